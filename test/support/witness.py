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

"""The real states of simulated lights, and whether the reports of the client are true."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
import re
from typing import Any

from illuminator_ros.illuminator.light import Light
from illuminator_ros.illuminator.messages import IlluminatorStatus
from illuminator_ros.illuminator.model import Mode
from illuminator_ros.illuminator.simulated import SimulatedIlluminator
from illuminator_ros.mavlink.messages import (
    Address,
    CommandAck,
    Heartbeat,
    MavCmd,
    MavResult,
)
from illuminator_ros.payload.simulated import SimulatedComponent, SimulatedComponents
from support.back_to_back import Pair, START
from support.records import Answer

ON_OFF, CONFIGURE = MavCmd.ILLUMINATOR_ON_OFF, MavCmd.DO_ILLUMINATOR_CONFIGURE
TRIES = re.compile(r'\((\d+) (?:try|tries), ')
# s by which a sending time that is told from an uptime may be wrong here.
UPTIME_ERROR = 0.05

Fields = Mapping[str, Any]


@dataclass
class State:
    """The state of a light during an interval, s."""

    since: float
    until: float
    fields: Fields

    def matches(self, wish: Fields) -> bool:
        """Return whether the light was as wished."""
        return all(self.fields[name] == value for name, value in wish.items())


class Witness:
    """Keeps the states that one simulated light has been in."""

    def __init__(self, light: SimulatedComponent[SimulatedIlluminator], now: float) -> None:
        self.lamp = light.device
        self._receive = light.receive
        light.receive = self._watched  # type: ignore[method-assign]
        self._states = [State(now, now, self._fields())]

    def _fields(self) -> Fields:
        configuration = self.lamp.configuration
        return {'enabled': self.lamp.enabled, 'mode': configuration.mode,
                'brightness': configuration.brightness,
                'strobe_period': configuration.strobe_period,
                'strobe_duty_cycle': configuration.strobe_duty_cycle}

    def _watched(self, source: Address, message: Any, now: float) -> None:
        self._receive(source, message, now)
        fields = self._fields()
        if fields != self._states[-1].fields:
            self._states[-1].until = now
            self._states.append(State(now, now, fields))

    def states(self, since: float, until: float) -> list[State]:
        """Return the states between two times (s)."""
        self._states[-1].until = max(until, self._states[-1].until)
        return [state for state in self._states if state.until >= since and state.since <= until]


@dataclass
class Request:
    """
    A request to a light.

    :param wish: what the light is to become, by the names of :class:`Witness`.
    """

    light: Light
    kind: MavCmd
    wish: Fields
    answer: Answer

    @property
    def message(self) -> str:
        """Return what the answer says."""
        return self.answer.result.message


def asked_for(sent: Any) -> dict[str, Any]:
    """Return the fields that a command sets, by the names of :class:`Witness`."""
    if sent.command == ON_OFF:
        return {'enabled': bool(sent.param1)}
    return {'mode': Mode(int(sent.param1)), 'brightness': sent.param2,
            'strobe_period': sent.param3, 'strobe_duty_cycle': sent.param4}


class Judge:
    """Compares answers with what went over the line and what the lights did."""

    def __init__(self, pair: Pair) -> None:
        assert isinstance(pair.other, SimulatedComponents)
        self._pair = pair
        self._witnesses = {light.address: Witness(light, pair.now)
                           for light in pair.other.components}

    def judge(self, request: Request) -> tuple[str, str]:
        """Return how a request has ended, and what is not true in that, '' if all is."""
        results = request.answer.results
        if len(results) != 1:
            return 'broken', f'{len(results)} outcomes: {request}'
        sign = next((sign for sign in _CHECKS if sign in request.message), None)
        if sign is None:
            return 'broken', f'an unknown outcome: {request.message!r}'
        kind, success, check = _CHECKS[sign]
        wrong = check(self, request)
        if success is not results[0].success:
            wrong = f'success is {results[0].success}'
        return kind, wrong and f'{wrong}: {request.light.address} {request.answer}'

    def _tries(self, request: Request) -> list[tuple[float, Any]]:
        """Return when the command was sent, and the messages; as often as the answer says."""
        groups: list[list[tuple[float, Any]]] = []
        for at, sent in self._pair.commands_to(request.light.address, request.kind):
            if at <= request.answer.ended_at:
                groups = groups if sent.confirmation else [*groups, []]
                groups[-1].append((at, sent))
        match = TRIES.search(request.message)
        assert match is not None, request
        # A command sent at the very end may be the next one, or the last repeat of this one.
        return max((group for group in groups if len(group) == int(match[1])), key=lambda group: (
            group[0][0] >= request.answer.asked_at
            and request.wish.items() <= asked_for(group[0][1]).items(),
            group[0][0] < request.answer.ended_at, group[0][0]))

    def _states(self, request: Request, error: float = 0.0) -> tuple[Fields, list[State]]:
        """Return the sent values, and the states of the light since, or by so much earlier."""
        (since, sent), *_ = self._tries(request)
        witness = self._witnesses[request.light.address]
        return asked_for(sent), witness.states(since - error, request.answer.ended_at)

    def _received(self, request: Request, kind: type, since: float) -> list[tuple[float, Any]]:
        return [(at, message) for at, source, message in self._pair.near.received
                if source == request.light.address and isinstance(message, kind)
                and since < at <= request.answer.ended_at]

    def _acks(self, request: Request) -> list[tuple[float, Any]]:
        since = self._tries(request)[0][0]
        return [(at, ack) for at, ack in self._received(request, CommandAck, since)
                if ack.command == request.kind and ack.result == MavResult.ACCEPTED]

    def _accepted(self, request: Request) -> bool:
        # A command that is sent again may be acknowledged in the same moment.
        return any(ack.command == request.kind and ack.result == MavResult.ACCEPTED
                   for _, ack in self._received(
                       request, CommandAck, self._tries(request)[0][0] - 1e-6))

    def _doubtful(self, request: Request) -> str:
        return '' if self._received(
            request, CommandAck, request.answer.asked_at) else 'not acknowledged'

    def _confirmed(self, request: Request) -> str:
        if not self._accepted(request):
            return 'not accepted'
        wish, states = self._states(request)
        return '' if any(state.matches(wish) for state in states) else 'never done'

    def _not_acknowledged(self, request: Request) -> str:
        return 'acknowledged' if self._acks(request) else ''

    def _not_shown(self, request: Request) -> str:
        if not self._accepted(request):
            return 'not accepted'
        wish, states = self._states(request, UPTIME_ERROR)
        return 'as wished all the time' if all(s.matches(wish) for s in states) else ''

    def _no_status(self, request: Request) -> str:
        if not self._accepted(request):
            return 'not accepted'
        acks = self._acks(request) or [(self._tries(request)[0][0], None)]
        sent_at, newest = self._tries(request)[0][0], 0
        boot = START - self._witnesses[request.light.address].lamp.uptime_ms(START) / 1000
        for at, status in self._received(request, IlluminatorStatus, 0.0):
            if status.uptime_ms >= newest:
                newest = status.uptime_ms
                if at > acks[0][0] and boot + newest / 1000 > sent_at + UPTIME_ERROR:
                    return 'a later status came'
        return ''

    def _not_sent(self, request: Request) -> str:
        # Whatever was sent meanwhile was another command.
        return 'sent' if TRIES.search(request.message) else ''

    def _overtaken(self, request: Request) -> str:
        off = [at for at, sent in self._pair.commands_to(request.light.address, ON_OFF)
               if not sent.param1 and request.answer.asked_at <= at <= request.answer.ended_at]
        return '' if request.wish == {'enabled': True} and off else 'not overtaken'

    def _lost(self, request: Request) -> str:
        since = request.answer.ended_at - request.light.settings.heartbeat_timeout + 1e-6
        heard = (self._received(request, Heartbeat, since)
                 or self._received(request, IlluminatorStatus, since))
        return 'heard' if heard else ''


# An answer: the kind of outcome, whether it is a success, whether it is true.
_CHECKS: dict[str, tuple[str, bool, Callable[[Judge, Request], str]]] = {
    'confirmed by ILLUMINATOR_STATUS': ('confirmed', True, Judge._confirmed),
    'may be that of an earlier command': ('doubtful', False, Judge._doubtful),
    'no acknowledgement': ('no acknowledgement', False, Judge._not_acknowledged),
    'but ILLUMINATOR_STATUS shows': ('not shown', False, Judge._not_shown),
    'ILLUMINATOR_STATUS came within': ('no status', False, Judge._no_status),
    'not sent: earlier requests took too long': ('not sent', False, Judge._not_sent),
    'cancelled by a later request': ('overtaken', False, Judge._overtaken),
    'is lost: no heartbeat for': ('light lost', False, Judge._lost),
}
