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

"""The peers that lead to each component (MAVLink guide, "Routing")."""

from __future__ import annotations

from collections.abc import Sequence
import math

from .messages import Address
from .transport import Peer

# Components with a route, and peers of one route. Messages to other components go to all peers.
MAX_ROUTES = 256
MAX_ROUTE_PEERS = 4
# s without a frame, after which a peer is removed from a route.
EXPIRY = 10.0
# s between searches of a full table for expired routes, so that few frames cause one.
EXPIRY_INTERVAL = 1.0


class RoutingTable:
    """
    The routes to components, learnt from the frames that come from them.

    A message to a component that is heard over several peers goes to all of them, so that an
    impostor diverts nothing from the real component.
    """

    def __init__(self) -> None:
        self._routes: dict[tuple[int, int], dict[Peer, float]] = {}
        # When a component was last heard over more peers than a route has.
        self._overflowed: dict[tuple[int, int], float] = {}
        self._expiry_due = -math.inf

    def __len__(self) -> int:
        return len(self._routes)

    def peer_count(self, now: float) -> int:
        """Return how many peers lead to any component."""
        return len({peer for route in self._routes.values()
                    for peer, heard in route.items() if now - heard <= EXPIRY})

    def peer_count_of(self, source: Address, now: float) -> int:
        """Return over how many peers a component was heard in the last :data:`EXPIRY`."""
        return sum(now - heard <= EXPIRY for heard in self._routes.get(source, {}).values())

    def heard(self, source: Address, peer: Peer, now: float) -> None:
        """Note that a component was heard over a peer."""
        route = self._routes.get(source)
        if route is None:
            if len(self._routes) >= MAX_ROUTES and not self._expire(now):
                return
            route = self._routes[source] = {}
        if peer not in route and len(route) >= MAX_ROUTE_PEERS:
            for old in [one for one, heard in route.items() if now - heard > EXPIRY]:
                del route[old]
            if len(route) >= MAX_ROUTE_PEERS:
                self._overflowed[source] = now
                return
        route[peer] = now

    def towards(self, message: object, peers: Sequence[Peer], now: float) -> Sequence[Peer]:
        """Return the peers that lead to the message's target, all peers if none does."""
        system = getattr(message, 'target_system', 0)
        if not system:
            return peers
        target = system, getattr(message, 'target_component', 0)
        if self._overflowed and now - self._overflowed.get(target, -math.inf) <= EXPIRY:
            return peers
        route = self._routes.get(target, {})
        known = [peer for peer in peers if now - route.get(peer, -math.inf) <= EXPIRY]
        return known or peers

    def clear(self) -> None:
        """Remove all routes: the link is closed."""
        self._routes.clear()
        self._overflowed.clear()

    def _expire(self, now: float) -> bool:
        """Remove expired routes, and return whether there is room for another."""
        if now >= self._expiry_due:
            self._expiry_due = now + EXPIRY_INTERVAL
            for source, route in list(self._routes.items()):
                if all(now - heard > EXPIRY for heard in route.values()):
                    del self._routes[source]
                    self._overflowed.pop(source, None)
        return len(self._routes) < MAX_ROUTES
