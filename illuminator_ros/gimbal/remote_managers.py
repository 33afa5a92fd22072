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

"""The managers that announce a gimbal, as a client hears them."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator
import math
from typing import Any

from . import events
from .commands import Control
from .messages import GimbalManagerInformation, GimbalManagerStatus, REMOVE_SENDER
from ..mavlink.command_sender import (
    Command,
    CommandDone,
    CommandSender,
    format_seconds,
    request_message,
)
from ..mavlink.dialect import mavlink
from ..mavlink.messages import Address
from ..mavlink.retries import GIMBAL_MESSAGE, Retries
from ..payload.confirmed_command import Desired, Result, Target
from ..payload.device_property import Caller, Outcome, Property
from ..payload.liveness import Liveness
from ..payload.messages import GimbalDeviceAttitudeStatus
from ..payload.mount_attitude import yaw_frame, YawFrame

# s of silence after which a manager or a device is lost.
SILENCE_LIMIT = 3.0
# s since the last GIMBAL_MANAGER_STATUS after which it is requested (ArduPilot does not stream it,
# PX4 does every 2 s), before a manager with a heartbeat each 5 s is lost; and after which control
# is unknown.
STATUS_REQUEST_DELAY, STATUS_LIMIT = 2.5, 6.0
# s for which a release of control waits until the attitude shows that the gimbal stands.
STOP_LIMIT = 0.45
# ms by which a status may be older than the one before it; with a longer step back, its sender has
# restarted.
LATE_LIMIT = 1000
# The most managers of one gimbal; further ones are ignored.
MAX_MANAGERS = 4


def is_late(time_boot_ms: int, newest: int) -> bool:
    """Return whether a status is older than the newest one."""
    # The counter wraps.
    return 0 < (newest - time_boot_ms) % (1 << 32) < LATE_LIMIT


def silence(what: str, heard_at: float, now: float) -> str:
    """Return that something is silent, for people."""
    if heard_at == -math.inf:
        return f'{what} has not been heard'
    return f'nothing from {what} for {format_seconds(now - heard_at)}'


class RemoteManager:
    """
    One manager of a gimbal: its messages, and the changes that are requested of it. Times are s.

    :ivar autopilot: MAV_AUTOPILOT, None while unknown; likewise ``information``.
    :ivar control: the components in control in its last status.
    :ivar release_due: the time before which control is not released: the gimbal is being stopped.
    :ivar control_changes: confirmed by its status.
    :ivar pose_changes: of the flags, confirmed by the status of the device: ArduPilot's manager
        does not report them.
    :ivar place_changes: of the region of interest, which no status shows.
    """

    def __init__(self, address: Address, commands: CommandSender, key: events.GimbalKey) -> None:
        self.address = address
        self.liveness = Liveness(SILENCE_LIMIT)
        self.status_at = -math.inf
        self.autopilot: int | None = None
        self.information: GimbalManagerInformation | None = None
        self.control: Control | None = None
        self.status_query = Retries(GIMBAL_MESSAGE)
        self._status_time = 0
        self.release_due = -math.inf
        self._commands = commands
        self.control_changes: Property[GimbalManagerStatus] = Property(Target(
            address, commands, 'gimbal manager', GimbalManagerStatus.id,
            GimbalManagerStatus.msgname, needs_status=True))
        self.pose_changes: Property[GimbalDeviceAttitudeStatus] = Property(Target(
            address, commands, 'gimbal device', GimbalDeviceAttitudeStatus.id,
            GimbalDeviceAttitudeStatus.msgname, key.address, needs_status=True))
        self.place_changes: Property[None] = Property(Target(address, commands, 'gimbal manager'))
        # The newest place of a stream, while another one is under way.
        self._next_place: tuple[Desired[None], Caller] | None = None
        # A release of control that waits until the gimbal stands, and its callers.
        self._release: tuple[Desired[GimbalManagerStatus], list[Caller]] | None = None

    @property
    def properties(self) -> tuple[Property[Any], ...]:
        """Return all properties."""
        return self.control_changes, self.pose_changes, self.place_changes

    def request(self, message_id: int, now: float, *, to: Address | None = None) -> None:
        """Request one message of the manager or of another component."""
        self._commands.start(request_message(to or self.address, message_id), now)

    def send(
        self, command: int, params: tuple[float, ...], now: float, done: CommandDone, *,
        to: Address,
    ) -> None:
        """Send a command to another component."""
        self._commands.start(Command(to, command, params), now, done)

    def change_control(
        self, desired: Desired[GimbalManagerStatus], now: float, caller: Caller,
    ) -> None:
        """Take or release control; a release waits until ``release_due``."""
        if desired.change.params[0] != REMOVE_SENDER:
            self._end_release(Result(False, f'superseded by {desired.change.goal}',
                                     superseded=True))
        elif now < self.release_due:
            self.control_changes.cancel(f'superseded by {desired.change.goal}', now,
                                        superseded=True)
            self._release = desired, [*(self._release[1] if self._release else ()), caller]
            return
        self.control_changes.want(desired, now, caller)

    def _end_release(self, result: Result) -> None:
        release, self._release = self._release, None
        if release is not None:
            self.control_changes.outcomes.append(
                Outcome(release[0], result, None, tuple(release[1])))

    def take_outcomes(self) -> Iterator[tuple[Property[Any], Outcome[Any]]]:
        """Return what has ended, and of which property."""
        for one in self.properties:
            while one.outcomes:
                yield one, one.outcomes.popleft()

    def poll(self, now: float) -> None:
        """Do what is due."""
        if self._release is not None and now >= self.release_due:
            (release, callers), self._release = self._release, None
            for caller in callers:
                self.control_changes.want(release, now, caller)
        for one in self.properties:
            one.poll(now)
        if self._next_place is not None and self.place_changes.desired is None:
            (desired, caller), self._next_place = self._next_place, None
            self.place_changes.want(desired, now, caller)

    def next_deadline(self) -> float:
        """Return when :meth:`poll` has something to do."""
        due = math.inf if self._release is None else self.release_due
        return min(due, *(one.next_deadline() for one in self.properties))

    def request_place(self, desired: Desired[None], now: float, caller: Caller) -> None:
        """Point at a place, or at none; of a stream the newest is sent when one has ended."""
        self._drop_next_place(f'superseded by {desired.change.goal}')
        if caller.is_stream and self.place_changes.desired is not None:
            self._next_place = desired, caller
        else:
            self.place_changes.want(desired, now, caller)

    def cancel_places(self, message: str, now: float, *, superseded: bool = False) -> None:
        """End the requests that point at a place."""
        self._drop_next_place(message)
        self.place_changes.cancel(message, now, superseded=superseded)

    def _drop_next_place(self, message: str) -> None:
        if self._next_place is not None:
            desired, caller = self._next_place
            self._next_place = None
            self.place_changes.outcomes.append(Outcome(
                desired, Result(False, message, superseded=True), None, (caller,)))

    def pose_frame(self) -> tuple[YawFrame | None, float]:
        """Return the yaw frame of the request for a pose, None for none; since when, s."""
        desired = self.pose_changes.desired
        if desired is None:
            return None, -math.inf
        return yaw_frame(int(desired.change.params[4])), self.pose_changes.sent_at

    @property
    def enforces_control(self) -> bool:
        """Whether it refuses components without control, as far as it is known."""
        return self.autopilot != mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA

    def known_control(self, now: float) -> Control | None:
        """Return the components in control, None if they are not known."""
        is_known = self.liveness.is_heard(now) and now < self.status_at + STATUS_LIMIT
        return self.control if is_known else None

    def control_deadline(self) -> float:
        """Return when :meth:`known_control` returns None without another message, s."""
        return min(self.liveness.silent_at, self.status_at + STATUS_LIMIT)

    def lack_of_status(self, now: float) -> str:
        """Return that its status is missing, for people."""
        text = f'manager {self.address} has sent no GIMBAL_MANAGER_STATUS'
        age = now - self.status_at
        return f'{text} for {format_seconds(age)}' if math.isfinite(age) else text

    def take_status(self, status: GimbalManagerStatus, now: float) -> bool:
        """Take a status; return whether it counts: late ones do not."""
        if is_late(status.time_boot_ms, self._status_time):
            return False
        self._status_time = status.time_boot_ms
        self.status_at, self.control = now, Control.of(status)
        self.status_query = Retries(GIMBAL_MESSAGE, now + STATUS_REQUEST_DELAY)
        return True

    def confirm_control(self, status: GimbalManagerStatus, now: float) -> None:
        """Compare a status that counts with the requests for control."""
        self.control_changes.reported(status, now)

    def confirm_pose(self, status: GimbalDeviceAttitudeStatus, now: float) -> None:
        """Compare a status of the device with the requests for a pose."""
        self.pose_changes.reported(status, now)

    @property
    def is_releasing(self) -> bool:
        """Whether a release of control is under way."""
        desired = self.control_changes.desired
        return self._release is not None or (
            desired is not None and desired.change.params[0] == REMOVE_SENDER)

    def cancel_moves(self, message: str, now: float, *, superseded: bool = False) -> None:
        """End the requests that may turn the gimbal."""
        self.pose_changes.cancel(message, now, superseded=superseded)
        self.cancel_places(message, now, superseded=superseded)

    def cancel(self, message: str, now: float, *, superseded: bool = False) -> None:
        """End all requests."""
        self._end_release(Result(False, message, superseded=superseded))
        self.control_changes.cancel(message, now, superseded=superseded)
        self.cancel_moves(message, now, superseded=superseded)


class RemoteManagers:
    """
    The managers that announce one gimbal: the first one that is heard is used until it is lost.

    :param first: the manager that has announced the gimbal.
    :param emit: takes the events.
    :ivar used: the manager that is used.
    :ivar all: the managers that have announced it, by address.
    :ivar announced_at: when a manager last announced the gimbal, s.
    """

    def __init__(
        self, key: events.GimbalKey, first: Address, commands: CommandSender,
        emit: Callable[[events.GimbalEvent], None],
    ) -> None:
        self.announced_at = -math.inf
        self._key = key
        self._commands = commands
        self._emit = emit
        self.used = RemoteManager(first, commands, key)
        self.all = {first: self.used}
        self._others: set[Address] = set()

    @property
    def addresses(self) -> tuple[Address, ...]:
        """Return the manager that is used, and the others that are heard."""
        return self.used.address, *sorted(self._others)

    def get(self, address: Address) -> RemoteManager | None:
        """Return a manager that announces the gimbal."""
        return self.all.get(address)

    def announce(self, address: Address, now: float) -> RemoteManager | None:
        """Note an announcement; return the manager, None if there are too many."""
        self.announced_at = now
        if address not in self.all and len(self.all) < MAX_MANAGERS:
            self.all[address] = RemoteManager(address, self._commands, self._key)
        if manager := self.all.get(address):
            manager.liveness.hear(now)
        return manager

    def choose(self, now: float) -> None:
        """Use another manager if the used one is lost, and report further ones."""
        heard = [one for one in self.all.values() if one.liveness.is_heard(now)]
        if not heard:
            return
        if self.used not in heard:
            before, self.used = self.used, heard[0]
            before.cancel('the manager was lost', now)
            self._emit(events.ManagerChanged(self._key, before.address, self.used.address))
        others = {one.address for one in heard} - {self.used.address}
        for other in others - self._others:
            self._emit(events.SecondManager(self._key, self.used.address, other))
        self._others = others

    def components_lost(self, lost: Collection[Address], now: float, reason: str) -> None:
        """Lose some managers at once."""
        for manager in [one for one in self.all.values() if one.address in lost]:
            manager.liveness.lose(now)
            manager.cancel(reason, now)

    def close(self, message: str, now: float) -> None:
        """End all requests: the process ends."""
        for manager in self.all.values():
            manager.cancel(message, now, superseded=True)
