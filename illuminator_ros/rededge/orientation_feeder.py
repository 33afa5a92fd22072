# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Attitude of the vehicle and mount of the camera, as pairs of one instant."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
import math
from typing import NamedTuple

from . import conversions
from .conversions import MountParent
from .input_states import CameraSettings, Input, InputStates, PAIR, Stamp, UNKNOWN
from ..geometry.rotation import Quaternion, Vector
from ..mavlink.messages import Address, Message, time_boot_ms
from ..mavlink.schedule import Schedule

# s between messages about a fixed mount while there is no attitude; the camera uses it for 5 s.
MOUNT_INTERVAL = 1.0
# Attitudes, and mounts, that are kept to find a pair of one instant.
MAX_SAMPLES = 256


class _Sample(NamedTuple):
    time: int
    rotation: Quaternion
    rates: Vector


def _interpolated(samples: deque[_Sample], time: int, longest: float) -> _Sample | None:
    """
    Return the rotation at a time; None if it is not known.

    :param samples: of one input, in the order of their stamps.
    :param longest: the longest time between two samples, s.
    """
    newer: _Sample | None = None
    for sample in reversed(samples):
        if sample.time <= time:
            if newer is None or sample.time == time:
                return sample if sample.time == time else None
            if newer.time - sample.time > longest * 1e9:
                return None
            share = (time - sample.time) / (newer.time - sample.time)
            return _Sample(time, conversions.interpolate(
                sample.rotation, newer.rotation, share), newer.rates)
        newer = sample
    return None


class OrientationFeeder:
    """
    Sends pairs of attitude and mount, and repeats a fixed mount.

    :param send: sends a message.
    :param target: returns the address of the camera.
    :param schedule: of the link.
    :ivar fixed_mount: roll, pitch and yaw of a fixed mount, degrees; None if ~/mount has a
        publisher.
    """

    def __init__(
        self, settings: CameraSettings, send: Callable[[Message], None],
        target: Callable[[], Address], schedule: Schedule, inputs: InputStates,
    ) -> None:
        self._settings = settings
        self._send = send
        self._target = target
        self._schedule = schedule
        self._inputs = inputs
        self._samples: dict[Input, deque[_Sample]] = {
            name: deque(maxlen=MAX_SAMPLES)
            for name in (Input.IMU, Input.ATTITUDE, Input.MOUNT)}
        self._mount_parent = MountParent.VEHICLE
        self.fixed_mount: Vector | None = (0.0, 0.0, 0.0)
        self._fixed_since = -math.inf
        # When mount angles were sent last, s.
        self._mount_sent_at = -math.inf
        # The least time between two pairs, s.
        self._interval = 1 / settings.attitude_rate
        self._pair_due = -math.inf
        self._pair_time = 0
        # When attitude and mount were sent last, s.
        self._pair_sent_at = -math.inf
        self._set_due()

    def receive_attitude(
        self, name: Input, orientation: Quaternion | None, rates: Vector, stamp: Stamp,
        now: float,
    ) -> None:
        """
        Take the orientation of the vehicle's FLU body in ENU.

        :param name: IMU or ATTITUDE; IMU takes precedence while it is received.
        :param orientation: of any norm; None if the message has none.
        :param rates: of the body, FLU, rad/s; NaN if unknown.
        """
        with self._inputs.receiving(name, now, stamp):
            if orientation is None:
                raise ValueError('it has no orientation: its covariance begins with -1')
            self._add(name, orientation, rates, stamp)
        self._send_pair(now)

    def receive_mount(
        self, orientation: Quaternion, frame_id: str, stamp: Stamp, now: float,
    ) -> None:
        """
        Take the orientation of the camera; the mount is then not fixed.

        :param frame_id: the frame of the orientation, see :class:`~.conversions.MountParent`.
        """
        self.expect_mount()
        with self._inputs.receiving(Input.MOUNT, now, stamp):
            parent = MountParent.of(frame_id)
            if parent is not self._mount_parent:
                self._mount_parent = parent
                self._samples[Input.MOUNT].clear()
            self._add(Input.MOUNT, orientation, UNKNOWN, stamp)
        self._send_pair(now)

    def _add(self, name: Input, rotation: Quaternion, rates: Vector, stamp: Stamp) -> None:
        """Add a rotation of any norm, or raise ValueError."""
        self._inputs.check(name, stamp)
        self._samples[name].append(_Sample(stamp.time, rotation.normalized(), rates))

    @property
    def mount_is_fixed(self) -> bool:
        """Return whether the mount is given by parameters, and not by ``~/mount``."""
        return self.fixed_mount is not None

    def expect_mount(self) -> None:
        """Stop sending the fixed mount, since ``~/mount`` has a publisher."""
        self.fixed_mount = None

    def set_fixed_mount(self, angles: Vector, since: float) -> None:
        """
        Set roll, pitch and yaw of a fixed mount, degrees; no effect with ``~/mount``.

        :param since: when it may be sent first, s.
        """
        if self.fixed_mount is not None:
            self.fixed_mount, self._fixed_since = angles, since
            self._mount_sent_at = -math.inf
            self._set_due()

    def _send_pair(self, now: float) -> None:
        """Send the newest known attitude and mount of one instant, back to back."""
        is_fresh, mounts = self._inputs.is_fresh, self._samples[Input.MOUNT]
        name = Input.IMU if is_fresh(Input.IMU, now) else Input.ATTITUDE
        attitudes = self._samples[name]
        if now < self._pair_due or not (is_fresh(name, now) and attitudes):
            return
        time, angles = attitudes[-1].time, self.fixed_mount
        if angles is None:
            if not (is_fresh(Input.MOUNT, now) and mounts):
                return
            time = min(time, mounts[-1].time)
        elif now < self._fixed_since:
            return
        longest = self._settings.attitude_timeout
        mount, sample = (_interpolated(one, time, longest) for one in (mounts, attitudes))
        if sample is None or time <= self._pair_time:
            return
        if angles is None:
            if mount is None:
                return
            angles = conversions.mount_angles(
                conversions.in_vehicle(mount.rotation, self._mount_parent, sample.rotation),
                self._settings.mount_frame)
        self._pair_time, self._pair_sent_at = time, now
        interval = self._interval
        self._pair_due = max(self._pair_due + interval, now + interval / 2)
        self._inputs.wait(PAIR, now)
        self._send(conversions.attitude(sample.rotation, sample.rates, time_boot_ms(now)))
        self._send_mount(angles, now)

    def why_no_pair(self, now: float) -> str:
        """Return why attitude and mount are not sent although both are received, '' else."""
        is_fresh, is_fixed = self._inputs.is_fresh, self.mount_is_fixed
        if not ((is_fresh(Input.IMU, now) or is_fresh(Input.ATTITUDE, now))
                and (is_fixed or is_fresh(Input.MOUNT, now))):
            return ''
        if now < self._pair_sent_at + max(self._settings.attitude_timeout, 2 * self._interval):
            return ''
        return ('a publisher of ~/mount is still awaited' if is_fixed and now < self._fixed_since
                else 'none are of one instant')

    def change_rate(self, attitude_rate: float, now: float) -> None:
        """Replace the highest rate of attitudes, Hz."""
        self._interval = 1 / attitude_rate
        self._pair_due = min(self._pair_due, now + self._interval)

    def _send_mount(self, angles: Vector, now: float) -> None:
        self._send(conversions.mount_status(angles, self._target()))
        self._mount_sent_at = now
        self._set_due()

    def clock_jumped(self) -> None:
        """Forget everything that depends on ROS time."""
        self._pair_time = 0
        for samples in self._samples.values():
            samples.clear()

    def _repeat_mount(self, now: float) -> None:
        if self.fixed_mount is not None:
            self._send_mount(self.fixed_mount, now)

    def _set_due(self) -> None:
        self._schedule.at(self._repeat_mount, math.inf if self.fixed_mount is None else max(
            self._fixed_since, self._mount_sent_at + MOUNT_INTERVAL))
