# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""UDP channels: the peers that they have, send to, and receive from."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
import contextlib
import errno
import socket
from typing import Any

from illuminator_ros.mavlink.errors import ChannelLost
from illuminator_ros.mavlink.frame import Decoder
from illuminator_ros.mavlink.transport import udp
from illuminator_ros.mavlink.transport.udp import MAX_DATAGRAM, MAX_PEERS, PEER_EXPIRY
from illuminator_ros.mavlink.url import Broadcast, HostPort, UdpUrl
import pytest
from support.frames import heartbeat_frame
from support.live_link import BRIDGE, LiveLink, Run
from support.open_channel import bound_socket, has_nothing, Open
from support.ports import free_port

ANY_PORT = UdpUrl(HostPort('127.0.0.1', 0))


@pytest.fixture
def port(loopback: str) -> int:
    return free_port(host=loopback)


@pytest.fixture
def sockets(loopback: str) -> Iterator[list[socket.socket]]:
    """Return three sockets on this host."""
    with contextlib.ExitStack() as stack:
        yield [stack.enter_context(bound_socket(loopback)) for _ in range(3)]


def send(port: int, *senders: tuple[socket.socket, bytes]) -> None:
    """Send datagrams to the port of a channel."""
    for sender, data in senders:
        sender.sendto(data, (sender.getsockname()[0], port))


def test_listening_channel_hears_all_and_sends_to_those_it_has_checked(
        channel: Open, loopback: str, port: int, sockets: list[socket.socket]) -> None:
    ours, (good, unchecked, _) = channel(f'udpin://{loopback}:{port}'), sockets
    assert ours.channel.peers(0.0) == ()
    send(port, (good, b'good'), (unchecked, b'unchecked'))
    origins = {data: peer for peer, data in ours.receive(2)}
    assert sorted(origins) == [b'good', b'unchecked']
    ours.channel.heard(origins[b'good'], 0.0)
    ours.broadcast(b'frame')
    assert good.recv(100) == b'frame'
    assert has_nothing(unchecked)


def test_fixed_remote_is_the_only_receiver_and_is_heard_from_any_port_of_its_host(
        channel: Open, loopback: str, port: int, sockets: list[socket.socket]) -> None:
    # The reference emulator sends from another port than it listens on.
    remote, other, _ = sockets
    ours = channel(f'udp://{loopback}:{port}@{loopback}:{remote.getsockname()[1]}')
    send(port, (other, b'x'))
    ((peer, data),) = ours.receive()
    assert (data, ours.channel.heard(peer, 0.0)) == (b'x', False)
    assert [ours.channel.leads_to(peer)] == list(ours.channel.peers(0.0))
    ours.broadcast(b'frame')
    assert remote.recv(100) == b'frame'
    assert has_nothing(other)


@pytest.mark.parametrize(('remote', 'heard'), [('127.0.0.1', True), ('192.0.2.1', False)])
def test_host_that_is_not_the_remote_is_not_heard_but_any_loopback_address_is_this_machine(
        channel: Open, remote: str, heard: bool) -> None:
    port = free_port()
    ours = channel(f'udp://0.0.0.0:{port}@{remote}:14550')
    with bound_socket('127.0.0.2') as other:
        other.sendto(b'hello', ('127.0.0.1', port))
        assert ours.selector.select(5)
        assert [data for _, data in ours.turn()] == [b'hello'] * heard


@pytest.mark.parametrize(('kind', 'receiver'), [('until_peer', 1), ('always', 0)])
def test_broadcast_ends_with_the_first_peer_unless_it_is_always_wanted(
        channel: Open, kind: Broadcast, receiver: int) -> None:
    with bound_socket('0.0.0.0') as all_hosts, bound_socket() as peer:
        ours = channel(UdpUrl(
            HostPort('', 0), HostPort('127.255.255.255', all_hosts.getsockname()[1]), kind))
        ours.broadcast(b'first')
        assert all_hosts.recv(100) == b'first'
        ours.channel.heard(peer.getsockname(), 0.0)
        ours.broadcast(b'second')
        both = [all_hosts, peer]
        assert ours.channel.has_clients is (kind == 'until_peer')
        assert both[receiver].recv(100) == b'second'
        assert has_nothing(both[1 - receiver])


@pytest.mark.parametrize(('sizes', 'datagrams'), [
    ([0], [0]), ([10, 20], [30]), ([MAX_DATAGRAM - 1, 1], [MAX_DATAGRAM]),
    ([MAX_DATAGRAM - 1, 2], [MAX_DATAGRAM - 1, 2]), ([280] * 12, [1400, 1400, 560])])
def test_frames_share_datagrams_that_ethernet_does_not_fragment(
        channel: Open, sizes: list[int], datagrams: list[int]) -> None:
    with bound_socket() as remote:
        ours = channel(f'udpout://127.0.0.1:{remote.getsockname()[1]}')
        ours.broadcast(*map(bytes, sizes))
        assert [len(remote.recv(65536)) for _ in datagrams] == datagrams
        assert has_nothing(remote)


@pytest.fixture
def fail(monkeypatch: pytest.MonkeyPatch) -> Callable[[int], None]:
    """Return a function that makes sockets return one datagram and then fail for a reason."""
    def fail(reason: int) -> None:
        left = [(b'last', ('127.0.0.1', 14550))]

        def recvfrom(one: socket.socket, size: int) -> tuple[bytes, Any]:
            return left.pop() if left else sendto()

        def sendto(*arguments: object) -> Any:
            raise OSError(reason, 'as the test says')

        monkeypatch.setattr(socket.socket, 'recvfrom', recvfrom)
        monkeypatch.setattr(socket.socket, 'sendto', sendto)

    return fail


@pytest.mark.parametrize(('reason', 'is_loss'), [
    (errno.ENOBUFS, False), (errno.ENOMEM, False), (errno.EAGAIN, False),
    (errno.ECONNREFUSED, False), (errno.ENETUNREACH, True)])
def test_remote_that_cannot_be_sent_to_costs_a_frame_or_without_a_way_the_channel(
        channel: Open, fail: Callable[[int], None], reason: int, is_loss: bool) -> None:
    ours = channel('udpout://127.0.0.1:9').channel
    fail(reason)
    with pytest.raises(ChannelLost) if is_loss else contextlib.nullcontext():
        ours.send([b'frame'], ours.peers(0.0))
    assert ours.dropped == (not is_loss)


def test_broadcast_address_of_a_url_that_does_not_broadcast_is_an_error_with_the_remedy(
        channel: Open) -> None:
    ours = channel('udpout://127.255.255.255:9').channel
    with pytest.raises(ChannelLost, match=r'a broadcast address needs udp-b://'):
        ours.send([b'frame'], ours.peers(0.0))


def test_datagram_before_the_loss_of_the_channel_is_read(
        channel: Open, fail: Callable[[int], None]) -> None:
    coming = iter(channel(ANY_PORT).channel.receive(None))
    fail(errno.ENETDOWN)
    assert next(coming) == (('127.0.0.1', 14550), b'last')
    with pytest.raises(ChannelLost):
        next(coming)


def test_learnt_peer_out_of_reach_is_forgotten_without_loss(channel: Open) -> None:
    ours = channel(ANY_PORT)
    with bound_socket() as good:
        # Nothing can be sent to port 0.
        for peer in (('127.0.0.1', 0), good.getsockname()):
            ours.channel.heard(peer, 0.0)
        ours.broadcast(bytes(MAX_DATAGRAM), b'frame')
        assert [len(good.recv(MAX_DATAGRAM)) for _ in range(2)] == [MAX_DATAGRAM, 5]
        assert (ours.channel.peers(0.0), ours.channel.dropped) == ((good.getsockname(),), 2)


# The amount of one read

@pytest.mark.parametrize(('limits', 'sent', 'reads'), [
    # The first datagram of a peer is read alone, since a request may wait for it.
    ({'BATCH': 4}, 'aaaaa', [(['a', 'aaa'], True), (['a'], False)]),
    ({}, 'aaab', [(['a', 'aa', 'b'], False)]),
    ({'BATCH_SIZE': 2}, 'aaa', [(['a', 'a'], True), (['a'], False)])])
def test_datagrams_of_one_peer_are_read_together_up_to_a_limit(
        channel: Open, monkeypatch: pytest.MonkeyPatch, limits: dict[str, int], sent: str,
        reads: list[tuple[list[str], bool]]) -> None:
    for name, limit in limits.items():
        monkeypatch.setattr(udp, name, limit)
    port = free_port()
    ours = channel(f'udpin://127.0.0.1:{port}')
    with bound_socket() as one, bound_socket() as other:
        send(port, *((one if name == 'a' else other, name.encode()) for name in sent))
        for pieces, more in reads:
            assert ([data.decode() for _, data in ours.receive()], ours.channel.more) == (
                pieces, more)


# Peers: heard(peer, now) -> whether it is new; peers(now)

def peer(number: int) -> tuple[str, int]:
    return '127.0.0.1', 10_000 + number


ALL = list(range(MAX_PEERS))
LATER = PEER_EXPIRY + 0.01


@pytest.mark.parametrize(('heard', 'now', 'peers'), [
    ([(1, 0.0, True), (1, 1.0, False)], 1.0, [1]), ([(1, 0.0, True)], PEER_EXPIRY, [1]),
    ([(1, 0.0, True)], LATER, []), ([(1, 0.0, True), (1, 9.0, False)], LATER, [1]),
    # A peer beyond the bound takes the place of an expired one only.
    ([*((number, 0.0, True) for number in ALL), (MAX_PEERS, 1.0, False)], 1.0, ALL),
    ([*((number, 0.0, True) for number in ALL), (MAX_PEERS, LATER, True)], LATER, [MAX_PEERS])])
def test_peer_is_one_until_it_expires_and_takes_no_place_of_another(
        channel: Open, heard: Iterable[tuple[int, float, bool]], now: float,
        peers: list[int]) -> None:
    ours = channel(ANY_PORT).channel
    for number, time, is_new in heard:
        assert ours.heard(peer(number), time) is is_new
    assert ours.peers(now) == tuple(map(peer, peers))
    assert not peers or not ours.heard(peer(peers[0]), now)


# Peers of a link


@pytest.fixture
def bridge(run: Run) -> tuple[LiveLink, int]:
    """Return a link that listens, and its port."""
    port = free_port()
    link = run(LiveLink(f'udpin://127.0.0.1:{port}'))
    link.wait_open()
    return link, port


@pytest.mark.parametrize('garbage', [b'', bytes(300), heartbeat_frame()[:-1] + b'\0'])
def test_garbage_makes_no_peer_and_a_valid_frame_one_that_is_answered_at_once(
        bridge: tuple[LiveLink, int], garbage: bytes) -> None:
    link, port = bridge
    with bound_socket() as light, bound_socket() as liar:
        send(port, (liar, garbage), (light, heartbeat_frame()))
        (frame,) = Decoder().feed(light.recv(300))
        assert frame.source == BRIDGE
        assert has_nothing(liar)
        assert link.state().peers == 1
