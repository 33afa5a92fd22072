# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The thermal model of a simulated light: heating, throttling, shutdown, recovery."""

import dataclasses

from illuminator_ros.illuminator.thermal import ThermalModel, ThermalProperties
from illuminator_ros.mavlink.dialect import mavlink
import pytest

THROTTLING = mavlink.ILLUMINATOR_ERROR_FLAGS_THERMAL_THROTTLING
SHUTDOWN = mavlink.ILLUMINATOR_ERROR_FLAGS_OVER_TEMPERATURE_SHUTDOWN


def model(ambient: float = 25.0, **properties: float) -> ThermalModel:
    return ThermalModel(ThermalProperties(**properties), ambient)


@pytest.mark.parametrize(('seconds', 'power', 'temperature'), [
    (0.0, 1.0, -10.0), (100.0, 1.0, -10.0 + 40.0 * 0.632), (5000.0, 0.5, 10.0)])
def test_the_temperature_approaches_ambient_plus_rise_times_power(
    seconds: float, power: float, temperature: float,
) -> None:
    one = model(ambient=-10.0, rise=40.0, time_constant=100.0)
    one.advance(seconds, power)
    assert one.temperature == pytest.approx(temperature, abs=0.1)
    assert (one.flags, one.output) == (0, 1.0)


def test_a_light_in_too_hot_an_environment_is_throttled_from_the_start() -> None:
    one = model(ambient=85.0)
    assert (one.flags, one.output) == (THROTTLING, 0.5)


def test_thresholds_have_a_hysteresis() -> None:
    one = model()
    for temperature, flags, output in (
            (79.9, 0, 1.0), (80.0, THROTTLING, 0.5), (94.9, THROTTLING, 0.5),
            (95.0, THROTTLING | SHUTDOWN, 0.0), (70.1, THROTTLING | SHUTDOWN, 0.0),
            (69.9, SHUTDOWN, 0.0), (65.1, SHUTDOWN, 0.0), (64.9, 0, 1.0)):
        one.set_temperature(temperature)
        assert (one.flags, one.output) == (flags, output), temperature


@pytest.mark.parametrize('wrong', [
    {'time_constant': 0.0}, {'time_constant': -1.0}, {'time_constant': float('nan')},
    {'throttle_until': 80.0}, {'throttle_at': 96.0}, {'shutdown_until': 95.0}])
def test_properties_that_contradict_each_other_are_refused(wrong: dict[str, float]) -> None:
    with pytest.raises(ValueError, match='time constant|thresholds'):
        dataclasses.replace(ThermalProperties(), **wrong)
