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

"""How a simulated light behaves: as the protocol says, like lights seen in the field, or badly."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

from .identity import Identity
from .model import Limits, Mode
from ..mavlink.messages import (
    Address,
    MAV_AUTOPILOT_ARDUPILOTMEGA,
    MAV_AUTOPILOT_INVALID,
    MAV_COMP_ID_AUTOPILOT1,
    MAV_COMP_ID_ILLUMINATOR,
    MAV_STATE_ACTIVE,
    MAV_STATE_UNINIT,
    MavResult,
    MavType,
)


class Extension(NamedTuple):
    """What a vendor's 38-byte ILLUMINATOR_STATUS has behind the 35 bytes."""

    zoom_level: int = 0
    color_mode: int = 0
    gimbal_device_id: int = 0


@dataclass(frozen=True)
class Behaviour:
    """
    What a light does; the defaults are what the protocol asks for.

    :param heartbeat_interval: s, 0 for none.
    :param has_clock: whether uptime_ms and time_boot_ms run; else they are 0.
    :param measures: whether it has a temperature and strobe limits to report; else 0, and it
        does not strobe.
    :param fixed_rate: whether MAV_CMD_SET_MESSAGE_INTERVAL only switches the stream.
    :param endless_stream: whether the stream cannot be stopped.
    :param resumes: whether the stream can be started again.
    :param on_request: whether a status can be requested.
    :param pushes: whether a change is followed by a status at once.
    :param extension: what makes the status one of 38 bytes.
    :param identifies: whether it sends COMPONENT_INFORMATION_BASIC.
    :param terminates: whether its strings end with a NUL where they are too long.
    :param padding: what fills its strings to the last byte, '' for nothing.
    :param joint_switch: whether being on is having a brightness above 0.
    :param filters_target: whether messages to others are left alone.
    :param takes_int: whether it answers COMMAND_INT.
    :param takes_broadcast: whether it answers what is for all components.
    :param acks_target: whether COMMAND_ACK names whom it is for.
    :param misaddresses: whether COMMAND_ACK names somebody else.
    :param apply_after: s from the acknowledgement to the change.
    :param lets_nan_in: whether range checks are comparisons that NaN passes.
    :param lets_all_in: whether values out of range are accepted, and taken.
    :param obeys_refused: whether refused commands are carried out all the same.
    :param toggles: whether switching on what is on switches it off.
    :param accepts_unknown: whether unknown commands, and requests for unknown messages, are
        accepted.
    :param false_flags: ILLUMINATOR_ERROR_FLAGS that are set for no reason.
    :param inverted_flags: whether thermal flags are set while the light is cold.
    :param silence: s for which it neither hears nor says anything.
    :param reboot_interval: s, 0 for never.
    :param thermistor_failed: whether its temperature sensor is broken.
    :param refuse: what changes are answered with, None to consider them.
    :param rejections: how many changes are rejected temporarily.
    :param progress: s for which a change is reported to be in progress first.
    :param slow: s from a command to its answer.
    :param drop: share (0..1) of messages that are not sent.
    :param duplicate: share (0..1) of messages that are sent twice.
    :param delay: s by which messages are late at the most.
    :param corrupt: share (0..1) of messages with a wrong checksum.
    :param lies: whether accepted changes are not made.
    """

    heartbeat_type: int = MavType.ILLUMINATOR
    heartbeat_autopilot: int = MAV_AUTOPILOT_INVALID
    heartbeat_state: int = MAV_STATE_ACTIVE
    heartbeat_interval: float = 1.0
    has_clock: bool = True
    measures: bool = True
    fixed_rate: bool = False
    endless_stream: bool = False
    resumes: bool = True
    on_request: bool = True
    pushes: bool = True
    extension: Extension | None = None
    identifies: bool = True
    terminates: bool = True
    padding: str = ''
    joint_switch: bool = False
    filters_target: bool = True
    takes_int: bool = True
    takes_broadcast: bool = True
    acks_target: bool = True
    misaddresses: bool = False
    apply_after: float = 0.0
    lets_nan_in: bool = False
    lets_all_in: bool = False
    obeys_refused: bool = False
    toggles: bool = False
    accepts_unknown: bool = False
    false_flags: int = 0
    inverted_flags: bool = False
    silence: float = 0.0
    reboot_interval: float = 0.0
    thermistor_failed: bool = False
    refuse: MavResult | None = None
    rejections: int = 0
    progress: float = 0.0
    slow: float = 0.0
    drop: float = 0.0
    duplicate: float = 0.0
    delay: float = 0.0
    corrupt: float = 0.0
    lies: bool = False


@dataclass(frozen=True)
class Profile:
    """
    A light seen in the field.

    :param shifted_bitmask: whether mode_bitmask has 1 << mode for a mode, else the mode itself.
    """

    description: str
    source: Address = Address(1, MAV_COMP_ID_ILLUMINATOR)
    behaviour: Behaviour = Behaviour()
    limits: Limits = Limits(0.05, 10.0)
    modes: tuple[Mode, ...] = (Mode.INTERNAL_CONTROL, Mode.EXTERNAL_SYNC)
    shifted_bitmask: bool = False
    identity: Identity | None = field(default=None)


PROFILES = {
    'default': Profile('follows the protocol in all that it does'),
    # The emulator of the developer guide, as it is and not as it should be.
    'reference': Profile(
        'the emulator of the MAVLink developer guide: 255/0, acknowledges before it applies, '
        'status at 1 Hz or not at all',
        Address(255, 0),
        Behaviour(
            heartbeat_state=MAV_STATE_UNINIT, has_clock=False, fixed_rate=True, pushes=False,
            terminates=False, filters_target=False, takes_int=False, acks_target=False,
            apply_after=0.005, lets_nan_in=True),
        limits=Limits(0.0, 10.0),
        identity=Identity(
            'Illuminator Vendor', 'Illuminator Model', 'Illuminator Software Version',
            'Illuminator Hardware Version', 'Illuminator Serial Number')),
    'ardusub': Profile(
        "a light of ArduSub: the autopilot's component and heartbeat, mode_bitmask 1 << mode, 0 "
        'for what it does not measure, brightness 0 is off',
        Address(1, MAV_COMP_ID_AUTOPILOT1),
        Behaviour(
            heartbeat_type=MavType.SUBMARINE, heartbeat_autopilot=MAV_AUTOPILOT_ARDUPILOTMEGA,
            measures=False, identifies=False, joint_switch=True, pushes=False,
            lets_nan_in=True),
        limits=Limits(0.0, 0.0), modes=(Mode.INTERNAL_CONTROL,), shifted_bitmask=True),
    'extended': Profile(
        'a vendor extension: 38 bytes of status, with zoom_level, color_mode and '
        'gimbal_device_id',
        behaviour=Behaviour(extension=Extension(zoom_level=25, color_mode=1))),
}
