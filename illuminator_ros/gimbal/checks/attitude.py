# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Requirements on the attitude and the motion of gimbals, for devices and managers."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from dataclasses import replace
from functools import partial
from itertools import pairwise
import math
from typing import TypeAlias, TypeVar

from .session import (
    FORWARD,
    GimbalSession,
    Information,
    Limits,
    NAN,
    NORTH,
    Pose,
    PROPOSAL,
    RATE,
    STEP,
    TOLERANCE,
)
from ..axes import CONDITIONS
from ...checks.component_requirements import check_command_int, none_of, uptime
from ...checks.outcomes import Failed, Skipped
from ...checks.requirements import AnyRequirement, Check, Requirement, requirement
from ...checks.session import Transaction
from ...checks.specifications import COMMAND, MESSAGES, Specification
from ...geometry.mount_attitude import AXES
from ...geometry.rotation import Quaternion
from ...mavlink.dialect import flag_names, mavlink, short_names
from ...mavlink.messages import Message
from ...payload.messages import GimbalDeviceAttitudeStatus as AttitudeStatus

STATUS = 'GIMBAL_DEVICE_ATTITUDE_STATUS'
# Degrees; the rotation between two statuses that the angular velocity need not explain.
JUMP = 8.0
# Degrees; the steepest pitch that is commanded.
STEEP = 75.0
UNREACHABLE = 'a quaternion cannot have a pitch beyond its range'
# Degrees from a limit at which AT_PITCH_LIMIT contradicts it; the vehicle may be tilted.
FAR_FROM_LIMIT = 45.0
# The most turns of yaw in one direction that a range may permit: a cable limits a gimbal without
# slip rings.
MAX_TURNS = 10
FRAMES = (mavlink.GIMBAL_DEVICE_FLAGS_YAW_IN_EARTH_FRAME
          | mavlink.GIMBAL_DEVICE_FLAGS_YAW_IN_VEHICLE_FRAME)
# The flags from which the frame of the yaw follows.
FRAME_FLAGS = FRAMES | mavlink.GIMBAL_DEVICE_FLAGS_YAW_LOCK

T = TypeVar('T', bound=GimbalSession, contravariant=True)
# Sends a setpoint; returns the transaction if the setpoint is a command.
Send: TypeAlias = Callable[[T, Pose], Awaitable[Transaction | None]]

moves = partial(requirement, needs_consent=True)


def reaches(send: Send[T], yaw: float = STEP) -> Check[T]:
    """Return the check that a gimbal turns to a commanded attitude, and then back."""
    async def check(gimbal: T) -> str:
        await gimbal.begin()
        for angles in ((-2 * STEP, yaw), (-STEP, 0.0)):
            target = await gimbal.target(*angles)
            if one := await send(gimbal, target):
                one.expect(accepted=True)
            await gimbal.reach(target)
        return str(await gimbal.pose())
    return check


def ignores(cause: str, send: Send[T]) -> Check[T]:
    """Return the check that a gimbal keeps its attitude after a call of ``send``."""
    async def check(gimbal: T) -> None:
        before = await gimbal.begin()
        one = await send(gimbal, await gimbal.target(-2 * STEP, STEP))
        await gimbal.stays(before, cause)
        if one:
            one.expect(accepted=False)
    return check


def turns(
    send: Callable[[T, float], Awaitable[Transaction | None]], speed: float, *,
    seconds: float = 1.0, slowest: float = 0.25, fastest: float = 3.0,
) -> Check[T]:
    """
    Return the check that a gimbal turns down, or up, for some time when a speed is sent.

    :param speed: deg/s.
    :param slowest: the lowest accepted speed, as a multiple of ``speed``.
    :param fastest: the highest accepted speed, likewise; infinite where the specification does
        not limit it.
    """
    async def check(gimbal: T) -> str:
        before = await gimbal.begin()
        direction = await gimbal.free_direction(before, 2 * speed * seconds)
        one = await send(gimbal, direction * speed)
        await gimbal.pause(seconds)
        after = await gimbal.pose()
        await send(gimbal, 0.0)
        if one:
            one.expect(accepted=True)
        turned = after.pitch - before.pitch
        text = f'turned {turned:.1f} deg in {seconds:g} s'
        if fastest < math.inf:
            text = f'commanded {direction * speed:g} deg/s, {text}'
        if not slowest * speed * seconds < direction * turned < fastest * speed * seconds:
            raise Failed(text)
        return text
    return check


async def turn_from_north(gimbal: GimbalSession, heading: float) -> str:
    """
    Command a yaw relative to north without locking it, and return it as text.

    :param heading: of the vehicle, degrees.
    """
    target = await gimbal.target(-STEP, STEP)
    yaw = math.remainder(target.yaw + heading, 360.0)
    await gimbal.point(replace(target, yaw=yaw), flags=NORTH)
    text = f'{yaw:.1f} deg from north'
    await gimbal.reach(target, f'{text} at a heading of {heading:.1f} deg')
    return text


# INFORMATION

def information(cls: type[Information]) -> tuple[Requirement[GimbalSession], ...]:
    """Return the requirements on an INFORMATION message."""
    @requirement('information-static', f'sends the same {cls.msgname} at all times', PROPOSAL,
                 'Messaging (GM-10)')
    async def static(gimbal: GimbalSession) -> None:
        first, second = [await gimbal.required(cls) for _ in range(2)]
        # Compare texts, since NaN is not equal to NaN.
        if str(Limits.from_message(first)) != str(Limits.from_message(second)):
            raise Failed('two requests returned different limits or capabilities')

    @requirement('limits', 'reports a range of each axis whose ends are in order, and in rad',
                 MESSAGES, cls.msgname)
    async def limits(gimbal: GimbalSession) -> str:
        ranges = dict(zip(AXES, (await gimbal.limits())[:3], strict=True))
        failures = [
            f'{axis} {math.radians(low):g} to {math.radians(high):g} rad: {reason}'
            for axis, (low, high) in ranges.items() if (reason := _implausible(axis, low, high))]
        if failures:
            raise Failed('; '.join(failures))
        return ', '.join(f'{low:g} to {high:g}' for low, high in ranges.values()) + ' deg'

    @requirement('pitch-axis', 'reports a pitch axis, if it reports a range of its pitch',
                 PROPOSAL, 'Gimbals (GM-1)')
    async def pitch_axis(gimbal: GimbalSession) -> None:
        found = await gimbal.limits()
        if not found.capabilities & mavlink.GIMBAL_DEVICE_CAP_FLAGS_HAS_PITCH_AXIS:
            text = f'{cls.msgname} has the capabilities 0x{found.capabilities:x}'
            raise Failed(text) if found.pitch.low < found.pitch.high else Skipped(text)

    return static, limits, pitch_axis


def _implausible(axis: str, low: float, high: float) -> str:
    """Return why a range, degrees, cannot be right, '' if it can; an unknown end is NaN."""
    if low > high:
        return 'the minimum is above the maximum'
    turns = MAX_TURNS if axis == 'yaw' else 1
    is_far = any(turns * 360.0 < abs(end) < math.inf for end in (low, high))
    return f'more than {"one turn" if turns == 1 else f"{turns} turns"}, so in degrees?' if (
        is_far) else ''


def command_int(cls: type[Message]) -> Requirement[GimbalSession]:
    """Return the requirement on COMMAND_INT, with a request of a message."""
    @requirement('command-int', 'executes a command as COMMAND_INT, if it takes that message',
                 COMMAND, 'Use COMMAND_INT or COMMAND_LONG?')
    async def check(gimbal: GimbalSession) -> str:
        one, message = await gimbal.ask(cls, as_int=True)
        check_command_int(one)
        if one.accepted and message is None:
            raise Failed(f'COMMAND_INT {one.text}: {one.answer}, but no {cls.msgname}', one.lines)
        return one.answer
    return check


# GIMBAL_DEVICE_ATTITUDE_STATUS

def statuses(
    name: str, title: str, deviation: Callable[[AttitudeStatus], str],
    specification: Specification = MESSAGES, section: str = STATUS,
) -> Requirement[GimbalSession]:
    """
    Return a requirement on each status of the run.

    :param deviation: returns the error in a status, '' if there is none.
    """
    @requirement(name, title, specification, section, whole_run=True)
    async def check(gimbal: GimbalSession) -> str:
        received = [one for _, one in gimbal.received(AttitudeStatus)]
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
    if not found:
        raise Skipped(f'flags 0x{status.flags:x} name no frame, as those of old devices')
    return f'flags 0x{status.flags:x} name both frames' if found == FRAMES else ''


def _speed(status: AttitudeStatus) -> float:
    """Return the angular velocity, deg/s; NaN without the rate of each axis."""
    return math.degrees(math.hypot(
        status.angular_velocity_x, status.angular_velocity_y, status.angular_velocity_z))


def _are_comparable(one: AttitudeStatus, other: AttitudeStatus) -> bool:
    """Return whether two statuses say how far the gimbal turned between them."""
    return not (math.isnan(_speed(one) + _speed(other)) or _content(one) or _content(other)
                or other.time_boot_ms < one.time_boot_ms
                or (one.flags ^ other.flags) & FRAME_FLAGS)


@requirement('continuous', 'reports no attitude that its angular velocity does not explain',
             MESSAGES, STATUS, whole_run=True)
async def continuous(gimbal: GimbalSession) -> str:
    """Compare consecutive statuses in the same frame."""
    failures, count = [], 0
    for (before, one), (at, other) in pairwise(gimbal.received(AttitudeStatus)):
        if _are_comparable(one, other):
            count += 1
            turned = math.degrees(Quaternion(*one.q).normalized().angle_to(
                Quaternion(*other.q).normalized()))
            speed = max(_speed(one), _speed(other))
            if turned > 1.5 * speed * (at - before) + JUMP:
                failures.append(Failed(f'{turned:.0f} deg in {at - before:.2f} s, and at most '
                                       f'{speed:.0f} deg/s', []))
    if not count:
        raise Skipped('fewer than two were received')
    return none_of(failures, count, 'pairs')


STATUSES = (
    statuses('attitude', 'reports a unit quaternion', _content),
    statuses('yaw-frame', 'names the one frame of the reported yaw (GM-2)', _frame),
    continuous, uptime(AttitudeStatus, 'time_boot_ms'),
)


@requirement('failures-at-rest', 'reports no failure before the first command', MESSAGES,
             'GIMBAL_DEVICE_ERROR_FLAGS')
async def failures_at_rest(gimbal: GimbalSession) -> None:
    """Read the flags, except those of normal operation."""
    seen = {one.failure_flags & ~CONDITIONS for _, one in gimbal.idle(AttitudeStatus)}
    if names := [name for flag, name in short_names('GIMBAL_DEVICE_ERROR_FLAGS').items()
                 if any(one & flag for one in seen)]:
        raise Failed(', '.join(names))
    if not seen:
        raise Skipped('none was received')


# Motion

@moves('stop', 'stops at a rate of 0', MESSAGES, 'GIMBAL_DEVICE_SET_ATTITUDE')
async def stop(gimbal: GimbalSession) -> None:
    """Turn down or up, then send a rate of 0."""
    direction = await gimbal.free_direction(await gimbal.begin(), 2 * RATE)
    await gimbal.point(None, rates=(NAN, direction * RATE, NAN))
    await gimbal.pause(0.8)
    await gimbal.point(None, rates=(NAN, 0.0, NAN))
    await gimbal.pause(1.0)
    await gimbal.stays(await gimbal.pose(), 'after a rate of 0')


async def _command_end_of_pitch(gimbal: GimbalSession) -> tuple[int, float, float]:
    """
    Command a pitch beyond the range, or else the steepest one.

    :return: 1 for the upper end, or -1 for the lower one; this end, and the commanded pitch,
        degrees.
    """
    await gimbal.requires(mavlink.GIMBAL_DEVICE_CAP_FLAGS_HAS_PITCH_AXIS)
    low, high = (await gimbal.limits()).pitch
    if not (math.isfinite(low) and math.isfinite(high)):
        raise Skipped('it does not report the range of its pitch')
    sign, limit = (-1, low) if high > STEEP and low >= -STEEP else (1, high)
    commanded = STEEP if limit > STEEP else limit + sign * STEP
    await gimbal.point(replace(await gimbal.begin(), roll=0.0, pitch=commanded))
    return sign, limit, commanded


@moves('range', 'keeps within the range that it reports', MESSAGES, 'GIMBAL_DEVICE_INFORMATION')
async def within_range(gimbal: GimbalSession) -> str:
    """Command a pitch beyond the range, or the steepest one in it."""
    sign, limit, commanded = await _command_end_of_pitch(gimbal)
    await gimbal.pose_when(lambda pose: abs(pose.pitch - limit) < 0.5)
    await gimbal.pause(0.5)
    reached = await gimbal.pose()
    text = f'commanded {commanded:.1f} deg, turned to {reached.pitch:.1f} deg'
    beyond = sign * (reached.pitch - limit)
    if beyond > TOLERANCE:
        raise Failed(f'{text}; its limit is {limit:.1f} deg')
    if (reached.failures & mavlink.GIMBAL_DEVICE_ERROR_FLAGS_AT_PITCH_LIMIT
            and beyond < -FAR_FROM_LIMIT):
        raise Failed(f'{text}, and reports AT_PITCH_LIMIT; its limit is {limit:.1f} deg')
    if sign * (commanded - limit) <= 0:
        raise Skipped(f'{text}: {UNREACHABLE}')
    return f'{reached.pitch:.1f} deg'


@moves('limit-flags', 'reports that the commanded pitch is beyond its range', MESSAGES,
       'GIMBAL_DEVICE_ERROR_FLAGS')
async def limit_flags(gimbal: GimbalSession) -> None:
    """Command a pitch beyond the range, and wait for AT_PITCH_LIMIT."""
    sign, limit, commanded = await _command_end_of_pitch(gimbal)
    if sign * (commanded - limit) <= 0:
        raise Skipped(UNREACHABLE)
    flag = mavlink.GIMBAL_DEVICE_ERROR_FLAGS_AT_PITCH_LIMIT
    pose = await gimbal.pose_when(
        lambda pose: bool(pose.failures & flag) and abs(pose.pitch - limit) <= TOLERANCE)
    if abs(pose.pitch - limit) > TOLERANCE:
        raise Skipped(f'its pitch is {pose.pitch:.1f} deg, and its limit {limit:.1f} deg')
    if not pose.failures & flag:
        raise Failed(f'commanded {commanded:.1f} deg, stopped at {pose.pitch:.1f} deg, no '
                     'AT_PITCH_LIMIT')


def _position(flag: int, capability: int) -> Requirement[GimbalSession]:
    [name] = flag_names('GIMBAL_DEVICE_FLAGS', flag)

    @moves(name, f'reports {name.upper()} when it is commanded to', MESSAGES,
           'GIMBAL_DEVICE_FLAGS')
    async def check(gimbal: GimbalSession) -> str:
        await gimbal.requires(capability)
        await gimbal.begin()
        await gimbal.point(None, flags=flag | FORWARD)
        pose = await gimbal.pose_when(lambda pose: bool(pose.flags & flag), 2.0)
        if not pose.flags & flag:
            raise Failed(f'flags 0x{pose.flags:x}')
        await gimbal.pause(1.0)
        return str(await gimbal.pose())
    return check


MOTION: tuple[AnyRequirement, ...] = (
    moves('hold', 'keeps its attitude when attitude and rates are unset', MESSAGES,
          'GIMBAL_DEVICE_SET_ATTITUDE')(
        ignores('a setpoint of NaN', lambda gimbal, pose: gimbal.point(None))),
    moves('rate', 'turns at a rate', MESSAGES, 'GIMBAL_DEVICE_SET_ATTITUDE')(turns(
        lambda gimbal, speed: gimbal.point(None, rates=(NAN, speed, NAN)), RATE, seconds=1.5,
        slowest=1 / 3, fastest=2.0)),
    stop, within_range, limit_flags,
    _position(mavlink.GIMBAL_DEVICE_FLAGS_NEUTRAL, mavlink.GIMBAL_DEVICE_CAP_FLAGS_HAS_NEUTRAL),
    _position(mavlink.GIMBAL_DEVICE_FLAGS_RETRACT, mavlink.GIMBAL_DEVICE_CAP_FLAGS_HAS_RETRACT))
