# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The temperature of a simulated light, and its effect on brightness and error flags."""

from __future__ import annotations

from dataclasses import dataclass
import math

from ..mavlink.dialect import mavlink

# degC; the reading of an open thermistor, which receivers take for "not measured".
BROKEN_READING = 0.0
# Plain ints: each operation of an IntFlag takes 1 us.
_THROTTLING = mavlink.ILLUMINATOR_ERROR_FLAGS_THERMAL_THROTTLING
_SHUTDOWN = mavlink.ILLUMINATOR_ERROR_FLAGS_OVER_TEMPERATURE_SHUTDOWN
_FAILURE = mavlink.ILLUMINATOR_ERROR_FLAGS_THERMISTOR_FAILURE


@dataclass(frozen=True)
class ThermalProperties:
    """
    A first-order thermal model with two thresholds, each with hysteresis.

    :param rise: K above ambient at full power, in the steady state.
    :param time_constant: s.
    :param throttle_at: degC at which brightness is cut to ``throttle_to`` (a share, 0..1) ...
    :param throttle_until: ... until it is cooler than this, degC.
    :param shutdown_at: degC at which the light switches itself off ...
    :param shutdown_until: ... until it is cooler than this, degC.
    """

    rise: float = 60.0
    time_constant: float = 120.0
    throttle_at: float = 80.0
    throttle_until: float = 70.0
    throttle_to: float = 0.5
    shutdown_at: float = 95.0
    shutdown_until: float = 65.0

    def __post_init__(self) -> None:
        if not self.time_constant > 0:
            raise ValueError(f'time constant {self.time_constant} s is not above 0')
        if not self.throttle_until < self.throttle_at <= self.shutdown_at:
            raise ValueError('the throttling thresholds are not in order')
        if not self.shutdown_until < self.shutdown_at:
            raise ValueError('the shutdown thresholds are not in order')


class ThermalModel:
    """
    The temperature of a light over time.

    :param ambient: degC.
    :ivar temperature: degC.
    :ivar sensor_failed: whether the light cannot measure its temperature.
    :ivar flags: the error flags of its report; THERMISTOR_FAILURE alone while the sensor has
        failed.
    :ivar output: the share (0..1) of the commanded brightness that the light gives.
    """

    def __init__(self, properties: ThermalProperties, ambient: float) -> None:
        self.properties = properties
        self.ambient = self.temperature = ambient
        self.sensor_failed = False
        self.flags = 0
        self.output = 1.0
        self.advance(0.0, 0.0)

    @property
    def reading(self) -> float:
        """Return the temperature as the light reports it, degC."""
        return BROKEN_READING if self.sensor_failed else self.temperature

    def set_sensor_failed(self, failed: bool) -> None:
        """Set whether the sensor has failed, and update the flags and the output."""
        self.sensor_failed = failed
        self.advance(0.0, 0.0)

    def set_temperature(self, temperature: float) -> None:
        """Set the temperature, degC, and update the flags and the output."""
        self.temperature = temperature
        self.advance(0.0, 0.0)

    def advance(self, seconds: float, power: float) -> None:
        """
        Let time pass.

        :param power: the commanded share of full power (0..1).
        """
        longest = self.properties.time_constant / 50
        steps = max(math.ceil(seconds / longest), 1)
        for _ in range(steps):
            if self._step(seconds / steps, power):
                break

    def _step(self, seconds: float, power: float) -> bool:
        """Return whether the temperature and the flags have reached their final values."""
        properties, before = self.properties, self.flags
        final = self.ambient + properties.rise * power * self.output
        decay = math.exp(-seconds / properties.time_constant)
        self.temperature = temperature = final + (self.temperature - final) * decay
        flags = _FAILURE
        if not self.sensor_failed:
            flags = before & ~_FAILURE
            if temperature >= properties.throttle_at:
                flags |= _THROTTLING
            elif temperature < properties.throttle_until:
                flags &= ~_THROTTLING
            if temperature >= properties.shutdown_at:
                flags |= _SHUTDOWN
            elif temperature < properties.shutdown_until:
                flags &= ~_SHUTDOWN
        self.flags = flags
        self.output = (0.0 if flags & _SHUTDOWN else
                       properties.throttle_to if flags & _THROTTLING else 1.0)
        return flags == before and abs(temperature - final) < 1e-9
