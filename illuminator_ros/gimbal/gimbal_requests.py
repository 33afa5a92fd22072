# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The requests to the manager of a gimbal: for control, a pose, a place, the yaw lock."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
import math
from typing import Any

from .commands import configure, Flag, point
from .events import GimbalKey
from .messages import GimbalManagerStatus
from .setpoint_stream import REPEATS, SuspendedBy
from ..mavlink.command_sender import CommandSender, format_seconds
from ..mavlink.dialect import flag_names
from ..mavlink.messages import Address
from ..payload.confirmed_command import Desired, Done, Result, Target
from ..payload.device_property import answer, Caller, MAX_CALLERS, Outcome, Property
from ..payload.messages import GeoPoint, GimbalDeviceAttitudeStatus
from ..payload.mount_attitude import YawFrame

# s; the limit of a request, including its confirmation.
REQUEST_LIMIT = 5.0
# s from a request until it has failed.
LOCK_LIMIT = 2.0
# s by which a status may be late: one that shows the lock sooner may be older than the request.
STATUS_DELAY = 0.2


class GimbalRequests:
    """
    The requests to one manager of a gimbal, by commands. Times are s.

    :ivar control: confirmed by the status of the manager.
    :ivar pose: a flag, confirmed by the status of the device: ArduPilot's manager does not report
        them.
    :ivar place: the region of interest, which no status shows.
    :ivar release_due: the time before which control is not released: the gimbal is being stopped.
    """

    def __init__(self, key: GimbalKey, manager: Address, commands: CommandSender) -> None:
        self.release_due = -math.inf
        self.control: Property[GimbalManagerStatus] = Property(Target(
            manager, commands, 'gimbal manager', GimbalManagerStatus.id,
            GimbalManagerStatus.msgname, needs_status=True))
        self.pose: Property[GimbalDeviceAttitudeStatus] = Property(Target(
            manager, commands, 'gimbal device', GimbalDeviceAttitudeStatus.id,
            GimbalDeviceAttitudeStatus.msgname, key.address, needs_status=True))
        self.place: Property[None] = Property(Target(manager, commands, 'gimbal manager'))
        self._device_id = key.device_id
        self._commands = commands
        self._take, self._release = (
            Desired(configure(commands.address, key.device_id, take=take), limit=REQUEST_LIMIT)
            for take in (True, False))
        # Those that wait for a release of control, which waits until the gimbal stands.
        self._releasing: list[Caller] = []
        # The newest place of a stream, while another one is under way.
        self._next_place: tuple[Desired[None], Caller] | None = None

    # Control

    @property
    def is_releasing(self) -> bool:
        """Whether a release of control is under way."""
        desired = self.control.desired
        return bool(self._releasing) or (
            desired is not None and desired.value == self._release.value)

    def request_control(self, take: bool, now: float, done: Done) -> None:
        """Take primary control, or release all control once ``release_due`` has passed."""
        desired = self._take if take else self._release
        caller = Caller(done, now, detail='take control' if take else 'release control')
        message = f'superseded by {desired.change.goal}'
        if take:
            self.end_release(Result(False, message, superseded=True))
            self.control.want(desired, now, caller)
        elif now < self.release_due:
            self.control.cancel(message, now, superseded=True)
            self._releasing.append(caller)
        else:
            self._want_release(now, caller)

    def _want_release(self, now: float, caller: Caller) -> None:
        # The end of the process cannot await the end of a fence.
        self.control.want(
            replace(self._release, is_last=bool(self._commands.refusal)), now, caller)

    def end_release(self, result: Result) -> None:
        """End a release of control that waits."""
        self.release_due = -math.inf
        if self._releasing:
            self.control.outcomes.append(
                Outcome(self._release, result, None, tuple(self._releasing)))
            self._releasing = []

    # Poses and places

    @property
    def may_turn(self) -> bool:
        """Whether a request is under way that may turn the gimbal."""
        return bool(self.pose.desired or self.place.desired)

    def set_pose(self, flag: Flag, now: float, done: Done) -> None:
        """Turn the gimbal to a pose."""
        self.pose.want(Desired(flag.change(self._device_id), limit=REQUEST_LIMIT), now,
                       Caller(done, now, detail=flag.wish))

    def set_place(
        self, place: GeoPoint | None, now: float, done: Done, *, is_stream: bool,
    ) -> None:
        """Point at a place, or at none; of a stream the newest is sent when one has ended."""
        desired = Desired(point(self._device_id, place), limit=REQUEST_LIMIT)
        goal = desired.change.goal
        caller = Caller(done, now, is_stream=is_stream, detail=goal)
        self._drop_next_place(f'superseded by {goal}')
        if is_stream and self.place.desired is not None:
            self._next_place = desired, caller
        else:
            self.place.want(desired, now, caller)

    def _drop_next_place(self, message: str) -> None:
        if self._next_place is not None:
            (desired, caller), self._next_place = self._next_place, None
            self.place.outcomes.append(Outcome(
                desired, Result(False, message, superseded=True), None, (caller,)))

    # The end

    def cancel_places(self, message: str, now: float, *, superseded: bool = False) -> None:
        """End the requests that point at a place."""
        self._drop_next_place(message)
        self.place.cancel(message, now, superseded=superseded)

    def cancel_moves(self, message: str, now: float, *, superseded: bool = False) -> None:
        """End the requests that may turn the gimbal."""
        self.pose.cancel(message, now, superseded=superseded)
        self.cancel_places(message, now, superseded=superseded)

    def cancel(self, message: str, now: float, *, superseded: bool = False) -> None:
        """End all requests."""
        self.end_release(Result(False, message, superseded=superseded))
        self.control.cancel(message, now, superseded=superseded)
        self.cancel_moves(message, now, superseded=superseded)

    def take_outcomes(self) -> Iterator[tuple[SuspendedBy | None, Outcome[Any]]]:
        """Return the requests that have ended, each with its kind: None is one for control."""
        for kind, changes in self._properties().items():
            while changes.outcomes:
                yield kind, changes.outcomes.popleft()

    def _properties(self) -> dict[SuspendedBy | None, Property[Any]]:
        return {None: self.control, SuspendedBy.POSE: self.pose, SuspendedBy.PLACE: self.place}

    # Time

    def poll(self, now: float) -> None:
        """Do what is due."""
        if now >= self.release_due:
            callers, self._releasing = self._releasing, []
            for caller in callers:
                self._want_release(now, caller)
        for changes in self._properties().values():
            changes.poll(now)
        if self._next_place is not None and self.place.desired is None:
            (desired, caller), self._next_place = self._next_place, None
            self.place.want(desired, now, caller)

    def next_deadline(self) -> float:
        """Return when :meth:`poll` has something to do."""
        return min(self.release_due if self._releasing else math.inf,
                   self.control.next_deadline(), self.pose.next_deadline(),
                   self.place.next_deadline())


class YawLock:
    """
    Sets the yaw lock with a rate of zero, until the status of the device shows it.

    A :class:`~..payload.device_property.Property` would need a command. The command with the
    flag, MAV_CMD_DO_GIMBAL_MANAGER_PITCHYAW, turns the gimbal: PX4 reads its unset angles as 0, it
    has no roll, and the other yaw frame needs the heading. No I/O; times are s.

    :param send: sends the rate of zero, whose yaw frame sets the lock.
    """

    def __init__(self, send: Callable[[YawFrame, float], None]) -> None:
        self._send = send
        self._wanted: Flag | None = None
        self._flags: int | None = None
        self._resend: list[float] = []
        self._callers: list[Caller] = []

    def want(self, flag: Flag, now: float, done: Done) -> None:
        """
        Set or clear the lock; an equal request under way is shared, another one superseded.

        :param done: called once with the result.
        """
        if flag is not self._wanted:
            self.cancel(f'superseded by {flag.goal}', now, superseded=True)
            self._wanted, self._flags = flag, None
        elif len(self._callers) >= MAX_CALLERS:
            done(Result(False, f'{MAX_CALLERS} requests are waiting already'), now)
            return
        self._callers.append(Caller(done, now))
        self._resend = [now + delay for delay in REPEATS]
        self._send(YawFrame.EARTH if flag.is_set else YawFrame.VEHICLE, now)

    def stop_resending(self) -> None:
        """Send nothing more; the status may still show the lock."""
        self._resend = []

    def cancel(self, message: str, now: float, *, superseded: bool = False) -> None:
        """End the request."""
        self._answer(self._callers, Result(False, message, superseded=superseded), now)

    def reported(self, status: GimbalDeviceAttitudeStatus, now: float) -> None:
        """Take a status of the device."""
        wanted = self._wanted
        waiting = [one for one in self._callers if now >= one.asked_at + STATUS_DELAY]
        if wanted is None or not waiting:
            return
        self._flags = status.flags
        if bool(status.flags & wanted.flag) is wanted.is_set:
            took = format_seconds(now - waiting[0].asked_at)
            self._answer(waiting, Result(
                True, f'{wanted.goal}, confirmed by {status.msgname} ({took})'), now)

    def poll(self, now: float) -> None:
        """Send the rate of zero again, or fail, if that is due."""
        wanted = self._wanted
        if wanted is None:
            return
        if late := [one for one in self._callers if now >= one.asked_at + LOCK_LIMIT]:
            name = GimbalDeviceAttitudeStatus.msgname
            shown = (f'no {name} came' if self._flags is None else f'{name} shows ' + (
                ', '.join(flag_names('GIMBAL_DEVICE_FLAGS', self._flags)) or 'no flags'))
            advice = '; the device may need the heading of the vehicle' if wanted.is_set else ''
            text = f'{wanted.goal} not confirmed: {shown} within {LOCK_LIMIT:g} s{advice}'
            self._answer(late, Result(False, text), now)
        elif self._resend and now >= self._resend[0]:
            del self._resend[0]
            self._send(YawFrame.EARTH if wanted.is_set else YawFrame.VEHICLE, now)

    def next_deadline(self) -> float:
        """Return when :meth:`poll` is due, infinity if never."""
        return math.inf if self._wanted is None else min(
            [self._callers[0].asked_at + LOCK_LIMIT, *self._resend])

    def _answer(self, callers: list[Caller], result: Result, now: float) -> None:
        """Answer the first callers; the request ends with the last one."""
        self._callers = self._callers[len(callers):]
        if not self._callers:
            self._wanted = None
        answer(callers, result, now)
