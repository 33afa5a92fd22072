# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The setpoints of a client: attitudes, and rates that end with a zero."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from enum import Enum
import math

from .messages import GimbalManagerSetAttitude
from .rate_stop import RateStop
from ..mavlink.dialect import mavlink
from ..payload.messages import GimbalDeviceAttitudeStatus
from ..payload.mount_attitude import (
    STILL,
    to_mavlink,
    UNSET_QUATERNION,
    UNSET_VECTOR,
    Wxyz,
    YawFrame,
)
from ..payload.requests import Result
from ..payload.rotation import flu_frd, Quaternion, Vector

# s after which a setpoint is sent again, since the message is not acknowledged.
REPEATS = (0.2, 0.4, 0.8)
# s after an attitude in which the device may still report the yaw lock that it had before.
LOCK_DELAY = 1.0


class SuspendedBy(Enum):
    """The requests that a gimbal follows instead of a setpoint."""

    POSE = 'pose'
    PLACE = 'place'


class Kind(Enum):
    """The kinds of setpoints."""

    ATTITUDE = 'attitude'
    RATE = 'rate'
    ZERO = 'rate of zero'
    PLACE = 'place, which a command sets'


@dataclass(eq=False)
class _Setpoint:
    """
    A setpoint that the gimbal may follow.

    :param message: None for a place, and for a zero that was not sent.
    :param due: when an attitude is sent again, or a rate ends with a zero, s.
    :param is_over: whether the gimbal follows a later request.
    """

    kind: Kind
    message: GimbalManagerSetAttitude | None = None
    attitude: tuple[Quaternion, YawFrame] | None = None
    due: list[float] = field(default_factory=list)
    is_over: bool = False


class SetpointStream:
    """
    Sends setpoints to one gimbal, and repeats the last one. No I/O; times are s.

    A :class:`~..payload.device_property.Property` cannot do this: GIMBAL_MANAGER_SET_ATTITUDE is
    not acknowledged, and the status of a device shows where it points, not what it was given,
    since it turns slowly, within its ranges, and with the offsets of other players.

    :param make: returns the message of a setpoint.
    :param send: sends a message.
    :param timeout: from the last rate until a rate of zero is sent.
    :param told: called with False when the gimbal may go on turning at a rate that has ended, with
        True when it stands.
    :ivar sent: the number of messages.
    :ivar rate_stop: sends the message that ends a rate, a zero or an attitude.
    """

    def __init__(
        self, make: Callable[[YawFrame, Wxyz, Vector], GimbalManagerSetAttitude],
        send: Callable[[GimbalManagerSetAttitude], None], timeout: float,
        told: Callable[[bool], None],
    ) -> None:
        self.sent = 0
        self.rate_stop = RateStop(self._stop_told, lasts=True)
        self._make = make
        self._send_message = send
        self._timeout = timeout
        self._told = told
        # Whether it was told that the gimbal may go on turning.
        self._has_told = False
        self._last: _Setpoint | None = None
        # The setpoint that the last request of each kind has suspended, and the place of the
        # request, None if it has none.
        self._suspended: dict[SuspendedBy, tuple[_Setpoint | None, _Setpoint | None]] = {}
        self._reported_frame = YawFrame.VEHICLE
        self._attitude_frame, self._attitude_at = YawFrame.VEHICLE, -math.inf

    def change_timeout(self, timeout: float, now: float) -> None:
        """Replace the time-out; a rate that lasts ends after it at the latest."""
        self._timeout = timeout
        if self._last is not None and self._last.kind is Kind.RATE:
            self._last.due = [min(due, now + timeout) for due in self._last.due]

    @property
    def _kind(self) -> Kind | None:
        return None if self._last is None else self._last.kind

    @property
    def may_have_rate(self) -> bool:
        """Whether the gimbal may turn at a rate, since the message that ends it may be lost."""
        return self._kind is Kind.RATE or self.rate_stop.may_turn

    @property
    def has_place(self) -> bool:
        """Whether the gimbal may point at a place."""
        return self._kind is Kind.PLACE

    @property
    def may_turn(self) -> bool:
        """Whether the gimbal may turn at a rate, or towards a place."""
        return self.has_place or self.may_have_rate

    @property
    def lack_of_stop(self) -> str:
        """Return that the gimbal may turn, for people."""
        return ('the gimbal still turns' if self.rate_stop.turns else
                'no attitude shows that the gimbal stands')

    @property
    def unstopped_since(self) -> float | None:
        """Return since when a rate has ended and no attitude shows that the gimbal stands, s."""
        # A gimbal turns towards an attitude or a place, too.
        is_stop = self._kind in (Kind.ZERO, None) and self.rate_stop.may_turn
        return self.rate_stop.begun if is_stop else None

    def attitude(self, frame: YawFrame) -> Quaternion | None:
        """Return the last attitude, None if its yaw has another frame or it counts no longer."""
        attitude = self._last and self._last.attitude
        return attitude[0] if attitude and attitude[1] is frame else None

    def set_attitude(self, rotation: Quaternion, frame: YawFrame, now: float) -> None:
        """Send an attitude, and again after :data:`REPEATS`; if it ends a rate, until it has."""
        self._attitude_frame, self._attitude_at = frame, now
        # A rate that has ended may be late.
        ends_rate = self._kind is Kind.RATE or self.rate_stop.is_running
        self._last = setpoint = _Setpoint(
            Kind.ATTITUDE, self._make(frame, to_mavlink(rotation, frame), UNSET_VECTOR),
            (rotation, frame), [now + delay for delay in REPEATS])
        self._send(setpoint)
        if ends_rate:
            self.rate_stop.begin(lambda now: self._send(setpoint), now, was_sent=True)
        else:
            self.rate_stop.cancel()

    def set_rates(self, rates: Vector, now: float) -> None:
        """Send rates, which leave the yaw lock as it is; a zero follows after the time-out."""
        if rates == STILL:
            self._send_zero(now)
            self.rate_stop.begin(self._send_zero, now, was_sent=True)
            return
        self._last = _Setpoint(
            Kind.RATE, self._make(self._yaw_frame(now), UNSET_QUATERNION, flu_frd(rates)),
            due=[now + self._timeout])
        self._has_told = False
        self.rate_stop.cancel()
        self._send(self._last)

    def _send_zero(self, now: float) -> None:
        # The yaw lock may have changed since the last one.
        self._last = _Setpoint(
            Kind.ZERO, self._make(self._yaw_frame(now), UNSET_QUATERNION, STILL))
        self._send(self._last)

    def _yaw_frame(self, now: float) -> YawFrame:
        """Return the yaw frame that rates keep, which implies the yaw lock."""
        return (self._attitude_frame if self._attitude_at > now - LOCK_DELAY
                else self._reported_frame)

    def suspend(self, now: float, kind: SuspendedBy, *, is_place: bool = False) -> None:
        """
        End a rate with a zero, and send no attitude again: a request follows.

        :meth:`request_ended` takes its result.

        :param is_place: whether the request points the gimbal at a place.
        """
        if self.may_have_rate and self._kind in (Kind.RATE, Kind.ATTITUDE):
            self.set_rates(STILL, now)
        before, place = self._last, None
        if before is not None and before.kind is Kind.ATTITUDE:
            before.due.clear()
        if is_place:
            self._last = place = _Setpoint(Kind.PLACE)
        elif kind is SuspendedBy.POSE:
            # The flags of a pose clear the lock.
            self._attitude_frame, self._attitude_at = YawFrame.VEHICLE, now
        elif before is not None and before.kind is Kind.ZERO:
            # ArduPilot leaves a rate as it is, so the zero must arrive.
            before = None
        self._suspended[kind] = before, place

    def request_ended(self, kind: SuspendedBy, result: Result, now: float) -> None:
        """
        Take the result of the last request: the setpoint counts again if it was refused.

        The zero before a place without an answer, which may be lost, too, is sent again.
        """
        before, place = self._suspended.get(kind, (None, None))
        if result.refused and kind is SuspendedBy.POSE:
            self._attitude_at = -math.inf
        if result.success:
            if kind is SuspendedBy.POSE or place is not None:
                self.rate_stop.cancel()
            if before is not None:
                before.is_over = True
        # Without an answer the gimbal may follow the place.
        elif (place is not None and self._last is place and not result.superseded
                and (result.refused or self.rate_stop.may_turn)):
            self._last = before
            # Another request may have suspended the place.
            self._suspended = {
                one: (before if suspended is place else suspended, its_place)
                for one, (suspended, its_place) in self._suspended.items()}
        if self._last is not None and self._last.is_over:
            self._last = None

    def hold(self, frame: YawFrame, now: float) -> None:
        """Send a zero whose yaw frame sets the yaw lock: the gimbal stays where it points."""
        self._attitude_frame, self._attitude_at = frame, now
        self.set_rates(STILL, now)

    def end(self, now: float) -> None:
        """Repeat no attitude, and end a rate or a place with a zero once it can be sent."""
        if self.may_turn and not (self._kind is Kind.ZERO and self.rate_stop.is_running):
            self._last = _Setpoint(Kind.ZERO)
            self.rate_stop.begin(self._send_zero, now)
        elif self._last is not None:
            self._last.due.clear()

    def control_changed(self, now: float, *, is_lost: bool) -> None:
        """
        Send nothing while another component has control; owe a zero to a gimbal that may turn.

        It is sent once this component has control, if the device then turns. Where this component
        finds itself in control, a process before this one, with its address, had it: it was
        killed, or it would have released control.
        """
        if not is_lost and self._last is not None:
            return
        owes = not is_lost or self.may_have_rate
        self._last = None
        if owes:
            self.rate_stop.owe(self._send_zero, now)
        else:
            self.rate_stop.cancel()

    def control_unknown(self, now: float, *, can_send: bool) -> None:
        """Repeat no attitude, and end a rate with a zero, now and when control is known again."""
        if self.may_have_rate:
            self._last = _Setpoint(Kind.ZERO)
            self.rate_stop.begin(self._send_zero, now)
            if can_send:
                self.rate_stop.poll(now)
        elif self._last is not None:
            self._last.due.clear()

    def _stop_told(self, stands: bool) -> None:
        """Pass on what is known of a rate that has ended."""
        if stands is self._has_told and self._kind in (Kind.ZERO, None):
            self._has_told = not stands
            self._told(stands)

    def reported(self, status: GimbalDeviceAttitudeStatus, now: float) -> None:
        """Take a status of the device."""
        is_locked = status.flags & mavlink.GIMBAL_DEVICE_FLAGS_YAW_LOCK
        self._reported_frame = YawFrame.EARTH if is_locked else YawFrame.VEHICLE
        self.rate_stop.reported(status, now)

    def poll(self, now: float, *, may_stop: bool) -> None:
        """
        Send what is due; this component must have control.

        :param may_stop: whether a zero may be sent again: no request is under way, which may turn
            the gimbal.
        """
        last = self._last
        if last is not None and last.due and now >= last.due[0]:
            if last.kind is Kind.RATE:
                self.set_rates(STILL, now)
            else:
                del last.due[0]
                self._send(last)
        if may_stop:
            self.rate_stop.poll(now)

    def due(self, *, may_stop: bool) -> float:
        """Return when :meth:`poll` is due, infinity if never."""
        return min([*(self._last.due[:1] if self._last is not None else ()),
                    *([self.rate_stop.due] if may_stop else ())], default=math.inf)

    def _send(self, setpoint: _Setpoint) -> None:
        assert setpoint.message is not None
        self.sent += 1
        self._send_message(setpoint.message)
