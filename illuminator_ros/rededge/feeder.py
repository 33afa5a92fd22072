# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""
Position, UTC, attitude and mount for the camera: checked, and not repeated.

A refused or stale input is not sent. The camera then falls back to its own sensors, 5 s after
the last message. Only a fixed mount is repeated.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
import math
from typing import NamedTuple

from . import conversions
from .conversions import FIRST_UTC, LAST_UTC, Position
from .input_states import (
    CameraSettings,
    Input,
    InputSnapshot,
    InputState,
    InputStates,
    NANO,
    PAIR,
    PositionSource,
    Stamp,
    TIME_REFERENCE_LIFETIME,
    VELOCITIES,
)
from .messages import GpsRawInt
from .orientation_feeder import OrientationFeeder
from ..geometry.rotation import Quaternion, Vector
from ..mavlink.durations import format_seconds
from ..mavlink.messages import Address, Message, time_boot_ms
from ..mavlink.schedule import Schedule
from ..payload.messages import Attitude, GlobalPositionInt

# s
GPS_STATUS_INTERVAL = 1.0
ENU = Quaternion(1.0, 0.0, 0.0, 0.0)
# The first ROS time, ns, whose seconds do not fit into the int32 of a stamp.
END_OF_STAMPS = 2**31 * NANO


@dataclass(frozen=True)
class FeederSnapshot:
    """
    All inputs at one moment.

    :param needed: groups of inputs; one input of each group must be received.
    :param no_pair: why attitude and mount are not sent although both are received, '' if they are.
    """

    inputs: Mapping[Input, InputSnapshot]
    needed: Sequence[Sequence[Input]]
    no_pair: str = ''

    @property
    def lacking(self) -> list[Sequence[Input]]:
        """Return the groups in which no input can be used."""
        return [group for group in self.needed
                if all(self.inputs[name].state is not InputState.OK for name in group)]


class _Reference(NamedTuple):
    time: int
    # UTC less ROS time, ns.
    offset: int


class Feeder:
    """
    Makes messages for the camera from the inputs.

    It sends each position once, at once, with the newest velocity and number of satellites.

    :param send: sends a message.
    :param target: returns the address of the camera.
    :param schedule: of the link.
    :ivar orientation: takes attitudes and mounts.
    """

    def __init__(
        self, settings: CameraSettings, send: Callable[[Message], None],
        target: Callable[[], Address], schedule: Schedule,
    ) -> None:
        self._settings = settings
        self._send = send
        self._inputs = InputStates(settings)
        self.orientation = OrientationFeeder(settings, send, target, schedule, self._inputs)
        self._velocities: dict[Input, Vector] = {}
        self._satellites: int | None = None
        self._gps_status_due = -math.inf
        self._reference: _Reference | None = None
        self._needs_reference = False

    def snapshot(self, now: float) -> FeederSnapshot:
        """Return all inputs at this moment."""
        needed: list[tuple[Input, ...]] = [(Input.FIX,), (Input.IMU, Input.ATTITUDE)]
        if self._settings.position_source is PositionSource.FUSED:
            needed.append(VELOCITIES)
        if not self.orientation.mount_is_fixed:
            needed.append((Input.MOUNT,))
        if self._needs_reference:
            needed.append((Input.TIME_REFERENCE,))
        return FeederSnapshot(
            self._inputs.snapshot(now), needed, self.orientation.why_no_pair(now))

    def set_link(self, *, is_open: bool) -> None:
        """Note whether messages can be sent."""
        self._inputs.set_link(is_open=is_open)

    def sent(self, message: Message) -> None:
        """Note that a message is sent, since the line had room for it."""
        if isinstance(message, (GpsRawInt, GlobalPositionInt)):
            self._inputs.sent((Input.FIX,))
        elif isinstance(message, Attitude):
            self._inputs.sent(PAIR)

    # Position and time

    def receive_fix(self, position: Position, stamp: Stamp, now: float) -> None:
        """Send a position at once, or refuse it."""
        settings, is_fresh = self._settings, self._inputs.is_fresh
        velocity = next((self._velocities[one] for one in VELOCITIES if is_fresh(one, now)), None)
        satellites = self._satellites if is_fresh(Input.SATELLITES, now) else None
        with self._inputs.receiving(Input.FIX, now, stamp):
            conversions.fix_type(position.status)
            if conversions.is_no_place(position):
                raise ValueError('no fix: its position is 0, 0')
            utc = self._utc(stamp) // 1000
            self._inputs.check(Input.FIX, stamp)
            self._inputs.wait((Input.FIX,), now)
            if settings.position_source is PositionSource.RAW:
                self._send(conversions.gps_raw_int(
                    position, utc, velocity, satellites, settings.geoid_separation))
            elif velocity is None:
                raise ValueError('position_source fused needs a velocity, which is missing')
            else:
                boot_ms = time_boot_ms(now)
                placed = conversions.global_position_int(
                    position, velocity, settings.geoid_separation, boot_ms)
                self._send(conversions.system_time(utc, boot_ms))
                self._send(placed)

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
            raise ValueError(f'its time, {utc / 1e9:.1f} s after 1970-01-01, cannot be UTC: stamp '
                             'it by a clock that is set, or publish ~/time_reference')
        return utc

    def receive_time_reference(self, utc: int, stamp: Stamp, now: float) -> None:
        """
        Take the UTC (ns since the UNIX epoch) of a stamp.

        From then on ROS time is no longer used as UTC.
        """
        with self._inputs.receiving(Input.TIME_REFERENCE, now, stamp):
            if not FIRST_UTC <= utc // 1000 <= LAST_UTC:
                raise ValueError(f'{utc / 1e9:.1f} s after 1970-01-01 cannot be UTC')
            self._inputs.check(Input.TIME_REFERENCE, stamp)
            self._needs_reference = True
            self._reference = _Reference(stamp.time, utc - stamp.time)

    def receive_velocity(
        self, name: Input, velocity: Vector, stamp: Stamp, now: float, body: Quaternion = ENU,
    ) -> None:
        """
        Take the velocity of the vehicle.

        :param velocity: m/s, in the axes of ``body``.
        :param body: the orientation of these axes in ENU, of any norm.
        """
        with self._inputs.receiving(name, now, stamp):
            self._inputs.check(name, stamp)
            if not all(map(math.isfinite, velocity)):
                raise ValueError('a component is not a finite number')
            self._velocities[name] = body.normalized().rotate(velocity)

    def receive_satellites(self, count: int, now: float) -> None:
        """Take the number of satellites."""
        with self._inputs.receiving(Input.SATELLITES, now):
            self._satellites = count
            if self._settings.send_gps_status and now >= self._gps_status_due:
                self._gps_status_due = now + GPS_STATUS_INTERVAL
                self._send(conversions.gps_status(count))

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
        self._reference = None
        self._inputs.clock_jumped()
        self.orientation.clock_jumped()
