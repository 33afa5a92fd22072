# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The images that the camera takes on request, and its reports of all images."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
import math

from . import messages as rededge
from .pings import PingDone
from ..mavlink.command_sender import CommandSender
from ..mavlink.dialect import entry_names, mavlink
from ..mavlink.durations import format_seconds
from ..mavlink.messages import Address

# s from DIGICAM_CONTROL to CAMERA_FEEDBACK.
CAPTURE_TIMEOUT = 5.0
# s in which the answer to a capture that had none may still come; captures fail meanwhile, since a
# lost request looks the same.
LATE_ANSWER = 15.0
# An image whose index is less than this behind the newest one is older; if it is farther behind,
# the camera has restarted.
OLDER_INDICES = 32
# CAMERA_FEEDBACK_FLAGS, a number instead of bits, of an image that was taken: MicaSense cameras
# send CLOSEDLOOP, and ArduPilot sends PHOTO, which is 0.
TAKEN = (mavlink.CAMERA_FEEDBACK_PHOTO, mavlink.CAMERA_FEEDBACK_CLOSEDLOOP)
# Requests without an answer that are remembered.
MAX_LATE = 32


@dataclass
class _Capture:
    sent_at: float
    done: PingDone
    index: int | None = None
    # Why its CAMERA_FEEDBACK does not confirm the image, '' while none has come.
    doubt: str = ''
    # The time until which the earlier request that may have caused a reported image counts, s.
    late_until: float | None = None

    @property
    def due(self) -> float:
        return self.sent_at + CAPTURE_TIMEOUT

    def described(self, now: float) -> str:
        """Return how far it has come, for people."""
        heard = ('the camera has not answered' if self.index is None else
                 f'image {self.index} was triggered')
        return (f'another capture is under way since {format_seconds(now - self.sent_at)}: '
                f'{heard}; it ends within {format_seconds(max(self.due - now, 0.0))}')


class Captures:
    """
    Requests one image at a time, and assigns the reports of images to the requests.

    :param commands: sends the requests.
    :ivar images: images that were reported since the start.
    :ivar newest: index of the newest reported image; None before it, and after a loss.
    """

    def __init__(self, commands: CommandSender) -> None:
        self.images = 0
        self.newest: int | None = None
        self._commands = commands
        self._capture: _Capture | None = None
        # The ends of the times in which late answers to captures may come, s.
        self._late: deque[float] = deque(maxlen=MAX_LATE)
        # The index of the latest image that a request has triggered, and the time until which its
        # CAMERA_FEEDBACK may still come, s.
        self._triggered = 0, -math.inf

    def request(self, shot: rededge.Shot, target: Address, now: float, done: PingDone) -> None:
        """Take an image; succeed only after its CAMERA_FEEDBACK."""
        if self._capture is not None:
            done(False, self._capture.described(now))
            return
        self._capture = _Capture(now, done)
        self._commands.schedule.at(self._expire, self._capture.due)
        # The manufacturer recommends 1 for session and zoom_pos.
        self._commands.send(rededge.DigicamControl(*target, 1, 1, 0, 0, shot, 0, 0, 0.0))

    def forget_count(self) -> None:
        """Note that the camera is lost: after a restart it counts its images from the start."""
        self.newest = None

    def stop(self, now: float, reason: str) -> None:
        """End the request, since the link is closed."""
        if self._capture is not None and self._capture.index is None:
            self._late.append(now + LATE_ANSWER)
        self.end(reason)

    def end(self, reason: str) -> None:
        """End the request."""
        self._end(False, f'{reason}; the image may have been taken')

    def receive_status(self, message: rededge.CameraStatus, now: float) -> None:
        """Take CAMERA_STATUS, which reports that an image was triggered."""
        if message.event_id == mavlink.CAMERA_STATUS_TYPE_TRIGGER:
            if message.img_idx == self._triggered[0] and self._is_new(message.img_idx):
                # Each image is triggered once: the camera has restarted and counts from the start.
                self._triggered = 0, -math.inf
            self._note_index(message.img_idx, now)

    def receive_feedback(self, message: rededge.CameraFeedback, now: float, note: str) -> None:
        """
        Take CAMERA_FEEDBACK, which reports that an image was taken.

        :param note: is added to the answer of the request that caused the image.
        """
        self.images += 1
        self._note_index(message.img_idx, now)
        capture = self._capture
        if capture is None or capture.index != message.img_idx:
            return
        if message.flags in TAKEN:
            self._end(True, f'image {capture.index} taken, confirmed after '
                            f'{format_seconds(now - capture.sent_at)}{note}')
        else:
            name = entry_names('CAMERA_FEEDBACK_FLAGS').get(message.flags, 'unknown')
            capture.doubt = f'its CAMERA_FEEDBACK has the flags {message.flags} ({name})'

    def _is_new(self, index: int) -> bool:
        """Return whether an image is newer than all others; its index has 16 bits."""
        return self.newest is None or (self.newest - index) & 0xFFFF >= OLDER_INDICES

    def _note_index(self, index: int, now: float) -> None:
        """Record an image; a request causes the first new image after it."""
        if not self._is_new(index):
            return
        self.newest = index
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
                self._capture.late_until = late_until
        elif self._capture is not None and self._capture.index is None:
            self._capture.index = index
            self._triggered = index, self._capture.due + LATE_ANSWER

    def _end(self, success: bool, text: str) -> None:
        capture, self._capture = self._capture, None
        if capture is not None:
            capture.done(success, text)

    def _expire(self, now: float) -> None:
        """End a request whose time is over."""
        capture, limit = self._capture, format_seconds(CAPTURE_TIMEOUT)
        if capture is None or now < capture.due:
            return
        if capture.index is not None:
            self._end(False, f'image {capture.index} triggered, not confirmed: '
                      + (capture.doubt or f'no CAMERA_FEEDBACK within {limit}'))
            return
        text = f'no answer to DIGICAM_CONTROL within {limit}'
        if capture.late_until is None:
            self._late.append(now + LATE_ANSWER)
        else:
            # A new period here would never end while images are taken.
            self._late.appendleft(capture.late_until)
            text += '; an image was reported that an earlier request may have caused'
        self._end(False, text)
