# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""A link in its thread: its snapshots and calls, its response to faults, and its end."""

from __future__ import annotations

from collections.abc import Callable
import logging
import math
from pathlib import Path
import socket
import threading
from typing import Any

from illuminator_ros.mavlink import connector as connector_module
from illuminator_ros.mavlink import line, link_thread
from illuminator_ros.mavlink.dialect import decode
from illuminator_ros.mavlink.errors import LinkThreadError
from illuminator_ros.mavlink.frame import Decoder
from illuminator_ros.mavlink.link import Link, STORE_INTERVAL
from illuminator_ros.mavlink.link_state import LinkEvent
from illuminator_ros.mavlink.messages import CommandLong
from illuminator_ros.mavlink.retries import RESOURCE
from illuminator_ros.mavlink.signing import Signing, SigningMode
from illuminator_ros.mavlink.signing_files import TimestampStore
from illuminator_ros.mavlink.transport import open_channel, tcp
from illuminator_ros.mavlink.url import parse_url
import pytest
from support.frames import heartbeat_frame, LIGHT
from support.live_link import (
    CONNECTOR,
    Jump,
    LiveLink,
    resources,
    Run,
    Talker,
    wait_for_resources,
)
from support.open_channel import listening_socket, Open, OpenChannel
from support.ports import free_port
from support.waiting import eventually, Log, PATIENCE

URL = 'memory://link'


@pytest.fixture
def other(channel: Open) -> OpenChannel:
    """Return the other side of the in-memory links here."""
    return channel(URL)


# Snapshots and calls

def test_open_link_tells_its_name_and_counts_frames_and_bytes_both_ways(
        run: Run, other: OpenChannel) -> None:
    link = run(LiveLink(URL))
    sent = other.receive()[0][1]
    other.broadcast(heartbeat_frame() + b'xyz')
    assert link.endpoint.wait_heard() == LIGHT
    state = link.state()
    assert (state.is_open, state.name, state.reason, state.openings, state.failure) == (
        True, 'memory link', '', 1, '')
    traffic = state.traffic
    assert (traffic.frames_received, traffic.bytes_received) == (1, len(heartbeat_frame()) + 3)
    assert traffic.frames_sent >= 1
    assert traffic.bytes_sent == traffic.frames_sent * len(sent)


# Exceptions of the endpoint and of listeners: each is logged, and the link continues

class Fault(Exception):
    """The exception that a test injects."""


class Faulty(Talker):
    """
    Fails in the method of this name, a number of times.

    :ivar failures: the calls that failed.
    """

    def __init__(self, method: str, times: float = 1) -> None:
        super().__init__()
        self.failures: Log[str] = Log()
        self.schedule.at(lambda now: self.poll(now), 0.0)
        genuine = getattr(self, method)

        def fail(*arguments: Any) -> Any:
            if len(self.failures) < times:
                self.failures.append(method)
                raise Fault(method)
            return genuine(*arguments)

        setattr(self, method, fail)

    def poll(self, now: float) -> None:
        """Do what is due: nothing."""


@pytest.fixture
def faults(monkeypatch: pytest.MonkeyPatch,
           caplog: pytest.LogCaptureFixture) -> Callable[[], list[str]]:
    """Return a function that returns all logged faults; each is logged."""
    monkeypatch.setattr(link_thread, 'FAULT_LOG_INTERVAL', 0.0)

    def logged() -> list[str]:
        assert all(record.levelno == logging.ERROR for record in caplog.records)
        return [str(record.exc_info[1]) for record in caplog.records if record.exc_info]

    return logged


@pytest.mark.parametrize('method', ['link_opened', 'receive', 'poll'])
def test_fault_of_the_endpoint_is_logged_and_costs_no_other_frame(
        run: Run, other: OpenChannel, faults: Callable[[], list[str]], method: str) -> None:
    endpoint = Faulty(method)
    link = run(LiveLink(URL, endpoint))
    link.wait_open()
    other.broadcast(heartbeat_frame() + heartbeat_frame(sequence=1))
    assert endpoint.wait_heard() == LIGHT
    endpoint.failures.wait_for(lambda one: True)
    assert faults() == [method]


def test_message_with_a_value_that_does_not_fit_costs_no_other_message(
        run: Run, other: OpenChannel, caplog: pytest.LogCaptureFixture) -> None:
    link, decoder = run(LiveLink(URL)), Decoder()
    link.wait_open()
    link.send(*(CommandLong(1, 243, 405, confirmation, value, 0, 0, 0, 0, 0, 0)
                for confirmation, value in ((0, 1.0), (256, 1.0), (0, 1e39), (2, 1.0))))
    sent: list[int] = []
    while 2 not in sent:
        frames = (frame for _, data in other.receive() for frame in decoder.feed(data))
        sent += [decode(CommandLong, frame.payload).confirmation
                 for frame in frames if frame.message_id == CommandLong.id]
    assert sent == [0, 2]
    assert 'internal error in the link' in caplog.text


@pytest.mark.parametrize('failing', ['link_closed', 'opening', 'loss'])
def test_fault_at_a_loss_or_in_a_listener_does_not_keep_a_link_lost(
        run: Run, faults: Callable[[], list[str]], failing: str) -> None:
    def listen(event: LinkEvent) -> None:
        if failing == ('opening' if event.is_open else 'loss'):
            raise Fault(failing)

    endpoint = Faulty('link_closed', failing == 'link_closed')
    with listening_socket() as server:
        link = run(LiveLink(f'tcp://127.0.0.1:{server.getsockname()[1]}', endpoint,
                            on_event=listen))
        for count in (1, 2):
            with server.accept()[0] as connection:
                connection.sendall(heartbeat_frame())
                endpoint.wait_heard(count)
                link.wait_open(count)
    assert set(faults()) == {failing}


def test_lasting_fault_pauses_the_thread_and_does_not_fill_the_log(
        run: Run, caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch) -> None:
    endpoint = Faulty('poll', math.inf)
    monkeypatch.setattr(link_thread, 'FAULT_PAUSE', 0.001)
    monkeypatch.setattr(link_thread, 'FAULT_LOG_INTERVAL', 60.0)
    run(LiveLink(URL, endpoint))
    endpoint.failures.wait_for(lambda one: True, count=50)
    assert len(caplog.records) == 1


@pytest.mark.parametrize('reason', [PermissionError('no room'), Fault('store')])
def test_time_stamps_that_cannot_be_stored_do_not_end_the_link(
        run: Run, other: OpenChannel, caplog: pytest.LogCaptureFixture, tmp_path: Path,
        reason: Exception) -> None:
    class Store(TimestampStore):

        def store(self, *arguments: Any, **named: Any) -> None:
            raise reason

    link = run(LiveLink(URL, signing=Signing(SigningMode.SIGN, bytes(32)),
                        store=Store('key', 'name', tmp_path)))
    link.wait_open()
    other.broadcast(heartbeat_frame())
    assert link.endpoint.wait_heard() == LIGHT
    link.stop()
    assert caplog.records


# Unix time, s: 1970, as on a computer whose clock was not set, and 2023.
@pytest.mark.parametrize('unix_time', [0.0, 1.7e9])
def test_link_stores_its_time_stamps_at_once_every_30_s_and_when_it_ends(
        run: Run, tmp_path: Path, unix_time: float) -> None:
    store, clock = TimestampStore('key', 'test', tmp_path), Jump()
    used = []
    for wall_clock in (unix_time, unix_time + 2 * STORE_INTERVAL):
        times = [wall_clock]
        signing = Signing(SigningMode.SIGN, bytes(32), timestamp=store.begin(wall_clock))
        link = run(LiveLink('memory://time_stamps', signing=signing, store=store, clock=clock,
                            wall_clock=lambda times=times: times[0]))
        link.wait_open()
        link.ask(lambda now: None)
        # The file that a crash would leave, now and after some time.
        assert store.load() > signing.timestamp > 0
        store.path.unlink()
        times[0] += STORE_INTERVAL
        clock.ahead += STORE_INTERVAL
        link.ask(lambda now: None)
        eventually(store.path.exists, 'stored again')
        assert store.load() > signing.timestamp
        link.stop()
        assert store.load() == signing.timestamp
        used.append(signing.timestamp)
    assert used[1] > used[0]


def test_fault_while_opening_is_logged_and_tried_again(
        run: Run, faults: Callable[[], list[str]], monkeypatch: pytest.MonkeyPatch) -> None:
    genuine, tries = open_channel, Log[int]()

    def open_second_time(url: Any) -> Any:
        tries.append(1)
        if len(tries) == 1:
            raise Fault('opening')
        return genuine(url)

    monkeypatch.setattr(connector_module, 'open_channel', open_second_time)
    run(LiveLink(URL)).wait_open()
    assert faults() == ['opening']


def test_connector_whose_thread_cannot_be_started_is_tried_again(
        run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    # Threads fail to start, as with a limit on the number of processes.
    monkeypatch.setattr(line, 'RESOURCE', RESOURCE._replace(first=0.01))
    genuine, failures = threading.Thread.start, Log[str]()

    def start(thread: threading.Thread) -> None:
        if thread.name == CONNECTOR and len(failures) < 2:
            failures.append(thread.name)
            raise RuntimeError("can't start new thread")
        genuine(thread)

    monkeypatch.setattr(threading.Thread, 'start', start)
    with listening_socket() as server:
        url = f'tcp://127.0.0.1:{server.getsockname()[1]}'
        link = run(LiveLink(url))
        assert str(link.wait_lost()) == (
            f"link not open: {url}: can't start new thread; trying again")
        with server.accept()[0] as connection:
            connection.sendall(heartbeat_frame())
            link.endpoint.wait_heard()
            failures.clear()
        link.wait_lost(2)
        failures.wait_for(lambda name: True, count=2)
        server.accept()[0].close()


def test_link_whose_thread_cannot_be_started_says_so_and_leaves_nothing(
        monkeypatch: pytest.MonkeyPatch) -> None:
    def start(thread: threading.Thread) -> None:
        raise RuntimeError("can't start new thread")

    before = resources()
    link = Link(parse_url(URL), Talker(), label='the label')
    monkeypatch.setattr(threading.Thread, 'start', start)
    with pytest.raises(LinkThreadError, match="the label: can't start new thread for the link"):
        link.start()
    link.stop()
    # There may be fewer if a thread of an earlier test has ended meanwhile.
    wait_for_resources(*before)


# The end: from any thread, at any moment, and with nothing left open (fixture "run")

@pytest.mark.parametrize('url', [
    URL, 'udpin://127.0.0.1:{port}', 'udpout://127.0.0.1:9', 'tcpin://127.0.0.1:{port}',
    'tcp://127.0.0.1:{port}', 'serial:///dev/illuminator_ros_has_no_such_device:57600'])
def test_link_ends_open_or_not_and_tells_so(run: Run, url: str) -> None:
    url = url.format(port=free_port(socket.SOCK_STREAM))
    run(LiveLink(url)).stop()
    link = run(LiveLink(url))
    link.events.wait_for(lambda event: True)
    threads = [threading.Thread(target=link.stop) for _ in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(PATIENCE)
    link.link.start()
    state = link.link.snapshot(link.link.clock())
    assert (link.link.is_running(), state.is_open, state.reason) == (False, False, 'stopped')


def test_link_ends_in_its_own_thread_and_in_a_listener(run: Run) -> None:
    links: Log[LiveLink] = Log()
    one = run(LiveLink(URL))
    other = run(LiveLink(
        URL, on_event=lambda event: links.wait_for(lambda link: True).link.stop()))
    one.ask(lambda now: one.link.stop())
    links.append(other)
    eventually(lambda: not one.link.is_running() and not other.link.is_running())


@pytest.mark.parametrize(('module', 'name', 'url', 'after'), [
    # A name server or a host that does not answer takes long, so the channel opens late.
    (socket, 'getaddrinfo', 'udpout://127.0.0.1:9', False),
    (tcp, '_connect', 'tcp://127.0.0.1:{port}', False),
    (connector_module, 'open_channel', 'udpin://127.0.0.1:{port}', True)])
def test_link_ends_while_it_opens_and_closes_what_opens_late(
        run: Run, monkeypatch: pytest.MonkeyPatch, module: Any, name: str, url: str,
        after: bool) -> None:
    begun, go_on, genuine = threading.Event(), threading.Event(), getattr(module, name)

    def wait() -> None:
        begun.set()
        go_on.wait(PATIENCE)

    def slow(*arguments: Any, **named: Any) -> Any:
        if not after:
            wait()
        result = genuine(*arguments, **named)
        if after:
            wait()
        return result

    monkeypatch.setattr(module, name, slow)
    link = run(LiveLink(url.format(port=free_port())))
    assert begun.wait(PATIENCE)
    link.stop()
    assert not link.link.is_running()
    go_on.set()
