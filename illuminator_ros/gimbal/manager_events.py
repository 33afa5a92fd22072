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

"""The events of a gimbal manager."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

from .manager_control import RoleHolderChanged
from .manager_setpoint import Clipped, Setpoint
from .manager_state import StateChanged
from ..mavlink.messages import Address


@dataclass(frozen=True)
class RequestRefused:
    """A setpoint or a command of a player was refused."""

    player: Address
    reason: str


@dataclass(frozen=True)
class AnglesClipped:
    """Angles beyond the ranges of the device are clipped; once for an axis and a setpoint."""

    clipped: tuple[Clipped, ...]


@dataclass(frozen=True)
class SetpointSent:
    """A device without MAVLink must take a setpoint, which is mixed and clipped."""

    setpoint: Setpoint


@dataclass(frozen=True)
class AddressShared:
    """Two senders with different heartbeats use the address of one player."""

    player: Address


@dataclass(frozen=True)
class ReferenceLost:
    """
    The gimbal no longer follows its region of interest, or a yaw relative to north.

    :param unknown: the unknown value of the vehicle: ``position`` or ``heading``.
    """

    unknown: str


@dataclass(frozen=True)
class RateStopped:
    """
    A rate has ended, since the manager gives no more setpoints.

    :param stands: whether an attitude has shown in time that the device stands.
    """

    stands: bool


ManagerEvent: TypeAlias = (
    StateChanged | RoleHolderChanged | RequestRefused | AnglesClipped | SetpointSent
    | AddressShared | ReferenceLost | RateStopped)
