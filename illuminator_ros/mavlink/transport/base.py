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

"""The contract of an open transport."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Hashable, Iterator, Sequence
import selectors
from typing import Any

# Where bytes came from, and where they can be sent back to.
Peer = Hashable

# Bytes that wait for a slow line. What does not fit is dropped, whole frames, oldest first: a
# command that has waited longer than its time-out has been sent again anyway.
MAX_QUEUED = 16 * 1024


class ChannelLost(OSError):
    """The other side or the device is gone; the channel is of no use any more."""


class Channel(ABC):
    """
    An open transport, used from one thread and never blocking.

    :ivar name: what it is, for people.
    :ivar dropped: frames that were not sent because the line or the kernel was full.
    :ivar more: whether there may be more than was read last.
    """

    name: str = ''
    dropped: int = 0
    more: bool = False

    @abstractmethod
    def register(self, selector: selectors.BaseSelector) -> None:
        """Register what can be read with the selector."""

    @abstractmethod
    def receive(self, handle: Any) -> Iterator[tuple[Peer, bytes]]:
        """
        Return what is there to read on a registered handle, with its origin.

        :raises ChannelLost: if nothing will come any more.
        """

    @abstractmethod
    def peers(self, now: float) -> Sequence[Peer]:
        """Return everybody that a broadcast goes to."""

    def heard(self, peer: Peer, now: float) -> bool:
        """
        Note that a checked frame came from a peer.

        Return whether the peer is new. Only what has been checked may be reported here: it is
        from now on sent to.
        """
        return False

    @abstractmethod
    def send(self, frames: Sequence[bytes], peers: Sequence[Peer]) -> None:
        """
        Send frames to some of the peers, dropping them where there is no room.

        Frames that are given together go out together, in one datagram where there are datagrams.

        :raises ChannelLost: if the channel is gone.
        """

    def writable(self, handle: Any) -> None:  # noqa: B027 - only queues have something to do
        """Go on sending, now that a registered handle has room."""

    @abstractmethod
    def close(self) -> None:
        """Close it; harmless a second time."""


class FrameQueue:
    """Whole frames that wait for a stream with room, at most :data:`MAX_QUEUED` bytes of them."""

    def __init__(self) -> None:
        self._frames: deque[bytes] = deque()
        self._size = 0
        self._begun = False

    def __bool__(self) -> bool:
        return bool(self._frames)

    def put(self, frame: bytes) -> int:
        """Append a frame and return how many were dropped for it."""
        self._frames.append(frame)
        self._size += len(frame)
        dropped = 0
        # The first frame may be half on the wire; the rest of it must follow.
        first = 1 if self._begun else 0
        while self._size > MAX_QUEUED and len(self._frames) > first + 1:
            self._size -= len(self._frames[first])
            del self._frames[first]
            dropped += 1
        return dropped

    def head(self) -> bytes:
        """Return what is to be written next."""
        return self._frames[0]

    def written(self, count: int) -> None:
        """Note that ``count`` bytes of the head have gone out."""
        frame = self._frames.popleft()
        self._size -= count
        self._begun = count < len(frame)
        if self._begun:
            self._frames.appendleft(frame[count:])
