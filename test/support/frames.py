# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Frames for tests, right ones and wrong ones."""

from __future__ import annotations

from collections import Counter

from fastcrc.crc16 import mcrf4xx
from illuminator_ros.mavlink import messages as mav
from illuminator_ros.mavlink.dialect import base_size, CRC_EXTRA, encode, mavlink
from illuminator_ros.mavlink.frame import Decoder, encode_frame, Frame
from illuminator_ros.mavlink.signing import Signing
from support.messages import decode_payload, HANDLED, STATUS

LIGHT = mav.Address(1, 243)
# Bytes that do not begin a frame, and that are long enough to complete any frame.
FILLER = bytes(300)


def frame_of(message: mav.Message = STATUS, sequence: int = 0, source: mav.Address = LIGHT, *,
             signed: bool = False, version: int = 2) -> bytes:
    """Return a frame of this package, without the signature that a signed one still needs."""
    payload = encode(message)
    return encode_frame(
        message.get_msgId(), payload if version == 2 else payload[:base_size(type(message))],
        sequence=sequence,
        source=source, crc_extra=message.crc_extra, signed=signed, version=version)


def heartbeat_frame(source: mav.Address = LIGHT, sequence: int = 0,
                    mav_type: int = mavlink.MAV_TYPE_ILLUMINATOR) -> bytes:
    """Return the heartbeat of a light, or of another component."""
    return frame_of(mav.heartbeat(mav_type), sequence, source)


class Codec:
    """
    Messages to numbered frames and back, as a component at the far end of a line has them.

    :param signing: signs the frames, as its mode says.
    :param version: of MAVLink.
    """

    def __init__(self, signing: Signing | None = None, version: int = 2) -> None:
        self.decoder = Decoder()
        self._version = version
        self._signing = signing or Signing()
        self._sent: Counter[mav.Address] = Counter()

    def frame(self, source: mav.Address, message: mav.Message, now: float = 0.0) -> bytes:
        """Return a message as a frame with the next sequence number of its sender."""
        data = frame_of(message, self._sent[source] & 0xFF, source, signed=self._signing.signs,
                        version=self._version)
        self._sent[source] += 1
        return self._signing.sign(data, 1.7e9 + now) if self._signing.signs else data

    def messages(self, data: bytes) -> list[tuple[mav.Address, mav.Message]]:
        """Return the messages in a stream, with their senders."""
        return [(frame.source, decode_payload(frame.message_id, frame.payload))
                for frame in self.decoder.feed(data) if frame.message_id in HANDLED]


def raw_v2(message_id: int, payload: bytes, *, crc_extra: int | None = None, incompat: int = 0,
           compat: int = 0, sequence: int = 0, source: mav.Address = LIGHT) -> bytes:
    """Return a MAVLink 2 frame with any flags, length and CRC_EXTRA."""
    header = bytes((len(payload), incompat, compat, sequence, *source))
    return _raw(0xFD, message_id, header + message_id.to_bytes(3, 'little') + payload, crc_extra)


def raw_v1(message_id: int, payload: bytes, *, crc_extra: int | None = None, sequence: int = 0,
           source: mav.Address = LIGHT) -> bytes:
    """Return a MAVLink 1 frame of any length."""
    return _raw(0xFE, message_id,
                bytes((len(payload), sequence, *source, message_id)) + payload, crc_extra)


def _raw(stx: int, message_id: int, body: bytes, crc_extra: int | None) -> bytes:
    seed = CRC_EXTRA[message_id] if crc_extra is None else crc_extra
    return bytes((stx,)) + body + mcrf4xx(body + bytes((seed,))).to_bytes(2, 'little')


def spoilt(frame: bytes, at: int = -1) -> bytes:
    """Return a frame with one bit wrong, in the checksum or elsewhere."""
    changed = bytearray(frame)
    changed[at] ^= 0x40
    return bytes(changed)


def only(data: bytes) -> Frame:
    """Return the one frame that the data holds."""
    (frame,) = Decoder().feed(data)
    return frame


def decoded(data: bytes) -> list[Frame]:
    """Return the frames of a stream that ends with the data."""
    return Decoder().feed(data + FILLER)
