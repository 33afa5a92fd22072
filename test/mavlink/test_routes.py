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

"""To which peers a message goes."""

from __future__ import annotations

from illuminator_ros.mavlink.messages import Address, CommandLong, heartbeat
from illuminator_ros.mavlink.router import (
    EXPIRY,
    LOOK_INTERVAL,
    MAX_ROUTES,
    MAX_WAYS,
    Router,
)
import pytest
from support.frames import LIGHT

PEERS = ('a', 'b', 'c')


def to(target: Address) -> CommandLong:
    """Return a message with a target."""
    return CommandLong(*target, 512, 0, 0, 0, 0, 0, 0, 0, 0)


@pytest.fixture
def routes() -> Router:
    """Return routes on which the light was heard over one peer at 0 s."""
    one = Router()
    one.heard(LIGHT, 'b', 0.0)
    return one


def test_a_message_without_target_goes_to_all(routes: Router) -> None:
    assert routes.towards(heartbeat(18), PEERS, 0.0) == PEERS


def test_a_message_goes_where_its_target_was_heard(routes: Router) -> None:
    assert routes.towards(to(LIGHT), PEERS, 0.0) == ['b']


@pytest.mark.parametrize('target', [
    Address(0, 0), Address(0, 243), Address(1, 0), Address(2, 243)],
                         ids=['everybody', 'any system', 'a whole system', 'never heard'])
def test_a_message_to_nobody_that_was_heard_goes_to_all(routes: Router, target: Address) -> None:
    assert routes.towards(to(target), PEERS, 0.0) == PEERS


def test_a_message_goes_to_all_places_where_its_target_was_heard(routes: Router) -> None:
    routes.heard(LIGHT, 'c', 1.0)
    assert routes.towards(to(LIGHT), PEERS, 1.0) == ['b', 'c']


def test_a_way_expires(routes: Router) -> None:
    assert routes.towards(to(LIGHT), PEERS, EXPIRY) == ['b']
    assert routes.towards(to(LIGHT), PEERS, EXPIRY + 0.1) == PEERS


def test_a_way_that_is_used_stays(routes: Router) -> None:
    routes.heard(LIGHT, 'b', EXPIRY)
    assert routes.towards(to(LIGHT), PEERS, EXPIRY + 0.1) == ['b']


def test_a_way_over_a_peer_that_is_gone_is_none(routes: Router) -> None:
    assert routes.towards(to(LIGHT), ('a', 'c'), 0.0) == ('a', 'c')


def test_a_component_on_more_peers_than_are_remembered_is_sent_to_over_all() -> None:
    # A light that restarts on another port each time must be reached on the newest.
    routes = Router()
    peers = tuple(range(MAX_WAYS + 1))
    for peer in peers:
        routes.heard(LIGHT, peer, 0.0)
    assert routes.towards(to(LIGHT), peers, 1.0) == peers


def test_a_component_on_few_peers_again_is_sent_to_over_those() -> None:
    routes = Router()
    peers = tuple(range(MAX_WAYS + 1))
    for peer in peers:
        routes.heard(LIGHT, peer, 0.0)
    routes.heard(LIGHT, 'new', EXPIRY + 1)
    assert routes.towards(to(LIGHT), (*peers, 'new'), EXPIRY + 1) == ['new']


def test_more_components_than_are_remembered_take_nobodys_way(routes: Router) -> None:
    for number in range(2 * MAX_ROUTES):
        routes.heard(Address(2 + number // 256, number % 256), 'a', 0.0)
    assert len(routes) == MAX_ROUTES
    assert routes.towards(to(LIGHT), PEERS, 0.0) == ['b']


def test_components_that_have_fallen_silent_make_room(routes: Router) -> None:
    for number in range(MAX_ROUTES - 1):
        routes.heard(Address(2, number), 'a', 0.0)
    routes.heard(Address(3, 0), 'c', EXPIRY + 1)
    assert routes.towards(to(Address(3, 0)), PEERS, EXPIRY + 1) == ['c']
    assert len(routes) == 1


def test_a_full_table_is_looked_through_once_in_a_while(routes: Router) -> None:
    # A look costs as much as hundreds of frames.
    for number in range(MAX_ROUTES - 1):
        routes.heard(Address(2, number), 'a', 0.0)
    new = Address(3, 0)
    remembered = []
    for now in (EXPIRY - 0.1, EXPIRY + 0.1, EXPIRY + LOOK_INTERVAL):
        routes.heard(new, 'c', now)
        remembered.append(routes.towards(to(new), PEERS, now) == ['c'])
    assert remembered == [False, False, True]


def test_what_is_known_of_crowded_components_is_bounded_too() -> None:
    routes = Router()
    for batch in range(3):
        for number in range(MAX_ROUTES):
            for peer in range(MAX_WAYS + 1):
                routes.heard(Address(batch, number), peer, batch * (EXPIRY + LOOK_INTERVAL))
    assert len(routes._crowded) <= MAX_ROUTES


def test_peers_are_counted_while_something_comes_from_them(routes: Router) -> None:
    routes.heard(Address(9, 9), 'b', 1.0)
    routes.heard(Address(9, 9), 'c', 5.0)
    assert [routes.peer_count(now) for now in (5.0, EXPIRY + 2, EXPIRY + 6)] == [2, 1, 0]


def test_a_link_that_was_closed_leads_nowhere(routes: Router) -> None:
    routes.clear()
    assert routes.towards(to(LIGHT), PEERS, 0.0) == PEERS
    assert routes.peer_count(0.0) == 0
