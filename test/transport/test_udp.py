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

"""UDP channels: to whom they send, and whom they hear."""

from __future__ import annotations

from collections.abc import Callable
import errno
import socket
from typing import Any

from illuminator_ros.mavlink.transport import ChannelLost, open_channel
from illuminator_ros.mavlink.transport.udp import MAX_DATAGRAM, RECEIVE_BUFFER
from illuminator_ros.mavlink.url import HostPort, UdpUrl
import pytest
from support.open_channel import bound_socket, has_nothing, OpenChannel
from support.ports import free_port

OpenFunction = Callable[[str | UdpUrl], OpenChannel]


def test_a_listening_socket_hears_everybody(channel: OpenFunction, loopback: str) -> None:
    port = free_port(host=loopback)
    ours = channel(f'udpin://{loopback}:{port}')
    with bound_socket(loopback) as one, bound_socket(loopback) as other:
        one.sendto(b'one', (loopback.strip('[]'), port))
        other.sendto(b'other', (loopback.strip('[]'), port))
        assert sorted(data for _, data in ours.receive(2)) == [b'one', b'other']


def test_a_socket_keeps_as_much_as_the_kernel_allows(channel: OpenFunction) -> None:
    ours: Any = channel(UdpUrl(HostPort('127.0.0.1', 0))).channel
    with socket.socket(type=socket.SOCK_DGRAM) as other:
        other.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, RECEIVE_BUFFER)
        most = other.getsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF)
    assert ours._socket.getsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF) == most


def test_a_listening_socket_sends_to_whom_it_has_checked(
    channel: OpenFunction, loopback: str,
) -> None:
    port = free_port(host=loopback)
    ours = channel(f'udpin://{loopback}:{port}')
    with bound_socket(loopback) as good, bound_socket(loopback) as unchecked:
        for one in (good, unchecked):
            one.sendto(b'x', (loopback.strip('[]'), port))
        (peer,) = (peer for peer, _ in ours.receive(2) if peer[1] == good.getsockname()[1])
        ours.channel.heard(peer, 0.0)
        ours.broadcast(b'frame')
        assert good.recv(100) == b'frame'
        assert has_nothing(unchecked)


def test_a_listening_socket_has_nobody_to_send_to_at_first(channel: OpenFunction) -> None:
    assert not channel(UdpUrl(HostPort('127.0.0.1', 0))).channel.peers(0.0)


def test_a_fixed_remote_is_sent_to_unheard(channel: OpenFunction, loopback: str) -> None:
    with bound_socket(loopback) as remote:
        ours = channel(f'udpout://{loopback}:{remote.getsockname()[1]}')
        ours.broadcast(b'frame')
        assert remote.recv(100) == b'frame'


def test_a_fixed_remote_is_the_only_one_that_is_sent_to(
    channel: OpenFunction, loopback: str,
) -> None:
    port = free_port(host=loopback)
    with bound_socket(loopback) as remote, bound_socket(loopback) as other:
        ours = channel(f'udp://{loopback}:{port}@{loopback}:{remote.getsockname()[1]}')
        other.sendto(b'x', (loopback.strip('[]'), port))
        ((peer, _),) = ours.receive()
        assert not ours.channel.heard(peer, 0.0)
        ours.broadcast(b'frame')
        assert remote.recv(100) == b'frame'
        assert has_nothing(other)


def test_a_fixed_remote_is_heard_from_any_of_its_ports(
    channel: OpenFunction, loopback: str,
) -> None:
    # The reference emulator sends from another port than it listens on.
    port = free_port(host=loopback)
    with bound_socket(loopback) as remote, bound_socket(loopback) as same_host:
        ours = channel(f'udp://{loopback}:{port}@{loopback}:{remote.getsockname()[1]}')
        same_host.sendto(b'hello', (loopback.strip('[]'), port))
        assert ours.receive()[0][1] == b'hello'


def test_a_fixed_remote_on_another_host_is_the_only_host_that_is_heard(
    channel: OpenFunction,
) -> None:
    port = free_port()
    ours = channel(f'udp://0.0.0.0:{port}@192.0.2.1:14550')
    with bound_socket() as stranger:
        stranger.sendto(b'x', ('127.0.0.1', port))
        # It has arrived: the selector says so.
        assert ours.selector.select(5)
        assert ours.turn() == []


def test_any_loopback_address_is_a_remote_on_this_machine(channel: OpenFunction) -> None:
    port = free_port()
    ours = channel(f'udp://0.0.0.0:{port}@127.0.0.1:14550')
    with bound_socket('127.0.0.2') as other:
        other.sendto(b'hello', ('127.0.0.1', port))
        assert ours.receive()[0][1] == b'hello'


@pytest.mark.parametrize(('kind', 'reached'), [('until_peer', 'peer'), ('always', 'all')])
def test_a_broadcast_goes_on_once_a_peer_is_known_only_where_that_is_asked_for(
    channel: OpenFunction, kind: str, reached: str,
) -> None:
    with bound_socket('0.0.0.0') as everybody, bound_socket() as peer:
        remote = HostPort('127.255.255.255', everybody.getsockname()[1])
        ours = channel(UdpUrl(HostPort('', 0), remote, kind))
        ours.broadcast(b'first')
        assert everybody.recv(100) == b'first'
        ours.channel.heard(peer.getsockname(), 0.0)
        ours.broadcast(b'second')
        at, not_at = {'peer': (peer, everybody), 'all': (everybody, peer)}[reached]
        assert at.recv(100) == b'second'
        assert has_nothing(not_at)


def test_addresses_of_different_ip_versions_are_refused_by_name() -> None:
    with pytest.raises(OSError, match=r'127\.0\.0\.1:1.*\[::1\]:2.*different IP versions'):
        open_channel(UdpUrl(HostPort('127.0.0.1', 1), HostPort('::1', 2)))


def test_a_learnt_peer_out_of_reach_is_forgotten_and_no_loss(channel: OpenFunction) -> None:
    ours = channel(UdpUrl(HostPort('127.0.0.1', 0)))
    with bound_socket() as good:
        # Nothing can be sent to port 0.
        ours.channel.heard(('127.0.0.1', 0), 0.0)
        ours.channel.heard(good.getsockname(), 0.0)
        ours.broadcast(bytes(MAX_DATAGRAM), b'frame')
        assert good.recv(MAX_DATAGRAM) == bytes(MAX_DATAGRAM)
        assert good.recv(100) == b'frame'
        assert ours.channel.peers(0.0) == (good.getsockname(),)
        assert ours.channel.dropped == 2


@pytest.mark.parametrize(('sizes', 'datagrams'), [
    ([0], [0]),
    ([10, 20], [30]),
    ([MAX_DATAGRAM - 1, 1], [MAX_DATAGRAM]),
    ([MAX_DATAGRAM - 1, 2], [MAX_DATAGRAM - 1, 2]),
    ([280] * 12, [1400, 1400, 560]),
])
def test_frames_share_datagrams_that_pass_an_ethernet_whole(
    channel: OpenFunction, sizes: list[int], datagrams: list[int],
) -> None:
    with bound_socket() as remote:
        ours = channel(f'udpout://127.0.0.1:{remote.getsockname()[1]}')
        ours.broadcast(*map(bytes, sizes))
        assert [len(remote.recv(65536)) for _ in datagrams] == datagrams
        assert has_nothing(remote)


class _FailingSocket:
    """Fails to send, in one way."""

    def __init__(self, reason: int) -> None:
        self._reason = reason

    def sendto(self, data: bytes, peer: Any) -> int:
        raise OSError(self._reason, 'as the test says')

    def close(self) -> None:
        pass


def _with_failing_socket(ours: OpenChannel, reason: int) -> OpenChannel:
    real: socket.socket = ours.channel._socket  # type: ignore[attr-defined]
    ours.selector.unregister(real)
    real.close()
    ours.channel._socket = _FailingSocket(reason)  # type: ignore[attr-defined]
    return ours


@pytest.mark.parametrize('reason', [errno.ENOBUFS, errno.ENOMEM, errno.EAGAIN,
                                    errno.ECONNREFUSED])
def test_a_remote_that_cannot_be_sent_to_just_now_costs_one_frame(
    channel: OpenFunction, reason: int,
) -> None:
    ours = _with_failing_socket(channel('udpout://127.0.0.1:9'), reason)
    ours.broadcast(b'frame')
    assert ours.channel.dropped == 1


def test_a_remote_without_a_way_to_it_is_a_lost_channel(channel: OpenFunction) -> None:
    ours = _with_failing_socket(channel('udpout://127.0.0.1:9'), errno.ENETUNREACH)
    with pytest.raises(ChannelLost):
        ours.broadcast(b'frame')
