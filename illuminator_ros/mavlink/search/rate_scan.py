# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The baud rates at which a serial port is listened to, and what is heard that is not MAVLink."""

from __future__ import annotations

from collections.abc import Sequence
from functools import reduce
from operator import xor
import re

# The likely ones first.
RATES = 57600, 115200, 921600, 38400, 9600, 19200, 230400, 460800, 500000, 1000000, 1500000
# s at one rate, in which a heartbeat comes.
SHARE = 1.2
# Bytes at one rate without a valid frame that decide sooner: two of the longest frames.
ENOUGH = 600
# The shortest text that is recognised, characters, and the longest part that is shown.
MIN_TEXT = 40
MAX_SHOWN = 30


def other_protocol(data: bytes) -> str:
    """Return what received bytes are that are not MAVLink, for people; '' if that is unknown."""
    for sentence, checksum in re.findall(
            rb'\$([A-Z]{4,6},[^\r\n*$]{0,90})\*([0-9A-F]{2})', data):
        if reduce(xor, sentence) == int(checksum, 16):
            return 'this is NMEA text: a GPS receiver'
    for start in (match.end() for match in re.finditer(rb'\xb5\x62', data)):
        length = int.from_bytes(data[start + 2:start + 4], 'little')
        if _is_checked(data[start:start + 4 + length + 2], length):
            return 'this is UBX: a GPS receiver of u-blox'
    # The bytes before the first whole line may be garbage.
    text = data[data.find(b'\n') + 1:]
    if len(text) >= MIN_TEXT and re.fullmatch(rb'[\t\n\r\x1b\x20-\x7e]*', text) and b'\n' in text:
        shown = text.decode('ascii').split('\n')[0].strip()[:MAX_SHOWN]
        return f'this is text, such as {shown!r}: a console'
    return ''


def _is_checked(packet: bytes, length: int) -> bool:
    """Return whether the Fletcher checksum at the end of a UBX packet is right."""
    first = second = 0
    for byte in packet[:-2]:
        first = (first + byte) & 0xFF
        second = (second + first) & 0xFF
    return len(packet) == length + 6 and packet[-2:] == bytes((first, second))


class RateScan:
    """
    Decides at which baud rate to listen; no I/O.

    :param rates: in this order, again and again.
    :param share: s at each.
    :ivar since: when the listening at the present rate began, s.
    :ivar found: what the bytes are that are not MAVLink, for people; '' if that is unknown.
    """

    def __init__(self, rates: Sequence[int], share: float, now: float) -> None:
        self.since = now
        self.found = ''
        self._rates = [*rates]
        self._share = share
        self._data = b''

    @property
    def rate(self) -> int:
        """Return the present rate."""
        return self._rates[0]

    def feed(self, data: bytes) -> None:
        """Take bytes in which no frame is valid."""
        if len(self._data) < ENOUGH and not self.found:
            self._data += data
            self.found = other_protocol(self._data)

    def next_rate(self, now: float) -> int | None:
        """Return the next rate if its time has come."""
        if len(self._rates) < 2 or self.found or (
                now < self.since + self._share and len(self._data) < ENOUGH):
            return None
        self._rates.append(self._rates.pop(0))
        self.since, self._data = now, b''
        return self.rate
