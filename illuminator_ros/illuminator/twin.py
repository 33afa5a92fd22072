# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The state that one light shows, the configuration agreed with it, and changes of others."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import replace
import math
from typing import Any, NamedTuple

from . import events
from .decide import Shown
from .model import (
    Configuration,
    FIELDS,
    Mode,
    NOTHING,
    SafetyLimits,
    Status,
    StrobeRange,
    unexpected_differences,
)
from .status_order import ChangingStates, StatusOrder
from ..mavlink.dialect import mavlink
from ..payload.attempt import Change, Target

# s after a command of ours in which a change of another value counts as implied by it.
IMPLIED_TIME = 2.0


class OwnCommands(NamedTuple):
    """
    The commands of ours that may have caused what a status shows.

    :param is_busy: whether one is under way.
    :param unconfirmed: the change that may have a late effect, None if there is none.
    :param implied_until: s; until then a change of another value counts as implied.
    """

    is_busy: bool = False
    unconfirmed: Change[Status] | None = None
    implied_until: float = -math.inf


class Failure(NamedTuple):
    """
    Why a light does not have the last configuration that was requested.

    :param text: for people, '' if it has it.
    :param goal: that configuration, None if it was not sent.
    :param instead: the status that showed something else.
    """

    text: str = ''
    goal: Configuration | None = None
    instead: Status | None = None


class Twin:
    """
    The state of one light as its statuses show it. No I/O; times are s.

    :param emit: takes the events.
    :ivar order: the newest status, and the order of those before.
    :ivar changing: whether the state goes back and forth.
    :ivar enabled: as reported, None if unknown; while heat keeps the light off, as before, since
        it may light up once it has cooled down.
    :ivar is_off_by_heat: whether heat has switched it off, and it has not been on since.
    :ivar agreed: the configuration that the light last accepted from us or, if another sender has
        changed it since, last reported; None before either.
    :ivar brightness_is_switch: whether a brightness above 0 switches the light on, as in ArduSub:
        it reports 0 while it is off; None if unknown.
    :ivar failure: why the light does not have the last configuration that was requested.
    """

    def __init__(self, target: Target, emit: Callable[[events.LightEvent], None]) -> None:
        self.order = StatusOrder()
        self.changing = ChangingStates()
        self.enabled: bool | None = None
        self.is_off_by_heat = False
        self.agreed: Configuration | None = None
        self.brightness_is_switch: bool | None = None
        self.failure = Failure()
        self._target = target
        self._emit = emit
        # The state that was reported last as an event.
        self._told: bool | None = None
        # Small steps away from it add up to a change.
        self._reference: Configuration | None = None
        self._measures_temperature = False

    # Known facts

    @property
    def status(self) -> Status | None:
        """Return the newest status, None before the first."""
        return self.order.newest

    @property
    def shown(self) -> Shown:
        """Return what matters to a decision."""
        status = self.order.newest
        return Shown(self.agreed, status is not None and status.is_dark,
                     self.brightness_is_switch, self.strobe_range)

    @property
    def strobe_range(self) -> StrobeRange:
        """Return the strobe periods that the light reports to be possible."""
        status = self.order.newest
        return status.strobe_range if status is not None else StrobeRange()

    @property
    def temperature(self) -> float | None:
        """Return the temperature, degC; None where it is not measured, or the sensor fails."""
        status = self.order.newest
        if (status is None or not self._measures_temperature
                or status.error_flags & mavlink.ILLUMINATOR_ERROR_FLAGS_THERMISTOR_FAILURE):
            return None
        return status.temperature

    @property
    def reported(self) -> Configuration | None:
        """Return the configuration that the newest status shows, None if it is not complete."""
        status = self.order.newest
        if status is None or self.agreed is None and not status.complete:
            return None
        return status.configuration(self.agreed or NOTHING)

    def with_agreed(self, values: Mapping[str, Any], limits: SafetyLimits) -> Configuration:
        """Return the agreed configuration with some other values, within the limits."""
        return limits.clipped(replace(self.agreed or NOTHING, **values), self.strobe_range)

    def shows(self, name: str, value: float) -> bool:
        """Return whether the newest status shows the value of a field."""
        status = self.order.newest
        if status is None:
            return False
        if name == 'enabled':
            return status.enabled is bool(value)
        if getattr(status, name) is None or status.is_dimmed or status.mode is Mode.EXTERNAL_SYNC:
            return False
        values: dict[str, Any] = {name: value}
        return name not in replace(NOTHING, **values).differences(status.configuration(NOTHING))

    # The switch

    def update(self, status: Status) -> None:
        """Take the state of a status that counts."""
        # Lights that do not measure send 0 (ArduSub), and a sensor rarely reads exactly 0.
        self._measures_temperature |= bool(status.temperature)
        self.is_off_by_heat = not status.enabled and (
            self.is_off_by_heat or status.is_off_by_heat)
        if not self.is_off_by_heat:
            self.enabled = status.enabled
        if status.enabled is False and status.brightness is not None:
            self.brightness_is_switch = status.brightness == 0.0

    def restarted(self, status: Status) -> None:
        """Take the state of the first status after a restart."""
        self.enabled, self.is_off_by_heat = None, False
        self.update(status)
        self.tell('')

    @property
    def is_told(self) -> bool:
        """Whether its present state was reported as an event."""
        return self.enabled is self._told

    @property
    def may_tell(self) -> bool:
        """Whether a change of the switch that no request made is a switch of another sender."""
        status = self.order.newest
        return (self._told is not None and not self.changing.are_changing and status is not None
                and not (status.is_dimmed or status.mode is Mode.EXTERNAL_SYNC))

    def tell(self, origin: str) -> None:
        """Report a state that differs from the last reported one; '' for no event."""
        if self.enabled is not None and self.enabled is not self._told:
            self._told = self.enabled
            if origin and not self._target.commands.refusal:
                self._emit(events.LightSwitched(self._target.address, self.enabled, origin))

    # The configuration

    def compare(self, waiting: Collection[str], ours: OwnCommands) -> None:
        """
        Follow what no command under way has changed.

        :param waiting: fields that will be restored.
        """
        status, reported = self.order.newest, self.reported
        if status is None or reported is None or ours.is_busy:
            return
        _, goal, instead = self.failure
        # It was applied late, or another sender has replaced it.
        if goal is not None and instead is not None and (
                not _differ(goal, status) or _differ(instead.configuration(NOTHING), status)):
            self.failure = Failure()
        if self.agreed is None:
            self._adopt(reported, events.ChangeCause.FIRST_STATUS)
        elif not self.changing.are_changing and reported != self.agreed:
            self._follow(self.agreed, status, reported, waiting, ours)

    def _follow(
        self, agreed: Configuration, status: Status, reported: Configuration,
        waiting: Collection[str], ours: OwnCommands,
    ) -> None:
        flags = status.error_flags
        names = [name for name in unexpected_differences(agreed, reported, flags, step=False)
                 if name not in waiting]
        if not names:
            return
        far = [name for name in unexpected_differences(
            self._reference or reported, reported, flags, step=True) if name in names]
        kind = events.ChangeCause.ROUNDING
        if far:
            kind = events.ChangeCause.LIGHT
            if ours.unconfirmed is not None and ours.unconfirmed.shown_by(status):
                kind = events.ChangeCause.LATE_EFFECT
            elif self.order.newest_at <= ours.implied_until:
                kind = events.ChangeCause.REQUEST
        self._adopt(replace(agreed, **{name: getattr(reported, name) for name in names}), kind)

    def agree(
        self, goal: Configuration, names: Collection[str], status: Status | None,
    ) -> None:
        """
        Agree on fields of a configuration that a command has set, with the status that shows it.

        Values that the light rounds to its own steps are agreed as it shows them; values that
        differ for another reason (heat, external sync) as they were sent.
        """
        self.failure = Failure()
        if status is not None:
            reported = status.configuration(goal)
            far = goal.differences(reported)
            goal = replace(goal, **{
                name: getattr(reported, name)
                for name in goal.differences(reported, step=False) if name not in far})
        agreed = self.agreed or goal
        self._adopt(replace(agreed, **{name: getattr(goal, name) for name in names}),
                    events.ChangeCause.REQUEST)

    def fail(self, text: str, goal: Configuration | None = None) -> None:
        """
        Note why the light does not have the last configuration that was requested.

        :param goal: that configuration, None if it was not sent.
        """
        self.failure = Failure(text, goal, self.status)

    def keep(self, name: str) -> None:
        """Agree on the value of a field that the light has, in place of one that it must not."""
        if self.agreed is not None and self.reported is not None:
            self._adopt(replace(self.agreed, **{name: getattr(self.reported, name)}),
                        events.ChangeCause.LIGHT)

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


def _differ(configuration: Configuration, status: Status) -> bool:
    return bool(unexpected_differences(
        configuration, status.configuration(NOTHING), status.error_flags, step=True))
