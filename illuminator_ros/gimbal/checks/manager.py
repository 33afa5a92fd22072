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
from .attitude import earth_yaw, ignores, moves, reaches, turns
from .tester import (
    Control,
    control_of,
    control_text,
    describe,
    GIMBAL,
    GimbalTester,
    NAN,
    Pose,
    PROPOSAL,
    quaternion_of,
    radians,
    RATE,
    STEP,
    TOLERANCE,
)
from .. import messages as gimbal
from ..axes import LEVEL
from ..messages import NO_COMPONENT
from ...mavlink.dialect import mavlink
from ...mavlink.messages import Address, Message, time_boot_ms
from ...payload.checks import component_requirements as component
from ...payload.checks.outcomes import fail_if, Failed, Skipped
from ...payload.checks.requirement import (
    Conditions,
    MESSAGES,
    PayloadChecks,
    Requirement,
    requirement,
    ROUTING,
)
from ...payload.checks.session import Session, Transaction
from ...payload.messages import Attitude, GlobalPositionInt
from ...payload.messages import GimbalDeviceAttitudeStatus as AttitudeStatus
from ...payload.mount_attitude import UNSET_VECTOR

INFORMATION, MANAGER_STATUS = gimbal.GimbalManagerInformation, gimbal.GimbalManagerStatus
PITCHYAW, CONFIGURE = (mavlink.MAV_CMD_DO_GIMBAL_MANAGER_PITCHYAW,
                       mavlink.MAV_CMD_DO_GIMBAL_MANAGER_CONFIGURE)
VEHICLE_FRAME = mavlink.GIMBAL_DEVICE_FLAGS_YAW_IN_VEHICLE_FRAME
# Sections of the specifications.
PITCHYAW_COMMAND = 'MAV_CMD_DO_GIMBAL_MANAGER_PITCHYAW'
CONFIGURE_COMMAND = 'MAV_CMD_DO_GIMBAL_MANAGER_CONFIGURE'
STARTING = 'Starting / Configuring Gimbal Control'
ADDRESSING = 'Addressing of Gimbal MAVLink Devices'
# s from an acknowledgement to the status that shows the control.
SHOWN_TIMEOUT = 1.5
# The vehicle that is played, 1e-7 degrees and mm, and its heading, degrees; a place 111 m north of
# the vehicle and 30 m below it, 1e-7 degrees and m.
VEHICLE = (474_000_000, 85_000_000, 500_000)
HEADING = 15.0
PLACE = (474_010_000, 85_000_000, 470.0)
NORTH = Pose(0.0, -15.1, -HEADING)


class ManagerTester(GimbalTester):
    """
    Plays players that take control of a gimbal manager, and command it.

    :ivar vehicle: the autopilot that is played, None for none.
    """

    information = INFORMATION
    status = MANAGER_STATUS

    def __init__(self, session: Session, conditions: Conditions) -> None:
        super().__init__(session, conditions)
        self.vehicle: Address | None = None
        self._control_before: Control | None = None

    @property
    def other(self) -> Address:
        """Return the address of the second player."""
        return self.session.components.free_component()

    @property
    def device_id(self) -> int:
        """Return the gimbal device that the manager is responsible for, 0 if unknown."""
        known = self.session.received(MANAGER_STATUS), self.session.received(INFORMATION)
        return next((int(one[-1][1].gimbal_device_id) for one in known if one), 0)

    # Control

    async def control(self) -> Control:
        """Return the players in control; raise Skipped if the manager does not report them."""
        return control_of(await self.newest(MANAGER_STATUS, 'who has control'))

    async def configure(self, *values: float, source: Address | None = None) -> Transaction:
        """Send MAV_CMD_DO_GIMBAL_MANAGER_CONFIGURE with four values."""
        return await self.session.command(
            CONFIGURE, *values, 0.0, 0.0, self.device_id, source=source)

    async def shown(self, condition: Callable[[Control], bool]) -> Control:
        """Return the control once it meets a condition, or after :data:`SHOWN_TIMEOUT`."""
        end = self.session.now + SHOWN_TIMEOUT
        while not condition(control := await self.control()) and self.session.now < end:
            await self.pause(0.1)
        return control

    async def take(self, primary: Address, secondary: Address = NO_COMPONENT) -> None:
        """Give control to two players; raise Failed if the manager refuses or does not show it."""
        one = await self.configure(*primary, *secondary)
        await self.leads_to(one, lambda control: control == (primary, secondary))

    async def leads_to(self, one: Transaction, wanted: Callable[[Control], bool]) -> None:
        """Raise Failed if a command is refused or does not lead to the wanted control."""
        control = await self.shown(wanted)
        if not one.accepted or not wanted(control):
            raise one.failure(f'{one.answer}, and then {control_text(control)}')

    async def prepare(self) -> None:
        """Take primary control; the second player releases any control that it has."""
        if self.other in await self.control():
            await self.configure(-3.0, -3.0, -3.0, -3.0, source=self.other)
        own = self.session.address
        if (await self.control())[0] != own:
            one = await self.configure(*own, *NO_COMPONENT)
            await self.pause(0.3)
            holder = (await self.control())[0]
            # The holder must consent (GM-17), or any component may take control.
            if not one.accepted and holder not in (own, self.other, NO_COMPONENT):
                raise Skipped(f'{one.answer}: {holder} keeps primary control')

    async def pause(self, seconds: float) -> None:
        """See :class:`GimbalTester`."""
        if self.vehicle is not None:
            milliseconds = time_boot_ms(self.session.now)
            self.session.send(Attitude(
                milliseconds, 0.0, 0.0, math.radians(HEADING), 0.0, 0.0, 0.0), self.vehicle)
            self.session.send(GlobalPositionInt(
                milliseconds, *VEHICLE, 0, 0, 0, 0, int(100 * HEADING)), self.vehicle)
        await super().pause(seconds)

    # Setpoints

    async def point(
        self, pose: Pose | None, *, flags: int = LEVEL | VEHICLE_FRAME,
        rates: tuple[float, float, float] = UNSET_VECTOR, source: Address | None = None,
        device_id: int | None = None,
    ) -> None:
        """See :class:`GimbalTester`: GIMBAL_MANAGER_SET_ATTITUDE of a player."""
        self.session.send(gimbal.GimbalManagerSetAttitude(
            *self.session.device, flags, self.device_id if device_id is None else device_id,
            quaternion_of(pose), *radians(rates)), source)

    async def send(
        self, cls: type[gimbal.GimbalManagerSetPitchyaw | gimbal.GimbalManagerSetManualControl],
        pitch: float = NAN, yaw: float = NAN, pitch_rate: float = NAN, yaw_rate: float = NAN,
        source: Address | None = None,
    ) -> None:
        """Send SET_PITCHYAW (rad) or SET_MANUAL_CONTROL."""
        self.session.send(
            cls(*self.session.device, int(LEVEL | VEHICLE_FRAME), self.device_id, pitch, yaw,
                pitch_rate, yaw_rate), source)

    async def pitchyaw(
        self, *values: float, source: Address | None = None, device_id: float | None = None,
    ) -> Transaction:
        """Send MAV_CMD_DO_GIMBAL_MANAGER_PITCHYAW with four values, degrees."""
        return await self.session.command(
            PITCHYAW, *values, float(LEVEL | VEHICLE_FRAME), 0.0,
            self.device_id if device_id is None else device_id, source=source)

    # Restoring

    async def save(self) -> bool:
        """See :class:`Tester`."""
        if self._control_before is None:
            try:
                self._control_before = await self.control()
            except Skipped:
                return False
        return await super().save()

    @property
    def saved(self) -> str:
        """See :class:`Tester`."""
        assert self._control_before is not None
        return f'{super().saved}, control: {control_text(self._control_before)}'

    async def restore(self) -> list[str]:
        """See :class:`Tester`."""
        differing, before = await super().restore(), self._control_before
        assert before is not None
        try:
            if await self.control() != before:
                await self.configure(*before[0], *before[1])
            if await self.shown(lambda control: control == before) != before:
                differing.append('control')
        except Skipped:
            differing.append('control')
        return differing


# Reports

@requirement('manager-status-request', 'sends GIMBAL_MANAGER_STATUS with the gimbal device of '
             'its INFORMATION (GM-27)', GIMBAL, 'Mapping from Gimbal Managers to Gimbal Devices')
async def same_device(tester: ManagerTester) -> str:
    """Compare the ids."""
    information = await tester.session.required(INFORMATION)
    status = await tester.newest(MANAGER_STATUS, 'its gimbal device')
    found = {information.gimbal_device_id, status.gimbal_device_id}
    if len(found) != 1 or 0 in found:
        raise Failed(f'gimbal_device_id {information.gimbal_device_id} in INFORMATION, '
                     f'{status.gimbal_device_id} in STATUS')
    return f'gimbal device {status.gimbal_device_id}'


@requirement('attitude-stream', 'sends the attitude of a gimbal that is not a component of its '
             'own (GM-22)', GIMBAL, 'Addressing of non-MAVLink gimbal devices')
async def attitude_stream(tester: ManagerTester) -> str:
    """Wait for statuses with the id of the gimbal."""
    if tester.device_id not in gimbal.NON_MAVLINK_IDS:
        raise Skipped('its gimbal is a MAVLink component of its own')
    received = [one.gimbal_device_id for _, one in tester.session.received(AttitudeStatus)]
    if not received:
        raise Failed('none was received')
    if set(received) != {tester.device_id}:
        raise Failed(f'gimbal_device_id {sorted(set(received))}, not {tester.device_id}')
    return f'{len(received)} statuses'


# Control

@moves('take', 'gives primary control to a component that asks, and shows it', GIMBAL, STARTING)
async def take(tester: ManagerTester) -> str:
    """Take primary control."""
    await tester.take(tester.session.address)
    return control_text(await tester.control())


@moves('release', 'ends the control of a component that releases it', MESSAGES, CONFIGURE_COMMAND)
async def release(tester: ManagerTester) -> None:
    """Send -3, which releases control."""
    await tester.prepare()
    one = await tester.configure(-3, -3, -3, -3)
    await tester.leads_to(one, lambda control: control[0] == NO_COMPONENT)


@moves('release-others', 'keeps the control of a component when another one releases', MESSAGES,
       CONFIGURE_COMMAND)
async def release_others(tester: ManagerTester) -> None:
    """Send -3 from two other components: one has our component id, one our system id."""
    await tester.prepare()
    own = tester.session.address
    before = await tester.control()
    for source in (Address(tester.other.system, own.component),
                   Address(own.system, own.component ^ 1)):
        if source == own:
            continue
        one = await tester.configure(-3, -3, -3, -3, source=source)
        await tester.pause(0.5)
        if (control := await tester.control()) != before:
            raise one.failure(f'from {source}: {control_text(control)}')


@moves('secondary', 'gives secondary control, and shows it', MESSAGES, CONFIGURE_COMMAND)
async def secondary(tester: ManagerTester) -> None:
    """Give secondary control to the second player."""
    try:
        await tester.take(tester.session.address, tester.other)
    finally:
        # A manager may let only the holder end secondary control (GM-17).
        await tester.configure(-3, -3, -3, -3, source=tester.other)


@moves('unchanged', 'leaves control as it is at -1', MESSAGES, CONFIGURE_COMMAND)
async def unchanged(tester: ManagerTester) -> None:
    """Send -1."""
    await tester.prepare()
    before = await tester.control()
    one = await tester.configure(-1, -1, -1, -1)
    await tester.pause(0.5)
    await tester.leads_to(one, lambda control: control == before)


@moves('configure-values', 'rejects ids that do not exist', MESSAGES, CONFIGURE_COMMAND)
async def configure_values(tester: ManagerTester) -> None:
    """Send -4 and 256."""
    await tester.prepare()
    sent = [await tester.configure(value, value, -1, -1) for value in (-4, 256)]
    fail_if([one.failure() if one.accepted or one.result is None else None for one in sent])


@moves('one-player', 'obeys one player at a time when a second one takes control (GM-16)',
       PROPOSAL, 'Proposed Architecture')
async def one_player(tester: ManagerTester) -> str:
    """Let the second player take control; the player without control must not move the gimbal."""
    before, other = await tester.begin(), tester.other
    one = await tester.configure(*other, *NO_COMPONENT, source=other)
    await tester.pause(0.5)
    holder = (await tester.control())[0]
    if one.accepted is not (holder == other):
        raise one.failure(f'{one.answer}, and then primary {holder}')
    loser = tester.session.address if holder == other else other
    await tester.point(await tester.target(-2 * STEP, STEP), source=loser)
    await tester.stays(before, f'primary {holder}, a setpoint of {loser}')
    return ('the second player took control' if holder == other else
            'the first player kept control')


# Setpoints

async def _send_messages(tester: ManagerTester, pose: Pose) -> None:
    """Send each message that sets an attitude from the second player."""
    other = tester.other
    await tester.point(pose, source=other)
    await tester.send(gimbal.GimbalManagerSetPitchyaw, math.radians(pose.pitch),
                      math.radians(pose.yaw), source=other)
    await tester.send(gimbal.GimbalManagerSetManualControl, pitch_rate=-0.3, yaw_rate=0.3,
                      source=other)


async def _clear_roi(tester: ManagerTester, pose: Pose) -> Transaction:
    """Clear the region from the second player; success would turn the gimbal to neutral."""
    await tester.requires(mavlink.GIMBAL_DEVICE_CAP_FLAGS_CAN_POINT_LOCATION_GLOBAL)
    return await tester.session.command(
        mavlink.MAV_CMD_DO_SET_ROI_NONE, tester.device_id, source=tester.other)


async def _point_other_device(tester: ManagerTester, pose: Pose) -> Transaction:
    """Send a message and a command for a device that does not exist."""
    device_id = next(n for n in (6, 175) if n != tester.device_id)
    await tester.point(pose, device_id=device_id)
    return await tester.pitchyaw(pose.pitch, pose.yaw, NAN, NAN, device_id=device_id)


@moves('earth-frame', 'takes yaw relative to north (GM-2)', MESSAGES, 'GIMBAL_MANAGER_FLAGS')
async def earth_frame(tester: ManagerTester) -> str:
    """Command a yaw relative to north without locking it."""
    await tester.requires(mavlink.GIMBAL_DEVICE_CAP_FLAGS_SUPPORTS_YAW_IN_EARTH_FRAME)
    start = await tester.begin()
    if not abs(start.heading) > 2 * TOLERANCE:
        raise Skipped('it does not report delta_yaw' if math.isnan(start.heading) else
                      'the vehicle heads north, where both frames are the same')
    target = await tester.target(-STEP, STEP)
    (yaw,) = earth_yaw([Pose(0.0, target.pitch, target.yaw, heading=start.heading)])
    await tester.point(Pose(0.0, target.pitch, yaw),
                       flags=LEVEL | mavlink.GIMBAL_DEVICE_FLAGS_YAW_IN_EARTH_FRAME)
    pose = await tester.settle(target)
    if not pose.near(target):
        raise Failed(f'commanded {yaw:.1f} deg from north at a heading of '
                     f'{start.heading:.1f} deg: it reports {pose}')
    return f'{yaw:.1f} deg from north'


@moves('flags-shown', 'shows the flags of the setpoint in GIMBAL_MANAGER_STATUS', MESSAGES,
       'GIMBAL_MANAGER_STATUS')
async def flags_shown(tester: ManagerTester) -> None:
    """Command NEUTRAL, and read the status."""
    await tester.requires(mavlink.GIMBAL_DEVICE_CAP_FLAGS_HAS_NEUTRAL)
    await tester.begin()
    await tester.point(None, flags=mavlink.GIMBAL_DEVICE_FLAGS_NEUTRAL | LEVEL)
    await tester.pause(0.5)
    status = await tester.newest(MANAGER_STATUS, 'its flags')
    if not status.flags & mavlink.GIMBAL_DEVICE_FLAGS_NEUTRAL:
        raise Failed(f'flags 0x{status.flags:x}')


@moves('other-target', 'ignores setpoints and commands for other components', ROUTING,
       'Routing Detail')
async def other_target(tester: ManagerTester) -> None:
    """Send a setpoint and a command to a component that does not exist."""
    before, session = await tester.begin(), tester.session
    other, pose = session.components.free_component(200), await tester.target(-2 * STEP, STEP)
    session.send(gimbal.GimbalManagerSetAttitude(
        *other, int(LEVEL | VEHICLE_FRAME), tester.device_id, quaternion_of(pose), *UNSET_VECTOR))
    one = await session.send_to_other(
        other, PITCHYAW, pose.pitch, pose.yaw, NAN, NAN, float(LEVEL), 0.0, tester.device_id)
    await tester.stays(before, f'setpoints for {other}')
    if one.acks:
        raise one.failure(f'answered a command for {other}: {one.answer}')


@moves('roi', 'points at a place, and stops on command (GM-8)', GIMBAL, 'Gimbal Manager Messages')
async def roi(tester: ManagerTester) -> str:
    """Set a place north of the vehicle; play the autopilot if none is heard."""
    await tester.requires(mavlink.GIMBAL_DEVICE_CAP_FLAGS_CAN_POINT_LOCATION_GLOBAL)
    await tester.begin()
    session = tester.session
    autopilot = Address(session.device.system, mavlink.MAV_COMP_ID_AUTOPILOT1)
    tester.vehicle = None if autopilot in session.components.heard else autopilot
    try:
        await tester.pause(0.5)
        one = await session.command(
            mavlink.MAV_CMD_DO_SET_ROI_LOCATION, tester.device_id, 0.0, 0.0, 0.0, *PLACE,
            as_int=True)
        if one.result in (None, mavlink.MAV_RESULT_UNSUPPORTED,
                          mavlink.MAV_RESULT_COMMAND_LONG_ONLY):
            latitude, longitude, altitude = PLACE
            one = await session.command(
                mavlink.MAV_CMD_DO_SET_ROI_LOCATION, tester.device_id, 0.0, 0.0, 0.0,
                latitude / 1e7, longitude / 1e7, altitude)
        if not one.accepted and tester.vehicle is None:
            raise Skipped(f'{one.answer}: the position of the vehicle may be unknown')
        one.expect(accepted=True)
        if tester.vehicle is not None:
            await tester.reach(await tester.target(NORTH.pitch, NORTH.yaw))
        pose = await tester.pose()
        one = await session.command(mavlink.MAV_CMD_DO_SET_ROI_NONE, tester.device_id)
        one.expect(accepted=True)
        return str(pose)
    finally:
        tester.vehicle = None


REQUIREMENTS: tuple[Requirement[ManagerTester], ...] = (
    component.heartbeat, component.address,
    component.status_stream(MANAGER_STATUS, GIMBAL, 'Gimbal Manager Status'),
    component.sent_on_request(
        'status-request', MANAGER_STATUS, MESSAGES, MANAGER_STATUS.msgname, optional=True),
    attitude.failures_at_rest,
    component.sent_on_request('information', INFORMATION, GIMBAL, 'Discovery of Gimbal Manager'),
    *attitude.information(INFORMATION), same_device, attitude_stream,
    component.unknown_command, component.unknown_message, component.broadcast(INFORMATION),
    attitude.command_int(INFORMATION),
    take, release, unchanged, release_others, secondary, configure_values, one_player,
    reaches('set-attitude', 'turns to an attitude (GIMBAL_MANAGER_SET_ATTITUDE)', GIMBAL,
            'Controlling Gimbal Angle and/or Angular Rate using MAVLink',
            lambda tester, pose: tester.point(pose)),
    *attitude.MOTION,
    reaches('angles-with-rates', 'turns to angles at rates (GIMBAL_MANAGER_SET_ATTITUDE)',
            MESSAGES, PITCHYAW_COMMAND,
            lambda tester, pose: tester.point(pose, rates=(3 * RATE, 3 * RATE, 3 * RATE))),
    reaches('set-pitchyaw', 'turns to angles (GIMBAL_MANAGER_SET_PITCHYAW)', MESSAGES,
            'GIMBAL_MANAGER_SET_PITCHYAW', lambda tester, pose: tester.send(
                gimbal.GimbalManagerSetPitchyaw, math.radians(pose.pitch),
                math.radians(pose.yaw))),
    reaches('pitchyaw', f'turns to angles ({PITCHYAW_COMMAND})', MESSAGES, PITCHYAW_COMMAND,
            lambda tester, pose: tester.pitchyaw(pose.pitch, pose.yaw, NAN, NAN)),
    # A manager that reads this low rate as rad/s is detected and does no harm.
    turns('pitchyaw-rate', f'turns at rates in deg/s ({PITCHYAW_COMMAND})', MESSAGES,
          PITCHYAW_COMMAND, lambda tester, speed: tester.pitchyaw(NAN, NAN, speed, 0.0), 2.0),
    reaches('one-axis', f'changes one angle and keeps the other ({PITCHYAW_COMMAND})', MESSAGES,
            PITCHYAW_COMMAND, lambda tester, pose: tester.pitchyaw(pose.pitch, NAN, NAN, NAN),
            yaw=0.0),
    # A fifth of the full rate.
    turns('manual', 'turns by manual control (GIMBAL_MANAGER_SET_MANUAL_CONTROL)', GIMBAL,
          'Manual Gimbal Control using MAVLink', lambda tester, speed: tester.send(
              gimbal.GimbalManagerSetManualControl, pitch_rate=speed / 10, yaw_rate=0.0), 2.0,
          fastest=math.inf),
    earth_frame, flags_shown, roi,
    ignores('no-control-command', f'rejects {PITCHYAW_COMMAND} of a component without control '
            '(GM-19)', GIMBAL, STARTING, 'a command of the second player',
            lambda tester, pose: tester.pitchyaw(
                pose.pitch, pose.yaw, NAN, NAN, source=tester.other)),
    ignores('no-control-messages', 'ignores setpoint messages of a component without control '
            '(GM-19)', GIMBAL, STARTING, 'setpoints of the second player', _send_messages),
    ignores('no-control-roi', 'rejects a region of interest of a component without control '
            '(GM-11)', GIMBAL, STARTING, 'a command of the second player', _clear_roi),
    ignores('other-device', 'ignores setpoints and commands for other gimbal devices (GM-28)',
            GIMBAL, ADDRESSING, 'setpoints for another gimbal device', _point_other_device),
    reaches('all-devices', 'treats gimbal device 0 as all of its gimbals (GM-28)', GIMBAL,
            ADDRESSING, lambda tester, pose: tester.point(pose, device_id=0)),
    other_target, *component.interval_requirements(MANAGER_STATUS),
    component.heartbeat_rate, *attitude.STATUSES, *component.ACKNOWLEDGEMENTS,
    component.checksums,
)


def device_of(message: Message) -> int:
    """Return the component id of a manager's gimbal device, 0 if it is not a component."""
    found = message.gimbal_device_id if isinstance(message, INFORMATION | MANAGER_STATUS) else 0
    return 0 if found in gimbal.NON_MAVLINK_IDS else found


CHECKS: PayloadChecks[ManagerTester] = PayloadChecks(
    payload='gimbal_manager', device='gimbal manager',
    messages=(INFORMATION, MANAGER_STATUS, AttitudeStatus),
    is_device=lambda message: isinstance(message, INFORMATION | MANAGER_STATUS),
    evidence='GIMBAL_MANAGER_STATUS or GIMBAL_MANAGER_INFORMATION',
    tester=ManagerTester, requirements=REQUIREMENTS, describe=describe,
    risk='give control away, and turn its gimbal to all sides and to the end of its range',
    question='Most checks take control of gimbal manager {device}, and turn its gimbal, also to '
             'the end of its\nrange and to its retracted position. At the end it is turned back, '
             'and control is restored.\nMay the checks control gimbal manager {device}? [y/N] ',
    mavlink_version=2, discovery=INFORMATION, part_of=device_of)
