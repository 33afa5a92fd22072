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

"""The camera on a link: heartbeat, PING, captures and their feedback."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, replace
import math

from . import messages as rededge
from ..mavlink.command_sender import format_seconds
from ..mavlink.messages import Address, Message, target_of

# s between PINGs, and the wait for a reply; a requested PING is tried twice.
PING_INTERVAL = 2.0
PING_TIMEOUT = 1.0
PING_TRIES = 2
# Successive PINGs without a reply after which the camera counts as not receiving.
UNANSWERED_PINGS = 3
# s from DIGICAM_CONTROL to CAMERA_FEEDBACK.
CAPTURE_TIMEOUT = 5.0
# s in which the answer to a capture that had none may still come; captures fail meanwhile, since a
# lost request looks the same.
LATE_ANSWER = 15.0
# An image whose index is less than this behind the newest one is older; if it is farther behind,
# the camera has restarted.
OLDER_INDICES = 32
# Requests without an answer that are remembered.
MAX_LATE = 32
# So many heartbeats in CONFLICT_WINDOW s show several components: each sends one a second.
CONFLICT_HEARTBEATS = 10
CONFLICT_WINDOW = 7.0

# Takes success and a message for people, once.
Done = Callable[[bool, str], None]


@dataclass(frozen=True)
class CameraConnected:
    """The camera's heartbeat is heard."""

    address: Address


@dataclass(frozen=True)
class CameraLost:
    """The camera's heartbeat has stopped, or the link is closed."""

    address: Address
    reason: str


@dataclass(frozen=True)
class ImageTaken:
    """The camera reported an image, which any component may have requested."""

    feedback: rededge.CameraFeedback


CameraEvent = CameraConnected | CameraLost | ImageTaken


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


@dataclass(frozen=True)
class _PingRequest:
    since: float
    done: Done
    tries: int = 1

    @property
    def due(self) -> float:
        return self.since + self.tries * PING_TIMEOUT


@dataclass(frozen=True)
class _Capture:
    sent_at: float
    done: Done
    index: int | None = None
    # The time until which the earlier request that may have caused a reported image counts, s.
    late_until: float | None = None

    @property
    def due(self) -> float:
        return self.sent_at + CAPTURE_TIMEOUT


class Camera:
    """
    The camera, identified by its component id, since it adopts the system id of the host.

    :param own: the address of this component.
    :param heartbeat_timeout: silence after which it is lost, s.
    :param send: sends a message.
    :param emit: takes the events.
    :param sequence: the sequence number before the first PING.
    """

    def __init__(
        self, own: Address, heartbeat_timeout: float, send: Callable[[Message], None],
        emit: Callable[[CameraEvent], None], *, sequence: int,
    ) -> None:
        self._own = own
        self._timeout = heartbeat_timeout
        self._send = send
        self._emit = emit
        self._link_open = False
        # Why no request is taken any more, '' while requests are taken.
        self._closed = ''
        self._address: Address | None = None
        self._connected = False
        self._heard_at = -math.inf
        self._link_failure = ''
        self._heartbeats: deque[float] = deque(maxlen=CONFLICT_HEARTBEATS)
        self._sequence = sequence
        # When each unanswered PING was sent, by sequence number, s.
        self._pings: dict[int, float] = {}
        self._ping_due = math.inf
        self._ping_requests: list[_PingRequest] = []
        self._round_trip: float | None = None
        self._unanswered_pings = 0
        self._capture: _Capture | None = None
        self._newest: int | None = None
        # The ends of the times in which late answers to captures may come, s.
        self._late: deque[float] = deque(maxlen=MAX_LATE)
        # The index of the latest image that a request has triggered, and the time until which its
        # CAMERA_FEEDBACK may still come, s.
        self._triggered = 0, -math.inf
        self._images = 0

    @property
    def target(self) -> Address:
        """Return the target of messages to the camera; its system id is 0 until it is heard."""
        return self._address or Address(0, rededge.MAV_COMP_ID_CAMERA)

    def snapshot(self, now: float) -> CameraSnapshot:
        """Return the camera at this moment."""
        return CameraSnapshot(
            self._address, self._connected, self._heard_at, self._loss(now),
            self._is_conflict(now), self._round_trip, self._unanswered_pings, self._images,
            self._newest)

    def _is_conflict(self, now: float) -> bool:
        return (len(self._heartbeats) == CONFLICT_HEARTBEATS
                and now - self._heartbeats[0] <= CONFLICT_WINDOW)

    # The link

    def link_opened(self, now: float) -> None:
        """See :meth:`Payload.link_opened`."""
        if not self._link_open:
            self._link_open = True
            self._link_failure = ''
            self._ping_due = now

    def link_closed(self, now: float, reason: str) -> None:
        """See :meth:`Payload.link_closed`."""
        self._link_open = False
        self._ping_due = math.inf
        self._pings.clear()
        self._link_failure = f'link lost: {reason}'
        self._lose(self._link_failure)
        if self._capture is not None and self._capture.index is None:
            self._late.append(now + LATE_ANSWER)
        self._end_requests(self._link_failure)

    def close(self, reason: str) -> None:
        """Answer all requests, those after this call too, with the reason."""
        self._closed = reason
        self._end_requests(reason)

    def _end_requests(self, reason: str) -> None:
        requests, self._ping_requests = self._ping_requests, []
        for request in requests:
            request.done(False, reason)
        self._end_capture(False, f'{reason}; the image may have been taken')

    # Liveness

    def take_heartbeat(self, source: Address, now: float) -> None:
        """Take a heartbeat of the camera's component id, whatever its content."""
        self._address = source
        self._heard_at = now
        self._heartbeats.append(now)
        if not self._connected:
            self._connected = True
            self._emit(CameraConnected(source))

    def _lose(self, reason: str) -> None:
        if self._connected:
            self._connected = False
            self._heartbeats.clear()
            # After a restart the camera counts its images from the beginning.
            self._newest = None
            self._emit(CameraLost(self.target, reason))

    def _loss(self, now: float) -> str:
        if self._connected or self._address is None:
            return ''
        reason = self._link_failure or f'no heartbeat for {format_seconds(now - self._heard_at)}'
        return f'camera {self._address} is lost: {reason}'

    # PING

    def ping(self, now: float, done: Done) -> None:
        """Measure the round trip through the camera."""
        if self._closed or not self._link_open:
            done(False, self._closed or 'the link is not open')
            return
        self._ping_requests.append(_PingRequest(now, done))
        self._send_ping(now)

    def _send_ping(self, now: float) -> None:
        self._ping_due = now + PING_INTERVAL
        self._sequence = (self._sequence + 1) & 0xFFFFFFFF
        self._pings[self._sequence] = now
        self._send(rededge.Ping(int(now * 1e6), self._sequence, 0, 0))

    def take_ping(self, message: rededge.Ping, now: float) -> None:
        """Take a PING of the camera, which is a reply if its target is our address."""
        if target_of(message) != self._own:
            return
        sent_at = self._pings.pop(message.seq, None)
        if sent_at is None:
            return
        self._round_trip = now - sent_at
        self._unanswered_pings = 0
        answered = [one for one in self._ping_requests if one.since <= sent_at]
        self._ping_requests = [one for one in self._ping_requests if one.since > sent_at]
        for request in answered:
            request.done(True, f'{self._round_trip * 1000:.1f} ms round trip')

    def _poll_pings(self, now: float) -> None:
        for sequence, sent_at in list(self._pings.items()):
            if now >= sent_at + PING_TIMEOUT:
                del self._pings[sequence]
                self._unanswered_pings += 1
        for request in [one for one in self._ping_requests if now >= one.due]:
            self._ping_requests.remove(request)
            if request.tries < PING_TRIES:
                self._ping_requests.append(replace(request, tries=request.tries + 1))
                self._send_ping(now)
            else:
                request.done(False, f'no reply to {PING_TRIES} PINGs')
        if now >= self._ping_due:
            self._send_ping(now)

    # Captures

    def capture(self, shot: rededge.Shot, now: float, done: Done) -> None:
        """Take an image; succeed only after its CAMERA_FEEDBACK."""
        if self._closed:
            done(False, self._closed)
        elif not self._connected:
            done(False, self._loss(now) or 'no camera connected: none heard yet')
        elif self._capture is not None:
            done(False, 'another capture is under way')
        else:
            self._capture = _Capture(now, done)
            # The manufacturer recommends 1 for session and zoom_pos.
            self._send(rededge.DigicamControl(*self.target, 1, 1, 0, 0, shot, 0, 0, 0.0))

    def take_status(self, message: rededge.CameraStatus, now: float) -> None:
        """Take CAMERA_STATUS, which reports that an image was triggered."""
        if message.event_id == rededge.CameraStatusType.TRIGGER:
            if message.img_idx == self._triggered[0] and self._is_new(message.img_idx):
                # Each image is triggered once: the camera has restarted and counts from the start.
                self._triggered = 0, -math.inf
            self._take_index(message.img_idx, now)

    def take_feedback(self, message: rededge.CameraFeedback, now: float) -> None:
        """Take CAMERA_FEEDBACK, which reports that an image was taken."""
        self._images += 1
        self._take_index(message.img_idx, now)
        self._emit(ImageTaken(message))
        capture = self._capture
        if (capture is not None and capture.index == message.img_idx
                and message.flags == rededge.CameraFeedbackFlags.CLOSEDLOOP):
            note = ("; several components have the camera's id, so another may have taken it"
                    if self._is_conflict(now) else '')
            self._end_capture(
                True, f'image {capture.index} taken, confirmed after '
                      f'{format_seconds(now - capture.sent_at)}{note}')

    def _is_new(self, index: int) -> bool:
        """Return whether an image is newer than all others; its index has 16 bits."""
        return self._newest is None or (self._newest - index) & 0xFFFF >= OLDER_INDICES

    def _take_index(self, index: int, now: float) -> None:
        """Record an image; a request causes the first new image after it."""
        if not self._is_new(index):
            return
        self._newest = index
        triggered, until = self._triggered
        if index == triggered and now < until:
            # The camera was lost meanwhile.
            return
        while self._late and now >= self._late[0]:
            self._late.popleft()
        if self._late:
            # The image may be the late answer to an earlier request.
            late_until = self._late.popleft()
            if self._capture is not None:
                self._capture = replace(self._capture, late_until=late_until)
        elif self._capture is not None and self._capture.index is None:
            self._capture = replace(self._capture, index=index)
            self._triggered = index, self._capture.due + LATE_ANSWER

    def _end_capture(self, success: bool, text: str) -> None:
        capture, self._capture = self._capture, None
        if capture is not None:
            capture.done(success, text)

    def _poll_capture(self, capture: _Capture, now: float) -> None:
        if now < capture.due:
            return
        limit = format_seconds(CAPTURE_TIMEOUT)
        if capture.index is not None:
            self._end_capture(False, f'image {capture.index} triggered, not confirmed: no '
                                     f'CAMERA_FEEDBACK within {limit}')
            return
        text = f'no answer to DIGICAM_CONTROL within {limit}'
        if capture.late_until is None:
            self._late.append(now + LATE_ANSWER)
        else:
            # A new period here would never end while images are taken.
            self._late.appendleft(capture.late_until)
            text += '; an image was reported that an earlier request may have caused'
        self._end_capture(False, text)

    def poll(self, now: float) -> None:
        """See :meth:`Payload.poll`."""
        if self._connected and now >= self._heard_at + self._timeout:
            self._lose(f'no heartbeat for {format_seconds(self._timeout)}')
        if self._link_open:
            self._poll_pings(now)
        if self._capture is not None:
            self._poll_capture(self._capture, now)

    def next_deadline(self) -> float:
        """See :meth:`Payload.next_deadline`."""
        return min(
            self._heard_at + self._timeout if self._connected else math.inf, self._ping_due,
            min(self._pings.values(), default=math.inf) + PING_TIMEOUT,
            min((one.due for one in self._ping_requests), default=math.inf),
            self._capture.due if self._capture is not None else math.inf)
