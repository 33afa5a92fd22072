# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The decision: one function ranks the standing requests to a light."""

from __future__ import annotations

from dataclasses import replace
import math
from typing import Any, NamedTuple

from .model import Configuration, FIELDS, Mode, SafetyLimits, StrobeRange
from ..payload.requests import Goal, Request, Values

# s; rqt_reconfigure gives up after 1.0 s, and the answer must arrive before. The middleware waits
# up to 0.1 s before it sends an answer to a client that it has not discovered yet.
CONFIGURE_LIMIT = 0.85
# %; set together with a strobe period where the duty cycle is 0, at which a light does not strobe.
DEFAULT_DUTY_CYCLE = 50.0
DUTY_CYCLE_NOTE = ('strobe_duty_cycle was 0 %, at which the light does not strobe, and was set to '
                   f'{DEFAULT_DUTY_CYCLE:g} %')


class Shown(NamedTuple):
    """
    The state that a light shows, as far as it matters to a decision.

    :param agreed: the values of the fields without a request; None before they are known.
    :param is_dark: whether it is off with a brightness of 0, so that a brightness may switch it
        on.
    :param brightness_is_switch: whether a brightness above 0 switches it on; None if unknown.
    :param strobe_range: that it reports.
    """

    agreed: Configuration | None = None
    is_dark: bool = False
    brightness_is_switch: bool | None = None
    strobe_range: StrobeRange = StrobeRange()


class Goals(NamedTuple):
    """
    The goals of one light, None where anything is fine.

    :param missing: the fields without which the configuration cannot be sent.
    """

    switch: Goal | None = None
    configuration: Goal | None = None
    missing: tuple[str, ...] = ()


def describe(values: Values) -> str:
    """Describe the values of a request, for people."""
    if 'enabled' in values:
        return 'on' if values['enabled'] else 'off'
    return Configuration(**{**dict.fromkeys(FIELDS, 0), **values}).describe(
        [name for name in FIELDS if name in values])


def decide(live: list[Request], shown: Shown, limits: SafetyLimits, now: float) -> Goals:
    """
    Return what the switch and the configuration of a light should be now.

    :param live: the open requests that may be sent.
    :param limits: clip each configuration.
    """
    switch = Goal.strongest(live, 'enabled', now)
    if all('enabled' in one.values for one in live):
        return Goals(switch)
    left_out: tuple[str, ...] = ()
    if switch is not None and not switch.values and shown.brightness_is_switch is not False:
        # Only a call may send a configuration that might undo an OFF.
        left_out = FIELDS
    elif shown.is_dark:
        left_out = ('brightness',)
    # The strongest last; what a call asks for is stronger than a setpoint.
    ranked = sorted(live, key=lambda one: (-one.why, one.is_call, one.since))
    wanted = [(one, values) for one in ranked if (values := {
        name: value for name, value in one.values.items()
        if name in FIELDS and (one.is_call or name not in left_out)})]
    # Rules that are not due yet go along with what is.
    if not any(now >= one.not_before for one, _ in wanted):
        return Goals(switch)
    return _configuration(wanted, shown, limits, now, may_light_up='brightness' not in left_out
                          )._replace(switch=switch)


def _configuration(
    wanted: list[tuple[Request, dict[str, Any]]], shown: Shown, limits: SafetyLimits, now: float,
    *, may_light_up: bool,
) -> Goals:
    """Return the goal of one command that carries all fields, each with the strongest value."""
    values: dict[str, Any] = {}
    for _, asked in wanted:
        values |= asked
    serves = tuple(one for one, asked in wanted
                   if all(values[name] == value for name, value in asked.items()))
    agreed, note = shown.agreed, ''
    if agreed is None:
        missing = tuple(name for name in FIELDS if name not in values)
        if missing:
            return Goals(None, Goal(values, serves), missing)
        agreed = Configuration(Mode.UNKNOWN, 0.0, 0.0, 0.0)
    elif (values.get('strobe_period') and 'strobe_duty_cycle' not in values
            and not agreed.strobe_duty_cycle):
        values['strobe_duty_cycle'] = DEFAULT_DUTY_CYCLE
        note = DUTY_CYCLE_NOTE
    # Under external sync a light may report the period of the signal, which it denies.
    base = replace(agreed, strobe_period=shown.strobe_range.nearest(agreed.strobe_period))
    if not may_light_up:
        # A brightness that is not asked for would switch the light on.
        base = replace(base, brightness=0.0)
    # Each command is made here, so the limits apply to every command.
    configuration = limits.clipped(replace(base, **values), shown.strobe_range)
    calls = [one for one in serves if one.is_call]
    is_asked = any(one.is_wish for one in serves)
    deadline = (max(one.deadline for one in calls) if calls
                else now + CONFIGURE_LIMIT if is_asked else math.inf)
    return Goals(None, Goal.of(
        configuration, serves, deadline=deadline, note=note, gives_way=not calls))
