# Copyright 2026 The illuminator_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.

"""Thousands of commands over lines that lose, repeat, reorder, delay and corrupt frames."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
import itertools
import math
import random
from typing import Any

from illuminator_ros.illuminator.light import Light
from illuminator_ros.illuminator.simulated import SimulatedIlluminator
from illuminator_ros.illuminator.simulated_properties import IlluminatorProperties
from illuminator_ros.illuminator.thermal import ThermalProperties
from illuminator_ros.mavlink.messages import Address, CommandAck, MavCmd, MavResult
from illuminator_ros.payload.simulated import SimulatedComponent
import pytest
from support.back_to_back import Pair
from support.faulty_wire import Faults
from support.records import Answer

ON_OFF, CONFIGURE = MavCmd.ILLUMINATOR_ON_OFF, MavCmd.DO_ILLUMINATOR_CONFIGURE
KINDS = ('drop', 'duplicate', 'reorder', 'delay', 'corrupt')
COMMANDS = 400
# s; more than the longest delay of the line.
QUIET = 3.0
# s by which a sending time that is told from an uptime may be wrong here.
UPTIME_ERROR = 0.05
# Lights that stay as bright as they are told: what heat does is another test's subject.
LIGHTS = [IlluminatorProperties(address=Address(1, one), thermal=ThermalProperties(rise=0.0))
          for one in (243, 244)]
# Faults of the line by name, towards the lights and back.
LINES: dict[str, tuple[tuple[str, ...], tuple[str, ...]]] = {
    **{kind: ((kind,), (kind,)) for kind in KINDS},
    'all of these': (KINDS, KINDS),
    'drop, to the lights': (('drop',), ()),
    'delay, from the lights': ((), ('delay',)),
}
Fields = Mapping[str, Any]


class Witness:
    """Keeps the states that one simulated light has been in, each with its beginning (s)."""

    def __init__(self, light: SimulatedComponent[SimulatedIlluminator], now: float) -> None:
        self._lamp = light.device
        self._receive = light.receive
        light.receive = self._watched  # type: ignore[method-assign]
        self._states: list[tuple[float, Fields]] = [(now, self._fields())]

    def _fields(self) -> Fields:
        return {'enabled': self._lamp.enabled, **asdict(self._lamp.configuration)}

    def _watched(self, source: Address, message: Any, now: float) -> None:
        self._receive(source, message, now)
        if (fields := self._fields()) != self._states[-1][1]:
            self._states.append((now, fields))

    def matches(self, wish: Fields, since: float, until: float) -> list[bool]:
        """Return for each state between two times whether it was as wished."""
        ends = [*(at for at, _ in self._states[1:]), math.inf]
        return [wish.items() <= fields.items() for (at, fields), end in zip(
            self._states, ends, strict=True) if at <= until and end >= since]


@dataclass
class Request:
    """A request to a light, and the wish with which it was made."""

    light: Light
    kind: MavCmd
    wish: Fields
    answer: Answer


class User:
    """
    One user of one light: asks for something, waits for the answer, and asks again.

    :ivar due: when it does the next thing, or later if it is still waiting then.
    """

    def __init__(self, pair: Pair, light: Light, kind: MavCmd, draw: random.Random) -> None:
        self.pair, self.light, self.kind, self.draw = pair, light, kind, draw
        self.due = pair.now + draw.uniform(0, 1)
        self.requests: list[Request] = []

    @property
    def idle(self) -> bool:
        """Whether all its requests are answered."""
        return not self.requests or bool(self.requests[-1].answer.results)

    def act(self) -> None:
        """Ask for something."""
        if self.kind == ON_OFF:
            wish: dict[str, Any] = {'enabled': self.draw.random() < 0.5}
            answer = self.pair.ask_enable(wish['enabled'], self.light)
        else:
            values = {'brightness': float(self.draw.randrange(101)),
                      'strobe_period': self.draw.choice((0.0, 0.5, 1.0, 2.0)),
                      'strobe_duty_cycle': float(self.draw.randrange(101))}
            wish = {name: values[name] for name in self.draw.sample(sorted(values), 2)}
            answer = self.pair.ask_configure(self.light, **wish)
        self.requests.append(Request(self.light, self.kind, wish, answer))
        self.due = self.pair.now + self.draw.choice((0.001, 0.1, 0.3))


def play(line: str, share: float) -> tuple[Pair, list[Request], dict[Address, Witness]]:
    """Use lights over a line until there are enough requests, all answered."""
    there, back = (Faults(**dict.fromkeys(kinds, share)) for kinds in LINES[line])
    pair = Pair(LIGHTS, there=there, back=back, seed=f'{line} {share}')
    witnesses = {light.address: Witness(light, pair.now) for light in pair.devices}
    lights = pair.controller.lights
    pair.run_until(lambda: len(lights) == len(LIGHTS)
                   and all(light.snapshot(0.0).configuration for light in lights.values()))
    draw = random.Random(f'{line} {share}')
    users = [User(pair, light, kind, draw)
             for kind in (ON_OFF, CONFIGURE) for light in lights.values()]
    while sum(len(user.requests) for user in users) < COMMANDS:
        for user in users:
            if user.due <= pair.now and user.idle:
                user.act()
        pair.step(min((user.due for user in users if user.idle), default=math.inf))
    requests = [request for user in users for request in user.requests]
    pair.run_until(lambda: all(request.answer.results for request in requests))
    return pair, requests, witnesses


def untruth(pair: Pair, witness: Witness, request: Request) -> str:
    """Return what is not true in the answer to a request, '' if all is."""
    answer = request.answer
    accepted = any(
        ack.result == MavResult.ACCEPTED for at, source, ack in pair.near.received
        if isinstance(ack, CommandAck) and ack.command == request.kind
        and source == request.light.address and answer.asked_at < at <= answer.ended_at)
    matches = witness.matches(
        request.wish, answer.asked_at - UPTIME_ERROR * (not answer.result.success),
        answer.ended_at)
    message = answer.result.message
    if len(answer.results) != 1:
        return f'{len(answer.results)} outcomes'
    if answer.result.success:
        return '' if accepted and any(matches) else 'not accepted, or never done'
    if 'no acknowledgement' in message:
        return 'acknowledged' if accepted else ''
    if 'but ILLUMINATOR_STATUS shows' in message:
        return '' if accepted and not all(matches) else 'not accepted, or as wished all the time'
    known = ('ILLUMINATOR_STATUS came within', 'may belong to an earlier command',
             'is lost: no heartbeat for')
    return '' if any(text in message for text in known) else 'an unknown outcome'


@pytest.mark.parametrize(('line', 'share'), [
    ('drop', 0.0), *itertools.product(LINES, (0.1, 0.3, 0.5))])
def test_every_command_has_one_outcome_and_it_is_true(line: str, share: float) -> None:
    pair, requests, witnesses = play(line, share)
    assert [f'{wrong}: {one}' for one in requests
            if (wrong := untruth(pair, witnesses[one.light.address], one))] == []
    confirmed = [one.answer.result.success for one in requests].count(True) / len(requests)
    print(f'{line} {share:.0%}: {confirmed:.1%} confirmed')
    assert share or confirmed == 1.0
    pair.mend()
    pair.run(QUIET)
    for simulated in pair.devices:
        light = pair.controller.lights[simulated.address]
        assert light.snapshot(pair.now).configuration == simulated.device.configuration
        assert light.status is not None
        assert light.status.enabled == simulated.device.enabled
        assert 'restarted' not in pair.recorders[simulated.address].events
        assert not light.snapshot(pair.now).shared_address


def test_the_same_seed_gives_the_same_answers() -> None:
    first, second = ([one.answer.result.message for one in play('all of these', 0.3)[1]]
                     for _ in range(2))
    assert first == second
