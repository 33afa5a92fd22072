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

"""A link's state, as other threads read it."""

from __future__ import annotations

from collections.abc import Callable
import threading

from illuminator_ros.mavlink import connector as opener
from illuminator_ros.mavlink.link_state import LinkState
from illuminator_ros.mavlink.messages import Address
import pytest
from support.frames import LIGHT
from support.heartbeats import heartbeat_frame
from support.live_link import Jump, LiveLink
from support.open_channel import bound_socket, listening_socket, OpenChannel
from support.ports import free_port

Run = Callable[[LiveLink], LiveLink]
# s; so much more than this takes that it tells times apart.
STEP = 1000.0


def test_a_link_that_cannot_be_opened_says_why(run: Run) -> None:
    with bound_socket() as taken:
        port = taken.getsockname()[1]
        link = run(LiveLink(f'udpin://127.0.0.1:{port}'))
        link.wait_lost()
        state = link.state()
    assert (state.is_open, state.name, state.openings) == (
        False, f'udpin://127.0.0.1:{port}', 0)
    assert state.reason == f'cannot listen on 127.0.0.1:{port}: Address already in use'


def test_an_open_link_says_what_it_is(run: Run) -> None:
    port = free_port()
    link = run(LiveLink(f'udpin://127.0.0.1:{port}'))
    link.wait_open()
    state = link.state()
    assert (state.is_open, state.name, state.reason, state.openings) == (
        True, f'udp 127.0.0.1:{port}', '', 1)


def test_it_says_since_when_it_is_open_or_not(run: Run) -> None:
    clock = Jump()
    begun = clock()
    server = listening_socket()
    port = server.getsockname()[1]
    server.close()
    link = run(LiveLink(f'tcp://127.0.0.1:{port}', clock=clock))
    link.wait_lost()
    assert link.state().since < begun + STEP

    clock.ahead += STEP
    with listening_socket(port=port) as server:
        connection, _ = server.accept()
        connection.sendall(heartbeat_frame())
        link.wait_open()
        assert begun + STEP <= link.state().since < begun + 2 * STEP

        clock.ahead += STEP
        # A channel that opens again at once would restart it.
        server.close()
        connection.close()
        link.wait_lost(2)
        assert link.state().since >= begun + 2 * STEP


def test_frames_and_bytes_are_counted_both_ways(
    run: Run, channel: Callable[[str], OpenChannel],
) -> None:
    other = channel('memory://state')
    link = run(LiveLink('memory://state'))
    sent = other.receive()[0][1]
    other.broadcast(heartbeat_frame() + b'xyz')
    link.endpoint.wait_for(LIGHT)
    traffic = link.state().traffic
    assert (traffic.frames_received, traffic.bytes_received) == (1, len(heartbeat_frame()) + 3)
    assert traffic.frames_sent >= 1
    assert traffic.bytes_sent == traffic.frames_sent * len(sent)


def fill(link: LiveLink) -> None:
    """Have a link send so much that not all of it finds room."""
    def send(now: float) -> None:
        for _ in range(10_000):
            link.endpoint.heartbeat.send(now, link.endpoint.outgoing)

    while not link.ask(lambda now: link.link._channel.dropped):
        link.ask(send)


def test_what_does_not_go_out_is_counted(
    run: Run, channel: Callable[[str], OpenChannel],
) -> None:
    channel('memory://state')
    link = run(LiveLink('memory://state'))
    link.wait_open()
    fill(link)
    assert link.ask(lambda now: link.link._channel.dropped == (
        link.link.snapshot(now).traffic.frames_dropped))


def test_a_lost_link_leads_nowhere_and_awaits_nothing(run: Run) -> None:
    with listening_socket() as server:
        link = run(LiveLink(f'tcp://127.0.0.1:{server.getsockname()[1]}'))
        connection = server.accept()[0]
    with connection:
        connection.sendall(heartbeat_frame() + heartbeat_frame()[:9])
        link.endpoint.wait_for(LIGHT)
        assert link.state().peers == 1
    link.wait_lost()
    assert link.state().peers == 0
    assert link.ask(lambda now: link.link._receiver.next_deadline()) == float('inf')


def test_drops_are_counted_over_all_openings(run: Run) -> None:
    with listening_socket() as server:
        link = run(LiveLink(f'tcp://127.0.0.1:{server.getsockname()[1]}'))
        counts = []
        for _ in range(2):
            with server.accept()[0] as connection:
                connection.sendall(heartbeat_frame())
                link.endpoint.heard.wait_for(lambda heard: True, count=len(counts) + 1)
                fill(link)
                counts.append(link.state().traffic.frames_dropped)
            link.wait_lost(len(counts))
        assert 0 < counts[0] < counts[1]


def test_what_was_sent_while_the_link_was_lost_does_not_count_as_lost(run: Run) -> None:
    with listening_socket() as server:
        link = run(LiveLink(f'tcp://127.0.0.1:{server.getsockname()[1]}'))
        for count, sequence in enumerate((10, 100), 1):
            with server.accept()[0] as connection:
                connection.sendall(heartbeat_frame(sequence=sequence))
                link.endpoint.heard.wait_for(lambda heard: True, count=count)
            link.wait_lost(count)
    counter = link.state().traffic.sources[LIGHT]
    assert (counter.received, counter.lost) == (2, 0)


def test_reading_it_while_everything_changes_is_no_error(
    run: Run, monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(opener, 'FIRST_PAUSE', 0.001)
    monkeypatch.setattr(opener, 'LAST_PAUSE', 0.001)
    states: list[LinkState] = []
    errors: list[Exception] = []
    ended = threading.Event()
    server = listening_socket()
    link = run(LiveLink(f'tcp://127.0.0.1:{server.getsockname()[1]}'))

    def read() -> None:
        while not ended.is_set():
            try:
                states.append(link.link.state())
                ended.wait(0.0002)
            except Exception as error:
                errors.append(error)

    readers = [threading.Thread(target=read) for _ in range(2)]
    for reader in readers:
        reader.start()
    with server:
        for count in range(10):
            with server.accept()[0] as connection:
                for number in range(20):
                    connection.sendall(heartbeat_frame(Address(1 + count, 1 + number)))
                link.endpoint.wait_for(Address(1 + count, 20))
    ended.set()
    for reader in readers:
        reader.join()
    assert errors == []
    assert all(state.is_open is (state.reason == '') for state in states)
