# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""
The checks of a gimbal manager: control, setpoints, and the reports on its gimbal.

The checks play two players: one with our own address, and a second one in the system of the
manager. They do not check -2 in MAV_CMD_DO_GIMBAL_MANAGER_CONFIGURE: implementations differ in the
component that it means.
"""

from __future__ import annotations

from collections.abc import Callable
import math

from . import attitude
from .attitude import ignores, moves, reaches, turns
from .session import (
    FORWARD,
    GIMBAL,
    GimbalSession,
    NAN,
    Pose,
    PROPOSAL,
    RATE,
    STEP,
    TOLERANCE,
)
from .. import messages as gimbal
from ..commands import Control
from ..messages import NON_MAVLINK_IDS
from ...checks import component_requirements as component
from ...checks.outcomes import fail_if, Failed, Skipped
from ...checks.requirements import PayloadChecks, Requirement, requirement
from ...checks.session import Conditions, Session, Transaction
from ...checks.specifications import MESSAGES, ROUTING
from ...geometry.mount_attitude import Wxyz
from ...geometry.rotation import Vector
from ...mavlink.dialect import mavlink
from ...mavlink.messages import Address, Message, time_boot_ms
from ...payload.messages import Attitude, GlobalPositionInt
from ...payload.messages import GimbalDeviceAttitudeStatus as AttitudeStatus

INFORMATION, MANAGER_STATUS = gimbal.GimbalManagerInformation, gimbal.GimbalManagerStatus
PITCHYAW, CONFIGURE = (mavlink.MAV_CMD_DO_GIMBAL_MANAGER_PITCHYAW,
                       mavlink.MAV_CMD_DO_GIMBAL_MANAGER_CONFIGURE)
# Sections of the specifications.
PITCHYAW_COMMAND = 'MAV_CMD_DO_GIMBAL_MANAGER_PITCHYAW'
CONFIGURE_COMMAND = 'MAV_CMD_DO_GIMBAL_MANAGER_CONFIGURE'
STARTING = 'Starting / Configuring Gimbal Control'
ADDRESSING = 'Addressing of Gimbal MAVLink Devices'
# Four values of CONFIGURE_COMMAND: leave control as it is, and end the control of the sender.
UNCHANGED, RELEASE = (-1.0,) * 4, (-3.0,) * 4
# s from an acknowledgement to the status that shows the control.
SHOWN_TIMEOUT = 1.5
# The vehicle that is played, 1e-7 degrees and mm, and its heading, degrees; a place 111 m north of
# the vehicle and 30 m below it, degrees and m; the pose that points at this place.
VEHICLE = (474_000_000, 85_000_000, 500_000)
HEADING = 15.0
PLACE = (47.401, 8.5, 470.0)
AT_PLACE = (-15.1, -HEADING)
SetpointMessage = gimbal.GimbalManagerSetPitchyaw | gimbal.GimbalManagerSetManualControl


class ManagerSession(GimbalSession):
    """
    Plays players that take control of a gimbal manager, and command it.

    :ivar vehicle: the autopilot that is played, None for none.
    """

    messages = (*Session.messages, INFORMATION, MANAGER_STATUS, AttitudeStatus)
    discovery = INFORMATION
    information = INFORMATION
    status = MANAGER_STATUS

    def __init__(self, conditions: Conditions) -> None:
        super().__init__(conditions)
        self.vehicle: Address | None = None
        self._before_control = Control()

    def is_device(self, message: Message) -> bool:
        """See :class:`Session`."""
        return isinstance(message, INFORMATION | MANAGER_STATUS)

    def is_part(self, source: Address) -> bool:
        """See :class:`Session`: the gimbal device may be a component of its own."""
        found, device_id = self.components.found, self.device_id
        return (found is not None and device_id not in NON_MAVLINK_IDS
                and source == (found.system, device_id))

    @property
    def other(self) -> Address:
        """Return the address of the second player."""
        return self.components.free_component()

    @property
    def device_id(self) -> int:
        """Return the gimbal device that the manager is responsible for, 0 if unknown."""
        known = self.received(MANAGER_STATUS), self.received(INFORMATION)
        return next((int(one[-1][1].gimbal_device_id) for one in known if one), 0)

    # Control

    async def control(self) -> Control:
        """Return the players in control; raise Skipped if the manager does not report them."""
        return Control.of(await self.newest(MANAGER_STATUS, 'who has control'))

    async def configure(self, *values: float, source: Address | None = None) -> Transaction:
        """Send MAV_CMD_DO_GIMBAL_MANAGER_CONFIGURE with four values."""
        return await self.command(CONFIGURE, *values, 0.0, 0.0, self.device_id, source=source)

    async def take(self, primary: Address, secondary: Address | None = None) -> None:
        """Give control to two players; raise Failed if the manager refuses or does not show it."""
        wanted = Control(primary, secondary)
        await self.leads_to(await self.configure(*wanted.params()), lambda one: one == wanted)

    async def leads_to(self, one: Transaction, wanted: Callable[[Control], bool]) -> None:
        """Raise Failed if a command is refused or does not lead to the wanted control."""
        end = self.now + SHOWN_TIMEOUT
        while not wanted(control := await self.control()) and self.now < end:
            await self.pause(0.1)
        if not one.accepted or not wanted(control):
            raise one.failure(f'{one.answer}, and then {control}')

    async def prepare(self) -> None:
        """Take primary control; the second player releases any control that it has."""
        if (await self.control()).includes(self.other):
            await self.configure(*RELEASE, source=self.other)
        own = self.address
        if (await self.control()).primary != own:
            one = await self.configure(*Control(own).params())
            await self.pause(0.3)
            holder = (await self.control()).primary
            # The holder must consent (GM-17), or any component may take control.
            if not one.accepted and holder not in (own, self.other, None):
                raise Skipped(f'{one.answer}: {holder} keeps primary control')

    async def pause(self, seconds: float) -> None:
        """See :class:`GimbalSession`."""
        if self.vehicle is not None:
            milliseconds = time_boot_ms(self.now)
            self.send(Attitude(
                milliseconds, 0.0, 0.0, math.radians(HEADING), 0.0, 0.0, 0.0), self.vehicle)
            self.send(GlobalPositionInt(
                milliseconds, *VEHICLE, 0, 0, 0, 0, int(100 * HEADING)), self.vehicle)
        await super().pause(seconds)

    # Setpoints

    def setpoint(
        self, target: Address, device_id: int | None, flags: int, q: Wxyz, rates: Vector,
    ) -> Message:
        """See :class:`GimbalSession`."""
        return gimbal.GimbalManagerSetAttitude(
            *target, flags, self.device_id if device_id is None else device_id, q, *rates)

    async def send_angles(
        self, cls: type[SetpointMessage], pitch: float = NAN, yaw: float = NAN,
        pitch_rate: float = NAN, yaw_rate: float = NAN, source: Address | None = None,
    ) -> None:
        """Send SET_PITCHYAW (rad) or SET_MANUAL_CONTROL."""
        self.send(cls(*self.device, FORWARD, self.device_id, pitch, yaw, pitch_rate, yaw_rate),
                  source)

    async def set_pitchyaw(self, pose: Pose, source: Address | None = None) -> None:
        """Send SET_PITCHYAW."""
        await self.send_angles(gimbal.GimbalManagerSetPitchyaw, math.radians(pose.pitch),
                               math.radians(pose.yaw), source=source)

    async def pitchyaw(
        self, pitch: float = NAN, yaw: float = NAN, pitch_rate: float = NAN,
        yaw_rate: float = NAN, source: Address | None = None, device_id: int | None = None,
    ) -> Transaction:
        """Send MAV_CMD_DO_GIMBAL_MANAGER_PITCHYAW, degrees."""
        return await self.command(
            PITCHYAW, pitch, yaw, pitch_rate, yaw_rate, FORWARD, 0.0,
            self.device_id if device_id is None else device_id, source=source)

    # Restoring

    async def save(self) -> str | None:
        """See :class:`Session`."""
        try:
            self._before_control = await self.control()
        except Skipped:
            return None
        pose = await super().save()
        return pose and f'{pose}, control: {self._before_control}'

    async def restore(self) -> list[str]:
        """See :class:`Session`."""
        differing, before = await super().restore(), self._before_control
        try:
            if await self.control() != before:
                await self.configure(*before.params())
            is_back = await self.control() == before
        except Skipped:
            is_back = False
        return differing if is_back else [*differing, 'control']


# Reports

@requirement('manager-status-request', 'sends GIMBAL_MANAGER_STATUS with the gimbal device of '
             'its INFORMATION (GM-27)', GIMBAL, 'Mapping from Gimbal Managers to Gimbal Devices')
async def same_device(manager: ManagerSession) -> str:
    """Compare the ids."""
    information = (await manager.required(INFORMATION)).gimbal_device_id
    status = (await manager.newest(MANAGER_STATUS, 'its gimbal device')).gimbal_device_id
    if not information == status != 0:
        raise Failed(f'gimbal_device_id {information} in INFORMATION, {status} in STATUS')
    return f'gimbal device {status}'


@requirement('attitude-stream', 'sends the attitude of a gimbal that is not a component of its '
             'own (GM-22)', GIMBAL, 'Addressing of non-MAVLink gimbal devices')
async def attitude_stream(manager: ManagerSession) -> str:
    """Wait for statuses with the id of the gimbal."""
    if manager.device_id not in NON_MAVLINK_IDS:
        raise Skipped('its gimbal is a MAVLink component of its own')
    received = [one.gimbal_device_id for _, one in manager.received(AttitudeStatus)]
    if not received:
        raise Failed('none was received')
    if set(received) != {manager.device_id}:
        raise Failed(f'gimbal_device_id {sorted(set(received))}, not {manager.device_id}')
    return f'{len(received)} statuses'


# Control

@moves('take', 'gives primary control to a component that asks, and shows it', GIMBAL, STARTING)
async def take(manager: ManagerSession) -> str:
    """Take primary control."""
    await manager.take(manager.address)
    return str(await manager.control())


@moves('release', 'ends the control of a component that releases it', MESSAGES, CONFIGURE_COMMAND)
async def release(manager: ManagerSession) -> None:
    """Send -3, which releases control."""
    await manager.prepare()
    one = await manager.configure(*RELEASE)
    await manager.leads_to(one, lambda control: control.primary is None)


@moves('release-others', 'keeps the control of a component when another one releases', MESSAGES,
       CONFIGURE_COMMAND)
async def release_others(manager: ManagerSession) -> None:
    """Send -3 from two other components: one has our component id, one our system id."""
    await manager.prepare()
    own = manager.address
    before = await manager.control()
    for source in (Address(manager.other.system, own.component),
                   Address(own.system, own.component ^ 1)):
        if source != own:
            one = await manager.configure(*RELEASE, source=source)
            await manager.pause(0.5)
            if (control := await manager.control()) != before:
                raise one.failure(f'from {source}: {control}')


@moves('secondary', 'gives secondary control, and shows it', MESSAGES, CONFIGURE_COMMAND)
async def secondary(manager: ManagerSession) -> None:
    """Give secondary control to the second player."""
    try:
        await manager.take(manager.address, manager.other)
    finally:
        # A manager may let only the holder end secondary control (GM-17).
        await manager.configure(*RELEASE, source=manager.other)


@moves('unchanged', 'leaves control as it is at -1', MESSAGES, CONFIGURE_COMMAND)
async def unchanged(manager: ManagerSession) -> None:
    """Send -1."""
    await manager.prepare()
    before = await manager.control()
    one = await manager.configure(*UNCHANGED)
    await manager.pause(0.5)
    await manager.leads_to(one, lambda control: control == before)


@moves('configure-values', 'rejects ids that do not exist', MESSAGES, CONFIGURE_COMMAND)
async def configure_values(manager: ManagerSession) -> None:
    """Send -4 and 256."""
    await manager.prepare()
    sent = [await manager.configure(value, value, -1, -1) for value in (-4, 256)]
    fail_if([one.failure() if one.accepted or one.result is None else None for one in sent])


@moves('one-player', 'obeys one player at a time when a second one takes control (GM-16)',
       PROPOSAL, 'Proposed Architecture')
async def one_player(manager: ManagerSession) -> str:
    """Let the second player take control; the player without control must not move the gimbal."""
    before, other = await manager.begin(), manager.other
    one = await manager.configure(*Control(other).params(), source=other)
    await manager.pause(0.5)
    holder = (await manager.control()).primary
    if one.accepted is not (holder == other):
        raise one.failure(f'{one.answer}, and then primary {holder or "none"}')
    loser = manager.address if holder == other else other
    await manager.point(await manager.target(-2 * STEP, STEP), source=loser)
    await manager.stays(before, f'primary {holder}, a setpoint of {loser}')
    return ('the second player took control' if holder == other else
            'the first player kept control')


# Setpoints

async def _send_messages(manager: ManagerSession, pose: Pose) -> None:
    """Send each message that sets an attitude from the second player."""
    other = manager.other
    await manager.point(pose, source=other)
    await manager.set_pitchyaw(pose, source=other)
    await manager.send_angles(gimbal.GimbalManagerSetManualControl, pitch_rate=-0.3, yaw_rate=0.3,
                              source=other)


async def _clear_roi(manager: ManagerSession, pose: Pose) -> Transaction:
    """Clear the region from the second player; success would turn the gimbal to neutral."""
    await manager.requires(mavlink.GIMBAL_DEVICE_CAP_FLAGS_CAN_POINT_LOCATION_GLOBAL)
    return await manager.command(
        mavlink.MAV_CMD_DO_SET_ROI_NONE, manager.device_id, source=manager.other)


async def _point_other_device(manager: ManagerSession, pose: Pose) -> Transaction:
    """Send a message and a command for a device that does not exist."""
    device_id = next(n for n in (6, 175) if n != manager.device_id)
    await manager.point(pose, device_id=device_id)
    return await manager.pitchyaw(pose.pitch, pose.yaw, device_id=device_id)


@moves('earth-frame', 'takes yaw relative to north (GM-2)', MESSAGES, 'GIMBAL_MANAGER_FLAGS')
async def earth_frame(manager: ManagerSession) -> str:
    """Command a yaw relative to north, at the heading that the vehicle has."""
    await manager.requires(mavlink.GIMBAL_DEVICE_CAP_FLAGS_SUPPORTS_YAW_IN_EARTH_FRAME)
    heading = (await manager.begin()).heading
    if not abs(heading) > 2 * TOLERANCE:
        raise Skipped('it does not report delta_yaw' if math.isnan(heading) else
                      'the vehicle heads north, where both frames are the same')
    return await attitude.turn_from_north(manager, heading)


@moves('flags-shown', 'shows the flags of the setpoint in GIMBAL_MANAGER_STATUS', MESSAGES,
       'GIMBAL_MANAGER_STATUS')
async def flags_shown(manager: ManagerSession) -> None:
    """Command NEUTRAL, and read the status."""
    await manager.requires(mavlink.GIMBAL_DEVICE_CAP_FLAGS_HAS_NEUTRAL)
    await manager.begin()
    await manager.point(None, flags=FORWARD | mavlink.GIMBAL_DEVICE_FLAGS_NEUTRAL)
    await manager.pause(0.5)
    status = await manager.newest(MANAGER_STATUS, 'its flags')
    if not status.flags & mavlink.GIMBAL_DEVICE_FLAGS_NEUTRAL:
        raise Failed(f'flags 0x{status.flags:x}')


@moves('other-target', 'ignores setpoints and commands for other components', ROUTING,
       'Routing Detail')
async def other_target(manager: ManagerSession) -> None:
    """Send a setpoint and a command to a component that does not exist."""
    before, other = await manager.begin(), manager.components.free_component(200)
    pose = await manager.target(-2 * STEP, STEP)
    await manager.point(pose, target=other)
    one = await manager.command(
        PITCHYAW, pose.pitch, pose.yaw, NAN, NAN, FORWARD, 0.0, manager.device_id, target=other,
        is_foreign=True)
    await manager.stays(before, f'setpoints for {other}')
    if one.acks:
        raise one.failure(f'answered a command for {other}: {one.answer}')


@moves('roi', 'points at a place, and stops on command (GM-8)', GIMBAL, 'Gimbal Manager Messages')
async def roi(manager: ManagerSession) -> str:
    """Set a place north of the vehicle; play the autopilot if none is heard."""
    await manager.requires(mavlink.GIMBAL_DEVICE_CAP_FLAGS_CAN_POINT_LOCATION_GLOBAL)
    await manager.begin()
    autopilot = Address(manager.device.system, mavlink.MAV_COMP_ID_AUTOPILOT1)
    manager.vehicle = None if autopilot in manager.components.heard else autopilot
    try:
        await manager.pause(0.5)
        one = await _set_roi(manager)
        if not one.accepted and manager.vehicle is None:
            raise Skipped(f'{one.answer}: the position of the vehicle may be unknown')
        one.expect(accepted=True)
        if manager.vehicle is not None:
            await manager.reach(await manager.target(*AT_PLACE))
        pose = await manager.pose()
        one = await manager.command(mavlink.MAV_CMD_DO_SET_ROI_NONE, manager.device_id)
        one.expect(accepted=True)
        return str(pose)
    finally:
        manager.vehicle = None


async def _set_roi(manager: ManagerSession) -> Transaction:
    """Send the place as COMMAND_INT, and as COMMAND_LONG if the manager does not take that."""
    roi, (latitude, longitude, altitude) = mavlink.MAV_CMD_DO_SET_ROI_LOCATION, PLACE
    ids = manager.device_id, 0.0, 0.0, 0.0
    one = await manager.command(
        roi, *ids, latitude * 1e7, longitude * 1e7, altitude, as_int=True)
    if one.result in (None, mavlink.MAV_RESULT_UNSUPPORTED, mavlink.MAV_RESULT_COMMAND_LONG_ONLY):
        one = await manager.command(roi, *ids, *PLACE)
    return one


OWN: tuple[Requirement[ManagerSession], ...] = (
    component.status_stream(MANAGER_STATUS, GIMBAL, 'Gimbal Manager Status'),
    component.sent_on_request(
        'status-request', MANAGER_STATUS, MESSAGES, MANAGER_STATUS.msgname, optional=True),
    attitude.failures_at_rest,
    component.sent_on_request('information', INFORMATION, GIMBAL, 'Discovery of Gimbal Manager'),
    *attitude.information(INFORMATION), same_device, attitude_stream,
    attitude.command_int(INFORMATION),
    take, release, unchanged, release_others, secondary, configure_values, one_player,
    moves('set-attitude', 'turns to an attitude (GIMBAL_MANAGER_SET_ATTITUDE)', GIMBAL,
          'Controlling Gimbal Angle and/or Angular Rate using MAVLink')(
        reaches(ManagerSession.point)),
    *attitude.MOTION,
    moves('angles-with-rates', 'turns to angles at rates (GIMBAL_MANAGER_SET_ATTITUDE)',
          MESSAGES, PITCHYAW_COMMAND)(
        reaches(lambda manager, pose: manager.point(pose, rates=(3 * RATE,) * 3))),
    moves('set-pitchyaw', 'turns to angles (GIMBAL_MANAGER_SET_PITCHYAW)', MESSAGES,
          'GIMBAL_MANAGER_SET_PITCHYAW')(reaches(ManagerSession.set_pitchyaw)),
    moves('pitchyaw', f'turns to angles ({PITCHYAW_COMMAND})', MESSAGES, PITCHYAW_COMMAND)(
        reaches(lambda manager, pose: manager.pitchyaw(pose.pitch, pose.yaw))),
    # A manager that reads this low rate as rad/s is detected and does no harm.
    moves('pitchyaw-rate', f'turns at rates in deg/s ({PITCHYAW_COMMAND})', MESSAGES,
          PITCHYAW_COMMAND)(turns(
              lambda manager, speed: manager.pitchyaw(pitch_rate=speed, yaw_rate=0.0), 2.0)),
    moves('one-axis', f'changes one angle and keeps the other ({PITCHYAW_COMMAND})', MESSAGES,
          PITCHYAW_COMMAND)(reaches(lambda manager, pose: manager.pitchyaw(pose.pitch), 0.0)),
    # A fifth of the full rate.
    moves('manual', 'turns by manual control (GIMBAL_MANAGER_SET_MANUAL_CONTROL)', GIMBAL,
          'Manual Gimbal Control using MAVLink')(turns(
              lambda manager, speed: manager.send_angles(
                  gimbal.GimbalManagerSetManualControl, pitch_rate=speed / 10, yaw_rate=0.0),
              2.0, fastest=math.inf)),
    earth_frame, flags_shown, roi,
    moves('no-control-command', f'rejects {PITCHYAW_COMMAND} of a component without control '
          '(GM-19)', GIMBAL, STARTING)(
        ignores('a command of the second player', lambda manager, pose: manager.pitchyaw(
            pose.pitch, pose.yaw, source=manager.other))),
    moves('no-control-messages', 'ignores setpoint messages of a component without control '
          '(GM-19)', GIMBAL, STARTING)(
        ignores('setpoints of the second player', _send_messages)),
    moves('no-control-roi', 'rejects a region of interest of a component without control '
          '(GM-11)', GIMBAL, STARTING)(ignores('a command of the second player', _clear_roi)),
    moves('other-device', 'ignores setpoints and commands for other gimbal devices (GM-28)',
          GIMBAL, ADDRESSING)(
        ignores('setpoints for another gimbal device', _point_other_device)),
    moves('all-devices', 'treats gimbal device 0 as all of its gimbals (GM-28)', GIMBAL,
          ADDRESSING)(reaches(lambda manager, pose: manager.point(pose, device_id=0))),
    other_target, *attitude.STATUSES,
)
REQUIREMENTS = component.with_common(OWN, MANAGER_STATUS, INFORMATION)
CHECKS: PayloadChecks[ManagerSession] = PayloadChecks(
    payload='gimbal_manager', device='gimbal manager', session=ManagerSession,
    requirements=REQUIREMENTS,
    evidence='GIMBAL_MANAGER_STATUS or GIMBAL_MANAGER_INFORMATION',
    risk='give control away, and turn its gimbal to all sides and to the end of its range',
    question='Most checks take control of gimbal manager {device}, and turn its gimbal, also to '
             'the end of its\nrange and to its retracted position. At the end it is turned back, '
             'and control is restored.\nMay the checks control gimbal manager {device}? [y/N] ',
    mavlink_version=2)
