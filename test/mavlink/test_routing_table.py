# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The peers and the lines over which messages and frames go."""

from __future__ import annotations

import math

from illuminator_ros.mavlink.dialect import mavlink
from illuminator_ros.mavlink.forwarding.routing_table import (
    EXPIRY,
    EXPIRY_INTERVAL,
    MAX_ROUTE_PEERS,
    MAX_ROUTES,
    Router,
    RoutingTable,
)
from illuminator_ros.mavlink.messages import Address, CommandLong, heartbeat, Message
import pytest
from support.frames import frame_of, LIGHT, only, raw_v2

# The table of one line

PEERS = ('a', 'b', 'c')


@pytest.fixture
def table() -> RoutingTable:
    """Return a table that has heard the light over one peer at 0 s."""
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
        table: RoutingTable, target: Address, peers: tuple[str, ...], now: float,
        receivers: list[str]) -> None:
    assert table.towards(target, peers, now) == receivers


def test_message_goes_over_all_peers_that_its_target_was_heard_over(table: RoutingTable) -> None:
    table.heard(LIGHT, 'c', 1.0)
    assert table.towards(LIGHT, PEERS, 1.0) == ['b', 'c']
    table.heard(LIGHT, 'b', EXPIRY)
    assert table.towards(LIGHT, PEERS, EXPIRY + 1.1) == ['b']


def test_component_on_more_peers_than_are_remembered_is_sent_to_over_all_meanwhile() -> None:
    # Messages must reach a light on its newest port if it restarts on another port each time.
    table, peers = RoutingTable(), tuple(range(MAX_ROUTE_PEERS + 1))
    for peer in peers:
        table.heard(LIGHT, peer, 0.0)
    assert table.towards(LIGHT, peers, 1.0) == peers
    table.heard(LIGHT, 'new', EXPIRY + 1)
    assert table.towards(LIGHT, (*peers, 'new'), EXPIRY + 1) == ['new']
    assert table.towards(Address(9, 9), peers, 1.0, math.inf) == []


def test_components_beyond_the_bound_take_no_way_from_those_remembered(
    table: RoutingTable,
) -> None:
    for number in range(2 * MAX_ROUTES):
        table.heard(Address(2 + number // 256, number % 256), 'a', 0.0)
    assert len(table.sources()) == MAX_ROUTES
    assert table.towards(LIGHT, PEERS, 0.0) == ['b']
    assert table.towards(Address(9, 9), PEERS, 0.0) == PEERS


def test_full_table_makes_room_for_silent_components_once_a_second(table: RoutingTable) -> None:
    # A search for silent components takes as much time as hundreds of frames.
    for number in range(MAX_ROUTES - 1):
        table.heard(Address(2, number), 'a', 0.0)
    new, remembered = Address(3, 0), []
    for now in (EXPIRY - 0.1, EXPIRY + 0.1, EXPIRY + EXPIRY_INTERVAL):
        table.heard(new, 'c', now)
        remembered.append(table.towards(new, PEERS, now) == ['c'])
    assert (remembered, len(table.sources())) == ([False, False, True], 1)


def test_peers_count_while_they_are_heard_and_none_do_after_the_link_is_closed(
        table: RoutingTable) -> None:
    table.heard(Address(9, 9), 'b', 1.0)
    table.heard(Address(9, 9), 'c', 5.0)
    assert [table.peer_count(now) for now in (5.0, EXPIRY + 2, EXPIRY + 6)] == [2, 1, 0]
    table.clear()
    assert (table.peer_count(5.0), table.towards(LIGHT, PEERS, 5.0)) == (0, [])


# Several lines

OWN = Address(1, 193)
GIMBAL, AUTOPILOT, GROUND = Address(1, 154), Address(1, 1), Address(255, 190)
# The light is on line 0, the autopilot on 0 and 1, the gimbal on 1, and the ground station on 2.
# Another sender with our address is on 1.
HEARD = ((LIGHT, 0), (AUTOPILOT, 0), (AUTOPILOT, 1), (GIMBAL, 1), (GROUND, 2), (OWN, 1))
UNKNOWN_TARGET = 8  # LINK_NODE_STATUS: the dialect has its seed, and no class.


def router(now: float = 0.0) -> Router:
    """Return a router with three lines of one peer each."""
    tables = [RoutingTable() for _ in range(3)]
    for address, line in HEARD:
        tables[line].heard(address, f'peer {line}', now)
    return Router(tables, {OWN: 0})


def peers(*lines: int) -> list[list[str]]:
    return [[f'peer {line}'] if line in lines else [] for line in range(3)]


def lines_of(found: object) -> set[int]:
    assert isinstance(found, list | tuple)
    return {line for line, some in enumerate(found) if some}


def to(system: int, component: int) -> CommandLong:
    return CommandLong(system, component, 512, 0, 0, 0, 0, 0, 0, 0, 0)


SETUP_SIGNING = mavlink.MAVLink_setup_signing_message(1, 1, [0] * 32, 0)


@pytest.mark.parametrize(('frame', 'origin', 'expected'), [
    (frame_of(heartbeat(44), source=LIGHT), 0, {1, 2}),
    (frame_of(heartbeat(6), source=GROUND), 2, {0, 1}),
    (frame_of(to(0, 0), source=GROUND), 2, {0, 1}),
    (frame_of(to(0, 154), source=GROUND), 2, {0, 1}),
    (frame_of(to(*LIGHT), source=GROUND), 2, {0}),
    (frame_of(to(*GIMBAL), source=GROUND), 2, {1}),
    (frame_of(to(*AUTOPILOT), source=GROUND), 2, {0, 1}),
    (frame_of(to(*AUTOPILOT), source=GIMBAL), 1, {0}),
    (frame_of(to(1, 0), source=GROUND), 2, {0, 1}),
    (frame_of(to(1, 0), source=LIGHT), 0, {1}),
    (frame_of(to(*GROUND), source=LIGHT), 0, {2}),
    (frame_of(to(1, 7), source=GROUND), 2, set()),
    (frame_of(to(9, 0), source=GROUND), 2, set()),
    (frame_of(to(*GROUND), source=GROUND), 2, set()),
    (frame_of(to(*OWN), source=GROUND), 2, set()),
    (frame_of(to(*LIGHT), source=OWN), 1, {0}),
    (frame_of(to(*GIMBAL), source=GROUND, version=1), 2, {1}),
    (frame_of(SETUP_SIGNING, source=GROUND), 2, set()),
    (raw_v2(UNKNOWN_TARGET, bytes((9, 9, 9)), source=GROUND), 2, {0, 1})])
def test_a_frame_goes_to_the_other_lines_where_its_target_was_heard(
        frame: bytes, origin: int, expected: set[int]) -> None:
    others = peers(*{0, 1, 2} - {origin})
    for now in (0.0, 10 * EXPIRY):
        assert lines_of(router().targets(only(frame), others, now)) == expected


@pytest.mark.parametrize(('heard', 'sole'), [
    ([(LIGHT, 0, 'a')], {LIGHT}),
    ([(LIGHT, 0, 'a'), (GIMBAL, 0, 'b')], {LIGHT, GIMBAL}),
    ([(LIGHT, 0, 'a'), (GIMBAL, 1, 'a')], {LIGHT, GIMBAL}),
    ([(LIGHT, 0, 'a'), (GIMBAL, 0, 'a')], set()),
    ([(LIGHT, 0, 'a'), (LIGHT, 0, 'b')], set()),
    ([(LIGHT, 0, 'a'), (LIGHT, 1, 'a')], set())])
def test_a_component_is_alone_if_one_peer_leads_to_it_and_to_no_other_one(
        heard: list[tuple[Address, int, str]], sole: set[Address]) -> None:
    tables = [RoutingTable(), RoutingTable()]
    for address, line, peer in heard:
        tables[line].heard(address, peer, 0.0)
    router = Router(tables, {})
    assert [router.sole_sources(now) for now in (0.0, EXPIRY + 1)] == [sole, set()]


def test_a_frame_goes_where_its_target_was_heard_last_if_that_is_long_ago() -> None:
    tables = [RoutingTable(), RoutingTable()]
    router = Router(tables, {})
    both = [['a'], ['b']]
    tables[0].heard(LIGHT, 'a', 0.0)
    tables[1].heard(LIGHT, 'b', EXPIRY)
    frame = only(frame_of(to(*LIGHT), source=GROUND))
    assert [lines_of(router.targets(frame, both, now)) for now in (
        EXPIRY, EXPIRY + 1, 3 * EXPIRY)] == [{0, 1}, {1}, {0, 1}]


@pytest.mark.parametrize(('target', 'now', 'expected'), [
    (LIGHT, 0.0, {0}), (AUTOPILOT, 0.0, {0, 1}), (GROUND, EXPIRY, {2}),
    (GROUND, EXPIRY + 1, {0, 1, 2}), (Address(1, 0), 0.0, {0, 1, 2}),
    (Address(0, 0), 0.0, {0, 1, 2}), (Address(9, 9), 0.0, {0, 1, 2})])
def test_our_message_goes_where_its_target_was_lately_heard_and_else_everywhere(
        target: Address, now: float, expected: set[int]) -> None:
    assert lines_of(router().towards(target, peers(0, 1, 2), now)) == expected


def test_a_full_line_diverts_neither_our_messages_to_an_impostor_nor_frames_from_its_components(
) -> None:
    # The light is on line 0, which has no room for its route; an impostor of it is on line 1.
    tables = [RoutingTable(), RoutingTable()]
    for number in range(MAX_ROUTES):
        tables[0].heard(Address(2, number), 'a', 0.0)
    tables[0].heard(LIGHT, 'a', 0.0)
    router = Router(tables, {})
    frame = only(frame_of(to(*LIGHT), source=GROUND))
    assert lines_of(router.targets(frame, [['a'], ['b']], 0.0)) == {0}
    tables[1].heard(LIGHT, 'b', 0.0)
    assert lines_of(router.towards(LIGHT, [['a'], ['b']], 0.0)) == {0, 1}
    assert lines_of(router.towards(LIGHT, [['a'], ['b']], EXPIRY + 0.1)) == {0, 1}


def test_a_frame_goes_to_the_other_clients_of_its_server_by_the_same_rules() -> None:
    table = RoutingTable()
    for address, client in ((LIGHT, 'a'), (GIMBAL, 'b'), (GROUND, 'c')):
        table.heard(address, client, 0.0)
    router = Router([table], {})
    sent: list[tuple[Message, object]] = [
        (to(*LIGHT), [['a']]), (heartbeat(6), [['a', 'b']]), (to(*GROUND), [[]])]
    for message, expected in sent:
        frame = only(frame_of(message, source=GROUND))
        assert router.targets(frame, [['a', 'b']], 0.0) == expected
