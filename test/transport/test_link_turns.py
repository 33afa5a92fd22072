# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The turns of a link's thread: no number of calls and messages delays a deadline."""

from __future__ import annotations

from collections.abc import Callable
import selectors
import threading
from typing import Any

from illuminator_ros.mavlink import link_thread
from illuminator_ros.mavlink.link_thread import (
    FaultLog,
    LinkThread,
    MAX_CALLS,
    STALL_TIME,
    TURN_TIME,
)
from illuminator_ros.mavlink.messages import Address, Message
import pytest
from support.frames import heartbeat_frame
from support.live_link import LiveLink, Talker
from support.simulated_link import SimulatedLink
from support.waiting import eventually, PATIENCE

# s that a call or a message takes, and between deadlines.
STEP, PERIOD = 0.4 * TURN_TIME, 0.5 * TURN_TIME


class Busy(Talker):
    """
    An endpoint with a deadline in each period, which a message takes some time to handle.

    :ivar latest: the longest delay of a deadline, s.
    :ivar done: the numbers of messages and calls in the order in which they were handled.
    """

    def __init__(self) -> None:
        super().__init__()
        self.due = self.latest = 0.0
        self.done: list[int] = []
        self.link = SimulatedLink(self, lambda data, peer: None, now=0.0)
        self.schedule.at(self.poll, self.due)

    def act(self, number: int) -> None:
        """Handle a message or a call."""
        self.link.now += STEP
        self.link.until = self.link.now
        self.done.append(number)

    def call(self, number: int) -> Callable[[float], None]:
        """Return a call of the link."""
        return lambda now: self.act(number)

    def receive(self, source: Address, message: Message, now: float) -> None:
        self.act(source.component)

    def poll(self, now: float) -> None:
        self.latest = max(self.latest, now - self.due)
        self.due = now + PERIOD
        self.schedule.at(self.poll, self.due)

    def run(self) -> None:
        """Run turns until nothing waits."""
        before = -1
        while len(self.done) > before:
            before = len(self.done)
            self.link.ask(lambda now: None)


# A turn may begin a message and then a call when its time is nearly over.
LATEST = TURN_TIME + 2 * STEP + PERIOD


def test_deadlines_are_met_between_any_number_of_calls_which_stay_in_order() -> None:
    busy = Busy()
    for number in range(100):
        busy.link.call(busy.call(number))

    busy.run()

    assert busy.done == [*range(100)]
    assert busy.latest <= LATEST


@pytest.mark.parametrize('together', [True, False])
def test_deadlines_are_met_between_messages_that_came_together(together: bool) -> None:
    """They come in one datagram, or in one of each sender."""
    busy = Busy()
    frames = [heartbeat_frame(Address(1, number)) for number in range(1, 101)]
    busy.link.call(busy.call(200))

    busy.link.receive(*([(b''.join(frames), ('127.0.0.1', 1))] if together else [
        (frame, ('127.0.0.1', number % 20 + 1)) for number, frame in enumerate(frames)]))
    busy.run()

    assert [number for number in busy.done if number != 200] == [*range(1, 101)]
    assert busy.latest <= LATEST


def test_urgent_call_is_made_before_those_that_wait() -> None:
    busy = Busy()
    for number in range(100):
        busy.link.call(busy.call(number))
    busy.link.call_first(busy.call(200))

    busy.run()

    assert busy.done == [200, *range(100)]


def test_other_thread_with_many_calls_waits_for_the_link(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(link_thread, 'ROOM_TIMEOUT', PATIENCE)
    live, is_held, may_go_on = LiveLink('memory://busy'), threading.Event(), threading.Event()
    made: list[int] = []
    waiting: list[int] = []

    def hold(now: float) -> None:
        is_held.set()
        may_go_on.wait(PATIENCE)

    def count(now: float) -> None:
        waiting.append(len(made) - len(waiting))

    def make_calls() -> None:
        for number in range(100):
            live.link.call(count)
            made.append(number)

    # No other call waits from then on.
    live.wait_open()
    live.link.call(hold)
    assert is_held.wait(PATIENCE)
    caller = threading.Thread(target=make_calls)
    caller.start()
    eventually(lambda: len(made) >= MAX_CALLS)
    may_go_on.set()
    caller.join(PATIENCE)
    eventually(lambda: len(waiting) == 100)
    live.stop()

    assert max(waiting) <= MAX_CALLS + 1


@pytest.mark.parametrize(('pause', 'expected'), [
    (STALL_TIME, ['call']), (STALL_TIME + 5.0, [7.0, 'call'])], ids=['busy', 'stopped'])
def test_a_stop_of_the_process_is_noted_before_the_calls_that_waited_meanwhile(
    pause: float, expected: list[object],
) -> None:
    now, pauses, order = [1000.0], list[float](), list[object]()

    class Selector(selectors.SelectSelector):

        def select(self, timeout: float | None = None) -> list[tuple[selectors.SelectorKey, int]]:
            now[0] += pauses.pop() if pauses else 0.0
            return super().select(0)

    def clock() -> float:
        return now[0]

    thread = LinkThread(
        lambda: now[0] + 1.0, lambda: None, FaultLog(clock), clock, Selector(),
        stalled=lambda seconds: order.append(round(seconds, 6)), monotonic=clock)
    thread.run_once()
    thread.call(lambda at: order.append('call'))
    pauses.append(pause)
    thread.run_once()
    assert order == expected
    thread.stop(0.0)


def test_a_line_that_is_always_ready_ends_the_turn_and_keeps_no_other_one_waiting_for_ever(
) -> None:
    now, served = [1000.0], list[int]()

    def serve(handle: Any, events: int) -> None:
        now[0] += 2 * TURN_TIME
        served.append(handle)

    class Selector(selectors.SelectSelector):

        def select(self, timeout: float | None = None) -> list[tuple[selectors.SelectorKey, int]]:
            return [(selectors.SelectorKey(one, one, 1, serve), 1) for one in range(3)]

    def clock() -> float:
        return now[0]

    thread = LinkThread(
        lambda: now[0], lambda: None, FaultLog(clock), clock, Selector(), monotonic=clock)
    for turn in range(100):
        thread.run_once()
        assert len(served) == turn + 1
    thread.stop(0.0)
    assert set(served) == {0, 1, 2}
