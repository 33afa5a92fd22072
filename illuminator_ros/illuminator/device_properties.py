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

"""What a simulated light is."""

from __future__ import annotations

from dataclasses import dataclass, field

from .behaviour import Behaviour
from .identity import Identity
from .model import Limits, Mode
from .thermal import ThermalProperties
from ..mavlink.messages import Address, MAV_COMP_ID_ILLUMINATOR


@dataclass(frozen=True)
class DeviceProperties:
    """
    What a simulated light is.

    :param name: what people call it.
    :param mode_bitmask: as reported; here the enum values of the supported modes, or-ed.
    :param modes: what it can be configured to.
    :param status_interval: s between statuses unless told otherwise; 0 sends none.
    :param time_scale: how much faster than time the light gets hot.
    :param behaviour: what it does at first; :attr:`Device.behaviour` can change.
    :param normal: what it does without faults.
    :param seed: of what happens by chance.
    """

    source: Address = Address(1, MAV_COMP_ID_ILLUMINATOR)
    identity: Identity = field(default_factory=lambda: Identity(
        'illuminator_ros', 'simulator', '1.0.0', '1.0.0', 'SIM-1-243'))
    limits: Limits = Limits(0.05, 10.0)
    mode_bitmask: int = Mode.INTERNAL_CONTROL | Mode.EXTERNAL_SYNC
    status_interval: float = 1.0
    thermal: ThermalProperties = ThermalProperties()
    time_scale: float = 1.0
    name: str = ''
    modes: tuple[Mode, ...] = (Mode.INTERNAL_CONTROL, Mode.EXTERNAL_SYNC)
    behaviour: Behaviour = Behaviour()
    normal: Behaviour = Behaviour()
    seed: int = 0
