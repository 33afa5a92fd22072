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

"""What speaks over a link: messages in, messages out, time passed in."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections import deque
from typing import Any

from .messages import Address, heartbeat

# s; heartbeat protocol: "usually 1 Hz".
HEARTBEAT_INTERVAL = 1.0


class Endpoint(ABC):
    """
    One side of a protocol, without I/O.

    A :class:`~.link.Link` calls it from its one thread and sends what it leaves in ``outgoing``.

    :ivar outgoing: messages to send, each with the address that it is sent from.
    """

    def __init__(self) -> None:
        self.outgoing: deque[tuple[Address, Any]] = deque()

    @abstractmethod
    def link_opened(self, now: float) -> None:
        """
        Note that messages can be sent, or that somebody may have come within hearing.

        It comes again and again while nobody is heard.
        """

    def link_closed(self, now: float) -> None:  # noqa: B027 - not everybody cares
        """Note that nothing can be sent any more."""

    @abstractmethod
    def receive(self, source: Address, message: Any, now: float) -> None:
        """Take a message."""

    @abstractmethod
    def poll(self, now: float) -> None:
        """Do what is due."""

    @abstractmethod
    def next_deadline(self) -> float:
        """Return the time at which :meth:`poll` has something to do, infinity if never."""


class Heartbeat:
    """
    The heartbeat of one component (heartbeat protocol).

    It goes out before anything else, since routers forward nothing to whom they have not heard.
    """

    def __init__(self, source: Address, mav_type: int) -> None:
        self.source = source
        self.mav_type = mav_type
        self.due = 0.0

    def poll(self, now: float, outgoing: deque[tuple[Address, Any]]) -> None:
        """Append a heartbeat if one is due."""
        if now >= self.due:
            self.send(now, outgoing)

    def send(self, now: float, outgoing: deque[tuple[Address, Any]]) -> None:
        """Append a heartbeat at once; the next is due an interval later."""
        outgoing.append((self.source, heartbeat(self.mav_type)))
        self.due = now + HEARTBEAT_INTERVAL
