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

"""Hostile input: valid frames with wrong content, invalid frames, and noise."""

from __future__ import annotations

from collections.abc import Callable
import math
import random
import struct
from typing import Any

from illuminator_ros.illuminator.messages import IlluminatorStatus
from illuminator_ros.mavlink.messages import (
    Address,
    CommandAck,
    CommandInt,
    CommandLong,
    ComponentInformationBasic,
    encode_payload,
    Heartbeat,
    LAYOUTS,
    MavType,
)
from illuminator_ros.mavlink.signing import MAX_TICKS, signature, ticks
from support.frames import raw_v1, raw_v2

FLOATS = (0.0, -0.0, 1.0, 50.0, 100.0, 100.00001, -1.0, -1e-30, 1e-45, 3.4e38, -3.4e38, 25.5,
          math.nan, -math.nan, math.inf, -math.inf, 440.0, 396.0, 1e6, 0.05, 3600.5)
COMMANDS = (405, 406, 511, 512, 80, 0, 65535)
# Every length that is of interest: too short, right, extended, the longest.
LENGTHS = (0, 1, 2, 3, 9, 10, 30, 33, 34, 35, 36, 38, 160, 161, 200, 254, 255)


class Attacker:
    """
    Makes datagrams, the same ones for the same seed.

    :param key: that signs some of the frames rightly.
    :param sources: addresses worth claiming to be.
    """

    def __init__(self, seed: object, key: bytes, sources: list[Address]) -> None:
        self._random = random.Random(repr(seed))
        self._key = key
        self._sources = sources
        self._count = 0
        self._kinds: list[Callable[[float], list[tuple[bytes, Any]]]] = [
            *[self._one_frame] * 12, *[self._mutated] * 4, self._noise, self._glued,
            self._split, self._unknown_ids, self._new_systems, self._new_peers]

    def datagrams(self, now: float) -> list[tuple[bytes, Any]]:
        """Return the next datagrams, with the peers that they come from."""
        return self._random.choice(self._kinds)(now)

    # Peers

    def _peer(self) -> Any:
        if self._random.random() < 0.7:
            return '127.0.0.1', self._random.randrange(40_000, 40_004)
        return self._new_peer()

    def _new_peer(self) -> Any:
        self._count += 1
        return f'127.{self._count >> 16 & 255}.{self._count >> 8 & 255}.{self._count & 255}', 9

    # Datagrams

    def _one_frame(self, now: float) -> list[tuple[bytes, Any]]:
        return [(self._frame(now), self._peer())]

    def _mutated(self, now: float) -> list[tuple[bytes, Any]]:
        data = bytearray(self._frame(now))
        for _ in range(self._random.randrange(1, 4)):
            at = self._random.randrange(len(data))
            what = self._random.randrange(4)
            if what == 0:
                data[at] ^= 1 << self._random.randrange(8)
            elif what == 1:
                data[at] = self._random.choice((0, 255, 0xFD, 0xFE))
            elif what == 2:
                data[at:at] = self._random.randbytes(self._random.randrange(4))
            elif len(data) > 1:
                del data[at]
        return [(bytes(data), self._peer())]

    def _noise(self, now: float) -> list[tuple[bytes, Any]]:
        data = self._random.randbytes(self._random.randrange(300))
        return [(data.replace(b'\x00', b'\xfd').replace(b'\x01', b'\xfe'), self._peer())]

    def _glued(self, now: float) -> list[tuple[bytes, Any]]:
        pieces = []
        for _ in range(self._random.randrange(2, 5)):
            pieces += [self._frame(now), self._random.randbytes(self._random.randrange(8))]
        return [(b''.join(pieces), self._peer())]

    def _split(self, now: float) -> list[tuple[bytes, Any]]:
        data, peer = self._frame(now) + self._frame(now), self._peer()
        at = self._random.randrange(len(data))
        return [(data[:at], peer), (data[at:], peer)]

    def _unknown_ids(self, now: float) -> list[tuple[bytes, Any]]:
        peer, source = self._peer(), self._source()
        return [(raw_v2(self._random.randrange(1 << 24), self._payload(), crc_extra=0,
                        source=source), peer) for _ in range(10)]

    def _new_systems(self, now: float) -> list[tuple[bytes, Any]]:
        peer = self._peer()
        return [(self._framed(self._any_heartbeat(), self._any_source(), now), peer)
                for _ in range(10)]

    def _new_peers(self, now: float) -> list[tuple[bytes, Any]]:
        return [(self._frame(now), self._new_peer()) for _ in range(10)]

    # Frames

    def _frame(self, now: float) -> bytes:
        if self._random.random() < 0.05:
            message_id = self._random.choice(list(LAYOUTS))
            return raw_v2(message_id, self._payload(), source=self._source())
        return self._framed(self._random.choice((
            self._any_heartbeat, self._status, self._status, self._information, self._ack,
            self._ack, self._command_long, self._command_int))(), self._source(), now)

    def _framed(self, message: Any, source: Address, now: float) -> bytes:
        cls = type(message)
        payload = encode_payload(message)
        if self._random.random() < 0.1:
            payload = (payload + self._random.randbytes(255))[:self._random.choice(LENGTHS)]
        elif self._random.random() < 0.8:
            payload = payload.rstrip(b'\0') or b'\0'
        sequence = self._random.randrange(256)
        if cls.id < 256 and len(payload) < 256 and self._random.random() < 0.15:
            return raw_v1(cls.id, payload, sequence=sequence, source=source)
        if self._random.random() < 0.4:
            return self.signed(cls.id, payload, sequence, source, now)
        flags = self._random.choice((0,) * 20 + (2, 0x80, 0xFF))
        return raw_v2(cls.id, payload, incompat=flags, sequence=sequence, source=source)

    def signed(
        self, message_id: int, payload: bytes, sequence: int, source: Address, now: float,
    ) -> bytes:
        frame = raw_v2(message_id, payload, incompat=1, sequence=sequence, source=source)
        fresh = ticks(1.7e9 + now) + self._random.randrange(1000)
        stamp = self._random.choice((fresh, fresh, fresh, 0, MAX_TICKS, fresh - 10**8))
        # Only the owner of the key can make a time stamp of the far future count.
        genuine = self._random.random() < 0.5 and stamp <= fresh
        frame += bytes((self._random.randrange(256),)) + stamp.to_bytes(6, 'little')
        return frame + (signature(self._key, frame) if genuine else self._random.randbytes(6))

    def _payload(self) -> bytes:
        return self._random.randbytes(self._random.choice(LENGTHS))

    # Fields

    def _source(self) -> Address:
        if self._random.random() < 0.6:
            return self._random.choice(self._sources)
        return self._any_source()

    def _any_source(self) -> Address:
        return Address(self._random.randrange(256), self._random.randrange(256))

    def _float(self) -> float:
        if self._random.random() < 0.2:
            value: float = struct.unpack('<f', self._random.randbytes(4))[0]
            return value
        return self._random.choice(FLOATS)

    def _int(self, bits: int) -> int:
        top = (1 << bits) - 1
        return self._random.choice((0, 1, 2, top, top >> 1, self._random.randrange(top + 1)))

    def _bytes(self, size: int) -> bytes:
        data = self._random.choice((
            b'', b'torch', b'\xff' * size, bytes(range(1, size + 1)), 'Ünï\u202e'.encode(),
            self._random.randbytes(size)))
        return data[:size]

    def _target(self) -> tuple[int, int]:
        return self._random.choice([(0, 0), *self._sources, self._any_source()])

    def _any_heartbeat(self) -> Any:
        mav_type = MavType.ILLUMINATOR if self._random.random() < 0.5 else self._int(8)
        return Heartbeat(mav_type, *map(self._int, (8, 8, 32, 8, 8)))

    def _status(self) -> Any:
        return IlluminatorStatus(*map(self._int, (32, 8, 8, 32, 8)),
                                 *(self._float() for _ in range(6)))

    def _information(self) -> Any:
        return ComponentInformationBasic(
            self._int(32), self._int(64), self._int(32),
            *(self._bytes(length) for length in (32, 32, 24, 24, 32)))

    def _ack(self) -> Any:
        return CommandAck(
            self._random.choice(COMMANDS), self._random.choice((*range(11), 255)), self._int(8),
            self._int(31), *self._target())

    def _command_long(self) -> Any:
        return CommandLong(
            *self._target(), self._random.choice(COMMANDS), self._int(8),
            *(self._float() for _ in range(7)))

    def _command_int(self) -> Any:
        return CommandInt(
            *self._target(), self._int(8), self._random.choice(COMMANDS), self._int(8),
            self._int(8), self._float(), self._float(), self._float(), self._float(),
            self._int(31), self._int(31), self._float())
