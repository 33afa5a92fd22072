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

"""What a light tells those who watch it."""

from __future__ import annotations

from enum import Enum
from typing import TYPE_CHECKING

from .identity import Identity
from .model import Configuration, Status

if TYPE_CHECKING:
    from .light import Light


class Cause(Enum):
    """Why the agreed configuration is another now."""

    FIRST_STATUS = 'first status'
    REQUEST = 'request'
    LIGHT = 'light'
    ROUNDING = 'rounding'


class LightObserver:
    """
    Hears what happens to one light, in the thread that runs the protocol.

    Each method does nothing here: an observer overrides what it cares for.
    """

    def connected(self, light: Light) -> None:
        """Note that the light is heard."""

    def lost(self, light: Light, reason: str) -> None:
        """Note that the light is not heard any more."""

    def restarted(self, light: Light) -> None:
        """Note that the light has restarted."""

    def identified(self, light: Light, identity: Identity) -> None:
        """Note what the light says it is."""

    def status(self, light: Light, status: Status) -> None:
        """Take a status."""

    def configured(
        self, light: Light, configuration: Configuration, names: list[str], cause: Cause,
    ) -> None:
        """Take the agreed configuration, with the names of the fields that are new in it."""

    def restored(self, light: Light, success: bool, message: str) -> None:
        """Note what became of overrides, or of the configuration after a restart."""

    def setpoint_failed(self, light: Light, message: str) -> None:
        """Note that a setpoint of a stream did not reach the light."""
