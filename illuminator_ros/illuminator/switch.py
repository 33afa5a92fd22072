# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The switch of a light: whether it should be on, and what it shows."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
import math

from . import events
from .commands import SWITCHES
from .model import Mode, Status
from ..mavlink.command_sender import format_seconds
from ..mavlink.retries import UNCONFIRMED
from ..payload.confirmed_command import Change, Desired, Done, Result, Target
from ..payload.device_property import Caller, Outcome, Property

ON, OFF = SWITCHES[True], SWITCHES[False]


@dataclass
class Silence:
    """
    The dead man's switch: how long nothing has been requested. Times are s.

    :param limit: after which a light that is on is switched off; 0 for never.
    :param requested_at: the last request that counts, or the ON of another sender.
    :param called_at: when the first of the calls under way was made; -inf if there is none.
    """

    limit: float
    requested_at: float = -math.inf
    called_at: float = -math.inf

    @property
    def ends_at(self) -> float:
        """Return when it is over, infinity for never."""
        if not self.limit:
            return math.inf
        return self.limit + max(self.requested_at, self.called_at)


class Switch:
    """
    Switches one light on and off. No I/O; times are s.

    :param emit: takes the events.
    :param off_after_silence: s without a request after which a light that is on is switched off;
        0 for never.
    :ivar enabled: as reported, None if unknown; while heat keeps the light off, as before, since
        it may light up once it has cooled down.
    :ivar silence: of all who may request something.
    :ivar property: the property of the light; :meth:`take` takes its outcomes.
    """

    def __init__(
        self, target: Target, emit: Callable[[events.LightEvent], None], off_after_silence: float,
    ) -> None:
        self.enabled: bool | None = None
        self._target = target
        self._emit = emit
        self.silence = Silence(off_after_silence)
        self.property: Property[Status] = Property(target)
        # The OFF of a release, until the light shows it.
        self._required: Desired[Status] | None = None
        # Takes the results of the OFF at the end of the process.
        self._report: Done | None = None
        self._is_finally_off = False
        self._silence_due = math.inf
        # When an automatic OFF may follow one that the light has shown.
        self._off_due = -math.inf
        # The state that was reported last, and whether a failure of the OFF under way was.
        self._told: bool | None = None
        self._has_told_failure = False
        # Heat has switched it off, and it has not been on since.
        self._is_off_by_heat = False

    # The desired value

    def goal(self, now: float) -> Desired[Status] | None:
        """Return the value that the switch should have, None if any is fine."""
        if self._report is not None:
            is_due = self.enabled or not self._is_finally_off
            return Desired(OFF, 'the end', insists=True, is_last=True) if is_due else None
        if (self.silence.limit and now >= self.silence.ends_at and self.may_be_on(now)
                and not self.is_pending(OFF)):
            return Desired(OFF, 'off_after_silence: no request has succeeded for '
                           f'{format_seconds(self.silence.limit)}', insists=True)
        return self.property.desired or self._required

    def is_off_due(self, now: float) -> bool:
        """Return whether an OFF is desired that is not under way."""
        desired = self.goal(now)
        return desired is not None and desired.change == OFF and not self.is_pending(OFF)

    def update(self, now: float) -> None:
        """Send what the goal asks for; the light must be connected."""
        desired = self.goal(now)
        under_way = self.property.desired
        if desired is not None and desired.insists and under_way is None and now < self._off_due:
            # Two lights with one address end an OFF and need the next at the speed of the line.
            self._silence_due = self._off_due
            return
        if desired is not None and desired is not under_way and not (
                under_way and under_way.equals(desired)):
            self._want(desired, now)
        command, under_way = self.property.command, self.property.desired
        if command is not None and under_way is not None and under_way.insists:
            self._tell_failure(command.failure(), now)
        waits = self.silence.limit and self.may_be_on(now) and not self.is_pending(OFF)
        self._silence_due = self.silence.ends_at if waits else math.inf

    def _want(self, desired: Desired[Status], now: float, caller: Caller | None = None) -> None:
        if desired.insists and self._report is None:
            self._emit(events.AutomaticSwitch(self._target.address, False, desired.reason))
        self._has_told_failure = False
        self.property.want(desired, now, caller)

    def _tell_failure(self, failure: str, now: float) -> None:
        """Report why an automatic OFF is not confirmed: once, or the newest reason at the end."""
        if failure and self._report is not None:
            self._report(Result(False, failure), now)
        elif failure and not self._has_told_failure:
            assert self.property.desired is not None
            self._has_told_failure = True
            self._emit(events.AutomaticSwitch(
                self._target.address, False, self.property.desired.reason, failure))

    # Requests

    def ask(self, on: bool, now: float, caller: Caller) -> None:
        """Switch the light on or off; the light must be connected."""
        self._want(Desired(SWITCHES[on]), now, caller)

    def require_off(self, reason: str) -> None:
        """Switch the light off until it shows that, or a request switches it on."""
        self._required = Desired(OFF, reason, insists=True)

    def cancel(self, message: str, now: float, *, superseded: bool = False) -> None:
        """End the command under way; an automatic OFF is sent again by the next update."""
        self.property.cancel(message, now, superseded=superseded)

    def close(self, message: str, now: float) -> None:
        """End everything that is desired, since the process ends."""
        self.silence.limit, self._required = 0.0, None
        self.cancel(message, now, superseded=True)

    def switch_off_finally(self, now: float, report: Done) -> None:
        """See :meth:`.light_control.LightControl.switch_off_finally`."""
        self._report, self._is_finally_off = report, False
        report(Result(False, 'sent, not confirmed' if now < self.property.fence else ''), now)

    # Known facts

    def is_pending(self, change: Change[Status]) -> bool:
        """Return whether a change is under way."""
        desired = self.property.desired
        return desired is not None and desired.change == change

    def may_be_on(self, now: float) -> bool:
        """Return whether the light is on, or may go on by an ON of ours."""
        return bool(
            self.enabled or self.is_pending(ON)
            or self.property.unconfirmed(now) == ON
            and (self.enabled is None or now < self.property.fence))

    @property
    def off_at(self) -> float:
        """Return when ``off_after_silence`` switches the light off, infinity for never."""
        return self._silence_due

    # Reports

    def reported(
        self, status: Status, now: float, *, may_be_ours: bool, is_told: bool,
    ) -> None:
        """
        Take a status that is not older than those before.

        :param may_be_ours: whether a configuration of ours may have switched the light.
        :param is_told: whether a change that no command under way has made is reported.
        """
        before, was_off_by_heat = self.enabled, self._is_off_by_heat
        self._take_enabled(status)
        is_busy, origin = self.property.command is not None, ''
        if self.enabled is not before or self.enabled is not self._told:
            origin = (events.LATE_EFFECT if self._is_late(now) else
                      events.A_REQUEST if may_be_ours else events.OTHER_SENDER)
        if self.enabled is False and not is_busy:
            self._required = None
        elif self.enabled and is_told and not (is_busy or was_off_by_heat) and (
                before is None or not before and origin == events.OTHER_SENDER):
            # Another sender has switched it on, or it was on when it was found.
            self.silence.requested_at = now
        self.property.reported(status, now)
        if origin and not (self.property.outcomes or self.property.command is not None):
            shows_switch = not (status.is_dimmed or status.mode is Mode.EXTERNAL_SYNC)
            self._tell(origin if is_told and shows_switch and self._told is not None else '')

    def _take_enabled(self, status: Status) -> None:
        self._is_off_by_heat = not status.enabled and (
            self._is_off_by_heat or status.is_off_by_heat)
        if not self._is_off_by_heat:
            self.enabled = status.enabled

    def _is_late(self, now: float) -> bool:
        """Return whether a command of ours that ended unconfirmed asked for this state."""
        return self.enabled is not None and (
            self.property.unconfirmed(now) == SWITCHES[self.enabled])

    def _tell(self, origin: str) -> None:
        """Report a state that differs from the last reported state."""
        if self.enabled is not None and self.enabled is not self._told:
            self._told = self.enabled
            if origin and not self._target.commands.refusal:
                self._emit(events.LightSwitched(self._target.address, self.enabled, origin))

    def restarted(self, status: Status, now: float) -> None:
        """Take the first status after a restart, which confirms nothing."""
        self.enabled, self._is_off_by_heat = None, False
        self._take_enabled(status)
        self._tell('')
        self.property.restarted(status, now)

    def take(self, outcome: Outcome[Status], now: float) -> None:
        """Take the end of a value."""
        desired, result, on = outcome.desired, outcome.result, outcome.desired.change == ON
        if result.success:
            self.enabled = on
            self._required = None
            self._is_finally_off = not on
            self._off_due = now + UNCONFIRMED.first if desired.insists else -math.inf
            detail = next((one.detail for one in outcome.callers if one.detail), '')
            self._tell(detail or desired.reason or events.A_REQUEST)
            if self._report is not None and not on:
                self._report(result, now)
        elif on and self._is_off_by_heat:
            # It may light up once it has cooled down.
            self.enabled = None
        elif self._is_late(now):
            self._tell(events.LATE_EFFECT)

    # Time

    def next_deadline(self) -> float:
        """Return when ``property.poll`` or :meth:`update` has something to do."""
        return min(self.property.next_deadline(), self._silence_due)
