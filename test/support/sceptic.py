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

"""A listener that accepts no value that cannot be."""

from __future__ import annotations

import math

from illuminator_ros.illuminator.events import (
    AnyLightEvent,
    ConfigurationChanged,
    LightIdentified,
    StatusReceived,
)


def check_event(event: AnyLightEvent) -> None:
    """Check that an event has no value that must not be believed."""
    match event:
        case StatusReceived(status=status, temperature=temperature):
            for value, low, high in (
                    (status.brightness, 0.0, 100.0), (status.strobe_period, 0.0, 3600.0),
                    (status.strobe_duty_cycle, 0.0, 100.0), (status.temperature, -273.2, 1000.0)):
                assert value is None or low <= value <= high, status
            assert status.enabled in (None, False, True), status
            if status.limits.known:
                assert (0 <= status.limits.min_strobe_period
                        <= status.limits.max_strobe_period <= 3600)
            assert temperature is None or math.isfinite(temperature), status
        case ConfigurationChanged(configuration=configuration):
            assert 0 <= configuration.brightness <= 100, configuration
            assert 0 <= configuration.strobe_period <= 3600, configuration
            assert 0 <= configuration.strobe_duty_cycle <= 100, configuration
        case LightIdentified(identity=identity):
            for text in (identity.vendor, identity.model, identity.serial_number):
                assert text.isprintable() and len(text) <= 32, identity
