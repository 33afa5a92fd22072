# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""A component that receives commands: which it executes, and how it acknowledges."""

from __future__ import annotations

import math
from typing import Any

from illuminator_ros.mavlink import messages as mav
from illuminator_ros.mavlink.command_receiver import MAX_RESULTS, REPEAT_TIME
from illuminator_ros.mavlink.command_sender import CommandSender
from illuminator_ros.mavlink.component import Component, Payload
from illuminator_ros.mavlink.dialect import mavlink
from illuminator_ros.mavlink.messages import AnyCommand
import pytest

OURS, PILOT, OTHER = mav.Address(1, 193), mav.Address(255, 190), mav.Address(255, 191)
SUPPORTED = 1000


class Turner(Payload):
    """Executes one command, and sends a heartbeat for it."""

    messages = (mav.CommandLong, mav.CommandInt)

    def __init__(self, commands: CommandSender, supported: int, *results: int) -> None:
        self.commands = commands
        self.supported = supported
        self.results = list(results)
        self.executed: list[AnyCommand] = []

    def receive(self, source: mav.Address, message: mav.Message, now: float) -> None:
        raise AssertionError('commands are executed')

    def execute(
        self, source: mav.Address, command: AnyCommand, now: float,
    ) -> int | None:
        if command.command != self.supported:
            return None
        self.executed.append(command)
        self.commands.send(mav.heartbeat(26))
        return self.results.pop(0) if self.results else mavlink.MAV_RESULT_ACCEPTED


class Rig:
    """A component with two payloads, of which the second supports the command."""

    def __init__(self, *results: int) -> None:
        commands = CommandSender(OURS)
        self.turner = Turner(commands, SUPPORTED, *results)
        self.component = Component(commands, [Turner(commands, 1001), self.turner])

    def give(self, command: Any, *, source: mav.Address = PILOT, now: float = 1.0) -> list[Any]:
        """Return what the component sends when it receives a command."""
        self.component.receive(source, command, now)
        sent = [message for _, message in self.component.outgoing]
        self.component.outgoing.clear()
        return sent


def long(command: int = SUPPORTED, *, to: mav.Address = OURS, confirmation: int = 0,
         param1: float = math.nan) -> mav.CommandLong:
    return mav.CommandLong(*to, command, confirmation, param1, *(0.0,) * 6)


def whole(command: int = SUPPORTED, *, to: mav.Address = OURS) -> mav.CommandInt:
    return mav.CommandInt(*to, 0, command, 0, 0, *(0.0,) * 4, 0, 0, 0.0)


def ack(result: int, command: int = SUPPORTED) -> mav.CommandAck:
    return mav.CommandAck(command, result, 0, 0, *PILOT)


@pytest.mark.parametrize('make', [long, whole])
def test_a_command_is_acknowledged_before_the_messages_that_it_causes(make: Any) -> None:
    first, second = Rig(mavlink.MAV_RESULT_DENIED).give(make())

    assert first == ack(mavlink.MAV_RESULT_DENIED)
    assert isinstance(second, mav.Heartbeat)


@pytest.mark.parametrize(('to', 'command', 'result'), [
    (OURS, SUPPORTED, mavlink.MAV_RESULT_ACCEPTED),
    (mav.Address(1, 0), SUPPORTED, mavlink.MAV_RESULT_ACCEPTED),
    (mav.Address(0, 0), SUPPORTED, mavlink.MAV_RESULT_ACCEPTED),
    (OURS, 31000, mavlink.MAV_RESULT_UNSUPPORTED),
    (mav.Address(1, 0), 31000, None),
    (mav.Address(0, 0), 31000, None),
    (mav.Address(1, 1), SUPPORTED, None),
    (mav.Address(2, 193), SUPPORTED, None),
])
@pytest.mark.parametrize('make', [long, whole])
def test_a_command_is_answered_if_it_is_for_us(
        make: Any, to: mav.Address, command: int, result: int | None) -> None:
    rig = Rig()

    sent = rig.give(make(command, to=to))

    assert sent[:1] == ([] if result is None else [ack(result, command)])
    assert bool(rig.turner.executed) == (result == mavlink.MAV_RESULT_ACCEPTED)


@pytest.mark.parametrize(('to', 'answers'), [
    (OURS, 1), (mav.Address(1, 0), 0), (mav.Address(0, 194), 0), (mav.Address(0, 0), 0),
    (mav.Address(1, 1), 0)])
@pytest.mark.parametrize('make', [long, whole])
def test_a_component_whose_payloads_take_no_commands_tells_their_sender_that(
        make: Any, to: mav.Address, answers: int) -> None:
    component = Component(CommandSender(OURS), [])
    command = make(to=to)
    assert type(command) in component.messages

    component.receive(PILOT, command, 1.0)

    assert list(component.outgoing) == [
        (OURS, ack(mavlink.MAV_RESULT_UNSUPPORTED))] * answers


# The second command that comes after long(), and whether it is executed.
SECOND = {
    'a repetition': (long(confirmation=1), PILOT, 1.0, False),
    'a late repetition': (long(confirmation=1), PILOT, REPEAT_TIME + 0.1, True),
    'the same command, new': (long(), PILOT, 1.0, True),
    'other params': (long(confirmation=1, param1=1.0), PILOT, 1.0, True),
    'another sender': (long(confirmation=1), OTHER, 1.0, True),
}


@pytest.mark.parametrize('case', SECOND)
def test_a_repeated_command_is_acknowledged_again_but_not_executed_again(case: str) -> None:
    command, source, pause, executed = SECOND[case]
    rig = Rig(mavlink.MAV_RESULT_DENIED)
    rig.give(long())

    [answer, *_] = rig.give(command, source=source, now=1.0 + pause)

    assert len(rig.turner.executed) == 1 + executed
    assert answer.result == (mavlink.MAV_RESULT_ACCEPTED if executed
                             else mavlink.MAV_RESULT_DENIED)


def test_a_command_that_was_rejected_temporarily_is_executed_when_it_is_repeated() -> None:
    rig = Rig(mavlink.MAV_RESULT_TEMPORARILY_REJECTED)
    rig.give(long())

    [answer, _] = rig.give(long(confirmation=1))

    assert answer == ack(mavlink.MAV_RESULT_ACCEPTED)


def test_only_so_many_results_are_remembered() -> None:
    rig = Rig()
    rig.give(long())
    for number in range(MAX_RESULTS):
        rig.give(long(), source=mav.Address(2 + number // 250, 1 + number % 250))

    rig.give(long(confirmation=1))

    assert len(rig.turner.executed) == MAX_RESULTS + 2
