# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""
The simulated light: the device's side of the illuminator protocol.

https://mavlink.io/en/services/illuminator.html
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields, replace
from functools import partial
import math

from . import model
from .messages import IlluminatorStatus
from .simulated_properties import FAULTS, IlluminatorBehaviour, IlluminatorProperties, PROFILES
from .thermal import ThermalModel, ThermalProperties
from ..mavlink import messages as mav
from ..mavlink.dialect import mavlink
from ..mavlink.errors import InvalidValue
from ..mavlink.messages import AnyCommand, params_of
from ..simulation.faults import Behaviour
from ..simulation.settings import number
from ..simulation.simulated import (
    CommandReply,
    ConsoleCommand,
    Effect,
    Reply,
    Report,
    SimulatedDevice,
    SimulatedType,
    Snapshot,
)

# K by which the temperature must change for a line of its own.
TEMPERATURE_STEP = 5.0
# % of a strobe that is started by hand while the duty cycle is 0 %.
DEFAULT_DUTY_CYCLE = 50.0

_number = number(-math.inf, math.inf)
_celsius = number(-273.15, 1000.0)


def _strobe(light: SimulatedIlluminator, words: list[str], now: float) -> Effect:
    # With a duty cycle of 0 %, a period alone would switch the light off.
    duty_cycle = (_number(words[1]) if len(words) > 1
                  else light.configuration.strobe_duty_cycle or DEFAULT_DUTY_CYCLE)
    return light.press(now, strobe_period=_number(words[0]), strobe_duty_cycle=duty_cycle)


COMMANDS: tuple[ConsoleCommand[SimulatedIlluminator, Effect], ...] = (
    ConsoleCommand('on', 'switch on, as by a button on the light',
                   lambda light, words, now: light.press(now, enabled=True)),
    ConsoleCommand('off', 'switch off, likewise',
                   lambda light, words, now: light.press(now, enabled=False)),
    ConsoleCommand('brightness PERCENT', 'set it, likewise',
                   lambda light, words, now: light.press(now, brightness=_number(words[0]))),
    ConsoleCommand('mode MODE', 'internal_control or external_sync, likewise',
                   lambda light, words, now: light.press(now, mode=words[0])),
    ConsoleCommand('strobe S [PERCENT]', 'period and duty cycle, likewise; 0 ends it', _strobe),
    ConsoleCommand('ambient DEG_C', 'change the ambient temperature', lambda light, words, now:
                   partial(light.set_ambient, _celsius(words[0]), now)),
    ConsoleCommand('temperature DEG_C', "change the light's own temperature", lambda light, words,
                   now: partial(light.heat_to, _celsius(words[0]), now)),
)


class SimulatedIlluminator(SimulatedDevice):
    """
    A simulated light, without the link: see :class:`SimulatedDevice`.

    :ivar enabled: whether it is on.
    :ivar configuration: as commanded.
    """

    changes = frozenset({mavlink.MAV_CMD_ILLUMINATOR_ON_OFF,
                         mavlink.MAV_CMD_DO_ILLUMINATOR_CONFIGURE})
    faults = FAULTS
    commands = COMMANDS
    properties: IlluminatorProperties
    behaviour: IlluminatorBehaviour

    def __init__(self, properties: IlluminatorProperties) -> None:
        super().__init__(properties)
        self.thermal = ThermalModel(properties.thermal, properties.ambient)
        self.thermal.set_sensor_failed(self.behaviour.thermistor_failed)

    def behave(self, behaviour: Behaviour, now: float) -> None:
        """See :meth:`SimulatedDevice.behave`."""
        self.warm(now)
        super().behave(behaviour, now)
        self.thermal.set_sensor_failed(self.behaviour.thermistor_failed)

    def restart(self, now: float) -> None:
        """See :meth:`SimulatedDevice.restart`; the temperature stays."""
        self.enabled = False
        self.configuration = model.Configuration(model.Mode.INTERNAL_CONTROL, 100.0, 0.0, 0.0)
        self._last_brightness = self.configuration.brightness
        self._booted_at = now
        self._warmed_at = now

    def reports(self) -> Mapping[type[mav.Message], Report]:
        """See :meth:`SimulatedDevice.reports`."""
        return {IlluminatorStatus: Report(self.status, self.properties.status_interval),
                mav.ComponentInformationBasic: Report(self._information)}

    def uptime_ms(self, now: float) -> int:
        """Return the time since the start, ms, wrapping as the field does."""
        return mav.time_boot_ms(now - self._booted_at)

    def status(self, now: float) -> IlluminatorStatus:
        """Return the ILLUMINATOR_STATUS of this moment."""
        self.warm(now)
        behaviour, configuration, thermal = self.behaviour, self.configuration, self.thermal
        brightness = configuration.brightness * thermal.output
        if behaviour.brightness_is_switch and not self.enabled:
            brightness = 0.0
        flags = thermal.flags | behaviour.false_flags
        if behaviour.inverted_flags and self.enabled:
            flags ^= mavlink.ILLUMINATOR_ERROR_FLAGS_THERMAL_THROTTLING
        strobe_range = self.properties.strobe_range if behaviour.measures else model.StrobeRange()
        fields = (
            self.uptime_ms(now) if behaviour.has_clock else 0, int(self.enabled),
            self.properties.reported_bitmask, flags, int(configuration.mode), brightness,
            configuration.strobe_period, configuration.strobe_duty_cycle,
            thermal.reading if behaviour.measures else 0.0,
            strobe_range.min_strobe_period, strobe_range.max_strobe_period)
        return IlluminatorStatus(*fields, *self.properties.extension)

    def _information(self, now: float) -> mav.ComponentInformationBasic | None:
        behaviour, properties = self.behaviour, self.properties
        if not behaviour.identifies:
            return None

        def string(text: str, size: int) -> bytes:
            if behaviour.padding:
                return text.ljust(size, behaviour.padding).encode()[:size]
            return text.encode()[:size - behaviour.terminates]

        serial_number = properties.serial_number or 'SIM-{}-{}'.format(*properties.address)
        return mav.ComponentInformationBasic(
            self.uptime_ms(now) if behaviour.has_clock else 0, 0, 0,
            string(properties.vendor, 32), string(properties.model, 32),
            string(properties.software_version, 24), string(properties.hardware_version, 24),
            string(serial_number, 32))

    def execute(self, source: mav.Address, command: AnyCommand, now: float) -> Reply:
        """See :meth:`SimulatedDevice.execute`."""
        self.warm(now)
        if command.command == mavlink.MAV_CMD_ILLUMINATOR_ON_OFF:
            valid = command.param1 in (0.0, 1.0) or self.behaviour.accepts_out_of_range
            on = command.param1 == 1.0 and not (self.behaviour.toggles and self.enabled)
            return CommandReply(
                mavlink.MAV_RESULT_ACCEPTED if valid else mavlink.MAV_RESULT_DENIED,
                partial(self._switch, on))
        if command.command == mavlink.MAV_CMD_DO_ILLUMINATOR_CONFIGURE:
            return self._configuration_reply(*params_of(command)[:4])
        return None

    def _configuration_reply(
        self, mode: float, brightness: float, period: float, duty_cycle: float,
    ) -> CommandReply:
        behaviour, strobe_range = self.behaviour, self.properties.strobe_range
        known = mode in (model.Mode.INTERNAL_CONTROL, model.Mode.EXTERNAL_SYNC)
        configuration = model.Configuration(
            model.Mode(int(mode)) if known else self.configuration.mode, brightness, period,
            duty_cycle)
        try:
            if mode not in self.properties.modes:
                raise InvalidValue(f'mode {mode}')
            if period and not behaviour.measures:
                raise InvalidValue('this light does not strobe')
            for name, value in (('brightness', brightness), ('strobe_period', period),
                                ('strobe_duty_cycle', duty_cycle)):
                if not (math.isnan(value) and behaviour.accepts_nan):
                    model.checked(name, value, strobe_range)
        except InvalidValue:
            accepted = behaviour.accepts_out_of_range
        else:
            accepted = True
        return CommandReply(mavlink.MAV_RESULT_ACCEPTED if accepted else mavlink.MAV_RESULT_DENIED,
                            partial(self._configure, configuration))

    def _switch(self, on: bool) -> None:
        self.enabled = on
        if on and self.behaviour.brightens:
            self.configuration = replace(self.configuration, brightness=100.0)
        # Where 0 % means off, ON restores the last brightness above 0 %.
        if (on and self.behaviour.brightness_is_switch and not self.configuration.brightness):
            self.configuration = replace(self.configuration, brightness=self._last_brightness)

    def _configure(self, configuration: model.Configuration) -> None:
        self.configuration = configuration
        if configuration.brightness > 0:
            self._last_brightness = configuration.brightness
        if self.behaviour.brightness_is_switch:
            self.enabled = configuration.brightness > 0
        elif self.behaviour.configuring_switches and configuration.brightness > 0:
            self.enabled = True

    def press(self, now: float, *, enabled: bool | None = None, **changes: object) -> Effect:
        """
        Return the effect of a button on the light.

        :raises InvalidValue: if the light cannot be set so.
        """
        self.warm(now)
        strobe_range = self.properties.strobe_range
        checked: model.Changes = {
            name: model.checked(name, value, strobe_range) for name, value in changes.items()}
        configuration = replace(self.configuration, **checked)

        def effect() -> None:
            if changes:
                self._configure(configuration)
            if enabled is not None:
                self._switch(enabled)
        return effect

    def heat_to(self, temperature: float, now: float) -> None:
        """Set the temperature, degC."""
        self.warm(now)
        self.thermal.set_temperature(temperature)

    def set_ambient(self, temperature: float, now: float) -> None:
        """Set the ambient temperature, degC."""
        self.warm(now)
        self.thermal.ambient = temperature

    def warm(self, now: float) -> None:
        """Advance the temperature to this moment; call it before each change of the state."""
        if now == self._warmed_at:
            return
        configuration = self.configuration
        power = configuration.brightness / 100 if self.enabled else 0.0
        if configuration.strobe_period:
            power *= configuration.strobe_duty_cycle / 100
        # A light that has accepted NaN heats as at full power.
        power = min(max(power, 0.0), 1.0) if math.isfinite(power) else 1.0
        self.thermal.advance((now - self._warmed_at) * self.properties.time_scale, power)
        self._warmed_at = now

    def snapshot(self, now: float) -> Snapshot:
        """See :meth:`SimulatedDevice.snapshot`."""
        status, temperature = self.status(now), self.thermal.temperature
        period, duty = status.strobe_period, status.strobe_duty_cycle
        mode = model.Mode(status.mode)
        state = ('ON ' if self.enabled else 'off', f'{status.brightness:>5.3g} %',
                 f'{f"strobe {period:g} s, {duty:g} %" if period else "no strobe":18}')
        notes = tuple(filter(None, (
            '' if mode is model.Mode.INTERNAL_CONTROL else mode.label,
            ', '.join(model.flag_names(status.error_status)))))
        return Snapshot('  '.join((*state, f'{temperature:6.1f} degC', *notes)),
                        (*state, *notes), temperature / TEMPERATURE_STEP)


SIMULATED = SimulatedType(
    'light', 'lights', SimulatedIlluminator, IlluminatorProperties(), PROFILES,
    examples=(
        '', 'udpin://127.0.0.1:14550 --count 3',
        '--light 1/243=bow --light 1/250=stern --fault stern:drop=0.2',
        '--ambient 60 --time-scale 60      # gets hot in seconds',
        '--file lights.yaml                # the same settings, for each light'),
    notes='thermal, with defaults (degC, K and s; throttle_to is a share of the brightness):\n  '
    + ', '.join(f'{one.name}={one.default:g}' for one in fields(ThermalProperties)),
    mavlink_version=2)
