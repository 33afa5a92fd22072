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

"""
What a light is tested on: talks to it, and keeps all that was said. No I/O; time is passed in.

Checks are coroutines without an event loop: each waits for a condition or a time, and goes on
when a message or the time has come. So a run against a simulated light needs no real time.
"""

from __future__ import annotations

from collections.abc import Callable, Coroutine, Generator
from dataclasses import dataclass, field
import math
from typing import Any, TypeVar

from .describe import command_name, describe, status_text
from ..illuminator.model import Configuration, DIMMING_FLAGS, Mode, NOTHING, Status
from ..mavlink.dialect import (
    CommandAck,
    CommandInt,
    CommandLong,
    ComponentInformationBasic,
    Heartbeat,
    IlluminatorStatus,
    INFORMATION_ID,
    MavCmd,
    MavResult,
    MavType,
    result_name,
    Source,
    STATUS_ID,
)
from ..mavlink.endpoint import Endpoint
from ..mavlink.endpoint import Heartbeat as HeartbeatTimer

# s. The developer guide's own tests wait 3 s for an acknowledgement.
ACK_TIMEOUT = 3.0
PROGRESS_TIMEOUT = 4.0
# s after which a command that is still reported to be in progress is not waited for any more.
PROGRESS_LIMIT = 15.0
TRIES = 4
# s in which a message that was requested or a change that was accepted has to show.
SHOW_TIMEOUT = 1.0
# s; a second acknowledgement of one command would come this soon.
SETTLE = 0.05
# s in which a message to somebody else would be answered.
SILENCE = 0.7
# s without a message after which an unanswered command means that the light is gone.
GONE = 5.0
# Temporary rejections in a row that are put up with, and s between the tries.
REJECTIONS = 12
REJECTION_PAUSE = 0.3
# Lines of the exchange that are kept for one check.
MAX_LINES = 60
# The brightness at which a light may be switched on without asking, %.
LOW = 10.0
# The brightness that is not exceeded without asking, %.
DIM = 20.0

T = TypeVar('T')


# What is wrong, and the lines of the exchange that show it.
Finding = tuple[str, list[str]]


class LightGone(Exception):
    """The light has fallen silent."""


class Interrupted(BaseException):
    """The run is to end now."""


@dataclass
class _Wait:
    condition: Callable[[], Any]
    deadline: float

    def __await__(self) -> Generator[_Wait, None, None]:
        yield self


@dataclass
class Transaction:
    """
    One command and what it was answered with.

    :param sent: when, s, for each try.
    :param acks: what was acknowledged, and when.
    :param expected: whether it counts as a command that every light has to answer.
    :param not_shown: the fields in which the status does not show the change that was accepted.
    :param disagreement: what is wrong then, None if nothing is.
    """

    text: str
    command: int
    expected: bool = True
    sent: list[float] = field(default_factory=list)
    acks: list[tuple[float, Any]] = field(default_factory=list)
    lines: list[str] = field(default_factory=list)
    not_shown: list[str] = field(default_factory=list)
    disagreement: Finding | None = None

    @property
    def finals(self) -> list[tuple[float, Any]]:
        """Return the acknowledgements that are not reports of progress."""
        return [(at, ack) for at, ack in self.acks if ack.result != MavResult.IN_PROGRESS]

    @property
    def result(self) -> int | None:
        """Return the last result, None if there is none."""
        return self.finals[-1][1].result if self.finals else None

    @property
    def accepted(self) -> bool:
        """Whether the command was accepted."""
        return self.result == MavResult.ACCEPTED

    @property
    def answer(self) -> str:
        """Return the result, for people."""
        return 'no acknowledgement' if self.result is None else result_name(self.result)

    def finding(self, what: str = '') -> Finding:
        """Return what is wrong with the answer, and the lines that show it."""
        return f'{self.text}: {what or self.answer}', self.lines

    def unmet(self, *names: str) -> Finding | None:
        """
        Return why a change has not been made, None if it has, or no status says otherwise.

        :param names: the fields of the status that matter here.
        """
        if not self.accepted:
            return self.finding()
        return self.disagreement if set(names) & set(self.not_shown) else None


class Bench(Endpoint):
    """
    The tester's side.

    :param target: the light; None takes the first that is heard.
    :param consent: whether the light may strobe and shine at 100 %.
    :param heat: s at 100 % in which it may get hot.
    :param checksum_errors: returns how many frames had a wrong checksum.
    :param link_fault: returns why the link is not open, '' if it is.
    :ivar found: the light, once it is heard.
    :ivar rest: the statuses that came before anything was asked for.
    :ivar transactions: all commands, in order.
    :ivar disagreements: accepted changes that the status did not show.
    :ivar tidying: whether the light is being brought back to where it was.
    :ivar disobediences: refused changes after which the status was another.
    """

    def __init__(
        self, identity: Source, *, target: Source | None = None, consent: bool = True,
        heat: float = 5.0, checksum_errors: Callable[[], int] = lambda: 0,
        link_fault: Callable[[], str] = lambda: '',
    ) -> None:
        super().__init__()
        self.identity = identity
        self.consent = consent
        self.heat = heat
        self.checksum_errors = checksum_errors
        self.link_fault = link_fault
        self.found: Source | None = None
        self.now = 0.0
        self.heard: set[Source] = set()
        self.heartbeats: list[tuple[float, Any]] = []
        self.statuses: list[tuple[float, Status]] = []
        self.informations: list[Any] = []
        self.rest: list[tuple[float, Status]] = []
        self.transactions: list[Transaction] = []
        self.disagreements: list[Finding] = []
        self.disobediences: list[Finding] = []
        self.log: list[str] = []
        self.tidying = False
        self.target = target
        self._began: float | None = None
        self._last_heard = -math.inf
        self._latest: dict[int, Transaction] = {}
        self._beat = HeartbeatTimer(identity, MavType.GCS)
        self._open = False
        self._main: Coroutine[_Wait, None, None] | None = None
        self._wait: _Wait | None = None

    # The endpoint

    def run(self, main: Coroutine[Any, Any, None]) -> None:
        """Have a coroutine run from the next poll on."""
        self._main = main

    @property
    def running(self) -> bool:
        """Whether the coroutine has not ended."""
        return self._main is not None

    def link_opened(self, now: float) -> None:
        """See :meth:`Endpoint.link_opened`."""
        self._open = True
        self._beat.send(now, self.outgoing)

    def link_closed(self, now: float) -> None:
        """See :meth:`Endpoint.link_closed`."""
        self._open = False

    def receive(self, source: Source, message: Any, now: float) -> None:
        """See :meth:`Endpoint.receive`."""
        self._at(now)
        self.heard.add(source)
        if self.found is None and self._is_light(source, message):
            self.found = source
        if source == self.found:
            self._last_heard = now
            self.note('<', describe(message))
            self._take(message)
        self._advance()

    def _is_light(self, source: Source, message: Any) -> bool:
        if self.target is not None:
            return source == self.target
        return (isinstance(message, IlluminatorStatus)
                or isinstance(message, Heartbeat) and message.type == MavType.ILLUMINATOR)

    def _take(self, message: Any) -> None:
        if isinstance(message, Heartbeat):
            self.heartbeats.append((self.now, message))
        elif isinstance(message, IlluminatorStatus):
            self.statuses.append((self.now, Status.from_message(message)))
        elif isinstance(message, ComponentInformationBasic):
            self.informations.append(message)
        elif isinstance(message, CommandAck) and message.command in self._latest:
            transaction = self._latest[message.command]
            transaction.acks.append((self.now, message))
            transaction.lines.append(self.log[-1])

    def poll(self, now: float) -> None:
        """See :meth:`Endpoint.poll`."""
        self._at(now)
        if self._open:
            self._beat.poll(now, self.outgoing)
        self._advance()

    def next_deadline(self) -> float:
        """See :meth:`Endpoint.next_deadline`."""
        beat = self._beat.due if self._open else math.inf
        if self._main is None:
            return beat
        return min(beat, self._wait.deadline if self._wait else self.now)

    def interrupt(self, now: float) -> None:
        """End the run; what it tidies up then is not interrupted."""
        if self.tidying:
            return
        self._at(now)
        self._advance()
        if self._main is not None:
            self._step(lambda main: main.throw(Interrupted()))
            self._advance()

    def _at(self, now: float) -> None:
        self._began = now if self._began is None else self._began
        self.now = now

    def _advance(self) -> None:
        while self._main is not None and (
                self._wait is None or self.now >= self._wait.deadline or self._wait.condition()):
            self._step(lambda main: main.send(None))

    def _step(self, step: Callable[[Coroutine[_Wait, None, None]], _Wait]) -> None:
        assert self._main is not None
        try:
            self._wait = step(self._main)
        except (StopIteration, Interrupted):
            self._main = self._wait = None

    def note(self, direction: str, text: str) -> None:
        """Keep a line of the exchange."""
        self.log.append(f'{self.now - (self._began or 0.0):8.3f} s {direction} {text}')

    # What checks wait for

    async def until(self, condition: Callable[[], Any], timeout: float) -> bool:
        """Wait until something is so, s at most; return whether it is."""
        await _Wait(condition, self.now + timeout)
        return bool(condition())

    async def more(self, came: list[Any], before: int, timeout: float) -> bool:
        """Wait until there are more than there were before; return whether there are."""
        return await self.until(lambda: len(came) > before, timeout)

    async def sleep(self, seconds: float) -> None:
        """Let time pass."""
        await _Wait(lambda: False, self.now + seconds)

    # What checks do

    @property
    def light(self) -> Source:
        """Return the light's address."""
        assert self.found is not None
        return self.found

    async def command(
        self, command: int, *params: float, as_int: bool = False, confirmation: int = 0,
        target: Source | None = None,
    ) -> Transaction:
        """Send a command, again where it must be, and return what it was answered with."""
        for _ in range(REJECTIONS):
            one = self._begin(command, params)
            # Checks of their own see to these.
            one.expected = not as_int and target is None
            for number in range(TRIES):
                self._send(one, params, confirmation + number, as_int, target or self.light)
                if await self._answered(one):
                    break
                self._must_be_there()
            if one.result != MavResult.TEMPORARILY_REJECTED:
                break
            await self.sleep(REJECTION_PAUSE)
        return one

    async def overheard(self, target: Source, command: int, *params: float) -> Transaction:
        """Send a command to somebody else, and return what the light answers all the same."""
        one = self._begin(command, params)
        one.expected = False
        self._send(one, params, 0, False, target)
        await self.until(lambda: one.acks, SILENCE)
        await self.sleep(SETTLE)
        return one

    def _begin(self, command: int, params: tuple[float, ...]) -> Transaction:
        text = ' '.join([command_name(command), *(f'{param:g}' for param in params)])
        one = Transaction(text, command)
        self.transactions.append(one)
        self._latest[command] = one
        return one

    def _send(
        self, one: Transaction, params: tuple[float, ...], confirmation: int, as_int: bool,
        target: Source,
    ) -> None:
        values = [*map(float, params), *[0.0] * (7 - len(params))]
        message = (
            CommandInt(*target, 0, one.command, 0, 0, *values[:4], 0, 0, 0.0) if as_int
            else CommandLong(*target, one.command, min(confirmation, 255), *values))
        one.sent.append(self.now)
        self.outgoing.append((self.identity, message))
        self.note('>', describe(message))
        one.lines.append(self.log[-1])

    async def _answered(self, one: Transaction) -> bool:
        """Wait for the result of a try, as long as progress is reported."""
        timeout, until = ACK_TIMEOUT, self.now + PROGRESS_LIMIT
        while self.now < until:
            seen = len(one.acks)
            await self.more(one.acks, seen, timeout)
            if one.finals:
                break
            if len(one.acks) == seen:
                return False
            timeout = PROGRESS_TIMEOUT
        # Whatever else comes must not be taken for the answer to the next command.
        if len(one.sent) > 1:
            await self.until(lambda: len(one.finals) >= len(one.sent), ACK_TIMEOUT)
        await self.sleep(SETTLE)
        return True

    def _must_be_there(self) -> None:
        if self.now - self._last_heard > GONE:
            raise LightGone

    async def request(self, message_id: int, came: list[Any]) -> Any:
        """Request a message until it comes, and return it, None if it does not."""
        for _ in range(TRIES):
            before = len(came)
            one = await self.command(MavCmd.REQUEST_MESSAGE, message_id)
            if not one.accepted and one.result is not None:
                return None
            if await self.more(came, before, SHOW_TIMEOUT):
                return came[-1]
        return None

    async def status(self) -> Status | None:
        """Return what the light reports now, None if it does not."""
        came = await self.request(STATUS_ID, self.statuses)
        if came is None:
            # It may stream what it does not send on request.
            before = len(self.statuses)
            if await self.more(self.statuses, before, 2.5):
                came = self.statuses[-1]
        return came[1] if came else None

    async def information(self) -> Any:
        """Return the COMPONENT_INFORMATION_BASIC, None if there is none."""
        return await self.request(INFORMATION_ID, self.informations)

    async def switch(self, on: bool, *, as_int: bool = False, confirmation: int = 0
                     ) -> Transaction:
        """Switch the light and note whether it shows what it accepted."""
        one = await self.command(
            MavCmd.ILLUMINATOR_ON_OFF, float(on), as_int=as_int, confirmation=confirmation)
        await self._agree(one, lambda status: [] if status.enabled == on else ['enable'])
        return one

    async def configure(
        self, mode: int = Mode.INTERNAL_CONTROL, brightness: float = LOW, period: float = 0.0,
        duty: float = 0.0,
    ) -> Transaction:
        """Configure the light and note whether it shows what it accepted."""
        asked = Configuration(Mode(mode), brightness, period, duty)
        one = await self.command(MavCmd.DO_ILLUMINATOR_CONFIGURE, mode, brightness, period, duty)
        await self._agree(one, lambda status: differences(asked, status))
        return one

    async def _agree(self, one: Transaction, differ: Callable[[Status], list[str]]) -> None:
        if not one.accepted:
            return
        begun, since = len(self.log), self.now
        while True:
            status = await self.status()
            if status is None or not differ(status):
                return
            if self.now - since >= SHOW_TIMEOUT:
                break
            await self.sleep(0.1)
        one.not_shown = differ(status)
        one.disagreement = (
            f'{one.text}: {one.answer}, but then the status differs in '
            f'{" and ".join(one.not_shown)}: {status_text(status)}',
            one.lines + self.log[begun:][-2:])
        self.disagreements.append(one.disagreement)

    async def refused(self, command: int, params: tuple[float, ...]) -> Finding | None:
        """Send what has to be denied; return what is wrong with the answer, None if nothing."""
        before = await self.status()
        one = await self.command(command, *params)
        after = await self.status()
        restarted = before and after and after.uptime_ms < before.uptime_ms
        if before and after and not (one.accepted or restarted or same(before, after)):
            self.disobediences.append((
                f'{one.text}: {one.answer}, and then {status_text(after)}', one.lines))
        if one.result == MavResult.DENIED:
            return None
        if one.accepted:
            await self.baseline()
        return one.finding()

    async def baseline(self) -> None:
        """Bring the light to where checks begin: off, at low brightness, without strobe."""
        status = await self.status()
        low = Configuration(Mode.INTERNAL_CONTROL, LOW, 0.0, 0.0)
        if status is None or status.enabled is not False:
            await self.command(MavCmd.ILLUMINATOR_ON_OFF, 0.0)
            status = await self.status()
        if status is None or differences(low, status):
            await self.command(MavCmd.DO_ILLUMINATOR_CONFIGURE, *low.params())
            status = await self.status()
        if status is not None and status.enabled:
            # Where brightness and switch are one.
            await self.command(MavCmd.ILLUMINATOR_ON_OFF, 0.0)

    async def watch(self, seconds: float) -> list[tuple[float, Status]]:
        """Return the statuses that come in a time."""
        before = len(self.statuses)
        await self.sleep(seconds)
        return self.statuses[before:]


def differences(asked: Configuration, status: Status) -> list[str]:
    """Return the fields in which a status does not show what was asked for."""
    if not status.complete:
        return [text.split()[0] for text in status.invalid]
    shown = status.configuration(NOTHING)
    names = asked.differences(shown)
    if status.error_flags & DIMMING_FLAGS and shown.brightness < asked.brightness:
        names = [name for name in names if name != 'brightness']
    return names


def same(one: Status, other: Status) -> bool:
    """Return whether two statuses show the same switch and configuration."""
    if one.enabled != other.enabled or one.complete != other.complete:
        return False
    if not one.complete:
        return one.invalid == other.invalid
    first, second = one.configuration(NOTHING), other.configuration(NOTHING)
    names = first.differences(second)
    return not [name for name in names if name != 'brightness' or not (
        (one.error_flags | other.error_flags) & DIMMING_FLAGS)]


def periods(times: list[float]) -> list[float]:
    """Return the differences of consecutive times."""
    return [later - earlier for earlier, later in zip(times, times[1:], strict=False)]


def median(values: list[float]) -> float:
    """Return the middle one."""
    return sorted(values)[len(values) // 2]
