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

"""Which peers lead to which component (MAVLink guide, "Routing")."""

from __future__ import annotations

from collections.abc import Sequence
import math

from .messages import Address
from .transport import Peer

# Components whose way is remembered, and ways for each. Beyond that all peers get a message.
MAX_ROUTES = 256
MAX_WAYS = 4
# s without a frame, after which a way is forgotten.
EXPIRY = 10.0
# s between looks for what has expired, where there is no room: a frame must not cost a look.
LOOK_INTERVAL = 1.0


class RoutingTable:
    """
    The ways to components, learnt from what comes from them.

    A component that is heard over several peers is sent to over all of them: an impostor
    diverts nothing from the real component.
    """

    def __init__(self) -> None:
        self._ways: dict[Address, dict[Peer, float]] = {}
        # When a component was last heard over more peers than are remembered.
        self._crowded: dict[Address, float] = {}
        self._look_due = -math.inf

    def __len__(self) -> int:
        return len(self._ways)

    def peer_count(self, now: float) -> int:
        """Return how many peers lead somewhere."""
        return len({peer for ways in self._ways.values()
                    for peer, heard in ways.items() if now - heard <= EXPIRY})

    def way_count(self, source: Address, now: float) -> int:
        """Return over how many peers a component is heard."""
        return sum(now - heard <= EXPIRY for heard in self._ways.get(source, {}).values())

    def heard(self, source: Address, peer: Peer, now: float) -> None:
        """Note that a component was heard over a peer."""
        ways = self._ways.get(source)
        if ways is None:
            if len(self._ways) >= MAX_ROUTES and not self._expire(now):
                return
            ways = self._ways[source] = {}
        if peer not in ways and len(ways) >= MAX_WAYS:
            for old in [way for way, heard in ways.items() if now - heard > EXPIRY]:
                del ways[old]
            if len(ways) >= MAX_WAYS:
                self._crowded[source] = now
                return
        ways[peer] = now

    def towards(self, message: object, peers: Sequence[Peer], now: float) -> Sequence[Peer]:
        """Return those of the peers that lead to the message's target, all where none does."""
        system = getattr(message, 'target_system', 0)
        if not system or len(peers) < 2:
            return peers
        target = Address(system, getattr(message, 'target_component', 0))
        if now - self._crowded.get(target, -math.inf) <= EXPIRY:
            return peers
        ways = self._ways.get(target, {})
        known = [peer for peer in peers if now - ways.get(peer, -math.inf) <= EXPIRY]
        return known or peers

    def clear(self) -> None:
        """Forget all: the link is closed."""
        self._ways.clear()
        self._crowded.clear()

    def _expire(self, now: float) -> bool:
        """Forget what has not been heard for long, and return whether there is room."""
        if now >= self._look_due:
            self._look_due = now + LOOK_INTERVAL
            for source, ways in list(self._ways.items()):
                if all(now - heard > EXPIRY for heard in ways.values()):
                    del self._ways[source]
                    self._crowded.pop(source, None)
        return len(self._ways) < MAX_ROUTES
