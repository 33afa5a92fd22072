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

"""The properties of a simulated light, its faults, and profiles: lights seen in the field."""

from __future__ import annotations

from dataclasses import dataclass
import functools
from typing import NamedTuple

from .model import Mode, StrobeRange
from .thermal import ThermalProperties
from .. import __version__
from ..mavlink import messages
from ..mavlink.dialect import mavlink
from ..payload.faults import Behaviour, Fault, FaultTable, faulty, FLAGS
from ..payload.identity import Identity


class Extension(NamedTuple):
    """The three fields that follow the common 35 bytes in a vendor's ILLUMINATOR_STATUS."""

    zoom_level: int = 0
    color_mode: int = 0
    gimbal_device_id: int = 0


@dataclass(frozen=True)
class IlluminatorBehaviour(Behaviour):
    """
    How a simulated light behaves; the defaults follow the protocol.

    :param has_clock: whether uptime_ms and time_boot_ms run; else they are 0.
    :param measures: whether it has a temperature and strobe limits to report; else they are 0,
        and it does not strobe.
    :param extension: makes the status one of 38 bytes.
    :param identifies: whether it sends COMPONENT_INFORMATION_BASIC.
    :param terminates: whether a string that is too long ends with a NUL.
    :param padding: fills its strings to the last byte, '' for nothing.
    :param brightness_is_switch: whether a brightness above 0 is on, and 0 is off.
    :param accepts_nan: whether range checks are comparisons that NaN passes.
    :param accepts_out_of_range: whether values out of range are accepted and applied.
    :param toggles: whether ON switches it off if it is on.
    :param false_flags: ILLUMINATOR_ERROR_FLAGS that are set without a reason.
    :param inverted_flags: whether THERMAL_THROTTLING is set while the light is cold.
    :param thermistor_failed: whether its temperature sensor is broken.
    """

    heartbeat_type: int = mavlink.MAV_TYPE_ILLUMINATOR
    measures: bool = True
    extension: Extension | None = None
    terminates: bool = True
    brightness_is_switch: bool = False
    thermistor_failed: bool = faulty(False, Fault(
        'thermistor', 'its temperature sensor fails: THERMISTOR_FAILURE, and temp_c stays at 0'))
    has_clock: bool = faulty(True, Fault('no-clock', 'reports an uptime of 0', False))
    identifies: bool = faulty(True, Fault(
        'no-identity', 'sends no COMPONENT_INFORMATION_BASIC', False))
    padding: str = faulty('', Fault(
        'no-terminator', 'fills its strings with blanks, to the last byte', ' '))
    accepts_nan: bool = faulty(False, Fault('nan', 'accepts NaN'))
    accepts_out_of_range: bool = faulty(False, Fault(
        'anything', 'accepts values out of range'))
    toggles: bool = faulty(False, Fault(
        'toggle', 'is switched off by switching it on again'))
    false_flags: int = faulty(0, Fault(
        'flags', 'reports error flags without a reason',
        mavlink.ILLUMINATOR_ERROR_FLAGS_OVER_TEMPERATURE_SHUTDOWN, FLAGS))
    inverted_flags: bool = faulty(False, Fault(
        'cold-throttling',
        'reports THERMAL_THROTTLING while it is on and cool, not while it is hot'))


FAULTS = FaultTable.of(IlluminatorBehaviour)


@dataclass(frozen=True)
class IlluminatorProperties:
    """
    The properties of a simulated light.

    :param modes: the modes that it can be configured to.
    :param mode_bitmask: as reported; None to compute it from the modes.
    :param shifted_bitmask: whether it is computed from 1 << mode for each mode, else from the
        mode.
    :param status_interval: s between statuses by default; 0 sends none.
    :param time_scale: factor by which it heats and cools faster than real time.
    :param behaviour: how it behaves at first, and without faults.
    """

    address: messages.Address = messages.Address(1, mavlink.MAV_COMP_ID_ILLUMINATOR)
    identity: Identity = Identity(
        'illuminator_ros', 'simulator', __version__, '1.0.0', 'SIM-1-243')
    strobe_range: StrobeRange = StrobeRange(0.05, 10.0)
    modes: tuple[Mode, ...] = (Mode.INTERNAL_CONTROL, Mode.EXTERNAL_SYNC)
    mode_bitmask: int | None = None
    shifted_bitmask: bool = False
    status_interval: float = 1.0
    thermal: ThermalProperties = ThermalProperties()
    time_scale: float = 1.0
    behaviour: IlluminatorBehaviour = IlluminatorBehaviour()

    @functools.cached_property
    def reported_bitmask(self) -> int:
        """Return the mode_bitmask of ILLUMINATOR_STATUS."""
        if self.mode_bitmask is not None:
            return self.mode_bitmask
        return sum({1 << mode if self.shifted_bitmask else mode for mode in self.modes})


class Profile(NamedTuple):
    """A light seen in the field."""

    description: str
    properties: IlluminatorProperties


PROFILES = {
    'default': Profile('follows the protocol in everything', IlluminatorProperties()),
    # The emulator of the developer guide, with its deviations from the protocol.
    'reference': Profile(
        'the emulator of the MAVLink developer guide: 255/0, acknowledges before it applies, '
        'status at 1 Hz or not at all',
        IlluminatorProperties(
            address=messages.Address(255, 0), strobe_range=StrobeRange(0.0, 10.0),
            identity=Identity(
                'Illuminator Vendor', 'Illuminator Model', 'Illuminator Software Version',
                'Illuminator Hardware Version', 'Illuminator Serial Number'),
            behaviour=IlluminatorBehaviour(
                heartbeat_state=mavlink.MAV_STATE_UNINIT, has_clock=False, fixed_rate=True,
                status_on_change=False, terminates=False, filters_target=False,
                answers_command_int=False, acks_target=False, apply_after=0.005,
                accepts_nan=True))),
    'ardusub': Profile(
        "a light of ArduSub: the autopilot's component and heartbeat, mode_bitmask 1 << mode, 0 "
        'for what it does not measure, brightness 0 is off',
        IlluminatorProperties(
            address=messages.Address(1, mavlink.MAV_COMP_ID_AUTOPILOT1),
            strobe_range=StrobeRange(0.0, 0.0),
            modes=(Mode.INTERNAL_CONTROL,), shifted_bitmask=True,
            behaviour=IlluminatorBehaviour(
                heartbeat_type=mavlink.MAV_TYPE_SUBMARINE,
                heartbeat_autopilot=mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA, measures=False,
                identifies=False, brightness_is_switch=True, status_on_change=False,
                accepts_nan=True))),
    'extended': Profile(
        'a vendor extension: 38 bytes of status, with zoom_level, color_mode and '
        'gimbal_device_id',
        IlluminatorProperties(behaviour=IlluminatorBehaviour(
            extension=Extension(zoom_level=25, color_mode=1)))),
}
