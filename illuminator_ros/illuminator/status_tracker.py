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

"""Statuses in time: restarts of a light, late frames, several lights at one address."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
import math
import operator

from .model import DIMMING_FLAGS, Mode, NOTHING, Status, StrobeRange, unexpected_differences
from ..mavlink.dialect import mavlink
from ..payload.attempt import StatusReport

WRAP_MS = 1 << 32
# s without progress after which a light has no clock.
NO_CLOCK_TIME = 2.0
# By how much a running light's uptime may lag behind our clock: s, and a share of the time.
MAX_LAG = 0.5
DRIFT = 0.05
# s by which a light may seem to have started before its last status came, since that was late.
BOOT_SLACK = 0.05
# s; a frame is not delayed by more.
MAX_DELAY = 30.0
# The same as BOOT_SLACK where a second status proves the restart, s.
PROVED_BOOT_SLACK = 2.0
# s between the two statuses that prove a restart, and by how much their clocks may differ.
RESTART_PROOF_TIME = 0.1
RESTART_PROOF_ERROR = 0.05
# s for which an ON waits for the statuses that show whether the light has restarted: long enough
# for two of a light that sends one each second and none on request.
RESTART_CHECK_TIME = 2.5
# The same as RESTART_PROOF_TIME where the light seems to have started before its last status.
CLOCK_JUMP_PROOF_TIME = 5.0
# s for which a status is compared with later ones. With an oscillator without a crystal, whose
# error is 2 %, the second status after a change confirms it.
COMPARED_TIME = 8.0
# s; a clock that counts in larger steps does not distinguish statuses that follow one another.
MAX_STEP = 0.02
RESOLUTION = 0.001


def uptime_difference(new_ms: int, old_ms: int) -> int:
    """Return the time from one uptime to another, ms, where the counter may have wrapped."""
    return (new_ms - old_ms + WRAP_MS // 2) % WRAP_MS - WRAP_MS // 2


class Uptime(Enum):
    """The meaning of an uptime compared with those before."""

    RUNNING = 'running'
    RESTARTED = 'restarted'
    LATE = 'late'


class UptimeClock:
    """
    Determines from uptimes whether a light has restarted, or whether a frame is late.

    A delayed frame has a lower uptime, too. So a second status must prove a restart: its uptime
    has advanced from the first uptime by the time that has passed. A status that lags by more than
    :data:`MAX_DELAY` needs no proof.

    :ivar is_suspecting: whether another status must show whether the light has restarted.
    """

    def __init__(self) -> None:
        self.is_suspecting = False
        self._has_clock = False
        self._last: tuple[int, float] | None = None
        self._suspect: tuple[int, float] | None = None
        self._suspecting_since = math.inf

    def take(self, uptime_ms: int, now: float, *, was_lost: bool = False) -> Uptime:
        """
        Return the meaning of an uptime; times are s.

        :param was_lost: whether the light was lost since the newest status.
        """
        meaning = Uptime.RUNNING
        if self._last is not None:
            self._has_clock |= uptime_ms != self._last[0]
            meaning = self._compare(uptime_ms, now, *self._last, was_lost)
        if meaning is not Uptime.LATE:
            self._last = uptime_ms, now
            self._suspect = None
            self._suspecting_since = math.inf
            self.is_suspecting = False
        return meaning

    def _compare(
        self, uptime_ms: int, now: float, last_ms: int, last_at: float, was_lost: bool,
    ) -> Uptime:
        elapsed = now - last_at
        if uptime_ms == last_ms:
            # A repeated status, two statuses within a millisecond, or a light without a clock.
            is_same = self._has_clock and elapsed < NO_CLOCK_TIME
            return Uptime.RESTARTED if was_lost and not is_same else Uptime.RUNNING
        ahead_ms = uptime_difference(uptime_ms, last_ms)
        has_progressed = ahead_ms >= 0
        lag = elapsed - ahead_ms / 1000
        may_have_restarted = uptime_ms <= 1000 * (elapsed + BOOT_SLACK)
        # A light that was lost may have restarted long before it is heard again.
        allowed = BOOT_SLACK if was_lost else MAX_LAG + DRIFT * elapsed
        # A line that stalled until the light was lost may deliver statuses from before a restart.
        may_be_old = was_lost and lag > MAX_LAG + DRIFT * elapsed
        if has_progressed and not (may_have_restarted and lag > allowed or may_be_old):
            return Uptime.RUNNING
        if not has_progressed and may_have_restarted and lag > MAX_DELAY:
            return Uptime.RESTARTED
        may_have_restarted = uptime_ms <= 1000 * (elapsed + PROVED_BOOT_SLACK)
        self.is_suspecting = may_have_restarted or may_be_old or lag > MAX_DELAY
        if self._suspect is not None:
            suspect_ms, suspect_at = self._suspect
            waited = now - suspect_at
            error = abs(uptime_difference(uptime_ms, suspect_ms) / 1000 - waited)
            if error <= RESTART_PROOF_ERROR + DRIFT * waited:
                if has_progressed and not may_have_restarted and waited >= RESTART_PROOF_TIME:
                    return Uptime.RUNNING
                is_proof = (waited >= RESTART_PROOF_TIME if may_have_restarted
                            else lag > MAX_DELAY and waited >= CLOCK_JUMP_PROOF_TIME)
                return Uptime.RESTARTED if is_proof else Uptime.LATE
        self._suspecting_since = min(self._suspecting_since, now)
        if (has_progressed and not may_have_restarted
                and now >= self._suspecting_since + CLOCK_JUMP_PROOF_TIME):
            # The line has delivered what it held back; the light's clock is wrong.
            return Uptime.RUNNING
        self._suspect = uptime_ms, now
        return Uptime.LATE


class SendingTimes:
    """
    Computes from the uptimes the latest time at which each status can have been sent.

    The uptime of a delayed frame lags behind those of quicker frames, which give the difference
    between the clocks. The light's clock is taken to be exact, since an allowance would make
    delayed statuses look new. The statuses of a slow clock look old instead, by at most its error
    times :data:`COMPARED_TIME`.
    """

    def __init__(self) -> None:
        self._last: Status | None = None
        self._last_at = -math.inf
        # ms since the first status, without wraps.
        self._running_ms = 0
        # The uptimes differ by multiples of this, 0 means no clock; and whether different statuses
        # had the same uptime, so that this is the step of the clock and not just the interval of
        # the statuses.
        self._step_ms = 0
        self._has_repeated = False
        # The least difference between our clock and the uptime, s, in this half of COMPARED_TIME
        # and in the half before, and the end of this half.
        self._least = self._least_before = math.inf
        self._half_ends = -math.inf

    def take(self, status: Status, now: float) -> tuple[float, bool]:
        """
        Return the latest time at which a status that has just come can have been sent, s.

        The second value is whether the uptimes show that. Where the light has no clock, or another
        status to compare is missing, the status counts as sent when it came.
        """
        if self._last is not None:
            ahead_ms = uptime_difference(status.uptime_ms, self._last.uptime_ms)
            self._running_ms += ahead_ms
            self._has_repeated |= not ahead_ms and status != self._last
            self._step_ms = math.gcd(self._step_ms, ahead_ms)
        if now >= self._half_ends:
            is_comparable = now < self._last_at + COMPARED_TIME
            self._least_before = self._least if is_comparable else math.inf
            self._least, self._half_ends = math.inf, now + COMPARED_TIME / 2
        known = min(self._least, self._least_before)
        running, step = self._running_ms / 1000, self._step_ms / 1000
        self._least = min(self._least, now - running)
        # A status with the uptime of the last one was sent before the last one came.
        is_equal = self._last is not None and status.uptime_ms == self._last.uptime_ms
        latest = math.nextafter(self._last_at, 0.0) if is_equal and step <= MAX_STEP else now
        self._last, self._last_at = status, self._last_at if is_equal else now
        if not step or known == math.inf:
            return now, False
        if step > MAX_STEP and not self._has_repeated:
            step = RESOLUTION
        return min(latest, running + known + step), step <= MAX_STEP


# Returns to an earlier state that prove several lights: the sixth status of A B A B A B is the
# fourth return. Another sender that switches a light on, off and on again causes one.
ENOUGH_EVIDENCE = 4
# Evidence does not grow beyond this, so that the verdict ends soon after the contradiction does.
MAX_EVIDENCE = 6
# Evidence that a status removes if it agrees with its predecessor. One status in ten of two lights
# may get lost; flashing one light may make each third status differ.
REPEAT_PENALTY = 2
# How many statuses are remembered, and how many states, one for each light.
MAX_RECENT = 8
MAX_STATES = 4
# s; starting times that differ by this are those of two lights: the delay of a line varies by
# less.
CLOCK_STEP = 1.5
# s for which a light counts after its last status.
SENDER_TIME = 10.0
# Returns to a starting time that prove a light.
ENOUGH_RETURNS = 2


@dataclass
class _Sender:
    """
    A light, identified by a value that its statuses share.

    :param value: a sender number, or a starting time.
    :param returns: how often statuses have returned to the value.
    """

    value: float
    seen_at: float
    returns: int = 0


class _Senders:
    """
    Lights that a value distinguishes; a light is proved when statuses return to its value.

    :param is_same: whether two values are those of one light.
    """

    def __init__(self, is_same: Callable[[float, float], bool]) -> None:
        self._is_same = is_same
        self._senders: list[_Sender] = []
        self._newest: _Sender | None = None

    def take(self, value: float, now: float) -> None:
        """Take the value of a status."""
        if len(self._senders) > 1:
            self._senders = [one for one in self._senders if now - one.seen_at <= SENDER_TIME]
        for one in self._senders:
            if self._is_same(value, one.value):
                one.returns += one is not self._newest
                break
        else:
            one = _Sender(value, now)
            self._senders = [*self._senders[1 - MAX_STATES:], one]
        one.seen_at, one.value = now, value
        self._newest = one

    def are_several(self, now: float) -> bool:
        """Return whether several lights have sent lately."""
        return len(self._senders) > 1 and sum(
            one.returns >= ENOUGH_RETURNS and now - one.seen_at <= SENDER_TIME
            for one in self._senders) > 1


def _is_same_start(start: float, other: float) -> bool:
    difference = (start - other + WRAP_MS / 2) % WRAP_MS - WRAP_MS / 2
    return abs(difference) < CLOCK_STEP * 1000.0


class AddressConflict:
    """
    Determines whether several lights send from one address.

    ILLUMINATOR_STATUS does not say which light it is of: ArduSub sends one for each of its
    lights from the autopilot's address, and two lights may have been given the same ids. Lights
    are distinguished by their alternating states, by their start times, and by their sequence
    numbers. Lights of one component with the same state and start time cannot be distinguished.

    :ivar detected: whether several lights send.
    :ivar can_follow: whether the newest status can be followed: it does not go back to a state
        shown before, or it has been repeated.
    """

    def __init__(self) -> None:
        self.detected = False
        self.can_follow = True
        self._evidence = 0
        # The last one is at the end.
        self._states: list[Status] = []
        self._by_start = _Senders(_is_same_start)
        self._by_number = _Senders(operator.eq)
        self._recent: list[Status] = []

    def take(self, status: Status, now: float, *, commanded: bool, sender: int = 0) -> None:
        """
        Take a status, even a late one.

        :param sender: of the message.
        :param commanded: whether a command of ours may have changed the light.
        """
        uptime = status.uptime_ms
        has_clock = any(one.uptime_ms != uptime for one in self._recent)
        if has_clock and status in self._recent:
            # The same frame by another route, on which its sequence number may lag far behind.
            return
        if has_clock or not self._recent:
            self._by_start.take(now * 1000.0 - uptime, now)
        self._by_number.take(sender, now)
        self._recent = [*self._recent[1 - MAX_RECENT:], status]
        if not commanded:
            repeated = self._take_state(status)
            self.can_follow = repeated or not self._evidence
        elif not self.detected:
            # Changes by our own commands are not evidence.
            self._states.clear()
            self._evidence = 0
            self.can_follow = True
        self.detected = (self._evidence >= (1 if self.detected else ENOUGH_EVIDENCE)
                         or self._by_start.are_several(now) or self._by_number.are_several(now))

    def _take_state(self, status: Status) -> bool:
        """Return whether a status repeats the last state."""
        for index, state in enumerate(reversed(self._states)):
            if _same_state(state, status):
                self._evidence += 1 if index else -REPEAT_PENALTY
                self._evidence = min(max(self._evidence, 0), MAX_EVIDENCE)
                del self._states[-1 - index]
                self._states.append(status)
                return not index
        self._states = [*self._states[1 - MAX_STATES:], status]
        return len(self._states) == 1


def _same_state(one: Status, other: Status) -> bool:
    """Return whether a light may show both without having been changed."""
    if _shown(one) == _shown(other):
        return True
    if one.mode is other.mode is Mode.EXTERNAL_SYNC:
        # Its output follows another signal.
        return True
    hot = (one.error_flags | other.error_flags) & DIMMING_FLAGS
    if not hot and None not in (one.enabled, other.enabled) and one.enabled != other.enabled:
        return False
    if not one.complete or not other.complete:
        return True
    first, second = one.configuration(NOTHING), other.configuration(NOTHING)
    names = unexpected_differences(first, second, 0, step=True)
    return not [name for name in names if not (hot and name == 'brightness')]


def _shown(status: Status) -> tuple[object, ...]:
    return (status.enabled, status.mode, status.brightness, status.strobe_period,
            status.strobe_duty_cycle)


@dataclass
class NewestStatus:
    """
    The newest status of a light, which its switch and its configuration read.

    :param report: None before the first.
    :param at: when it came, s.
    :param measures_temperature: whether a temperature other than 0 was ever reported.
    """

    report: StatusReport[Status] | None = None
    at: float = -math.inf
    measures_temperature: bool = False

    def take(self, report: StatusReport[Status], now: float) -> None:
        """Take a status."""
        self.report, self.at = report, now
        # Lights that do not measure send 0 (ArduSub), and a sensor rarely reads exactly 0.
        self.measures_temperature |= bool(report.status.temperature)

    @property
    def status(self) -> Status | None:
        """Return the status, None before the first."""
        return self.report.status if self.report else None

    @property
    def is_shared(self) -> bool:
        """Whether several lights send from the address."""
        return self.report is not None and self.report.shared_address

    @property
    def strobe_range(self) -> StrobeRange:
        """Return the strobe periods that the light reports to be possible."""
        return self.report.status.strobe_range if self.report else StrobeRange()

    @property
    def temperature(self) -> float | None:
        """Return the temperature, degC; None where it is not measured, or the sensor fails."""
        status = self.status
        if (status is None or not self.measures_temperature
                or status.error_flags & mavlink.ILLUMINATOR_ERROR_FLAGS_THERMISTOR_FAILURE):
            return None
        return status.temperature


class StatusTracker:
    """
    Puts the statuses of one address in order, and finds out whether its light has restarted.

    :ivar conflict: determines whether they are those of several lights.
    :ivar check_until: the time until which an ON waits, s, since the light may have restarted.
    :ivar proof_due: when another status may show whether it has, s; infinity if that is known.
    """

    def __init__(self) -> None:
        self.conflict = AddressConflict()
        self.check_until = -math.inf
        self.proof_due = math.inf
        self._clock = UptimeClock()
        self._sending_times = SendingTimes()
        # Whether the light was lost since the newest status.
        self._was_lost = False

    def take(
        self, status: Status, now: float, *, commanded: bool, sender: int = 0,
    ) -> tuple[StatusReport[Status] | None, bool]:
        """
        Return the report of a status, None if it is late, and whether the light has restarted.

        :param sender: of the message.
        :param commanded: whether a command of ours may have changed the light.
        """
        uptime = self._clock.take(status.uptime_ms, now, was_lost=self._was_lost)
        self.proof_due = math.inf
        self.conflict.take(status, now, commanded=commanded, sender=sender)
        if self.conflict.detected:
            # The uptimes of several lights cannot be compared.
            self._clock = UptimeClock()
            self._was_lost = False
            return StatusReport(status, now, has_clock=False, shared_address=True), False
        if uptime is Uptime.LATE:
            if self._clock.is_suspecting:
                self.proof_due = now + RESTART_PROOF_TIME
                if now > self.check_until:
                    self.check_until = now + RESTART_CHECK_TIME
            return None, False
        self._was_lost = False
        restarted = uptime is Uptime.RESTARTED
        if restarted:
            self._sending_times = SendingTimes()
        return StatusReport(status, *self._sending_times.take(status, now)), restarted

    def checked(self) -> None:
        """Note that the configuration is compared with a status: no ON need wait for one."""
        self.check_until = -math.inf

    def found(self, now: float) -> None:
        """Note that the light is heard: it may have restarted."""
        self.check_until = now + RESTART_CHECK_TIME

    def lost(self) -> None:
        """Forget the other lights at the address: the light is lost."""
        self.conflict = AddressConflict()
        self._was_lost = True
