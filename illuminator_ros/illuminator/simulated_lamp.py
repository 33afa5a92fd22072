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

"""The lamp of a simulated light: its state, its temperature, and the messages that report it."""

from __future__ import annotations

from dataclasses import dataclass, replace
import math
from typing import Any

from .messages import IlluminatorStatus, STATUS_ID
from .model import Configuration, ErrorFlag, Limits, Mode
from .simulated_properties import IlluminatorBehaviour, IlluminatorProperties
from .thermal import ThermalModel
from ..mavlink.messages import ComponentInformationBasic, define, UInt8


@define(STATUS_ID, 'ILLUMINATOR_STATUS', extensions=3)
@dataclass(slots=True)
class ExtendedIlluminatorStatus(IlluminatorStatus):
    """
    A vendor's ILLUMINATOR_STATUS of 38 bytes, to be sent; receivers ignore the last three.

    :ivar zoom_level: %.
    :ivar color_mode: 0 white, 1 red, 2 blue, 255 not applicable.
    :ivar gimbal_device_id: component id or gimbal number, 0 for none.
    """

    zoom_level: UInt8
    color_mode: UInt8
    gimbal_device_id: UInt8


class SimulatedLamp:
    """
    The state of a simulated light. No I/O; ``now`` is s.

    :ivar enabled: whether it is on.
    :ivar configuration: as commanded.
    """

    def __init__(self, properties: IlluminatorProperties) -> None:
        self.properties = properties
        self.thermal = ThermalModel(properties.thermal)
        self.restart(0.0)

    def restart(self, now: float) -> None:
        """Return to the state after a power cycle; the temperature stays."""
        self.enabled = False
        self.configuration = Configuration(Mode.INTERNAL_CONTROL, 100.0, 0.0, 0.0)
        self._last_brightness = self.configuration.brightness
        self._booted_at = now
        self._warmed_at = now

    def switch(self, on: bool, *, brightness_is_switch: bool) -> None:
        """Switch on or off; with 0 % meaning off, ON restores the last brightness above 0."""
        self.enabled = on
        if on and brightness_is_switch and not self.configuration.brightness:
            self.configuration = replace(self.configuration, brightness=self._last_brightness)

    def configure(self, configuration: Configuration, *, brightness_is_switch: bool) -> None:
        """Take a configuration; with 0 % meaning off, its brightness switches, too."""
        self.configuration = configuration
        if configuration.brightness > 0:
            self._last_brightness = configuration.brightness
        if brightness_is_switch:
            self.enabled = configuration.brightness > 0

    def uptime_ms(self, now: float) -> int:
        """Return the time since the start, ms, wrapping as the field does."""
        return int((now - self._booted_at) * 1000) & 0xFFFFFFFF

    def status(self, behaviour: IlluminatorBehaviour, now: float) -> Any:
        """Return the ILLUMINATOR_STATUS of this moment."""
        self.warm(now)
        configuration = self.configuration
        brightness = configuration.brightness * self.thermal.output
        if behaviour.brightness_is_switch and not self.enabled:
            brightness = 0.0
        flags = int(self.thermal.flags) | behaviour.false_flags
        if behaviour.inverted_flags and self.enabled:
            flags ^= ErrorFlag.THERMAL_THROTTLING
        limits = self.properties.limits if behaviour.measures else Limits()
        fields = (
            self.uptime_ms(now) if behaviour.has_clock else 0, int(self.enabled),
            self.properties.mode_bitmask, flags, int(configuration.mode), brightness,
            configuration.strobe_period, configuration.strobe_duty_cycle,
            self.thermal.reading if behaviour.measures else 0.0,
            limits.min_strobe_period, limits.max_strobe_period)
        if behaviour.extension is not None:
            return ExtendedIlluminatorStatus(*fields, *behaviour.extension)
        return IlluminatorStatus(*fields)

    def information(self, behaviour: IlluminatorBehaviour, now: float) -> Any:
        """Return the COMPONENT_INFORMATION_BASIC."""
        identity = self.properties.identity

        def string(text: str, size: int) -> bytes:
            if behaviour.padding:
                return text.ljust(size, behaviour.padding).encode()[:size]
            return text.encode()[:size - behaviour.terminates]

        return ComponentInformationBasic(
            self.uptime_ms(now) if behaviour.has_clock else 0, 0, 0,
            string(identity.vendor, 32), string(identity.model, 32),
            string(identity.software_version, 24), string(identity.hardware_version, 24),
            string(identity.serial_number, 32))

    def heat_to(self, temperature: float, now: float) -> None:
        """Set the temperature, degC."""
        self.warm(now)
        self.thermal.temperature = temperature

    def set_ambient(self, temperature: float, now: float) -> None:
        """Set the ambient temperature, degC."""
        self.warm(now)
        self.thermal.ambient = temperature

    def warm(self, now: float) -> None:
        """Advance the temperature to this moment; call it before each change of the state."""
        configuration = self.configuration
        power = configuration.brightness / 100 if self.enabled else 0.0
        if configuration.strobe_period:
            power *= configuration.strobe_duty_cycle / 100
        # A light that has accepted NaN heats as at full power.
        power = min(max(power, 0.0), 1.0) if math.isfinite(power) else 1.0
        self.thermal.advance((now - self._warmed_at) * self.properties.time_scale, power)
        self._warmed_at = now
