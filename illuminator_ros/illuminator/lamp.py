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

"""A light but for its link: how it shines, what it lets itself be told, what it reports."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
import math
from typing import Any

from .device_properties import DeviceProperties
from .error_flags import ErrorFlag
from .extended_status import ExtendedIlluminatorStatus
from .model import checked, Configuration, InvalidValue, Limits, Mode
from .thermal import ThermalModel
from ..mavlink.messages import ComponentInformationBasic, IlluminatorStatus, MavResult

# The result of a command, the change that it makes, and what makes the messages that answer it.
Judgement = tuple[MavResult, Callable[[], None] | None, list[Callable[[float], Any]]]


class Lamp:
    """What commands change and messages tell of. No I/O; time is passed in."""

    def __init__(self, properties: DeviceProperties) -> None:
        self.properties = properties
        self.behaviour = properties.behaviour
        self.thermal = ThermalModel(properties.thermal)
        self.thermal.sensor_failed = self.behaviour.thermistor_failed

    def restart(self, now: float) -> None:
        """Begin anew, as after a power cycle; only the heat stays."""
        self.enabled = False
        self.configuration = Configuration(Mode.INTERNAL_CONTROL, 100.0, 0.0, 0.0)
        self._last_brightness = self.configuration.brightness
        self._booted_at = now
        self._thermal_at = now

    def heat_to(self, temperature: float, now: float) -> None:
        """Bring the light to a temperature, degC."""
        self._warm(now)
        self.thermal.temperature = temperature

    def _press(self, enabled: bool | None, changes: Mapping[str, Any]) -> Callable[[], None]:
        """Return what a button on the light does."""
        configuration = self.configuration.with_changes({
            name: checked(name, value, self.properties.limits)
            for name, value in changes.items()})

        def change() -> None:
            self.configuration = configuration
            if enabled is not None:
                self.enabled = enabled
            elif self.behaviour.joint_switch:
                self.enabled = configuration.brightness > 0
        return change

    def _switch(self, param: float) -> Judgement:
        valid = param in (0.0, 1.0) or self.behaviour.lets_all_in
        on = bool(param == 1.0)
        if on and self.behaviour.toggles:
            on = not self.enabled

        def change() -> None:
            self.enabled = on
            # "0%: Off": where the two are one, being on needs some brightness.
            if on and self.behaviour.joint_switch and not self.configuration.brightness:
                self.configuration = replace(
                    self.configuration, brightness=self._last_brightness)
        return MavResult.ACCEPTED if valid else MavResult.DENIED, change, []

    def _configure(self, params: list[float]) -> Judgement:
        mode, brightness, period, duty = params
        behaviour = self.behaviour
        known = mode in (Mode.INTERNAL_CONTROL, Mode.EXTERNAL_SYNC)
        configuration = Configuration(
            Mode(int(mode)) if known else self.configuration.mode, brightness, period, duty)

        def change() -> None:
            self.configuration = configuration
            if brightness > 0:
                self._last_brightness = brightness
            if behaviour.joint_switch:
                self.enabled = brightness > 0

        try:
            if mode not in self.properties.modes:
                raise InvalidValue(f'mode {mode}')
            if period and not behaviour.measures:
                raise InvalidValue('this light does not strobe')
            for name, value in (('brightness', brightness), ('strobe_period', period),
                                ('strobe_duty_cycle', duty)):
                if not (math.isnan(value) and behaviour.lets_nan_in):
                    checked(name, value, self.properties.limits)
        except InvalidValue:
            accepted = behaviour.lets_all_in
        else:
            accepted = True
        return MavResult.ACCEPTED if accepted else MavResult.DENIED, change, []

    def status(self, now: float) -> Any:
        """Return the ILLUMINATOR_STATUS of this moment."""
        self._warm(now)
        behaviour, configuration = self.behaviour, self.configuration
        brightness = configuration.brightness * self.thermal.output
        if behaviour.joint_switch and not self.enabled:
            brightness = 0.0
        limits = self.properties.limits if behaviour.measures else Limits()
        fields = (
            self.uptime_ms(now), int(self.enabled), self.properties.mode_bitmask,
            int(self._flags()), int(configuration.mode), brightness,
            configuration.strobe_period, configuration.strobe_duty_cycle,
            self.thermal.reading if behaviour.measures else 0.0,
            limits.min_strobe_period, limits.max_strobe_period)
        if behaviour.extension is not None:
            return ExtendedIlluminatorStatus(*fields, extension=behaviour.extension)
        return IlluminatorStatus(*fields)

    def _flags(self) -> int:
        flags = int(self.thermal.flags) | self.behaviour.false_flags
        if self.behaviour.inverted_flags and self.enabled:
            flags ^= ErrorFlag.THERMAL_THROTTLING
        return flags

    def information(self, now: float) -> Any:
        """Return the COMPONENT_INFORMATION_BASIC."""
        identity, behaviour = self.properties.identity, self.behaviour

        def string(text: str, size: int) -> bytes:
            if behaviour.padding:
                return text.ljust(size, behaviour.padding).encode()[:size]
            return text.encode()[:size - behaviour.terminates]

        return ComponentInformationBasic(
            self.uptime_ms(now), 0, 0, string(identity.vendor, 32), string(identity.model, 32),
            string(identity.software_version, 24), string(identity.hardware_version, 24),
            string(identity.serial_number, 32))

    def uptime_ms(self, now: float) -> int:
        """Return the time since the start, ms, wrapping as the field does."""
        if not self.behaviour.has_clock:
            return 0
        return int((now - self._booted_at) * 1000) & 0xFFFFFFFF

    def _warm(self, now: float) -> None:
        configuration = self.configuration
        power = configuration.brightness / 100 if self.enabled else 0.0
        if configuration.strobe_period and configuration.strobe_duty_cycle:
            power *= configuration.strobe_duty_cycle / 100
        # A light that let NaN in is as hot as one at full power, and stays a light.
        power = min(max(power, 0.0), 1.0) if math.isfinite(power) else 1.0
        self.thermal.advance((now - self._thermal_at) * self.properties.time_scale, power)
        self._thermal_at = now
