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

"""A second MAVLink sender on the same light: somebody else who changes it."""

from __future__ import annotations

import math
import threading
from typing import Any

from illuminator_ros.mavlink.command import Command, CommandResult, CommandSender
from illuminator_ros.mavlink.component import Endpoint, Heartbeat
from illuminator_ros.mavlink.link import Link
from illuminator_ros.mavlink.messages import Address, CommandAck, MavCmd
from illuminator_ros.mavlink.url import parse_url

IDENTITY = Address(255, 190)
MAV_TYPE_GCS = 6


class GroundStation(Endpoint):
    """Sends commands to a light, without ROS and without the bridge."""

    def __init__(self, url: str) -> None:
        super().__init__()
        self._heartbeat = Heartbeat(IDENTITY, MAV_TYPE_GCS)
        self._sender = CommandSender(IDENTITY)
        self.outgoing = self._sender.outgoing
        self._link = Link(parse_url(url), self, label=url)
        self._link.start()

    def configure(self, target: Address, mode: int, brightness: float, period: float,
                  duty: float, timeout: float = 5.0) -> CommandResult:
        """Send MAV_CMD_DO_ILLUMINATOR_CONFIGURE and return its outcome."""
        command = Command(
            target, MavCmd.DO_ILLUMINATOR_CONFIGURE, (mode, brightness, period, duty))
        outcomes: list[CommandResult] = []
        ended = threading.Event()

        def done(outcome: CommandResult, now: float) -> None:
            outcomes.append(outcome)
            ended.set()

        self._link.call(lambda now: self._sender.start(command, now, done, limit=now + timeout))
        ended.wait(timeout + 1.0)
        return outcomes[0]

    def close(self) -> None:
        """Close the link."""
        self._link.stop()

    def link_opened(self, now: float) -> None:
        """See :meth:`Endpoint.link_opened`."""
        self._heartbeat.send(now, self.outgoing)

    def receive(self, source: Address, message: Any, now: float) -> None:
        """See :meth:`Endpoint.receive`."""
        if isinstance(message, CommandAck):
            self._sender.acknowledge(source, message, now)

    def poll(self, now: float) -> None:
        """See :meth:`Endpoint.poll`."""
        self._heartbeat.poll(now, self.outgoing)
        self._sender.poll(now)

    def next_deadline(self) -> float:
        """See :meth:`Endpoint.next_deadline`."""
        return min(self._heartbeat.due, self._sender.next_deadline(), math.inf)
