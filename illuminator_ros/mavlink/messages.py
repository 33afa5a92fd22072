# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""
The messages that every component has: short names of pymavlink's classes, and their contents.

A payload names the classes of its own messages in the same way. Their fields are as on the wire,
and float32 is not rounded before it is sent.
"""

from __future__ import annotations

from typing import NamedTuple

from .dialect import entry_names, mavlink, MAVLink_component_information_basic_message

Message = mavlink.MAVLink_message
Heartbeat = mavlink.MAVLink_heartbeat_message
CommandInt = mavlink.MAVLink_command_int_message
CommandLong = mavlink.MAVLink_command_long_message
CommandAck = mavlink.MAVLink_command_ack_message
ComponentInformationBasic = MAVLink_component_information_basic_message
AnyCommand = CommandLong | CommandInt
INFORMATION_ID = ComponentInformationBasic.id
# param1 to param7 of a command.
Params = tuple[float, float, float, float, float, float, float]
MAVLINK_VERSION = 3


class Address(NamedTuple):
    """The address of a MAVLink component: system id and component id, each 0..255."""

    system: int
    component: int

    def includes(self, other: Address) -> bool:
        """Return whether a message to this address is for a component; an id of 0 means all."""
        return self.system in (0, other.system) and self.component in (0, other.component)

    def __str__(self) -> str:
        return f'{self.system}/{self.component}'


def params_of(command: AnyCommand) -> Params:
    """Return param1 to param7."""
    last = ((command.x, command.y, command.z) if isinstance(command, CommandInt) else
            (command.param5, command.param6, command.param7))
    return command.param1, command.param2, command.param3, command.param4, *last


def target_of(message: Message) -> Address:
    """Return the address that a message is for; an id is 0 where the message does not name it."""
    return Address(getattr(message, 'target_system', 0), getattr(message, 'target_component', 0))


def result_name(result: int) -> str:
    """Return the name of a MAV_RESULT, for example ``MAV_RESULT_DENIED``; any int is accepted."""
    return entry_names('MAV_RESULT').get(result, f'MAV_RESULT {result} (unknown)')


def command_name(command: int) -> str:
    """Return the name of a MAV_CMD; any int is accepted."""
    return entry_names('MAV_CMD').get(command, f'MAV_CMD {command}')


def time_boot_ms(seconds: float) -> int:
    """Return a field value for a time since the start, s: ms, wrapping after 49.7 days."""
    return int(seconds * 1000) & 0xFFFFFFFF


def heartbeat(mav_type: int) -> Heartbeat:
    """Return the HEARTBEAT of a component that is not an autopilot (heartbeat protocol)."""
    return Heartbeat(mav_type, mavlink.MAV_AUTOPILOT_INVALID, 0, 0, mavlink.MAV_STATE_ACTIVE,
                     MAVLINK_VERSION)
