# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Frames of others on a slow line: which wait, in which order they go, and which are dropped."""

from __future__ import annotations

from collections import Counter
import math

from hypothesis import given
from hypothesis import strategies as st
from illuminator_ros.mavlink.dialect import mavlink
from illuminator_ros.mavlink.forwarding.forward_queue import (
    ForwardQueue,
    MAX_AGES,
    MAX_DELAY,
    MAX_QUEUED,
    MIN_QUEUED,
)
from illuminator_ros.mavlink.frame import Frame
from illuminator_ros.mavlink.message_traits import Priority, traits_of
from illuminator_ros.mavlink.messages import Address
import pytest
from support.frames import LIGHT

ACK, ATTITUDE, BATTERY, COMMAND, HEARTBEAT, PARAM, SERVO = (
    getattr(mavlink, f'MAVLINK_MSG_ID_{name}') for name in (
        'COMMAND_ACK', 'ATTITUDE', 'BATTERY_STATUS', 'COMMAND_LONG', 'HEARTBEAT', 'PARAM_VALUE',
        'SERVO_OUTPUT_RAW'))


def frame(message_id: int, name: str, source: Address = LIGHT, payload: bytes = b'') -> Frame:
    """Return a frame whose bytes are a name, for the queue does not read them."""
    return Frame(2, 0, source, message_id, payload, None, name.encode())


def taken(queue: ForwardQueue, now: float = 0.0) -> list[str]:
    """Return the names of all frames that the queue still sends, in order."""
    names = []
    while data := queue.pop(now):
        names.append(data.decode().strip())
    assert not queue
    return names


def test_commands_come_first_and_others_alternate_each_in_its_order() -> None:
    queue = ForwardQueue(Counter())
    for message_id, name in ((ATTITUDE, 'attitude'), (PARAM, 'param 1'), (SERVO, 'servo'),
                             (PARAM, 'param 2'), (PARAM, 'param 3'), (COMMAND, 'command'),
                             (HEARTBEAT, 'heartbeat'), (ACK, 'ack')):
        queue.put(frame(message_id, name), 0.0)
    names = taken(queue)
    assert names[:3] == ['command', 'heartbeat', 'ack']
    assert [name for name in names if 'param' in name] == ['param 1', 'param 2', 'param 3']
    assert set(names[3:5]) == {'attitude', 'param 1'}
    assert set(names[5:7]) == {'servo', 'param 2'}


def test_the_newest_telemetry_of_each_sender_and_instance_replaces_older_in_place() -> None:
    dropped = Counter[int]()
    queue = ForwardQueue(dropped)
    other = Address(2, 1)
    instance = traits_of(BATTERY).instance
    first, second = (bytes(instance.start) + number for number in (b'\1', b'\2'))
    for message_id, name, source, payload in (
            (ATTITUDE, 'old', LIGHT, b''), (ATTITUDE, 'other', other, b''),
            (BATTERY, 'battery 1', LIGHT, first), (BATTERY, 'battery 2', LIGHT, second),
            (ATTITUDE, 'new', LIGHT, b''), (BATTERY, 'battery 2 new', LIGHT, second)):
        queue.put(frame(message_id, name, source, payload), 0.0)
    assert taken(queue) == ['new', 'other', 'battery 1', 'battery 2 new']
    assert dropped == {ATTITUDE: 1, BATTERY: 1}


def test_a_full_queue_drops_telemetry_then_others_then_commands_the_oldest_first() -> None:
    dropped = Counter[int]()
    queue = ForwardQueue(dropped, rate=0.0)
    size = MIN_QUEUED // 4
    kinds = [PARAM, COMMAND, SERVO, ATTITUDE]
    for message_id in kinds:
        queue.put(frame(message_id, f'{message_id} first'.ljust(size)), 0.0)
    for number in range(5):
        queue.put(frame(COMMAND, f'{COMMAND} {number}'.ljust(size)), 0.0)
        assert queue.size <= MIN_QUEUED
    assert taken(queue) == [f'{COMMAND} {number}' for number in range(1, 5)]
    assert dropped == {SERVO: 1, ATTITUDE: 1, PARAM: 1, COMMAND: 2}
    queue.put(frame(PARAM, 'param'.ljust(MIN_QUEUED)), 0.0)
    queue.put(frame(ATTITUDE, 'attitude'), 0.0)
    assert taken(queue) == ['param']


@pytest.mark.parametrize(('message_id', 'age'), [
    (ATTITUDE, MAX_AGES[Priority.NEWEST]), (PARAM, MAX_AGES[Priority.KEPT]),
    (COMMAND, MAX_AGES[Priority.URGENT])])
def test_a_frame_that_has_waited_too_long_is_dropped(message_id: int, age: float) -> None:
    dropped = Counter[int]()
    queue = ForwardQueue(dropped)
    for now, expected in ((age - 0.01, ['name']), (age, [])):
        queue.put(frame(message_id, 'name'), 0.0)
        assert taken(queue, now) == expected
    assert dropped == {message_id: 1}


@pytest.mark.parametrize(('rate', 'capacity'), [
    (960.0, MIN_QUEUED), (5760.0, int(MAX_DELAY * 5760)), (math.inf, MAX_QUEUED)])
def test_a_line_holds_what_it_sends_in_half_a_second(rate: float, capacity: int) -> None:
    queue = ForwardQueue(Counter(), rate)
    for number in range(400):
        queue.put(frame(PARAM, f'{number}'.ljust(60)), 0.0)
    assert capacity - 60 < queue.size <= capacity


kinds = st.sampled_from([ACK, ATTITUDE, BATTERY, COMMAND, HEARTBEAT, PARAM, SERVO])
sources = st.sampled_from([LIGHT, Address(2, 1)])


@given(st.lists(st.tuples(st.booleans(), kinds, sources, st.integers(12, 280))))
def test_each_frame_is_taken_or_counted_as_dropped_and_the_size_is_right(
        steps: list[tuple[bool, int, Address, int]]) -> None:
    dropped = Counter[int]()
    queue = ForwardQueue(dropped, rate=0.0)
    put, got = Counter[int](), Counter[int]()
    for number, (takes, message_id, source, size) in enumerate(steps):
        if takes:
            if data := queue.pop(0.05 * number):
                got[int(data.split()[0])] += 1
        else:
            queue.put(frame(message_id, f'{message_id} {number}'.ljust(size), source),
                      0.05 * number)
            put[message_id] += 1
        assert queue.size <= MIN_QUEUED
    got.update(int(name.split()[0]) for name in taken(queue, 0.05 * len(steps)))
    assert got + dropped == put
    assert queue.size == 0
