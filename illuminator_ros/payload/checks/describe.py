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

"""The messages of the heartbeat and command protocols as text, for the log of a session."""

from __future__ import annotations

from ...mavlink import messages
from ...mavlink.messages import Address, CommandAck, CommandInt, CommandLong, MavCmd, MavResult


def command_name(command: int) -> str:
    """Return the name of a MAV_CMD."""
    try:
        return f'MAV_CMD_{MavCmd(command).name}'
    except ValueError:
        return f'MAV_CMD {command}'


def describe(message: messages.Message) -> str:
    """Return a message in one line; only its name if it belongs to another protocol."""
    if isinstance(message, CommandLong | CommandInt):
        return _command(message)
    if isinstance(message, CommandAck):
        return _ack(message)
    if isinstance(message, messages.Heartbeat):
        return f'HEARTBEAT type {message.type}, autopilot {message.autopilot}'
    return str(message.name)


def _command(message: CommandLong | CommandInt) -> str:
    params = [message.param1, message.param2, message.param3, message.param4]
    while len(params) > 1 and params[-1] == 0:
        params.pop()
    to = Address(message.target_system, message.target_component)
    confirmation = getattr(message, 'confirmation', 0)
    numbers = ' '.join(f'{param:g}' for param in params)
    return (f'{message.name} to {to}: {command_name(message.command)} {numbers}'
            + (f', confirmation {confirmation}' if confirmation else ''))


def _ack(message: CommandAck) -> str:
    text = f'COMMAND_ACK {command_name(message.command)}: {messages.result_name(message.result)}'
    if message.result == MavResult.IN_PROGRESS:
        text += f', progress {message.progress}'
    target = Address(message.target_system, message.target_component)
    return text + (f' to {target}' if any(target) else '')
