# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The inputs of a camera: their messages are accepted or refused, and they become stale."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator, Mapping, Sequence
import contextlib
from dataclasses import dataclass, field
from enum import Enum
import math
from typing import NamedTuple

from .conversions import MountFrame
from ..geometry.rotation import Vector
from ..mavlink.durations import format_seconds

# s for which the offset of UTC from ROS time holds.
TIME_REFERENCE_LIFETIME = 60.0
NANO = 1_000_000_000
# The last messages of an input; most of them may be refused though it is not stale.
RECENT_MESSAGES = 10
UNKNOWN: Vector = (math.nan, math.nan, math.nan)


class Input(Enum):
    """The inputs, named after their topics."""

    FIX = 'fix'
    VELOCITY = 'velocity'
    VELOCITY_WITH_COVARIANCE = 'velocity_with_covariance'
    ODOMETRY = 'odometry'
    SATELLITES = 'satellites'
    IMU = 'imu'
    ATTITUDE = 'attitude'
    MOUNT = 'mount'
    TIME_REFERENCE = 'time_reference'


# The inputs with a velocity, the preferred ones first.
VELOCITIES = (Input.VELOCITY, Input.VELOCITY_WITH_COVARIANCE, Input.ODOMETRY)
# The inputs of attitude and mount, which are sent as pairs.
PAIR = (Input.IMU, Input.ATTITUDE, Input.MOUNT)
# Inputs that are used with later messages of others, so that their ages count from their stamps.
USED_LATER = (*VELOCITIES, Input.TIME_REFERENCE)


class InputState(Enum):
    """The state of an input."""

    MISSING = 'missing'
    OK = 'ok'
    UNSENT = 'unsent'
    STALE = 'stale'
    REFUSED = 'refused'


class PositionSource(Enum):
    """The messages by which the camera gets position and UTC; only one kind may be sent."""

    RAW = 'raw'
    FUSED = 'fused'


@dataclass(frozen=True)
class CameraSettings:
    """
    The settings of the client of a camera.

    :param geoid_separation: height of mean sea level above the ellipsoid, m.
    :param mount_frame: the axes of the camera's frame in ``~/mount``.
    :param attitude_rate: the highest rate of attitudes, Hz.
    :param position_timeout: age, s, at which a fix, a velocity or satellites are stale.
    :param attitude_timeout: likewise for an attitude or a mount.
    :param heartbeat_timeout: silence after which the camera is lost, s.
    """

    position_source: PositionSource = PositionSource.RAW
    geoid_separation: float = 0.0
    mount_frame: MountFrame = MountFrame.CAMERA
    attitude_rate: float = 20.0
    position_timeout: float = 1.0
    attitude_timeout: float = 0.5
    send_gps_status: bool = False
    heartbeat_timeout: float = 3.5

    def timeout(self, name: Input) -> float:
        """Return the age at which an input is stale, s."""
        if name is Input.TIME_REFERENCE:
            return TIME_REFERENCE_LIFETIME
        return self.attitude_timeout if name in PAIR else self.position_timeout


class Stamp(NamedTuple):
    """
    The stamp of a message.

    :param time: ROS time, ns.
    :param age: its age on reception by the ROS clock, s; negative for a stamp in the future.
    :param simulated: whether ROS time is simulated, so that it is not UTC.
    """

    time: int
    age: float
    simulated: bool = False


@dataclass(frozen=True)
class InputSnapshot:
    """
    An input at one moment.

    :param age: since the last accepted message, s; None if there was none.
    :param refusal: why the last refused message was refused, '' if no message was.
    :param refused_age: the time since that message, s; None if no message was refused.
    :param refused: the number of refused messages.
    :param refused_lately: how many of the last :data:`RECENT_MESSAGES`.
    """

    state: InputState
    age: float | None
    refusal: str
    refused_age: float | None
    refused: int
    refused_lately: int


@dataclass
class _Tracker:
    """
    Tracks whether an input is missing, sent, not sent in time, stale or refused.

    :param last: the stamp of the last accepted message by ROS time, ns; None after a jump of it.
    :param waits_since: when the first message was accepted that no sent one has followed.
    """

    timeout: float
    last: int | None = None
    accepted_at: float = -math.inf
    waits_since: float = math.inf
    refused_at: float = -math.inf
    refusal: str = ''
    refused: int = 0
    # Whether each of the last messages was refused.
    lately: deque[bool] = field(default_factory=lambda: deque(maxlen=RECENT_MESSAGES))

    def is_fresh(self, now: float) -> bool:
        return now < self.accepted_at + self.timeout

    def state(self, now: float) -> InputState:
        if self.is_fresh(now):
            is_late = now >= self.waits_since + self.timeout
            return InputState.UNSENT if is_late else InputState.OK
        if now < self.refused_at + self.timeout:
            return InputState.REFUSED
        if max(self.accepted_at, self.refused_at) > -math.inf:
            return InputState.STALE
        return InputState.MISSING

    def snapshot(self, now: float) -> InputSnapshot:
        accepted, refused = (now - at if at > -math.inf else None
                             for at in (self.accepted_at, self.refused_at))
        return InputSnapshot(self.state(now), accepted, self.refusal, refused, self.refused,
                             sum(self.lately))


class InputStates:
    """The states of all inputs."""

    def __init__(self, settings: CameraSettings) -> None:
        self._link_is_open = False
        self._trackers = {name: _Tracker(settings.timeout(name)) for name in Input}

    @contextlib.contextmanager
    def receiving(self, name: Input, now: float, stamp: Stamp | None = None) -> Iterator[None]:
        """Take a message in the context, which raises ValueError with the reason to refuse it."""
        tracker = self._trackers[name]
        if not tracker.is_fresh(now):
            # A message that waited before a pause of the input has been dropped.
            tracker.waits_since = math.inf
        try:
            yield
        except ValueError as error:
            tracker.refused += 1
            tracker.refused_at, tracker.refusal = now, str(error)
            tracker.lately.append(True)
            return
        tracker.lately.append(False)
        tracker.accepted_at = now
        if stamp is not None:
            tracker.last = stamp.time
            if name in USED_LATER:
                tracker.accepted_at -= max(0.0, stamp.age)

    def wait(self, names: Sequence[Input], now: float) -> None:
        """Note that a message of some inputs is sent once the line has room for it."""
        for name in names if self._link_is_open else ():
            tracker = self._trackers[name]
            tracker.waits_since = min(tracker.waits_since, now)

    def set_link(self, *, is_open: bool) -> None:
        """Note whether messages can be sent; while they cannot, that is a state of the link."""
        self._link_is_open = is_open
        if not is_open:
            self.sent(tuple(Input))

    def sent(self, names: Sequence[Input]) -> None:
        """Note that a message of some inputs is sent."""
        for name in names:
            self._trackers[name].waits_since = math.inf

    def check(self, name: Input, stamp: Stamp) -> None:
        """Raise ValueError if a stamp is old, in the future, or not newer than the last one."""
        tracker = self._trackers[name]
        if stamp.age > tracker.timeout:
            raise ValueError(f'its stamp is {format_seconds(stamp.age)} old by the ROS clock')
        if stamp.age < -tracker.timeout:
            raise ValueError(f'its stamp is {format_seconds(-stamp.age)} ahead of the ROS clock')
        if tracker.last is not None and stamp.time <= tracker.last:
            whole = stamp.time % NANO == 0 and stamp.time == tracker.last
            raise ValueError('its stamp is not newer than the last'
                             + (', since its stamps are whole seconds' if whole else ''))

    def clock_jumped(self) -> None:
        """Compare no stamp with those from before a jump of ROS time."""
        for tracker in self._trackers.values():
            tracker.last = None

    def is_fresh(self, name: Input, now: float) -> bool:
        """Return whether an input can be used."""
        return self._trackers[name].is_fresh(now)

    def snapshot(self, now: float) -> Mapping[Input, InputSnapshot]:
        """Return all inputs at this moment."""
        return {name: one.snapshot(now) for name, one in self._trackers.items()}
