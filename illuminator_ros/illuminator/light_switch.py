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
The switch of a light: which rule decides whether it is on or off, and what it shows.

:data:`RULES` ranks the rules. They read :class:`SwitchState`, which holds what was requested and
what the light shows; a :class:`~..payload.reconciler.Reconciler` sends the commands.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
import math

from . import events
from .commands import SWITCHES
from .light_configuration import (
    IMPLIED_TIME,
    LATE_TIME,
    LightConfiguration,
    REPEAT_INTERVAL,
    undoing_limit,
)
from .model import DIMMING_FLAGS, Mode, Status
from .status_tracker import NewestStatus
from ..mavlink.command_sender import format_seconds
from ..mavlink.dialect import mavlink
from ..payload.attempt import Change, Done, LastChange, Result, StatusReport, Target
from ..payload.reconciler import decide, Desired, Reconciler, Rule

# s after an ON in which an OFF may overtake it on the way to the light.
OVERTAKING_TIME = 0.2


@dataclass
class SwitchState:
    """
    The facts that the rules read. Times are s.

    :param off_after_silence: s without a request after which a light that is on is switched off;
        0 for never.
    :param enabled: as reported, None if unknown.
    :param may_be_on: whether the light, or one of several at its address, is on or may go on.
    :param requested_at: the time of the last request, or of the status that showed that another
        sender has switched the light on.
    :param off: an OFF that no request has asked for, until the light shows it.
    :param asked: the value that was requested.
    :param undoing: the value that another sender has changed.
    """

    off_after_silence: float
    enabled: bool | None = None
    may_be_on: bool = False
    requested_at: float = -math.inf
    off: Desired[Status] | None = None
    asked: Desired[Status] | None = None
    undoing: Desired[Status] | None = None

    def is_silent(self, now: float) -> bool:
        """Return whether nothing has been requested for ``off_after_silence``."""
        limit = self.off_after_silence
        return bool(limit) and now >= self.requested_at + limit


def off_required(state: SwitchState, now: float) -> Desired[Status] | None:
    """Repeat an OFF that a rule has required, until the light shows it."""
    return state.off


def silence(state: SwitchState, now: float) -> Desired[Status] | None:
    """Switch a light off for which nothing has been requested for a time."""
    if not state.off_after_silence or not state.may_be_on or state.off:
        return None
    return Desired(
        SWITCHES[False],
        f'off_after_silence: no request for {format_seconds(state.off_after_silence)}',
        since=state.requested_at + state.off_after_silence)


def request(state: SwitchState, now: float) -> Desired[Status] | None:
    """Do what the source that holds the light has requested."""
    return state.asked


def reassert(state: SwitchState, now: float) -> Desired[Status] | None:
    """Undo a switch by another sender, unless nothing has been requested for a time."""
    return None if state.is_silent(now) else state.undoing


SwitchRule = Rule[SwitchState, Status]
# The highest first.
RULES: tuple[SwitchRule, ...] = (off_required, silence, request, reassert)


def _is_on(change: Change[Status]) -> bool:
    return change.params == SWITCHES[True].params


def _is_off(change: Change[Status]) -> bool:
    return change.params == SWITCHES[False].params


class LightSwitch:
    """
    Switches one light. No I/O; times are s.

    :param emit: takes the events.
    :param newest: the newest status.
    :param configuration: of the light: an OFF replaces it where brightness is the switch.
    :param reassert: whether a switch by another sender is undone.
    :param earliest_on: returns the time before which an ON must not be sent.
    :param rules: the highest first.
    :ivar state: the facts that the rules read.
    """

    def __init__(
        self, target: Target, emit: Callable[[events.LightEvent], None],
        configuration: LightConfiguration, newest: NewestStatus, *, off_after_silence: float,
        reassert: bool, earliest_on: Callable[[], float], rules: Sequence[SwitchRule] = RULES,
    ) -> None:
        self.state = SwitchState(off_after_silence)
        self._target = target
        self._emit = emit
        self._configuration = configuration
        self._newest = newest
        self._rules = rules
        self._reconciler: Reconciler[Status] = Reconciler(
            target, self._ended, overtakes=_is_off,
            earliest=lambda change: earliest_on() if _is_on(change) else -math.inf)
        # The OFF at the end of the process.
        self._last_off: LastChange[Status] | None = None
        # How the value was requested, for LightSwitched.
        self._origin = ''
        # Whether it is switched on again if another sender switches it off: a request has switched
        # it on, and it was neither lost nor restarted since.
        self._undoes_off = False
        # The limit on undoing switches by other senders, None where these are followed.
        self._undoing = undoing_limit(reassert)
        # Whether a status has shown it on since the last OFF that was confirmed.
        self._was_on = False
        # Whether the last status showed that heat has switched the light off.
        self._was_hot = False
        # When the light has last confirmed or refused a switch: it will not execute it later.
        self._settled_at = -math.inf
        # When another rule may come into force, s; at once after a change of the state.
        self._due = -math.inf

    # Settings

    def change_silence(self, off_after_silence: float, now: float) -> None:
        """Replace the time of ``off_after_silence``; the silence begins again."""
        self.state.off_after_silence = off_after_silence
        self.note_request(now)

    def change_reassert(self, reassert: bool, now: float) -> None:
        """Undo switches by other senders from now on, or follow them."""
        self._undoing = undoing_limit(reassert)
        undone, self.state.undoing = self.state.undoing, None
        if undone is not None and self._reconciler.desired is undone:
            self._reconciler.cancel('superseded by external_changes', now, superseded=True)

    @property
    def off_at(self) -> float:
        """Return when ``off_after_silence`` switches the light off, infinity for never."""
        desired = silence(self.state, -math.inf)
        return math.inf if desired is None else desired.since

    # Desired values

    def ask(
        self, on: bool, now: float, done: Done, origin: str = '', *, is_stream: bool = False,
    ) -> None:
        """
        Switch the light on or off; the light must be connected.

        :param done: called once with the result.
        :param origin: how it was requested, for :class:`~.events.LightSwitched`.
        :param is_stream: whether a newer request replaces it.
        """
        self.state.off = self.state.undoing = None
        self.state.asked = Desired(SWITCHES[on], since=now)
        self._origin = origin
        self.decide(now, done, is_stream=is_stream)

    def require_off(self, reason: str, now: float) -> None:
        """Switch the light off until it shows that."""
        self._require_off(Desired(SWITCHES[False], reason, since=now))

    def _require_off(self, desired: Desired[Status]) -> None:
        self._due = -math.inf
        self.state.off = desired
        self.keep_off()
        self._emit(events.AutomaticSwitch(self._target.address, False, desired.reason))

    def keep_off(self) -> None:
        """Undo no OFF by another sender until a request has switched the light on."""
        self._undoes_off = False
        if self.state.undoing is not None and _is_on(self.state.undoing.change):
            self.state.undoing = None

    def note_request(self, now: float) -> None:
        """Begin the time of ``off_after_silence`` again."""
        self.state.requested_at, self._due = now, -math.inf

    def decide(
        self, now: float, done: Done | None = None, *, is_stream: bool = False,
    ) -> None:
        """
        Have the value sent that the highest rule in force desires; the light must be connected.

        :param done: called once with the result of the value that was just requested.
        """
        state = self.state
        state.may_be_on = self.may_be_on
        desired, self._due = decide(self._rules, state, now)
        if desired is None:
            return
        # A rule may make an equal value each time.
        known = (state.off, state.undoing, state.asked)
        desired = next((one for one in known if one == desired), desired)
        if state.asked and desired.change == state.asked.change:
            desired = state.asked
        elif done is not None:
            # Another rule prevents the request.
            state.asked = None
            done(Result(False, desired.reason), now)
            done = None
        if _is_off(desired.change):
            if desired not in known:
                if self.is_known_off(now):
                    return
                self._require_off(desired)
            if (self._configuration.brightness.is_switch
                    and desired is not self._reconciler.desired):
                # A brightness that is sent later would be an ON.
                self._configuration.replace('superseded by off', now)
            self._undoes_off = False
        if desired is not self._reconciler.desired:
            self._due = -math.inf
        self._reconciler.want(desired, now, done, is_stream=is_stream)

    def _ended(
        self, desired: Desired[Status], result: Result, status: Status | None, now: float,
    ) -> None:
        self._due = -math.inf
        state, on, sent = self.state, _is_on(desired.change), self._reconciler.last_sent
        was_on = sent.before.enabled if sent and sent.before else None
        if result.success:
            state.enabled = self._undoes_off = self._was_on = on
            if not on and self._configuration.brightness.is_switch:
                self._configuration.drop_required()
        if result.success or result.refused:
            self._settled_at = now
        origin = desired.reason
        if desired is state.asked:
            state.asked, origin = None, self._origin
        elif desired is state.off:
            state.off = self._failed(desired, result, now + REPEAT_INTERVAL)
        elif desired is state.undoing:
            state.undoing = self._failed(
                desired, result,
                self._undoing.take(now) if self._undoing and not result.success else None)
            if state.undoing is None and not result.success:
                self._emit(events.ChangedByOther(
                    self._target.address, 'off' if on else 'on', undone=False))
        if result.success and was_on is not on:
            self._emit(events.LightSwitched(
                self._target.address, on, origin or events.A_REQUEST))

    def _failed(
        self, desired: Desired[Status], result: Result, due: float | None,
    ) -> Desired[Status] | None:
        """Return a value that no request has asked for, to be sent again; None if it must not."""
        if result.success:
            return None
        if not result.superseded:
            self._emit(events.AutomaticSwitch(
                self._target.address, _is_on(desired.change), desired.reason, result.message))
        return None if due is None else replace(desired, since=due)

    def cancel(self, message: str, now: float) -> None:
        """End the requests and their resends, but not an OFF that a rule has required."""
        if self.state.undoing is not None and _is_on(self.state.undoing.change):
            self.state.undoing = None
        if self._reconciler.desired is not self.state.off:
            self._reconciler.cancel(message, now)
        self.state.asked = None

    def close(self, message: str, now: float) -> None:
        """End everything that is desired; no rule counts from now on."""
        self._rules = ()
        self._reconciler.cancel(message, now, superseded=True)

    def switch_off_finally(self, now: float, report: Done, *, connected: bool) -> None:
        """Switch the light off whenever it may be on; see :meth:`.light.Light.close`."""
        self._last_off = LastChange(self._target, SWITCHES[False], report,
                                    counts_from=self._last_on_at(now) + OVERTAKING_TIME)
        if connected:
            self._last_off.poll(now)

    def stop_on(self, message: str, now: float) -> None:
        """Send no further ON: its source no longer holds the light."""
        if self._reconciler.desired and _is_on(self._reconciler.desired.change):
            self._reconciler.stop(message, now)

    # Known facts

    @property
    def is_changing(self) -> bool:
        """Whether a command of ours is under way."""
        return self._reconciler.under_way is not None

    @property
    def switched_at(self) -> float:
        """When a switch was last sent, s."""
        return self._reconciler.last_sent.at if self._reconciler.last_sent else -math.inf

    @property
    def may_be_on(self) -> bool:
        """Whether the light, or one of several at its address, is on or may go on."""
        # A light that sends no status may be on if it was switched on, and so may one of several
        # lights at the address, whose statuses may come at once. A try of an ON that has not ended
        # may still take effect.
        state, sent = self.state, self._reconciler.last_sent
        return bool(
            state.enabled or self._reconciler.may_set(_is_on)
            or sent and _is_on(sent.change) and (state.enabled is None or self._newest.is_shared)
            or self._was_on and self._newest.is_shared)

    def _last_on_at(self, now: float) -> float:
        """Return the time after which no ON was sent, s, unless it has succeeded or failed."""
        sent, at = self._reconciler.last_sent, -math.inf
        if sent is not None:
            at = sent.at if _is_off(sent.change) else now if self.is_own(True, now) else at
        if self._configuration.brightness.off_brightness == 0.0:
            at = max(at, self._configuration.sent_at)
        return at

    def may_brightness_undo_off(self) -> bool:
        """Return whether an OFF is under way that a brightness may undo."""
        # A brightness does not switch on a light that has shown one while it was off. Without this
        # exception a light that confirms slowly would not be configured while OFFs are repeated.
        return (self._configuration.brightness.off_brightness in (None, 0.0)
                and self._reconciler.may_set(_is_off))

    def is_known_off(self, now: float) -> bool:
        """Return whether the light is off, and no command of ours may still switch it on."""
        return (self.state.enabled is False and not self._newest.is_shared
                and not self._reconciler.may_set(_is_on) and not self.is_own(True, now)
                and not (self._configuration.brightness.off_brightness == 0.0
                         and self._configuration.has_values_to_send))

    def is_own(self, on: bool, now: float) -> bool:
        """Return whether a switch may be the late or implied effect of a command of ours."""
        sent = self._reconciler.last_sent
        return (sent is not None and sent.change == SWITCHES[on] and self._settled_at < sent.at
                and now <= sent.at + LATE_TIME
                or self._configuration.brightness.off_brightness == 0.0
                and now <= self._configuration.sent_at + IMPLIED_TIME)

    # Reports

    def reported(self, report: StatusReport[Status], now: float, *, restarted: bool) -> None:
        """Take a status that is newer than all before."""
        self._due = -math.inf
        state, enabled = self.state, report.status.enabled
        before, state.enabled = state.enabled, enabled
        self._was_on |= bool(enabled)
        if enabled is False:
            confirmed = self._configuration.agreed.confirmed
            self._configuration.brightness.reported(
                report.status, was_dimmed=bool(before and confirmed and confirmed.brightness)
                and not self._configuration.is_changing)
        was_hot, self._was_hot = self._was_hot, bool(
            report.status.error_flags & mavlink.ILLUMINATOR_ERROR_FLAGS_OVER_TEMPERATURE_SHUTDOWN)
        # Several lights at one address seem to be one light that switches repeatedly, and a light
        # that has cooled down switches itself on.
        is_busy = self._reconciler.is_busy
        is_by_other = before is False and not (
            report.shared_address or was_hot or is_busy or self.is_own(True, now))
        if enabled and (state.requested_at == -math.inf or is_by_other):
            self.note_request(now)
        if not is_busy:
            # The OFF of one of several lights does not show that the others are off.
            if enabled is not None and (enabled or not report.shared_address):
                if not enabled:
                    state.off = None
                if state.undoing and state.undoing.change == SWITCHES[enabled]:
                    state.undoing = None
            if self._rules and not restarted:
                self._follow(before, report, now)
        self._reconciler.reported(report, now)
        if self._last_off is not None:
            self._last_off.reported(report, now)

    def _follow(
        self, before: bool | None, report: StatusReport[Status], now: float,
    ) -> None:
        """Report that the light was switched without a request under way."""
        status = report.status
        if (before is None or status.enabled is None or before == status.enabled
                or report.shared_address or status.error_flags & DIMMING_FLAGS
                or status.mode is Mode.EXTERNAL_SYNC):
            return
        is_own = self.is_own(status.enabled, now)
        origin = events.A_REQUEST if is_own else events.OTHER_SENDER
        self._emit(events.LightSwitched(self._target.address, status.enabled, origin))
        if self._undoing is None or is_own or before and not self._undoes_off:
            return
        due, change = self._undoing.take(now), 'off' if before else 'on'
        if due is None:
            self._emit(events.ChangedByOther(self._target.address, change, undone=False))
        else:
            reason = f'external_changes: another sender switched it {change}'
            self.state.undoing = Desired(SWITCHES[before], reason, since=due)
            self._emit(events.AutomaticSwitch(self._target.address, before, reason))

    def lost(self, message: str, now: float) -> None:
        """Send no further ON: the light is lost, and another try may reach it after a restart."""
        self.keep_off()
        if self._reconciler.may_set(_is_on):
            self._reconciler.lost(message, now)

    # Time

    def poll(self, now: float, *, connected: bool) -> None:
        """Do what is due."""
        if connected:
            self.decide(now)
            if self._last_off is not None:
                self._last_off.poll(now)
        self._reconciler.poll(now)

    def next_deadline(self, *, connected: bool) -> float:
        """Return when :meth:`poll` has something to do."""
        due = self._reconciler.next_deadline()
        if not connected:
            return due
        return min(due, self._due, self._last_off.next_deadline() if self._last_off else math.inf)
