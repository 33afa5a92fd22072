# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The setpoints of a client: attitudes, and rates that end with a zero."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from enum import Enum
import math

from .messages import GimbalManagerSetAttitude
from .rate_stop import ATTITUDE_SPACING, TurningDetector
from ..mavlink.dialect import mavlink
from ..payload.confirmed_command import Result
from ..payload.messages import GimbalDeviceAttitudeStatus
from ..payload.mount_attitude import (
    STILL,
    to_mavlink,
    UNSET_QUATERNION,
    UNSET_VECTOR,
    Wxyz,
    YawFrame,
)
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
    """The kinds of setpoints: an ATTITUDE is repeated, and a ZERO if the device still turns."""

    ATTITUDE = 'attitude'
    RATE = 'rate'
    ZERO = 'rate of zero'
    PLACE = 'place, which a command sets'


@dataclass(eq=False)
class _Setpoint:
    """
    A setpoint that the gimbal may follow.

    :param message: None for a place, and for a zero that was not sent.
    :param due: when it is sent again, s; of a rate or a place, when it ends with a zero.
    :param ends_rate: whether it ends a rate, unless it is lost: an attitude, or a place until the
        manager has accepted it.
    :param is_over: whether the gimbal follows a later request.
    :param stands: whether the last attitude after a zero shows that the gimbal stands.
    """

    kind: Kind
    message: GimbalManagerSetAttitude | None = None
    attitude: tuple[Quaternion, YawFrame] | None = None
    due: list[float] = field(default_factory=list)
    ends_rate: bool = False
    is_over: bool = False
    stands: bool = False

    @property
    def moves(self) -> bool:
        """Whether the gimbal turns until it gets another setpoint."""
        return self.kind in (Kind.RATE, Kind.PLACE)

    @property
    def may_have_rate(self) -> bool:
        """Whether the gimbal may turn at a rate, since the message that ends it may be lost."""
        if self.kind is Kind.ZERO and not self.stands:
            return True
        return bool(self.due) and (self.kind is not Kind.ATTITUDE or self.ends_rate)

    @property
    def awaits_status(self) -> bool:
        """
        Whether it is sent again when the next status of the device comes.

        A status shows that the line is not cut, so an attitude that ends a rate awaits one, too.
        """
        return self.kind is Kind.ZERO or (
            self.kind is Kind.ATTITUDE and self.ends_rate and len(self.due) == 1)


class SetpointStream:
    """
    Sends setpoints to one gimbal, and repeats the last one. No I/O; times are s.

    A :class:`~..payload.device_property.Property` cannot do this: GIMBAL_MANAGER_SET_ATTITUDE is
    not acknowledged, and the status of a device shows where it points, not what it was given,
    since it turns slowly, within its ranges, and with the offsets of other players.

    :param make: returns the message of a setpoint.
    :param send: sends a message.
    :param timeout: from the last rate until a rate of zero is sent.
    :ivar sent: the number of messages.
    """

    def __init__(
        self, make: Callable[[YawFrame, Wxyz, Vector], GimbalManagerSetAttitude],
        send: Callable[[GimbalManagerSetAttitude], None], timeout: float,
    ) -> None:
        self.sent = 0
        self._make = make
        self._send_message = send
        self._timeout = timeout
        self._last: _Setpoint | None = None
        # The setpoint that the last request of each kind has suspended, and its place.
        self._suspended: dict[SuspendedBy, tuple[_Setpoint | None, _Setpoint]] = {}
        self._reported_frame = YawFrame.VEHICLE
        self._attitude_frame, self._attitude_at = YawFrame.VEHICLE, -math.inf
        self._detector = TurningDetector()

    def change_timeout(self, timeout: float, now: float) -> None:
        """Replace the time-out; a rate that lasts ends after it at the latest."""
        self._timeout = timeout
        if self._last is not None and self._last.kind is Kind.RATE:
            self._last.due = [min(due, now + timeout) for due in self._last.due]

    @property
    def may_turn(self) -> bool:
        """Whether the gimbal may turn at a rate, or towards a place."""
        return self._last is not None and (self._last.moves or self._last.may_have_rate)

    def attitude(self, frame: YawFrame) -> Quaternion | None:
        """Return the last attitude, None if its yaw has another frame or it counts no longer."""
        attitude = self._last and self._last.attitude
        return attitude[0] if attitude and attitude[1] is frame else None

    def set_attitude(self, rotation: Quaternion, frame: YawFrame, now: float) -> None:
        """Send an attitude, and send it again after :data:`REPEATS`."""
        self._attitude_frame, self._attitude_at = frame, now
        self._set(_Setpoint(
            Kind.ATTITUDE, self._make(frame, to_mavlink(rotation, frame), UNSET_VECTOR),
            (rotation, frame), [now + delay for delay in REPEATS],
            ends_rate=self._last is not None and self._last.may_have_rate))

    def set_rates(self, rates: Vector, now: float) -> None:
        """Send rates, which leave the yaw lock as it is; a zero follows after the time-out."""
        message = self._make(self._yaw_frame(now), UNSET_QUATERNION, flu_frd(rates))
        if rates == STILL:
            self._set(_Setpoint(Kind.ZERO, message, due=[now + delay for delay in REPEATS]))
        else:
            self._set(_Setpoint(Kind.RATE, message, due=[now + self._timeout]))

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
        before, place = self._last, _Setpoint(Kind.PLACE)
        if before is not None and before.may_have_rate and before.kind is not Kind.ZERO:
            self.set_rates(STILL, now)
            before = self._last
        elif before is not None and before.kind is Kind.ATTITUDE:
            before.due.clear()
        if is_place:
            place.ends_rate = before is not None and (before.may_have_rate or (
                before.kind is Kind.PLACE and before.ends_rate))
            self._last = place
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

        A zero follows a place without an answer that came after a rate, since the zero before it
        may be lost, too.
        """
        before, place = self._suspended.get(kind, (None, None))
        if result.refused and kind is SuspendedBy.POSE:
            self._attitude_at = -math.inf
        if result.success and before is not None:
            before.is_over = True
        last = self._last
        # Without an answer the gimbal may follow the place.
        if last is not None and last is place and not result.superseded:
            if result.success:
                last.ends_rate = False
            elif result.refused:
                last = self._last = before
                # Another request may have suspended the place.
                self._suspended = {
                    one: (before if suspended is place else suspended, its_place)
                    for one, (suspended, its_place) in self._suspended.items()}
            if last is not None and last.kind is Kind.PLACE and last.ends_rate:
                last.due = [now]
        if self._last is not None and self._last.is_over:
            self._last = None

    def hold(self, frame: YawFrame, now: float) -> None:
        """Send a zero whose yaw frame sets the yaw lock: the gimbal stays where it points."""
        self._attitude_frame, self._attitude_at = frame, now
        self.set_rates(STILL, now)

    def stop(self, now: float) -> None:
        """Send a zero, whose first check is sooner, since control will be released."""
        self.set_rates(STILL, now)
        assert self._last is not None
        self._last.due.insert(0, now + ATTITUDE_SPACING)

    def forget_zero(self) -> bool:
        """Forget the last zero if an attitude has shown since that the gimbal stands."""
        has_arrived = self._last is not None and self._last.stands
        if has_arrived:
            self._last = None
        return has_arrived

    def end(self, now: float) -> None:
        """Repeat no attitude, and end a rate or a place with a zero once it can be sent."""
        last = self._last
        if last is not None and last.kind is not Kind.ZERO:
            if last.may_have_rate:
                last.kind = Kind.RATE
            last.due = [now] if last.moves else []

    def control_changed(self, *, is_lost: bool) -> None:
        """
        Send nothing while another component has control; owe a zero to a gimbal that may turn.

        It is sent once this component has control, if the device then turns. Where this component
        finds itself in control, a process before this one, with its address, had it: it was
        killed, or it would have released control.
        """
        if not is_lost and self._last is not None:
            return
        owes = not is_lost or self._last is not None and (
            self._last.may_have_rate or self._last.ends_rate)
        self._last = _Setpoint(Kind.ZERO, due=[-math.inf] * len(REPEATS)) if owes else None

    def control_unknown(self, now: float, *, can_send: bool, is_heard: bool) -> None:
        """
        Repeat no attitude, and end a rate with a zero, now or when control is known again.

        A manager that is not heard gets both: it may hear the first one.
        """
        last = self._last
        if last is not None and last.may_have_rate:
            last.kind, last.due = Kind.RATE, [now]
            if can_send:
                self.set_rates(STILL, now)
                if not is_heard:
                    self._last = last
        elif last is not None:
            last.due.clear()

    def reported(
        self, status: GimbalDeviceAttitudeStatus, now: float, *, may_send: bool,
    ) -> None:
        """
        Take a status of the device, and send a zero again if the device still turns.

        :param may_send: whether this component has control, and no request is under way, which may
            turn the gimbal.
        """
        is_locked = status.flags & mavlink.GIMBAL_DEVICE_FLAGS_YAW_LOCK
        self._reported_frame = YawFrame.EARTH if is_locked else YawFrame.VEHICLE
        last = self._last
        if not may_send or last is None or not last.due or not last.awaits_status:
            return
        turns = self._detector.turns(status, now)
        if now < last.due[0]:
            return
        if last.kind is Kind.ATTITUDE:
            last.due.clear()
            self._send(last)
            return
        if turns is not None:
            last.stands = not turns
            del last.due[0]
            self._detector.reset()
        if turns:
            # The yaw lock may have changed since.
            last.message = self._make(self._yaw_frame(now), UNSET_QUATERNION, STILL)
            self._send(last)

    def poll(self, now: float) -> None:
        """Send what is due; this component must have control."""
        last = self._last
        if last is not None and now >= self.next_deadline():
            if last.moves:
                self.set_rates(STILL, now)
            else:
                del last.due[0]
                self._send(last)

    def next_deadline(self) -> float:
        """Return when :meth:`poll` is due, infinity if never."""
        last = self._last
        return last.due[0] if last and last.due and not last.awaits_status else math.inf

    def _set(self, setpoint: _Setpoint) -> None:
        self._last = setpoint
        self._detector.reset()
        self._send(setpoint)

    def _send(self, setpoint: _Setpoint) -> None:
        assert setpoint.message is not None
        self.sent += 1
        self._send_message(setpoint.message)
