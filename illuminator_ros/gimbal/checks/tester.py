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

"""The base of the testers of gimbals: it moves a gimbal, watches it, and turns it back."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
import math
from typing import NamedTuple, TypeVar

from .. import messages as gimbal
from ..axes import LEVEL, Range, read_ranges
from ...mavlink.dialect import mavlink, short_names
from ...mavlink.messages import Address, Message
from ...payload.checks.component_requirements import restore_interval
from ...payload.checks.outcomes import Failed, Skipped
from ...payload.checks.requirement import Conditions, Specification
from ...payload.checks.session import Session
from ...payload.messages import GimbalDeviceAttitudeStatus as AttitudeStatus
from ...payload.mount_attitude import names_frame, UNSET_VECTOR, yaw_frame, YawFrame
from ...payload.rotation import Quaternion

GIMBAL = Specification('gimbal protocol v2', 'https://mavlink.io/en/services/gimbal_v2.html')
PROPOSAL = Specification(
    'gimbal proposal', 'https://docs.google.com/document/d/'
    '16pekKRXLN2FhlL9YNFP983cjfBKAsDwN0gOSks8USo4')

# s
MOVE_TIMEOUT = 8.0
# s; the time for which a gimbal that must not move is watched.
WATCH_TIME = 1.0
POLL = 0.1
# s; the time after which a gimbal that only passes a pose has left it.
SETTLE_TIME = 0.4
# Degrees.
TOLERANCE = 3.0
STEP = 15.0
RATE = 6.0
NAN = math.nan
Control = tuple[Address, Address]
Information = gimbal.GimbalDeviceInformation | gimbal.GimbalManagerInformation
M = TypeVar('M', bound=Message)


@dataclass(frozen=True)
class Pose:
    """
    An attitude as a gimbal reports it, degrees.

    :param yaw: relative to the vehicle.
    :param heading: of the vehicle, NaN if unknown.
    """

    roll: float
    pitch: float
    yaw: float
    flags: int = 0
    failures: int = 0
    heading: float = NAN

    @classmethod
    def from_message(cls, message: AttitudeStatus) -> Pose:
        """
        Read a status.

        :raises ValueError: if it has no attitude relative to the vehicle.
        """
        roll, pitch, yaw = Quaternion(*message.q).normalized().euler()
        # A receiver must ignore delta_yaw if the status names no frame.
        heading = message.delta_yaw if names_frame(message.flags) else NAN
        if yaw_frame(message.flags) is YawFrame.EARTH:
            yaw = math.remainder(yaw - heading, math.tau)
        if math.isnan(yaw):
            raise ValueError('yaw is relative to north, and delta_yaw is not known')
        return cls(math.degrees(roll), math.degrees(pitch), math.degrees(yaw), message.flags,
                   message.failure_flags, math.degrees(heading))

    def near(self, other: Pose, tolerance: float = TOLERANCE) -> bool:
        """Return whether another pose is the same within a tolerance, degrees."""
        return (abs(self.pitch - other.pitch) < tolerance
                and abs(math.remainder(self.yaw - other.yaw, 360.0)) < tolerance)

    def __str__(self) -> str:
        return f'pitch {self.pitch:.1f}, yaw {self.yaw:.1f} deg'


class Limits(NamedTuple):
    """The ranges and capabilities of an INFORMATION message; NaN for unknown, degrees."""

    roll: Range
    pitch: Range
    yaw: Range
    capabilities: int

    @classmethod
    def from_message(cls, message: Information) -> Limits:
        """Read an INFORMATION message."""
        roll, pitch, yaw = (Range(*map(math.degrees, one)) for one in read_ranges(message))
        return cls(roll, pitch, yaw, getattr(message, 'cap_flags2', 0) or message.cap_flags)


# The ranges and capabilities of a gimbal that does not report them: all are possible.
UNKNOWN_LIMITS = Limits(*(Range(NAN, NAN),) * 3, -1)


def describe(message: Message) -> str:
    """Return the content of a message of the gimbal protocol, '' if its name is enough."""
    if isinstance(message, AttitudeStatus):
        try:
            text = str(Pose.from_message(message))
        except ValueError as error:
            text = str(error)
        return (f'{message.get_type()} {text}, flags {message.flags}, '
                f'failures {message.failure_flags}')
    if isinstance(message, gimbal.GimbalManagerStatus):
        return f'{message.get_type()} {control_text(control_of(message))}, flags {message.flags}'
    if isinstance(message, gimbal.GimbalDeviceSetAttitude | gimbal.GimbalManagerSetAttitude):
        angles = 'no attitude'
        if all(map(math.isfinite, message.q)):
            _, pitch, yaw = map(math.degrees, Quaternion(*message.q).euler())
            angles = f'pitch {pitch:.1f}, yaw {yaw:.1f} deg'
        rates = ' '.join(f'{math.degrees(rate):g}' for rate in (
            message.angular_velocity_y, message.angular_velocity_z))
        return f'{message.get_type()} {angles}, rates {rates} deg/s, flags {message.flags}'
    return ''


def control_text(control: Control) -> str:
    """Return the components in control, for people."""
    return ', '.join(f'{name} {one if any(one) else "none"}'
                     for name, one in zip(('primary', 'secondary'), control, strict=True))


def control_of(message: gimbal.GimbalManagerStatus) -> Control:
    """Return primary and secondary control of a status."""
    return (Address(message.primary_control_sysid, message.primary_control_compid),
            Address(message.secondary_control_sysid, message.secondary_control_compid))


class GimbalTester(ABC):
    """
    Moves a gimbal for the checks.

    :cvar information: the class of the INFORMATION message.
    :cvar status: the class whose interval is restored.
    """

    information: type[Information]
    status: type[Message]

    def __init__(self, session: Session, conditions: Conditions) -> None:
        self.session = session
        self.conditions = conditions
        self._before: Pose | None = None
        self._limits: Limits | None = None

    # Reports

    async def newest(self, cls: type[M], what: str) -> M:
        """
        Return the newest message of a stream; request one if none comes.

        :param what: its content, for people.
        :raises Skipped: if the gimbal does not send it.
        """
        streamed = await self.session.receive_more(cls, 1.0)
        message = streamed[-1][1] if streamed else await self.session.request(cls)
        if message is None:
            raise Skipped(f'it does not report {what}')
        return message

    async def pose(self) -> Pose:
        """
        Return the present attitude.

        :raises Skipped: if the gimbal does not report one.
        """
        message = await self.newest(AttitudeStatus, 'its attitude')
        try:
            return Pose.from_message(message)
        except ValueError as error:
            raise Skipped(f'its attitude cannot be read: {error}') from error

    async def limits(self) -> Limits:
        """
        Return the ranges and the capabilities of the gimbal.

        :raises Skipped: if the gimbal does not report them.
        """
        if self._limits is None:
            self._limits = Limits.from_message(await self.session.required(self.information))
        return self._limits

    async def possible(self) -> Limits:
        """Return the ranges and the capabilities; unlimited ones if none are reported."""
        try:
            return await self.limits()
        except Skipped:
            return UNKNOWN_LIMITS

    async def requires(self, capability: int) -> None:
        """Raise Skipped if the gimbal does not have a capability."""
        if not (await self.limits()).capabilities & capability:
            raise Skipped(f'it does not have {short_names("GIMBAL_DEVICE_CAP_FLAGS")[capability]}')

    # Moving

    @abstractmethod
    async def prepare(self) -> None:
        """Prepare the gimbal for setpoints, for example by taking control."""

    @abstractmethod
    async def point(
        self, pose: Pose | None, *,
        flags: int = LEVEL | mavlink.GIMBAL_DEVICE_FLAGS_YAW_IN_VEHICLE_FRAME,
        rates: tuple[float, float, float] = UNSET_VECTOR,
    ) -> None:
        """Send a setpoint: an attitude if there is one, and rates, deg/s."""

    async def pause(self, seconds: float) -> None:
        """Wait, and send the messages that must be sent regularly."""
        await self.session.runner.sleep(seconds)

    async def until(
        self, condition: Callable[[Pose], bool], timeout: float = MOVE_TIMEOUT,
    ) -> Pose:
        """Return the first pose that meets a condition, or the last one before the timeout."""
        end = self.session.now + timeout
        while not condition(pose := await self.pose()) and self.session.now < end:
            await self.pause(POLL)
        return pose

    async def steady(self) -> Pose:
        """Return the pose once two successive statuses agree, or after 1 s."""
        end, pose = self.session.now + 1.0, await self.pose()
        while not pose.near(now := await self.pose()) and self.session.now < end:
            pose = now
        return now

    async def settle(self, pose: Pose) -> Pose:
        """Return the pose once the gimbal stays at a wanted one, or after MOVE_TIMEOUT."""
        end = self.session.now + MOVE_TIMEOUT
        while True:
            await self.until(pose.near, end - self.session.now)
            # The gimbal may only have passed the wanted pose.
            await self.pause(SETTLE_TIME)
            if pose.near(now := await self.pose()) or self.session.now >= end:
                return now

    async def reach(self, pose: Pose) -> None:
        """Raise Failed if the gimbal does not turn to a pose and stay at it."""
        reached = await self.settle(pose)
        if not pose.near(reached):
            raise Failed(f'commanded {pose}, reached {reached} after {MOVE_TIMEOUT:g} s')

    async def target(self, pitch: float, yaw: float) -> Pose:
        """Return a pose within the ranges; an axis that the gimbal lacks keeps its angle."""
        limits, now = await self.possible(), await self.pose()

        def clipped(angle: float, low: float, high: float) -> float:
            return angle if math.isnan(low) or math.isnan(high) or low > high else min(
                max(angle, 0.9 * low), 0.9 * high)

        return Pose(
            0.0,
            clipped(pitch, *limits.pitch)
            if limits.capabilities & mavlink.GIMBAL_DEVICE_CAP_FLAGS_HAS_PITCH_AXIS else now.pitch,
            clipped(yaw, *limits.yaw)
            if limits.capabilities & mavlink.GIMBAL_DEVICE_CAP_FLAGS_HAS_YAW_AXIS else now.yaw)

    async def begin(self) -> Pose:
        """
        Turn the gimbal to the pose from which checks start; return the pose that it reaches.

        :raises Skipped: if radio control alone turns it.
        """
        await self.prepare()
        start, now = await self.target(-STEP, 0.0), await self.pose()
        if now.flags & mavlink.GIMBAL_DEVICE_FLAGS_RC_EXCLUSIVE:
            raise Skipped('it reports RC_EXCLUSIVE, so it ignores setpoints')
        if not start.near(now):
            await self.point(start)
        return await self.until(start.near)

    async def free_direction(self, pose: Pose, angle: float) -> int:
        """
        Return the direction in which the pitch can turn by an angle: -1, or else 1 for up.

        :raises Skipped: if there is none.
        """
        _, (low, high), _, capabilities = await self.possible()
        if not capabilities & mavlink.GIMBAL_DEVICE_CAP_FLAGS_HAS_PITCH_AXIS:
            raise Skipped('it does not have HAS_PITCH_AXIS')
        # An unknown end is NaN.
        if not pose.pitch - angle < low:
            return -1
        if not pose.pitch + angle > high:
            return 1
        raise Skipped(f'its pitch cannot turn by {angle:g} deg')

    async def stays(self, before: Pose, cause: str) -> None:
        """Raise Failed if the gimbal moves within :data:`WATCH_TIME`."""
        end = self.session.now + WATCH_TIME
        # A single deviating status does not count: the requirement "continuous" covers it.
        away = 0
        while away < 2 and self.session.now < end:
            pose = await self.pose()
            away = 0 if pose.near(before) else away + 1
            await self.pause(POLL)
        if away == 2:
            raise Failed(f'{cause}: it moved from {before} to {pose}')

    # Restoring

    async def save(self) -> bool:
        """See :class:`Tester`."""
        if self._before is None:
            try:
                self._before = await self.pose()
            except Skipped:
                return False
        return True

    @property
    def saved(self) -> str:
        """See :class:`Tester`."""
        return str(self._before)

    async def restore(self) -> list[str]:
        """See :class:`Tester`."""
        before = self._before
        assert before is not None
        differing = []
        try:
            now = await self.pose()
            same_mode = not (
                now.flags ^ before.flags) & ~mavlink.GIMBAL_DEVICE_FLAGS_ACCEPTS_YAW_IN_EARTH_FRAME
            if self.conditions.consent and not (now.near(before, 1.0) and same_mode):
                await self.prepare()
                await self._turn_back(before)
            if not (await self.until(lambda pose: pose.near(before), 1.0)).near(before):
                differing = ['attitude']
        except Skipped:
            differing = ['attitude']
        await restore_interval(self.session, self.status)
        return differing

    async def _turn_back(self, before: Pose) -> None:
        frames = (mavlink.GIMBAL_DEVICE_FLAGS_YAW_IN_EARTH_FRAME
                  | mavlink.GIMBAL_DEVICE_FLAGS_ACCEPTS_YAW_IN_EARTH_FRAME)
        flags = before.flags & ~frames | mavlink.GIMBAL_DEVICE_FLAGS_YAW_IN_VEHICLE_FRAME
        await self.point(before, flags=flags)
        await self.until(lambda pose: pose.near(before, 1.0))
        # Wait until the gimbal stands still.
        await self.pause(0.5)


def quaternion_of(pose: Pose | None) -> tuple[float, float, float, float]:
    """Return the quaternion of a pose for a message, NaN without one."""
    if pose is None:
        return (NAN,) * 4
    return Quaternion.from_euler(*map(math.radians, (pose.roll, pose.pitch, pose.yaw)))


def radians(rates: tuple[float, float, float]) -> tuple[float, float, float]:
    """Return rates in rad/s."""
    one, two, three = map(math.radians, rates)
    return one, two, three
