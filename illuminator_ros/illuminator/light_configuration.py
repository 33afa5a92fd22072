# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""
The configuration of a light: what was agreed with it, and what it must be set to.

One command carries all fields. So each command holds the values that are wanted now, those that
are required (restored after a restart, overrides, limits), and the agreed ones for the rest.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable
from dataclasses import dataclass, field, replace
from enum import Enum
import math

from . import events
from .commands import Configure, CONFIRMED
from .model import (
    Changes,
    checked,
    Configuration,
    FIELDS,
    InvalidValue,
    NOTHING,
    SafetyLimits,
    Status,
    StrobeRange,
    unexpected_differences,
)
from ..mavlink.retries import REQUIRED, Retries
from ..payload.confirmed_command import Change, Desired, Result, Target
from ..payload.device_property import Caller, Outcome, Property

# s; rqt_reconfigure gives up after 1.0 s, and the answer must arrive before. The middleware waits
# up to 0.1 s before it sends an answer to a client that it has not discovered yet.
CONFIGURE_LIMIT = 0.85
# s to wait for the first status before a complete set of overrides is sent without one.
FIRST_STATUS_TIMEOUT = 3.0
# s; a light that exceeds a limit is brought back within it once in this time.
LIMIT_INTERVAL = 10.0
# s after a command of ours in which a change of another value counts as implied by it.
IMPLIED_TIME = 2.0
# %; set together with a strobe period where the duty cycle is 0, at which a light does not strobe.
DEFAULT_DUTY_CYCLE = 50.0
# The reasons of values that no request asks for.
_REQUIRED, _SETPOINT = 'required values', 'a setpoint'
# Of a request that is refused before a command is made.
NOTHING_CHANGED = Configure.of(NOTHING, [])
NO_FAILURE = ('', None, None)


class Reason(Enum):
    """Why a field must have a value that no request asks for."""

    RESTORED = 'restored after a restart'
    OVERRIDE = 'override'
    LIMIT = 'limit'


@dataclass
class Required:
    """
    The values that must be sent though no request asks for them. Times are s.

    :param fields: the value of each field, and its reason.
    :param retries: when they are sent next.
    :param is_tried: whether they were sent.
    :param failure: why they are not confirmed, '' if that is not known.
    """

    fields: dict[str, tuple[float, Reason]]
    retries: Retries = field(default_factory=lambda: Retries(REQUIRED, math.inf))
    is_tried: bool = False
    failure: str = ''

    def drop(self, names: Iterable[str]) -> None:
        """Require some fields no more."""
        for name in names:
            self.fields.pop(name, None)
        if not self.fields:
            self.is_tried, self.failure = False, ''

    def with_reason(self, reason: Reason) -> list[str]:
        """Return the fields that are required for a reason."""
        return [name for name, (_, one) in self.fields.items() if one is reason]

    def merged(self, values: Changes, reason: Reason, due: float) -> Required:
        """Return these and other values; only restored ones do not replace those that wait."""
        newer = {name: (value, reason) for name, value in values.items()}
        return Required({**newer, **self.fields} if reason is Reason.RESTORED
                        else {**self.fields, **newer}, Retries(REQUIRED, due))


class LightConfiguration:
    """
    Keeps one light configured. No I/O; times are s.

    :param emit: takes the events.
    :param limits: apply to each command that is sent.
    :param restores: whether a light that has restarted gets its agreed configuration again.
    :ivar agreed: the configuration that the light last accepted from us or, if another sender has
        changed it since, last reported; None before either.
    :ivar exceeded: how the light exceeds the limits.
    :ivar brightness_is_switch: whether a brightness above 0 switches the light on, as in ArduSub:
        it reports 0 while it is off; None if unknown.
    :ivar property: the property of the light; :meth:`take` takes its outcomes.
    """

    def __init__(
        self, target: Target, emit: Callable[[events.LightEvent], None], *,
        limits: SafetyLimits, restores: bool,
    ) -> None:
        self.agreed: Configuration | None = None
        self.exceeded = events.LimitExceeded(target.address, (), '')
        self.brightness_is_switch: bool | None = None
        self.property: Property[Status] = Property(target)
        self._emit = emit
        self._target = target
        self._limits = limits
        self._restores = restores
        self._required = Required({})
        # When the required values are sent, infinity while none may be sent.
        self._due = math.inf
        self._setpoint: float | None = None
        # Small steps away from it add up to a change.
        self._reference: Configuration | None = None
        # Why the light does not have the last configuration that was requested, what that was,
        # and what the light showed instead.
        self._failure: tuple[str, Configuration | None, Status | None] = NO_FAILURE
        self._limited_at = -math.inf
        self._is_off_pending = False

    # The desired value

    def goal(self, now: float) -> Desired[Status] | None:
        """
        Return the configuration to send while no request is under way, None if any is fine.

        Required values go first, since a stream of setpoints may never end.

        :raises InvalidValue: if the light must not get it.
        """
        if now >= self._due:
            return Desired(self._change({}), _REQUIRED)
        if self._setpoint is not None and 'brightness' in self._sendable:
            return Desired(self._change({'brightness': self._setpoint}), _SETPOINT,
                           limit=CONFIGURE_LIMIT)
        return None

    @property
    def _sendable(self) -> Collection[str]:
        """Return the fields that may be sent now though no request asks for them."""
        if self._target.commands.refusal or (
                self._is_off_pending and self.brightness_is_switch is not False):
            # The process ends, or the configuration may undo an OFF.
            return ()
        status = self.property.newest
        return FIELDS if status is None or not status.is_dark else [
            name for name in FIELDS if name != 'brightness']

    def _required_values(self) -> dict[str, float]:
        """Return the required values that may be sent now."""
        return {name: value for name, (value, _) in self._required.fields.items()
                if name in self._sendable}

    def update(self, now: float, *, is_off_pending: bool) -> None:
        """
        Send what the goal asks for; the light must be connected.

        :param is_off_pending: whether an OFF is under way, which a brightness may undo.
        """
        self._is_off_pending, self._due = is_off_pending, math.inf
        if self.property.desired is not None:
            return
        if self._required.fields:
            self._check_required()
            if self._required_values():
                self._due = self._required.retries.due
        setpoint = self._setpoint
        if setpoint is None and now < self._due:
            return
        try:
            desired = self.goal(now)
        except InvalidValue as error:
            if now >= self._due:
                self._not_sent(f'{", ".join(self._required.fields)} not sent: {error}', _REQUIRED)
            else:
                self._not_sent(str(error), _SETPOINT)
            return
        if desired is None:
            return
        if desired.reason == _SETPOINT:
            self._setpoint = None
            status = self.property.newest
            if (self.agreed is not None and self.agreed.brightness == setpoint
                    and self.property.unconfirmed(now) is None
                    and not (status is not None and _differ(self.agreed, status))):
                return
        else:
            self._required.is_tried = True
            if self._required.with_reason(Reason.LIMIT):
                self._limited_at = now
        self._due = math.inf
        self.property.want(desired, now)

    def _check_required(self) -> None:
        """Drop required values that are outside the range that the light reports."""
        for name, (value, _) in list(self._required.fields.items()):
            try:
                checked(name, value, self.strobe_range)
            except InvalidValue as error:
                self._required.drop([name])
                self._restored(False, str(error))
                if self.agreed is not None and (status := self.property.newest) is not None:
                    # Other fields are sent with the value that the light has.
                    kept = getattr(status.configuration(self.agreed), name)
                    self._adopt(replace(self.agreed, **{name: kept}), events.ChangeCause.LIGHT)

    def _not_sent(self, message: str, reason: str, *callers: Caller) -> None:
        """Note that the light must not get a value."""
        if reason == _SETPOINT:
            self._setpoint = None
        self.property.outcomes.append(Outcome(
            Desired(NOTHING_CHANGED, reason), Result(False, message, permanent=not reason), None,
            callers))

    @property
    def _under_way(self) -> Configure | None:
        """Return the change that is under way, None if there is none."""
        desired = self.property.desired
        return (desired.change if desired is not None and isinstance(desired.change, Configure)
                else None)

    def _change(self, values: Changes) -> Configure:
        """
        Return the change that sets some fields, and the required fields.

        :raises InvalidValue: if nothing is agreed yet and the values are not complete.
        """
        values = {**self._required_values(), **values}
        base, names, note = self.agreed, [*values], ''
        if under_way := self._under_way:
            # A newer request carries the values of the one that it replaces.
            base, names = under_way.configuration, [*under_way.names, *names]
        if base is None:
            if missing := [name for name in FIELDS if name not in values]:
                raise InvalidValue(
                    'the light has not reported its configuration yet, so '
                    f'{", ".join(missing)} must be set in the same call')
            goal = Configuration(**values)
        else:
            if (values.get('strobe_period') and 'strobe_duty_cycle' not in values
                    and not base.strobe_duty_cycle):
                values['strobe_duty_cycle'] = DEFAULT_DUTY_CYCLE
                names.append('strobe_duty_cycle')
                note = ('strobe_duty_cycle was 0 %, at which the light does not strobe, and was '
                        f'set to {DEFAULT_DUTY_CYCLE:g} %')
            # Under external sync a light may report the period of the signal, which it denies.
            base = replace(base, strobe_period=self.strobe_range.nearest(base.strobe_period))
            status = self.property.newest
            if 'brightness' not in names and (
                    status is not None and status.is_dark
                    or self._is_off_pending and self.brightness_is_switch):
                # A brightness that is not asked for would switch the light on.
                base = replace(base, brightness=0.0)
            goal = replace(base, **values)
        # Each command is made here, so the limits apply to every command.
        limited = self._limits.clipped(goal, self.strobe_range)
        ordered = [name for name in FIELDS
                   if name in names or name in goal.differences(limited)]
        return Configure.of(limited, ordered, note)

    # Requests

    def configure(self, changes: Changes, now: float, caller: Caller) -> None:
        """
        Change some fields with one command; the light must be connected.

        :param changes: values by name, see :data:`~.model.FIELDS`; if one is wrong none is sent,
            and the outcome says why.
        """
        try:
            values = {name: checked(name, value, self.strobe_range)
                      for name, value in changes.items()}
            for name, value in values.items():
                self._limits.check(name, value)
            if (self._is_off_pending and self.brightness_is_switch is None
                    and 'brightness' not in values):
                raise InvalidValue('an OFF is under way, which the brightness in this command '
                                   'may undo; repeat it')
            change = self._change(values)
        except InvalidValue as error:
            self._not_sent(str(error), '', caller)
        else:
            self.property.want(Desired(change, limit=CONFIGURE_LIMIT), now, caller)

    def set_brightness(self, brightness: float) -> None:
        """Take a setpoint of a stream, %, checked; the next update sends it."""
        try:
            self._limits.check('brightness', brightness)
        except InvalidValue as error:
            brightness = self._limits.max_brightness
            self._emit(events.SetpointClipped(self._target.address, str(error)))
        self._setpoint = brightness

    def require(self, values: Changes, now: float) -> None:
        """
        Send overrides, and what is required already, once the light has reported its values.

        :param values: by name, checked, except against the range that the light reports; none if
            the light is heard again.
        """
        due = now if self.agreed else now + FIRST_STATUS_TIMEOUT
        self._required = self._required.merged(values, Reason.OVERRIDE, due)

    def cancel(self, message: str, now: float, *, superseded: bool) -> None:
        """End all requests; required values stay."""
        if self._setpoint is not None and not superseded:
            self._emit(events.SetpointFailed(self._target.address, message))
        self._setpoint = None
        self.property.cancel(message, now, superseded=superseded)

    def change_limits(self, limits: SafetyLimits, now: float) -> None:
        """Replace the limits, and bring a light that exceeds them back within them."""
        # The next update sends what they demand.
        self._limits, self._limited_at, self._due = limits, -math.inf, -math.inf
        self._required.drop(self._required.with_reason(Reason.LIMIT))
        desired = self.property.desired
        if desired is not None and (under_way := self._under_way):
            goal = under_way.configuration
            limited = limits.clipped(goal, self.strobe_range)
            if limited != goal or desired.reason == _REQUIRED:
                # A resend would exceed the limits. The newest setpoint is sent as the limit.
                if desired.reason == _SETPOINT and self._setpoint is None:
                    self._setpoint = limited.brightness
                self.property.cancel(
                    ', '.join(limits.excess(goal)) or 'a limit was changed', now,
                    superseded=bool(desired.reason))
        status = self.property.newest
        if status is not None and (self.agreed or status.complete):
            self._keep_limits(status.configuration(self.agreed or NOTHING), now)

    # Known facts

    @property
    def strobe_range(self) -> StrobeRange:
        """Return the strobe periods that the light reports to be possible."""
        status = self.property.newest
        return status.strobe_range if status is not None else StrobeRange()

    @property
    def discrepancy(self) -> str:
        """Why the light does not have a configuration that it should have, '' if it has."""
        return self._required.failure or self._failure[0]

    def may_switch(self, now: float) -> bool:
        """Return whether a command of ours may have switched the light by its brightness."""
        return bool(self.brightness_is_switch) and (
            self.property.command is not None or now <= self.property.sent_at + IMPLIED_TIME)

    def excess(self, status: Status) -> tuple[str, ...]:
        """Describe how a status exceeds the limits."""
        if self._limits == SafetyLimits():
            return ()
        return self._limits.excess(status.configuration(self.agreed or NOTHING))

    # Reports

    def reported(
        self, status: Status, now: float, *, can_follow: bool, switched_at: float,
    ) -> None:
        """
        Take a status that is not older than those before.

        :param can_follow: whether the parameters follow what it shows.
        :param switched_at: when the light was last switched by us, s.
        """
        if status.enabled is False and status.brightness is not None:
            self.brightness_is_switch = status.brightness == 0.0
        was_busy, late = self.property.command is not None, self.property.unconfirmed(now)
        self.property.reported(status, now)
        self._compare(status, now, was_busy=was_busy, late=late, can_follow=can_follow,
                      switched_at=switched_at)

    def restarted(self, status: Status, now: float) -> None:
        """Take the first status after a restart: the configuration may be lost."""
        under_way = self._under_way
        # A set ends before the fence of the restart, and its values must not be lost with it.
        wanted = under_way.configuration if under_way else self.agreed
        if self._restores and wanted is not None:
            values = {name: getattr(wanted, name) for name in FIELDS
                      if name != 'mode' or wanted.mode}
            self._required = self._required.merged(values, Reason.RESTORED, now)
        else:
            # The light has other values now.
            self._required.drop(self._required.with_reason(Reason.LIMIT))
        self._limited_at = -math.inf
        self.property.restarted(status, now)
        self._compare(status, now, was_busy=under_way is not None)

    def _compare(
        self, status: Status, now: float, *, was_busy: bool, late: Change[Status] | None = None,
        can_follow: bool = True, switched_at: float = -math.inf,
    ) -> None:
        """
        Compare a status with the limits and, if it is not the effect of a command, with the rest.

        :param was_busy: whether a command was under way.
        :param late: the change of ours that may have a late effect, None if there is none.
        """
        if self.agreed is None and not status.complete:
            return
        reported = status.configuration(self.agreed or NOTHING)
        if not was_busy:
            _, goal, instead = self._failure
            # It was applied late, or another sender has replaced it.
            if goal is not None and instead is not None and (
                    not _differ(goal, status) or _differ(instead.configuration(NOTHING), status)):
                self._failure = NO_FAILURE
            if self.agreed is None:
                self._adopt(reported, events.ChangeCause.FIRST_STATUS)
                self._required.retries.due = min(self._required.retries.due, now)
            if self._required.fields:
                self._drop_shown(status, reported)
            if can_follow and reported != self.agreed:
                self._follow(status, reported, now, late=late, switched_at=switched_at)
        self._keep_limits(reported, now)

    def _drop_shown(self, status: Status, reported: Configuration) -> None:
        """Drop the required values that a status shows; overrides are sent once nevertheless."""
        required, was_tried = self._required, self._required.is_tried
        assert self.agreed is not None
        values: Changes = {name: value for name, (value, _) in required.fields.items()}
        goal = self._limits.clipped(replace(self.agreed, **values), self.strobe_range)
        hidden = [*goal.differences(reported), *(['brightness'] if status.is_dimmed else [])]
        if not was_tried:
            hidden += required.with_reason(Reason.OVERRIDE)
        shown = [name for name in FIELDS if name in required.fields and name not in hidden]
        required.drop(shown)
        if was_tried and not required.fields:
            self._restored(True, f'{goal.describe(shown)}, {CONFIRMED}')

    def _follow(
        self, status: Status, reported: Configuration, now: float, *,
        late: Change[Status] | None, switched_at: float,
    ) -> None:
        """Follow a change that no command under way has made."""
        assert self.agreed is not None
        waiting = [] if self._required.is_tried else self._required.with_reason(Reason.RESTORED)
        flags = status.error_flags
        names = [name for name in unexpected_differences(self.agreed, reported, flags, step=False)
                 if name not in waiting]
        if not names:
            return
        far = [name for name in unexpected_differences(
            self._reference or reported, reported, flags, step=True) if name in names]
        cause = events.ChangeCause.ROUNDING
        if far:
            cause = events.ChangeCause.LIGHT
            if late is not None and late.shown_by(status):
                cause = events.ChangeCause.LATE_EFFECT
            elif now <= IMPLIED_TIME + max(
                    switched_at, -math.inf if late else self.property.sent_at):
                cause = events.ChangeCause.REQUEST
        self._adopt(replace(self.agreed, **{name: getattr(reported, name) for name in names}),
                    cause)

    def _adopt(self, configuration: Configuration, cause: events.ChangeCause) -> None:
        """Agree on a configuration, and report what is new in it."""
        old, self.agreed = self.agreed, configuration
        if cause is not events.ChangeCause.ROUNDING:
            self._reference = configuration
        names = [name for name in FIELDS
                 if old is None or getattr(old, name) != getattr(configuration, name)]
        if names:
            self._emit(events.ConfigurationChanged(
                self._target.address, configuration, names, cause))

    def _keep_limits(self, reported: Configuration, now: float) -> None:
        """Bring a light that exceeds a limit back within it."""
        if self._limits == SafetyLimits() and not self.exceeded.excess:
            return
        excess = self._limits.excess(reported)
        is_again = bool(excess) and (
            self.exceeded.is_again if self.exceeded.excess
            else now < self._limited_at + LIMIT_INTERVAL)
        exceeded = events.LimitExceeded(
            self._target.address, excess, self._limits.impossible(self.strobe_range), is_again)
        if exceeded != self.exceeded:
            self.exceeded = exceeded
            self._emit(exceeded)
        limited = self._limits.clipped(reported, self.strobe_range)
        beyond, known = reported.differences(limited), self._required.with_reason(Reason.LIMIT)
        self._required.drop([name for name in known if name not in beyond])
        values = {name: getattr(limited, name) for name in beyond if name not in known}
        if excess and values and self.property.command is None:
            self._required = self._required.merged(
                values, Reason.LIMIT, max(now, self._limited_at + LIMIT_INTERVAL))

    # Outcomes

    def take(self, outcome: Outcome[Status], now: float) -> None:
        """Take the end of a value."""
        desired, result, change = outcome.desired, outcome.result, outcome.desired.change
        assert isinstance(change, Configure)
        if result.success:
            self._accepted(change.configuration, outcome.status)
            self._required.drop([
                name for name, (value, _) in [*self._required.fields.items()]
                if name in change.names or value == getattr(change.configuration, name)])
        elif result.contradicted:
            self._failure = result.message, change.configuration, self.property.newest
        if desired.reason == _REQUIRED and not result.superseded:
            self._required_ended(result, now)
        elif desired.reason == _SETPOINT and not (result.success or result.superseded):
            self._emit(events.SetpointFailed(self._target.address, result.message))

    def _accepted(self, goal: Configuration, status: Status | None) -> None:
        """
        Agree on a configuration that a command has set, with the status that shows it.

        Values that the light rounds to its own steps are agreed as it shows them; values that
        differ for another reason (heat, external sync) as they were sent.
        """
        self._failure = NO_FAILURE
        if status is not None:
            reported = status.configuration(goal)
            far = goal.differences(reported)
            goal = replace(goal, **{
                name: getattr(reported, name)
                for name in goal.differences(reported, step=False) if name not in far})
        self._adopt(goal, events.ChangeCause.REQUEST)

    def _required_ended(self, result: Result, now: float) -> None:
        """Take the result of a command that no request has asked for."""
        required = self._required
        required.retries.note_try(now)
        if result.success:
            self._restored(True, result.message)
        elif result.permanent:
            self._required = Required({})
            self._failure = result.message, None, None
            self._restored(False, result.message)
        else:
            if not required.failure:
                self._restored(False, f'{result.message}; it will be sent again', is_final=False)
            required.failure = result.message

    def _restored(self, success: bool, message: str, *, is_final: bool = True) -> None:
        self._emit(events.ConfigurationRestored(self._target.address, success, message, is_final))

    # Time

    def next_deadline(self) -> float:
        """Return when ``property.poll`` or :meth:`update` has something to do."""
        return min(self.property.next_deadline(), self._due)


def _differ(configuration: Configuration, status: Status) -> bool:
    return bool(unexpected_differences(
        configuration, status.configuration(NOTHING), status.error_flags, step=True))


def requested(outcome: Outcome[Status]) -> float | None:
    """Return the brightness that a request has set, %; None if it has set none."""
    change = outcome.desired.change
    if isinstance(change, Configure) and 'brightness' in change.names:
        return change.configuration.brightness
    return None
