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
Position, UTC, attitude and mount for the camera: checked, and not repeated.

A refused or stale input is not sent. The camera then falls back to its own sensors, 5 s after
the last message. Only a fixed mount is repeated.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from enum import Enum
import math
from typing import NamedTuple

from . import conversions
from .conversions import FIRST_UTC, LAST_UTC, MountFrame, MountParent, Position
from ..mavlink.command_sender import format_seconds
from ..mavlink.messages import Address, Message, time_boot_ms
from ..payload.rotation import Quaternion, Vector

# s between messages about a fixed mount while there is no attitude; the camera uses it for 5 s.
MOUNT_INTERVAL = 1.0
GPS_STATUS_INTERVAL = 1.0
# s for which the offset of UTC from ROS time holds.
TIME_REFERENCE_LIFETIME = 60.0
# Attitudes, and mounts, that are kept to find a pair of one instant.
MAX_SAMPLES = 256
NANO = 1_000_000_000
# The first ROS time, ns, whose seconds do not fit into the int32 of a stamp.
END_OF_STAMPS = 2**31 * NANO
UNKNOWN: Vector = (math.nan, math.nan, math.nan)


class PositionSource(Enum):
    """The messages by which the camera gets position and UTC; only one kind may be sent."""

    RAW = 'raw'
    FUSED = 'fused'


class Input(Enum):
    """The inputs, named after their topics."""

    FIX = 'fix'
    VELOCITY = 'velocity'
    SATELLITES = 'satellites'
    IMU = 'imu'
    ATTITUDE = 'attitude'
    MOUNT = 'mount'
    TIME_REFERENCE = 'time_reference'


class InputState(Enum):
    """The state of an input."""

    MISSING = 'missing'
    OK = 'ok'
    STALE = 'stale'
    REFUSED = 'refused'


@dataclass(frozen=True)
class FeederSettings:
    """
    The settings of the inputs.

    :param geoid_separation: height of mean sea level above the ellipsoid, m.
    :param mount_frame: the axes of the camera's frame in ``~/mount``.
    :param attitude_rate: the highest rate of attitudes, Hz.
    :param position_timeout: age, s, at which a fix, a velocity or satellites are stale.
    :param attitude_timeout: likewise for an attitude or a mount.
    """

    position_source: PositionSource = PositionSource.RAW
    geoid_separation: float = 0.0
    mount_frame: MountFrame = MountFrame.CAMERA
    attitude_rate: float = 20.0
    position_timeout: float = 1.0
    attitude_timeout: float = 0.5
    send_gps_status: bool = False

    def timeout(self, name: Input) -> float:
        """Return the age at which an input is stale, s."""
        if name is Input.TIME_REFERENCE:
            return TIME_REFERENCE_LIFETIME
        return (self.attitude_timeout if name in (Input.IMU, Input.ATTITUDE, Input.MOUNT)
                else self.position_timeout)


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
    """

    state: InputState
    age: float | None
    refusal: str
    refused_age: float | None
    refused: int


@dataclass(frozen=True)
class InputChanged:
    """
    The state of an input has changed.

    :param text: the reason, for people.
    """

    input: Input  # noqa: A003 - the field's term
    state: InputState
    text: str


@dataclass(frozen=True)
class FeederSnapshot:
    """
    All inputs at one moment.

    :param needed: groups of inputs; one input of each group must be received.
    :param positions: sent positions, and ``attitudes``, sent pairs of attitude and mount. Messages
        that are made while the link is closed are dropped, and are not counted.
    """

    inputs: Mapping[Input, InputSnapshot]
    needed: Sequence[Sequence[Input]]
    positions: int
    attitudes: int

    @property
    def lacking(self) -> list[Sequence[Input]]:
        """Return the groups in which no input can be used."""
        return [group for group in self.needed
                if all(self.inputs[name].state is not InputState.OK for name in group)]


class _Tracker:
    """Tracks whether an input is missing, used, stale or refused."""

    def __init__(self, name: Input, timeout: float) -> None:
        self._name = name
        self._timeout = timeout
        self._accepted_at = -math.inf
        self._refused_at = -math.inf
        self._refusal = ''
        self._refused = 0
        self._reported = InputState.MISSING

    def accept(self, at: float) -> None:
        self._accepted_at = at

    def refuse(self, reason: str, now: float) -> None:
        self._refused += 1
        self._refused_at, self._refusal = now, reason

    def state(self, now: float) -> InputState:
        if now < self._accepted_at + self._timeout:
            return InputState.OK
        if now < self._refused_at + self._timeout:
            return InputState.REFUSED
        if max(self._accepted_at, self._refused_at) > -math.inf:
            return InputState.STALE
        return InputState.MISSING

    def change(self, now: float) -> InputChanged | None:
        """Return the state if it has changed since the last call."""
        state = self.state(now)
        if state is self._reported:
            return None
        self._reported = state
        text = {InputState.OK: 'received', InputState.REFUSED: self._refusal}.get(
            state, f'nothing for {format_seconds(self._timeout)}')
        return InputChanged(self._name, state, text)

    def next_change(self) -> float:
        """Return when the state ends by itself, s."""
        if self._reported is InputState.OK:
            return self._accepted_at + self._timeout
        return (self._refused_at + self._timeout if self._reported is InputState.REFUSED
                else math.inf)

    def snapshot(self, now: float) -> InputSnapshot:
        def age(at: float) -> float | None:
            return now - at if at > -math.inf else None

        return InputSnapshot(self.state(now), age(self._accepted_at), self._refusal,
                             age(self._refused_at), self._refused)


class _Sample(NamedTuple):
    time: int
    rotation: Quaternion
    rates: Vector


@dataclass
class _History:
    """Rotations of one input in the order of their stamps."""

    timeout: float
    samples: deque[_Sample] = field(default_factory=lambda: deque(maxlen=MAX_SAMPLES))

    def add(self, sample: _Sample) -> None:
        if self.samples:
            _check_newer(sample.time, self.samples[-1].time)
        self.samples.append(sample)

    def at(self, time: int) -> _Sample | None:
        """Return the rotation at a time, interpolated; None if it is not known."""
        newer: _Sample | None = None
        for sample in reversed(self.samples):
            if sample.time <= time:
                if newer is None or sample.time == time:
                    return sample if sample.time == time else None
                if newer.time - sample.time > self.timeout * NANO:
                    return None
                share = (time - sample.time) / (newer.time - sample.time)
                return _Sample(time, conversions.interpolate(
                    sample.rotation, newer.rotation, share), newer.rates)
            newer = sample
        return None


@dataclass(frozen=True)
class _Reference:
    time: int
    # UTC less ROS time, ns.
    offset: int


class Feeder:
    """
    Makes messages for the camera from the inputs.

    :param send: sends a message.
    :param target: returns the address of the camera.
    :param emit: takes the changes of inputs.
    """

    def __init__(
        self, settings: FeederSettings, send: Callable[[Message], None],
        target: Callable[[], Address], emit: Callable[[InputChanged], None],
    ) -> None:
        self._settings = settings
        self._send = send
        self._target = target
        self._emit = emit
        self._inputs = {name: _Tracker(name, settings.timeout(name)) for name in Input}
        self._fix_time: int | None = None
        self._velocity: Vector | None = None
        self._velocity_time: int | None = None
        self._satellites: int | None = None
        self._gps_status_due = -math.inf
        self._reference: _Reference | None = None
        self._needs_reference = False
        self._attitudes = {name: _History(settings.attitude_timeout)
                           for name in (Input.IMU, Input.ATTITUDE)}
        self._mounts = _History(settings.attitude_timeout)
        self._mount_parent = MountParent.VEHICLE
        # Roll, pitch and yaw of a fixed mount, degrees; None if ~/mount has a publisher.
        self._fixed_mount: Vector | None = (0.0, 0.0, 0.0)
        self._fixed_since = -math.inf
        self._link_open = False
        self._mount_due = math.inf
        self._pair_due = -math.inf
        self._pair_time = 0
        self._positions = self._pairs = 0

    def snapshot(self, now: float) -> FeederSnapshot:
        """Return all inputs at this moment."""
        needed: list[tuple[Input, ...]] = [(Input.FIX,), (Input.IMU, Input.ATTITUDE)]
        if self._settings.position_source is PositionSource.FUSED:
            needed.append((Input.VELOCITY,))
        if self._fixed_mount is None:
            needed.append((Input.MOUNT,))
        if self._needs_reference:
            needed.append((Input.TIME_REFERENCE,))
        return FeederSnapshot({name: one.snapshot(now) for name, one in self._inputs.items()},
                              needed, self._positions, self._pairs)

    # Position and time

    def take_fix(self, position: Position, stamp: Stamp, now: float) -> None:
        """Send a position at once, or refuse it."""
        self._take(Input.FIX, now, lambda: self._send_position(position, stamp, now))

    def _send_position(self, position: Position, stamp: Stamp, now: float) -> None:
        settings = self._settings
        conversions.fix_type(position.status)
        utc = self._utc(stamp)
        _check_age(stamp, settings.position_timeout)
        if self._fix_time is not None:
            _check_newer(stamp.time, self._fix_time)
        velocity = self._velocity if self._is_fresh(Input.VELOCITY, now) else None
        if settings.position_source is PositionSource.RAW:
            satellites = self._satellites if self._is_fresh(Input.SATELLITES, now) else None
            self._send(conversions.gps_raw_int(
                position, utc // 1000, velocity, satellites, settings.geoid_separation))
        elif velocity is None:
            raise ValueError('position_source fused needs ~/velocity, which is missing')
        else:
            boot_ms = time_boot_ms(now)
            placed = conversions.global_position_int(
                position, velocity, settings.geoid_separation, boot_ms)
            self._send(conversions.system_time(utc // 1000, boot_ms))
            self._send(placed)
        self._fix_time = stamp.time
        self._positions += self._link_open

    def _utc(self, stamp: Stamp) -> int:
        """Return the UTC of a stamp, ns."""
        offset = 0
        if self._needs_reference:
            if self._reference is None:
                raise ValueError('ROS time has jumped: waiting for ~/time_reference')
            age = abs(stamp.time - self._reference.time) / NANO
            if age > TIME_REFERENCE_LIFETIME:
                raise ValueError(f'~/time_reference is {format_seconds(age)} old')
            offset = self._reference.offset
        elif stamp.simulated:
            raise ValueError('ROS time is simulated (use_sim_time), which is not UTC: publish '
                             '~/time_reference')
        utc = stamp.time + offset
        if not FIRST_UTC <= utc // 1000 <= LAST_UTC:
            raise ValueError(f'its time, {utc / 1e9:.1f} s after 1970-01-01, cannot be UTC: set '
                             'the clock, or publish ~/time_reference')
        return utc

    def take_time_reference(self, utc: int, stamp: Stamp, now: float) -> None:
        """
        Take the UTC (ns since the UNIX epoch) of a stamp.

        From then on ROS time is no longer used as UTC.
        """
        def take() -> None:
            if not FIRST_UTC <= utc // 1000 <= LAST_UTC:
                raise ValueError(f'{utc / 1e9:.1f} s after 1970-01-01 cannot be UTC')
            _check_age(stamp, TIME_REFERENCE_LIFETIME)
            if self._reference is not None:
                _check_newer(stamp.time, self._reference.time)
            self._needs_reference = True
            self._reference = _Reference(stamp.time, utc - stamp.time)

        # It is used with later fixes, so its age counts from its stamp.
        self._take(Input.TIME_REFERENCE, now, take, age=max(0.0, stamp.age))

    def take_velocity(self, velocity: Vector, stamp: Stamp, now: float) -> None:
        """Take the velocity of the vehicle, ENU, m/s."""
        def take() -> None:
            _check_age(stamp, self._settings.position_timeout)
            if self._velocity_time is not None:
                _check_newer(stamp.time, self._velocity_time)
            if not all(map(math.isfinite, velocity)):
                raise ValueError('a component is not a finite number')
            self._velocity, self._velocity_time = velocity, stamp.time

        # The velocity is sent with later fixes, so its age is measured from its stamp.
        self._take(Input.VELOCITY, now, take, age=max(0.0, stamp.age))

    def take_satellites(self, count: int, now: float) -> None:
        """Take the number of satellites."""
        def take() -> None:
            self._satellites = count
            if self._settings.send_gps_status and now >= self._gps_status_due:
                self._gps_status_due = now + GPS_STATUS_INTERVAL
                self._send(conversions.gps_status(count))

        self._take(Input.SATELLITES, now, take)

    def ros_time(self, utc: int, present: Stamp) -> int:
        """
        Return the ROS time of a UTC in ns.

        :param present: a stamp of now, whose time is returned if that is not known.
        """
        try:
            ros = utc - (self._utc(present) - present.time)
        except ValueError:
            return present.time
        is_known = FIRST_UTC <= utc // 1000 <= LAST_UTC and 0 <= ros < END_OF_STAMPS
        return ros if is_known else present.time

    def clock_jumped(self) -> None:
        """Forget everything that depends on ROS time, which has jumped."""
        self._reference = self._fix_time = self._velocity_time = None
        self._pair_time = 0
        for history in (*self._attitudes.values(), self._mounts):
            history.samples.clear()

    # Attitude and mount

    def take_attitude(
        self, name: Input, orientation: Quaternion | None, rates: Vector, stamp: Stamp,
        now: float,
    ) -> None:
        """
        Take the orientation of the vehicle's FLU body in ENU.

        :param name: IMU or ATTITUDE; IMU takes precedence while it is received.
        :param orientation: of any norm; None if the message has none.
        :param rates: of the body, FLU, rad/s; NaN if unknown.
        """
        def take() -> None:
            if orientation is None:
                raise ValueError('it has no orientation: its covariance begins with -1')
            _check_age(stamp, self._settings.attitude_timeout)
            self._attitudes[name].add(_Sample(stamp.time, orientation.normalized(), rates))

        if self._take(name, now, take):
            self._send_pair(now)

    def take_mount(
        self, orientation: Quaternion, frame_id: str, stamp: Stamp, now: float,
    ) -> None:
        """
        Take the orientation of the camera; the mount is then not fixed.

        :param frame_id: the frame of the orientation, see :class:`~.conversions.MountParent`.
        """
        def take() -> None:
            parent = MountParent.of(frame_id)
            if parent is not self._mount_parent:
                self._mount_parent = parent
                self._mounts.samples.clear()
            _check_age(stamp, self._settings.attitude_timeout)
            self._mounts.add(_Sample(stamp.time, orientation.normalized(), UNKNOWN))

        self.expect_mount()
        if self._take(Input.MOUNT, now, take):
            self._send_pair(now)

    @property
    def mount_is_fixed(self) -> bool:
        """Return whether the mount is given by parameters, and not by ``~/mount``."""
        return self._fixed_mount is not None

    def expect_mount(self) -> None:
        """Stop sending the fixed mount, since ``~/mount`` has a publisher."""
        self._fixed_mount = None
        self._mount_due = math.inf

    def set_fixed_mount(self, angles: Vector, since: float) -> None:
        """
        Set roll, pitch and yaw of a fixed mount, degrees; no effect with ``~/mount``.

        :param since: when it may be sent first, s.
        """
        if self._fixed_mount is not None:
            self._fixed_mount, self._fixed_since = angles, since
            self._mount_due = since if self._link_open else math.inf

    def _send_pair(self, now: float) -> None:
        """Send the newest known attitude and mount of one instant, back to back."""
        name = Input.IMU if self._is_fresh(Input.IMU, now) else Input.ATTITUDE
        if now < self._pair_due or not self._is_fresh(name, now):
            return
        history = self._attitudes[name]
        if not history.samples:
            return
        time, angles = history.samples[-1].time, self._fixed_mount
        if angles is None:
            if not (self._is_fresh(Input.MOUNT, now) and self._mounts.samples):
                return
            time = min(time, self._mounts.samples[-1].time)
        elif now < self._fixed_since:
            return
        mount, sample = self._mounts.at(time), history.at(time)
        if sample is None or time <= self._pair_time:
            return
        if angles is None:
            if mount is None:
                return
            angles = conversions.mount_angles(
                conversions.in_vehicle(mount.rotation, self._mount_parent, sample.rotation),
                self._settings.mount_frame)
        self._pair_time = time
        interval = 1 / self._settings.attitude_rate
        self._pair_due = max(self._pair_due + interval, now + interval / 2)
        self._send(conversions.attitude(sample.rotation, sample.rates, time_boot_ms(now)))
        self._send_mount(angles, now)
        self._pairs += self._link_open

    def _send_mount(self, angles: Vector, now: float) -> None:
        self._send(conversions.mount_status(angles, self._target()))
        if self._fixed_mount is not None:
            self._mount_due = now + MOUNT_INTERVAL

    # Inputs

    def _is_fresh(self, name: Input, now: float) -> bool:
        return self._inputs[name].state(now) is InputState.OK

    def _take(
        self, name: Input, now: float, take: Callable[[], None], *, age: float = 0.0,
    ) -> bool:
        """Take a message; return whether it was accepted."""
        tracker = self._inputs[name]
        try:
            take()
        except ValueError as error:
            tracker.refuse(str(error), now)
            accepted = False
        else:
            tracker.accept(now - age)
            accepted = True
        self._report(tracker, now)
        return accepted

    def _report(self, tracker: _Tracker, now: float) -> None:
        if (change := tracker.change(now)) is not None:
            self._emit(change)

    def link_opened(self, now: float) -> None:
        """Let the next :meth:`poll` send the fixed mount."""
        self._link_open = True
        # The link repeats the call while it hears no peer.
        if self._fixed_mount is not None and self._mount_due == math.inf:
            self._mount_due = max(now, self._fixed_since)

    def link_closed(self) -> None:
        """Stop repeating the fixed mount until the link is open again."""
        self._link_open = False
        self._mount_due = math.inf

    def poll(self, now: float) -> None:
        """See :meth:`Payload.poll`."""
        for tracker in self._inputs.values():
            if now >= tracker.next_change():
                self._report(tracker, now)
        if now >= self._mount_due and self._fixed_mount is not None:
            self._send_mount(self._fixed_mount, now)

    def next_deadline(self) -> float:
        """See :meth:`Payload.next_deadline`."""
        return min(self._mount_due, *(one.next_change() for one in self._inputs.values()))


def _check_age(stamp: Stamp, timeout: float) -> None:
    """Refuse a message whose stamp is too old, or too far in the future."""
    if stamp.age > timeout:
        raise ValueError(f'its stamp is {format_seconds(stamp.age)} old by the ROS clock')
    if stamp.age < -timeout:
        raise ValueError(f'its stamp is {format_seconds(-stamp.age)} ahead of the ROS clock')


def _check_newer(time: int, last: int) -> None:
    """Refuse a repeated or overtaken message."""
    if time <= last:
        raise ValueError('its stamp is not newer than the last')
