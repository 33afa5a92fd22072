# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""
A line between two endpoints: real bytes, and a clock that jumps.

It may lose, repeat, delay and corrupt frames, the same ones in each run.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
import heapq
import math
import random
from typing import Any

from illuminator_ros.mavlink import messages as mav
from illuminator_ros.mavlink.component import Endpoint
from illuminator_ros.mavlink.dialect import decode
from illuminator_ros.mavlink.frame import Decoder
from support.frames import Codec

# s; the initial time: not 0, so that a wrong use of 0 as a time shows.
START = 1000.0
# Turns at one moment: more of them mean that a link's thread would spin.
MAX_TURNS = 200
# s; later frames within this time overtake a reordered frame.
OVERTAKEN_WITHIN = 0.05


@dataclass(frozen=True)
class Faults:
    """
    The faults of a line: shares (0..1) of the frames, each drawn independently.

    :param latency: s, for every frame.
    :param longest_delay: s; a delayed frame takes up to this much longer.
    """

    drop: float = 0.0
    duplicate: float = 0.0
    reorder: float = 0.0
    delay: float = 0.0
    corrupt: float = 0.0
    latency: float = 0.002
    longest_delay: float = 1.0


NO_FAULTS = Faults(latency=0.0)


class FaultyWire:
    """
    One direction of a line; the caller passes the time.

    :ivar is_open: whether sent frames are delivered.
    """

    def __init__(self, faults: Faults, seed: int | str) -> None:
        self.faults = faults
        self.is_open = True
        self._random = random.Random(seed)
        self._travelling: list[tuple[float, int, bytes]] = []
        self._count = 0

    def send(self, frame: bytes, now: float) -> None:
        """Take a frame."""
        faults = self.faults
        if not self.is_open or self._happens(faults.drop):
            return
        for _ in range(2 if self._happens(faults.duplicate) else 1):
            arrival = now + faults.latency
            if self._happens(faults.reorder):
                arrival += self._random.uniform(0, OVERTAKEN_WITHIN)
            if self._happens(faults.delay):
                arrival += self._random.uniform(0, faults.longest_delay)
            data = self._corrupted(frame) if self._happens(faults.corrupt) else frame
            self._count += 1
            heapq.heappush(self._travelling, (arrival, self._count, data))

    def receive(self, now: float) -> list[bytes]:
        """Return the frames that have arrived, in the order of arrival."""
        arrived = []
        while self._travelling and self._travelling[0][0] <= now:
            arrived.append(heapq.heappop(self._travelling)[2])
        return arrived

    def next_arrival(self) -> float:
        """Return when the next frame arrives, infinity if the line is empty."""
        return self._travelling[0][0] if self._travelling else math.inf

    def switch(self, *, is_open: bool) -> None:
        """Open or cut the line; frames on it are lost."""
        self.is_open = is_open
        self._travelling.clear()

    def _happens(self, share: float) -> bool:
        # Do not draw for a share of 0: new kinds of faults then do not change old runs.
        return share > 0 and self._random.random() < share

    def _corrupted(self, frame: bytes) -> bytes:
        # Change one byte: a 16-bit CRC always detects a burst of 8 bits.
        at = self._random.randrange(len(frame))
        return frame[:at] + bytes([frame[at] ^ self._random.randrange(1, 256)]) + frame[at + 1:]


class End:
    """
    One end of a line: an endpoint, its sequence numbers, and its decoder.

    :ivar wire: the way from here.
    :ivar sent: messages with their times; ``received`` with their senders, too; if they are kept.
    """

    def __init__(
        self, endpoint: Endpoint, wire: FaultyWire, version: int, *, keeps: bool,
    ) -> None:
        self.endpoint = endpoint
        self.wire = wire
        self.decoder = Decoder()
        self.classes = {cls.id: cls for cls in endpoint.messages}
        self.sent: list[tuple[float, Any]] = []
        self.received: list[tuple[float, mav.Address, Any]] = []
        self._keeps = keeps
        self._codec = Codec(version=version)

    def flush(self, now: float) -> None:
        while self.endpoint.outgoing:
            source, message = self.endpoint.outgoing.popleft()
            if self.wire.is_open:
                if self._keeps:
                    self.sent.append((now, message))
                self.wire.send(self._codec.frame(source, message), now)

    def take(self, data: bytes, now: float) -> None:
        for frame in self.decoder.feed(data):
            if (cls := self.classes.get(frame.message_id)) is not None:
                if self.endpoint.inspect is not None:
                    self.endpoint.inspect(frame, cls)
                message = decode(cls, frame.payload)
                if self._keeps:
                    self.received.append((now, frame.source, message))
                self.endpoint.receive(frame.source, message, now)
                self.flush(now)


class Line:
    """
    Connects two endpoints as two links would.

    :param there: the faults of the way from the first to the second; ``back`` of the way back.
    :param version: of MAVLink.
    :param keeps: whether both ends keep all messages.
    :ivar now: s.
    """

    def __init__(
        self, near: Endpoint, far: Endpoint, *, there: Faults = NO_FAULTS,
        back: Faults = NO_FAULTS, seed: int | str = 0, version: int = 2, keeps: bool = False,
    ) -> None:
        self.now = START
        self.near = End(near, FaultyWire(there, f'{seed} there'), version, keeps=keeps)
        self.far = End(far, FaultyWire(back, f'{seed} back'), version, keeps=keeps)
        self._turns = 0
        self.open()

    # Time

    @property
    def due(self) -> float:
        """Return when something happens next."""
        return min(self.near.endpoint.schedule.due, self.far.endpoint.schedule.due,
                   self.near.wire.next_arrival(), self.far.wire.next_arrival())

    def step(self, until: float = math.inf) -> bool:
        """Advance to the next event, but to ``until`` at most; return whether there was one."""
        due = self.due
        if due > until:
            self.now = max(self.now, until)
            return False
        self._turns = self._turns + 1 if due <= self.now else 0
        assert self._turns < MAX_TURNS, f'a link would spin: deadline {due} at {self.now}'
        self.now = max(self.now, due)
        self.turn()
        return True

    def turn(self) -> None:
        """Do what a link's thread does in one turn, at both ends."""
        self._deliver()
        for end in (self.far, self.near):
            end.endpoint.schedule.run(self.now)
            end.flush(self.now)
        self._deliver()

    def _deliver(self) -> None:
        """Deliver what has arrived, also the answers to it."""
        ways = (self.far, self.near.wire), (self.near, self.far.wire)
        while any(wire.next_arrival() <= self.now for _, wire in ways):
            for end, wire in ways:
                for data in wire.receive(self.now):
                    end.take(data, self.now)

    def run(self, seconds: float) -> None:
        """Let time pass."""
        until = self.now + seconds
        while self.step(until):
            pass

    def run_until(self, condition: Callable[[], Any], *, within: float = 60.0) -> None:
        """Let time pass until a condition holds; raise an error after ``within`` s."""
        until = self.now + within
        while not condition():
            assert self.step(until), f'not so within {within} s'

    # Faults

    def mend(self) -> None:
        """End the faults of the line."""
        for end in (self.near, self.far):
            end.wire.faults = Faults()

    def open(self) -> None:  # noqa: A003
        """Open the line."""
        self._switch(is_open=True)
        for end in (self.near, self.far):
            end.endpoint.link_opened(self.now)

    def close(self) -> None:
        """Close the line; frames on it are lost."""
        self._switch(is_open=False)
        for end in (self.near, self.far):
            end.endpoint.link_closed(self.now, 'closed')
        self.turn()

    def _switch(self, *, is_open: bool) -> None:
        for end in (self.near, self.far):
            end.wire.switch(is_open=is_open)
            end.decoder = Decoder()
