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

"""The messages of a light as text, for the log of a session."""

from __future__ import annotations

from ..messages import IlluminatorStatus
from ..model import flag_names, Status
from ...mavlink.messages import ComponentInformationBasic, Message
from ...payload.checks import describe as protocols
from ...payload.identity import Identity


def describe(message: Message) -> str:
    """Return a message in one line."""
    if isinstance(message, IlluminatorStatus):
        return f'ILLUMINATOR_STATUS {status_text(Status.from_message(message))}'
    if isinstance(message, ComponentInformationBasic):
        one = Identity.from_message(message)
        return (f'COMPONENT_INFORMATION_BASIC {one.vendor!r}, {one.model!r}, '
                f'{one.software_version!r}, {one.hardware_version!r}, {one.serial_number!r}')
    return protocols.describe(message)


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
