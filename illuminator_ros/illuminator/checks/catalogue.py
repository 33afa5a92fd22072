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

from . import configuration, information, status, switch, thermal
from .describe import describe
from .specification import ILLUMINATOR
from .tester import LightTester
from ..messages import IlluminatorStatus
from ...mavlink.messages import ComponentInformationBasic, Heartbeat, MavType, Message
from ...payload.checks import command, heartbeat, whole_run
from ...payload.checks.payload_checks import Option, PayloadChecks
from ...payload.checks.requirement import Requirement
from ...payload.checks.stream import interval_requirements, stream_requirements

REQUIREMENTS: tuple[Requirement[LightTester], ...] = (
    heartbeat.heartbeat,
    heartbeat.heartbeat_type(MavType.ILLUMINATOR, 'an illuminator'),
    heartbeat.heartbeat_autopilot,
    heartbeat.address,
    *stream_requirements(IlluminatorStatus, ILLUMINATOR, 'Message/Command/Enum Summary',
                         'Illuminator Connection'),
    status.content, status.mode, status.limits, status.flags,
    information.on_request, information.terminated, information.text,
    command.unknown_command,
    command.unknown_message,
    command.broadcast(IlluminatorStatus),
    switch.other_target, switch.command_int, switch.repeated,
    switch.on, switch.off, switch.values,
    configuration.internal, configuration.external, configuration.modes,
    configuration.brightness, configuration.brightness_values,
    configuration.strobe, configuration.strobe_limits, configuration.strobe_values,
    configuration.duty, configuration.duty_values, configuration.not_a_number,
    *interval_requirements(IlluminatorStatus),
    thermal.thermal,
    whole_run.heartbeat_rate,
    status.uptime,
    *whole_run.ACKNOWLEDGEMENTS,
    status.agrees, status.unchanged,
    whole_run.checksums,
)


def is_light(message: Message) -> bool:
    """Return whether a message identifies its sender as a light."""
    return (isinstance(message, IlluminatorStatus)
            or isinstance(message, Heartbeat) and message.type == MavType.ILLUMINATOR)


CHECKS: PayloadChecks[LightTester] = PayloadChecks(
    payload='illuminator', device='light',
    messages=(IlluminatorStatus, ComponentInformationBasic),
    is_device=is_light, evidence='HEARTBEAT with MAV_TYPE_ILLUMINATOR or ILLUMINATOR_STATUS',
    describe=describe, identity=information.describe_identity,
    tester=LightTester, requirements=REQUIREMENTS,
    risk='strobe, or shine at 100 %',
    question='Some checks make light {device} strobe, and shine at 100 % for {heat:g} s. '
             'Strobing can trigger\nseizures; do not look into the light. All other checks run '
             'in any case.\nMay light {device} strobe and shine at 100 %? [y/N] ',
    options=(Option('heat', 'S', 5.0, 0, 36000, 'time at 100 %% to heat the light, and then as '
                    'long to cool it'),))
