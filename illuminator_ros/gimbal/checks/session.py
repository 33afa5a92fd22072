# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""A session with a gimbal: it moves the gimbal, watches it, and turns it back."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
import math
from typing import ClassVar, NamedTuple, TypeVar

from .. import messages as gimbal
from ..axes import LEVEL, Range, read_ranges
from ...checks.component_requirements import restore_interval
from ...checks.outcomes import Failed, Skipped
from ...checks.session import Conditions, Session
from ...checks.specifications import Specification
from ...geometry.mount_attitude import (
    names_frame,
    UNSET_QUATERNION,
    UNSET_VECTOR,
    Wxyz,
    yaw_frame,
    YawFrame,
)
from ...geometry.rotation import Quaternion, Vector
from ...mavlink.dialect import mavlink, short_names
from ...mavlink.messages import Address, Message
from ...payload.messages import GimbalDeviceAttitudeStatus as AttitudeStatus

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
# Degrees beyond its range at which a gimbal is stopped; the vehicle may be tilted a little.
MARGIN = 10.0
STEP = 15.0
RATE = 6.0
NAN = math.nan
# A setpoint with level roll and pitch, and a yaw relative to the vehicle, or to north.
FORWARD = int(LEVEL | mavlink.GIMBAL_DEVICE_FLAGS_YAW_IN_VEHICLE_FRAME)
NORTH = int(LEVEL | mavlink.GIMBAL_DEVICE_FLAGS_YAW_IN_EARTH_FRAME)
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
        """Read an INFORMATION message; a range of 0 to 0 is unknown."""
        roll, pitch, yaw = (Range(*map(math.degrees, one)) if any(one) else Range(NAN, NAN)
                            for one in read_ranges(message))
        return cls(roll, pitch, yaw, getattr(message, 'cap_flags2', 0) or message.cap_flags)

    def exceeded(self, pose: Pose) -> str:
        """Return the range that a pose exceeds by more than :data:`MARGIN`, '' for none."""
        for axis, angle, span in (('pitch', pose.pitch, self.pitch), ('yaw', pose.yaw, self.yaw)):
            # The reported yaw has no turns. A comparison with an unknown end is false.
            if (-180.0 <= span.low < span.high <= 180.0
                    and not span.low - MARGIN <= angle <= span.high + MARGIN):
                return f'beyond its range of {axis}, {span.low:.1f} to {span.high:.1f} deg'
        return ''


# The ranges and capabilities of a gimbal that does not report them: all are possible.
UNKNOWN_LIMITS = Limits(*(Range(NAN, NAN),) * 3, -1)


class GimbalSession(Session):
    """
    Moves a gimbal for the checks.

    :cvar information: the class of the INFORMATION message.
    :cvar status: the class whose interval is restored.
    """

    information: ClassVar[type[Information]]
    status: ClassVar[type[Message]]

    def __init__(self, conditions: Conditions) -> None:
        super().__init__(conditions)
        self._before: Pose | None = None
        self._limits: Limits | None = None
        # Consecutive statuses with an attitude beyond the range; the first ones do not count.
        self._beyond = -math.inf

    def describe(self, message: Message) -> str:
        """See :class:`Session`; an attitude is shown by its angles."""
        if not isinstance(message, AttitudeStatus | gimbal.GimbalDeviceSetAttitude
                          | gimbal.GimbalManagerSetAttitude):
            return super().describe(message)
        angles = 'no attitude'
        if all(map(math.isfinite, message.q)):
            _, pitch, yaw = map(math.degrees, Quaternion(*message.q).euler())
            angles = str(Pose(0.0, pitch, yaw))
        rates = ', '.join(f'{math.degrees(rate):g}' for rate in (
            message.angular_velocity_y, message.angular_velocity_z))
        return (f'{message.get_type()} {angles}, rates {rates} deg/s, flags {message.flags}, '
                f'failures {getattr(message, "failure_flags", 0)}')

    # Reports

    async def newest(self, cls: type[M], what: str) -> M:
        """
        Return the newest message of a stream; request one if none comes.

        :param what: its content, for people.
        :raises Skipped: if the gimbal does not send it.
        """
        streamed = await self.receive_more(cls, 1.0)
        message = streamed[-1][1] if streamed else await self.request(cls)
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
            self._limits = Limits.from_message(await self.required(self.information))
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
    def setpoint(
        self, target: Address, device_id: int | None, flags: int, q: Wxyz, rates: Vector,
    ) -> Message:
        """Return the message of a setpoint, rad/s; a device ignores the ``device_id``."""

    async def point(
        self, pose: Pose | None, *, flags: int = FORWARD, rates: Vector = UNSET_VECTOR,
        source: Address | None = None, target: Address | None = None,
        device_id: int | None = None,
    ) -> None:
        """
        Send a setpoint.

        :param pose: the attitude, None for none.
        :param rates: deg/s.
        :param source: its address, None for the component that operates the gimbal.
        :param target: None for the gimbal.
        :param device_id: the gimbal device of a manager, None for the one that it reports.
        """
        q = UNSET_QUATERNION if pose is None else Quaternion.from_euler(
            *map(math.radians, (pose.roll, pose.pitch, pose.yaw)))
        x, y, z = map(math.radians, rates)
        self.send(self.setpoint(target or self.device, device_id, flags, q, (x, y, z)),
                  source or self.operator)

    @property
    def operator(self) -> Address:
        """Return the address from which the gimbal is operated."""
        return self.address

    async def pause(self, seconds: float) -> None:
        """Wait, and send the messages that must be sent regularly."""
        await self.sleep(seconds)

    async def pose_when(
        self, condition: Callable[[Pose], bool], timeout: float = MOVE_TIMEOUT,
    ) -> Pose:
        """Return the first pose that meets a condition, or the last one before the timeout."""
        end = self.now + timeout
        while not condition(pose := await self.pose()) and self.now < end:
            await self.pause(POLL)
        return pose

    async def settle(self, pose: Pose) -> Pose:
        """Return the pose once the gimbal stays at a wanted one, or after MOVE_TIMEOUT."""
        end = self.now + MOVE_TIMEOUT
        while True:
            await self.pose_when(pose.near, end - self.now)
            # The gimbal may only have passed the wanted pose.
            await self.pause(SETTLE_TIME)
            if pose.near(now := await self.pose()) or self.now >= end:
                return now

    async def reach(self, pose: Pose, commanded: str = '') -> None:
        """
        Raise Failed if the gimbal does not turn to a pose and stay at it.

        :param commanded: the setpoint as text, by default the pose.
        """
        reached = await self.settle(pose)
        if not pose.near(reached):
            raise Failed(f'commanded {commanded or pose}, reached {reached} after '
                         f'{MOVE_TIMEOUT:g} s')

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
        return await self.pose_when(start.near)

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
        end = self.now + WATCH_TIME
        # A single deviating status does not count: the requirement "continuous" covers it.
        away = 0
        while away < 2 and self.now < end:
            pose = await self.pose()
            away = 0 if pose.near(before) else away + 1
            await self.pause(POLL)
        if away == 2:
            raise Failed(f'{cause}: it moved from {before} to {pose}')

    # Restoring

    async def save(self) -> str | None:
        """See :class:`Session`."""
        try:
            self._before = await self.pose()
        except Skipped:
            return None
        return str(self._before)

    def danger_of(self, message: Message) -> str:
        """See :class:`Session`: the gimbal must not turn beyond its range."""
        if not (isinstance(message, AttitudeStatus) and self.consent and self._limits
                and self._before):
            return ''
        try:
            pose = Pose.from_message(message)
        except ValueError:
            return ''
        # A gimbal may retract to a position beyond its range.
        beyond = '' if pose.flags & mavlink.GIMBAL_DEVICE_FLAGS_RETRACT else self._limits.exceeded(
            pose)
        # A single deviating status does not count: the requirement "continuous" covers it.
        self._beyond = self._beyond + 1 if beyond else 0
        return f'it turned to {pose}, {beyond}' if self._beyond > 1 else ''

    async def restore(self) -> list[str]:
        """See :class:`Session`."""
        before = self._before
        assert before is not None
        try:
            if self.danger:
                # Only stop it, since each other setpoint may turn it beyond its range again.
                await self.point(None, rates=(NAN, 0.0, 0.0))
                await self.prepare()
                await self.point(None, rates=(NAN, 0.0, 0.0))
            elif self.consent:
                await self._turn_back(before)
            is_back = before.near(await self.pose_when(before.near, 1.0))
        except Skipped:
            is_back = False
        await restore_interval(self, self.status)
        return [] if is_back else ['attitude']

    async def _turn_back(self, before: Pose) -> None:
        accepts = mavlink.GIMBAL_DEVICE_FLAGS_ACCEPTS_YAW_IN_EARTH_FRAME
        now = await self.pose()
        if now.near(before, 1.0) and not (now.flags ^ before.flags) & ~accepts:
            return
        await self.prepare()
        flags = before.flags & ~(accepts | mavlink.GIMBAL_DEVICE_FLAGS_YAW_IN_EARTH_FRAME)
        await self.point(before, flags=flags | mavlink.GIMBAL_DEVICE_FLAGS_YAW_IN_VEHICLE_FRAME)
        await self.pose_when(lambda pose: pose.near(before, 1.0))
        # Wait until the gimbal stands still.
        await self.pause(0.5)
