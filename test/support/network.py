# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Routers with several lines, and components behind them, in one thread and in simulated time."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator, Sequence
import math
import selectors
from typing import Any

from illuminator_ros.mavlink.component import Endpoint
from illuminator_ros.mavlink.line import Line
from illuminator_ros.mavlink.lines import Lines
from illuminator_ros.mavlink.link_thread import FaultLog
from illuminator_ros.mavlink.messages import Address, Heartbeat, Message
from illuminator_ros.mavlink.signing import Signing
from illuminator_ros.mavlink.transport import Channel, Peer
from illuminator_ros.mavlink.url import MemoryUrl
from support.frames import Codec

# Frames that a network carries for each sent frame; with more they would circulate.
MAX_HOPS = 200


class FakeSelector(selectors.BaseSelector):
    """Registers anything, and finds nothing."""

    def __init__(self) -> None:
        self.keys: dict[Any, selectors.SelectorKey] = {}

    def register(self, fileobj: Any, events: int, data: Any = None) -> selectors.SelectorKey:
        self.keys[fileobj] = selectors.SelectorKey(fileobj, -1, events, data)
        return self.keys[fileobj]

    def unregister(self, fileobj: Any) -> selectors.SelectorKey:
        return self.keys.pop(fileobj)

    def get_map(self) -> Any:
        return self.keys

    def select(self, timeout: float | None = None) -> list[tuple[selectors.SelectorKey, int]]:
        return []


class Port(Channel):
    """
    One end of wires; each wire leads to a peer.

    :param has_clients: whether it is a server, whose peers do not hear each other.
    """

    def __init__(self, network: Network, name: str, has_clients: bool) -> None:
        super().__init__()
        self.name = name
        self.has_clients = has_clients
        self.wires: dict[Peer, Callable[[bytes], None]] = {}
        self.inbox: deque[tuple[Peer, bytes]] = deque()
        self.serve: Callable[[object, int], None] | None = None
        self._network = network

    def register(self, selector: selectors.BaseSelector, serve: Any) -> None:
        selector.register(self, selectors.EVENT_READ, serve)  # type: ignore[arg-type]
        self.serve = serve

    def receive(self, handle: object) -> Iterator[tuple[Peer, bytes]]:
        while self.inbox:
            yield self.inbox.popleft()

    def peers(self, now: float) -> Sequence[Peer]:
        return tuple(self.wires)

    def send(self, frames: Sequence[bytes], peers: Sequence[Peer]) -> None:
        for peer in peers:
            for frame in frames:
                self._network.carry(self.wires[peer], frame)

    def take(self, peer: Peer, data: bytes) -> None:
        """Receive bytes of a peer."""
        self.inbox.append((peer, data))
        if self.serve:
            self.serve(self, selectors.EVENT_READ)

    def close(self) -> None:
        self.serve = None


class Listener(Endpoint):
    """
    The component of a router.

    :ivar heard: what it has received.
    :ivar closed: the components that were lost, or None for all.
    """

    messages = (Heartbeat,)

    def __init__(self, address: Address) -> None:
        super().__init__()
        self.address = address
        self.heard: list[tuple[Address, Message]] = []
        self.lost: list[Sequence[Address] | None] = []

    def receive(self, source: Address, message: Message, now: float) -> None:
        self.heard.append((source, message))

    def components_lost(self, lost: Any, now: float, reason: str) -> None:
        self.lost.append(list(lost))

    def link_closed(self, now: float, reason: str) -> None:
        self.lost.append(None)


class Router:
    """Lines with a component of their own, as a bridge has them."""

    def __init__(
        self, network: Network, ports: Sequence[Port], address: Address, *,
        signing: Signing | None = None, version: int = 2,
    ) -> None:
        self.endpoint = Listener(address)
        self.ports = ports
        self._network = network
        faults = FaultLog(lambda: network.now)
        faults.log = network.fail  # type: ignore[method-assign]
        self.lines = Lines(
            [(port.name, MemoryUrl(port.name)) for port in ports], self.endpoint, faults=faults,
            selector=FakeSelector(), call=lambda function: None,
            defer=lambda function: False,
            signing=signing or Signing(), mavlink_version=version, clock=lambda: network.now,
            wall_clock=lambda: 1.7e9)
        for line, port in zip(self.lines, ports, strict=True):
            self.endpoint.schedule.at(line._connect, math.inf)
            line.opened(port, network.now)

    def line(self, index: int) -> Line:
        """Return a line."""
        return list(self.lines)[index]

    def send(self, *messages: Message) -> None:
        """Send messages of the router's own component."""
        self.endpoint.outgoing.extend((self.endpoint.address, one) for one in messages)
        self.lines.flush(self._network.now)


class Leaf:
    """
    A component at the end of a wire.

    :ivar received: frames in order, as bytes.
    """

    def __init__(self, network: Network, port: Port, address: Address,
                 codec: Codec | None = None) -> None:
        self.address = address
        self.received: list[bytes] = []
        self.codec = codec or Codec()
        self._network = network
        self._port = port
        port.wires[self] = self.received.append

    def send(self, message: Message, source: Address | None = None) -> bytes:
        """Send a message, carry it everywhere, and return its frame."""
        frame = self.codec.frame(source or self.address, message)
        self.send_bytes(frame)
        return frame

    def send_bytes(self, data: bytes) -> None:
        """Send bytes, and carry what they cause everywhere."""
        self._network.carry(lambda sent: self._port.take(self, sent), data)
        self._network.settle()


class Network:
    """
    Carries frames one after the other.

    :ivar now: s.
    :ivar hops: how many frames were carried since :meth:`settle` was called.
    """

    def __init__(self) -> None:
        self.now = 1000.0
        self.hops = 0
        self._carried: deque[tuple[Callable[[bytes], None], bytes]] = deque()

    def fail(self) -> None:
        """Raise the exception that is handled, instead of logging it."""
        raise  # noqa: PLE0704 - it is called while an exception is handled

    def port(self, name: str, *, has_clients: bool = False) -> Port:
        """Return a port without a wire."""
        return Port(self, name, has_clients)

    def connect(self, one: Port, other: Port) -> None:
        """Connect two ports by a wire."""
        one.wires[other] = lambda data: other.take(one, data)
        other.wires[one] = lambda data: one.take(other, data)

    def carry(self, wire: Callable[[bytes], None], data: bytes) -> None:
        """Let a wire carry bytes when those before have come."""
        self._carried.append((wire, data))

    def settle(self) -> None:
        """Carry all bytes, and those that they cause."""
        self.hops = 0
        while self._carried:
            self.hops += 1
            assert self.hops <= MAX_HOPS, 'frames circulate'
            wire, data = self._carried.popleft()
            wire(data)
