# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Streams on a slow line: the newest in time, the urgent first, the rest dropped and counted."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import nan as NAN
from typing import Any

from illuminator_ros.gimbal.messages import GimbalManagerSetAttitude
from illuminator_ros.mavlink.component import Endpoint
from illuminator_ros.mavlink.conflating_queue import ConflatingQueue, StreamGroup
from illuminator_ros.mavlink.dialect import decode
from illuminator_ros.mavlink.frame import Decoder
from illuminator_ros.mavlink.messages import Address, CommandLong, heartbeat, Message
from illuminator_ros.payload.messages import Attitude, GlobalPositionInt, SystemTime
from support.simulated_link import SimulatedLink

SOURCE = Address(1, 191)
# 57,600 baud, bytes/s.
RATE = 5760.0
GROUPS = ((GlobalPositionInt,), (Attitude, SystemTime))


def position(number: int) -> Message:
    return GlobalPositionInt(number, 0, 0, 0, 0, 0, 0, 0, 0)


def pair(number: int) -> tuple[Message, Message]:
    return Attitude(number, 0, 0, 0, 0, 0, 0), SystemTime(0, number)


def test_a_newer_message_replaces_its_whole_group_and_the_urgent_group_is_first() -> None:
    queue = ConflatingQueue(GROUPS)
    for message in (*pair(1), *pair(2), position(2), position(3)):
        assert queue.hold(SOURCE, message, 0.0)

    assert not queue.hold(SOURCE, heartbeat(18), 0.0)
    assert queue.dropped == 3
    assert [message for _, message in queue.pop(0.0)] == [position(3)]
    # The other group has its turn, though the urgent one has a message again.
    queue.hold(SOURCE, position(4), 0.0)
    assert [[message for _, message in queue.pop(0.0)] for _ in range(2)] == [
        [*pair(2)], [position(4)]]
    assert not queue


def test_a_pair_replaces_the_second_half_that_was_held_alone() -> None:
    queue = ConflatingQueue(GROUPS)
    for message in (pair(1)[1], *pair(2)):
        queue.hold(SOURCE, message, 0.0)

    assert [message for _, message in queue.pop(0.0)] == [*pair(2)]
    assert queue.dropped == 1


def rate(device_id: int, yaw: float, system: int = 1) -> Message:
    return GimbalManagerSetAttitude(system, 1, 0, device_id, [NAN] * 4, 0.0, 0.0, yaw)


def test_setpoints_replace_those_for_their_own_gimbal_only_and_gimbals_take_turns() -> None:
    queue = ConflatingQueue(((GimbalManagerSetAttitude,),))
    devices = [(1, 1), (2, 1), (1, 2)]
    found = []
    for turn in range(6):
        for device, system in devices:
            queue.hold(SOURCE, rate(device, turn, system), 0.0)
        [(_, sent)] = queue.pop(0.0)
        assert isinstance(sent, GimbalManagerSetAttitude)
        found.append((sent.gimbal_device_id, sent.target_system, sent.angular_velocity_z))

    assert found == [(*device, turn) for turn, device in enumerate(devices * 2)]


def test_a_command_follows_the_setpoints_for_its_target_on_a_busy_line() -> None:
    command = CommandLong(1, 1, 1000, 0, *[0.0] * 7)

    def make(number: int) -> list[Message]:
        return [rate(1, 1.0), rate(1, 0.0), command] if number == 20 else [rate(1, number)]

    classes = (GimbalManagerSetAttitude, CommandLong)
    _, sent, _ = run(RATE, 0.5, Stream(make, 0.005), groups=(classes[:1],), classes=classes)
    messages = [message for _, message in sent]

    before = messages[messages.index(command) - 1]
    assert isinstance(before, GimbalManagerSetAttitude)
    assert before.angular_velocity_z == 0.0


@dataclass
class Stream:
    """Sends a message, or several, again and again."""

    make: Any
    interval: float
    number: int = 0

    def due(self, start: float) -> float:
        return start + self.number * self.interval


class Sender(Endpoint):
    """Makes a pair each 5 ms, twice the capacity of the line, and 10 positions a second."""

    messages = ()
    streams: Sequence[StreamGroup] = GROUPS

    def __init__(self, start: float) -> None:
        super().__init__()
        self.start = start
        self.reported: list[tuple[float, Message]] = []
        self.due = [Stream(pair, 0.005), Stream(lambda number: [position(number)], 0.1)]

    def sent(self, message: Message, now: float) -> None:
        self.reported.append((now, message))

    def link_opened(self, now: float) -> None:
        self.outgoing.append((SOURCE, heartbeat(18)))
        self.schedule.by(self.poll, now)

    def receive(self, source: Address, message: Message, now: float) -> None:
        raise AssertionError(message)

    def poll(self, now: float) -> None:
        for stream in self.due:
            if now >= stream.due(self.start):
                self.outgoing.extend((SOURCE, one) for one in stream.make(stream.number))
                stream.number += 1
        self.schedule.at(self.poll, min(stream.due(self.start) for stream in self.due))


def run(
    rate: float, seconds: float, *streams: Stream,
    groups: Sequence[StreamGroup] = GROUPS,
    classes: Sequence[type[Message]] = (GlobalPositionInt, Attitude, SystemTime),
) -> tuple[SimulatedLink, list[tuple[float, Message]], int]:
    """Return what a link of a rate sends, when, and how many bytes."""
    sent: list[tuple[float, bytes]] = []
    sender = Sender(1000.0)
    sender.streams = groups
    sender.due = list(streams) or sender.due
    link = SimulatedLink(sender, lambda data, peer: sent.append((link.now, data)))
    link.udp.rate = rate
    link.udp.heard(('127.0.0.1', 14550), link.now)
    link.run(seconds)
    by_id = {cls.id: cls for cls in classes}
    return link, [
        (at, decode(by_id[frame.message_id], frame.payload))
        for at, data in sent for frame in Decoder().feed(data) if frame.message_id in by_id
    ], sum(len(data) for _, data in sent)


def test_on_a_slow_line_nothing_waits_and_whole_pairs_of_the_newest_are_sent() -> None:
    link, sent, size = run(RATE, 9.95)
    positions = [(at, one) for at, one in sent if isinstance(one, GlobalPositionInt)]
    others = [(at, one) for at, one in sent if not isinstance(one, GlobalPositionInt)]
    # A pair takes 8 ms of the line.
    late = [at - (1000.0 + one.time_boot_ms * 0.1) for at, one in positions]

    assert len(positions) == 100
    assert max(late) < 0.001
    assert 0.9 * RATE < size / 9.95 <= 1.01 * RATE
    for (at, one), (_, other) in zip(others[::2], others[1::2], strict=True):
        assert isinstance(one, Attitude)
        assert (one, other) == pair(one.time_boot_ms)
        assert at - (1000.0 + one.time_boot_ms * 0.005) < 0.006
    dropped = link.snapshot(link.now).traffic.frames_dropped
    # The newest pair may still wait.
    assert 2 * 1990 - 2 <= dropped + len(others) <= 2 * 1991


def test_positions_at_any_rate_leave_each_pair_its_turn_on_a_slow_line() -> None:
    _, sent, size = run(RATE, 10.0, Stream(pair, 0.05), Stream(lambda n: [position(n)], 0.002))

    assert len([one for _, one in sent if isinstance(one, Attitude)]) >= 199
    assert len([one for _, one in sent if isinstance(one, GlobalPositionInt)]) > 80
    assert size / 10.0 <= 1.01 * RATE


def test_messages_that_a_blocked_line_has_held_for_long_are_dropped_and_counted() -> None:
    # The heartbeats occupy the line for more than 1 s.
    link, sent, _ = run(
        200.0, 10.0, Stream(lambda number: [*[heartbeat(18)] * 10, position(number)], 1e9))

    assert sent == []
    assert isinstance(link.endpoint, Sender)
    assert link.endpoint.reported == []
    assert link.snapshot(link.now).traffic.frames_dropped == 1


def test_on_a_fast_link_each_message_is_sent() -> None:
    link, sent, _ = run(float('inf'), 1.0)
    assert len(sent) >= 2 * 200 + 10
    assert isinstance(link.endpoint, Sender)
    assert link.endpoint.reported == sent
    assert not link.snapshot(link.now).traffic.frames_dropped
