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

"""The simulated heat: it rises, dims the light, ends it, and lets it come back."""

import dataclasses

from illuminator_ros.illuminator.error_flags import ErrorFlag
from illuminator_ros.illuminator.thermal import ThermalModel, ThermalProperties
import pytest

THROTTLING = ErrorFlag.THERMAL_THROTTLING
SHUTDOWN = ErrorFlag.OVER_TEMPERATURE_SHUTDOWN


def at(temperature: float, **properties: float) -> ThermalModel:
    """Return a model that has been brought to a temperature, degC."""
    model = ThermalModel(ThermalProperties(**properties))
    model.temperature = temperature
    model.advance(0.0, 0.0)
    return model


def test_it_begins_at_the_ambient_temperature():
    model = ThermalModel(ThermalProperties(ambient=-10.0))
    assert (model.temperature, model.flags, model.output) == (-10.0, 0, 1.0)


def test_it_reaches_63_percent_of_the_rise_after_one_time_constant():
    model = ThermalModel(ThermalProperties(ambient=20.0, rise=40.0, time_constant=100.0))
    model.advance(100.0, 1.0)
    assert model.temperature == pytest.approx(20.0 + 40.0 * 0.632, abs=0.1)


def test_half_the_power_leads_to_half_the_rise():
    model = ThermalModel(ThermalProperties(ambient=20.0, rise=40.0, time_constant=1.0))
    model.advance(100.0, 0.5)
    assert model.temperature == pytest.approx(40.0)


def test_how_often_it_is_looked_at_makes_no_difference():
    once, often = at(25.0), at(25.0)
    once.advance(60.0, 1.0)
    for _ in range(600):
        often.advance(0.1, 1.0)
    assert once.temperature == pytest.approx(often.temperature, abs=0.01)


@pytest.mark.parametrize(('temperature', 'flags', 'output'), [
    (79.9, ErrorFlag(0), 1.0),
    (80.0, THROTTLING, 0.5),
    (94.9, THROTTLING, 0.5),
    (95.0, THROTTLING | SHUTDOWN, 0.0),
])
def test_thresholds_on_the_way_up(temperature, flags, output):
    model = at(temperature)
    assert (model.flags, model.output) == (flags, output)


@pytest.mark.parametrize(('temperature', 'flags', 'output'), [
    (70.1, THROTTLING | SHUTDOWN, 0.0),
    (69.9, SHUTDOWN, 0.0),
    (65.1, SHUTDOWN, 0.0),
    (64.9, ErrorFlag(0), 1.0),
])
def test_thresholds_on_the_way_down_are_lower(temperature, flags, output):
    model = at(100.0)
    model.temperature = temperature
    model.advance(0.0, 0.0)
    assert (model.flags, model.output) == (flags, output)


def test_a_throttled_light_gets_cooler_and_throttles_again():
    model = at(25.0, ambient=30.0, rise=60.0, time_constant=10.0)
    changes = 0
    for _ in range(3000):
        before = model.flags
        model.advance(0.1, 1.0)
        changes += before != model.flags
    assert changes >= 4
    assert 69.0 < model.temperature < 81.0


@pytest.mark.parametrize('wrong', [
    {'time_constant': 0.0},
    {'time_constant': -1.0},
    {'time_constant': float('nan')},
    {'throttle_until': 80.0},
    {'throttle_at': 96.0},
    {'shutdown_until': 95.0},
])
def test_properties_that_cannot_be_are_refused(wrong):
    with pytest.raises(ValueError, match='time constant|thresholds'):
        dataclasses.replace(ThermalProperties(), **wrong)
