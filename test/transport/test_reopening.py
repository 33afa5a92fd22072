# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Links and lights that are lost and found again: by themselves, with one event, no leaks."""

from __future__ import annotations

from collections.abc import Callable, Iterator
import contextlib
from pathlib import Path
import socket

from illuminator_ros.illuminator.settings import LightSettings
from illuminator_ros.mavlink import component, line
from illuminator_ros.mavlink import connector as connector_module
from illuminator_ros.mavlink.retries import CONNECTION
from illuminator_ros.mavlink.transport.udp import MAX_PEERS, PEER_EXPIRY
from illuminator_ros.payload import attempt
import pytest
from support import live_link
from support.frames import heartbeat_frame
from support.open_channel import bound_socket, listening_socket
from support.ports import free_port
from support.waiting import eventually, Log, PATIENCE

CYCLES = 200


class Server:
    """A TCP server that can be restarted."""

    def __init__(self) -> None:
        self._port = free_port(socket.SOCK_STREAM)
        self.url = f'tcp://127.0.0.1:{self._port}'
        self._listener: socket.socket | None = None
        self._connection: socket.socket | None = None

    def come(self, data: bytes = heartbeat_frame()) -> None:
        """Accept a connection and send data."""
        self.listen()
        assert self._listener is not None
        self._connection = self._listener.accept()[0]
        self._connection.sendall(data)

    def listen(self) -> None:
        """Listen, unless the server already does."""
        if self._listener is None:
            self._listener = listening_socket(port=self._port)

    def drop(self) -> None:
        """Close the connection."""
        if self._connection:
            self._connection.close()

    def go(self) -> None:
        """Close the listener, then the connection, lest the link reconnects to the listener."""
        if self._listener:
            self._listener.close()
            self._listener = None
        self.drop()


@pytest.fixture
def server() -> Iterator[Server]:
    one = Server()
    yield one
    one.go()


@pytest.fixture
def _unproven_without_frame(monkeypatch: pytest.MonkeyPatch) -> None:
    """Prevent that a channel is proved by staying open."""
    monkeypatch.setattr(line, 'PROOF_TIME', 3600.0)


@pytest.fixture
def pauses(monkeypatch: pytest.MonkeyPatch) -> Log[float]:
    """Return a log of the pauses before tries, which are not shortened at random."""
    log: Log[float] = Log()

    class Recorded(connector_module.Backoff):

        def __init__(self) -> None:
            super().__init__(lambda: 1.0)

        def pause(self, spent: float) -> float:
            log.append(super().pause(0.0))
            return min(log[-1], 0.001)

    monkeypatch.setattr(connector_module, 'Backoff', Recorded)
    return log


def test_openings_and_losses_are_reported_once_each_with_reason_and_time(
        run: live_link.Run, server: Server, pauses: Log[float]) -> None:
    clock = live_link.Jump()
    times = [clock()]
    link = run(live_link.LiveLink(server.url, clock=clock))
    # Further tries are not reported, before the first opening and after a loss.
    pauses.wait_for(lambda one: True, count=4)
    for change, wait, count in ((server.come, link.wait_open, 1), (server.go, link.wait_lost, 2),
                                (server.come, link.wait_open, 2)):
        clock.ahead += 1000.0
        change()
        wait(count)
        times.append(link.state().since)
        pauses.wait_for(lambda one: True, count=4 if change == server.come else len(pauses) + 4)
    name, address = f'tcp to {server.url[6:]}', server.url[6:]
    lost = link.events[2].reason
    assert list(map(str, link.events)) == [
        f'link not open: {server.url}: cannot connect to {address}: Connection refused; '
        'trying again', f'link open: {name}', f'link lost: {name}: {lost}; trying again',
        f'link open: {name}']
    assert lost
    assert [int((later - times[0]) // 1000) for later in times] == [0, 1, 2, 3]


def test_snapshot_of_a_lost_link_has_the_reason_of_the_last_try(
        run: live_link.Run, server: Server) -> None:
    server.listen()
    link = run(live_link.LiveLink(server.url))
    server.come()
    link.endpoint.wait_heard()
    server.go()
    link.wait_lost()

    eventually(lambda: link.state().reason.endswith('Connection refused'))


def test_server_that_drops_connections_is_asked_more_rarely_and_open_once_it_sends(
        run: live_link.Run, server: Server, pauses: Log[float],
        _unproven_without_frame: None) -> None:
    server.listen()
    link = run(live_link.LiveLink(server.url))
    for _ in range(5):
        server.come(b'')
        server.drop()
    server.come()
    link.wait_open(2)
    assert [pause for pause in pauses if pause][:4] == [0.05, 0.1, 0.2, 0.4]
    assert link.history() == [True, False, True]
    assert link.state().is_open


@pytest.mark.parametrize(('proof_time', 'pause'), [(0.0, 0.0), (3600.0, CONNECTION.first)])
def test_link_that_has_worked_is_reopened_at_once_and_one_that_only_answered_after_a_pause(
        run: live_link.Run, server: Server, pauses: Log[float], monkeypatch: pytest.MonkeyPatch,
        proof_time: float, pause: float) -> None:
    monkeypatch.setattr(line, 'PROOF_TIME', proof_time)
    server.listen()
    link = run(live_link.LiveLink(server.url))
    for count in (1, 2, 3):
        server.come()
        link.endpoint.wait_heard(count)
        link.ask(lambda now: None)
        server.drop()
    link.wait_lost(3)
    assert [pauses[i] for i in range(3)] == [0.0, pause, pause]


def test_port_in_use_is_opened_once_it_is_free(run: live_link.Run) -> None:
    with contextlib.ExitStack() as stack:
        port = free_port()
        stack.enter_context(bound_socket(port=port))
        link = run(live_link.LiveLink(f'udpin://127.0.0.1:{port}'))
        link.wait_lost()
        assert (link.state().is_open, link.state().reason, link.state().openings) == (
            False, f'cannot listen on 127.0.0.1:{port}: Address already in use '
            '(doc/routers.md: several programs on one link)', 0)
        stack.close()
        link.wait_open()
        assert link.history() == [False, True]


# Leaks

def cycle(link: live_link.LiveLink, come: Callable[[], None], go: Callable[[], None]) -> None:
    """Start and stop the other side, and check that it leaves no thread and no descriptor."""
    come()
    link.endpoint.wait_heard()
    before = live_link.resources()
    for count in range(1, CYCLES + 1):
        go()
        link.wait_lost(count)
        come()
        link.endpoint.wait_heard(count + 1)
    link.wait_open(CYCLES + 1)
    live_link.wait_for_resources(*before)
    assert link.history() == [True] + CYCLES * [False, True]


@pytest.fixture
def _proven_at_once(monkeypatch: pytest.MonkeyPatch, pauses: Log[float]) -> None:
    monkeypatch.setattr(line, 'PROOF_TIME', 0.0)


def test_200_restarts_of_a_tcp_server_leak_nothing(
        run: live_link.Run, server: Server, _proven_at_once: None) -> None:
    server.listen()
    cycle(run(live_link.LiveLink(server.url)), server.come, server.go)


def test_200_clients_of_a_tcp_server_and_udp_peers_leak_nothing(run: live_link.Run) -> None:
    port, clock = free_port(socket.SOCK_STREAM), live_link.Jump()
    udp, tcp = (run(live_link.LiveLink(f'{scheme}://127.0.0.1:{port}', clock=clock))
                for scheme in ('udpin', 'tcpin'))
    udp.wait_open()
    tcp.wait_open()
    before = live_link.resources()
    for count in range(1, CYCLES + 1):
        with socket.create_connection(('127.0.0.1', port)) as client, bound_socket() as light:
            client.sendall(heartbeat_frame())
            light.sendto(heartbeat_frame(), ('127.0.0.1', port))
            for link in (udp, tcp):
                link.endpoint.wait_heard(count)
            # It is answered as a new peer, however many there were before.
            assert light.recv(300)
        clock.ahead += PEER_EXPIRY / MAX_PEERS + 0.1
    live_link.wait_for_resources(*before)
    clock.ahead += PEER_EXPIRY + 1
    assert [(link.history(), link.state().peers) for link in (udp, tcp)] == [([True], 0)] * 2


# Lights behind a link

# s after which a light is lost; longer than a pause of the machine.
SILENCE = 30.0


# The URLs of the bridge and of the light. Over UDP the light has another port each time, and a
# pseudo-terminal is another device.
URLS = {'tcp': ('tcp://127.0.0.1:{port}', 'tcpin://127.0.0.1:{port}'),
        'udp': ('udpin://127.0.0.1:{port}', 'udpout://127.0.0.1:{port}'),
        'serial': ('serial://{path}:57600', 'pty://{path}')}


@pytest.mark.parametrize('kind', URLS)
def test_light_that_comes_goes_and_returns_is_found_commanded_and_reported_once_each(
        run: live_link.Run, monkeypatch: pytest.MonkeyPatch, tmp_path: Path, kind: str) -> None:
    if kind == 'serial':
        pytest.importorskip('serial', reason='pyserial is not installed')
    # A pause of the machine after an acknowledgement must not fail a change.
    monkeypatch.setattr(attempt, 'CONFIRMATION_TIMEOUT', PATIENCE)
    monkeypatch.setattr(component, 'HEARTBEAT_INTERVAL', 0.05)
    clock, port = live_link.Jump(), free_port(socket.SOCK_STREAM)
    ours, theirs = (url.format(port=port, path=tmp_path / 'ttyLIGHT') for url in URLS[kind])

    bridge = run(live_link.Bridge(ours, LightSettings(heartbeat_timeout=SILENCE), clock=clock))
    for count in (1, 2, 3):
        with live_link.Lights(theirs, clock=clock):
            light = bridge.wait_connected(count)
            assert bridge.enable(True, light).success
        # Messages sent before are taken first; on UDP only silence shows the loss.
        bridge.ask(lambda now: None)
        clock.ahead += SILENCE
        bridge.link.call(lambda now: None)
        bridge.lights.wait_for(lambda entry: entry[0] == 'lost', count=count)
        refused = bridge.enable(True, light)
        assert (refused.success, 'is lost' in refused.message) == (False, True)

    assert [what for what, _ in bridge.lights] == ['connected', 'lost'] * 3
