# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Hostile input: valid frames with wrong content, invalid frames, and noise."""

from __future__ import annotations

import math
import random
import re
import struct
from typing import Any

from illuminator_ros.illuminator.messages import IlluminatorStatus
from illuminator_ros.mavlink import messages as mav
from illuminator_ros.mavlink.dialect import CRC_EXTRA, encode, mavlink
from illuminator_ros.mavlink.signing import MAX_TICKS, signature, ticks
from support.frames import raw_v1, raw_v2

MESSAGES: tuple[type[mav.Message], ...] = (
    mav.Heartbeat, IlluminatorStatus, IlluminatorStatus, mav.ComponentInformationBasic,
    mav.CommandAck, mav.CommandAck, mav.CommandLong, mav.CommandInt)
FLOATS = (0.0, -0.0, 1.0, 50.0, 100.0, 100.00001, -1.0, -1e-30, 1e-45, 3.4e38, -3.4e38, 25.5,
          math.nan, -math.nan, math.inf, -math.inf, 440.0, 396.0, 1e6, 0.05, 3600.5)
# Values of fields that decide about the processing of a message.
TELLING = {'command': (405, 406, 511, 512, 80, 0, 65535), 'result': (*range(11), 255),
           'type': (mavlink.MAV_TYPE_ILLUMINATOR, mavlink.MAV_TYPE_ILLUMINATOR, 0, 18, 255)}
# Lengths of payloads: too short, right, extended, the longest.
LENGTHS = (0, 1, 2, 3, 9, 10, 30, 33, 34, 35, 36, 38, 160, 161, 200, 254, 255)
Datagrams = list[tuple[bytes, Any]]


class Attacker:
    """
    Makes datagrams, the same ones for the same seed.

    :param key: the key that signs some of the frames correctly.
    :param sources: addresses that the attacker impersonates.
    """

    def __init__(self, seed: object, key: bytes, sources: list[mav.Address]) -> None:
        self._draw = random.Random(repr(seed))
        self._key = key
        self._sources = sources
        self._count = 0

    def datagrams(self, now: float) -> Datagrams:
        """Return the next datagrams, with the peers that they come from."""
        draw, peer = self._draw, self._peer()
        kind = draw.randrange(22)
        if kind < 12:
            return [(self._frame(now), peer)]
        if kind < 16:
            return [(self._mutated(self._frame(now)), peer)]
        if kind < 17:
            data = draw.randbytes(draw.randrange(300))
            return [(data.replace(b'\x00', b'\xfd').replace(b'\x01', b'\xfe'), peer)]
        if kind < 18:
            return [(b''.join(self._frame(now) + draw.randbytes(draw.randrange(8))
                              for _ in range(3)), peer)]
        if kind < 19:
            data = self._frame(now) + self._frame(now)
            at = draw.randrange(len(data))
            return [(data[:at], peer), (data[at:], peer)]
        if kind < 20:
            return [(raw_v2(draw.randrange(1 << 24), draw.randbytes(draw.choice(LENGTHS)),
                            crc_extra=0, source=self._source()), peer) for _ in range(10)]
        if kind < 21:
            return [(self._framed(mav.Heartbeat, self._any_source(), now), peer)
                    for _ in range(10)]
        return [(self._frame(now), self._new_peer()) for _ in range(10)]

    def _peer(self) -> Any:
        if self._draw.random() < 0.7:
            return '127.0.0.1', self._draw.randrange(40_000, 40_004)
        return self._new_peer()

    def _new_peer(self) -> Any:
        self._count += 1
        return f'127.{self._count >> 16 & 255}.{self._count >> 8 & 255}.{self._count & 255}', 9

    def _source(self) -> mav.Address:
        if self._draw.random() < 0.6:
            return self._draw.choice(self._sources)
        return self._any_source()

    def _any_source(self) -> mav.Address:
        return mav.Address(self._draw.randrange(256), self._draw.randrange(256))

    def _mutated(self, frame: bytes) -> bytes:
        draw, data = self._draw, bytearray(frame)
        for _ in range(draw.randrange(1, 4)):
            at = draw.randrange(len(data))
            end = at + draw.randrange(2 if len(data) > 1 else 1)
            data[at:end] = draw.choice((
                bytes((data[at] ^ 1 << draw.randrange(8),)), b'\0', b'\xff', b'\xfd', b'\xfe',
                draw.randbytes(draw.randrange(4)), data[at:at + 1]))
        return bytes(data)

    def _frame(self, now: float) -> bytes:
        if self._draw.random() < 0.05:
            return raw_v2(self._draw.choice(list(CRC_EXTRA)),
                          self._draw.randbytes(self._draw.choice(LENGTHS)), source=self._source())
        return self._framed(self._draw.choice(MESSAGES), self._source(), now)

    def _framed(self, cls: type[mav.Message], source: mav.Address, now: float) -> bytes:
        draw, payload = self._draw, encode(self._message(cls))
        if draw.random() < 0.1:
            payload = (payload + draw.randbytes(255))[:draw.choice(LENGTHS)]
        elif draw.random() < 0.8:
            payload = payload.rstrip(b'\0') or b'\0'
        sequence = draw.randrange(256)
        if cls.id < 256 and draw.random() < 0.15:
            return raw_v1(cls.id, payload, sequence=sequence, source=source)
        if draw.random() < 0.4:
            return self.signed(cls.id, payload, sequence, source, now)
        flags = draw.choice((0,) * 20 + (2, 0x80, 0xFF))
        return raw_v2(cls.id, payload, incompat=flags, sequence=sequence, source=source)

    def signed(
        self, message_id: int, payload: bytes, sequence: int, source: mav.Address, now: float,
    ) -> bytes:
        """Return a signed frame, whose signature and time stamp may be wrong."""
        frame = raw_v2(message_id, payload, incompat=1, sequence=sequence, source=source)
        fresh = ticks(1.7e9 + now) + self._draw.randrange(1000)
        stamp = self._draw.choice((fresh, fresh, fresh, 0, MAX_TICKS, fresh - 10**8))
        # A time stamp of the far future is accepted only from the owner of the key.
        genuine = self._draw.random() < 0.5 and stamp <= fresh
        frame += bytes((self._draw.randrange(256),)) + stamp.to_bytes(6, 'little')
        return frame + (signature(self._key, frame) if genuine else self._draw.randbytes(6))

    def _message(self, cls: type[mav.Message]) -> mav.Message:
        target = self._draw.choice([(0, 0), *self._sources, self._any_source()])
        telling = {**TELLING, 'target_system': target[:1], 'target_component': target[1:]}
        # None of the messages has an array of numbers.
        codes = dict(zip(cls.ordered_fieldnames, re.findall(
            r'\d+s|[A-Za-z]', cls.unpacker.format), strict=True))
        make: Any = cls
        message: mav.Message = make(*(
            self._draw.choice(telling[name]) if name in telling else self._value(codes[name])
            for name in cls.fieldnames))
        return message

    def _value(self, code: str) -> Any:
        draw, size = self._draw, struct.calcsize(f'<{code}')
        if code.endswith('s'):
            return draw.choice((
                b'', b'torch', b'\xff' * size, bytes(range(1, size + 1)),
                'Ünï\u202e'.encode(), draw.randbytes(size)))[:size]
        if code == 'f' and draw.random() < 0.8:
            return draw.choice(FLOATS)
        small = draw.choice((0, 1, 2, (1 << 8 * size) - 1, (1 << 8 * size - 1) - 1))
        data = draw.choice((small.to_bytes(size, 'little'), draw.randbytes(size)))
        return struct.unpack(f'<{code}', data)[0]
