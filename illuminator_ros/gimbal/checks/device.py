# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""
The checks of a gimbal device.

The checks play its gimbal manager: the component ``--manager`` of the device's system announces
itself with GIMBAL_MANAGER_STATUS and commands the device.
"""

from __future__ import annotations

from collections.abc import AsyncIterator
import contextlib
import math

from . import attitude
from .attitude import ignores, moves, reaches
from .session import FORWARD, GIMBAL, GimbalSession, NAN, Pose, PROPOSAL, STEP, TOLERANCE
from .. import messages as gimbal
from ..axes import LEVEL
from ...checks import component_requirements as component
from ...checks.outcomes import Failed, Skipped
from ...checks.requirements import Option, PayloadChecks, Requirement, requirement
from ...checks.session import Conditions, Session
from ...checks.specifications import MESSAGES, ROUTING
from ...geometry.mount_attitude import UNSET_VECTOR, Wxyz
from ...geometry.rotation import Quaternion, Vector
from ...mavlink.dialect import mavlink
from ...mavlink.messages import Address, CommandLong, heartbeat, Message, target_of
from ...payload.messages import GimbalDeviceAttitudeStatus as AttitudeStatus

INFORMATION = gimbal.GimbalDeviceInformation
# s
ANNOUNCE_INTERVAL = 0.4
# mavlink.MAV_COMP_ID_ONBOARD_COMPUTER
MANAGER_ID = 191
# ESTIMATOR_STATUS_FLAGS: only the attitude of the vehicle is valid.
ESTIMATOR_ATTITUDE = 1


class DeviceSession(GimbalSession):
    """
    Plays the gimbal manager of a device.

    :ivar heading: the vehicle's heading, sent to the device with each announcement, degrees; None
        to send none.
    """

    messages = (*Session.messages, INFORMATION, AttitudeStatus)
    mav_type = mavlink.MAV_TYPE_GIMBAL
    information = INFORMATION
    status = AttitudeStatus

    def __init__(self, conditions: Conditions) -> None:
        super().__init__(conditions)
        self.heading: float | None = None

    def is_device(self, message: Message) -> bool:
        """See :class:`Session`."""
        # Gimbal managers send these messages with a gimbal_device_id.
        return (isinstance(message, INFORMATION | AttitudeStatus)
                and message.gimbal_device_id == 0
                or super().is_device(message))

    @property
    def operator(self) -> Address:
        """Return the address of the manager that is played."""
        return Address(
            self.device.system, int(self.conditions.options.get('manager', MANAGER_ID)))

    def announce(self, manager: Address) -> None:
        """Announce a manager of the device."""
        self.send(heartbeat(mavlink.MAV_TYPE_ONBOARD_CONTROLLER), manager)
        self.send(gimbal.GimbalManagerStatus(
            0, int(LEVEL), self.device.component, *manager, 0, 0), manager)
        if self.heading is not None:
            q = Quaternion.from_euler(0.0, 0.0, math.radians(self.heading))
            self.send(gimbal.AutopilotStateForGimbalDevice(
                *self.device, int(self.now * 1e6), q, 0, NAN, NAN, NAN, 0, NAN,
                ESTIMATOR_ATTITUDE, 0, 1e-5), manager)

    async def prepare(self) -> None:
        """See :class:`GimbalSession`."""
        await self.pause(2 * ANNOUNCE_INTERVAL)

    async def pause(self, seconds: float) -> None:
        """See :class:`GimbalSession`."""
        end = self.now + seconds
        while (left := end - self.now) > 0:
            self.announce(self.operator)
            await self.sleep(min(ANNOUNCE_INTERVAL, left))

    def setpoint(
        self, target: Address, device_id: int | None, flags: int, q: Wxyz, rates: Vector,
    ) -> Message:
        """See :class:`GimbalSession`."""
        return gimbal.GimbalDeviceSetAttitude(*target, flags, q, *rates)


# GIMBAL_DEVICE_INFORMATION and GIMBAL_DEVICE_ATTITUDE_STATUS

def _not_to_all(status: AttitudeStatus) -> str:
    target = target_of(status)
    return f'to {target}' if any(target) else ''


@requirement('device-id', 'leaves gimbal_device_id 0, as it is a component of its own', MESSAGES,
             'GIMBAL_DEVICE_INFORMATION')
async def device_id(device: DeviceSession) -> None:
    """Read it in INFORMATION and in the status."""
    found = {(await device.required(INFORMATION)).gimbal_device_id, *(
        one.gimbal_device_id for _, one in device.received(AttitudeStatus))}
    if found != {0}:
        raise Failed(f'gimbal_device_id {", ".join(map(str, sorted(found)))}')


@requirement('north-needs-heading', 'accepts yaw relative to north only with a heading from the '
             'vehicle (GM-3)', MESSAGES, 'GIMBAL_DEVICE_CAP_FLAGS')
async def north_needs_heading(device: DeviceSession) -> None:
    """Read the statuses before the first command, while the checks send no heading."""
    unknown = [one for _, one in device.idle(AttitudeStatus) if math.isnan(one.delta_yaw)]
    if not unknown:
        raise Skipped('its statuses have the heading')
    if any(one.flags & mavlink.GIMBAL_DEVICE_FLAGS_ACCEPTS_YAW_IN_EARTH_FRAME for one in unknown):
        raise Failed('it reports ACCEPTS_YAW_IN_EARTH_FRAME, and delta_yaw is NaN')


# Setpoints, and their sources

async def _point_from_others(device: DeviceSession, pose: Pose) -> None:
    """Send setpoints from our own address and from another component of the device's system."""
    for source in (device.address, device.components.free_component()):
        await device.point(pose, source=source)


async def _announce_other(device: DeviceSession, pose: Pose) -> None:
    """Announce a second manager, and send setpoints from it."""
    other = device.components.free_component()
    device.announce(other)
    await device.pause(2 * ANNOUNCE_INTERVAL)
    device.announce(other)
    await device.point(pose, source=other)


async def _send_to_manager(device: DeviceSession, pose: Pose) -> None:
    """Send messages and a command for gimbal managers, from the device's manager."""
    address = device.device
    ids = (*address, int(LEVEL), address.component)
    pitch, yaw = math.radians(pose.pitch), math.radians(pose.yaw)
    for message in (
            gimbal.GimbalManagerSetAttitude(
                *ids, Quaternion.from_euler(0.0, pitch, yaw), *UNSET_VECTOR),
            gimbal.GimbalManagerSetPitchyaw(*ids, pitch, yaw, NAN, NAN),
            gimbal.GimbalManagerSetManualControl(*ids, -0.5, 0.5, NAN, NAN),
            CommandLong(*address, mavlink.MAV_CMD_DO_GIMBAL_MANAGER_PITCHYAW, 0, pose.pitch,
                        pose.yaw, NAN, NAN, float(LEVEL), 0.0, float(address.component))):
        device.send(message, device.operator)


async def _point_others(device: DeviceSession, pose: Pose) -> None:
    """Send setpoints to addresses that do not exist."""
    others = device.components
    for target in (others.free_component(200),
                   Address(others.free_system(), device.device.component)):
        await device.point(pose, target=target)


# Yaw relative to north

@contextlib.asynccontextmanager
async def _heading(device: DeviceSession, heading: float) -> AsyncIterator[None]:
    """
    Send a heading of the vehicle, degrees, during the context.

    :raises Skipped: if the device lacks a yaw axis, or does not use the heading.
    """
    await device.requires(mavlink.GIMBAL_DEVICE_CAP_FLAGS_SUPPORTS_YAW_IN_EARTH_FRAME)
    await device.requires(mavlink.GIMBAL_DEVICE_CAP_FLAGS_HAS_YAW_AXIS)
    if any(not math.isnan(one.delta_yaw) for _, one in device.idle(AttitudeStatus)):
        raise Skipped('another component sends it a heading')
    await device.begin()
    device.heading = heading
    try:
        await device.pause(2 * ANNOUNCE_INTERVAL)
        pose = await device.pose()
        if not pose.flags & mavlink.GIMBAL_DEVICE_FLAGS_ACCEPTS_YAW_IN_EARTH_FRAME:
            raise Skipped('it does not report ACCEPTS_YAW_IN_EARTH_FRAME')
        if abs(math.remainder(pose.heading - heading, 360.0)) > TOLERANCE:
            raise Skipped(f'it was sent a heading of {heading:g} deg, and reports '
                          f'{pose.heading:.1f} deg')
        yield
    finally:
        device.heading = None
        # End a lock, in which the yaw of an old device cannot be read without the heading.
        await device.point(None)


@moves('earth-frame', 'takes and reports yaw relative to north (GM-2)', MESSAGES,
       'GIMBAL_DEVICE_SET_ATTITUDE')
async def earth_frame(device: DeviceSession) -> str:
    """Send a heading of 40 degrees, and command a yaw relative to north."""
    async with _heading(device, 40.0):
        return await attitude.turn_from_north(device, 40.0)


@moves('yaw-lock', 'holds a locked yaw against north while the vehicle turns (GM-3)', MESSAGES,
       'GIMBAL_DEVICE_FLAGS')
async def yaw_lock(device: DeviceSession) -> str:
    """Lock the yaw straight ahead, then send the heading of a vehicle that turns."""
    lock = mavlink.GIMBAL_DEVICE_FLAGS_YAW_LOCK
    await device.requires(mavlink.GIMBAL_DEVICE_CAP_FLAGS_HAS_YAW_LOCK)
    async with _heading(device, 40.0):
        start, target = await device.target(-STEP, 0.0), await device.target(-STEP, -STEP)
        await device.point(start, flags=FORWARD | lock)
        await device.pause(0.5)
        pose = await device.pose_when(lambda pose: bool(pose.flags & lock), 1.5)
        if not pose.flags & lock:
            raise Failed(f'flags 0x{pose.flags:x} without YAW_LOCK')
        device.heading = 40.0 + STEP
        pose = await device.settle(target)
        if pose.near(start) and not start.near(target):
            raise Skipped('it did not turn; the vehicle did not, either')
        if not pose.near(target):
            raise Failed(f'the vehicle turned by {STEP:g} deg, and it reports {pose}')
        return str(pose)


OWN: tuple[Requirement[DeviceSession], ...] = (
    component.heartbeat_type(mavlink.MAV_TYPE_GIMBAL, 'GIMBAL', 'a gimbal'),
    component.heartbeat_autopilot,
    component.status_stream(AttitudeStatus, GIMBAL, 'Gimbal Device Broadcast/Status Messages'),
    component.sent_on_request(
        'status-request', AttitudeStatus, MESSAGES, attitude.STATUS, optional=True),
    attitude.failures_at_rest, north_needs_heading,
    component.sent_on_request('information', INFORMATION, GIMBAL, 'Discovery of Gimbal Device'),
    *attitude.information(INFORMATION), device_id,
    attitude.command_int(INFORMATION),
    moves('setpoint', 'turns to an attitude that its manager commands', GIMBAL,
          'Control of a Gimbal Device')(reaches(DeviceSession.point)),
    *attitude.MOTION, earth_frame, yaw_lock,
    moves('only-manager', 'ignores setpoints of components that are not its manager (GM-19)',
          GIMBAL, 'Gimbal Manager and Gimbal Device')(
        ignores('a setpoint of a component that is not its manager', _point_from_others)),
    moves('one-manager', 'keeps its manager while another component announces itself (GM-18)',
          PROPOSAL, 'Proposed Architecture')(
        ignores('a setpoint of the second manager', _announce_other)),
    moves('manager-set', 'ignores the messages and commands to gimbal managers (GM-19)',
          MESSAGES, 'GIMBAL_MANAGER_SET_PITCHYAW')(
        ignores('messages to gimbal managers', _send_to_manager)),
    moves('other-target', 'ignores setpoints for other components and systems', ROUTING,
          'Routing Detail')(ignores('setpoints for other addresses', _point_others)),
    attitude.statuses('status-to-all', 'sends its attitude to all components (GM-20)', _not_to_all,
                      GIMBAL, 'Gimbal Device Broadcast/Status Messages'),
    *attitude.STATUSES,
)
REQUIREMENTS = component.with_common(OWN, AttitudeStatus, INFORMATION)
CHECKS: PayloadChecks[DeviceSession] = PayloadChecks(
    payload='gimbal', device='gimbal', session=DeviceSession, requirements=REQUIREMENTS,
    evidence='HEARTBEAT with MAV_TYPE_GIMBAL, or GIMBAL_DEVICE_ATTITUDE_STATUS',
    risk='turn to all sides and to the end of its range',
    question='Most checks turn gimbal {device}, also to the end of its range and to its '
             'retracted position.\nAt the end it is turned back.\n'
             'May gimbal {device} turn? [y/N] ',
    options=(Option('manager', 'ID', MANAGER_ID, 1, 255,
                    'component id of the manager that is played, in the system of the gimbal'),),
    mavlink_version=2)
