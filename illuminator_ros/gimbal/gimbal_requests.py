# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The commands to the manager of a gimbal: for control, a pose, a place; and the yaw lock."""

from __future__ import annotations

from collections.abc import Callable, Mapping
import math
from typing import Any

from .commands import configure, Flag, point
from .events import GimbalKey
from .messages import GimbalManagerStatus
from .setpoint_stream import REPEATS
from ..mavlink.command_sender import CommandSender, format_seconds
from ..mavlink.dialect import flag_names
from ..mavlink.messages import Address
from ..payload.attempt import Change, Served, Target
from ..payload.device_property import Property
from ..payload.messages import GimbalDeviceAttitudeStatus
from ..payload.mount_attitude import YawFrame
from ..payload.requests import Done, Goal, Request, Requests, Result, Values, Why

# s; the limit of a request, including its confirmation.
REQUEST_LIMIT = 5.0
# s from a request until it has failed.
LOCK_LIMIT = 2.0
# s by which a status may be late: one that shows the lock sooner may be older than the request.
STATUS_DELAY = 0.2
# The fields of the requests to a gimbal. A request for control has no source: all sources need it.
POSE, PLACE, YAW_LOCK, CONTROL = 'pose', 'place', 'yaw lock', 'control'


def describe(values: Values) -> str:
    """Describe the values of a request, for people."""
    (field, value), = values.items()
    if field == CONTROL:
        return 'control taken' if value else 'control released'
    return str(point(0, value).goal if field == PLACE else value.goal)


class GimbalRequests:
    """
    Sends one manager of a gimbal what is wanted by command. No I/O; times are s.

    :param requests: for poses and places; those for control are in a table of their own.
    :param poll: of the gimbal.
    :ivar control: the standing requests for control.
    """

    def __init__(
        self, key: GimbalKey, manager: Address, commands: CommandSender, requests: Requests,
        poll: Callable[[float], None],
    ) -> None:
        self.control = Requests(f'gimbal {key}', None, describe)
        self._requests = requests
        self._us = commands.address
        self._device_id = key.device_id
        # The newest status of each property, and the time between it and the one before, s.
        self._newest: dict[str, tuple[Any, float, float]] = {}
        # The status of the manager confirms control, the status of the device a pose:
        # ArduPilot's manager does not report the flags. No status shows the place.
        self._properties: dict[str, Property[Any]] = {
            CONTROL: Property(Target(
                manager, commands, 'gimbal manager', poll, GimbalManagerStatus.id,
                GimbalManagerStatus.msgname, needs_status=True), self._planner(
                lambda take: configure(self._us, self._device_id, take=take))),
            POSE: Property(Target(
                manager, commands, 'gimbal device', poll, GimbalDeviceAttitudeStatus.id,
                GimbalDeviceAttitudeStatus.msgname, key.address, needs_status=True),
                self._planner(lambda flag: flag.change(self._device_id))),
            PLACE: Property(Target(manager, commands, 'gimbal manager', poll), self._planner(
                lambda place: point(self._device_id, place)))}

    @staticmethod
    def _planner(make: Callable[[Any], Change[Any]]) -> Callable[
            [Goal], tuple[Change[Any], Mapping[Request, Change[Any]]]]:
        def plan(goal: Goal) -> tuple[Change[Any], Mapping[Request, Change[Any]]]:
            change = make(goal.values)
            return change, dict.fromkeys(goal.serves, change)

        return plan

    # Control

    def request_control(
        self, take: bool, now: float, done: Done, *, due: float = -math.inf, is_end: bool = False,
    ) -> None:
        """
        Take primary control, or release all control.

        :param due: s; it is not sent before.
        :param is_end: whether the process ends, which cannot await the end of a fence.
        """
        self.control.put(Request(
            {CONTROL: take}, Why.END if is_end else Why.REQUEST, now, done=done,
            is_call=True, due=due, until=max(now, due) + REQUEST_LIMIT,
            detail=f'superseded by {describe({CONTROL: take})}'), now)

    @property
    def releases(self) -> list[Request]:
        """Return the requests to release control."""
        return [one for one in self.control.live() if not one.values[CONTROL]]

    @property
    def release_due(self) -> float:
        """Return when a release that waits is due, s; -inf if none waits."""
        return max((one.due for one in self.releases), default=-math.inf)

    def release_now(self, now: float) -> None:
        """Send a release that waits: the gimbal stands."""
        for one in self.releases:
            one.due = min(one.due, now)

    # Poses and places

    @property
    def may_turn(self) -> bool:
        """Whether a command is under way that may turn the gimbal."""
        return any(self._properties[field].attempt is not None for field in (POSE, PLACE))

    # Time

    def step(self, now: float) -> list[Served[Any]]:
        """Have what is wanted under way; return the requests that have ended by that."""
        live, ended = self._requests.live() + self.control.live(), list[Served[Any]]()
        for field, one in self._properties.items():
            goal = Goal.strongest(live, field, now)
            if goal is not None and not goal.is_awaited:
                # Of a stream of places the newest is sent when one has ended.
                goal = goal._replace(waits=True)
            status, _, gap = self._newest.get(field, (None, 0.0, None))
            standing = (self.control if field == CONTROL else self._requests).standing
            ended += [served for served in one.steer(goal, now, status, gap)
                      if served.request not in standing]
        return ended

    def reported(self, field: str, status: Any, now: float) -> list[Served[Any]]:
        """Take a status that shows a property; return the requests that have ended."""
        _, before, _ = self._newest.get(field, (None, now, 0.0))
        self._newest[field] = status, now, now - before
        return self._properties[field].reported(status, now - before, now)

    def poll(self, now: float) -> list[Served[Any]]:
        """Do what is due; return the requests that have ended."""
        return [served for one in self._properties.values() for served in one.poll(now)]

    @property
    def due(self) -> float:
        """Return when :meth:`poll` or :meth:`step` has something to do, s."""
        waits = [one.due for one in self.control.live() if not one.is_served]
        return min([*waits, *(one.due for one in self._properties.values())])


class YawLock:
    """
    Sets the yaw lock with a rate of zero, until the status of the device shows it.

    A :class:`~..payload.device_property.Property` would need a command. The command with the
    flag, MAV_CMD_DO_GIMBAL_MANAGER_PITCHYAW, turns the gimbal: PX4 reads its unset angles as 0, it
    has no roll, and the other yaw frame needs the heading. No I/O; times are s.

    :param send: sends the rate of zero, whose yaw frame sets the lock.
    """

    def __init__(self, requests: Requests, send: Callable[[YawFrame, float], None]) -> None:
        self._requests = requests
        self._send = send
        self._flags: int | None = None
        self._resend: list[float] = []
        # The newest request that it was sent for.
        self._sent_for: Request | None = None

    @property
    def _waiting(self) -> list[Request]:
        return [one for one in self._requests.live() if YAW_LOCK in one.values]

    @property
    def _wanted(self) -> Flag | None:
        return next((one.values[YAW_LOCK] for one in reversed(self._waiting)), None)

    def step(self, now: float) -> None:
        """Send the rate of zero for a new request, and again if that is due."""
        wanted, waiting = self._wanted, self._waiting
        if wanted is None:
            self._resend, self._flags = [], None
            return
        if waiting[-1] is not self._sent_for:
            self._sent_for = waiting[-1]
            self._resend = [now + delay for delay in REPEATS]
        elif not (self._resend and now >= self._resend[0]):
            return
        else:
            del self._resend[0]
        self._send(YawFrame.EARTH if wanted.is_set else YawFrame.VEHICLE, now)

    def stop_resending(self) -> None:
        """Send nothing more; the status may still show the lock."""
        self._resend = []

    def reported(self, status: GimbalDeviceAttitudeStatus, now: float) -> None:
        """Take a status of the device."""
        wanted = self._wanted
        waiting = [one for one in self._waiting if now >= one.since + STATUS_DELAY]
        if wanted is None or not waiting:
            return
        self._flags = status.flags
        if bool(status.flags & wanted.flag) is wanted.is_set:
            took = format_seconds(now - waiting[0].since)
            for one in waiting:
                self._requests.end(one, Result(
                    True, f'{wanted.goal}, confirmed by {status.msgname} ({took})'), now)

    def poll(self, now: float) -> None:
        """End the requests whose time is over."""
        name = GimbalDeviceAttitudeStatus.msgname
        for one in self._waiting:
            if now >= one.since + LOCK_LIMIT:
                wanted = one.values[YAW_LOCK]
                shown = (f'no {name} came' if self._flags is None else f'{name} shows ' + (
                    ', '.join(flag_names('GIMBAL_DEVICE_FLAGS', self._flags)) or 'no flags'))
                advice = ('; the device may need the heading of the vehicle' if wanted.is_set
                          else '')
                self._requests.end(one, Result(
                    False, f'{wanted.goal} not confirmed: {shown} within {LOCK_LIMIT:g} s'
                    f'{advice}'), now)

    @property
    def due(self) -> float:
        """Return when :meth:`poll` or :meth:`step` is due, infinity if never."""
        waiting = self._waiting
        return min([waiting[0].since + LOCK_LIMIT, *self._resend]) if waiting else math.inf
