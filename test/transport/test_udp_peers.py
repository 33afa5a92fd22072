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

"""The peers of a UDP channel that listens: who becomes one, and for how long."""

from __future__ import annotations

from collections.abc import Callable
import socket
from typing import Any

from illuminator_ros.mavlink.frame import Decoder
from illuminator_ros.mavlink.messages import Address, CommandLong, heartbeat
from illuminator_ros.mavlink.transport.udp import MAX_PEERS, PEER_EXPIRY
from illuminator_ros.mavlink.url import HostPort, UdpUrl
import pytest
from support.frames import LIGHT
from support.heartbeats import heartbeat_frame
from support.live_link import BRIDGE, LiveLink
from support.open_channel import bound_socket, has_nothing, OpenChannel
from support.ports import free_port

COMMAND = CommandLong(*LIGHT, 512, 0, 440, 0, 0, 0, 0, 0, 0)
MARK = heartbeat(18)
MARK.custom_mode = 0x12345678


def peer(number: int) -> tuple[str, int]:
    """Return an address that can be told from others."""
    return '127.0.0.1', 10_000 + number


@pytest.fixture
def ours(channel: Callable[[UdpUrl], OpenChannel]) -> Any:
    """Return a channel that listens."""
    return channel(UdpUrl(HostPort('127.0.0.1', 0))).channel


@pytest.fixture
def full(ours: Any) -> Any:
    """Return a channel that has all the peers it can have, heard at 0 s."""
    for number in range(MAX_PEERS):
        ours.heard(peer(number), 0.0)
    return ours


@pytest.fixture
def port() -> int:
    """Return a port to listen on."""
    return free_port()


@pytest.fixture
def bridge(run: Callable[..., Any], port: int) -> Any:
    """Return a link that listens."""
    link = run(LiveLink(f'udpin://127.0.0.1:{port}'))
    link.wait_open()
    return link


def test_a_peer_is_new_once(ours: Any) -> None:
    assert [ours.heard(peer(1), 0.0), ours.heard(peer(1), 1.0)] == [True, False]


def test_a_peer_expires_without_checked_frames(ours: Any) -> None:
    ours.heard(peer(1), 0.0)
    assert ours.peers(PEER_EXPIRY) == (peer(1),)
    assert ours.peers(PEER_EXPIRY + 0.01) == ()


def test_a_peer_stays_with_checked_frames(ours: Any) -> None:
    ours.heard(peer(1), 0.0)
    ours.heard(peer(1), PEER_EXPIRY)
    assert ours.peers(2 * PEER_EXPIRY) == (peer(1),)


def test_a_peer_that_comes_back_is_new(ours: Any) -> None:
    ours.heard(peer(1), 0.0)
    ours.peers(PEER_EXPIRY + 1)
    assert ours.heard(peer(1), PEER_EXPIRY + 1)


def test_one_peer_more_than_there_is_room_for_takes_nobodys_place(full: Any) -> None:
    assert not full.heard(peer(MAX_PEERS), 1.0)
    assert full.peers(1.0) == tuple(peer(number) for number in range(MAX_PEERS))


def test_a_peer_that_found_no_room_gets_it_once_others_have_expired(full: Any) -> None:
    later = PEER_EXPIRY + 1
    assert full.heard(peer(MAX_PEERS), later)
    assert full.peers(later) == (peer(MAX_PEERS),)


@pytest.mark.parametrize('garbage', [
    b'', b'hello', bytes(300), heartbeat_frame()[:-1], heartbeat_frame()[:-1] + b'\0',
    b'\xfd' * 280,
], ids=['nothing', 'text', 'zeros', 'cut', 'wrong checksum', 'start bytes'])
def test_garbage_makes_nobody_a_peer(
    bridge: Any, port: int, garbage: bytes,
) -> None:
    with bound_socket() as light, bound_socket() as liar:
        liar.sendto(garbage, ('127.0.0.1', port))
        light.sendto(heartbeat_frame(), ('127.0.0.1', port))
        # The greeting that follows the good frame went to all the peers that there are.
        (frame,) = Decoder().feed(light.recv(300))
        assert frame.source == BRIDGE
        assert has_nothing(liar)
        assert bridge.state().peers == 1


def test_a_new_peer_is_greeted_at_once(bridge: Any, port: int) -> None:
    # Routers forward nothing to whom they have not heard.
    bridge.endpoint.greetings.wait_for(lambda at: True)
    with bound_socket() as light:
        light.sendto(heartbeat_frame(), ('127.0.0.1', port))
        bridge.endpoint.greetings.wait_for(lambda at: True, count=2)
        assert light.recv(300)


def test_who_claims_to_be_a_light_takes_no_command_away_from_it(
    bridge: Any, port: int,
) -> None:
    with bound_socket() as light, bound_socket() as thief:
        hear(bridge, port, [(light, LIGHT), (thief, LIGHT)])
        say(bridge, COMMAND, MARK)
        assert COMMAND.id in ids_until_mark(light)


def test_addressed_messages_go_only_where_the_target_was_heard(bridge: Any, port: int) -> None:
    with bound_socket() as light, bound_socket() as other:
        hear(bridge, port, [(light, LIGHT), (other, Address(7, 1))])
        say(bridge, COMMAND, MARK)
        assert COMMAND.id in ids_until_mark(light)
        assert COMMAND.id not in ids_until_mark(other)


def test_messages_to_who_was_heard_nowhere_go_to_everybody(bridge: Any, port: int) -> None:
    with bound_socket() as one, bound_socket() as other:
        hear(bridge, port, [(one, Address(7, 1)), (other, Address(8, 1))])
        say(bridge, COMMAND, MARK)
        assert COMMAND.id in ids_until_mark(one)
        assert COMMAND.id in ids_until_mark(other)


def test_what_is_said_together_comes_in_one_datagram(bridge: Any, port: int) -> None:
    with bound_socket() as one:
        hear(bridge, port, [(one, Address(7, 1))])
        say(bridge, COMMAND, MARK)
        while COMMAND.id not in (ids := ids_in(one.recv(65536))):
            pass
        assert ids == [COMMAND.id, MARK.id]


def hear(bridge: Any, port: int, talkers: list[tuple[socket.socket, Address]]) -> None:
    """Have a link hear several senders."""
    for count, (sender, source) in enumerate(talkers, 1):
        sender.sendto(heartbeat_frame(source), ('127.0.0.1', port))
        bridge.endpoint.heard.wait_for(lambda heard: True, count=count)


def say(bridge: Any, *messages: Any) -> None:
    """Have a link send messages."""
    bridge.ask(lambda now: bridge.endpoint.outgoing.extend(
        (BRIDGE, message) for message in messages))


def ids_in(datagram: bytes) -> list[int]:
    """Return the ids of the messages in a datagram."""
    return [frame.message_id for frame in Decoder().feed(datagram)]


def ids_until_mark(receiver: socket.socket) -> list[int]:
    """Return the ids of the messages that come before the mark."""
    ids = []
    while True:
        for frame in Decoder().feed(receiver.recv(65536)):
            if frame.payload[:4] == MARK.custom_mode.to_bytes(4, 'little'):
                return ids
            ids.append(frame.message_id)
