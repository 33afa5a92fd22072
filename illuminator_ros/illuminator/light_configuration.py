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
The configuration of a light: confirmed, requested, and to be restored.

One command carries all fields. So a command holds the values that are wanted now, those of the
command before it that is not confirmed yet, and the confirmed ones for the rest.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
import math

from . import events
from .agreed_configuration import AgreedConfiguration
from .commands import Configure, CONFIRMED
from .model import (
    Changes,
    checked,
    Configuration,
    DIMMING_FLAGS,
    FIELDS,
    InvalidValue,
    NOTHING,
    SafetyLimits,
    Status,
    StrobeRange,
    unexpected_differences,
)
from .required_values import (
    CONFIGURE_LIMIT,
    RequiredValues,
    Requirement,
    RESTORE_INTERVAL,
)
from .status_tracker import NewestStatus
from ..payload.attempt import Done, Result, StatusReport, Target
from ..payload.reconciler import Desired, Reconciler
from ..payload.repeat_limit import RepeatLimit

# s to wait for the first status before a complete set of overrides is sent without one.
FIRST_STATUS_TIMEOUT = 3.0
# %; set together with a strobe period where the duty cycle is 0, at which a light does not strobe.
DEFAULT_DUTY_CYCLE = 50.0
# s after a command of ours in which a change to a commanded value counts as its late effect, and a
# change of another value, or a switch, as implied by it.
LATE_TIME = 30.0
IMPLIED_TIME = 2.0
# How often in a row a change by another sender is undone, and s between two of these commands or
# two tries of an OFF that no request has asked for.
REPEATS = 3
REPEAT_INTERVAL = 2.0


def undoing_limit(reassert: bool) -> RepeatLimit | None:
    """Return the limit on undoing changes by other senders, None if these are followed."""
    return RepeatLimit(REPEATS, REPEAT_INTERVAL) if reassert else None


class LimitGuard:
    """
    Whether a light exceeds the limits that the operator has set.

    :param limits: apply to each command that is sent.
    :ivar exceeded: how the light exceeds them.
    """

    def __init__(self, limits: SafetyLimits, emit: Callable[[events.LightEvent], None],
                 exceeded: events.LimitExceeded) -> None:
        self.limits = limits
        self.exceeded = exceeded
        self._emit = emit
        self.renew()

    @property
    def is_limiting(self) -> bool:
        """Return whether there is a limit."""
        return self.limits != SafetyLimits()

    def renew(self) -> None:
        """Bring the light back within the limits once more."""
        self._repeats = RepeatLimit(1, REPEAT_INTERVAL)

    def check(self, reported: Configuration, strobe_range: StrobeRange) -> bool:
        """Return whether the light exceeds a limit, and report a change of that."""
        exceeded = replace(self.exceeded, excess=self.limits.excess(reported),
                           impossible=self.limits.impossible(strobe_range))
        if exceeded != self.exceeded:
            self.exceeded = exceeded
            self._emit(exceeded)
        return bool(exceeded.excess)

    def due(self, now: float) -> float | None:
        """Return when the light may be brought back, s; None if that has been tried."""
        return self._repeats.take(now)


class BrightnessAsSwitch:
    """
    Whether a brightness above 0 is the switch of a light (ArduSub).

    :ivar off_brightness: the brightness that the light reports while it is off, None if unknown.
    :ivar is_switch: whether it was seen to report brightness 0 since it was switched off.
    """

    def __init__(self) -> None:
        self.off_brightness: float | None = None
        self.is_switch = False

    def reported(self, status: Status, *, was_dimmed: bool) -> None:
        """
        Take the status of a light that is off.

        :param was_dimmed: whether it was on with a brightness, and no configuration explains the
            change.
        """
        self.off_brightness = status.brightness
        self.is_switch = self.off_brightness == 0.0 and (self.is_switch or was_dimmed)


# The reasons of values in the reconciler; a request has none.
_REQUIRED, _SETPOINT = 'required values', 'a setpoint'


class LightConfiguration:
    """
    Keeps one light configured. No I/O; times are s.

    :param emit: takes the events.
    :param newest: the newest status.
    :param limits: apply to each command that is sent.
    :param restore: whether a light that has restarted gets its confirmed configuration again.
    :param reassert: whether changes by other senders are undone.
    :param must_wait: returns whether no required values may be sent now: the process ends, or an
        OFF is under way and a brightness may be an ON.
    :ivar agreed: the configuration agreed with the light.
    :ivar brightness: whether its brightness is the switch of the light.
    :ivar guard: how the light exceeds the limits.
    """

    def __init__(
        self, target: Target, emit: Callable[[events.LightEvent], None], newest: NewestStatus, *,
        limits: SafetyLimits, restore: bool = True, reassert: bool = False,
        must_wait: Callable[[], bool] = lambda: False,
    ) -> None:
        self.agreed = AgreedConfiguration(target.address, emit)
        self.brightness = BrightnessAsSwitch()
        self.guard = LimitGuard(limits, emit, events.LimitExceeded(target.address, (), ''))
        self._address = target.address
        self._emit = emit
        self._newest = newest
        self._restores = restore
        self._must_wait = must_wait
        self._undoing = undoing_limit(reassert)
        self._reconciler: Reconciler[Status] = Reconciler(target, self._ended)
        self._setpoint: float | None = None
        self._required = RequiredValues()
        # The result of the last command, None before the first.
        self._outcome: Result | None = None

    @property
    def discrepancy(self) -> str:
        """Why the light does not have a configuration that it should have, '' if it has."""
        return self._required.failure or self.agreed.discrepancy

    @property
    def is_changing(self) -> bool:
        """Whether a command of ours is under way."""
        return self._reconciler.under_way is not None

    @property
    def has_values_to_send(self) -> bool:
        """Whether a command of ours is under way, or values wait."""
        return (self._reconciler.is_busy or self._setpoint is not None
                or bool(self._required.values))

    @property
    def may_send_after_restart(self) -> bool:
        """Whether a light that has restarted may be sent a configuration."""
        return (self.guard.is_limiting or bool(self._required.values)
                or self._restores and self.agreed.confirmed is not None)

    @property
    def must_send_before_on(self) -> bool:
        """Whether the light must be sent a configuration before it is switched on."""
        return self._required.delays_on

    @property
    def sent_at(self) -> float:
        """When the last command was sent, s."""
        return self._reconciler.last_sent.at if self._reconciler.last_sent else -math.inf

    # Settings

    def change_limits(self, limits: SafetyLimits, now: float) -> None:
        """Replace the limits, and bring a light that exceeds them back within them."""
        self.guard.limits = limits
        self.guard.renew()
        if self._required.requirement is Requirement.LIMIT:
            self._required = RequiredValues()
        desired = self._reconciler.desired
        if desired is not None and isinstance(desired.change, Configure):
            goal = desired.change.configuration
            limited = limits.clipped(goal, self._newest.strobe_range)
            if limited != goal:
                # A resend would exceed the limits. The newest setpoint is sent as the limit.
                if self._is_stream and self._setpoint is None:
                    self._setpoint = limited.brightness
                self._reconciler.cancel(
                    ', '.join(limits.excess(goal)) or 'a limit was changed', now,
                    superseded=desired.reason == _SETPOINT)
        status = self._newest.status
        if status is not None and (self.agreed.confirmed or status.complete):
            self._keep_limits(status.configuration(self.agreed.confirmed or NOTHING), now)

    def change_reassert(self, reassert: bool) -> None:
        """Undo changes by other senders from now on, or follow them."""
        self._undoing = undoing_limit(reassert)
        if self._required.requirement is Requirement.OTHER_SENDER:
            self._required = RequiredValues()

    # Requests

    def configure(self, changes: Changes, now: float, done: Done) -> None:
        """
        Change some fields with one command; the light must be connected.

        :param changes: values by name, see :data:`~.model.FIELDS`; if one is wrong none is sent.
        :param done: called once with the result.
        """
        try:
            values = self._checked(changes)
            for name, value in values.items():
                self.guard.limits.check(name, value)
            change = self._change(values)
        except InvalidValue as error:
            done(Result(False, str(error), permanent=True), now)
            return
        self._reconciler.want(Desired(change, since=now, limit=CONFIGURE_LIMIT), now, done)

    def set_brightness(self, brightness: float, now: float) -> None:
        """Take a setpoint of a stream, %, checked; the light must be connected."""
        try:
            self.guard.limits.check('brightness', brightness)
        except InvalidValue as error:
            brightness = self.guard.limits.max_brightness
            self._emit(events.SetpointClipped(self._address, str(error)))
        under_way = self._reconciler.under_way
        if (self._is_stream and isinstance(under_way, Configure)
                and under_way.configuration.brightness == brightness):
            # A command with this value is under way; a setpoint that waits is outdated.
            self._setpoint = None
            return
        self._setpoint = brightness
        self.poll(now, connected=True)

    def set_desired(self, values: Changes, now: float) -> None:
        """
        Send values as soon as the light has reported its configuration.

        :param values: by name, checked, except against the limits that the light reports.
        """
        self._required = self._required.merged(
            values, Requirement.OVERRIDE, self._first_due(now))

    def _first_due(self, now: float) -> float:
        return now if self.agreed.confirmed else now + FIRST_STATUS_TIMEOUT

    def replace(self, message: str, now: float) -> None:
        """End all requests, and drop the required values: an OFF or the end replaces them."""
        self.drop_required()
        self._setpoint = None
        self._reconciler.cancel(message, now, superseded=True)

    def end_requests(self, message: str, now: float) -> None:
        """End all requests, but keep the required values."""
        self._setpoint = None
        self._reconciler.cancel(message, now)
        self.retry_required(now)

    def drop_required(self) -> None:
        """Drop the required values: an OFF replaces them, and they would be an ON."""
        if self._required.requirement is Requirement.LIMIT:
            # The light may be switched on beyond the limit.
            self.guard.renew()
        self._required = RequiredValues()

    def _checked(self, changes: Changes) -> dict[str, float]:
        return {name: checked(name, value, self._newest.strobe_range)
                for name, value in changes.items()}

    def _change(self, values: Changes) -> Configure:
        """
        Return the change that sets some fields.

        :raises InvalidValue: if nothing is confirmed yet and the values are not complete.
        """
        note, names = '', list(values)
        desired = self._reconciler.desired
        base = self.agreed.confirmed
        if desired is not None and isinstance(desired.change, Configure):
            base, names = desired.change.configuration, [*desired.change.names, *names]
        if base is None:
            missing = [name for name in FIELDS if name not in values]
            if missing:
                raise InvalidValue(
                    'the light has not reported its configuration yet, so '
                    f'{", ".join(missing)} must be set in the same call')
            goal = Configuration(**values)
        else:
            if (values.get('strobe_period') and 'strobe_duty_cycle' not in values
                    and not base.strobe_duty_cycle):
                values = {**values, 'strobe_duty_cycle': DEFAULT_DUTY_CYCLE}
                names.append('strobe_duty_cycle')
                note = ('strobe_duty_cycle was 0 %, at which the light does not strobe, and was '
                        f'set to {DEFAULT_DUTY_CYCLE:g} %')
            goal = replace(self._sendable(base, values), **values)
        # Each command is made here, so the limits apply to every command.
        limited = self.guard.limits.clipped(goal, self._newest.strobe_range)
        return Configure(limited, list(dict.fromkeys((*names, *goal.differences(limited)))), note)

    def _sendable(self, base: Configuration, changes: Changes) -> Configuration:
        """
        Return a configuration with reported values where its own are out of range.

        Otherwise a light that once reported a value out of its range would deny every change.
        """
        if self._newest.status is None:
            return base
        reported = self._newest.status.configuration(base)
        ruled_out = {}
        for name in FIELDS:
            try:
                if name != 'mode' and name not in changes:
                    checked(name, getattr(base, name), self._newest.strobe_range)
            except InvalidValue:
                ruled_out[name] = getattr(reported, name)
        return replace(base, **ruled_out)

    def _ended(
        self, desired: Desired[Status], result: Result, status: Status | None, now: float,
    ) -> None:
        change = desired.change
        assert isinstance(change, Configure)
        self._outcome = result
        if result.success:
            self._required = self._required.without([
                name for name, value in self._required.values.items()
                if name in change.names or value == getattr(change.configuration, name)])
            self.agreed.accept(change.configuration, status)
        elif result.contradicted:
            self.agreed.contradicted(change.configuration, self._newest.status, result.message)
        if desired.reason == _REQUIRED:
            self._required_ended(result, now)
        elif desired.reason == _SETPOINT and not (result.success or result.superseded):
            self._setpoint_failed(result.message)

    def _required_ended(self, result: Result, now: float) -> None:
        if result.success:
            self._restored(True, result.message)
        elif self._required.is_given_up(result, now):
            self._required = RequiredValues()
            self.agreed.failed(result.message)
            self._restored(False, result.message)

    # Reports

    def restarted(self, now: float) -> None:
        """Note that the light has restarted, so that its configuration may be lost."""
        if self._restores and self.agreed.confirmed is not None:
            confirmed = self.agreed.confirmed
            values = {name: getattr(confirmed, name) for name in FIELDS
                      if name != 'mode' or confirmed.mode}
            self._required = self._required.merged(values, Requirement.RESTART, now)
        elif self._required.is_sent_once:
            # The light has other values now.
            self._required = RequiredValues()
        # The restart may have undone the command that brought the light within the limits.
        self.guard.renew()

    def retry_required(self, now: float) -> None:
        """Make required values due, since the light is heard or a command was cancelled."""
        self._required.retry(self._first_due(now))

    def lost(self, message: str, now: float) -> None:
        """Note that the light is lost: no request must take effect when it is heard again."""
        self._reconciler.lost(message, now)
        # It may restart meanwhile, which cannot be detected where several lights share the
        # address.
        self.guard.renew()
        if self._setpoint is not None:
            self._setpoint = None
            self._setpoint_failed(message)

    def reported(
        self, report: StatusReport[Status], now: float, *, can_follow: bool, switched_at: float,
    ) -> None:
        """
        Confirm the request under way, or follow the change of another sender.

        :param can_follow: whether the status shows a change for certain.
        :param switched_at: when the light was last switched by us, s.
        """
        was_changing = self.is_changing
        self._reconciler.reported(report, now)
        status = report.status
        if self.agreed.confirmed is None and (was_changing or not status.complete):
            return
        reported = status.configuration(self.agreed.confirmed or NOTHING)
        if not was_changing:
            self._take(report, reported, now, can_follow=can_follow, switched_at=switched_at)
        if self.guard.is_limiting:
            self._keep_limits(reported, now)

    def _take(
        self, report: StatusReport[Status], reported: Configuration, now: float, *,
        can_follow: bool, switched_at: float,
    ) -> None:
        status = report.status
        self.agreed.end_discrepancy(reported, status.error_flags)
        required = self._required
        if self.agreed.confirmed is None:
            self.agreed.adopt(reported, events.ChangeCause.FIRST_STATUS)
            if required.values:
                required.due, required.has_ended = min(required.due, now), False
        elif required.values and not report.shared_address and (
                shown := self._shown_goal(required, self.agreed.confirmed, reported, status)):
            # The light has kept the values, another sender has restored them, or our command was
            # acknowledged too late.
            self._required = RequiredValues()
            self.agreed.accept(shown, status)
            if required.has_ended:
                self._restored(True, f'{shown.describe(list(required.values))}, {CONFIRMED}')
        elif ((not required.values or required.requirement is Requirement.OVERRIDE)
                and can_follow and not report.shared_address):
            self._follow(status, self.agreed.confirmed, reported, switched_at, now)

    def _follow(
        self, status: Status, confirmed: Configuration, reported: Configuration,
        switched_at: float, now: float,
    ) -> None:
        """Follow the change of another sender, or undo it."""
        names = unexpected_differences(confirmed, reported, status.error_flags, step=False)
        if not names:
            return
        far = self.agreed.changed_fields(reported, status.error_flags)
        cause = events.ChangeCause.ROUNDING
        if far:
            own = all(self._is_own(name, reported, switched_at, now) for name in far)
            cause = events.ChangeCause.REQUEST if own else events.ChangeCause.LIGHT
        # Where brightness is the switch, each command to a light that is off is an ON.
        if not (cause is events.ChangeCause.LIGHT
                and not (self.brightness.is_switch and status.enabled is False)
                and self._undo_change(status, confirmed, reported, now)):
            self.agreed.follow(reported, names, cause)

    def _is_own(
        self, name: str, reported: Configuration, switched_at: float, now: float,
    ) -> bool:
        """Return whether a change is a late or implied effect of a command of ours."""
        if now <= switched_at + IMPLIED_TIME:
            return True
        sent = self._reconciler.last_sent
        if sent is None or now > sent.at + LATE_TIME or not isinstance(sent.change, Configure):
            return False
        if name not in sent.change.configuration.differences(reported):
            return True
        was_accepted = self._outcome and (self._outcome.success or self._outcome.contradicted)
        return bool(was_accepted and name not in sent.change.names
                    and now <= sent.at + IMPLIED_TIME)

    def _shown_goal(
        self, required: RequiredValues, confirmed: Configuration, reported: Configuration,
        status: Status,
    ) -> Configuration | None:
        """
        Return the configuration with required values that the light shows, None if it does not.

        Heat hides the brightness. Overrides are sent once even if the light shows them.
        """
        if required.requirement is Requirement.OVERRIDE and not required.has_ended:
            return None
        goal = self.guard.limits.clipped(
            replace(confirmed, **required.values), self._newest.strobe_range)
        not_shown = goal.differences(reported)
        if status.error_flags & DIMMING_FLAGS:
            not_shown.append('brightness')
        return None if any(name in required.values for name in not_shown) else goal

    def _undo_change(
        self, status: Status, confirmed: Configuration, reported: Configuration, now: float,
    ) -> bool:
        """Undo another sender's change up to the limit of repeats; return whether it is undone."""
        names = unexpected_differences(confirmed, reported, status.error_flags, step=True)
        if self._undoing is None or not names:
            return False
        due = self._undoing.take(now)
        if due is not None:
            self._required = self._required.merged(
                {name: getattr(confirmed, name) for name in names}, Requirement.OTHER_SENDER, due)
        self._emit(events.ChangedByOther(
            self._address, reported.describe(names), due is not None))
        return due is not None

    def _keep_limits(self, reported: Configuration, now: float) -> None:
        """Bring a light that exceeds a limit back within it, once."""
        # Values that undo a change by another sender may be due only later.
        if (self.guard.check(reported, self._newest.strobe_range)
                and self._required.requirement is Requirement.OTHER_SENDER
                and (due := self.guard.due(now)) is not None):
            limited = self.guard.limits.clipped(reported, self._newest.strobe_range)
            values = {name: getattr(limited, name) for name in reported.differences(limited)}
            self._required = self._required.merged(values, Requirement.LIMIT, due)

    # Time

    def poll(self, now: float, *, connected: bool) -> None:
        """Send the values that are due; the light may be lost."""
        self._reconciler.poll(now)
        desired = self._reconciler.desired
        if connected and self._is_free and desired and isinstance(desired.change, Configure):
            # The light has accepted a setpoint, and a newer one need not wait for the status.
            self.agreed.accept(desired.change.configuration, None)
        # Required values go first, since a stream of setpoints may never end.
        if connected and self._is_free and now >= self._required_due:
            self._send_required(now)
        if connected and self._is_free and self._setpoint is not None:
            value, self._setpoint = self._setpoint, None
            self._send_setpoint(value, now)

    @property
    def _is_stream(self) -> bool:
        desired = self._reconciler.desired
        return desired is not None and desired.reason == _SETPOINT

    @property
    def _is_free(self) -> bool:
        """Whether values may be sent that no request has asked for."""
        return not self._reconciler.is_busy or (
            self._setpoint is not None and self._is_stream and self._reconciler.is_accepted)

    @property
    def _required_due(self) -> float:
        return math.inf if self._must_wait() else self._required.due

    def _send_setpoint(self, value: float, now: float) -> None:
        is_unconfirmed = self._reconciler.is_busy or (
            self._outcome is not None and not self._outcome.success)
        if (self.agreed.confirmed is not None and self.agreed.confirmed.brightness == value
                and not is_unconfirmed and not self._newest.is_shared):
            return
        try:
            change = self._change({'brightness': value})
        except InvalidValue as error:
            self._setpoint_failed(str(error))
        else:
            self._reconciler.want(
                Desired(change, _SETPOINT, since=now, limit=CONFIGURE_LIMIT), now)

    def _setpoint_failed(self, message: str) -> None:
        self._emit(events.SetpointFailed(self._address, message))

    def _restored(self, success: bool, message: str) -> None:
        self._emit(events.ConfigurationRestored(self._address, success, message))

    def _send_required(self, now: float) -> None:
        for name, value in self._required.values.items():
            try:
                checked(name, value, self._newest.strobe_range)
            except InvalidValue as error:
                self._required = self._required.without([name])
                self._restored(False, str(error))
        required = self._required
        if not required.values:
            return
        limit = required.limit
        required.due = now + RESTORE_INTERVAL + limit - CONFIGURE_LIMIT
        try:
            change = self._change(self._checked(required.values))
        except InvalidValue as error:
            # The values stay required until a status comes; report that once.
            required.due = math.inf
            required.has_ended = True
            required.failure = f'{", ".join(required.values)} not sent: {error}'
            self._restored(False, required.failure)
            return
        if self.agreed.confirmed is None:
            required.due += FIRST_STATUS_TIMEOUT
        required.is_sent = True
        self._reconciler.want(Desired(change, _REQUIRED, since=now, limit=limit), now)

    def next_deadline(self, *, connected: bool) -> float:
        """Return when :meth:`poll` has something to do."""
        due = self._reconciler.next_deadline()
        if not connected or not self._is_free:
            return due
        return -math.inf if self._setpoint is not None else min(due, self._required_due)
