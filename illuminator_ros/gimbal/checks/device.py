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
The checks of a gimbal device.

The checks play its gimbal manager: the component ``--manager`` of the device's system announces
itself with GIMBAL_MANAGER_STATUS and commands the device.
"""

from __future__ import annotations

from collections.abc import AsyncIterator
import contextlib
from dataclasses import replace
import math

from . import attitude
from .attitude import earth_yaw, ignores, moves, reaches
from .tester import (
    describe,
    GIMBAL,
    GimbalTester,
    NAN,
    Pose,
    PROPOSAL,
    quaternion_of,
    radians,
    STEP,
    TOLERANCE,
)
from .. import messages as gimbal
from ..axes import LEVEL
from ...mavlink.dialect import mavlink
from ...mavlink.messages import Address, CommandLong, Heartbeat, heartbeat, Message, target_of
from ...payload.checks import component_requirements as component
from ...payload.checks.outcomes import Failed, Skipped
from ...payload.checks.requirement import (
    Conditions,
    MESSAGES,
    Option,
    PayloadChecks,
    Requirement,
    requirement,
    ROUTING,
)
from ...payload.checks.session import Session
from ...payload.messages import GimbalDeviceAttitudeStatus as AttitudeStatus
from ...payload.mount_attitude import UNSET_VECTOR
from ...payload.rotation import Quaternion

# s
ANNOUNCE_INTERVAL = 0.4
# mavlink.MAV_COMP_ID_ONBOARD_COMPUTER
MANAGER_ID = 191
VEHICLE_FRAME = mavlink.GIMBAL_DEVICE_FLAGS_YAW_IN_VEHICLE_FRAME
# ESTIMATOR_STATUS_FLAGS: only the attitude of the vehicle is valid.
ESTIMATOR_ATTITUDE = 1


class DeviceTester(GimbalTester):
    """
    Plays the gimbal manager of a device.

    :ivar heading: the vehicle's heading, sent to the device with each announcement, degrees; None
        to send none.
    """

    information = gimbal.GimbalDeviceInformation
    status = AttitudeStatus

    def __init__(self, session: Session, conditions: Conditions) -> None:
        super().__init__(session, conditions)
        self.heading: float | None = None

    @property
    def manager(self) -> Address:
        """Return the address of the manager that is played."""
        return Address(self.session.device.system,
                       int(self.conditions.options.get('manager', MANAGER_ID)))

    def announce(self, manager: Address) -> None:
        """Announce a manager of the device."""
        self.session.send(heartbeat(mavlink.MAV_TYPE_ONBOARD_CONTROLLER), manager)
        self.session.send(gimbal.GimbalManagerStatus(
            0, int(LEVEL), self.session.device.component, *manager, 0, 0), manager)
        if self.heading is not None:
            q = Quaternion.from_euler(0.0, 0.0, math.radians(self.heading))
            self.session.send(gimbal.AutopilotStateForGimbalDevice(
                *self.session.device, int(self.session.now * 1e6), q, 0, NAN, NAN, NAN, 0, NAN,
                ESTIMATOR_ATTITUDE, 0, 1e-5), manager)

    async def prepare(self) -> None:
        """See :class:`GimbalTester`."""
        await self.pause(2 * ANNOUNCE_INTERVAL)

    async def pause(self, seconds: float) -> None:
        """See :class:`GimbalTester`."""
        end = self.session.now + seconds
        while (left := end - self.session.now) > 0:
            self.announce(self.manager)
            await self.session.runner.sleep(min(ANNOUNCE_INTERVAL, left))

    async def point(
        self, pose: Pose | None, *, flags: int = LEVEL | VEHICLE_FRAME,
        rates: tuple[float, float, float] = UNSET_VECTOR, source: Address | None = None,
        target: Address | None = None,
    ) -> None:
        """See :class:`GimbalTester`; the default source is the manager."""
        self.session.send(gimbal.GimbalDeviceSetAttitude(
            *(target or self.session.device), flags, quaternion_of(pose), *radians(rates)),
            source or self.manager)


# GIMBAL_DEVICE_INFORMATION and GIMBAL_DEVICE_ATTITUDE_STATUS

@requirement('status-to-all', 'sends its attitude to all components (GM-20)', GIMBAL,
             'Gimbal Device Broadcast/Status Messages', whole_run=True)
async def status_to_all(tester: DeviceTester) -> str:
    """Read the target fields."""
    received = [one for _, one in tester.session.received(AttitudeStatus)]
    if not received:
        raise Skipped('none was received')
    return component.none_of([
        Failed(f'to {target}', []) for target in map(target_of, received) if any(target)],
        len(received), 'statuses')


@requirement('device-id', 'leaves gimbal_device_id 0, as it is a component of its own', MESSAGES,
             'GIMBAL_DEVICE_INFORMATION')
async def device_id(tester: DeviceTester) -> None:
    """Read it in INFORMATION and in the status."""
    information = await tester.session.required(gimbal.GimbalDeviceInformation)
    found = {information.gimbal_device_id, *(
        one.gimbal_device_id for _, one in tester.session.received(AttitudeStatus))}
    if found != {0}:
        raise Failed(f'gimbal_device_id {", ".join(map(str, sorted(found)))}')


@requirement('north-needs-heading', 'accepts yaw relative to north only with a heading from the '
             'vehicle (GM-3)', MESSAGES, 'GIMBAL_DEVICE_CAP_FLAGS')
async def north_needs_heading(tester: DeviceTester) -> None:
    """Read the statuses before the first command, while the checks send no heading."""
    unknown = [one for _, one in tester.session.idle(AttitudeStatus)
               if math.isnan(one.delta_yaw)]
    if not unknown:
        raise Skipped('its statuses have the heading')
    if any(one.flags & mavlink.GIMBAL_DEVICE_FLAGS_ACCEPTS_YAW_IN_EARTH_FRAME for one in unknown):
        raise Failed('it reports ACCEPTS_YAW_IN_EARTH_FRAME, and delta_yaw is NaN')


# Setpoints, and their sources

async def _point_from_others(tester: DeviceTester, pose: Pose) -> None:
    """Send setpoints from our own address and from another component of the device's system."""
    for source in (tester.session.address, tester.session.components.free_component()):
        await tester.point(pose, source=source)


async def _announce_other(tester: DeviceTester, pose: Pose) -> None:
    """Announce a second manager, and send setpoints from it."""
    other = tester.session.components.free_component()
    tester.announce(other)
    await tester.pause(2 * ANNOUNCE_INTERVAL)
    tester.announce(other)
    await tester.point(pose, source=other)


async def _send_to_manager(tester: DeviceTester, pose: Pose) -> None:
    """Send messages and a command for gimbal managers, from the device's manager."""
    device = tester.session.device
    pitch, yaw = math.radians(pose.pitch), math.radians(pose.yaw)
    ids = (*device, int(LEVEL), device.component)
    for message in (
            gimbal.GimbalManagerSetAttitude(*ids, quaternion_of(pose), *UNSET_VECTOR),
            gimbal.GimbalManagerSetPitchyaw(*ids, pitch, yaw, NAN, NAN),
            gimbal.GimbalManagerSetManualControl(*ids, -0.5, 0.5, NAN, NAN),
            CommandLong(*device, mavlink.MAV_CMD_DO_GIMBAL_MANAGER_PITCHYAW, 0, pose.pitch,
                        pose.yaw, NAN, NAN, float(LEVEL), 0.0, float(device.component))):
        tester.session.send(message, tester.manager)


async def _point_others(tester: DeviceTester, pose: Pose) -> None:
    """Send setpoints to addresses that do not exist."""
    session = tester.session
    for target in (session.components.free_component(200),
                   Address(session.components.free_system(), session.device.component)):
        await tester.point(pose, target=target)


# Yaw relative to north

@contextlib.asynccontextmanager
async def _heading(tester: DeviceTester, heading: float) -> AsyncIterator[None]:
    """
    Send a heading of the vehicle, degrees, during the context.

    :raises Skipped: if the device lacks a yaw axis, or does not use the heading.
    """
    await tester.requires(mavlink.GIMBAL_DEVICE_CAP_FLAGS_SUPPORTS_YAW_IN_EARTH_FRAME)
    await tester.requires(mavlink.GIMBAL_DEVICE_CAP_FLAGS_HAS_YAW_AXIS)
    if any(not math.isnan(one.delta_yaw) for _, one in tester.session.idle(AttitudeStatus)):
        raise Skipped('another component sends it a heading')
    await tester.begin()
    tester.heading = heading
    try:
        await tester.pause(2 * ANNOUNCE_INTERVAL)
        pose = await tester.pose()
        if not pose.flags & mavlink.GIMBAL_DEVICE_FLAGS_ACCEPTS_YAW_IN_EARTH_FRAME:
            raise Skipped('it does not report ACCEPTS_YAW_IN_EARTH_FRAME')
        if abs(math.remainder(pose.heading - heading, 360.0)) > TOLERANCE:
            raise Skipped(f'it was sent a heading of {heading:g} deg, and reports '
                          f'{pose.heading:.1f} deg')
        yield
    finally:
        tester.heading = None
        # End a lock, in which the yaw of an old device cannot be read without the heading.
        await tester.point(None)


@moves('earth-frame', 'takes and reports yaw relative to north (GM-2)', MESSAGES,
       'GIMBAL_DEVICE_SET_ATTITUDE')
async def earth_frame(tester: DeviceTester) -> str:
    """Send a heading of 40 degrees, and command a yaw of 55 degrees."""
    async with _heading(tester, 40.0):
        target = await tester.target(-STEP, STEP)
        commanded = 40.0 + target.yaw
        await tester.point(replace(target, yaw=commanded),
                           flags=LEVEL | mavlink.GIMBAL_DEVICE_FLAGS_YAW_IN_EARTH_FRAME)
        pose = await tester.settle(target)
        (yaw,) = earth_yaw([pose])
        # A device need not know the heading.
        if not pose.near(target) or abs(yaw - commanded) > TOLERANCE:
            raise Failed(f'commanded {commanded:g} deg from north at a heading of 40 deg: it '
                         f'reports {pose}, {yaw:.1f} deg from north')
        return f'{yaw:.1f} deg from north'


@moves('yaw-lock', 'holds a locked yaw against north while the vehicle turns (GM-3)', MESSAGES,
       'GIMBAL_DEVICE_FLAGS')
async def yaw_lock(tester: DeviceTester) -> str:
    """Lock the yaw straight ahead, then send the heading of a vehicle that turns."""
    await tester.requires(mavlink.GIMBAL_DEVICE_CAP_FLAGS_HAS_YAW_LOCK)
    async with _heading(tester, 40.0):
        start, target = await tester.target(-STEP, 0.0), await tester.target(-STEP, -STEP)
        lock = mavlink.GIMBAL_DEVICE_FLAGS_YAW_LOCK
        await tester.point(start, flags=LEVEL | lock | VEHICLE_FRAME)
        await tester.pause(0.5)
        pose = await tester.until(lambda pose: bool(pose.flags & lock), 1.5)
        if not pose.flags & lock:
            raise Failed(f'flags 0x{pose.flags:x} without YAW_LOCK')
        tester.heading = 40.0 + STEP
        pose = await tester.settle(target)
        if pose.near(start) and not start.near(target):
            raise Skipped('it did not turn; the vehicle did not, either')
        if not pose.near(target):
            raise Failed(f'the vehicle turned by {STEP:g} deg, and it reports {pose}')
        return str(pose)


INFORMATION = gimbal.GimbalDeviceInformation
REQUIREMENTS: tuple[Requirement[DeviceTester], ...] = (
    component.heartbeat,
    component.heartbeat_type(mavlink.MAV_TYPE_GIMBAL, 'GIMBAL', 'a gimbal'),
    component.heartbeat_autopilot, component.address,
    component.status_stream(AttitudeStatus, GIMBAL, 'Gimbal Device Broadcast/Status Messages'),
    component.sent_on_request(
        'status-request', AttitudeStatus, MESSAGES, attitude.STATUS, optional=True),
    attitude.failures_at_rest, north_needs_heading,
    component.sent_on_request('information', INFORMATION, GIMBAL, 'Discovery of Gimbal Device'),
    *attitude.information(INFORMATION), device_id,
    component.unknown_command, component.unknown_message, component.broadcast(INFORMATION),
    attitude.command_int(INFORMATION),
    reaches('setpoint', 'turns to an attitude that its manager commands', GIMBAL,
            'Control of a Gimbal Device', lambda tester, pose: tester.point(pose)),
    *attitude.MOTION, earth_frame, yaw_lock,
    ignores('only-manager', 'ignores setpoints of components that are not its manager (GM-19)',
            GIMBAL, 'Gimbal Manager and Gimbal Device',
            'a setpoint of a component that is not its manager', _point_from_others),
    ignores('one-manager', 'keeps its manager while another component announces itself (GM-18)',
            PROPOSAL, 'Proposed Architecture', 'a setpoint of the second manager',
            _announce_other),
    ignores('manager-set', 'ignores the messages and commands to gimbal managers (GM-19)',
            MESSAGES, 'GIMBAL_MANAGER_SET_PITCHYAW', 'messages to gimbal managers',
            _send_to_manager),
    ignores('other-target', 'ignores setpoints for other components and systems', ROUTING,
            'Routing Detail', 'setpoints for other addresses', _point_others),
    *component.interval_requirements(AttitudeStatus),
    component.heartbeat_rate, status_to_all, *attitude.STATUSES, *component.ACKNOWLEDGEMENTS,
    component.checksums,
)


def is_device(message: Message) -> bool:
    """Return whether a message identifies its sender as a gimbal device."""
    # Gimbal managers send these messages with a gimbal_device_id.
    return (isinstance(message, gimbal.GimbalDeviceInformation | AttitudeStatus)
            and message.gimbal_device_id == 0
            or isinstance(message, Heartbeat) and message.type == mavlink.MAV_TYPE_GIMBAL)


CHECKS: PayloadChecks[DeviceTester] = PayloadChecks(
    payload='gimbal', device='gimbal', messages=(INFORMATION, AttitudeStatus),
    is_device=is_device,
    evidence='HEARTBEAT with MAV_TYPE_GIMBAL, or GIMBAL_DEVICE_ATTITUDE_STATUS',
    tester=DeviceTester, requirements=REQUIREMENTS,
    describe=describe,
    risk='turn to all sides and to the end of its range',
    question='Most checks turn gimbal {device}, also to the end of its range and to its '
             'retracted position.\nAt the end it is turned back.\n'
             'May gimbal {device} turn? [y/N] ',
    options=(Option('manager', 'ID', MANAGER_ID, 1, 255,
                    'component id of the manager that is played, in the system of the gimbal'),),
    mavlink_version=2)
