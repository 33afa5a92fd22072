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

"""Simulated lights from their properties, without the settings of the simulator."""

from __future__ import annotations

from collections.abc import Iterable

from illuminator_ros.illuminator.simulated import SimulatedIlluminator
from illuminator_ros.illuminator.simulated_properties import IlluminatorProperties
from illuminator_ros.payload.simulated import Description, SimulatedComponents


def describe(
    properties: IlluminatorProperties, name: str = '', seed: int = 0,
) -> Description[SimulatedIlluminator]:
    """Return the simulated component that has these properties."""
    return Description(properties.address, SimulatedIlluminator(properties), name, seed)


def simulated_lights(
    properties: Iterable[IlluminatorProperties], now: float,
) -> SimulatedComponents[SimulatedIlluminator]:
    """Return an endpoint of simulated lights that are powered on now, s."""
    return SimulatedComponents(map(describe, properties), now)
