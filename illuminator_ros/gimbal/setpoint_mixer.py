# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The setpoint of a gimbal: the requests of the players, mixed, clipped and sent to the device."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
import math
from typing import TypeAlias

from .axes import LEVEL
from .managed_device import ManagedDevice
from .manager_setpoint import clip, Clipped, direction, Refused, Setpoint, turned, turned_by
from .manager_state import ManagerState, StateTracker
from .messages import GimbalDeviceSetAttitude
from .rate_stop import RateStop
from .vehicle_state import VehicleState
from ..geometry.mount_attitude import AXES, STILL, UNSET_QUATERNION, YawFrame
from ..geometry.rotation import Vector
from ..mavlink.command_sender import CommandSender
from ..mavlink.dialect import mavlink, short_names
from ..payload.messages import GeoPoint

# s between repetitions of a constant setpoint, at most 1 s by the specification; and between
# setpoints that follow a place, the vehicle or a rate.
HOLD_INTERVAL = 0.9
FOLLOW_INTERVAL = 0.05
# s for which one step turns a setpoint at most, the shortest setpoint_timeout: the gimbal must not
# leap after a pause of the process.
STEP_LIMIT = 0.1
HEADING_UNKNOWN = 'the heading of the vehicle is unknown'


@dataclass(frozen=True)
class AnglesClipped:
    """Angles beyond the ranges of the device are clipped; once for an axis and a setpoint."""

    clipped: tuple[Clipped, ...]


@dataclass(frozen=True)
class SetpointSent:
    """A device without MAVLink must take a setpoint, which is mixed and clipped."""

    setpoint: Setpoint


@dataclass(frozen=True)
class ReferenceLost:
    """
    The gimbal no longer follows its region of interest, or a yaw relative to north.

    :param unknown: the unknown value of the vehicle: ``position`` or ``heading``.
    """

    unknown: str


@dataclass(frozen=True)
class RateStopped:
    """
    A rate has ended, since the manager gives no more setpoints.

    :param stands: whether an attitude has shown in time that the device stands.
    """

    stands: bool


SetpointEvent: TypeAlias = AnglesClipped | SetpointSent | ReferenceLost | RateStopped


class SetpointMixer:
    """
    Gives the device of an active manager its setpoints. No I/O; times are s.

    :param emit: takes the events.
    :ivar current: the setpoint without the offsets of secondary control, None before the first.
    :ivar sent: as the device got it.
    :ivar clipped: its angles that were clipped.
    :ivar due: when :meth:`poll` is due.
    :ivar rate_stop: ends a rate when no more setpoints are given.
    """

    def __init__(
        self, device: ManagedDevice, vehicle: VehicleState, tracker: StateTracker,
        commands: CommandSender, emit: Callable[[SetpointEvent], None],
    ) -> None:
        self.current: Setpoint | None = None
        self.sent: Setpoint | None = None
        self.clipped: tuple[Clipped, ...] = ()
        self.due = math.inf
        self._device = device
        self._vehicle = vehicle
        self._tracker = tracker
        self._commands = commands
        self._emit = emit
        self._offsets = STILL
        self._roi: GeoPoint | None = None
        # By axis, the request whose clipped angle was reported.
        self._reported: dict[str, object] = {}
        self._lost: set[str] = set()
        self.rate_stop = RateStop(self._rate_stopped)

    @property
    def has_place(self) -> bool:
        """Whether it follows a place."""
        return self._roi is not None

    # The state of the manager

    def activate(self, now: float) -> None:
        """Send setpoints from now on; end a motion that an earlier manager has left."""
        self.due = now
        if self.current is None:
            self.current = self._device.end_of_motion(now)

    def deactivate(self, now: float, *, forget: bool) -> None:
        """
        Send no setpoints, but end a rate: the device continues until a manager stops it.

        :param forget: whether another manager may move the device, or the next device may be
            another one.
        """
        self.due = math.inf
        if forget:
            self.current = (self.current.stopped() if self.current and self.current.has_rates_only
                            else None)
            self._roi, self._offsets = None, STILL
            self.clipped, self._reported = (), {}
        self._end_rate(now)

    def _end_rate(self, now: float, *, was_sent: bool = False) -> None:
        """Send the current setpoint, if it is a rate of zero, until the device stands."""
        zero = self.current
        if zero is not None and zero.has_rates_only:
            zero = (zero if zero.frame is YawFrame.VEHICLE or self._device.accepts_earth_frame(now)
                    else zero.in_vehicle_frame(0.0))
            self.rate_stop.begin(lambda now: self._give(zero), now, was_sent=was_sent)
            self.rate_stop.poll(now)

    def _rate_stopped(self, stands: bool) -> None:
        if stands:
            self.current = None
        self._emit(RateStopped(stands))

    # Players

    def set(self, request: Setpoint, now: float) -> None:  # noqa: A003
        """Follow a request of the player in primary control; :raises Refused: if it cannot."""
        if lacking := self._device.lacks(request.flags):
            names = (name for flag, name in short_names('GIMBAL_DEVICE_FLAGS').items()
                     if flag & lacking)
            raise Refused(f'the gimbal does not have {", ".join(names)}')
        self.current = request.resolved(
            self._start(request, now), now, turns=not self._tracker.has_mavlink)
        self._roi = None
        self._send(now)

    def add(self, request: Setpoint, limit: float, now: float) -> None:
        """
        Add the angles of the player in secondary control.

        :param limit: of each angle, rad.
        :raises Refused: if it requests something else.
        """
        if request.is_pose or not request.has_angles:
            raise Refused('secondary control adds angles only')
        self._offsets = request.offsets(limit)
        self._send(now)

    def end_offsets(self, now: float, *, keep: bool) -> None:
        """
        End the offsets.

        :param keep: whether they become part of the setpoint: the gimbal stays where it points.
        """
        offsets, self._offsets = self._offsets, STILL
        if keep:
            self._turn(now, offsets)

    def stop(self, now: float) -> None:
        """End rates and the region of interest: the gimbal stays where it points."""
        self._roi = None
        self._turn(now)
        self.current = self.current and self.current.stopped()
        self._send(now)

    def close(self, now: float) -> None:
        """Stop, and send nothing more once the device stands."""
        self.stop(now)
        if self._tracker.state is ManagerState.ACTIVE:
            self._end_rate(now, was_sent=True)
        self.current, self.due = None, math.inf

    def point(self, roi: tuple[GeoPoint, bool] | None, now: float) -> None:
        """
        Follow a place, None for none any more.

        :param roi: the place, and whether its altitude is relative to the home position.
        :raises Refused: if position or heading of the vehicle are unknown.
        """
        self._roi = None if roi is None else self._known_place(*roi, now)
        self.poll(now)

    def _known_place(self, place: GeoPoint, is_relative: bool, now: float) -> GeoPoint:
        above = self._vehicle.home_altitude if is_relative else 0.0
        if above is None or self._vehicle.position.get(now) is None or (
                self._device.heading(now) is None
                and not self._device.accepts_earth_frame(now)):
            raise Refused('the position or the heading of the vehicle is unknown',
                          mavlink.MAV_RESULT_TEMPORARILY_REJECTED)
        return place._replace(altitude=place.altitude + above)

    def poll(self, now: float) -> None:
        """Send the setpoint, which follows the region of interest if there is one."""
        if self._roi is not None:
            position = self._vehicle.position.get(now)
            self._note_lost('position', is_lost=position is None)
            if position and (angles := direction(position, self._roi)) is not None:
                lock = mavlink.GIMBAL_DEVICE_FLAGS_YAW_LOCK
                self.current = Setpoint(
                    LEVEL | (lock & ~self._device.lacks(lock)), YawFrame.EARTH,
                    (0.0, *angles), since=now)
        self._send(now)

    # The path to the device

    def _start(self, request: Setpoint, now: float) -> Vector:
        """Return the angles that a request changes; :raises Refused: if they are unknown."""
        if request.is_pose or (request.has_rates_only and self._tracker.has_mavlink):
            # Such a setpoint does not depend on the attitude.
            return STILL
        if (request.frame is YawFrame.EARTH and not self._device.accepts_earth_frame(now)
                and self._device.heading(now) is None):
            raise Refused(HEADING_UNKNOWN)
        return request.angles if request.has_all_angles else self._pointing(request.frame, now)

    def _pointing(self, frame: YawFrame, now: float) -> Vector:
        """Return the angles of the setpoint, or else of the device, with a yaw in a frame."""
        # A device that has neither reported an attitude nor got a setpoint starts at 0.
        angles, known = STILL, YawFrame.VEHICLE
        self._turn(now)
        if self.current is not None and self.current.has_all_angles:
            angles, known = self.current.angles, self.current.frame
        elif reported := self._device.pointing(now):
            angles, known = reported
        elif self.sent is not None or self._device.newest is not None:
            raise Refused('the attitude of the gimbal is unknown')
        if known is frame:
            return angles
        heading = self._device.heading(now)
        if heading is None:
            raise Refused(HEADING_UNKNOWN)
        return turned_by(angles, heading if frame is YawFrame.EARTH else -heading)

    def _ahead(self, setpoint: Setpoint, now: float) -> float | None:
        """Return the direction from which the range of the yaw counts, None if unknown."""
        # A pose and rates have no attitude that is converted.
        is_relative = setpoint.frame is YawFrame.VEHICLE or not setpoint.has_angles
        return 0.0 if is_relative else self._device.heading(now)

    def _turn(self, now: float, offsets: Vector = STILL) -> None:
        """Turn the setpoint by the rates that the device does not follow, and by offsets."""
        before = self.current
        if before is not None and not offsets == STILL == before.turning:
            self.current = turned(
                before._replace(since=max(before.since, now - STEP_LIMIT)), now,
                self._device.ranges, self._ahead(before, now), offsets, self.clipped)

    def _send(self, now: float) -> None:
        """Give the device the setpoint, with everything mixed and clipped."""
        self._turn(now)
        setpoint = self.current
        if setpoint is None or self._tracker.state is not ManagerState.ACTIVE:
            self.due = math.inf
            return
        converts = (setpoint.frame is YawFrame.EARTH
                    and not self._device.accepts_earth_frame(now))
        ahead = self._ahead(setpoint, now)
        self.due = now + (
            FOLLOW_INTERVAL if setpoint.turning != STILL or converts or self._roi is not None
            else HOLD_INTERVAL)
        angles, self.clipped = clip(
            setpoint, self._device.ranges, ahead, self._offsets, self.clipped)
        if self.clipped or self._reported:
            self._report_clipped(setpoint)
        sent = setpoint if angles is setpoint.angles else setpoint._replace(angles=angles)
        self._note_lost('heading', is_lost=converts and ahead is None)
        if converts:
            if ahead is None:
                return
            sent = sent.in_vehicle_frame(ahead)
        self._give(sent)

    def _give(self, sent: Setpoint) -> None:
        """Give the device a setpoint."""
        self.sent = sent
        if not self._tracker.has_mavlink:
            self._emit(SetpointSent(sent))
        elif self._tracker.device is not None:
            self._commands.send(GimbalDeviceSetAttitude(
                *self._tracker.device, sent.device_flags, sent.attitude or UNSET_QUATERNION,
                *sent.rates))

    def _report_clipped(self, setpoint: Setpoint) -> None:
        """Report a clipped angle once, although it changes while the vehicle turns or moves."""
        requests: dict[str, object] = {
            axis: (setpoint.frame, self._roi or (
                math.copysign(1.0, rate) if rate else round(angle + offset, 6)))
            for axis, angle, offset, rate in zip(
                AXES, setpoint.angles, self._offsets, setpoint.turning, strict=True)}
        self._reported = {axis: request for axis, request in self._reported.items()
                          if request == requests[axis]}
        if new := tuple(one for one in self.clipped if one.axis not in self._reported):
            self._reported |= {one.axis: requests[one.axis] for one in new}
            self._emit(AnglesClipped(new))

    def _note_lost(self, name: str, *, is_lost: bool) -> None:
        """Report once that a value of the vehicle, which the setpoint needs, is unknown."""
        if is_lost and name not in self._lost:
            self._emit(ReferenceLost(name))
        self._lost = self._lost | {name} if is_lost else self._lost - {name}
