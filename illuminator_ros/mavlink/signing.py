# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""
MAVLink 2 message signing, on frames; no I/O, and time is passed in.

https://mavlink.io/en/guide/message_signing.html. A frame is checked in this order: checksum (by
the decoder), signature, time stamp. The frame is remembered only after these checks, so a forged
one changes nothing.

This is not pymavlink's, which remembers the time stamp before it checks the signature: one forged
frame blocks its stream until the end of the program. The tests compare both.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum
import hashlib
import hmac

from .errors import InvalidValue
from .frame import Frame, SIGNATURE
from .messages import Address

# Time stamps count 10 us from 2015-01-01 00:00 UTC, in 48 bits.
EPOCH = 1_420_070_400
TICKS_PER_SECOND = 100_000
MAX_TICKS = (1 << 48) - 1
# A stream that is not known yet may be this far behind ("Timestamp Handling").
NEW_STREAM_TICKS = 60 * TICKS_PER_SECOND
# How far ahead of our clock a peer is followed: 10 years. The clock of a computer without a
# battery may start some years behind; a receiver that ignores the rollover of GPS weeks is 19.6
# years off.
FOLLOWED_TICKS = 10 * 365 * 86_400 * TICKS_PER_SECOND
# The clock of a computer without a battery starts in 1970, and is followed at any distance.
CLOCK_UNSET = ('the clock of this computer is before 2015, so components may refuse our '
               'signatures until it is set')
# A clock that is behind the time stamps of this link by less than this counts as correct: another
# clock was ahead. A clock further behind has no battery.
CLOCK_TOLERANCE_TICKS = 86_400 * TICKS_PER_SECOND
MAX_STREAMS = 256
KEY_SIZE = 32


class SigningMode(Enum):
    """
    The rule by which frames are signed and accepted.

    ``off``: no frame is signed, and every frame is accepted. ``sign``: sent frames are signed;
    unsigned frames are accepted, wrongly signed ones are not. ``require``: sent frames are signed;
    only rightly signed frames are accepted.
    """

    OFF = 'off'
    SIGN = 'sign'
    REQUIRE = 'require'


class Verdict(Enum):
    """The result of the check of a frame; ``OLD``: rightly signed, with an old time stamp."""

    ACCEPTED = 'accepted'
    OLD = 'old'
    REFUSED = 'refused'


@dataclass(slots=True)
class SigningCounters:
    """Received frames by the result of the check of their signature."""

    good: int = 0
    bad: int = 0
    replayed: int = 0
    unsigned: int = 0
    # Signed, but not checked, since the mode is off.
    unchecked: int = 0


def stamp_of(signature: bytes) -> int:
    """Return the time stamp of the 13 bytes behind a signed frame."""
    return int.from_bytes(signature[1:7], 'little')


def ticks(unix_time: float) -> int:
    """Return a Unix time (s) as a time stamp of the signing protocol."""
    return min(max(int((unix_time - EPOCH) * TICKS_PER_SECOND), 0), MAX_TICKS)


def signature(key: bytes, signed_part: bytes) -> bytes:
    """Return the first 48 bits of SHA-256 over the key and the frame up to the time stamp."""
    return hashlib.sha256(key + signed_part).digest()[:6]


@dataclass
class Signing:
    """
    Signs sent frames and checks received ones.

    :param key: 32 bytes; may be missing only where the mode is off.
    :param link_id: 0..255, our id for this link in the frames that we sign.
    :param timestamp: the last time stamp used, in ticks; from a former run.
    :raises InvalidValue: if the mode needs a key and there is none of 32 bytes.
    """

    mode: SigningMode = SigningMode.OFF
    key: bytes = field(default=b'', repr=False)
    link_id: int = 0
    timestamp: int = 0
    counters: SigningCounters = field(default_factory=SigningCounters)
    _streams: dict[tuple[int, Address], int] = field(default_factory=dict)
    # Streams with older time stamps may have been forgotten.
    _forgotten: int = 0

    def __post_init__(self) -> None:
        if self.mode is SigningMode.OFF:
            return
        if not isinstance(self.key, bytes):
            raise InvalidValue(f'signing needs a key of bytes, not {type(self.key).__name__}')
        if len(self.key) != KEY_SIZE:
            raise InvalidValue(f'signing needs a key of {KEY_SIZE} bytes, not {len(self.key)}')
        # The bridge imports hmac and hashlib when they are first used: now, not for the first
        # frame.
        self._is_equal = hmac.compare_digest
        signature(self.key, b'')

    @property
    def signs(self) -> bool:
        """Whether sent frames are signed."""
        return self.mode is not SigningMode.OFF

    def clock_fault(self, unix_time: float) -> str:
        """Return why components may ignore our frames, for people; '' in general."""
        return CLOCK_UNSET if self.signs and unix_time < EPOCH else ''

    def sign(self, frame: bytes, unix_time: float) -> bytes:
        """Return the frame with its signature. Its signed flag must already be set."""
        self.timestamp = min(max(self.timestamp + 1, ticks(unix_time)), MAX_TICKS)
        frame += bytes((self.link_id,)) + self.timestamp.to_bytes(6, 'little')
        return frame + signature(self.key, frame)

    def accepts(self, frame: Frame, unix_time: float) -> bool:
        """Return whether a frame is accepted."""
        return self.check(frame, unix_time) is Verdict.ACCEPTED

    def check(self, frame: Frame, unix_time: float) -> Verdict:
        """Check the signature of a frame, and its time stamp."""
        if self.mode is SigningMode.OFF:
            self.counters.unchecked += frame.signature is not None
            return Verdict.ACCEPTED
        if frame.signature is None:
            self.counters.unsigned += 1
            return Verdict.ACCEPTED if self.mode is SigningMode.SIGN else Verdict.REFUSED
        assert len(frame.signature) == SIGNATURE
        expected = signature(self.key, frame.data[:-SIGNATURE] + frame.signature[:7])
        if not self._is_equal(expected, frame.signature[7:]):
            self.counters.bad += 1
            return Verdict.REFUSED
        if not self._fresh(frame, unix_time):
            self.counters.replayed += 1
            return Verdict.OLD
        self.counters.good += 1
        return Verdict.ACCEPTED

    def _fresh(self, frame: Frame, unix_time: float) -> bool:
        """Return whether the time stamp is new for its stream, and remember it if so."""
        assert frame.signature is not None
        stamp = stamp_of(frame.signature)
        stream = (frame.signature[0], frame.source)
        last = self._streams.get(stream)
        oldest = max(self._reference(unix_time) - NEW_STREAM_TICKS, self._forgotten)
        if last is None:
            if stamp < oldest or not self._room(oldest):
                return False
        elif stamp <= last:
            return False
        self._streams[stream] = stamp
        # A peer with a better clock, or a longer memory, is followed; but not an implausible
        # clock, after which correct time stamps would count as too old. Before 2015 ours is wrong.
        if unix_time < EPOCH or stamp <= ticks(unix_time) + FOLLOWED_TICKS:
            self.timestamp = max(self.timestamp, stamp)
        return True

    def _reference(self, unix_time: float) -> int:
        """
        Return the time stamp that new streams are compared with.

        It is not the last one used, which may be ahead of the right time: after a crash, or after
        our clock or the clock of a peer was wrong for a moment.
        """
        clock = ticks(unix_time)
        return clock if self.timestamp - clock <= CLOCK_TOLERANCE_TICKS else self.timestamp

    def _room(self, oldest: int) -> bool:
        """
        Return whether one more stream can be remembered.

        Old frames of a forgotten stream must not be accepted again. So only streams are forgotten
        that are so old that their replay would be refused as too old for a new stream, now and
        after a step of the clock.
        """
        if len(self._streams) >= MAX_STREAMS:
            self._forgotten = oldest
            for stream in [s for s, stamp in self._streams.items() if stamp < oldest]:
                del self._streams[stream]
        return len(self._streams) < MAX_STREAMS
