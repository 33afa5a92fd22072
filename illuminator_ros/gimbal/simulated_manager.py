# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""
A simulated gimbal with a gimbal manager of its own: one component, no messages between the two.

https://mavlink.io/en/services/gimbal_v2.html, "Standalone Integrated Camera/Gimbal". Rules where
the specification is open: control goes to any component that takes it; a command without control
gets MAV_RESULT_DENIED; the angles of secondary control are added to the angles of primary control,
up to :data:`NUDGE_LIMIT`.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
import contextlib
from dataclasses import dataclass
from functools import partial
import math

from . import messages as gimbal
from .axes import LEVEL, Range
from .manager_setpoint import AnySetpoint, direction, read_roi, read_setpoint, Refused, Setpoint
from .messages import DEVICE_ID_PARAM, NO_COMPONENT
from .simulated_device import GimbalBehaviour, MountProperties, SimulatedMount
from ..geometry.mount_attitude import UNSET_VECTOR, YawFrame
from ..mavlink.dialect import mavlink, replaced
from ..mavlink.messages import Address, AnyCommand, Message, params_of
from ..payload.messages import (
    Attitude,
    GeoPoint,
    GlobalPositionInt,
    is_plausible,
    place_of,
)
from ..simulation import simulated
from ..simulation.faults import fault, FaultTable
from ..simulation.settings import geo_point, integer, number, setting

# s between messages with the state of the manager ("Gimbal Manager Status").
STATUS_INTERVAL = 0.2
# rad that secondary control may add to an angle.
NUDGE_LIMIT = math.radians(20.0)
AUTOPILOT = Address(1, mavlink.MAV_COMP_ID_AUTOPILOT1)


@dataclass(frozen=True)
class ManagerBehaviour(GimbalBehaviour):
    """
    The behaviour of a simulated gimbal manager; the defaults follow the protocol.

    :param enforces_roi: whether a region of interest needs control, too.
    :param frozen_control: whether its status always shows that no component has control.
    :param has_secondary: whether it has secondary control.
    :param own_is_manager: whether -2 in CONFIGURE means the manager itself, not the sender.
    :param releases_pairs: whether -3 in CONFIGURE needs system and component id of the sender.
    :param invalid_configure: result of CONFIGURE with values that do not exist.
    :param rates_in_degrees: whether PITCHYAW has rates in deg/s, else in rad/s.
    :param checks_device: whether it ignores messages for other gimbal devices.
    :param takes_pitchyaw: whether it takes GIMBAL_MANAGER_SET_PITCHYAW.
    :param takes_manual: whether it takes GIMBAL_MANAGER_SET_MANUAL_CONTROL.
    :param partial_angles: result of PITCHYAW with the angle of only one axis, which it then
        ignores; None if it takes such an angle.
    :param angles_with_rates: whether messages may have angles and rates.
    :param frame_is_lock: whether YAW_LOCK alone selects the frame of a yaw.
    :param shows_flags: whether its status has the flags of the setpoint.
    :param lacks: GIMBAL_DEVICE_CAP_FLAGS that it does not have.
    """

    enforces_roi: bool = True
    frozen_control: bool = fault(False, 'stale-control', 'reports the control of its start')
    has_secondary: bool = True
    own_is_manager: bool = False
    releases_pairs: bool = True
    invalid_configure: int = mavlink.MAV_RESULT_DENIED
    rates_in_degrees: bool = True
    checks_device: bool = True
    takes_pitchyaw: bool = True
    takes_manual: bool = True
    partial_angles: int | None = None
    angles_with_rates: bool = True
    frame_is_lock: bool = False
    shows_flags: bool = True
    lacks: int = 0


# Any type of component may be a manager, so the faults of the heartbeat's content are left out,
# and those of a device that has a manager.
FAULTS = FaultTable.of(ManagerBehaviour, 'type', 'autopilot', 'false-north', 'manager-set')


@dataclass(frozen=True)
class ManagerProperties(MountProperties):
    """
    The properties of a simulated gimbal with a manager.

    :param device_id: gimbal_device_id, 1..6 for a gimbal that is not a component of its own.
    :param position: of the vehicle, until it sends GLOBAL_POSITION_INT.
    :param heading: of the vehicle, until it sends ATTITUDE, degrees.
    """

    address: Address = Address(1, mavlink.MAV_COMP_ID_GIMBAL)
    behaviour: ManagerBehaviour = ManagerBehaviour()
    device_id: int = setting(1, 'ID', 'gimbal_device_id, 1 to 6 (default: 1)', integer(1, 6))
    position: GeoPoint = setting(
        GeoPoint(47.397742, 8.545594, 488.0), 'LAT,LON,ALT', 'of the vehicle until it sends '
        'GLOBAL_POSITION_INT, degrees and m above mean sea level (default: '
        '47.397742,8.545594,488)', geo_point)
    heading: float = setting(
        0.0, 'DEG', 'of the vehicle until it sends ATTITUDE', number(-180, 360))

    @property
    def capabilities(self) -> int:
        """Return its GIMBAL_DEVICE_CAP_FLAGS."""
        points = mavlink.GIMBAL_DEVICE_CAP_FLAGS_CAN_POINT_LOCATION_GLOBAL & ~self.lacks
        return (super().capabilities | points) & ~self.behaviour.lacks


PROFILES = {
    'reference': simulated.Profile(
        'follows the protocol, and enforces control', ManagerProperties()),
    # input_mavlink.cpp and output_rc.cpp of src/modules/gimbal.
    'px4': simulated.Profile(
        'PX4 with a gimbal on its outputs: enforces primary control, has no secondary control '
        'and no device ids, -2 is PX4 itself, -3 compares system and component id separately, '
        'PITCHYAW takes rates in rad/s, no SET_PITCHYAW, regions of interest from any component',
        ManagerProperties(AUTOPILOT, ManagerBehaviour(
            heartbeat_type=mavlink.MAV_TYPE_QUADROTOR,
            heartbeat_autopilot=mavlink.MAV_AUTOPILOT_PX4,
            enforces_roi=False, has_secondary=False, own_is_manager=True, releases_pairs=False,
            invalid_configure=mavlink.MAV_RESULT_ACCEPTED, rates_in_degrees=False,
            checks_device=False, takes_pitchyaw=False,
            partial_angles=mavlink.MAV_RESULT_ACCEPTED, frame_is_lock=True,
            lacks=mavlink.GIMBAL_DEVICE_CAP_FLAGS_HAS_RETRACT))),
    # AP_Mount.cpp and AP_Mount_Backend.cpp.
    'ardupilot': simulated.Profile(
        'ArduPilot with a gimbal on its outputs: records control and obeys any component, no '
        'secondary control, no SET_MANUAL_CONTROL, ignores angles with rates and the angle of one '
        'axis, reports constant flags and no failures',
        ManagerProperties(AUTOPILOT, ManagerBehaviour(
            heartbeat_type=mavlink.MAV_TYPE_QUADROTOR,
            heartbeat_autopilot=mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA,
            enforces_control=False, enforces_roi=False, has_secondary=False,
            invalid_configure=mavlink.MAV_RESULT_FAILED, takes_manual=False,
            partial_angles=mavlink.MAV_RESULT_FAILED, angles_with_rates=False, frame_is_lock=True,
            shows_flags=False, reports_earth=False, reports_failures=False))),
}


class SimulatedManager(SimulatedMount):
    """
    A simulated gimbal with a manager, without the link: see :class:`SimulatedDevice`.

    :ivar primary: the component with primary control, 0/0 for none.
    :ivar secondary: the component with secondary control, likewise.
    """

    messages = (
        gimbal.GimbalManagerSetAttitude, gimbal.GimbalManagerSetPitchyaw,
        gimbal.GimbalManagerSetManualControl, Attitude, GlobalPositionInt)
    changes = frozenset(DEVICE_ID_PARAM)
    faults = FAULTS
    properties: ManagerProperties
    behaviour: ManagerBehaviour

    def __init__(self, properties: ManagerProperties) -> None:
        super().__init__(properties)
        self._position = properties.position

    def restart(self, now: float) -> None:
        """See :meth:`SimulatedDevice.restart`; no component has control."""
        super().restart(now)
        self.primary = self.secondary = NO_COMPONENT
        self._roi: GeoPoint | None = None
        self._base = UNSET_VECTOR
        self.motion.receive_heading(
            0.0, 0.0, math.radians(self.properties.heading), 0.0, now, math.inf)

    def reports(self) -> Mapping[type[Message], simulated.Report]:
        """See :meth:`SimulatedDevice.reports`."""
        return {gimbal.GimbalManagerStatus: simulated.Report(
                    self._manager_status, STATUS_INTERVAL),
                gimbal.GimbalManagerInformation: simulated.Report(self._manager_information),
                **super().reports()}

    def _manager_status(self, now: float) -> gimbal.GimbalManagerStatus | None:
        flags = self.flags if self.behaviour.shows_flags else LEVEL
        primary, secondary = (
            (NO_COMPONENT, NO_COMPONENT) if self.behaviour.frozen_control
            else (self.primary, self.secondary))
        return gimbal.GimbalManagerStatus(
            self.uptime_ms(now), int(flags), self.properties.device_id, *primary, *secondary,
        ) if self.behaviour.reports else None

    def _manager_information(self, now: float) -> gimbal.GimbalManagerInformation | None:
        return gimbal.GimbalManagerInformation(
            self.uptime_ms(now), int(self.properties.capabilities), self.properties.device_id,
            **self.limits()) if self.behaviour.identifies else None

    # Setpoints

    def receive(self, source: Address, message: Message, now: float) -> Iterable[Message]:
        """See :meth:`SimulatedDevice.receive`."""
        if isinstance(message, Attitude | GlobalPositionInt):
            if source.system == self.properties.address.system:
                self._receive_vehicle(message, now)
        elif isinstance(message, AnySetpoint) and self._is_for_device(message.gimbal_device_id):
            with contextlib.suppress(ValueError):
                setpoint = self._read(message)
                if self._may_control(source):
                    self._obey(source, setpoint, now)
        return ()

    def _receive_vehicle(self, message: Attitude | GlobalPositionInt, now: float) -> None:
        if isinstance(message, Attitude):
            if is_plausible(message):
                self.motion.receive_heading(
                    message.roll, message.pitch, message.yaw, message.yawspeed, now, math.inf)
        else:
            self._position = place_of(message)
            self._point_at_roi(now)

    def _is_for_device(self, device_id: float) -> bool:
        return device_id in (0, self.properties.device_id) or not self.behaviour.checks_device

    def _may_control(self, source: Address) -> bool:
        return not self.behaviour.enforces_control or source in (self.primary, self.secondary)

    def _flags(self, flags: int) -> int:
        """Return the flags of a message as the profile reads them."""
        frames = (mavlink.GIMBAL_DEVICE_FLAGS_YAW_IN_EARTH_FRAME
                  | mavlink.GIMBAL_DEVICE_FLAGS_YAW_IN_VEHICLE_FRAME)
        return flags & ~frames if self.behaviour.frame_is_lock else flags

    def _read(self, message: AnySetpoint) -> Setpoint:
        """Return the setpoint of a message; ValueError if it is ignored."""
        behaviour = self.behaviour
        setpoint = read_setpoint(
            replaced(message, flags=self._flags(message.flags)), self.properties.ranges)
        has_both = all(map(math.isfinite, (*setpoint.angles, *setpoint.rates[1:])))
        if (isinstance(message, gimbal.GimbalManagerSetPitchyaw) and not behaviour.takes_pitchyaw
                or isinstance(message, gimbal.GimbalManagerSetManualControl)
                and not behaviour.takes_manual
                or has_both and not behaviour.angles_with_rates or self._lacks_an_axis(setpoint)):
            raise ValueError('the profile ignores it')
        return setpoint

    def _lacks_an_axis(self, setpoint: Setpoint) -> bool:
        """Return whether a setpoint has the angle of only one axis, and the profile ignores it."""
        _, pitch, yaw = setpoint.angles
        return math.isnan(pitch) is not math.isnan(yaw) and (
            self.behaviour.partial_angles is not None)

    def _obey(self, source: Address, setpoint: Setpoint, now: float) -> None:
        if self.behaviour.enforces_control and source == self.secondary != self.primary:
            # Nudging adds angles; a rate would override the angles of primary control.
            nudge = Range(-NUDGE_LIMIT, NUDGE_LIMIT)
            roll, pitch, yaw = (
                (own if math.isfinite(own) else 0.0) + nudge.clip(added)
                if math.isfinite(added) else math.nan
                for own, added in zip(self._base, setpoint.angles, strict=True))
            setpoint = Setpoint(setpoint.flags, setpoint.frame, (roll, pitch, yaw))
        else:
            self._base = setpoint.angles
        self._roi = None
        self.obey(setpoint, now)

    # Commands

    def execute(
        self, source: Address, command: AnyCommand, now: float,
    ) -> simulated.Reply:
        """See :meth:`SimulatedDevice.execute`."""
        if command.command not in self.changes:
            return None
        try:
            is_allowed, effect = self._consequence(source, command, now)
        except (ValueError, OverflowError) as error:
            return simulated.CommandReply(
                error.result if isinstance(error, Refused) else mavlink.MAV_RESULT_DENIED)
        return simulated.CommandReply(
            mavlink.MAV_RESULT_ACCEPTED if is_allowed else mavlink.MAV_RESULT_DENIED, effect)

    def _consequence(
        self, source: Address, command: AnyCommand, now: float,
    ) -> tuple[bool, simulated.Effect]:
        """Return whether the sender of a command has the control that it needs, and its effect."""
        params = params_of(command)
        *first, flags, _, _ = params
        if not self._is_for_device(params[DEVICE_ID_PARAM[command.command]]):
            raise Refused('another device')
        if command.command == mavlink.MAV_CMD_DO_GIMBAL_MANAGER_PITCHYAW:
            return self._may_control(source), partial(
                self._obey, source, self._pitchyaw(first, flags), now)
        if command.command == mavlink.MAV_CMD_DO_GIMBAL_MANAGER_CONFIGURE:
            return True, self._configure(source, first)
        is_allowed = not self.behaviour.enforces_roi or source == self.primary
        if command.command == mavlink.MAV_CMD_DO_SET_ROI_NONE:
            return is_allowed, partial(self._clear_roi, now)
        place, is_relative = read_roi(command)
        above = self.properties.position.altitude if is_relative else 0.0
        return is_allowed, partial(
            self._set_roi, place._replace(altitude=place.altitude + above), now)

    def _pitchyaw(self, values: Sequence[float], flags: float) -> Setpoint:
        pitch, yaw, *rates = map(math.radians, values)
        pitch_rate, yaw_rate = rates if self.behaviour.rates_in_degrees else values[2:]
        # int() of NaN raises ValueError, and of infinity OverflowError.
        setpoint = Setpoint.from_pitch_yaw(
            self._flags(int(flags)), pitch, yaw, pitch_rate, yaw_rate)
        if self._lacks_an_axis(setpoint):
            assert self.behaviour.partial_angles is not None
            raise Refused('an axis is lacking', self.behaviour.partial_angles)
        return setpoint

    def _configure(self, source: Address, values: Sequence[float]) -> simulated.Effect:
        behaviour = self.behaviour
        if not all(value % 1 == 0 and -3 <= value <= 255 for value in values):
            raise Refused('there is no such component', behaviour.invalid_configure)
        secondary = self._resolved(self.secondary, values[2:], source)
        return partial(self._give_control, self._resolved(self.primary, values[:2], source),
                       secondary if behaviour.has_secondary else NO_COMPONENT)

    def _resolved(
        self, current: Address, values: Sequence[float], source: Address,
    ) -> Address:
        """Return the component to which the values of CONFIGURE give control."""
        own = self.properties.address if self.behaviour.own_is_manager else source
        result = []
        for now_, value, itself, sender in zip(current, values, own, source, strict=True):
            releases = current == source if self.behaviour.releases_pairs else now_ == sender
            result.append({-1: now_, -2: itself, -3: 0 if releases else now_}.get(
                int(value), int(value)))
        return Address(*result)

    def _give_control(self, primary: Address, secondary: Address) -> None:
        if primary != self.primary:
            self._base = UNSET_VECTOR
        self.primary, self.secondary = primary, secondary

    # Region of interest

    def _set_roi(self, place: GeoPoint, now: float) -> None:
        self._roi = place
        self._point_at_roi(now)

    def _clear_roi(self, now: float) -> None:
        # "After this command the gimbal manager should ... assume a neutral position."
        self._roi = None
        self.obey(Setpoint(mavlink.GIMBAL_DEVICE_FLAGS_NEUTRAL | LEVEL), now)

    def _point_at_roi(self, now: float) -> None:
        if self._roi is not None and (angles := direction(self._position, self._roi)):
            self.obey(Setpoint(
                LEVEL | mavlink.GIMBAL_DEVICE_FLAGS_YAW_LOCK, YawFrame.EARTH, (0.0, *angles)), now)

    def snapshot(self, now: float) -> simulated.Snapshot:
        """See :meth:`SimulatedDevice.snapshot`."""
        control = ', '.join(
            f'{name} {one}' for name, one in (
                ('primary', self.primary), ('secondary', self.secondary)) if one != NO_COMPONENT)
        return self.describe(
            now, control or 'no control', 'region of interest' if self._roi else '')


SIMULATED = simulated.SimulatedType(
    'manager', 'managers', SimulatedManager, ManagerProperties(), PROFILES,
    examples=(
        '--payload gimbal_manager --heading 40',
        '--payload gimbal_manager --profile ardupilot --fault frozen-axis=yaw'),
    mavlink_version=2)
