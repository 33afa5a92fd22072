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

"""The configuration of a light: confirmed, requested, and to be restored."""

from __future__ import annotations

from collections.abc import Callable, Container
from dataclasses import dataclass, replace
from enum import Enum
import math

from . import events
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
from ..payload.repeat_limit import RepeatLimit
from ..payload.request import (
    Change,
    Done,
    OVERTAKEN,
    Phase,
    Request,
    RequestQueue,
    Result,
    StatusReport,
    Target,
)

# s; rqt_reconfigure gives up after 1.0 s, and the answer must arrive before. The middleware waits
# up to 0.1 s before it sends an answer to a client that it has not discovered yet.
CONFIGURE_LIMIT = 0.78
# s between tries of overrides and restored configurations that got no answer.
RESTORE_INTERVAL = 2.0
# s for each try after the first one: no ON waits for it, and the line may be slow.
RETRY_LIMIT = 1.5
# Attempts before giving up on a light that accepts a configuration but does not apply it.
MAX_CONTRADICTIONS = 3
# s to wait for the first status before a complete set of overrides is sent without one.
FIRST_STATUS_TIMEOUT = 3.0
# %; set together with a strobe period where the duty cycle is 0, at which a light does not strobe.
DEFAULT_DUTY_CYCLE = 50.0
# s after a command of ours in which a change to a commanded value counts as its late effect, and a
# change of another value as implied by it.
LATE_TIME = 30.0
IMPLIED_TIME = 2.0
# How often in a row a change by another sender is undone, and s between two of these commands.
REPEATS = 3
REPEAT_INTERVAL = 2.0


class _PendingReason(Enum):
    """The reason why values must be sent."""

    OVERRIDE = 'override'
    RESTART = 'restart'
    LIMIT = 'limit'
    OTHER_SENDER = 'other sender'


# Values with these reasons are dropped when the light has accepted and not applied them; a
# RepeatLimit limits further attempts.
_SENT_ONCE = (_PendingReason.LIMIT, _PendingReason.OTHER_SENDER)


@dataclass
class _Pending:
    """
    Values that must be sent, see :class:`_PendingReason`.

    :param attempts: how often the light has accepted them but then reported others.
    :param due: when they are sent next, s.
    :param has_ended: whether a command with them has ended, or none can be sent.
    :param failure: why the last attempt failed, '' if it did not.
    """

    values: Changes
    reason: _PendingReason
    due: float
    attempts: int = 0
    has_ended: bool = False
    failure: str = ''


@dataclass
class _Sent:
    """The last configuration that was sent, and when, s."""

    configuration: Configuration
    names: list[str]
    at: float
    accepted: bool = False


class ConfigurationManager:
    """
    Keeps one light configured.

    :param emit: takes the events.
    :param limits: apply to each command that is sent.
    :param reassert: whether changes by other senders are undone.
    :param must_wait: returns whether no pending values may be sent now, since the process ends, or
        since an OFF is under way and a brightness may be an ON.
    :ivar confirmed: the configuration that the light last accepted from us or, if another sender
        has changed it since, last reported; None before either.
    :ivar limit_exceeded: how the light exceeds the limits.
    """

    def __init__(
        self, target: Target, emit: Callable[[events.AnyLightEvent], None], *,
        limits: SafetyLimits, restore: bool = True, reassert: bool = False,
        must_wait: Callable[[], bool] = lambda: False,
    ) -> None:
        self.confirmed: Configuration | None = None
        self._target = target
        self._address = target.address
        self._emit = emit
        self._restore = restore
        self._must_wait = must_wait
        self._limits = limits
        self._is_limited = limits != SafetyLimits()
        self.limit_exceeded = events.LimitExceeded(target.address, (), '')
        self._limiting = RepeatLimit(1, REPEAT_INTERVAL)
        self._reassert = reassert
        self._undoing = RepeatLimit(REPEATS, REPEAT_INTERVAL)
        self._queue: RequestQueue[Status] = RequestQueue(target)
        self._status: Status | None = None
        self._brightness_is_switch = False
        self._shared_address = False
        self._setpoint: float | None = None
        self._pending: _Pending | None = None
        self._sent: _Sent | None = None
        # A configuration that the light has accepted but does not report, and its status then.
        self._unapplied: Configuration | None = None
        self._shown_instead: Status | None = None
        # Why that, or values that are pending no more, were not set; '' if they were.
        self._not_set = ''
        # Whether the effect of the last command is unknown, since it failed or was superseded.
        self._is_unconfirmed = False
        # The last configuration that was requested or reported as changed: small steps away
        # from it add up to a change.
        self._reference: Configuration | None = None

    @property
    def discrepancy(self) -> str:
        """Why the light does not have a configuration that it should have, '' if it has."""
        return self._pending.failure if self._pending and self._pending.failure else self._not_set

    @property
    def is_changing(self) -> bool:
        """Whether a command of ours is under way."""
        return self._queue.current is not None

    @property
    def is_confirming(self) -> bool:
        """Whether a request waits for a status."""
        return self._queue.is_confirming

    @property
    def has_values_to_send(self) -> bool:
        """Whether a command of ours is under way, or values wait."""
        return self.is_changing or self._setpoint is not None or self._pending is not None

    @property
    def may_send_after_restart(self) -> bool:
        """Whether a light that has restarted may be sent a configuration."""
        return (self._is_limited or self._pending is not None
                or self._restore and self.confirmed is not None)

    @property
    def must_send_before_on(self) -> bool:
        """Whether the light must be sent a configuration before it is switched on."""
        pending = self._pending
        return (pending is not None and not pending.has_ended
                and pending.reason is not _PendingReason.OTHER_SENDER)

    @property
    def sent_at(self) -> float:
        """When the last command was sent, s."""
        return self._sent.at if self._sent else -math.inf

    @property
    def _strobe_range(self) -> StrobeRange:
        return self._status.strobe_range if self._status else StrobeRange()

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
                self._limits.check(name, value)
        except InvalidValue as error:
            done(Result(False, str(error), permanent=True), now)
            return
        self._submit(values, now, done)

    def set_brightness(self, brightness: float, now: float) -> None:
        """Take a setpoint of a stream, %, checked; the light must be connected."""
        try:
            self._limits.check('brightness', brightness)
        except InvalidValue as error:
            brightness = self._limits.max_brightness
            self._emit(events.SetpointClipped(self._address, str(error)))
        current = self._queue.current
        if (current is not None and current.is_stream
                and current.phase is not Phase.FINISHED
                and isinstance(current.change, Configure)
                and current.change.configuration.brightness == brightness):
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
        self._want({**self._wanted, **values}, _PendingReason.OVERRIDE, self._first_due(now))

    def _first_due(self, now: float) -> float:
        return now if self.confirmed else now + FIRST_STATUS_TIMEOUT

    def _want(self, values: Changes, reason: _PendingReason, due: float) -> None:
        """Send values when they are due; the reason of values that already wait is kept."""
        self._pending = _Pending(values, self._pending.reason if self._pending else reason, due)

    @property
    def _wanted(self) -> Changes:
        return self._pending.values if self._pending else {}

    def replace(self, now: float, message: str = OVERTAKEN) -> None:
        """End all requests, and drop the pending values: an OFF or the end replaces them."""
        self.drop_pending()
        self._setpoint = None
        self._queue.replace(now, message)

    def end_requests(self, message: str, now: float) -> None:
        """End all requests, but keep the pending values."""
        self._setpoint = None
        self._queue.cancel(message, now)
        self.retry_pending(now)

    def drop_pending(self) -> None:
        """Drop the pending values: an OFF replaces them, and they would be an ON."""
        if self._pending and self._pending.reason is _PendingReason.LIMIT:
            # The light may be switched on beyond the limit.
            self._limiting = RepeatLimit(1, REPEAT_INTERVAL)
        self._pending = None

    def _drop_fields(self, names: Container[str]) -> None:
        """Remove fields from the pending values."""
        if self._pending:
            self._pending.values = {name: value for name, value in self._pending.values.items()
                                    if name not in names}
            if not self._pending.values:
                self._pending = None

    def _checked(self, changes: Changes) -> dict[str, float]:
        return {name: checked(name, value, self._strobe_range) for name, value in changes.items()}

    def _goal(self, values: Changes) -> Configure:
        """
        Return the change that sets some fields.

        :raises InvalidValue: if nothing is confirmed yet and the values are not complete.
        """
        note = ''
        if self.confirmed is None:
            missing = [name for name in FIELDS if name not in values]
            if missing:
                raise InvalidValue(
                    'the light has not reported its configuration yet, so '
                    f'{", ".join(missing)} must be set in the same call')
            goal = Configuration(**values)
        else:
            if (values.get('strobe_period') and 'strobe_duty_cycle' not in values
                    and not self.confirmed.strobe_duty_cycle):
                values = {**values, 'strobe_duty_cycle': DEFAULT_DUTY_CYCLE}
                note = ('strobe_duty_cycle was 0 %, at which the light does not strobe, and was '
                        f'set to {DEFAULT_DUTY_CYCLE:g} %')
            goal = replace(self._sendable(self.confirmed, values), **values)
        # Each command is made here, so the limits apply to every command.
        limited = self._limits.clipped(goal, self._strobe_range)
        return Configure(limited, list(dict.fromkeys((*values, *goal.differences(limited)))),
                         note)

    def _sendable(self, confirmed: Configuration, changes: Changes) -> Configuration:
        """
        Return the confirmed configuration, with reported values where its own are out of range.

        Otherwise a light that once reported a value out of its range would deny every change.
        """
        if self._status is None:
            return confirmed
        reported = self._status.configuration(confirmed)
        ruled_out = {}
        for name in FIELDS:
            try:
                if name != 'mode' and name not in changes:
                    checked(name, getattr(confirmed, name), self._strobe_range)
            except InvalidValue:
                ruled_out[name] = getattr(reported, name)
        return replace(confirmed, **ruled_out)

    def _submit(
        self, values: Changes, now: float, done: Done, *, is_stream: bool = False,
        limit: float = CONFIGURE_LIMIT,
    ) -> None:
        try:
            self._goal(values)
        except InvalidValue as error:
            done(Result(False, str(error), permanent=True), now)
            return

        def prepare(now: float) -> Configure:
            # Requests before this one may have changed the other fields.
            change = self._goal(values)
            self._sent = _Sent(change.configuration, change.names, now)
            return change

        def finished(
            result: Result, change: Change[Status] | None, status: Status | None, now: float,
        ) -> None:
            self._is_unconfirmed = not result.success or result.superseded
            if isinstance(change, Configure):
                if self._sent:
                    self._sent.accepted = result.success or result.contradicted
                if result.success:
                    self._drop_fields(values)
                    if self._pending:
                        # The command carries all fields.
                        self._drop_fields([name for name, value in self._pending.values.items()
                                           if value == getattr(change.configuration, name)])
                    self._accept(change.configuration, status)
                elif result.contradicted:
                    self._unapplied, self._shown_instead = change.configuration, self._status
                    self._not_set = result.message
            done(result, now)

        self._queue.submit(Request(
            self._target, prepare, finished, now=now, deadline=now + limit,
            is_stream=is_stream), now)

    # Reports

    def restarted(self, now: float) -> None:
        """Note that the light has restarted, so that its configuration may be lost."""
        if self._restore and self.confirmed is not None:
            confirmed = self.confirmed
            values = {name: getattr(confirmed, name) for name in FIELDS
                      if name != 'mode' or confirmed.mode}
            # Overrides that have not been sent yet replace confirmed values.
            self._pending = _Pending({**values, **self._wanted}, _PendingReason.RESTART, now)
        elif self._pending and self._pending.reason in _SENT_ONCE:
            # The light has other values now.
            self._pending = None
        # The restart may have undone the command that brought the light within the limits.
        self._limiting = RepeatLimit(1, REPEAT_INTERVAL)

    def retry_pending(self, now: float) -> None:
        """Make pending values due, since the light is heard or a command was cancelled."""
        pending = self._pending
        if pending and pending.due < math.inf:
            pending.due, pending.has_ended = self._first_due(now), False

    def lost(self, message: str, now: float) -> None:
        """Note that the light is lost: no request must take effect when it is heard again."""
        self._queue.cancel(message, now)
        # It may restart meanwhile, which cannot be detected where several lights share the
        # address.
        self._limiting = RepeatLimit(1, REPEAT_INTERVAL)
        if self._setpoint is not None:
            self._setpoint = None
            self._setpoint_failed(message)

    def take(
        self, report: StatusReport[Status], now: float, *, can_follow: bool, switched_at: float,
        brightness_is_switch: bool,
    ) -> None:
        """
        Confirm the request under way, or follow the change of another sender.

        :param can_follow: whether the status shows a change for certain.
        :param switched_at: when the light was last switched by us, s.
        """
        status = self._status = report.status
        self._brightness_is_switch = brightness_is_switch
        self._shared_address = report.shared_address
        was_changing = self.is_changing
        self._queue.take(report, now)
        if self.confirmed is None and (was_changing or not status.complete):
            return
        reported = status.configuration(self.confirmed or NOTHING)
        if not was_changing:
            self._take_configuration(
                report, reported, now, can_follow=can_follow, switched_at=switched_at)
        if self._is_limited:
            self._keep_limits(reported, now)

    def _take_configuration(
        self, report: StatusReport[Status], reported: Configuration, now: float, *,
        can_follow: bool, switched_at: float,
    ) -> None:
        status = report.status
        if self._unapplied and self._shown_instead:
            def differs(before: Configuration) -> bool:
                return bool(unexpected_differences(
                    before, reported, status.error_flags, step=True))

            # It was applied late, or another sender has replaced it.
            if (not differs(self._unapplied)
                    or differs(self._shown_instead.configuration(NOTHING))):
                self._unapplied, self._not_set = None, ''
        if self.confirmed is None:
            self._adopt(reported, events.ChangeCause.FIRST_STATUS, now)
            if self._pending:
                self._pending.due, self._pending.has_ended = min(self._pending.due, now), False
        elif (pending := self._pending) and not report.shared_address and (
                shown := self._shown_goal(pending, self.confirmed, reported, status)):
            # The light has kept the values, another sender has restored them, or our command was
            # acknowledged too late.
            self._pending = None
            self._accept(shown, status)
            if pending.has_ended:
                self._restored(True, f'{shown.describe(list(pending.values))}, {CONFIRMED}')
        elif ((pending is None or pending.reason is _PendingReason.OVERRIDE)
                and can_follow and not report.shared_address):
            self._follow(status, self.confirmed, reported, switched_at, now)

    def _shown_goal(
        self, pending: _Pending, confirmed: Configuration, reported: Configuration, status: Status,
    ) -> Configuration | None:
        """
        Return the configuration with pending values that the light shows, None if it does not.

        Heat hides the brightness. Overrides are sent once even if the light shows them.
        """
        if pending.reason is _PendingReason.OVERRIDE and not pending.has_ended:
            return None
        goal = self._limits.clipped(replace(confirmed, **pending.values), self._strobe_range)
        not_shown = goal.differences(reported)
        if status.error_flags & DIMMING_FLAGS:
            not_shown.append('brightness')
        return None if any(name in pending.values for name in not_shown) else goal

    def _accept(self, goal: Configuration, status: Status | None) -> None:
        """
        Note that the light has accepted a configuration, with the status that shows it.

        Values that the light rounds to its own steps are confirmed as it shows them; values that
        differ for another reason (heat, external sync) as they were sent.
        """
        if status:
            reported = status.configuration(goal)
            far = goal.differences(reported)
            goal = replace(goal, **{
                name: getattr(reported, name)
                for name in goal.differences(reported, step=False) if name not in far})
        self._unapplied, self._not_set = None, ''
        self._adopt(goal, events.ChangeCause.REQUEST, 0.0)

    def _adopt(self, configuration: Configuration, cause: events.ChangeCause, now: float) -> None:
        old, self.confirmed = self.confirmed, configuration
        if cause is not events.ChangeCause.ROUNDING:
            self._reference = configuration
        names = [name for name in FIELDS
                 if old is None or getattr(old, name) != getattr(configuration, name)]
        if names:
            self._emit(events.ConfigurationChanged(self._address, configuration, names, cause))

    def _follow(
        self, status: Status, confirmed: Configuration, reported: Configuration,
        switched_at: float, now: float,
    ) -> None:
        names = unexpected_differences(confirmed, reported, status.error_flags, step=False)
        if not names:
            return
        far = unexpected_differences(
            self._reference or confirmed, reported, status.error_flags, step=True)
        cause = events.ChangeCause.ROUNDING
        if far:
            own = all(self._is_own(name, reported, switched_at, now) for name in far)
            cause = events.ChangeCause.REQUEST if own else events.ChangeCause.LIGHT
        if self._reassert and cause is events.ChangeCause.LIGHT and self._undo_change(
                status, confirmed, reported, now):
            return
        self._adopt(replace(confirmed, **{name: getattr(reported, name) for name in names}),
                    cause, now)

    def _undo_change(
        self, status: Status, confirmed: Configuration, reported: Configuration, now: float,
    ) -> bool:
        """Undo another sender's change up to the limit of repeats; return whether it is undone."""
        names = unexpected_differences(confirmed, reported, status.error_flags, step=True)
        # Where brightness is the switch, each command to a light that is off is an ON.
        if not names or self._brightness_is_switch and status.enabled is False:
            return False
        due = self._undoing.take(now)
        if due is not None:
            self._want({**{name: getattr(confirmed, name) for name in names}, **self._wanted},
                       _PendingReason.OTHER_SENDER, due)
        self._emit(events.ChangedByOther(
            self._address, reported.describe(names), due is not None))
        return due is not None

    def _keep_limits(self, reported: Configuration, now: float) -> None:
        """Bring a light that exceeds a limit back within it, once."""
        exceeded = events.LimitExceeded(
            self._address, self._limits.excess(reported),
            self._limits.impossible(self._strobe_range))
        if exceeded != self.limit_exceeded:
            self.limit_exceeded = exceeded
            self._emit(exceeded)
        # Values that undo a change by another sender may be due only later.
        is_free = self._pending is None or self._pending.reason is _PendingReason.OTHER_SENDER
        if exceeded.excess and is_free and (due := self._limiting.take(now)) is not None:
            limited = self._limits.clipped(reported, self._strobe_range)
            values = {name: getattr(limited, name) for name in reported.differences(limited)}
            self._pending = _Pending({**values, **self._wanted}, _PendingReason.LIMIT, due)

    def _is_own(
        self, name: str, reported: Configuration, switched_at: float, now: float,
    ) -> bool:
        """Return whether a change is a late or implied effect of a command of ours."""
        if now <= switched_at + IMPLIED_TIME:
            return True
        if self._sent is None or now > self._sent.at + LATE_TIME:
            return False
        if name not in self._sent.configuration.differences(reported):
            return True
        return (self._sent.accepted and name not in self._sent.names
                and now <= self._sent.at + IMPLIED_TIME)

    # Time

    def poll(self, now: float, *, connected: bool) -> None:
        """Send pending values, one command at a time."""
        if self._setpoint is not None and (accepted := self._accepted_setpoint):
            # A newer setpoint need not wait for the status.
            accepted.supersede(now)
        self._queue.poll(now)
        if self._queue.current is not None or not connected:
            return
        # Pending values go first, since a stream of setpoints may never end.
        if self._pending and now >= self._pending_due:
            self._send_pending(self._pending, now)
        if self._setpoint is not None and self._queue.current is None:
            value, self._setpoint = self._setpoint, None
            self._send_setpoint(value, now)

    @property
    def _pending_due(self) -> float:
        if self._pending is None or self._must_wait():
            return math.inf
        return self._pending.due

    @property
    def _accepted_setpoint(self) -> Request[Status] | None:
        """Return the setpoint that is accepted but not confirmed."""
        current = self._queue.current
        return current if current and current.is_stream and current.is_accepted else None

    def _send_setpoint(self, value: float, now: float) -> None:
        if (self.confirmed is not None and self.confirmed.brightness == value
                and not self._is_unconfirmed and not self._shared_address):
            return

        def finished(result: Result, now: float) -> None:
            if not (result.success or result.superseded):
                self._setpoint_failed(result.message)

        self._submit({'brightness': value}, now, finished, is_stream=True)

    def _setpoint_failed(self, message: str) -> None:
        self._emit(events.SetpointFailed(self._address, message))

    def _restored(self, success: bool, message: str) -> None:
        self._emit(events.ConfigurationRestored(self._address, success, message))

    def _send_pending(self, pending: _Pending, now: float) -> None:
        limit = RETRY_LIMIT if pending.has_ended else CONFIGURE_LIMIT
        pending.due = now + RESTORE_INTERVAL + limit - CONFIGURE_LIMIT
        try:
            self._goal(pending.values)
        except InvalidValue as error:
            # The values stay pending until a status comes; report that once.
            pending.due = math.inf
            pending.has_ended = True
            pending.failure = f'{", ".join(pending.values)} not sent: {error}'
            self._restored(False, pending.failure)
            return
        if self.confirmed is None:
            pending.due += FIRST_STATUS_TIMEOUT
        for name, value in pending.values.items():
            try:
                checked(name, value, self._strobe_range)
            except InvalidValue as error:
                self._drop_fields([name])
                self._restored(False, str(error))
        if self._pending is not pending:
            return

        def finished(result: Result, now: float) -> None:
            pending.has_ended = True
            pending.failure = '' if result.success else result.message
            pending.attempts += result.contradicted
            if (result.success or result.permanent
                    or pending.attempts >= MAX_CONTRADICTIONS
                    or pending.attempts and pending.reason in _SENT_ONCE):
                self._drop_fields(pending.values)
                self._not_set = pending.failure
                self._restored(result.success, result.message)

        self._submit(self._checked(pending.values), now, finished, limit=limit)

    def next_deadline(self, *, connected: bool) -> float:
        """Return when :meth:`poll` has something to do."""
        is_changing = self.is_changing
        if connected and self._setpoint is not None and (
                not is_changing or self._accepted_setpoint):
            return -math.inf
        if is_changing or not connected:
            return self._queue.next_deadline()
        return self._pending_due
