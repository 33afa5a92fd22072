# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The rules: requests to a light that no user makes, and when they are due."""

from __future__ import annotations

from collections.abc import Callable, Collection
import math
from typing import Any

from . import events
from .commands import CONFIRMED
from .decide import describe
from .limit_watch import LimitWatch
from .model import Changes, checked, SafetyLimits, Status
from .settings import LightSettings
from .silence import Silence
from .twin import Twin
from ..mavlink.durations import format_seconds
from ..mavlink.errors import InvalidValue
from ..mavlink.retries import RetryPolicy
from ..payload.attempt import REPEAT, Target
from ..payload.requests import Request, Requests, Result, WEAK, Why

REQUIRED = RetryPolicy('a restored configuration, overrides and limits', 2.0, 60.0)
# s to wait for the first status before a complete set of overrides is sent without one.
FIRST_STATUS_TIMEOUT = 3.0
ENDED = Result(False, '', superseded=True)


class Rules:
    """
    Puts the requests that no user makes to one light. No I/O; times are s.

    :param emit: takes the events.
    :ivar silence: how long nothing has been requested.
    :ivar limits: how the light exceeds the limits.
    :ivar wants_off: whether the light must be switched off at the end of the process; False once
        it has shown that, None if it may stay on.
    """

    def __init__(
        self, target: Target, requests: Requests, twin: Twin, settings: LightSettings,
        emit: Callable[[events.LightEvent], None],
    ) -> None:
        self.silence = Silence(settings.off_after_silence)
        self.limits = LimitWatch(target.address)
        self.settings = settings
        self.wants_off: bool | None = None
        self._target = target
        self._requests = requests
        self._twin = twin
        self._emit = emit
        # The earliest time of an automatic OFF after one that the light has shown.
        self._off_due = -math.inf

    # OFF

    def note_request(self, now: float) -> None:
        """Note a request that counts: the silence begins again."""
        self.forget_silenced(now)
        self.silence.requested_at = now

    @property
    def silence_due(self) -> float:
        """Return when ``off_after_silence`` switches off a light that may be on, s."""
        return max(self.silence.ends_at, self._off_due)

    def put_due(self, now: float, silence_due: float) -> None:
        """
        Put the OFFs that are due; the light must be connected.

        :param silence_due: when the OFF of a silence is due, s; infinity for never.
        """
        if not self._requests.are_calling:
            self.silence.calling_since = -math.inf
        if now >= silence_due:
            self._put_off(Why.SILENCE, 'off_after_silence '
                          f'({format_seconds(self.silence.limit)})', now)
        if self.wants_off is not None and (self._twin.enabled or self.wants_off):
            self._put_off(Why.END, 'the end', now)
        self.forget_silenced(now)

    def put_release_off(self, reason: str, now: float) -> None:
        """Put the OFF of a release."""
        self._put(Why.RELEASE, {'enabled': False}, reason, now)

    def note_call(self, now: float) -> None:
        """Note a call beside which no other is under way."""
        self.silence.calling_since = now

    def want_off(self) -> None:
        """Want the OFF at the end of the process."""
        self.wants_off = True

    def finish(self) -> None:
        """Want only the OFF at the end of the process."""
        self.silence, self._off_due = Silence(0.0), -math.inf

    def switched(self, one: Request, on: bool, now: float) -> None:
        """Note that the light shows what a request wanted of its switch."""
        # Two lights with one address end an OFF and need the next at the speed of the line.
        self._off_due = -math.inf if one.why is Why.REQUEST else now + REPEAT.first
        if self.wants_off is not None:
            self.wants_off = on

    def forget_silenced(self, now: float) -> None:
        """Forget what would switch the light on, if it was requested before a silence."""
        if now >= self.silence.ends_at:
            self._requests.forget({'enabled': True, **(
                {'brightness': None} if self._twin.brightness_is_switch else {})})

    def _put_off(self, why: Why, reason: str, now: float) -> None:
        if not any(one.why is why for one in self._requests.standing):
            self._put(why, {'enabled': False}, reason, now, not_before=self._off_due)

    def _put(
        self, why: Why, values: dict[str, Any], reason: str, now: float, *,
        not_before: float = -math.inf,
    ) -> None:
        # While the process ends, nothing else is wanted.
        if why is Why.END or not self._target.commands.refusal:
            self._requests.put(
                Request(values, why, now, detail=reason, not_before=not_before), now)

    # The configuration

    @property
    def weak(self) -> list[Request]:
        """Return what is wanted though no user has asked for it since the start."""
        return [one for one in self._requests.standing if one.why in WEAK]

    @property
    def failure(self) -> str:
        """Return why the light does not have what is wanted, '' if it has or that is not known."""
        return next((one.failure for one in self.weak if one.failure), '')

    def require(self, values: Changes, now: float) -> None:
        """Send values that were given at the start, once the light has reported its own."""
        self._put(Why.OVERRIDE, self.settings.limits.clip(values), 'override', now,
                  not_before=self._first_due(now))

    def _first_due(self, now: float) -> float:
        return now if self._twin.agreed else now + FIRST_STATUS_TIMEOUT

    def begin_again(self, now: float) -> None:
        """Begin the tries again: the light is heard."""
        for one in self.weak:
            one.tried, one.failure, one.not_before = 0, '', self._first_due(now)

    def restore(self, values: dict[str, Any], now: float) -> None:
        """
        Restore a configuration: the light has restarted.

        :param values: what was agreed.
        """
        for one in self._requests.standing:
            one.may_be_repeated = False
        given = set[str]()
        for one in self.weak:
            if one.why is Why.OVERRIDE:
                given |= one.values.keys()
                continue
            # The light has other values now.
            if one.why is Why.RESTORED:
                values = {**values, **one.values}
            self._requests.end(one, ENDED, now)
        values = {name: value for name, value in values.items() if name not in given}
        if self.settings.restore_configuration and values:
            self._put(Why.RESTORED, values, 'restored after a restart', now)
        self.limits.limited_at = -math.inf

    @property
    def waiting(self) -> list[str]:
        """Return the fields that will be restored, so that their present values are not agreed."""
        return [name for one in self.weak if one.why is Why.RESTORED and not one.tried
                for name in one.values]

    def check_range(self, live: list[Request]) -> None:
        """Drop values of rules that are outside the range that the light reports."""
        for one in live:
            if one.why not in WEAK:
                continue
            for name, value in [*one.values.items()]:
                try:
                    checked(name, value, self._twin.strobe_range)
                except InvalidValue as error:
                    self._requests.drop(one, [name])
                    self._report(False, str(error))
                    # Other fields are sent with the value that the light has.
                    self._twin.keep(name)

    def drop_shown(self, status: Status) -> None:
        """Drop values that a status shows; overrides are sent once nevertheless."""
        reported, rules = self._twin.reported, self.weak
        if reported is None or self._twin.agreed is None:
            return
        shown: dict[str, Any] = {}
        for one in rules:
            one_is_shown = one.tried or one.why is not Why.OVERRIDE
            goal = self._twin.with_agreed(one.values, self.settings.limits)
            hidden = [*goal.differences(reported), *(['brightness'] if status.is_dimmed else [])]
            names = [name for name in one.values if one_is_shown and name not in hidden]
            shown |= {name: getattr(goal, name) for name in names}
            self._requests.drop(one, names)
        if shown and any(one.tried for one in rules) and not self.weak:
            self._report(True, f'{describe(shown)}, {CONFIRMED}')

    def ended(
        self, one: Request, names: Collection[str], result: Result, now: float,
    ) -> None:
        """
        Take the result of the command of a rule; one that failed is tried again later.

        :param names: the fields that the command has set; others wait until the light is on.
        """
        if result.success:
            if one.values.keys() <= set(names):
                self._requests.end(one, result, now)
            else:
                one.is_served = False
                self._requests.drop(one, names)
            self._report(True, result.message)
        elif result.permanent:
            for rule in self.weak:
                self._requests.end(rule, result, now)
            self._twin.fail(result.message)
            self._report(False, result.message)
        elif not result.superseded:
            self.failed(one, result.message, now)

    def failed(self, one: Request, text: str, now: float) -> None:
        """Try a rule again later, and report its first failure."""
        if not self.failure:
            self._report(False, f'{text}; it will be sent again', is_final=False)
        one.failure = text
        one.tried += 1
        one.is_served = False
        one.not_before = now + REQUIRED.wait(one.tried)

    def _report(self, success: bool, message: str, *, is_final: bool = True) -> None:
        self._emit(events.ConfigurationRestored(self._target.address, success, message, is_final))

    def change_settings(self, settings: LightSettings, now: float) -> bool:
        """Take other settings; return whether the limits differ."""
        before, self.settings = self.settings, settings
        if settings.off_after_silence != before.off_after_silence:
            self.forget_silenced(now)
            self.silence = Silence(settings.off_after_silence, now)
        if settings.limits == before.limits:
            return False
        self._change_limits(now)
        return True

    # Limits

    def _change_limits(self, now: float) -> None:
        """Apply other limits to what is wanted."""
        limits, self.limits.limited_at = self.settings.limits, -math.inf
        for one in [*self._requests.standing]:
            if one.why is Why.LIMIT:
                self._requests.end(one, ENDED, now)
            elif one.is_call and (excess := limits.excess_of(one.values)):
                self._requests.end(one, Result(False, excess), now)
            else:
                one.values = limits.clip(one.values)

    def keep_limits(self, now: float, *, is_busy: bool) -> None:
        """
        Bring a light that exceeds a limit back within it.

        :param is_busy: whether a configuration is under way.
        """
        limits = self.settings.limits
        if limits == SafetyLimits() and not self.limits.exceeded.excess:
            return
        if (reported := self._twin.reported) is None:
            return
        if self.limits.compare(limits, reported, self._twin.strobe_range, now):
            self._emit(self.limits.exceeded)
        limited = limits.clipped(reported, self._twin.strobe_range)
        beyond = {name: getattr(limited, name) for name in reported.differences(limited)}
        known = next((one for one in self.weak if one.why is Why.LIMIT), None)
        if known is not None and known.values.keys() != beyond.keys():
            self._requests.end(known, ENDED, now)
            known = None
        if known is None and beyond and self.limits.exceeded.excess and not is_busy:
            self._put(Why.LIMIT, beyond, 'limit', now, not_before=max(now, self.limits.due))

    def sent(self, now: float) -> None:
        """Note that a configuration was sent."""
        if any(one.why is Why.LIMIT for one in self.weak):
            self.limits.limited_at = now
