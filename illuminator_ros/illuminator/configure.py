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

"""Setting the mode, brightness and strobe of a light."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, TYPE_CHECKING

from .comparison import unexplained
from .error_flags import DIMMING_FLAGS
from .model import Status
from .operation import Done, Operation
from ..mavlink.command import Command
from ..mavlink.messages import MavCmd

if TYPE_CHECKING:
    from .light import Light


class Configure(Operation):
    """
    MAV_CMD_DO_ILLUMINATOR_CONFIGURE, with all four fields.

    :param changes: checked values by name; the other fields are those agreed when it is sent.
    :param stream: whether it is one of a stream of setpoints, which a newer one replaces.
    """

    def __init__(
        self, light: Light, changes: Mapping[str, Any], done: Done, *, now: float, limit: float,
        stream: bool = False,
    ) -> None:
        super().__init__(light, done, now=now, limit=limit)
        self.changes = changes
        self.stream = stream
        self.wanted = light.agreement.with_changes(changes)

    def start(self, now: float) -> None:
        """See :meth:`Operation.start`."""
        # What went before in the queue may have changed the other fields.
        self.wanted = self.light.agreement.with_changes(self.changes)
        super().start(now)

    def command(self) -> Command:
        """See :meth:`Operation.command`."""
        return Command(
            self.light.address, MavCmd.DO_ILLUMINATOR_CONFIGURE,
            (*self.wanted.params(), float(self.light.instance)))

    def shown_by(self, status: Status) -> bool:
        """See :meth:`Operation.shown_by`."""
        return not unexplained(
            self.wanted, status.configuration(self.wanted), status.error_flags, step=True)

    def proof(self, status: Status) -> str:
        """See :meth:`Operation.proof`."""
        reported = status.configuration(self.wanted)
        hidden = [name for name in self.wanted.differences(reported) if name in self.changes]
        if not hidden:
            return super().proof(status)
        if status.error_flags & DIMMING_FLAGS:
            return self.dimmed_proof(status)
        return f'accepted (ILLUMINATOR_STATUS shows {reported.describe(hidden)})'

    def accepted(self, status: Status | None) -> None:
        """See :meth:`Operation.accepted`."""
        self.light.agreement.agree(self.wanted, status)

    @property
    def wish(self) -> str:
        """See :meth:`Operation.wish`."""
        return self.wanted.describe(list(self.changes))

    def found(self, status: Status) -> str:
        """See :meth:`Operation.found`."""
        reported = status.configuration(self.wanted)
        return reported.describe(
            unexplained(self.wanted, reported, status.error_flags, step=True))
