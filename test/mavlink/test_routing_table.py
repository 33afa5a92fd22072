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

"""The peers to which a message goes."""

from __future__ import annotations

import math

from illuminator_ros.mavlink.messages import Address
from illuminator_ros.mavlink.routing_table import (
    EXPIRY,
    EXPIRY_INTERVAL,
    MAX_ROUTE_PEERS,
    MAX_ROUTES,
    RoutingTable,
)
import pytest
from support.frames import LIGHT

PEERS = ('a', 'b', 'c')


@pytest.fixture
def router() -> RoutingTable:
    """Return a router that has heard the light over one peer at 0 s."""
    one = RoutingTable()
    one.heard(LIGHT, 'b', 0.0)
    return one


@pytest.mark.parametrize(('target', 'peers', 'now', 'receivers'), [
    (LIGHT, PEERS, 0.0, ['b']),
    (LIGHT, PEERS, EXPIRY, ['b']),
    (LIGHT, PEERS, 10.1, []),
    (LIGHT, ('a', 'c'), 0.0, []),
    (Address(LIGHT.system, 0), PEERS, 0.0, ['b']),
    (Address(LIGHT.system, 1), PEERS, 0.0, []),
    (Address(2, LIGHT.component), PEERS, 0.0, [])])
def test_peers_lead_to_a_target_that_was_lately_heard_over_them(
        router: RoutingTable, target: Address, peers: tuple[str, ...], now: float,
        receivers: list[str]) -> None:
    assert router.towards(target, peers, now) == receivers


def test_message_goes_over_all_peers_that_its_target_was_heard_over(router: RoutingTable) -> None:
    router.heard(LIGHT, 'c', 1.0)
    assert router.towards(LIGHT, PEERS, 1.0) == ['b', 'c']
    router.heard(LIGHT, 'b', EXPIRY)
    assert router.towards(LIGHT, PEERS, EXPIRY + 1.1) == ['b']


def test_component_on_more_peers_than_are_remembered_is_sent_to_over_all_meanwhile() -> None:
    # Messages must reach a light on its newest port if it restarts on another port each time.
    router, peers = RoutingTable(), tuple(range(MAX_ROUTE_PEERS + 1))
    for peer in peers:
        router.heard(LIGHT, peer, 0.0)
    assert router.towards(LIGHT, peers, 1.0) == peers
    router.heard(LIGHT, 'new', EXPIRY + 1)
    assert router.towards(LIGHT, (*peers, 'new'), EXPIRY + 1) == ['new']
    assert router.towards(Address(9, 9), peers, 1.0, math.inf) == []


def test_components_beyond_the_bound_take_no_way_from_those_remembered(
    router: RoutingTable,
) -> None:
    for number in range(2 * MAX_ROUTES):
        router.heard(Address(2 + number // 256, number % 256), 'a', 0.0)
    assert len(router) == MAX_ROUTES
    assert router.towards(LIGHT, PEERS, 0.0) == ['b']
    assert router.towards(Address(9, 9), PEERS, 0.0) == PEERS


def test_full_table_makes_room_for_silent_components_once_a_second(router: RoutingTable) -> None:
    # A search for silent components takes as much time as hundreds of frames.
    for number in range(MAX_ROUTES - 1):
        router.heard(Address(2, number), 'a', 0.0)
    new, remembered = Address(3, 0), []
    for now in (EXPIRY - 0.1, EXPIRY + 0.1, EXPIRY + EXPIRY_INTERVAL):
        router.heard(new, 'c', now)
        remembered.append(router.towards(new, PEERS, now) == ['c'])
    assert (remembered, len(router)) == ([False, False, True], 1)


def test_peers_count_while_they_are_heard_and_none_do_after_the_link_is_closed(
        router: RoutingTable) -> None:
    router.heard(Address(9, 9), 'b', 1.0)
    router.heard(Address(9, 9), 'c', 5.0)
    assert [router.peer_count(now) for now in (5.0, EXPIRY + 2, EXPIRY + 6)] == [2, 1, 0]
    router.clear()
    assert (router.peer_count(5.0), router.towards(LIGHT, PEERS, 5.0)) == (0, [])
