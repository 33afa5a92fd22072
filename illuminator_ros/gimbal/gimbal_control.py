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

"""Control of a gimbal by this component: known, taken and released."""

from __future__ import annotations

from collections.abc import Callable

from . import events
from .commands import configure, Control
from .remote_managers import RemoteManager
from ..mavlink.messages import Address
from ..payload.confirmed_command import Desired, Result
from ..payload.device_property import Caller

# s; the limit of a request, including its confirmation.
REQUEST_LIMIT = 5.0


class GimbalControl:
    """
    Control of one gimbal, as GIMBAL_MANAGER_STATUS shows it.

    :param us: the address of this component.
    :param emit: takes the events.
    :ivar known: the components in control, None if they are not known.
    :ivar since: when that changed last, s.
    :ivar take_due: whether control must be taken as soon as no component has it.
    """

    def __init__(
        self, key: events.GimbalKey, us: Address, emit: Callable[[events.GimbalEvent], None],
    ) -> None:
        self.known: Control | None = None
        self.since = 0.0
        self.take_due = False
        self._key = key
        self._us = us
        self._emit = emit
        self._last: Control | None = None
        # Whether a request for control is under way, or was neither refused nor confirmed.
        self._may_have_it = False

    @property
    def is_ours(self) -> bool:
        """Whether this component has primary control."""
        return self.known is not None and self.known.primary == self._us

    @property
    def has_any(self) -> bool:
        """Whether this component has primary or secondary control, as far as it is known."""
        return self._may_have_it or (self.known is not None and self.known.includes(self._us))

    def update(self, control: Control | None, manager: RemoteManager, now: float) -> bool:
        """Take a change of the known control; return whether it was never known before."""
        before, self.known, self.since = self._last, control, now
        self._last = control or before
        self._emit(events.ControlChanged(
            self._key, before, control, self.is_ours,
            was_lost=(before is not None and before.primary == self._us and control is not None
                      and not self.is_ours and not manager.is_releasing)))
        return before is None

    def lack(self, manager: RemoteManager) -> str:
        """Return why the known control does not permit a change, for people; '' if it does."""
        if self.is_ours:
            return (f'control of gimbal {self._key} is being released' if manager.is_releasing
                    else '')
        todo = '' if self.known and self.known.primary else '; take control first'
        return f'no control of gimbal {self._key}: {self.known}{todo}'

    def request(
        self, take: bool, manager: RemoteManager, now: float, caller: Caller,
    ) -> Result | None:
        """Take primary control, or release all; return the result if nothing need be sent."""
        if not take and self.known is not None and not self.has_any:
            # PX4 would take the system id from another component of our system.
            return Result(True, f'not in control: {self.known}')
        self._may_have_it |= take
        manager.change_control(Desired(
            configure(self._us, self._key.device_id, take=take), limit=REQUEST_LIMIT), now, caller)
        return None

    def ended(self, take: bool, result: Result, manager: RemoteManager) -> Result:
        """Take the result of a request; return it with what the manager makes of control."""
        if result.success or take and result.refused:
            self._may_have_it = False
        if result.success and take and not manager.enforces_control:
            return result._replace(
                message=f'{result.message}; ArduPilot also obeys components without control')
        return result
