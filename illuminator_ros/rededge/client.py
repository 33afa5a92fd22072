# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The camera as a payload of a component: its liveness, its events, and requests."""

from __future__ import annotations

from collections import deque
from collections.abc import Collection
from dataclasses import dataclass
import random

from . import messages as rededge
from .captures import Captures
from .feeder import Feeder
from .input_states import CameraSettings
from .pings import PingDone, Pings
from ..mavlink.command_sender import CommandSender
from ..mavlink.component import Payload
from ..mavlink.dialect import mavlink
from ..mavlink.messages import Address, Heartbeat, Message
from ..payload.device_events import DeviceConnected, DeviceDisconnected, DeviceEvent
from ..payload.listeners import Listeners
from ..payload.liveness import Liveness
from ..payload.messages import Attitude, GlobalPositionInt, SystemTime

# Successive PINGs without a reply after which the camera counts as not receiving.
UNANSWERED_PINGS = 3
# So many heartbeats in CONFLICT_WINDOW s show several components: each sends one a second.
CONFLICT_HEARTBEATS = 10
CONFLICT_WINDOW = 7.0
# The last reports of images that are remembered, since a second path brings them again.
RECENT_REPORTS = 8


@dataclass(frozen=True)
class ImageTaken:
    """The camera reported an image, which any component may have requested."""

    feedback: rededge.CameraFeedback


CameraEvent = DeviceEvent[Address] | ImageTaken


@dataclass(frozen=True)
class CameraSnapshot:
    """
    The camera at one moment, for any thread; times are s on the link's clock.

    :param address: its latest address, None if it was never heard.
    :param heard_at: when its last heartbeat came, -inf if none has.
    :param loss: a text with the reason of its loss, '' if it is connected or was never heard.
    :param conflict: whether several components have the camera's component id.
    :param round_trip: of the last answered PING, s; None if no PING was answered.
    :param unanswered_pings: PINGs without a reply since the last reply.
    :param images: images that were reported since the start.
    :param image_index: of the newest reported image; None before it, and after a loss.
    """

    address: Address | None
    connected: bool
    heard_at: float
    loss: str
    conflict: bool
    round_trip: float | None
    unanswered_pings: int
    images: int
    image_index: int | None

    @property
    def is_unresponsive(self) -> bool:
        """Return whether the camera is heard, but does not answer PINGs."""
        return self.connected and self.unanswered_pings >= UNANSWERED_PINGS


class RedEdgeClient(Payload):
    """
    Feeds one camera, captures images, and reports its events.

    The camera is identified by its component id, since it adopts the system id of the host.

    :param commands: sends messages from the component's address; the camera takes no commands.
    :param sequence: the sequence number before the first PING; by default random, so that a reply
        to an earlier run does not count.
    :ivar feeder: takes the inputs.
    """

    messages = (Heartbeat, rededge.Ping, rededge.CameraStatus, rededge.CameraFeedback)
    sends = (rededge.DigicamControl, rededge.GpsRawInt, SystemTime, GlobalPositionInt, Attitude,
             rededge.MountStatus, rededge.GpsStatus)
    # A position must not wait behind attitudes.
    streams = ((rededge.GpsRawInt, SystemTime, GlobalPositionInt),
               (Attitude, rededge.MountStatus), (rededge.GpsStatus,))

    def __init__(
        self, commands: CommandSender, settings: CameraSettings, *, sequence: int | None = None,
    ) -> None:
        self.settings = settings
        self.events: Listeners[CameraEvent] = Listeners()
        self.feeder = Feeder(settings, commands.send, lambda: self.target, commands.schedule)
        self._commands = commands
        self._pings = Pings(commands, random.getrandbits(32) if sequence is None else sequence)
        self._captures = Captures(commands)
        self._address: Address | None = None
        self._liveness = Liveness(settings.heartbeat_timeout, 'the link is not open')
        self._heartbeats: deque[float] = deque(maxlen=CONFLICT_HEARTBEATS)
        self._reports: deque[rededge.CameraFeedback] = deque(maxlen=RECENT_REPORTS)

    @property
    def target(self) -> Address:
        """Return the target of messages to the camera; its system id is 0 until it is heard."""
        return self._address or Address(0, mavlink.MAV_COMP_ID_CAMERA)

    def snapshot(self, now: float) -> CameraSnapshot:
        """Return the camera at this moment; call it in the link's thread."""
        return CameraSnapshot(
            self._address, self._liveness.connected, self._liveness.heard_at, self._loss(now),
            self._is_conflict(now), self._pings.round_trip, self._pings.unanswered,
            self._captures.images, self._captures.newest)

    def _is_conflict(self, now: float) -> bool:
        return (len(self._heartbeats) == CONFLICT_HEARTBEATS
                and now - self._heartbeats[0] <= CONFLICT_WINDOW)

    # Liveness

    def link_opened(self, now: float) -> None:
        """See :meth:`Payload.link_opened`."""
        self._liveness.link_failure = ''
        self.feeder.set_link(is_open=True)
        self._pings.poll(now)

    def link_closed(self, now: float, reason: str) -> None:
        """See :meth:`Payload.link_closed`."""
        failure = self._liveness.link_failure = f'link lost: {reason}'
        self._lose(failure, now)
        self.feeder.set_link(is_open=False)
        self._pings.stop(failure)
        self._captures.stop(now, failure)

    def components_lost(self, lost: Collection[Address], now: float, reason: str) -> None:
        """See :meth:`Payload.components_lost`."""
        if self._address in lost:
            self._lose(f'link lost: {reason}', now)

    def _receive_heartbeat(self, source: Address, now: float) -> None:
        """Take a heartbeat of the camera's component id, whatever its content."""
        self._heartbeats.append(now)
        own, address = self._commands.address.system, self._address
        if self._liveness.connected and address and address.system == own != source.system:
            # Our camera has adopted our system id, so this is the camera of another vehicle.
            return
        self._address = source
        if self._liveness.hear(now):
            self.events.emit(DeviceConnected(source))
        self._commands.schedule.at(self._expire, self._liveness.silent_at)

    def _lose(self, reason: str, now: float) -> None:
        if self._liveness.lose(now):
            self._heartbeats.clear()
            self._captures.forget_count()
            self._reports.clear()
            self.events.emit(DeviceDisconnected(self.target, reason))

    def _loss(self, now: float) -> str:
        if self._liveness.connected or self._address is None:
            return ''
        return self._liveness.loss(f'camera {self._address}', now)

    # Requests, and messages of the camera

    def ping(self, now: float, done: PingDone) -> None:
        """Measure the round trip through the camera."""
        if refusal := self._commands.refusal or self._liveness.link_failure:
            done(False, refusal)
        else:
            self._pings.request(now, done)

    def capture(self, shot: rededge.Shot, now: float, done: PingDone) -> None:
        """Take an image; succeed only after its CAMERA_FEEDBACK."""
        if self._commands.refusal or not self._liveness.connected:
            done(False, self._commands.refusal or self._loss(now)
                 or 'no camera connected: none heard yet')
        else:
            self._captures.request(shot, self.target, now, done)

    def receive(self, source: Address, message: Message, now: float) -> None:
        """See :meth:`Payload.receive`."""
        if source.component != mavlink.MAV_COMP_ID_CAMERA:
            return
        if isinstance(message, Heartbeat):
            self._receive_heartbeat(source, now)
        elif isinstance(message, rededge.Ping):
            self._pings.receive(message, now)
        elif isinstance(message, rededge.CameraStatus):
            self._captures.receive_status(message, now)
        elif isinstance(message, rededge.CameraFeedback) and message not in self._reports:
            self._reports.append(message)
            note = ("; several components have the camera's id, so another may have taken it"
                    if self._is_conflict(now) else '')
            self.events.emit(ImageTaken(message))
            self._captures.receive_feedback(message, now, note)

    def sent(self, message: Message, now: float) -> None:
        """See :meth:`Payload.sent`."""
        self.feeder.sent(message)

    def close(self, now: float) -> None:
        """See :meth:`Payload.close`."""
        self._pings.end(self._commands.refusal)
        self._captures.end(self._commands.refusal)

    def _expire(self, now: float) -> None:
        """Note that the camera is silent."""
        if now >= self._liveness.silent_at:
            self._lose(self._liveness.silence(now), now)
