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

"""The camera as a payload of a component."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
import random

from . import messages as rededge
from .camera import Camera, CameraEvent, CameraSnapshot
from .feeder import Feeder, FeederSnapshot
from .input_states import FeederSettings, InputChanged
from ..mavlink.command_sender import CommandSender
from ..mavlink.component import Payload
from ..mavlink.dialect import mavlink
from ..mavlink.messages import Address, Heartbeat, Message
from ..payload.listeners import Listeners
from ..payload.messages import Attitude, GlobalPositionInt, SystemTime


@dataclass(frozen=True)
class Settings:
    """
    The settings of the client.

    :param heartbeat_timeout: silence after which the camera is lost, s.
    """

    feeder: FeederSettings = FeederSettings()
    heartbeat_timeout: float = 3.5


@dataclass(frozen=True)
class ClientSnapshot:
    """The camera and its inputs at one moment, for any thread."""

    camera: CameraSnapshot
    feeder: FeederSnapshot


class RedEdgeClient(Payload):
    """
    Feeds one camera, captures images, and reports its events.

    :param commands: sends messages from the component's address; the camera takes no commands.
    :param sequence: the sequence number before the first PING; by default random, so that a reply
        to an earlier run does not count.
    :ivar camera: PINGs and captures.
    :ivar feeder: takes the inputs.
    """

    messages = (Heartbeat, rededge.Ping, rededge.CameraStatus, rededge.CameraFeedback)
    sends = (rededge.DigicamControl, rededge.GpsRawInt, SystemTime, GlobalPositionInt, Attitude,
             rededge.MountStatus, rededge.GpsStatus)
    # A position must not wait behind attitudes.
    streams = ((rededge.GpsRawInt, SystemTime, GlobalPositionInt),
               (Attitude, rededge.MountStatus), (rededge.GpsStatus,))

    def __init__(
        self, commands: CommandSender, settings: Settings, *, sequence: int | None = None,
    ) -> None:
        self.settings = settings
        self.events: Listeners[CameraEvent | InputChanged] = Listeners()
        self._commands = commands
        self.camera = Camera(
            commands.address, settings.heartbeat_timeout, commands.send, self.events.emit,
            sequence=random.getrandbits(32) if sequence is None else sequence)
        self.feeder = Feeder(
            settings.feeder, commands.send, lambda: self.camera.target, self.events.emit)

    def snapshot(self, now: float) -> ClientSnapshot:
        """Return camera and inputs at this moment; call it in the link's thread."""
        return ClientSnapshot(self.camera.snapshot(now), self.feeder.snapshot(now))

    def link_opened(self, now: float) -> None:
        """See :meth:`Payload.link_opened`."""
        self.camera.link_opened(now)
        self.feeder.link_opened(now)

    def link_closed(self, now: float, reason: str) -> None:
        """See :meth:`Payload.link_closed`."""
        self.camera.link_closed(now, reason)
        self.feeder.link_closed()

    def components_lost(self, lost: Collection[Address], now: float, reason: str) -> None:
        """See :meth:`Payload.components_lost`."""
        self.camera.components_lost(lost, reason)

    def receive(self, source: Address, message: Message, now: float) -> None:
        """See :meth:`Payload.receive`."""
        if source.component != mavlink.MAV_COMP_ID_CAMERA:
            return
        if isinstance(message, Heartbeat):
            self.camera.take_heartbeat(source, now)
        else:
            self.camera.receive(message, now)

    def close(self, now: float) -> None:
        """See :meth:`Payload.close`."""
        self.camera.close(self._commands.refusal)

    def poll(self, now: float) -> None:
        """See :meth:`Payload.poll`."""
        self.camera.poll(now)
        self.feeder.poll(now)

    def next_deadline(self) -> float:
        """See :meth:`Payload.next_deadline`."""
        return min(self.camera.next_deadline(), self.feeder.next_deadline())
