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

"""Several simulated lights on one link."""

from __future__ import annotations

import functools
from typing import Any

from .device import Device
from .device_properties import DeviceProperties
from ..mavlink.component import Endpoint
from ..mavlink.deadline_queue import DeadlineQueue
from ..mavlink.messages import Address, CommandInt, CommandLong


class Devices(Endpoint):
    """Gives each what is for it, and has those act for which something is due."""

    def __init__(self, properties: list[DeviceProperties], now: float) -> None:
        super().__init__()
        self.devices = [Device(one, now, self.outgoing) for one in properties]
        self._agenda: DeadlineQueue[int] = DeadlineQueue()
        for index, device in enumerate(self.devices):
            device.changed = functools.partial(self._schedule, index)
            device.changed()

    def _schedule(self, index: int) -> None:
        self._agenda.set(index, self.devices[index].next_deadline())

    def link_opened(self, now: float) -> None:
        """See :meth:`Endpoint.link_opened`."""
        for device in self.devices:
            device.announce(now)

    def receive(self, source: Address, message: Any, now: float) -> None:
        """See :meth:`Endpoint.receive`."""
        if isinstance(message, CommandLong | CommandInt):
            for index, device in enumerate(self.devices):
                if device.addressed(message):
                    device.receive(source, message, now)
                    self._schedule(index)

    def poll(self, now: float) -> None:
        """See :meth:`Endpoint.poll`."""
        for index in self._agenda.due(now):
            self.devices[index].poll(now)
            self._schedule(index)

    def next_deadline(self) -> float:
        """See :meth:`Endpoint.next_deadline`."""
        return self._agenda.next_deadline()
