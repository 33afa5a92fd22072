# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The reason why no frame comes over an open serial port."""

from __future__ import annotations

from collections.abc import Callable
import contextlib
import math
import threading

from .listener import NOISE
from .rate_scan import ENOUGH, other_protocol, RATES, SHARE
from ..frame import Decoder
from ..transport import Channel
from ..transport.ports import IN_USE, users_of
from ..url import SerialUrl

# s without a frame until the reason is looked for, and between two other baud rates.
SILENCE = 10.0


class SilentPort:
    """
    Looks for the reason, for the thread of the line; where bytes come, also at other baud rates.

    :param call: has a function called in that thread, given the time (s).
    :ivar reason: for people; '' while it is unknown.
    """

    def __init__(
        self, url: SerialUrl, channel: Channel, *,
        call: Callable[[Callable[[float], None]], None],
        users: Callable[[SerialUrl], str] = users_of,
    ) -> None:
        self.reason = ''
        self._url = url
        self._channel = channel
        self._call = call
        self._users = users
        self._frames = -1
        self._baud = url.baud
        # The bytes at this rate, and the number of bytes at the rate of the link.
        self._data = b''
        self._received = 0
        self._due = math.inf
        # The rates that were not tried yet.
        self._left: list[int] = []

    @property
    def is_away(self) -> bool:
        """Return whether the port has another rate than the link."""
        return self._baud != self._url.baud

    def feed(self, data: bytes) -> None:
        """Take bytes in which no frame is valid, or that came at another rate."""
        self._received += 0 if self.is_away else len(data)
        if len(self._data) < ENOUGH:
            self._data += data

    def poll(self, frames: int, now: float) -> None:
        """
        Do what is due; called a few times a second while no frame comes.

        :param frames: that the line has received.
        """
        if frames != self._frames and not self.is_away:
            self.reason, self._frames, self._received = '', frames, 0
            self._left = [rate for rate in RATES if rate != self._url.baud]
            self._tune(self._url.baud, now)
        elif now >= self._due or self.is_away and len(self._data) >= ENOUGH:
            self._tune(self._return() if self.is_away else self._next_rate(), now)

    def _tune(self, baud: int, now: float) -> None:
        if baud != self._baud:
            # The hardware may not have this rate.
            with contextlib.suppress(OSError):
                self._channel.change_rate(baud)
        self._baud, self._data = baud, b''
        self._due = now + (SHARE if self.is_away else SILENCE)

    def _next_rate(self) -> int:
        """Judge the bytes at the rate of the link, and return the rate to listen at."""
        # A frame at the right rate was refused for its signature.
        if self.reason or self._has_frame():
            return self._url.baud
        # A thread of its own: it reads the descriptors of all processes.
        with contextlib.suppress(RuntimeError):
            threading.Thread(target=self._find_users, daemon=True).start()
        if found := other_protocol(self._data):
            self._end(found)
        elif self._data and not self._left:
            self._end(NOISE.format(self._received))
        return self._left.pop(0) if self._data and self._left else self._url.baud

    def _return(self) -> int:
        """Look for a frame among the bytes at another rate, and return the rate of the link."""
        if self._has_frame():
            self._end(f'{self._received} bytes, no valid frame at {self._url.baud} baud; MAVLink '
                      f'is heard at {self._baud}: use {self._url._replace(baud=self._baud)}')
        return self._url.baud

    def _has_frame(self) -> bool:
        decoder = Decoder()
        return bool(decoder.feed(self._data) or decoder.give_up(decoder.taken))

    def _end(self, reason: str) -> None:
        self.reason = reason
        self._left = []

    def _find_users(self) -> None:
        if users := self._users(self._url):
            self._call(lambda now: self._end(f'{self._url.device} is {IN_USE.format(users)}'))
