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

"""Faults of ours in what a link calls: each is logged, and the link goes on."""

from __future__ import annotations

from collections.abc import Callable
import logging
import math
import threading
from typing import Any

from illuminator_ros.mavlink import connector as opener
from illuminator_ros.mavlink import link as link_module
from illuminator_ros.mavlink.link_state import LinkEvent, MAX_EVENTS
from illuminator_ros.mavlink.messages import heartbeat
import pytest
from support.frames import LIGHT
from support.heartbeats import heartbeat_frame
from support.live_link import BRIDGE, LiveLink, OPENER, Talker
from support.open_channel import listening_socket, OpenChannel
from support.waiting import Log

Run = Callable[[LiveLink], LiveLink]


NEVER_ENDING = 10_000


class Fault(Exception):
    """The fault that a test injects."""


class Faulty(Talker):
    """
    Fails in the method of this name, so often.

    :ivar failures: the calls that failed.
    """

    def __init__(self, method: str, times: int = 1) -> None:
        super().__init__()
        self.failures: Log[str] = Log()
        genuine = getattr(self, method)

        def fail(*arguments: Any) -> Any:
            if len(self.failures) < times:
                self.failures.append(method)
                raise Fault(method)
            return genuine(*arguments)

        setattr(self, method, fail)


@pytest.fixture(autouse=True)
def _all_logged(monkeypatch: pytest.MonkeyPatch) -> None:
    """Have every fault logged, not only one in a while."""
    monkeypatch.setattr(link_module, 'FAULT_LOG_INTERVAL', 0.0)


def faults(caplog: pytest.LogCaptureFixture) -> list[str]:
    """Return what was logged, checked to be faults of the test."""
    assert all(record.levelno == logging.ERROR for record in caplog.records)
    return [str(record.exc_info[1]) for record in caplog.records if record.exc_info]


@pytest.fixture
def other(channel: Callable[[str], OpenChannel]) -> OpenChannel:
    """Return the other side of the links here."""
    return channel('memory://faults')


@pytest.mark.parametrize('method', ['link_opened', 'receive', 'poll', 'next_deadline'])
def test_a_fault_of_the_endpoint_is_logged_and_the_link_goes_on(
    run: Run, other: OpenChannel, caplog: pytest.LogCaptureFixture, method: str,
) -> None:
    link = run(LiveLink('memory://faults', Faulty(method)))
    link.wait_open()
    other.broadcast(heartbeat_frame())
    link.endpoint.failures.wait_for(lambda one: True)
    other.broadcast(heartbeat_frame())
    assert link.endpoint.wait_for(LIGHT)
    assert faults(caplog) == [method]


def test_a_fault_while_a_link_is_lost_does_not_keep_it_lost(
    run: Run, caplog: pytest.LogCaptureFixture,
) -> None:
    with listening_socket() as server:
        url = f'tcp://127.0.0.1:{server.getsockname()[1]}'
        link = run(LiveLink(url, Faulty('link_closed')))
        with server.accept()[0] as connection:
            connection.sendall(heartbeat_frame())
            link.endpoint.wait_for(LIGHT)
        with server.accept()[0]:
            link.wait_open(2)
    assert faults(caplog) == ['link_closed']


@pytest.mark.parametrize('failing', [True, False], ids=['opening', 'loss'])
def test_a_fault_of_who_hears_the_events_does_not_keep_a_link_lost(
    run: Run, caplog: pytest.LogCaptureFixture, failing: bool,
) -> None:
    def fail(event: LinkEvent) -> None:
        if event.is_open is failing:
            raise Fault('event')

    with listening_socket() as server:
        url = f'tcp://127.0.0.1:{server.getsockname()[1]}'
        link = run(LiveLink(url, on_event=fail))
        for count in (1, 2):
            with server.accept()[0] as connection:
                connection.sendall(heartbeat_frame())
                link.endpoint.heard.wait_for(lambda heard: True, count=count)
                link.wait_open(count)
                assert len(link.endpoint.closings) == count - 1
    assert set(faults(caplog)) == {'event'}


def test_a_frame_that_makes_a_fault_takes_no_other_with_it(
    run: Run, other: OpenChannel, caplog: pytest.LogCaptureFixture,
) -> None:
    link = run(LiveLink('memory://faults', Faulty('receive')))
    link.wait_open()
    other.broadcast(heartbeat_frame(sequence=0) + heartbeat_frame(sequence=1))
    assert link.endpoint.wait_for(LIGHT)
    assert faults(caplog) == ['receive']


def test_a_call_that_makes_a_fault_holds_back_no_other(
    run: Run, caplog: pytest.LogCaptureFixture,
) -> None:
    link = run(LiveLink('memory://faults'))
    link.wait_open()
    turns: Log[int] = Log()

    def fail(now: float) -> None:
        turns.append(link.endpoint.turns)
        raise Fault('call')

    def both(now: float) -> None:
        link.link.call(fail)
        link.link.call(lambda now: turns.append(link.endpoint.turns))

    link.link.call(both)
    turns.wait_for(lambda one: True, count=2)
    assert turns[0] == turns[1]
    assert faults(caplog) == ['call']


def test_a_message_that_cannot_be_sent_takes_no_other_with_it(
    run: Run, other: OpenChannel, caplog: pytest.LogCaptureFixture,
) -> None:
    link = run(LiveLink('memory://faults'))
    link.wait_open()
    wrong, right = heartbeat(18), heartbeat(18)
    wrong.custom_mode = -1
    right.custom_mode = 0x12345678
    link.ask(lambda now: link.endpoint.outgoing.extend([(BRIDGE, wrong), (BRIDGE, right)]))
    data = b''
    while b'\x78\x56\x34\x12' not in data:
        data += b''.join(piece for _, piece in other.receive())
    assert len(caplog.records) == 1


class Restless(Faulty):
    """Has always something to do, and never gets it done."""

    def next_deadline(self) -> float:
        return -math.inf


@pytest.mark.parametrize('endpoint', [
    Restless('poll', times=NEVER_ENDING), Faulty('next_deadline', times=NEVER_ENDING)],
    ids=['poll', 'next_deadline'])
def test_a_lasting_fault_does_not_keep_a_processor_busy(
    run: Run, endpoint: Faulty, monkeypatch: pytest.MonkeyPatch,
) -> None:
    # So that a thread which does pause stands still, whatever time the machine takes.
    monkeypatch.setattr(link_module, 'FAULT_PAUSE', 3600.0)
    monkeypatch.setattr(link_module, 'IDLE', 3600.0)
    run(LiveLink('memory://faults', endpoint))
    endpoint.failures.wait_for(lambda one: True)
    before = len(endpoint.failures)
    threading.Event().wait(0.2)
    assert len(endpoint.failures) - before < 10


def test_a_lasting_fault_does_not_fill_the_log(
    run: Run, caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(link_module, 'FAULT_LOG_INTERVAL', 60.0)
    monkeypatch.setattr(link_module, 'FAULT_PAUSE', 0.001)
    endpoint = Restless('poll', times=NEVER_ENDING)
    run(LiveLink('memory://faults', endpoint))
    endpoint.failures.wait_for(lambda one: True, count=50)
    assert faults(caplog) == ['poll']


@pytest.mark.parametrize('reason', [PermissionError('no room'), Fault('store')])
def test_time_stamps_of_signing_that_cannot_be_stored_do_not_end_the_link(
    run: Run, other: OpenChannel, caplog: pytest.LogCaptureFixture, reason: Exception,
) -> None:
    class Store:

        def store(self, timestamp: int, *, last: bool = False) -> None:
            raise reason

    store: Any = Store()
    link = run(LiveLink('memory://faults', store=store))
    link.wait_open()
    other.broadcast(heartbeat_frame())
    assert link.endpoint.wait_for(LIGHT)
    link.stop()
    assert link.has_ended()
    assert caplog.records


def test_a_fault_while_opening_is_logged_and_tried_again(
    run: Run, caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch,
) -> None:
    genuine, tries = opener.open_channel, Log[int]()

    def open_second_time(url: Any) -> Any:
        tries.append(1)
        if len(tries) == 1:
            raise Fault('opening')
        return genuine(url)

    monkeypatch.setattr(opener, 'open_channel', open_second_time)
    run(LiveLink('memory://faults')).wait_open()
    assert faults(caplog) == ['opening']


def test_thread_that_cannot_be_started_is_tried_again(
        run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    # As with a limit on the number of processes.
    genuine, failures = threading.Thread.start, Log[str]()

    def start(thread: threading.Thread) -> None:
        if thread.name == OPENER and len(failures) < 2:
            failures.append(thread.name)
            raise RuntimeError("can't start new thread")
        genuine(thread)

    with listening_socket() as server:
        link = run(LiveLink(f'tcp://127.0.0.1:{server.getsockname()[1]}'))
        with server.accept()[0] as connection:
            connection.sendall(heartbeat_frame())
            link.endpoint.heard.wait_for(lambda heard: True)
            monkeypatch.setattr(threading.Thread, 'start', start)
        link.wait_lost()
        failures.wait_for(lambda name: True, count=2)
        server.accept()[0].close()


def test_server_that_answers_and_closes_is_reported_at_a_limited_rate(run: Run) -> None:
    with listening_socket() as server:
        link = run(LiveLink(f'tcp://127.0.0.1:{server.getsockname()[1]}'))
        for _ in range(MAX_EVENTS):
            with server.accept()[0] as connection:
                connection.sendall(heartbeat_frame())
        server.accept()[0].close()
        assert len(link.history()) <= MAX_EVENTS + 1


def test_frames_are_logged_in_a_line_each_at_debug_level_only(
        run: Run, other: OpenChannel, caplog: pytest.LogCaptureFixture) -> None:
    for level in (logging.INFO, logging.DEBUG):
        caplog.set_level(level, 'illuminator_ros')
        link = run(LiveLink('memory://faults'))
        link.wait_open()
        other.channel.send([heartbeat_frame()], (None,))
        link.endpoint.wait_for(LIGHT)
        link.stop()
        lines = [record.getMessage() for record in caplog.records]
        assert any(line.startswith('received from 1/243: Heartbeat(') for line in lines) == (
            level == logging.DEBUG)
    assert any(line.startswith('sent from 1/194: Heartbeat(') for line in lines)
