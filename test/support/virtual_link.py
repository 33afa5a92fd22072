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

"""Two endpoints and a line between them: real bytes, and a clock that jumps."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from illuminator_ros.mavlink.component import Endpoint
from illuminator_ros.mavlink.dialect import decode
from illuminator_ros.mavlink.frame import Decoder
from support.frames import Codec

# s; the initial time: not 0, so that a wrong use of 0 as a time shows.
START = 1000.0
# Turns at one moment: more of them mean that a link's thread would spin.
MAX_TURNS = 200


class VirtualLink:
    """
    Connects two endpoints as two links would.

    :param version: of MAVLink.
    :ivar now: s.
    :ivar decoders: those of the first and the second endpoint.
    """

    def __init__(self, first: Endpoint, second: Endpoint, version: int = 2) -> None:
        self.now = START
        self.ends = (first, second)
        self.decoders = (Decoder(), Decoder())
        self._codec = Codec(version=version)
        self._turns = 0
        for end in self.ends:
            end.link_opened(self.now)

    def run_until(self, condition: Callable[[], Any], *, within: float) -> None:
        """Let time pass until a condition holds; raise an error after ``within`` s."""
        until = self.now + within
        while not condition():
            due = min(end.next_deadline() for end in self.ends)
            assert due <= until, f'not so within {within} s'
            self._turns = self._turns + 1 if due <= self.now else 0
            assert self._turns < MAX_TURNS, f'a link would spin at {self.now}'
            self.now = max(self.now, due)
            self.turn()

    def run(self, seconds: float) -> None:
        """Let time pass."""
        until = self.now + seconds
        while (due := min(end.next_deadline() for end in self.ends)) <= until:
            self.now = max(self.now, due)
            self.turn()
        self.now = until

    def turn(self) -> None:
        """Do the work of both links' threads in one turn."""
        for end in self.ends:
            if self.now >= end.next_deadline():
                end.poll(self.now)
        first, second = self.ends
        while first.outgoing or second.outgoing:
            self._carry(first, second, self.decoders[1])
            self._carry(second, first, self.decoders[0])

    def _carry(self, sender: Endpoint, receiver: Endpoint, decoder: Decoder) -> None:
        while sender.outgoing:
            source, message = sender.outgoing.popleft()
            for frame in decoder.feed(self._codec.frame(source, message)):
                for cls in receiver.messages:
                    if frame.message_id == cls.id:
                        if receiver.inspect is not None:
                            receiver.inspect(frame, cls)
                        receiver.receive(
                            frame.source, decode(cls, frame.payload), self.now)
