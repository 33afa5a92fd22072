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

"""Requirements on the attitude and the motion of gimbals, for devices and managers."""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Iterable
from dataclasses import replace
from functools import partial
from itertools import pairwise
import math
from typing import TypeAlias, TypeVar

from .tester import (
    GimbalTester,
    Information,
    Limits,
    NAN,
    Pose,
    PROPOSAL,
    RATE,
    STEP,
    TOLERANCE,
)
from ..axes import LEVEL
from ..messages import Capabilities, ErrorFlags
from ...mavlink.messages import MavCmd, MavResult, Message
from ...payload.checks.component_requirements import none_of
from ...payload.checks.requirement import (
    AnyRequirement,
    COMMAND,
    MESSAGES,
    Requirement,
    requirement,
    Specification,
)
from ...payload.checks.session import Failed, Skipped, Transaction
from ...payload.messages import GimbalDeviceAttitudeStatus as AttitudeStatus
from ...payload.mount_attitude import MountFlags, yaw_frame
from ...payload.rotation import Quaternion

STATUS = 'GIMBAL_DEVICE_ATTITUDE_STATUS'
# Degrees; the rotation between two statuses that the angular velocity need not explain.
JUMP = 8.0
FRAMES = MountFlags.YAW_IN_EARTH_FRAME | MountFlags.YAW_IN_VEHICLE_FRAME

T = TypeVar('T', bound=GimbalTester)
# Sends a setpoint; returns the transaction if the setpoint is a command.
Send: TypeAlias = Callable[[T, Pose], Awaitable[Transaction | None]]

moves = partial(requirement, needs_consent=True)


def reaches(
    name: str, title: str, specification: Specification, section: str, send: Send[T],
    yaw: float = STEP,
) -> Requirement[T]:
    """Return the requirement that a gimbal turns to a commanded attitude, and then back."""
    @moves(name, title, specification, section)
    async def check(tester: T) -> str:
        await tester.begin()
        for angles in ((-2 * STEP, yaw), (-STEP, 0.0)):
            target = await tester.target(*angles)
            if one := await send(tester, target):
                one.expect(accepted=True)
            await tester.reach(target)
        return str(await tester.pose())
    return check


def ignores(
    name: str, title: str, specification: Specification, section: str, cause: str, send: Send[T],
) -> Requirement[T]:
    """Return the requirement that a gimbal keeps its attitude after a call of ``send``."""
    @moves(name, title, specification, section)
    async def check(tester: T) -> None:
        before = await tester.begin()
        one = await send(tester, await tester.target(-2 * STEP, STEP))
        await tester.stays(before, cause)
        if one:
            one.expect(accepted=False)
    return check


def turns(
    name: str, title: str, specification: Specification, section: str,
    send: Callable[[T, float], Awaitable[Transaction | None]], speed: float, *,
    seconds: float = 1.0, slowest: float = 0.25, fastest: float = 3.0,
) -> Requirement[T]:
    """
    Return the requirement that a gimbal turns down for some seconds when a speed is sent.

    :param speed: deg/s, below 0.
    :param slowest: the lowest accepted speed, as a multiple of ``speed``.
    :param fastest: the highest accepted speed, likewise; infinite where the specification does
        not limit it.
    """
    @moves(name, title, specification, section)
    async def check(tester: T) -> str:
        before = await tester.begin()
        one = await send(tester, speed)
        await tester.pause(seconds)
        after = await tester.pose()
        await send(tester, 0.0)
        if one:
            one.expect(accepted=True)
        turned = after.pitch - before.pitch
        text = f'turned {turned:.1f} deg in {seconds:g} s'
        if fastest < math.inf:
            text = f'commanded {speed:g} deg/s, {text}'
        if not fastest * speed * seconds < turned < slowest * speed * seconds:
            raise Failed(text)
        return text
    return check


# INFORMATION

def information(cls: type[Information]) -> tuple[Requirement[GimbalTester], ...]:
    """Return the requirements on an INFORMATION message."""
    @requirement('information-static', f'sends the same {cls.name} at all times', PROPOSAL,
                 'Messaging (GM-10)')
    async def static(tester: GimbalTester) -> None:
        first, second = [await tester.session.required(cls) for _ in range(2)]
        # Compare texts, since NaN is not equal to NaN.
        if str(Limits.from_message(first)) != str(Limits.from_message(second)):
            raise Failed('two requests returned different limits or capabilities')

    @requirement('limits', 'reports a minimum that is at most the maximum of each axis',
                 MESSAGES, cls.name)
    async def limits(tester: GimbalTester) -> str:
        *ranges, _ = await tester.limits()
        if wrong := [f'{low:g} to {high:g} deg' for low, high in ranges if low > high]:
            raise Failed(', '.join(wrong))
        return ', '.join(f'{low:g} to {high:g}' for low, high in ranges) + ' deg'

    @requirement('pitch-axis', 'can turn about its pitch axis', PROPOSAL, 'Gimbals (GM-1)')
    async def pitch_axis(tester: GimbalTester) -> None:
        capabilities = (await tester.limits()).capabilities
        if not capabilities & Capabilities.HAS_PITCH_AXIS:
            raise Failed(f'{cls.name} has the capabilities 0x{capabilities:x}')

    return static, limits, pitch_axis


def command_int(cls: type[Message]) -> Requirement[GimbalTester]:
    """Return the requirement on COMMAND_INT, with a request of a message."""
    @requirement('command-int', 'answers COMMAND_INT, at least with MAV_RESULT_COMMAND_LONG_ONLY',
                 COMMAND, 'Use COMMAND_INT or COMMAND_LONG?')
    async def check(tester: GimbalTester) -> str:
        one = await tester.session.command(MavCmd.REQUEST_MESSAGE, cls.id, as_int=True)
        if one.result in (None, MavResult.UNSUPPORTED):
            raise one.failure()
        return one.answer
    return check


# GIMBAL_DEVICE_ATTITUDE_STATUS

def _statuses(
    name: str, title: str, section: str, deviation: Callable[[AttitudeStatus], str],
) -> Requirement[GimbalTester]:
    """
    Return a requirement on each status of the run.

    :param deviation: returns the error in a status, '' if there is none.
    """
    @requirement(name, title, MESSAGES, section, whole_run=True)
    async def check(tester: GimbalTester) -> str:
        received = [one for _, one in tester.session.received(AttitudeStatus)]
        if not received:
            raise Skipped('none was received')
        return none_of([Failed(text, []) for one in received if (text := deviation(one))],
                       len(received), 'statuses')
    return check


def _content(status: AttitudeStatus) -> str:
    norm = math.hypot(*status.q)
    return '' if abs(norm - 1.0) < 0.02 else f'the quaternion has the norm {norm:g}'


def _frame(status: AttitudeStatus) -> str:
    found = status.flags & FRAMES
    return '' if found not in (0, FRAMES) else f'flags 0x{status.flags:x} name ' + (
        'both frames' if found else 'no frame')


CONTENT = (
    _statuses('attitude', 'reports a unit quaternion', STATUS, _content),
    _statuses('yaw-frame', 'names the one frame of the reported yaw (GM-2)', STATUS, _frame),
)


@requirement('continuous', 'reports no attitude that its angular velocity does not explain',
             MESSAGES, STATUS, whole_run=True)
async def continuous(tester: GimbalTester) -> str:
    """Compare consecutive statuses in the same frame."""
    received = list(tester.session.received(AttitudeStatus))
    failures, count = [], 0
    for (before, one), (at, other) in pairwise(received):
        speeds = [math.hypot(*(rate for rate in (
            status.angular_velocity_x, status.angular_velocity_y, status.angular_velocity_z)
            if math.isfinite(rate))) for status in (one, other)]
        # Without rates the statuses do not say how far the gimbal turned.
        if not any(math.isfinite(status.angular_velocity_y) for status in (one, other)):
            continue
        if _content(one) or _content(other) or other.time_boot_ms < one.time_boot_ms:
            continue
        try:
            if yaw_frame(one.flags) is not yaw_frame(other.flags):
                continue
        except ValueError:
            # The requirement "yaw-frame" covers this error.
            continue
        count += 1
        turned = math.degrees(Quaternion(*one.q).normalized().angle_to(
            Quaternion(*other.q).normalized()))
        explained = math.degrees(max(speeds)) * (at - before)
        if turned > 1.5 * explained + JUMP:
            failures.append(Failed(
                f'{turned:.0f} deg in {at - before:.2f} s, and at most '
                f'{math.degrees(max(speeds)):.0f} deg/s', []))
    if not count:
        raise Skipped('fewer than two were received')
    return none_of(failures, count, 'pairs')


@requirement('uptime', 'counts time_boot_ms in real time and never backwards', MESSAGES, STATUS,
             whole_run=True)
async def uptime(tester: GimbalTester) -> None:
    """Look for a step back; a restart causes one."""
    for (_, one), (_, other) in pairwise(tester.session.received(AttitudeStatus)):
        back = (one.time_boot_ms - other.time_boot_ms) % (1 << 32)
        if 0 < back < 1 << 31:
            raise Failed(f'it went back from {one.time_boot_ms} to {other.time_boot_ms} ms')


@requirement('failures-at-rest', 'reports no failure before the first command', MESSAGES,
             'GIMBAL_DEVICE_ERROR_FLAGS')
async def failures_at_rest(tester: GimbalTester) -> None:
    """Read the flags; a device may report that it has no manager."""
    seen = {one.failure_flags & ~ErrorFlags.NO_MANAGER
            for _, one in tester.session.idle(AttitudeStatus)}
    if flags := [str(flag.name) for flag in ErrorFlags if any(one & flag for one in seen)]:
        raise Failed(', '.join(flags))
    if not seen:
        raise Skipped('none was received')


# Motion

@moves('stop', 'stops at a rate of 0', MESSAGES, 'GIMBAL_DEVICE_SET_ATTITUDE')
async def stop(tester: GimbalTester) -> None:
    """Turn down, then send a rate of 0."""
    await tester.begin()
    await tester.point(None, rates=(NAN, -RATE, NAN))
    await tester.pause(0.8)
    await tester.point(None, rates=(NAN, 0.0, NAN))
    await tester.pause(0.5)
    await tester.stays(await tester.steady(), 'after a rate of 0')


def _beyond(found: Limits) -> tuple[float, float]:
    low, high = found.pitch
    if not (math.isfinite(low) and math.isfinite(high)):
        raise Skipped('it does not report the range of its pitch')
    # A quaternion cannot have a pitch beyond the singular pitch of 90 degrees.
    if high <= 75.0:
        return high, high + STEP
    if low >= -75.0:
        return low, low - STEP
    raise Skipped('its pitch has a range that a quaternion cannot exceed')


@moves('range', 'keeps within the range that it reports', MESSAGES, 'GIMBAL_DEVICE_INFORMATION')
async def within_range(tester: GimbalTester) -> str:
    """Command a pitch beyond the range."""
    limit, beyond = _beyond(await tester.limits())
    start = await tester.begin()
    target = replace(start, roll=0.0, pitch=beyond)
    await tester.point(target)
    reached = await tester.until(lambda pose: abs(pose.pitch - limit) < 0.5)
    await tester.pause(0.5)
    reached = await tester.pose()
    if abs(reached.pitch) > abs(limit) + TOLERANCE and reached.pitch * limit > 0:
        raise Failed(f'commanded {beyond:g} deg, and it turned to {reached.pitch:.1f} deg; its '
                     f'limit is {limit:.1f} deg')
    return f'{reached.pitch:.1f} deg'


@moves('limit-flags', 'reports that the commanded pitch is beyond its range', MESSAGES,
       'GIMBAL_DEVICE_ERROR_FLAGS')
async def limit_flags(tester: GimbalTester) -> None:
    """Command a pitch beyond the range, and wait for AT_PITCH_LIMIT."""
    limit, beyond = _beyond(await tester.limits())
    start = await tester.begin()
    await tester.point(replace(start, roll=0.0, pitch=beyond))
    pose = await tester.until(lambda pose: bool(pose.failures & ErrorFlags.AT_PITCH_LIMIT))
    if abs(pose.pitch - limit) > TOLERANCE:
        raise Skipped(f'its pitch is {pose.pitch:.1f} deg, and its limit {limit:.1f} deg')
    if not pose.failures & ErrorFlags.AT_PITCH_LIMIT:
        raise Failed(f'commanded {beyond:.1f} deg, stopped at {pose.pitch:.1f} deg, no '
                     'AT_PITCH_LIMIT')


def _position(flag: MountFlags, capability: Capabilities) -> Requirement[GimbalTester]:
    name = str(flag.name).lower()

    @moves(name, f'reports {flag.name} when it is commanded to', MESSAGES, 'GIMBAL_DEVICE_FLAGS')
    async def check(tester: GimbalTester) -> str:
        await tester.requires(capability)
        await tester.begin()
        await tester.point(None, flags=flag | LEVEL | MountFlags.YAW_IN_VEHICLE_FRAME)
        pose = await tester.until(lambda pose: bool(pose.flags & flag), 2.0)
        if not pose.flags & flag:
            raise Failed(f'flags 0x{pose.flags:x}')
        await tester.pause(1.0)
        return str(await tester.pose())
    return check


POSITIONS = (_position(MountFlags.NEUTRAL, Capabilities.HAS_NEUTRAL),
             _position(MountFlags.RETRACT, Capabilities.HAS_RETRACT))
MOTION: tuple[AnyRequirement, ...] = (
    ignores('hold', 'keeps its attitude when attitude and rates are unset', MESSAGES,
            'GIMBAL_DEVICE_SET_ATTITUDE', 'a setpoint of NaN',
            lambda tester, pose: tester.point(None)),
    turns('rate', 'turns at a rate', MESSAGES, 'GIMBAL_DEVICE_SET_ATTITUDE',
          lambda tester, speed: tester.point(None, rates=(NAN, speed, NAN)), -RATE,
          seconds=1.5, slowest=1 / 3, fastest=2.0),
    stop, within_range, limit_flags, *POSITIONS)


def earth_yaw(poses: Iterable[Pose]) -> list[float]:
    """Return the yaws relative to north, degrees."""
    return [math.remainder(pose.yaw + pose.heading, 360.0) for pose in poses]
