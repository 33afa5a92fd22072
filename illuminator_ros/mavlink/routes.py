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
from typing import Any

from .dialect import Source
from .transport import Peer

# Components whose way is remembered, and ways for each. Beyond that a message goes to everybody.
MAX_ROUTES = 256
MAX_WAYS = 4
# s without a frame, after which a way is forgotten.
EXPIRY = 10.0


class Routes:
    """
    The ways to components, learnt from what comes from them.

    A component that is heard over several peers is sent to over all of them: somebody who claims
    to be it takes nothing away from the one that was there before.
    """

    def __init__(self) -> None:
        self._ways: dict[Source, dict[Peer, float]] = {}

    @property
    def peer_count(self) -> int:
        """Return how many peers lead somewhere."""
        return len({peer for ways in list(self._ways.values()) for peer in list(ways)})

    def heard(self, source: Source, peer: Peer, now: float) -> None:
        """Note that a component was heard over a peer."""
        ways = self._ways.get(source)
        if ways is None:
            if len(self._ways) >= MAX_ROUTES:
                self._expire(now)
                if len(self._ways) >= MAX_ROUTES:
                    return
            ways = self._ways[source] = {}
        if peer in ways or len(ways) < MAX_WAYS:
            ways[peer] = now
        else:
            for old in [way for way, heard in ways.items() if now - heard > EXPIRY]:
                del ways[old]
            if len(ways) < MAX_WAYS:
                ways[peer] = now

    def towards(self, message: Any, peers: Sequence[Peer], now: float) -> Sequence[Peer]:
        """Return those of the peers that lead to the message's target, all where none does."""
        system = getattr(message, 'target_system', 0)
        if not system or len(peers) < 2:
            return peers
        ways = self._ways.get(Source(system, getattr(message, 'target_component', 0)), {})
        known = [peer for peer in peers if now - ways.get(peer, -math.inf) <= EXPIRY]
        return known or peers

    def clear(self) -> None:
        """Forget all: the link is closed."""
        self._ways.clear()

    def _expire(self, now: float) -> None:
        for source, ways in list(self._ways.items()):
            if all(now - heard > EXPIRY for heard in ways.values()):
                del self._ways[source]
