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

"""Turns of a link: one after the other, in its thread or in a caller's thread."""

from __future__ import annotations

from collections.abc import Callable
import selectors
import threading
from typing import Any

from illuminator_ros.mavlink.command_sender import MIN_TIMEOUT
from illuminator_ros.mavlink.link import CALLER_BYTES
from illuminator_ros.mavlink.messages import heartbeat
import pytest
from support.frames import heartbeat_frame
from support.live_link import BRIDGE, LiveLink, Run, Talker
from support.open_channel import Open
from support.ports import free_port
from support.simulated_link import SimulatedLink
from support.waiting import eventually, Log, PATIENCE

URL = 'memory://link'
PEER = ('127.0.0.1', 14550)


class Waiting(selectors.DefaultSelector):
    """
    A selector that reports when it waits.

    :ivar begins: set when a wait begins that may take time.
    """

    def __init__(self) -> None:
        super().__init__()
        self.begins = threading.Event()

    def select(self, timeout: float | None = None) -> Any:
        if timeout != 0:
            self.begins.set()
        return super().select(timeout)


@pytest.fixture
def talker() -> Talker:
    """Return the endpoint of the link."""
    return Talker()


@pytest.fixture
def link(talker: Talker) -> SimulatedLink:
    """Return a link that has heard a peer."""
    link = SimulatedLink(talker, lambda data, peer: None)
    link.receive((heartbeat_frame(), PEER))
    link.run(0.01)
    link.is_woken()
    return link


def take_turn(
    link: LiveLink, selector: Waiting, function: Callable[[float], None],
    takers: Log[threading.Thread], is_done: Callable[[], bool] | None = None,
) -> None:
    """Take a turn in this thread, which the function then adds to the takers."""
    # The link's thread takes a turn each 0.25 s, since no peer answers, and may do so now.
    for _ in range(20):
        selector.begins.clear()
        assert selector.begins.wait(PATIENCE)
        link.link.run_turn(function, is_done)
        if threading.current_thread() in takers:
            return
    pytest.fail('each turn was left to the thread of the link')


def ask(
    link: LiveLink, selector: Waiting, send: Callable[[], None], *, frames: int = 1,
    tries: int = 20,
) -> None:
    """
    Send in turns of this thread, until it has received in one of them.

    On a busy machine a turn may end before the frames arrive.

    :param send: sends a number of frames, which are heard before the next try.
    """
    takers: Log[threading.Thread] = Log()
    caller, receivers = threading.current_thread(), link.endpoint.receivers

    def take(now: float) -> None:
        takers.append(threading.current_thread())
        send()

    for _ in range(tries):
        take_turn(link, selector, take, takers, lambda: caller in receivers)
        link.endpoint.wait_heard(frames * len(takers))
        if caller in receivers:
            break


def test_caller_takes_the_turn_and_sends_while_the_thread_waits(run: Run, channel: Open) -> None:
    other, selector = channel(URL), Waiting()
    link = run(LiveLink(URL, selector=selector))
    link.wait_open()
    takers: Log[threading.Thread] = Log()

    def take(now: float) -> None:
        message = heartbeat(18)
        message.custom_mode = 0x12345678
        link.endpoint.outgoing.append((BRIDGE, message))
        takers.append(threading.current_thread())

    take_turn(link, selector, take, takers)
    data = b''
    while b'\x78\x56\x34\x12' not in data:
        data += b''.join(piece for _, piece in other.receive())


def test_caller_that_waits_receives_the_answer_in_its_turn(run: Run, channel: Open) -> None:
    other, selector = channel(URL), Waiting()
    link = run(LiveLink(URL, selector=selector))
    link.wait_open()
    caller, receivers = threading.current_thread(), link.endpoint.receivers
    ask(link, selector, lambda: other.broadcast(heartbeat_frame()))
    assert caller in receivers
    # The caller has received the frame that woke the thread; the next frame is another one.
    count = len(receivers) + 1
    other.broadcast(heartbeat_frame(sequence=1))
    link.endpoint.wait_heard(count)
    assert list(receivers)[-1] is not caller


@pytest.mark.parametrize('is_udp', [False, True])
def test_caller_receives_no_more_than_it_waits_for(
        run: Run, channel: Open, is_udp: bool) -> None:
    url, selector, port = URL, Waiting(), free_port()
    if is_udp:
        url = f'udpin://127.0.0.1:{port}'
    link = run(LiveLink(url, selector=selector))
    link.wait_open()
    others = [channel(f'udpout://127.0.0.1:{port}' if is_udp else URL) for _ in range(2)]

    def send() -> None:
        for sequence in range(10):
            for other in others:
                other.broadcast(heartbeat_frame(sequence=sequence))

    ask(link, selector, send, frames=20)
    assert list(link.endpoint.receivers).count(threading.current_thread()) == 1


@pytest.mark.parametrize(('noise', 'by_caller'), [(100, True), (CALLER_BYTES, False)])
def test_caller_leaves_the_decoding_of_many_bytes_to_the_thread(
        run: Run, channel: Open, noise: int, by_caller: bool) -> None:
    other, selector = channel(URL), Waiting()
    link = run(LiveLink(URL, selector=selector))
    link.wait_open()
    ask(link, selector, lambda: other.broadcast(bytes(noise) + heartbeat_frame()),
        tries=20 if by_caller else 1)
    assert (threading.current_thread() in link.endpoint.receivers) is by_caller


def test_caller_that_gets_no_answer_leaves_the_link_to_its_thread(
        run: Run, channel: Open) -> None:
    other, selector = channel(URL), Waiting()
    link = run(LiveLink(URL, selector=selector))
    link.wait_open()
    callers: Log[threading.Thread] = Log()
    take_turn(link, selector, lambda now: callers.append(threading.current_thread()), callers,
              lambda: False)
    other.broadcast(heartbeat_frame())
    link.endpoint.wait_heard()


def test_turn_within_a_turn_is_left_to_the_thread(link: SimulatedLink) -> None:
    done: list[str] = []

    def outer(now: float) -> None:
        link.run_turn(lambda now: done.append('inner'))
        done.append('outer')

    link.meanwhile.extend((lambda: link.run_turn(outer), lambda: done.append('thread waits')))
    link.run(0.01)
    assert done == ['outer', 'thread waits', 'inner']


def test_turn_of_a_caller_does_not_overtake_a_call(link: SimulatedLink) -> None:
    done: list[str] = []
    link.meanwhile.extend((lambda: link.call(lambda now: done.append('call')),
                           lambda: link.run_turn(lambda now: done.append('turn'))))
    link.run(0.01)
    assert done == ['call', 'turn']


# A sent command waits for MIN_TIMEOUT at least, so a turn of its caller does not wake the thread.
@pytest.mark.parametrize(('ahead', 'wakes'), [
    (0.001, True), (MIN_TIMEOUT, False), (1000.0, False)])
def test_turn_of_a_caller_wakes_the_thread_for_an_earlier_deadline_only(
        link: SimulatedLink, talker: Talker, ahead: float, wakes: bool) -> None:
    found: list[bool] = []

    def plan(now: float) -> None:
        talker.heartbeat.due = now + ahead

    link.meanwhile.extend((lambda: link.run_turn(plan), lambda: found.append(link.is_woken())))
    link.run(0.01)
    assert found == [wakes]


def test_frames_of_a_channel_that_a_caller_has_lost_are_not_read(
        link: SimulatedLink, talker: Talker, monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*arguments: Any) -> None:
        raise OSError('no such device')

    def send(now: float) -> None:
        talker.heartbeat.send(now)

    monkeypatch.setattr(link.udp, 'send', fail)
    link.meanwhile.append(lambda: link.run_turn(send))
    heard = len(talker.heard)
    link.socket.inbox.append((heartbeat_frame(sequence=1), PEER))
    link.run(0.001)
    assert (link.state().is_open, len(talker.heard)) == (False, heard)


def test_data_that_a_caller_has_received_are_not_read_again(
        link: SimulatedLink, talker: Talker, monkeypatch: pytest.MonkeyPatch) -> None:
    def read(size: int) -> Any:
        # A serial port without data reads as one whose device has gone.
        if not link.socket.inbox:
            raise OSError('no such device')
        return link.socket.inbox.popleft()

    monkeypatch.setattr(link.socket, 'recvfrom', read)
    heard = len(talker.heard)
    link.meanwhile.append(lambda: link.run_turn(
        lambda now: None, lambda: len(talker.heard) > heard))
    link.socket.inbox.append((heartbeat_frame(sequence=1), PEER))
    link.run(0.001)
    assert (link.state().is_open, len(talker.heard)) == (True, heard + 1)


def test_frames_that_came_while_the_process_was_stopped_precede_the_deadlines(
        link: SimulatedLink, talker: Talker) -> None:
    heard = len(talker.heard)
    heard_at_poll: list[int] = []

    def stop() -> None:
        link.now = link.until = link.now + 10.0
        link.socket.inbox.append((heartbeat_frame(sequence=1), PEER))

    def poll(now: float) -> None:
        heard_at_poll.append(len(talker.heard))

    talker.poll = poll  # type: ignore[method-assign]
    link.meanwhile.append(stop)
    link.run(0.01)
    assert heard_at_poll == [heard + 1]


def test_fault_in_the_turn_of_a_caller_is_logged_and_ends_neither_caller_nor_link(
        run: Run, channel: Open, caplog: pytest.LogCaptureFixture) -> None:
    channel(URL)
    selector = Waiting()
    link = run(LiveLink(URL, selector=selector))
    link.wait_open()
    deadlines: Log[threading.Thread] = Log()
    genuine = link.endpoint.next_deadline

    def next_deadline() -> float:
        deadlines.append(threading.current_thread())
        if threading.current_thread() is threading.main_thread():
            raise ValueError('a fault of a payload')
        return genuine()

    link.endpoint.next_deadline = next_deadline  # type: ignore[method-assign]
    take_turn(link, selector, lambda now: None, deadlines)
    assert link.ask(lambda now: 'goes on') == 'goes on'
    assert 'internal error in the link' in caplog.text


def test_link_ends_in_the_turn_of_a_caller_which_does_not_wait_for_the_thread(run: Run) -> None:
    selector = Waiting()
    link = run(LiveLink(URL, selector=selector))
    link.wait_open()
    waited: Log[float] = Log()

    def stop(now: float) -> None:
        link.link.stop(PATIENCE)
        waited.append(link.link.clock() - now)

    selector.begins.clear()
    assert selector.begins.wait(PATIENCE)
    link.link.run_turn(stop)
    assert waited.wait_for(lambda seconds: True) < PATIENCE
    eventually(lambda: not link.link.is_running())


def test_caller_takes_no_turn_of_a_link_that_has_ended(run: Run) -> None:
    link = run(LiveLink(URL))
    link.wait_open()
    link.stop()
    taken: list[float] = []
    link.link.run_turn(taken.append)
    assert not taken
