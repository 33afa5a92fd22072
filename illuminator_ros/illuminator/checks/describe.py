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

"""Messages in words, for what was sent and what came."""

from __future__ import annotations

from typing import Any

from ..error_flags import flag_names
from ..identity import Identity
from ..model import Status
from ...mavlink.messages import (
    Address,
    CommandAck,
    CommandInt,
    CommandLong,
    ComponentInformationBasic,
    Heartbeat,
    IlluminatorStatus,
    MavCmd,
    MavResult,
    result_name,
)


def command_name(command: int) -> str:
    """Return the name of a MAV_CMD."""
    try:
        return f'MAV_CMD_{MavCmd(command).name}'
    except ValueError:
        return f'MAV_CMD {command}'


def describe(message: Any) -> str:
    """Return a message in one line."""
    if isinstance(message, CommandLong | CommandInt):
        return _command(message)
    if isinstance(message, CommandAck):
        return _ack(message)
    if isinstance(message, IlluminatorStatus):
        return f'ILLUMINATOR_STATUS {status_text(Status.from_message(message))}'
    if isinstance(message, Heartbeat):
        return (f'HEARTBEAT type {message.type}, autopilot {message.autopilot}, '
                f'system_status {message.system_status}')
    if isinstance(message, ComponentInformationBasic):
        one = Identity.from_message(message)
        return (f'COMPONENT_INFORMATION_BASIC {one.vendor!r}, {one.model!r}, '
                f'{one.software_version!r}, {one.hardware_version!r}, {one.serial_number!r}')
    return str(message.msgname)


def _command(message: Any) -> str:
    params = [message.param1, message.param2, message.param3, message.param4]
    while len(params) > 1 and params[-1] == 0:
        params.pop()
    to = Address(message.target_system, message.target_component)
    again = getattr(message, 'confirmation', 0)
    return (f'{message.msgname} to {to}: {command_name(message.command)} '
            + ' '.join(f'{param:g}' for param in params)
            + (f', confirmation {again}' if again else ''))


def _ack(message: Any) -> str:
    text = f'COMMAND_ACK {command_name(message.command)}: {result_name(message.result)}'
    if message.result == MavResult.IN_PROGRESS:
        text += f', progress {message.progress}'
    target = Address(message.target_system, message.target_component)
    return text + (f' to {target}' if any(target) else '')


def status_text(status: Status) -> str:
    """Return a status in one line."""
    on = {True: 'on', False: 'off', None: 'enable invalid'}[status.enabled]
    numbers = ', '.join(
        f'{name} {"invalid" if value is None else f"{value:g}"}{unit}' for name, value, unit in (
            ('brightness', status.brightness, ' %'),
            ('strobe_period', status.strobe_period, ' s'),
            ('strobe_duty_cycle', status.strobe_duty_cycle, ' %'),
            ('temp_c', status.temperature, '')))
    flags = ', '.join(flag_names(status.error_flags)) or 'no flags'
    return f'{on}, mode {status.mode.label}, {numbers}, {flags}, uptime_ms {status.uptime_ms}'
