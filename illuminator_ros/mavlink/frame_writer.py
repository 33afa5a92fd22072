# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The sending side of a link: sequence numbers, framing and signing; no I/O, no clock."""

from __future__ import annotations

from collections import deque
import random

from .dialect import base_size, encode
from .errors import InvalidValue
from .forwarding.duplicate_filter import DuplicateFilter, OWN
from .frame import encode_frame, Frame
from .messages import Address, Message
from .signing import Signing, stamp_of

# s for which an unsigned frame may return. Each second that is remembered is one more sequence
# number with which the heartbeat of another sender with our address would pass for ours.
MEMORY = 1.0
MAX_FRAMES = 64
# Time stamps of signed frames, which are unique: they may return at any time.
MAX_STAMPS = 4096

_Key = tuple[Address, int, int, bytes]


class LoopbackFilter:
    """Distinguishes our own returning frames from frames of another sender with our address."""

    def __init__(self) -> None:
        self._sent: deque[tuple[float, _Key]] = deque(maxlen=MAX_FRAMES)
        # In the order of sending.
        self._stamps: dict[int, None] = {}

    def sent(self, source: Address, sequence: int, message_id: int, payload: bytes,
             now: float) -> None:
        """Note a frame that is sent."""
        self._sent.append((now, (source, sequence, message_id, payload.rstrip(b'\0'))))

    def signed(self, stamp: int) -> None:
        """Note the time stamp of a frame that is sent signed."""
        self._stamps[stamp] = None
        if len(self._stamps) > MAX_STAMPS:
            del self._stamps[next(iter(self._stamps))]

    def has(self, frame: Frame, now: float) -> bool:
        """Return whether a frame is one of ours."""
        if frame.signature is not None and stamp_of(frame.signature) in self._stamps:
            return True
        key = (frame.source, frame.sequence, frame.message_id, frame.payload.rstrip(b'\0'))
        return any(now - at <= MEMORY and key == sent for at, sent in self._sent)


class FrameWriter:
    """
    Makes frames of messages, and recognises them when they return.

    :param version: 1 or 2, of all frames.
    :param duplicates: remembers the frames, None where none are forwarded.
    :ivar sequences: the next sequence number of each address that was sent from.
    :raises InvalidValue: if the frames must be signed and MAVLink 1 cannot.
    """

    def __init__(self, signing: Signing, version: int = 2,
                 duplicates: DuplicateFilter | None = None) -> None:
        if version not in (1, 2):
            raise InvalidValue(f'MAVLink version {version} is neither 1 nor 2')
        if version == 1 and signing.signs:
            raise InvalidValue('MAVLink 1 frames cannot be signed: switch signing off, '
                               'or use MAVLink 2')
        self.sequences: dict[Address, int] = {}
        self._signing = signing
        self._signs = signing.signs
        self._version = version
        self._duplicates = duplicates
        self._loopback = LoopbackFilter()

    def frame(self, source: Address, message: Message, now: float, unix_time: float) -> bytes:
        """
        Return the frame of a message.

        :raises InvalidValue: if MAVLink 1 cannot carry the message.
        :raises struct.error: if a value does not fit into its field.
        """
        payload = encode(message)
        if self._version == 1:
            payload = payload[:base_size(type(message))]
        sequence = self.sequences.get(source, -1)
        if sequence < 0:
            # Two programs that were started together with one address can then be distinguished.
            sequence = random.randrange(256)
        frame = encode_frame(
            message.get_msgId(), payload, sequence=sequence, source=source,
            crc_extra=message.crc_extra, signed=self._signs, version=self._version)
        self.sequences[source] = (sequence + 1) & 0xFF
        self._loopback.sent(source, sequence, message.get_msgId(), payload, now)
        if self._signs:
            frame = self._signing.sign(frame, unix_time)
            self._loopback.signed(self._signing.timestamp)
        if self._duplicates is not None:
            self._duplicates.add(frame, OWN, now)
        return frame

    def is_loopback(self, frame: Frame, now: float) -> bool:
        """Return whether a frame is one of our own that has returned."""
        return frame.source in self.sequences and self._loopback.has(frame, now)
