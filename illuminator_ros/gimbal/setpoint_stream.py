# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The setpoints of a client: attitudes, and rates that end with a zero."""

from __future__ import annotations

from collections.abc import Callable
import math

from .commands import Attitude, Flag, Move, Rates, setpoint_flags
from .events import GimbalKey
from .gimbal_reports import GimbalReports
from .messages import GimbalManagerSetAttitude
from .rate_stop import RateStop
from ..geometry.mount_attitude import (
    STILL,
    to_mavlink,
    UNSET_QUATERNION,
    UNSET_VECTOR,
    Wxyz,
    YawFrame,
)
from ..geometry.rotation import flu_frd, Vector
from ..mavlink.dialect import mavlink
from ..payload.messages import GeoPoint, GimbalDeviceAttitudeStatus
from ..payload.requests import Request, Result

# s after which an attitude or the yaw lock is sent again, since no message is acknowledged.
REPEATS = (0.2, 0.4, 0.8)
# s after an attitude in which the device may still report the yaw lock that it had before.
LOCK_DELAY = 1.0
# The fields of the requests to a gimbal; the value of the first is a :data:`Move`.
MOVE, YAW_LOCK = 'move', 'yaw lock'


class SetpointStream:
    """
    Sends the setpoint that is wanted of one gimbal, and stops the gimbal. No I/O; times are s.

    A :class:`~..payload.device_property.Property` cannot do this: GIMBAL_MANAGER_SET_ATTITUDE is
    not acknowledged, and the status of a device shows where it points, not what it was given,
    since it turns slowly, within its ranges, and with the offsets of other players.

    :param send: sends a message.
    :param told: called with False when the gimbal may go on turning at a rate that has ended, with
        True when it stands.
    :ivar sent: the number of messages.
    :ivar rate_stop: sends the message that ends a rate, a zero or an attitude.
    :ivar followed: the move that the gimbal follows as far as is known, None for none: the last
        setpoint, or the pose or the place of a command that was not refused.
    """

    def __init__(
        self, key: GimbalKey, reports: GimbalReports,
        send: Callable[[GimbalManagerSetAttitude], None], told: Callable[[bool], None],
    ) -> None:
        self.sent = 0
        self.rate_stop = RateStop(self._stop_told, lasts=True)
        self.followed: Move = None
        self._key = key
        self._reports = reports
        self._send_message = send
        self._told = told
        # Whether it was told that the gimbal may go on turning.
        self._has_told = False
        # The request that was begun last; its message, and when that is sent again.
        self._begun: Request | None = None
        self._send_again = self._send_zero
        self._repeats: list[float] = []
        self._reported_frame = YawFrame.VEHICLE
        # The yaw frame of the last message or pose, which sets the yaw lock, and its time.
        self._frame, self._frame_at = YawFrame.VEHICLE, -math.inf

    # Known facts

    @property
    def wanted(self) -> Move:
        """Return the move that is wanted, else the one that the gimbal follows; None for none."""
        return self.followed if self._begun is None else self._begun.values.get(MOVE)

    @property
    def has_place(self) -> bool:
        """Whether the gimbal may point at a place."""
        return any(isinstance(one, GeoPoint) for one in (self.wanted, self.followed))

    @property
    def may_have_rate(self) -> bool:
        """Whether the gimbal may turn at a rate, since the message that ends it may be lost."""
        return isinstance(self.followed, Rates) or self.rate_stop.may_turn

    @property
    def may_turn(self) -> bool:
        """Whether the gimbal may turn at a rate, or towards a place."""
        return self.has_place or self.may_have_rate

    @property
    def lack_of_stop(self) -> str:
        """Return that the gimbal may turn, for people; '' if it does not."""
        return ('' if not self.may_turn else 'the gimbal still turns' if self.rate_stop.turns else
                'no attitude shows that the gimbal stands')

    @property
    def unstopped_since(self) -> float | None:
        """Return since when a rate has ended and no attitude shows that the gimbal stands, s."""
        # A gimbal turns towards an attitude or a place, too.
        is_stop = self.followed is None and self.rate_stop.may_turn
        return self.rate_stop.begun if is_stop else None

    # The step

    def begin(self, wanted: Request | None, now: float, *, can_send: bool) -> None:
        """
        Send what is wanted by a message; stop a rate before a command, or if nothing is wanted.

        :param wanted: the newest request for a move or the yaw lock.
        """
        if wanted is self._begun:
            return
        self._begun, self._repeats = wanted, []
        (move,) = wanted.values.values() if wanted is not None else (None,)
        if isinstance(move, Attitude):
            # A rate that has ended may be late.
            ends_rate = isinstance(self.followed, Rates) or self.rate_stop.is_running
            self._send_again = lambda now: self._send_attitude(move, now)
            self._repeats = [now + delay for delay in REPEATS]
            self._send_again(now)
            if ends_rate:
                self.rate_stop.begin(self._send_again, now, was_sent=True)
        elif isinstance(move, Rates) and move != Rates():
            self.followed, self._has_told = move, False
            self.rate_stop.cancel()
            self._send(self._yaw_frame(now), UNSET_QUATERNION, flu_frd(move.rates))
        elif isinstance(move, Flag) and not move.is_pose:
            self._frame, self._frame_at = move.frame, now
            self._send_again = self._send_zero
            self._repeats = [now + delay for delay in REPEATS]
            self.stop(now, can_send=can_send)
        else:
            if move == Rates() or isinstance(self.followed, Rates) or (
                    isinstance(self.followed, Attitude) and self.rate_stop.may_turn):
                self.stop(now, can_send=can_send)
            if isinstance(move, Flag):
                self._frame, self._frame_at = move.frame, now

    def ended(self, move: Move, result: Result) -> None:
        """Take the result of a pose or a place; the move before counts on if it was refused."""
        if result.success:
            self.followed = move
            # ArduPilot leaves a rate as it is without a place, so the zero must arrive.
            if move is not None:
                self.rate_stop.cancel()
        elif isinstance(move, Flag) and result.refused:
            self._frame_at = -math.inf
        # Without an answer the gimbal may follow the place.
        elif (isinstance(move, GeoPoint) and not result.refused and not self.may_have_rate
                and not (self._begun and isinstance(self._begun.values.get(MOVE), Attitude))):
            self.followed = move

    # The stop

    def stop(self, now: float, *, can_send: bool) -> None:
        """Send a zero until an attitude shows that the gimbal stands, or once it can be sent."""
        self.followed = None
        self.rate_stop.begin(self._send_zero, now)
        if can_send:
            self.rate_stop.poll(now)

    def control_changed(self, now: float, *, is_ours: bool) -> None:
        """
        Follow nothing; send a zero once this component has control, if the device then turns.

        Where this component finds itself in control, a process before this one, with its address,
        had it: it was killed, or it would have released control.
        """
        if is_ours or self.may_have_rate:
            self.rate_stop.owe(self._send_zero, now)
        else:
            self.rate_stop.cancel()
        self.followed = None

    def _stop_told(self, stands: bool) -> None:
        """Pass on what is known of a rate that has ended."""
        if stands is self._has_told and self.followed is None:
            self._has_told = not stands
            self._told(stands)

    # Messages

    def _send_zero(self, now: float) -> None:
        # The yaw lock may have changed since the last one.
        self.followed = None
        self._send(self._yaw_frame(now), UNSET_QUATERNION, STILL)

    def _send_attitude(self, move: Attitude, now: float) -> None:
        self.followed = move
        self._frame, self._frame_at = move.frame, now
        self._send(move.frame, to_mavlink(move.rotation, move.frame), UNSET_VECTOR)

    def _send(self, frame: YawFrame, q: Wxyz, rates: Vector) -> None:
        flags = setpoint_flags(frame)
        if self._reports.missing(mavlink.GIMBAL_DEVICE_CAP_FLAGS_HAS_YAW_LOCK):
            flags &= ~mavlink.GIMBAL_DEVICE_FLAGS_YAW_LOCK
        self.sent += 1
        self._send_message(GimbalManagerSetAttitude(
            *self._reports.manager.address, flags, self._key.device_id, q, *rates))

    def _yaw_frame(self, now: float) -> YawFrame:
        """Return the yaw frame that rates keep, which implies the yaw lock."""
        return self._frame if self._frame_at > now - LOCK_DELAY else self._reported_frame

    def reported(self, status: GimbalDeviceAttitudeStatus, now: float) -> None:
        """Receive a status of the device."""
        is_locked = status.flags & mavlink.GIMBAL_DEVICE_FLAGS_YAW_LOCK
        self._reported_frame = YawFrame.EARTH if is_locked else YawFrame.VEHICLE
        self.rate_stop.reported(status, now)

    def poll(self, now: float, *, may_stop: bool) -> None:
        """
        Send what is due; this component must have control.

        :param may_stop: whether a zero may be sent again: no request is under way, which may turn
            the gimbal.
        """
        if self._repeats and now >= self._repeats[0]:
            del self._repeats[0]
            self._send_again(now)
        if may_stop:
            self.rate_stop.poll(now)

    def due(self, *, may_stop: bool) -> float:
        """Return when :meth:`poll` is due, infinity if never."""
        return min([*self._repeats[:1], *([self.rate_stop.due] if may_stop else ())],
                   default=math.inf)
