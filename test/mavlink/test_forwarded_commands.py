# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The sender of a command that was forwarded is known for 3 s."""

from __future__ import annotations

from illuminator_ros.mavlink.forwarding.forwarded_commands import ForwardedCommands, MEMORY
from illuminator_ros.mavlink.messages import Address, CommandInt, CommandLong, Message
import pytest
from support.frames import frame_of, heartbeat_frame, LIGHT, only

GROUND, PILOT = Address(255, 190), Address(1, 1)
ON_OFF = 405


def to(target: Address, on: float = 1.0, command: int = ON_OFF) -> CommandLong:
    return CommandLong(*target, command, 0, on, 0, 0, 0, 0, 0, 0)


@pytest.mark.parametrize(('message', 'after', 'sender'), [
    (to(LIGHT), 0.0, GROUND), (to(LIGHT), MEMORY, GROUND), (to(LIGHT), MEMORY + 0.1, None),
    (to(Address(LIGHT.system, 0)), 0.0, GROUND), (to(Address(0, 0)), 0.0, GROUND),
    (CommandInt(*LIGHT, 0, ON_OFF, 0, 0, 1, 0, 0, 0, 0, 0, 0), 0.0, GROUND),
    # Another value, command or light.
    (to(LIGHT, on=0.0), 0.0, None), (to(LIGHT, command=406), 0.0, None),
    (to(Address(1, 244)), 0.0, None), (to(Address(2, 0)), 0.0, None)])
def test_sender_of_a_command_is_known_if_its_target_and_value_are_those_of_the_change(
        message: Message, after: float, sender: Address | None) -> None:
    commands = ForwardedCommands()
    commands.add(only(heartbeat_frame()), 1.0)
    commands.add(only(frame_of(message, source=GROUND)), 1.0)
    assert commands.sender(LIGHT, ON_OFF, 1.0 + after, True) == sender


def test_the_last_of_several_senders_is_the_one() -> None:
    commands = ForwardedCommands()
    for now, source, target in ((1.0, GROUND, LIGHT), (2.0, PILOT, Address(0, 0))):
        commands.add(only(frame_of(to(target), source=source)), now)
    assert commands.sender(LIGHT, ON_OFF, 2.0) == PILOT
