# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The lines and peers that lead to each component (MAVLink guide, "Routing"); no I/O, no clock."""

from __future__ import annotations

from collections import Counter
from collections.abc import Container, Iterable, Iterator, Sequence
import math
from typing import TypeVar

from ..frame import Frame
from ..message_traits import NEVER_FORWARDED, target_of
from ..messages import Address
from ..transport import Peer

# Components with a route, and peers of one route. Messages to other components go to all peers.
MAX_ROUTES = 256
MAX_ROUTE_PEERS = 4
# s without a frame, after which a peer is removed from a route.
EXPIRY = 10.0
# s between searches of a full table for expired routes, so that few frames cause one.
EXPIRY_INTERVAL = 1.0


class RoutingTable:
    """
    The routes to components over one line, learnt from the frames that come from them.

    A message to a component that is heard over several peers goes to all of them, so that an
    impostor diverts nothing from the real component.
    """

    def __init__(self) -> None:
        self._routes: dict[tuple[int, int], dict[Peer, float]] = {}
        # When a component was last heard over more peers than a route has.
        self._overflowed: dict[tuple[int, int], float] = {}
        self._expiry_due = -math.inf
        # When a component was last heard for which there was no room.
        self._full_at: float | None = None

    def peer_count(self, now: float) -> int:
        """Return how many peers lead to any component."""
        return len({peer for _, peer in self.routes(now)})

    def peer_count_of(self, source: Address, now: float) -> int:
        """Return over how many peers a component was heard in the last :data:`EXPIRY`."""
        return sum(now - heard <= EXPIRY for heard in self._routes.get(source, {}).values())

    def routes(self, now: float) -> Iterator[tuple[Address, Peer]]:
        """Return the components that were heard in the last :data:`EXPIRY`, with the peers."""
        return ((Address(*source), peer) for source, route in self._routes.items()
                for peer, heard in route.items() if now - heard <= EXPIRY)

    def heard(self, source: Address, peer: Peer, now: float) -> None:
        """Note that a component was heard over a peer."""
        route = self._routes.get(source)
        if route is None:
            if len(self._routes) >= MAX_ROUTES and not self._expire(now):
                self._full_at = now
                return
            route = self._routes[source] = {}
        if peer not in route and len(route) >= MAX_ROUTE_PEERS:
            for old in [one for one, heard in route.items() if now - heard > EXPIRY]:
                del route[old]
            if len(route) >= MAX_ROUTE_PEERS:
                self._overflowed[source] = now
                return
        route[peer] = now

    def is_full(self, now: float, within: float = EXPIRY) -> bool:
        """Return whether a component was lately heard for which there was no room."""
        return self._full_at is not None and now - self._full_at <= within

    def towards(
        self, target: Address, peers: Sequence[Peer], now: float, within: float = EXPIRY,
    ) -> Sequence[Peer]:
        """
        Return the peers that lead to a target: none without a route, all if there was no room.

        :param target: all components of the system where the component id is 0.
        :param within: how far back a route counts, s.
        """
        if target not in self._routes and self.is_full(now, within):
            return peers
        sources = [target] if target.component else [
            one for one in self._routes if one[0] == target.system]
        known: set[Peer] = set()
        for source in sources:
            overflowed = self._overflowed.get(source)
            if overflowed is not None and now - overflowed <= within:
                return peers
            known.update(peer for peer, heard in self._routes.get(source, {}).items()
                         if now - heard <= within)
        return [peer for peer in peers if peer in known]

    def sources(self) -> list[Address]:
        """Return the components with a route."""
        return [Address(*source) for source in self._routes]

    def clear(self) -> None:
        """Remove all routes: the link is closed."""
        self._routes.clear()
        self._overflowed.clear()
        self._full_at = None

    def _expire(self, now: float) -> bool:
        """Remove expired routes, and return whether there is room for another."""
        if now >= self._expiry_due:
            self._expiry_due = now + EXPIRY_INTERVAL
            for source, route in list(self._routes.items()):
                if all(now - heard > EXPIRY for heard in route.values()):
                    del self._routes[source]
                    self._overflowed.pop(source, None)
        return len(self._routes) < MAX_ROUTES


# The peers of each line, by its index.
Peers = Sequence[Sequence[Peer]]
T = TypeVar('T')


def grouped(frames: Iterable[tuple[Peers, T]]) -> list[tuple[Peers, list[T]]]:
    """
    Return consecutive frames for the same peers together.

    They are sent together, so that each receiver is woken only once.
    """
    groups: list[tuple[Peers, list[T]]] = []
    for peers, frame in frames:
        if groups and groups[-1][0] == peers:
            groups[-1][1].append(frame)
        else:
            groups.append((peers, [frame]))
    return groups


class Router:
    """
    The rules by which messages and frames find the lines and peers that lead to their targets.

    :param tables: what each line has heard.
    :param own: the addresses of this program, from which it has sent.
    """

    def __init__(self, tables: Sequence[RoutingTable], own: Container[Address]) -> None:
        self._tables = tables
        self._own = own

    def towards(self, target: Address, peers: Peers, now: float) -> Peers:
        """
        Return where to send one of our own messages: everywhere if no line knows the target.

        A message to all components of a system goes everywhere, too: some may not have been heard
        yet. So does each while a line has heard more components than it remembers.
        """
        # One peer needs no search.
        if (not (target.system and target.component) or sum(map(len, peers)) < 2
                or any(table.is_full(now) for table in self._tables)):
            return peers
        found = self._known(target, peers, now)
        return found if any(found) else peers

    def targets(self, frame: Frame, peers: Peers, now: float) -> Peers:
        """
        Return where to forward a frame; nowhere if it is for us alone.

        :param peers: all but the one from which it came.
        """
        if frame.message_id in NEVER_FORWARDED:
            return ()
        target = target_of(frame)
        if not target.system:
            return peers
        if target in self._own:
            return ()
        found = self._known(target, peers, now)
        # A silent component is still where it was heard last.
        return found if any(found) else self._known(target, peers, now, math.inf)

    def sole_sources(self, now: float) -> set[Address]:
        """
        Return the components that are heard over one peer only, which leads to no other one.

        A peer that leads to several may be a router. It sends what is for one of them to that one
        only, so a frame that did not come is not lost.
        """
        if any(table.is_full(now) for table in self._tables):
            return set()
        routes = [(source, (line, peer)) for line, table in enumerate(self._tables)
                  for source, peer in table.routes(now)]
        ways = Counter(source for source, _ in routes)
        behind = Counter(path for _, path in routes)
        return {source for source, path in routes if ways[source] == behind[path] == 1}

    def is_reachable(self, source: Address, now: float) -> bool:
        """Return whether a component was lately heard over any line."""
        return any(table.peer_count_of(source, now) for table in self._tables)

    def _known(self, target: Address, peers: Peers, now: float, within: float = EXPIRY) -> Peers:
        return [table.towards(target, some, now, within) if some else ()
                for table, some in zip(self._tables, peers, strict=True)]
