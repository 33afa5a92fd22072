# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The properties of a simulated light, its faults, and profiles: lights seen in the field."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
import functools

from .model import Mode, MODES, StrobeRange
from .thermal import ThermalProperties
from .. import __version__
from ..mavlink import messages
from ..mavlink.dialect import mavlink
from ..simulation.faults import Behaviour, fault, FaultTable, FLAGS
from ..simulation.settings import integer, number, one_of, setting, text
from ..simulation.simulated import Profile, Properties


@dataclass(frozen=True)
class IlluminatorBehaviour(Behaviour):
    """
    How a simulated light behaves; the defaults follow the protocol.

    :param has_clock: whether uptime_ms and time_boot_ms run; else they are 0.
    :param measures: whether it has a temperature and strobe limits to report; else they are 0,
        and it does not strobe.
    :param identifies: whether it sends COMPONENT_INFORMATION_BASIC.
    :param terminates: whether a string that is too long ends with a NUL.
    :param padding: fills its strings to the last byte, '' for nothing.
    :param brightness_is_switch: whether a brightness above 0 is on, and 0 is off.
    :param accepts_nan: whether range checks are comparisons that NaN passes.
    :param accepts_out_of_range: whether values out of range are accepted and applied.
    :param brightens: whether ON sets its brightness to 100 %.
    :param configuring_switches: whether a brightness above 0 switches it on, and 0 does not switch
        it off.
    :param toggles: whether ON switches it off if it is on.
    :param false_flags: ILLUMINATOR_ERROR_FLAGS that are set without a reason.
    :param inverted_flags: whether THERMAL_THROTTLING is set while the light is cold.
    :param thermistor_failed: whether its temperature sensor is broken.
    """

    heartbeat_type: int = mavlink.MAV_TYPE_ILLUMINATOR
    measures: bool = True
    terminates: bool = True
    brightness_is_switch: bool = False
    thermistor_failed: bool = fault(
        False, 'thermistor',
        'its temperature sensor fails: THERMISTOR_FAILURE, and temp_c stays at 0')
    has_clock: bool = fault(True, 'no-clock', 'reports an uptime of 0')
    identifies: bool = fault(True, 'no-identity', 'sends no COMPONENT_INFORMATION_BASIC')
    padding: str = fault(
        '', 'no-terminator', 'fills its strings with blanks, to the last byte', ' ')
    accepts_nan: bool = fault(False, 'nan', 'accepts NaN')
    accepts_out_of_range: bool = fault(False, 'anything', 'accepts values out of range')
    brightens: bool = fault(False, 'on-bright', 'sets its brightness to 100 % when switched on')
    configuring_switches: bool = fault(
        False, 'configure-on', 'is switched on by a brightness above 0')
    toggles: bool = fault(False, 'toggle', 'is switched off by switching it on again')
    false_flags: int = fault(
        0, 'flags', 'reports error flags without a reason',
        mavlink.ILLUMINATOR_ERROR_FLAGS_OVER_TEMPERATURE_SHUTDOWN, FLAGS)
    inverted_flags: bool = fault(
        False, 'cold-throttling',
        'reports THERMAL_THROTTLING while it is on and cool, not while it is hot')


FAULTS = FaultTable.of(IlluminatorBehaviour)


def _modes(names: str) -> tuple[Mode, ...]:
    modes = tuple(MODES[one_of(MODES)(name.strip())] for name in names.split(',') if name.strip())
    if not modes:
        raise ValueError('at least one mode is needed')
    return modes


def _thermal(values: str) -> dict[str, float]:
    known = [field.name for field in fields(ThermalProperties)]
    result = {}
    for part in values.split(','):
        name, equals, value = part.strip().partition('=')
        if name not in known or not equals:
            raise ValueError(f'{part!r} is not one of '
                             + ', '.join(f'{name}=VALUE' for name in known))
        result[name] = number(-1000, 100_000)(value)
    return result


_period, _byte = number(0, 3600), integer(0, 255)


@dataclass(frozen=True)
class IlluminatorProperties(Properties):
    """
    The properties of a simulated light.

    :param shifted_bitmask: whether the mode_bitmask is computed from 1 << mode for each mode, else
        from the mode.
    :param serial_number: '' for one with the address.
    :param mode_bitmask: as reported; None to compute it from the modes.
    """

    address: messages.Address = messages.Address(1, mavlink.MAV_COMP_ID_ILLUMINATOR)
    behaviour: IlluminatorBehaviour = IlluminatorBehaviour()
    shifted_bitmask: bool = False
    vendor: str = setting('illuminator_ros', 'TEXT', 'vendor_name', text)
    model: str = setting('simulator', 'TEXT', 'model_name', text)
    software_version: str = setting(__version__, 'TEXT', 'software_version', text)
    hardware_version: str = setting('1.0.0', 'TEXT', 'hardware_version', text)
    serial_number: str = setting(
        '', 'TEXT', 'serial_number; several lights append their component id', text,
        distinct=True)
    status_interval: float = setting(
        1.0, 'S', 'time between statuses; 0 sends them only on request', _period)
    min_strobe_period: float = setting(0.05, 'S', 'shortest strobe period', _period)
    max_strobe_period: float = setting(10.0, 'S', 'longest strobe period', _period)
    modes: tuple[Mode, ...] = setting(
        tuple(MODES.values()), 'MODE,...',
        f'modes that it can be configured to (default: {",".join(MODES)})', _modes)
    mode_bitmask: int | None = setting(
        None, 'N', 'mode_bitmask, if it does not follow from the modes', _byte)
    ambient: float = setting(25.0, 'DEG_C', 'ambient temperature', number(-60, 150))
    thermal: ThermalProperties = setting(
        ThermalProperties(), 'NAME=VALUE,...', 'thermal model, see below', _thermal, adds=True)
    time_scale: float = setting(
        1.0, 'X', 'factor by which it heats faster than real time', number(0.001, 10000))
    zoom_level: int | None = setting(
        None, 'N', 'zoom_level, which makes the status one of 38 bytes', _byte)
    color_mode: int | None = setting(None, 'N', 'color_mode, likewise', _byte)
    gimbal_device_id: int | None = setting(None, 'N', 'gimbal_device_id, likewise', _byte)

    @property
    def strobe_range(self) -> StrobeRange:
        """Return the strobe periods that are possible."""
        return StrobeRange(self.min_strobe_period, self.max_strobe_period)

    @property
    def extension(self) -> Sequence[int]:
        """Return the three fields that follow the common 35 bytes of some vendor's status."""
        values = self.zoom_level, self.color_mode, self.gimbal_device_id
        return () if values == (None,) * 3 else [value or 0 for value in values]

    @functools.cached_property
    def reported_bitmask(self) -> int:
        """Return the mode_bitmask of ILLUMINATOR_STATUS."""
        if self.mode_bitmask is not None:
            return self.mode_bitmask
        return sum({1 << mode if self.shifted_bitmask else mode for mode in self.modes})


PROFILES = {
    'default': Profile('follows the protocol in everything', IlluminatorProperties()),
    # The emulator of the developer guide, with its deviations from the protocol.
    'reference': Profile(
        'the emulator of the MAVLink developer guide: 255/0, acknowledges before it applies, '
        'status at 1 Hz or not at all',
        IlluminatorProperties(
            messages.Address(255, 0),
            IlluminatorBehaviour(
                heartbeat_state=mavlink.MAV_STATE_UNINIT, has_clock=False, fixed_rate=True,
                status_on_change=False, terminates=False, filters_target=False,
                answers_command_int=False, acks_target=False, apply_after=0.005,
                accepts_nan=True),
            vendor='Illuminator Vendor', model='Illuminator Model',
            software_version='Illuminator Software Version',
            hardware_version='Illuminator Hardware Version',
            serial_number='Illuminator Serial Number', min_strobe_period=0.0)),
    'ardusub': Profile(
        "a light of ArduSub: the autopilot's component and heartbeat, mode_bitmask 1 << mode, 0 "
        'for what it does not measure, brightness 0 is off',
        IlluminatorProperties(
            messages.Address(1, mavlink.MAV_COMP_ID_AUTOPILOT1),
            IlluminatorBehaviour(
                heartbeat_type=mavlink.MAV_TYPE_SUBMARINE,
                heartbeat_autopilot=mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA, measures=False,
                identifies=False, brightness_is_switch=True, status_on_change=False,
                accepts_nan=True),
            shifted_bitmask=True, min_strobe_period=0.0, max_strobe_period=0.0,
            modes=(Mode.INTERNAL_CONTROL,))),
    'extended': Profile(
        'a vendor extension: 38 bytes of status, with zoom_level, color_mode and '
        'gimbal_device_id',
        IlluminatorProperties(zoom_level=25, color_mode=1)),
}
