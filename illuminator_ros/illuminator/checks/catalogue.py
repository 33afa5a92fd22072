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

"""The checks of a light: all requirements in the order in which they are checked."""

from __future__ import annotations

from . import commands, status
from .tester import ILLUMINATOR, LightTester, status_text
from ..messages import IlluminatorStatus
from ..model import Status
from ...mavlink.messages import ComponentInformationBasic, Heartbeat, MavType, Message
from ...payload.checks import component_requirements as component
from ...payload.checks.requirement import Option, PayloadChecks, Requirement

REQUIREMENTS: tuple[Requirement[LightTester], ...] = (
    component.heartbeat, component.heartbeat_type(MavType.ILLUMINATOR, 'an illuminator'),
    component.heartbeat_autopilot, component.address,
    component.status_stream(IlluminatorStatus, ILLUMINATOR, 'Message/Command/Enum Summary'),
    component.sent_on_request(
        'status-request', IlluminatorStatus, ILLUMINATOR, 'Illuminator Connection'),
    status.content, status.mode, status.limits, status.flags,
    component.sent_on_request(
        'information-request', ComponentInformationBasic, ILLUMINATOR,
        'COMPONENT_INFORMATION_BASIC', lambda session: session.identity or 'no names'),
    *component.IDENTITY_STRINGS,
    component.unknown_command, component.unknown_message, component.broadcast(IlluminatorStatus),
    commands.other_target, commands.command_int, commands.repeated,
    commands.on, commands.off, commands.on_off_values,
    commands.internal, commands.external, commands.mode_values,
    commands.brightness, commands.brightness_values, *commands.STROBE, commands.not_a_number,
    *component.interval_requirements(IlluminatorStatus),
    status.thermal,
    component.heartbeat_rate, status.uptime, *component.ACKNOWLEDGEMENTS,
    status.agrees, status.unchanged, component.checksums,
)


def is_light(message: Message) -> bool:
    """Return whether a message identifies its sender as a light."""
    return (isinstance(message, IlluminatorStatus)
            or isinstance(message, Heartbeat) and message.type == MavType.ILLUMINATOR)


def describe(message: Message) -> str:
    """Return an ILLUMINATOR_STATUS in one line, '' for another message."""
    return f'{message.name} {status_text(Status.from_message(message))}' if isinstance(
        message, IlluminatorStatus) else ''


CHECKS: PayloadChecks[LightTester] = PayloadChecks(
    payload='illuminator', device='light', is_device=is_light,
    messages=(IlluminatorStatus, ComponentInformationBasic),
    evidence='HEARTBEAT with MAV_TYPE_ILLUMINATOR or ILLUMINATOR_STATUS', describe=describe,
    tester=LightTester, requirements=REQUIREMENTS,
    risk='strobe, or shine at 100 %',
    question='Some checks make light {device} strobe, and shine at 100 % for {heat:g} s. '
             'Strobing can trigger\nseizures; do not look into the light. All other checks run '
             'in any case.\nMay light {device} strobe and shine at 100 %? [y/N] ',
    options=(Option('heat', 'S', 5.0, 0, 36000, 'time at 100 %% to heat the light, and then as '
                    'long to cool it'),))
