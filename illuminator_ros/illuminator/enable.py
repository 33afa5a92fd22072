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

"""Switching a light on or off."""

from __future__ import annotations

from typing import TYPE_CHECKING

from .model import Status
from .operation import Done, Operation
from ..mavlink.command import Command
from ..mavlink.messages import MavCmd

if TYPE_CHECKING:
    from .light import Light

# s; a light that reports progress for longer is not waited for.
PROGRESS_LIMIT = 30.0


class Enable(Operation):
    """MAV_CMD_ILLUMINATOR_ON_OFF."""

    def __init__(self, light: Light, on: bool, done: Done, *, now: float) -> None:
        super().__init__(light, done, now=now, limit=now + PROGRESS_LIMIT)
        self.on = on

    def command(self) -> Command:
        """See :meth:`Operation.command`."""
        return Command(self.light.address, MavCmd.ILLUMINATOR_ON_OFF,
                       (float(self.on), float(self.light.instance)))

    def shown_by(self, status: Status) -> bool:
        """See :meth:`Operation.shown_by`."""
        return status.enabled is self.on

    def accepted(self, status: Status | None) -> None:
        """See :meth:`Operation.accepted`."""

    def proof(self, status: Status) -> str:
        """See :meth:`Operation.proof`."""
        return self.dimmed_proof(status) if self.on else super().proof(status)

    @property
    def wish(self) -> str:
        """See :meth:`Operation.wish`."""
        return 'on' if self.on else 'off'

    def found(self, status: Status) -> str:
        """See :meth:`Operation.found`."""
        return {True: 'on', False: 'off', None: 'neither on nor off'}[status.enabled]
