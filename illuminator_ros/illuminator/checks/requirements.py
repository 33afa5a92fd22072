# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The requirements on a light, and its checks: these requirements in the order of checking."""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Sequence
from dataclasses import astuple
from functools import partial

from .session import (
    CheckedChange,
    CONFIGURE,
    differences,
    DIM,
    LightSession,
    LOW,
    ON_OFF,
    same,
    status_text,
)
from ..messages import IlluminatorStatus
from ..model import Configuration, flag_names, float32, Mode, Status, StrobeRange
from ...checks import component_requirements as component
from ...checks.outcomes import fail_if, Failed, Skipped
from ...checks.requirements import Option, PayloadChecks, Requirement, requirement
from ...checks.specifications import COMMAND, MESSAGES, ROUTING, Specification
from ...mavlink.dialect import mavlink
from ...mavlink.messages import Address, ComponentInformationBasic

ILLUMINATOR = Specification(
    'illuminator protocol', 'https://mavlink.io/en/services/illuminator.html')
CONFIGURE_SECTION = 'MAV_CMD_DO_ILLUMINATOR_CONFIGURE'
INTERNAL = float(Mode.INTERNAL_CONTROL)


# The command protocol, with commands that switch the light

@requirement('other-target', 'ignores commands for other components and systems', ROUTING,
             'Routing Detail', changes=True)
async def other_target(light: LightSession) -> None:
    """Send ON to addresses without a component, in the same and in another system."""
    await light.ensure_dim()
    others = (light.components.free_component(200),
              Address(light.components.free_system(), light.device.component or 200))
    failures = []
    for other in others:
        one = await light.command(ON_OFF, 1, target=other, is_foreign=True)
        if await light.enabled():
            failures.append(one.failure(f'switched on by a command for {other}'))
            await light.baseline()
        elif one.acks:
            failures.append(one.failure(f'answered a command for {other}: {one.answer}'))
    fail_if(failures)


@requirement('command-int', 'executes a command as COMMAND_INT, if it takes that message', COMMAND,
             'Use COMMAND_INT or COMMAND_LONG?', changes=True)
async def command_int(light: LightSession) -> str:
    """Switch the light on with COMMAND_INT."""
    await light.ensure_dim()
    change = await light.switch(True, as_int=True)
    one = change.transaction
    component.check_command_int(one)
    if not one.accepted and one.result != mavlink.MAV_RESULT_COMMAND_LONG_ONLY:
        raise Failed(f'COMMAND_INT {one.text}: {one.answer}', one.lines)
    fail_if([change.contradiction])
    return one.answer


@requirement('repeated', 'handles a repeated command like the first one', COMMAND,
             'COMMAND_LONG sequence', changes=True)
async def repeated(light: LightSession) -> None:
    """Repeat ON, as after a lost acknowledgement."""
    await light.ensure_dim()
    first = (await light.switch(True)).transaction
    if not first.accepted:
        raise Skipped(f'it cannot be switched on: {first.answer}')
    if not await light.enabled():
        raise Skipped('the status does not show it on after the first command')
    again = await light.command(ON_OFF, 1, confirmation=1)
    enabled = await light.enabled()
    if not again.accepted:
        raise Failed(f'the second {again.text}: {again.answer}')
    if enabled is False:
        raise Failed(f'the second {again.text} switched it off')


# Switching and configuring

@requirement('on-configuration', 'keeps its configuration when it is switched on', ILLUMINATOR,
             'ON/OFF', changes=True)
async def on_configuration(light: LightSession) -> str:
    """Configure a low brightness, switch the light on, and compare with that."""
    await light.ensure_dim()
    dim = Configuration(Mode.INTERNAL_CONTROL, DIM, 0.0, 0.0)
    configured = await light.configure(brightness=DIM)
    if not configured.transaction.accepted or configured.not_shown:
        raise Skipped(f'it cannot be dimmed to {DIM:g} %')
    if await light.enabled():
        # A brightness above 0 switches some lights on.
        await light.switch(False)
    one = (await light.switch(True)).transaction
    status = await light.after_change(lambda status: differences(dim, status))
    if status is None or not status.enabled:
        raise Skipped(f'{one.text}: {one.answer}, and the status does not show it on')
    if names := differences(dim, status):
        raise one.failure(f'changed {" and ".join(names)}: {status_text(status)} instead of '
                          + dim.describe())
    return f'{status.brightness:g} %'


@requirement('configure-switch', 'stays off, or on, when it is configured', ILLUMINATOR,
             'CONFIGURE', changes=True)
async def configure_switch(light: LightSession) -> None:
    """Configure a low brightness while the light is off, and then while it is on."""
    await light.ensure_dim()
    failures = []
    for on, brightness in ((False, LOW / 2), (True, LOW)):
        if await light.enabled() is not on:
            await light.switch(on)
        if await light.enabled() is not on:
            raise Skipped(f'the status does not show it {"on" if on else "off"}')
        one = (await light.configure(brightness=brightness)).transaction
        if await light.enabled() is not on:
            failures.append(one.failure(f'switched it {"off" if on else "on"}'))
    fail_if(failures)


@requirement('on', 'can be switched on', ILLUMINATOR, 'ON/OFF', changes=True)
async def on(light: LightSession) -> None:
    """Switch the light on at low brightness."""
    await light.ensure_dim()
    await _switch(light, True)


@requirement('off', 'can be switched off', ILLUMINATOR, 'ON/OFF', changes=True)
async def off(light: LightSession) -> None:
    """Switch the light off while it is on; a light that is already off shows no change."""
    if await light.enabled() is False:
        await light.ensure_dim()
        await light.switch(True)
    await _switch(light, False)


async def _switch(light: LightSession, on: bool) -> None:
    before = await light.enabled()
    fail_if([(await light.switch(on)).unmet('enable')])
    if before is on:
        state, other = ('on', 'off') if on else ('off', 'on')
        raise Skipped(f'accepted, but it was {state} and could not be switched {other} before')


async def _synchronise(light: LightSession) -> CheckedChange:
    """Configure external sync; at 0 % without consent, because a signal may strobe the light."""
    brightness = LOW if light.consent else 0.0
    return await light.configure(Mode.EXTERNAL_SYNC, brightness=brightness)


async def _unmet_mode(light: LightSession, one: CheckedChange, mode: Mode) -> Failed | None:
    """
    Return why a mode was not configured, None if a status does not contradict.

    :raises Skipped: if the light rejects a mode that it does not list.
    """
    if one.transaction.result == mavlink.MAV_RESULT_DENIED:
        status = await light.status()
        bitmask = status.mode_bitmask if status else 0
        # Lights differ in the meaning of a bit: the value of the enum, or 1 << value.
        shifts = [shift for shift in (0, 1) if not bitmask & ~(3 << shift)]
        if not shifts or not all(bitmask & mode << shift for shift in shifts):
            raise Skipped(f'MAV_RESULT_DENIED, and mode_bitmask 0x{bitmask:x} need not list it')
    return one.unmet('mode')


@requirement('mode-internal', 'accepts mode internal_control if mode_bitmask lists it',
             ILLUMINATOR, 'MODES', changes=True)
async def internal(light: LightSession) -> None:
    """Configure the mode, from external_sync if the light accepts that."""
    await light.baseline()
    await _synchronise(light)
    before = await light.status()
    # The brightness changes, too, because a light with only one mode would show no change.
    one = await light.configure(Mode.INTERNAL_CONTROL, brightness=DIM)
    after = await light.status()
    if before and after and same(before, after):
        fail_if([one.contradiction])
    fail_if([await _unmet_mode(light, one, Mode.INTERNAL_CONTROL)])


@requirement('mode-external', 'accepts mode external_sync if mode_bitmask lists it', ILLUMINATOR,
             'MODES', changes=True)
async def external(light: LightSession) -> None:
    """Configure the mode."""
    await light.baseline()
    fail_if([await _unmet_mode(light, await _synchronise(light), Mode.EXTERNAL_SYNC)])


@requirement('brightness', 'applies a brightness', ILLUMINATOR, 'CONFIGURE', changes=True)
async def brightness(light: LightSession) -> str:
    """Set several values, 100 % only with consent."""
    await light.baseline()
    values = (50.0, 100.0, 33.3) if light.consent else (5.0, DIM)
    fail_if([(await light.configure(brightness=value)).unmet('brightness') for value in values])
    return ', '.join(f'{value:g} %' for value in values)


# Invalid parameters

def _rejects(
    name: str, title: str, *commands: tuple[float, ...],
    state: Sequence[Callable[[LightSession], Awaitable[None]]] = (LightSession.baseline,),
    section: str = CONFIGURE_SECTION,
) -> Requirement[LightSession]:
    """
    Return the requirement that a light rejects some commands.

    :param commands: each a MAV_CMD and its parameters.
    :param state: steps that bring the light to the state in which the commands are sent.
    """
    @requirement(name, title, MESSAGES, section, changes=True)
    async def check(light: LightSession) -> None:
        for step in state:
            await step(light)
        fail_if([await light.rejected(int(command), *params) for command, *params in commands])
    return check


on_off_values = _rejects(
    'on-off-values', 'rejects ON_OFF values other than 0 and 1',
    *((ON_OFF, value) for value in (-1.0, 2.0, 0.5, 255.0)), state=(LightSession.ensure_dim,),
    section='MAV_CMD_ILLUMINATOR_ON_OFF')
mode_values = _rejects(
    'mode-values', 'rejects undefined modes',
    *((CONFIGURE, mode, LOW, 0.0, 0.0) for mode in (-1.0, 3.0, 1.5, 255.0)))
brightness_values = _rejects(
    'brightness-values', 'rejects a brightness outside 0 to 100 %',
    *((CONFIGURE, INTERNAL, value, 0.0, 0.0) for value in (-1.0, 101.0)),
    state=(LightSession.ensure_unlit, LightSession.baseline))
# In each parameter separately: every comparison with NaN is false, so it can pass range checks.
not_a_number = _rejects(
    'not-a-number', 'rejects NaN and infinity in every parameter',
    *(command for value in map(float, ('nan', 'inf', '-inf')) for command in (
        (ON_OFF, value), (CONFIGURE, value, LOW, 0.0, 0.0), (CONFIGURE, INTERNAL, value, 0.0, 0.0),
        (CONFIGURE, INTERNAL, LOW, value, 0.0), (CONFIGURE, INTERNAL, LOW, 0.0, value))),
    state=(LightSession.ensure_unlit, LightSession.ensure_dim))


# Strobe, which needs consent

def _strobe(
    name: str, title: str, specification: Specification, section: str,
    values: Callable[[StrobeRange], list[tuple[float, float]]], *shown: str,
) -> Requirement[LightSession]:
    """
    Return a requirement on strobe periods and duty cycles.

    :param values: returns periods, s, and duty cycles, %, from the limits that the light reports.
    :param shown: the fields in which the status must show these; without any, the light must
        reject the values.
    """
    @requirement(name, title, specification, section, needs_consent=True)
    async def check(light: LightSession) -> str:
        await light.baseline()
        status = await light.status()
        if status is None or not status.strobe_range.known:
            raise Skipped('it reports no strobe limits')
        sent = values(status.strobe_range)
        fail_if([
            (await light.configure(period=period, duty=duty)).unmet(*shown) if shown
            else await light.rejected(CONFIGURE, INTERNAL, LOW, period, duty)
            for period, duty in sent])
        return ', '.join(f'{period:g} s' for period in dict.fromkeys(one[0] for one in sent))
    return check


def _within(period: float, reported: StrobeRange) -> float:
    return float32(min(max(period, reported.min_strobe_period), reported.max_strobe_period))


STROBE = (
    _strobe('strobe', 'applies a strobe period and duty cycle', ILLUMINATOR, 'CONFIGURE',
            lambda reported: [
                (_within(1.0, reported), 50.0), (_within(0.5, reported), 25.0), (0.0, 0.0)],
            'strobe_period', 'strobe_duty_cycle'),
    _strobe('strobe-limit-values', 'accepts the strobe periods that it reports as its limits',
            MESSAGES, 'ILLUMINATOR_STATUS',
            # Except 0, which means no strobe.
            lambda reported: [(one, 50.0) for one in astuple(reported) if one],
            'strobe_period'),
    _strobe('strobe-values', 'rejects a strobe period outside its limits',
            MESSAGES, CONFIGURE_SECTION,
            # Half of a smallest period of 0 would be 0, which means no strobe.
            lambda reported: [
                (period, 50.0) for period in (
                    -1.0, reported.max_strobe_period * 1.5, reported.min_strobe_period / 2)
                if period]),
    _strobe('duty-cycle', 'accepts strobe duty cycles of 0 % and 100 %',
            MESSAGES, CONFIGURE_SECTION,
            lambda reported: [(_within(1.0, reported), duty) for duty in (0.0, 100.0)],
            'strobe_duty_cycle'),
    _strobe('duty-cycle-values', 'rejects a duty cycle outside 0 to 100 %',
            MESSAGES, CONFIGURE_SECTION,
            lambda reported: [(_within(1.0, reported), duty) for duty in (-1.0, 101.0)]),
)


# ILLUMINATOR_STATUS

# K; the smallest rise of temperature that explains a flag.
STEP = 0.5
THERMAL = (mavlink.ILLUMINATOR_ERROR_FLAGS_THERMAL_THROTTLING,
           mavlink.ILLUMINATOR_ERROR_FLAGS_OVER_TEMPERATURE_SHUTDOWN)

reports = partial(requirement, specification=MESSAGES, section='ILLUMINATOR_STATUS')


async def _status(light: LightSession) -> Status:
    idle = light.idle(IlluminatorStatus)
    status = Status.from_message(idle[-1][1]) if idle else await light.status()
    if status is None:
        raise Skipped('no ILLUMINATOR_STATUS was received')
    return status


@reports('status-content', 'reports a valid value in every field of ILLUMINATOR_STATUS')
async def content(light: LightSession) -> None:
    """Look for values out of range; a light without a thermometer may report NaN."""
    if invalid := [one for one in (await _status(light)).invalid if one != 'temp_c nan']:
        raise Failed(', '.join(invalid))


@reports('status-mode', 'lists its current mode in mode_bitmask')
async def mode(light: LightSession) -> str:
    """Accept both conventions of existing lights: the value of the enum, and 1 << value."""
    status = await _status(light)
    if status.mode is Mode.UNKNOWN:
        raise Skipped('it reports mode unknown')
    if not status.mode_bitmask & (status.mode | 1 << status.mode):
        raise Failed(f'mode {status.mode.label} ({int(status.mode)}) is not in mode_bitmask '
                     f'0x{status.mode_bitmask:x}')
    return f'0x{status.mode_bitmask:x}'


@reports('strobe-limits', 'reports a min_strobe_period that is at most max_strobe_period')
async def limits(light: LightSession) -> str:
    """Compare the limits."""
    status = await _status(light)
    low, high = astuple(status.strobe_range)
    if low == high == 0:
        raise Skipped('both are 0: it reports no strobe limits')
    if not status.strobe_range.known:
        raise Failed(f'{low:g} to {high:g} s')
    return f'{low:g} to {high:g} s'


@requirement('flags-at-rest', 'reports no error flag before the first command', ILLUMINATOR,
             'ILLUMINATOR_ERROR_FLAGS')
async def flags(light: LightSession) -> None:
    """Read the flags of a cold light."""
    status = await _status(light)
    if status.error_flags:
        raise Failed(f'{", ".join(flag_names(status.error_flags))}: the light is defective, or '
                     f'too hot for the checks ({status.temperature} degC)')


def _compared(name: str, title: str, *, accepted: bool) -> Requirement[LightSession]:
    """Return a requirement on the status after the accepted, or after the rejected changes."""
    kind = 'accepted' if accepted else 'rejected'

    @requirement(name, title, ILLUMINATOR, 'STATUS', whole_run=True)
    async def check(light: LightSession) -> str:
        count = sum(one.expected and one.command in (ON_OFF, CONFIGURE) and one.result is not None
                    and one.accepted == accepted for one in light.transactions)
        if not count:
            raise Skipped(f'no change was {kind}')
        failures = light.disagreements if accepted else light.rejected_but_applied
        return component.none_of(failures, count, f'{kind} changes')
    return check


agrees = _compared(
    'status-agrees', 'shows every accepted change in ILLUMINATOR_STATUS', accepted=True)
unchanged = _compared(
    'status-unchanged', 'shows no change after a rejected command', accepted=False)


@requirement('thermal-flags', 'sets thermal error flags according to its temperature', ILLUMINATOR,
             'ILLUMINATOR_ERROR_FLAGS', needs_consent=True)
async def thermal(light: LightSession) -> str:
    """Keep the light at 100 % for some time, then off for as long, and compare."""
    heat = light.conditions.options['heat']
    if not heat:
        raise Skipped('disabled by --heat 0')
    await light.baseline()
    start = await light.status()
    # A light without a thermometer may report NaN or 0.
    if start is None or not start.temperature:
        raise Skipped('it reports no temperature')
    if start.error_flags & mavlink.ILLUMINATOR_ERROR_FLAGS_THERMISTOR_FAILURE:
        raise Skipped('its temperature sensor has failed')
    await light.configure(brightness=100.0)
    seen = [start]
    for on in (True, False):
        one = (await light.switch(on)).transaction
        if on and not one.accepted:
            raise Skipped(f'it cannot be switched on: {one.answer}')
        until = light.now + heat
        while light.now < until:
            status = await light.status()
            seen += [status] if status is not None and status.temperature is not None else []
            await light.sleep(min(0.5, heat / 5))
    return _judge(seen, heat)


def _judge(seen: list[Status], seconds: float) -> str:
    """
    Return the temperatures at which flags were set.

    A flag that was not set at first must not be set at about the first temperature or below.
    Consecutive samples are not compared: between them a small light may heat up and cool down.

    :raises Failed: if a flag was set at such a temperature.
    """
    temperatures = [one.temperature or 0.0 for one in seen]
    start, ranges = temperatures[0], []
    for flag in THERMAL:
        flagged = [temperature for one, temperature in zip(seen, temperatures, strict=True)
                   if one.error_flags & flag]
        if flagged and not seen[0].error_flags & flag:
            text = f'{flag_names(flag)[0]} from {min(flagged):.1f} to {max(flagged):.1f} degC'
            if min(flagged) < start + STEP:
                raise Failed(f'{text}; it was not set at {start:.1f} degC before')
            ranges.append(text)
    if not ranges and not any(one.enabled for one in seen):
        raise Skipped('it acknowledged ON and never reported that it was on')
    if not ranges:
        raise Skipped(f'{seconds:g} s at 100 % heated it from {start:.1f} to '
                      f'{max(temperatures):.1f} degC and set no flag; try a longer --heat')
    return ', '.join(ranges)


# All requirements

OWN: tuple[Requirement[LightSession], ...] = (
    component.heartbeat_type(mavlink.MAV_TYPE_ILLUMINATOR, 'ILLUMINATOR', 'an illuminator'),
    component.heartbeat_autopilot,
    component.status_stream(
        IlluminatorStatus, ILLUMINATOR, 'Message/Command/Enum Summary', optional=True),
    component.sent_on_request(
        'status-request', IlluminatorStatus, ILLUMINATOR, 'Illuminator Connection'),
    content, mode, limits, flags,
    component.sent_on_request(
        'information-request', ComponentInformationBasic, ILLUMINATOR,
        'COMPONENT_INFORMATION_BASIC', lambda session: session.identity or 'no names'),
    *component.IDENTITY_STRINGS,
    other_target, on_configuration, configure_switch, command_int, repeated,
    on, off, on_off_values,
    internal, external, mode_values,
    brightness, brightness_values, *STROBE, not_a_number,
    thermal, component.uptime(IlluminatorStatus, 'uptime_ms'), agrees, unchanged,
)
REQUIREMENTS = component.with_common(OWN, IlluminatorStatus)
CHECKS: PayloadChecks[LightSession] = PayloadChecks(
    payload='illuminator', device='light', session=LightSession, requirements=REQUIREMENTS,
    evidence='HEARTBEAT with MAV_TYPE_ILLUMINATOR or ILLUMINATOR_STATUS',
    risk='strobe, or shine at 100 %',
    question='Some checks make light {device} strobe, and shine at 100 % for {heat:g} s. '
             'Strobing can trigger\nseizures; do not look into the light. All other checks run '
             'in any case.\nMay light {device} strobe and shine at 100 %? [y/N] ',
    options=(Option('heat', 'S', 5.0, 0, 36000, 'time at 100 %% to heat the light, and then as '
                    'long to cool it'),))
