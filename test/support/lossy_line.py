# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Users of simulated lights over a faulty line, and whether the answers that they get are true."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass
import math
import random
from typing import Any

from illuminator_ros.illuminator.light import Light
from illuminator_ros.illuminator.simulated import SimulatedIlluminator
from illuminator_ros.illuminator.simulated_properties import (
    IlluminatorBehaviour,
    IlluminatorProperties,
)
from illuminator_ros.illuminator.thermal import ThermalProperties
from illuminator_ros.mavlink.dialect import mavlink
from illuminator_ros.mavlink.messages import Address, CommandAck
from illuminator_ros.simulation.simulated import Effect, SimulatedComponent
from support.back_to_back import Pair
from support.records import Answer
from support.wire import Faults

ON_OFF, CONFIGURE = mavlink.MAV_CMD_ILLUMINATOR_ON_OFF, mavlink.MAV_CMD_DO_ILLUMINATOR_CONFIGURE
COMMANDS = 400
# s; more than the longest delay of a line, plus the period of statuses.
QUIET = 6.0
# s; the longest wait until a restored configuration is sent again, and some more.
RESTORED = 70.0
# s by which a sending time that follows from an uptime may be wrong here.
UPTIME_ERROR = 0.05
CONFIRMED = 'confirmed'
# The answers that a user may get, and texts that they contain. Only CONFIRMED is a success.
OUTCOMES = {
    CONFIRMED: 'confirmed by ILLUMINATOR_STATUS',
    'not acknowledged': 'no acknowledgement',
    'contradicted': 'but ILLUMINATOR_STATUS shows',
    'no status': 'ILLUMINATOR_STATUS came within',
    'rare status': 'its next status is due within',
    'superseded': 'superseded by ',
    'fenced': 'an earlier command may still be under way',
    'restarted': 'not confirmed; the light restarted meanwhile',
    'refused': 'refused: MAV_RESULT_',
    'unfinished': 'not finished in time',
    'progress stopped': 'no final acknowledgement',
    'lost': 'is lost: no heartbeat for',
}
FAULTLESS = IlluminatorBehaviour()
Fields = Mapping[str, Any]


class Witness:
    """Keeps the states that one simulated light has been in, each with its beginning (s)."""

    def __init__(self, light: SimulatedComponent[SimulatedIlluminator], now: float) -> None:
        self._lamp = light.device
        self._apply, self._restart = light.apply, light.restart
        light.apply = self._watched_apply  # type: ignore[method-assign]
        light.restart = self._watched_restart  # type: ignore[method-assign]
        self._states: list[tuple[float, Fields]] = [(now, self._fields())]

    def _fields(self) -> Fields:
        return {'enabled': self._lamp.enabled, **asdict(self._lamp.configuration)}

    def _watched_apply(self, effect: Effect, now: float) -> None:
        self._apply(effect, now)
        self._note(now)

    def _watched_restart(self, now: float) -> None:
        self._restart(now)
        self._note(now)

    def _note(self, now: float) -> None:
        if (fields := self._fields()) != self._states[-1][1]:
            self._states.append((now, fields))

    def matches(self, values: Fields, since: float, until: float) -> list[bool]:
        """Return for each state between two times whether it had these values."""
        ends = [*(at for at, _ in self._states[1:]), math.inf]
        return [values.items() <= fields.items() for (at, fields), end in zip(
            self._states, ends, strict=True) if at <= until and end >= since]

    def is_as(self, light: Light, now: float) -> bool:
        """Return whether the bridge shows the present state."""
        fields, shown = self._states[-1][1], light.snapshot(now)
        return (shown.status is not None and shown.status.enabled == fields['enabled']
                and shown.configuration == self._lamp.configuration)


@dataclass
class Request:
    """A request to a light, and the values that it requests."""

    light: Light
    kind: int
    values: Fields
    answer: Answer

    @property
    def message(self) -> str:
        """Return the text of the answer."""
        return self.answer.result.message

    @property
    def outcome(self) -> str:
        """Return the key of :data:`OUTCOMES` of the answer, '' for another answer."""
        name = next((name for name, text in OUTCOMES.items() if text in self.message), '')
        return name if self.answer.result.success is (name == CONFIRMED) else ''

    def overlaps(self, other: Request) -> bool:
        """Return whether an acknowledgement may belong to either of two requests."""
        return (self is not other and (self.light, self.kind) == (other.light, other.kind)
                and other.answer.asked_at <= self.answer.ended_at
                and self.answer.asked_at <= other.answer.ended_at)


class User:
    """
    One user of one light, who sends a request, waits for the answer, and sends another one.

    :ivar due: when it acts next, or later if it still waits then.
    """

    def __init__(
        self, pair: Pair, light: Light, kind: int, draw: random.Random, impatience: float,
        levels: int,
    ) -> None:
        self.pair, self.light, self.kind, self.draw = pair, light, kind, draw
        self.due = pair.now + draw.uniform(0, 1)
        self.requests: list[Request] = []
        self._impatience = impatience
        self._levels = levels
        self._waits = True

    @property
    def idle(self) -> bool:
        """Whether it does not wait for an answer."""
        return not self.requests or not self._waits or bool(self.requests[-1].answer.results)

    def act(self) -> None:
        """Send a request."""
        if self.kind == ON_OFF:
            values: dict[str, Any] = {'enabled': self.draw.random() < 0.5}
            answer = self.pair.ask_enable(values['enabled'], self.light)
        else:
            values = {'brightness': float(self.draw.randrange(self._levels)),
                      'strobe_period': self.draw.choice((0.0, 0.5, 1.0, 2.0)),
                      'strobe_duty_cycle': float(self.draw.randrange(self._levels))}
            values = {name: values[name] for name in self.draw.sample(sorted(values), 2)}
            answer = self.pair.ask_configure(self.light, **values)
        self.requests.append(Request(self.light, self.kind, values, answer))
        self.due = self.pair.now + self.draw.choice((0.001, 0.1, 0.3))
        self._waits = self.draw.random() >= self._impatience


class Run:
    """
    Users of two lights over a line, until there are enough requests, all answered.

    :param there: the faults of the line towards the lights; ``back`` towards the bridge.
    :param impatience: the share of requests after which the user does not wait for the answer.
    :param levels: of brightness and duty cycle; with few of them requests are often equal.
    """

    def __init__(
        self, there: Faults, back: Faults, seed: str, *, commands: int = COMMANDS,
        behaviour: IlluminatorBehaviour = FAULTLESS, impatience: float = 0.0, levels: int = 101,
    ) -> None:
        # Disable heating, so that lights keep the commanded brightness.
        self.pair = pair = Pair(
            [IlluminatorProperties(address=Address(1, one), thermal=ThermalProperties(rise=0.0),
                                   behaviour=behaviour) for one in (243, 244)],
            there=there, back=back, seed=seed)
        self._witnesses = {light.address: Witness(light, pair.now) for light in pair.devices}
        lights = pair.controller.lights
        pair.run_until(lambda: len(lights) == len(pair.devices) and all(
            light.snapshot(0.0).configuration for light in lights.values()), within=600.0)
        draw = random.Random(seed)
        users = [User(pair, light, kind, draw, impatience, levels)
                 for kind in (ON_OFF, CONFIGURE) for light in lights.values()]
        while sum(len(user.requests) for user in users) < commands:
            for user in users:
                if user.due <= pair.now and user.idle:
                    user.act()
            pair.step(min((user.due for user in users if user.idle), default=math.inf))
        self.requests = [request for user in users for request in user.requests]
        pair.run_until(lambda: all(request.answer.results for request in self.requests))

    @property
    def outcomes(self) -> Counter[str]:
        """Return how often each of :data:`OUTCOMES` was the answer."""
        return Counter(request.outcome for request in self.requests)

    def untruths(self) -> Iterator[str]:
        """Mend the line, and yield each untruth in the answers and in the shown state."""
        for request in self.requests:
            if wrong := self._untruth(request):
                yield f'{wrong}: {request.light.address} {request.answer}'
        self.pair.mend()
        restarts = any(light.snapshot(self.pair.now).restarts
                       for light in self.pair.controller.lights.values())
        for device in self.pair.devices:
            device.behave(FAULTLESS, self.pair.now)
        self.pair.run(RESTORED if restarts else QUIET)
        for address, witness in self._witnesses.items():
            light = self.pair.controller.lights[address]
            if not witness.is_as(light, self.pair.now):
                yield f'{address} is shown in another state than it is in'
            if light.snapshot(self.pair.now).states_are_changing:
                yield f'{address} is taken for several lights'

    def _untruth(self, request: Request) -> str:
        """Return the untruth in the answer to a request, '' if it is true."""
        answer, outcome = request.answer, request.outcome
        others = [other for other in self.requests if request.overlaps(other)]
        # Equal requests share a command, which may have been sent for the first of them.
        sent_at = min((other.answer.asked_at for other in others if other.values == request.values
                       and other.answer.ended_at == answer.ended_at), default=answer.asked_at)
        sent_at = min(sent_at, answer.asked_at)
        matches = self._witnesses[request.light.address].matches(
            request.values,
            answer.asked_at if outcome == CONFIRMED else sent_at - UPTIME_ERROR, answer.ended_at)
        acks = [at for at, source, ack in self.pair.near.received
                if isinstance(ack, CommandAck) and ack.command == request.kind
                and ack.result == mavlink.MAV_RESULT_ACCEPTED and source == request.light.address
                and sent_at < at <= answer.ended_at]
        match outcome:
            case 'confirmed':
                # A refusal that may have answered an earlier command does not count.
                if not acks and 'MAV_RESULT_ACCEPTED' in request.message:
                    return 'not accepted'
                return '' if any(matches) else 'never done'
            case 'not acknowledged':
                return 'acknowledged' if acks and not others else ''
            case 'contradicted':
                shown = request.message.partition('shows ')[2]
                # A command carries all fields, and a late copy may have changed another one.
                is_other = request.kind == CONFIGURE and not any(
                    name in shown for name in request.values)
                return '' if acks and (is_other or not all(matches)) else 'always as wished'
            case 'refused':
                return 'done' if matches[-1] and not matches[0] and not others else ''
            case 'superseded':
                is_newer = any(other.answer.asked_at >= answer.asked_at
                               and other.values != request.values for other in others)
                # An OFF ends a configuration where a brightness may switch the light on.
                is_newer |= request.kind == CONFIGURE and request.message == 'superseded by off'
                return '' if is_newer else 'not superseded'
            case '':
                return 'an unknown outcome'
        return ''
