# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""A whole link without thread, network and waiting: datagrams in, datagrams out, a clock."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
import math
import selectors
from typing import Any

from illuminator_ros.mavlink.component import Endpoint
from illuminator_ros.mavlink.link import Link
from illuminator_ros.mavlink.link_state import LinkSnapshot
from illuminator_ros.mavlink.messages import Address
from illuminator_ros.mavlink.signing import Signing
from illuminator_ros.mavlink.transport.udp import UdpChannel
from illuminator_ros.mavlink.url import HostPort, UdpUrl
from support.network import FakeSelector

Datagram = tuple[bytes, Any]
URL = UdpUrl(HostPort('127.0.0.1', 0))
# Turns of the link without input and without passing time; with more its thread would spin.
MAX_IDLE_TURNS = 200


class _Socket:
    """A UDP socket as a channel uses it."""

    def __init__(self, take: Callable[[bytes, Any], None]) -> None:
        self.inbox: deque[Datagram] = deque()
        self._take = take

    def recvfrom(self, size: int) -> Datagram:
        if not self.inbox:
            raise BlockingIOError
        return self.inbox.popleft()

    def sendto(self, data: bytes, peer: Any) -> None:
        self._take(data, peer)

    def close(self) -> None:
        pass


class _Selector(FakeSelector):
    """Finds data in the inbox, and lets time pass if it is empty."""

    def __init__(self, link: SimulatedLink) -> None:
        super().__init__()
        self._link = link

    def select(self, timeout: float | None = None) -> list[tuple[selectors.SelectorKey, int]]:
        link = self._link
        key = self.keys.get(link.socket)
        ready = [(key, selectors.EVENT_READ)] if key and link.socket.inbox else []
        while link.meanwhile:
            link.meanwhile.popleft()()
        if ready:
            return ready
        assert timeout is not None
        link.now = min(link.now + timeout, link.until)
        return []


class _FromZero(dict[Address, int]):
    """Sequence numbers that begin with 0, so that equal runs give equal bytes."""

    def get(self, key: Address, default: Any = None) -> Any:
        return super().get(key, 0)


class SimulatedLink(Link):
    """
    A link over UDP with single turns; it raises an exception instead of logging it.

    :param take: called with each sent datagram and its peer.
    :ivar now: s.
    :ivar meanwhile: called once each while the link waits.
    """

    def __init__(
        self, endpoint: Endpoint, take: Callable[[bytes, Any], None], *,
        signing: Signing | None = None, now: float = 1000.0,
        mavlink_version: int = 2,
    ) -> None:
        self.now = self.until = now
        self.meanwhile: deque[Callable[[], object]] = deque()
        super().__init__(URL, endpoint, label='simulated', clock=lambda: self.now,
                         wall_clock=lambda: 1.7e9 + self.now, signing=signing,
                         mavlink_version=mavlink_version, selector=_Selector(self))
        line = next(iter(self.lines))
        endpoint.schedule.at(line._connect, math.inf)
        self.lines._sender._writer.sequences = _FromZero()
        self._faults.log = self.log_fault  # type: ignore[method-assign]
        self.socket = _Socket(take)
        self.udp = UdpChannel(URL)
        self.udp._socket.close()
        self.udp._socket = self.socket  # type: ignore[assignment]
        line.opened(self.udp, now)

    def log_fault(self) -> None:
        raise  # noqa: PLE0704 - it is called while an exception is handled

    def receive(self, *datagrams: Datagram) -> None:
        """Take datagrams, at one moment."""
        self.socket.inbox.extend(datagrams)
        self.until = self.now
        while self.socket.inbox:
            self._thread.run_once()

    def ask(self, function: Callable[[float], Any]) -> None:
        """Call a function as other threads do."""
        self.call(function)
        self.until = self.now
        self._thread.run_once()

    def run(self, seconds: float) -> None:
        """Let time pass."""
        self.until = self.now + seconds
        idle = 0
        while self.now < self.until:
            before = self.now
            self._thread.run_once()
            idle = idle + 1 if self.now == before and not self.socket.inbox else 0
            assert idle < MAX_IDLE_TURNS, f'the thread would spin at {self.now}'

    def state(self) -> LinkSnapshot:
        """Return the link at this moment."""
        return self.snapshot(self.now)
