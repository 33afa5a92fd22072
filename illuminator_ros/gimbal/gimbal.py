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

"""One gimbal: its managers and its device, control of it, requests and setpoints."""

from __future__ import annotations

from collections.abc import Callable, Container
from dataclasses import dataclass, field
import math
from typing import Any, TypeVar

from . import events
from .axes import Ranges, read_ranges, TURNING
from .commands import Configure, Control, SetFlags, setpoint_flags
from .messages import (
    DEVICE_ID_PARAM,
    GimbalDeviceInformation,
    GimbalManagerInformation,
    GimbalManagerSetAttitude,
    GimbalManagerStatus,
)
from ..mavlink.command_sender import (
    Command,
    CommandResult,
    CommandSender,
    CommandStatus,
    format_seconds,
    Position,
)
from ..mavlink.dialect import mavlink, replaced, short_names
from ..mavlink.messages import Address
from ..payload import request
from ..payload.arbitration import HolderChanged
from ..payload.command_sources import Sources, SourceSettings
from ..payload.messages import GimbalDeviceAttitudeStatus
from ..payload.mount_attitude import (
    MountAttitude,
    STILL,
    to_mavlink,
    UNSET_QUATERNION,
    UNSET_VECTOR,
    yaw_frame,
    YawFrame,
)
from ..payload.rotation import flu_frd, Quaternion, Vector

# s of silence after which a manager or a device is lost.
SILENCE_LIMIT = 3.0
# s; the limit of a request, including its confirmation.
REQUEST_LIMIT = 5.0
# s; the limit of the command that stops a gimbal before control is released.
STOP_LIMIT = 0.3
# s after which an attitude is sent again, since the message is not acknowledged.
REPEATS = (0.2, 0.4, 0.8)
# s after an attitude in which the device may still report the yaw lock that it had before.
LOCK_DELAY = 1.0
# s; the least time between two attitudes that show whether a device turns: one may be a copy of
# the other.
ATTITUDE_SPACING = 0.1
# s since the last GIMBAL_MANAGER_STATUS after which it is requested (ArduPilot does not stream it,
# PX4 does every 2 s), and after which control is unknown.
STATUS_REQUEST_DELAY, STATUS_LIMIT = 3.0, 6.0
# ms by which a status may be older than the one before it; with a longer step back, its sender has
# restarted.
LATE_LIMIT = 1000
# The most managers of one gimbal; further ones are ignored.
MAX_MANAGERS = 4
MAV_FRAME_GLOBAL = 0
S = TypeVar('S')
# Commands that move a gimbal.
_MOVES = DEVICE_ID_PARAM.keys() - {mavlink.MAV_CMD_DO_GIMBAL_MANAGER_CONFIGURE}
# Commands that must not be sent again after a later setpoint or request, which they would undo.
_PLACES = (mavlink.MAV_CMD_DO_SET_ROI_LOCATION, mavlink.MAV_CMD_DO_SET_ROI_NONE)


@dataclass
class Repetition:
    """The times of the requests for a message, at growing intervals until it comes; s."""

    due: float = -math.inf
    _interval: float = 1.0

    def take(self, now: float) -> bool:
        """Return whether the message must be requested now."""
        if now < self.due:
            return False
        self.due = now + self._interval
        self._interval = min(2 * self._interval, 60.0)
        return True

    def finish(self) -> None:
        """End the requests: the message has come."""
        self.due = math.inf


@dataclass
class _Manager:
    """One manager of the gimbal; times are s."""

    target: request.Target
    requests: request.RequestQueue[GimbalManagerStatus]
    # For changes that the status of the device confirms.
    flag_target: request.Target
    flag_requests: request.RequestQueue[GimbalDeviceAttitudeStatus]
    heard_at: float = -math.inf
    autopilot: int | None = None
    information: GimbalManagerInformation | None = None
    control: Control | None = None
    status_at: float = -math.inf
    # The time_boot_ms of the newest status.
    status_time: int = 0
    status_query: Repetition = field(default_factory=Repetition)

    @property
    def queues(self) -> tuple[request.RequestQueue[Any], ...]:
        return self.requests, self.flag_requests

    def is_heard(self, now: float) -> bool:
        return now < self.heard_at + SILENCE_LIMIT


@dataclass(frozen=True)
class GimbalSettings:
    """
    The settings of the gimbals of a client.

    :param setpoint_timeout: s after the last rate until a rate of zero is sent.
    :param attitude_interval: s between attitudes of the device; 0 for its own.
    :param auto_take_control: whether to take control of a gimbal that no component controls once
        it is connected.
    :param device_id: gimbal device id of the gimbal that is kept beyond the limit of gimbals.
    :param sources: the sources of commands, None where all are alike.
    """

    setpoint_timeout: float = 0.5
    attitude_interval: float = 0.0
    auto_take_control: bool = False
    device_id: int = 0
    sources: SourceSettings | None = None


@dataclass
class _Setpoint:
    """
    The last setpoint, and the times at which it is sent again or ends, s.

    :param message: None for a place, which a command sets.
    :param after: how many requests that suspend setpoints came before it.
    """

    manager: Address
    message: GimbalManagerSetAttitude | None = None
    attitude: tuple[Quaternion, YawFrame] | None = None
    repeats: list[float] = field(default_factory=list)
    # Whether it is an attitude that ends a rate, unless it is lost.
    ends_rate: bool = False
    zero_at: float = math.inf
    # When a zero is sent again if the device still turns.
    zero_repeats: list[float] = field(default_factory=list)
    # An attitude of a device that reports no rates, and its time, s; a later one is compared.
    seen: tuple[MountAttitude, float] | None = None
    # Whether a request has ended the repetitions of a zero.
    is_suspended: bool = False
    after: int = 0

    @property
    def flags(self) -> int:
        """Return the flags of the message."""
        return self.message.flags if self.message else 0

    @property
    def moves(self) -> bool:
        """Whether the gimbal keeps turning: towards a place, or at a rate."""
        return self.message is None or self.zero_at < math.inf

    @property
    def may_have_rate(self) -> bool:
        """Whether the gimbal may turn at a rate, since the message that ends it may be lost."""
        return (self.zero_at < math.inf or bool(self.zero_repeats)
                or self.ends_rate and bool(self.repeats))

    def end_of_rate(self) -> _Setpoint | None:
        """Return the zero for a gimbal that still turns when it is controlled again."""
        if self.message is None or not self.may_have_rate:
            return None
        zero = replaced(self.message, q=UNSET_QUATERNION, angular_velocity_x=0.0,
                        angular_velocity_y=0.0, angular_velocity_z=0.0)
        return _Setpoint(self.manager, zero, zero_repeats=[-math.inf] * len(REPEATS),
                         after=self.after)

    def suspend(self) -> None:
        """Do not send it again, since a request follows it."""
        self.is_suspended |= bool(self.zero_repeats)
        self.repeats.clear()
        self.zero_repeats.clear()
        self.seen = None

    def resume(self, now: float) -> None:
        """Send a suspended zero again if the device still turns, since the request has failed."""
        if self.is_suspended:
            self.is_suspended = False
            self.zero_repeats = [now + delay for delay in REPEATS]


class Gimbal:
    """
    One gimbal device, for a component that may control it; in the link's thread.

    The first manager that is heard is used. Every change needs primary control, which
    GIMBAL_MANAGER_STATUS must show.

    :param emit: takes its events.
    :ivar was_commanded: whether a user has ever sent it a request or a setpoint.
    :ivar in_control: whether this component has primary control, and the manager is heard.
    """

    def __init__(
        self, key: events.GimbalKey, commands: CommandSender, settings: GimbalSettings,
        emit: Callable[[events.GimbalEvent], None],
    ) -> None:
        self.key = key
        self.was_commanded = False
        self.in_control = False
        self._commands = commands
        self._settings = settings
        self._emit = emit
        self._managers: dict[Address, _Manager] = {}
        self._manager = Address(0, 0)
        self._others: set[Address] = set()
        self._announced_at = self._device_heard_at = -math.inf
        self._manager_heard = self._connected = False
        # The control now, None if unknown; and the last known control.
        self._control: Control | None = None
        self._last_control: Control | None = None
        self._may_take = settings.auto_take_control
        # Whether a request for control was neither refused nor confirmed, or is under way.
        self._may_have_control = False
        # The releases of control that have not ended.
        self._releases = 0
        self._identity: events.DeviceIdentity | None = None
        self._device_ranges: Ranges | None = None
        self._identity_query = Repetition()
        self._interval_query = Repetition(
            -math.inf if settings.attitude_interval else math.inf)
        self._attitude: MountAttitude | None = None
        self._attitude_at = -math.inf
        # The time_boot_ms of the newest attitude.
        self._attitude_time = 0
        self._problem = ''
        self._flags = 0
        self._errors = 0
        self._setpoint: _Setpoint | None = None
        self._setpoints_sent = 0
        # The yaw frame of the last attitude or request, which implies the yaw lock; and the time
        # until which rates keep it, s: later the reported lock counts.
        self._frame, self._frame_until = YawFrame.VEHICLE, -math.inf
        # The requests so far that suspend setpoints, those of them that have not ended, and the
        # number of the last one that succeeded.
        self._requests = self._open_requests = self._last_success = 0
        self._link_problem = ''
        self._sources = Sources(settings.sources)

    # Liveness

    def link_closed(self, now: float, reason: str) -> None:
        """Record that the link is closed, and the reason."""
        self._link_problem = reason
        for manager in self._managers.values():
            manager.heard_at = min(manager.heard_at, now - SILENCE_LIMIT)
        self._check(now)

    @property
    def silent_since(self) -> float:
        """Return when a manager last announced the gimbal or its device was last heard, s."""
        return max(self._announced_at, self._device_heard_at)

    def heard(self, address: Address, now: float, autopilot: int) -> None:
        """Take the heartbeat of a component, which may be the device or one of its managers."""
        manager = self._managers.get(address)
        is_device = address == self.key.address and not self.key.number
        if manager is not None:
            manager.heard_at, manager.autopilot = now, autopilot
        if is_device:
            self._device_heard_at = now
        if manager is not None or is_device:
            self._check(now)

    def is_managed_by(self, address: Address) -> bool:
        """Return whether a manager announces the gimbal."""
        return address in self._managers

    def unreachable(self, now: float) -> str:
        """Return why the gimbal is not connected, for people; '' if it is."""
        manager = self._managers.get(self._manager)
        if manager is None or not manager.is_heard(now):
            return self._link_problem or _silence(
                f'manager {self._manager}', manager.heard_at if manager else -math.inf, now)
        if now >= self._device_heard_at + SILENCE_LIMIT:
            return _silence(f'device {self.key}', self._device_heard_at, now)
        return ''

    def _check(self, now: float) -> None:
        """Choose the manager, and report changes of connection and control."""
        self._choose(now)
        manager = self._active
        self._manager_heard = manager is not None and manager.is_heard(now)
        reason = self.unreachable(now)
        if self._connected is bool(reason):
            self._connected = not reason
            if reason:
                self._emit(events.GimbalLost(self.key, reason))
            else:
                self._link_problem = ''
                self._may_take = self._settings.auto_take_control
                self._identity_query = Repetition()
                if self._settings.attitude_interval:
                    self._interval_query = Repetition()
                self._emit(events.GimbalConnected(self.key, self._manager))
        control = (manager.control if manager and self._manager_heard
                   and now < manager.status_at + STATUS_LIMIT else None)
        if control != self._control:
            self._control = control
            self._control_changed(control, now)

    def _control_changed(self, control: Control | None, now: float) -> None:
        before, us = self._last_control, self._commands.address
        self.in_control = control is not None and control.primary == us
        if control is None:
            if (setpoint := self._setpoint) is not None:
                if setpoint.may_have_rate:
                    setpoint.zero_at = min(setpoint.zero_at, now)
                setpoint.repeats.clear()
                # The zero that ends a rate is sent now, or once the manager shows control again.
                if (setpoint.zero_at < math.inf and self._manager_heard
                        and setpoint.manager == self._manager):
                    self._send_rates(STILL, now)
        else:
            self._last_control = control
            if not self.in_control:
                self._setpoint = self._setpoint and self._setpoint.end_of_rate()
        self._emit(events.ControlChanged(
            self.key, before, control, self.in_control,
            was_lost=(before is not None and before.primary == us and control is not None
                      and not self.in_control and not self._releases)))

    def _choose(self, now: float) -> None:
        heard = [address for address, one in self._managers.items() if one.is_heard(now)]
        if not heard:
            return
        if self._manager not in heard:
            before, self._manager = self._manager, heard[0]
            if before in self._managers:
                for queue in self._managers[before].queues:
                    queue.cancel('the manager was lost', now)
                self._emit(events.ManagerChanged(self.key, before, self._manager))
        others = set(heard) - {self._manager}
        for other in others - self._others:
            self._emit(events.SecondManager(self.key, self._manager, other))
        self._others = others

    # Messages

    def _manager_at(self, address: Address, now: float) -> _Manager | None:
        manager = self._managers.get(address)
        if manager is None and len(self._managers) < MAX_MANAGERS:
            target = request.Target(
                address, self._commands, kind='gimbal manager',
                status_id=GimbalManagerStatus.id, status_name='GIMBAL_MANAGER_STATUS')
            flag_target = request.Target(
                address, self._commands, kind='gimbal device',
                status_id=GimbalDeviceAttitudeStatus.id,
                status_name='GIMBAL_DEVICE_ATTITUDE_STATUS', status_source=self.key.address)
            manager = self._managers[address] = _Manager(
                target, request.RequestQueue(target), flag_target,
                request.RequestQueue(flag_target))
        self._announced_at = now
        if manager is not None:
            manager.heard_at = now
        return manager

    def take_information(
        self, source: Address, message: GimbalManagerInformation, now: float,
    ) -> None:
        """Take GIMBAL_MANAGER_INFORMATION of the gimbal."""
        if manager := self._manager_at(source, now):
            manager.information = message
            self._check(now)

    def has_information_of(self, manager: Address) -> bool:
        """Return whether a manager has sent its GIMBAL_MANAGER_INFORMATION."""
        return manager in self._managers and self._managers[manager].information is not None

    def take_status(self, source: Address, status: GimbalManagerStatus, now: float) -> None:
        """Take GIMBAL_MANAGER_STATUS of the gimbal."""
        manager = self._manager_at(source, now)
        if manager is None or _is_late(status.time_boot_ms, manager.status_time):
            return
        manager.status_time = status.time_boot_ms
        manager.status_at, manager.control = now, Control.of(status)
        manager.status_query = Repetition(now + STATUS_REQUEST_DELAY)
        self._check(now)
        manager.requests.take(request.StatusReport(status, now, has_clock=False), now)

    def take_device_information(self, message: GimbalDeviceInformation) -> None:
        """Take GIMBAL_DEVICE_INFORMATION of the device."""
        self._identity = events.DeviceIdentity.of(message)
        self._device_ranges = read_ranges(message)
        self._identity_query.finish()

    def take_attitude(self, status: GimbalDeviceAttitudeStatus, now: float) -> None:
        """Take GIMBAL_DEVICE_ATTITUDE_STATUS of the device."""
        self._device_heard_at = now
        if _is_late(status.time_boot_ms, self._attitude_time):
            return
        self._attitude_time, self._attitude_at = status.time_boot_ms, now
        self._flags, self._errors = int(status.flags), int(status.failure_flags)
        try:
            self._attitude, self._problem = MountAttitude.from_status(status), ''
        except ValueError as error:
            self._attitude, self._problem = None, str(error)
        self._check(now)
        if (manager := self._active) is not None:
            manager.flag_requests.take(request.StatusReport(status, now, has_clock=False), now)
        self._repeat_zero(status, now)
        self._emit(events.AttitudeReceived(self.key, self._attitude, self._flags, self._errors))

    # Control

    @property
    def _active(self) -> _Manager | None:
        return self._managers.get(self._manager)

    def unavailable(self, now: float) -> str:
        """Return why the gimbal cannot be commanded now, for people; '' if it can."""
        return self._commands.refusal or self._obstacle(now)

    def _obstacle(self, now: float) -> str:
        """Return why a command would fail, for people; '' if it may succeed."""
        if not self._manager_heard:
            return f'gimbal {self.key} is not connected: {self.unreachable(now)}'
        if self._control is None:
            return _no_status(self._manager, self._managers[self._manager].status_at, now)
        if self.in_control:
            return f'control of gimbal {self.key} is being released' if self._releases else ''
        todo = '' if self._control.primary else '; take control first'
        return f'no control of gimbal {self.key}: {self._control}{todo}'

    def _begin(self, now: float) -> None:
        """Begin a request or a setpoint of a user, which may come before the poll that is due."""
        self.was_commanded = True
        self._check(now)

    @property
    def has_any_control(self) -> bool:
        """Whether this component has primary or secondary control, as far as it is known."""
        return self._may_have_control or (
            self._control is not None and self._control.includes(self._commands.address))

    @property
    def enforces_control(self) -> bool:
        """Whether the manager refuses components without control, as far as it is known."""
        manager = self._active
        return manager is None or manager.autopilot != mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA

    def take_control(self, now: float, done: request.Done) -> None:
        """Take primary control; succeed only if GIMBAL_MANAGER_STATUS shows it."""
        self._begin(now)
        self._configure(True, now, done)

    def close(self, now: float) -> None:
        """Answer all requests; :meth:`release_control` is still possible."""
        for manager in self._managers.values():
            for queue in manager.queues:
                queue.replace(now, self._commands.refusal)

    def release_control(self, now: float, done: request.Done) -> None:
        """Release control; succeed only if GIMBAL_MANAGER_STATUS shows it."""
        def ended(result: request.Result, now: float) -> None:
            self._releases -= 1
            done(result, now)

        self._begin(now)
        # Nothing that comes after the zero may turn the gimbal, as ArduPilot would let it.
        self._releases += 1
        if self._active is not None:
            self._active.flag_requests.cancel('control was released before it was confirmed', now)
        self._cancel(_MOVES, now)
        setpoint = self._setpoint
        may_turn = setpoint is not None and (setpoint.moves or setpoint.may_have_rate)
        self._end_motion(now)
        self._configure(False, now, ended, self._stop(now) if may_turn and self._manager_heard
                        else request.at_any_time)

    def _stop(self, now: float) -> Callable[[], float]:
        """
        Send a rate of zero, and a command of it, whose acknowledgement shows that it has arrived.

        :return: a function that returns from when on the command has ended, s.
        """
        ended_at = math.inf

        def ended(result: CommandResult, now: float) -> None:
            nonlocal ended_at
            ended_at = now
            if result.accepted:
                zero.zero_repeats.clear()

        zero = self._send_rates(STILL, now)
        self._commands.start(Command(
            self._manager, mavlink.MAV_CMD_DO_GIMBAL_MANAGER_PITCHYAW,
            (math.nan, math.nan, 0.0, 0.0, zero.flags, 0.0, self.key.device_id)),
            now, ended, deadline=now + STOP_LIMIT)
        return lambda: ended_at

    def _configure(
        self, take: bool, now: float, done: request.Done,
        earliest_start: Callable[[], float] = request.at_any_time,
    ) -> None:
        def ended(result: request.Result, now: float) -> None:
            if result.success or take and result.refused:
                self._may_have_control = False
            if result.success and take and not self.enforces_control:
                result = result._replace(
                    message=f'{result.message}; ArduPilot also obeys components without control')
            done(result, now)

        manager, refusal = self._active, self._commands.refusal if take else ''
        if refusal or manager is None or not self._manager_heard:
            done(request.Result(False, refusal or self._obstacle(now)), now)
        elif (not take and self._control is not None and not manager.requests
                and not self.has_any_control):
            # PX4 would take the system id from another component of our system.
            ended(request.Result(True, f'not in control: {self._control}'), now)
        else:
            self._may_have_control |= take
            change = Configure(self._commands.address, self.key.device_id, take)
            wish = 'take control' if take else 'release control'
            manager.requests.submit(_request(
                manager.target, change, now, self._explained(wish, ended), earliest_start), now)

    def _explained(self, wish: str, done: request.Done) -> request.Done:
        """Return a callback that adds the manager, the wish and the control to a refusal."""
        manager = self._manager

        def ended(result: request.Result, now: float) -> None:
            if result.refused:
                primary = self._control.primary if self._control else None
                if primary and not self.in_control and result.permanent:
                    advice = f'{primary} has control and must release it first'
                else:
                    who = 'this node' if self.in_control else primary or 'no component'
                    advice = self.unreachable(now) or (
                        f'{who} has control: the log of the manager may have the reason')
                # A doubtful answer, which may belong to an earlier command, has no such prefix.
                _, is_refusal, answer = result.message.partition('refused: ')
                text = (f'manager {manager} refused "{wish}": {answer}' if is_refusal
                        else result.message)
                result = result._replace(message=f'{text}; {advice}')
            done(result, now)

        return ended

    # Sources

    def claim(self, source: str, now: float) -> str:
        """Claim the gimbal for a source; return why it may not command it, '' if it may."""
        self._change_holder(self._sources.poll(now), now)
        self._change_holder(self._sources.claim(source, now), now)
        return self.refusal(source)

    def refusal(self, source: str) -> str:
        """Return why a source may not command the gimbal, for people; '' if it may."""
        return self._sources.refusal(source)

    def refusal_of_claim(self, source: str) -> str:
        """Return why a claim of a source would be refused, '' if it would not."""
        return self._sources.refusal_of_claim(source)

    def release(self, source: str, now: float) -> str:
        """
        Release the gimbal: the next lower source that has claimed it then holds it.

        :return: the source that holds it now, '' if none does.
        """
        self._change_holder(self._sources.poll(now), now)
        self._change_holder(self._sources.release(source, now), now)
        return self._sources.holder or ''

    def _change_holder(self, change: HolderChanged[str] | None, now: float) -> None:
        """End the setpoint and the commands of the previous source."""
        if change is None:
            return
        self._end_motion(now)
        if self._active is not None and change.before is not None:
            self._active.flag_requests.cancel(self.refusal(change.before), now)
            self._cancel(_MOVES, now)
        self._emit(events.GimbalHeld(self.key, change))

    def _cancel(self, commands: Container[int], now: float) -> None:
        """End commands of these kinds that are under way."""
        # The manager may have other gimbals, whose commands must not end.
        self._commands.end_all(
            now, CommandStatus.CANCELLED, self._manager, lambda command: (
                command.command in commands and self.key.device_id == command.params[
                    DEVICE_ID_PARAM[command.command]]))

    # Requests

    def set_neutral(self, now: float, done: request.Done) -> None:
        """Turn the gimbal to its neutral position."""
        flags = setpoint_flags(YawFrame.VEHICLE) | mavlink.GIMBAL_DEVICE_FLAGS_NEUTRAL
        self._set_flag(mavlink.GIMBAL_DEVICE_FLAGS_NEUTRAL, flags,
                       mavlink.GIMBAL_DEVICE_CAP_FLAGS_HAS_NEUTRAL,
                       'turn to neutral', 'neutral position', now, done)

    def retract(self, now: float, done: request.Done) -> None:
        """Turn the gimbal to its retracted position."""
        flags = setpoint_flags(YawFrame.VEHICLE) | mavlink.GIMBAL_DEVICE_FLAGS_RETRACT
        self._set_flag(mavlink.GIMBAL_DEVICE_FLAGS_RETRACT, flags,
                       mavlink.GIMBAL_DEVICE_CAP_FLAGS_HAS_RETRACT,
                       'retract', 'retracted', now, done)

    def set_yaw_lock(self, lock: bool, now: float, done: request.Done) -> None:
        """Hold the yaw against the earth, or let it follow the vehicle (GM-3)."""
        if lock:
            self._set_flag(mavlink.GIMBAL_DEVICE_FLAGS_YAW_LOCK, setpoint_flags(YawFrame.EARTH),
                           mavlink.GIMBAL_DEVICE_CAP_FLAGS_HAS_YAW_LOCK, 'lock yaw', 'yaw locked',
                           now, done)
        else:
            self._set_flag(mavlink.GIMBAL_DEVICE_FLAGS_YAW_LOCK, setpoint_flags(YawFrame.VEHICLE),
                           0, 'unlock yaw', 'yaw follows the vehicle', now, done)

    def _set_flag(
        self, flag: int, flags: int, needed: int, wish: str, goal: str,
        now: float, done: request.Done,
    ) -> None:
        self._begin(now)
        missing = self._missing(needed)
        reason = self.unavailable(now) or missing
        manager = self._active
        if reason or manager is None:
            done(request.Result(False, reason), now)
            return
        suspended = self._suspend(None, now, done)
        self._frame, self._frame_until = yaw_frame(flags), now + REQUEST_LIMIT

        def ended(result: request.Result, now: float) -> None:
            self._frame_until = now
            suspended(result, now)

        manager.flag_requests.submit(_request(
            manager.flag_target, SetFlags(flags, flag, self.key.device_id, goal), now,
            self._explained(wish, ended)), now)

    def _capabilities(self) -> int | None:
        manager = self._active
        if manager is None or manager.information is None:
            return None
        return manager.information.cap_flags

    def _missing(self, *enough: int) -> str:
        """Return that the gimbal has none of some capabilities, '' if it has or may have one."""
        known = self._capabilities()
        if known is None or any(one & known == one for one in enough):
            return ''
        names = [short_names('GIMBAL_DEVICE_CAP_FLAGS')[one] for one in enough]
        return f'gimbal {self.key} does not have {" or ".join(names)}'

    def set_roi(
        self, latitude: float, longitude: float, altitude: float, now: float, done: request.Done,
    ) -> None:
        """
        Point at a place.

        :param latitude: deg, and longitude.
        :param altitude: m above mean sea level.
        """
        self._command(Command(
            self._manager, mavlink.MAV_CMD_DO_SET_ROI_LOCATION, (float(self.key.device_id),),
            position=Position(MAV_FRAME_GLOBAL, latitude, longitude, altitude)),
            f'point at {latitude:.7g}, {longitude:.7g}, {altitude:.4g} m',
            _Setpoint(self._manager), now, done)

    def clear_roi(self, now: float, done: request.Done) -> None:
        """Stop pointing at a place."""
        self._command(Command(
            self._manager, mavlink.MAV_CMD_DO_SET_ROI_NONE, (float(self.key.device_id),)),
            'point at no place', None, now, done)

    def _command(
        self, command: Command, wish: str, place: _Setpoint | None, now: float,
        done: request.Done,
    ) -> None:
        """
        Send a command, if the gimbal can be commanded.

        :param place: see :meth:`_suspend`.
        """
        self._begin(now)
        if reason := self.unavailable(now):
            done(request.Result(False, reason), now)
            return
        explained = self._explained(wish, self._suspend(place, now, done))

        def ended(result: CommandResult, now: float) -> None:
            explained(request.Result(
                result.accepted, f'{result.describe_failure()} ({result.timing()})',
                refused=result.refused,
                permanent=result.refused and result.result in request.PERMANENT_RESULTS,
                superseded=result.status in (CommandStatus.CANCELLED, CommandStatus.CLOSED)), now)

        self._commands.start(command, now, ended, deadline=now + REQUEST_LIMIT)

    def _suspend(
        self, place: _Setpoint | None, now: float, done: request.Done,
    ) -> request.Done:
        """
        End a rate with a zero, and send no setpoint again, since a request follows.

        :param place: the setpoint that the request makes, None if it makes none.
        :return: a callback that ends the present setpoint, unless the request fails.
        """
        self._cancel(_PLACES, now)
        if self._setpoint is not None and self._setpoint.zero_at < math.inf:
            self._send_rates(STILL, now)
        before = self._setpoint
        if before is not None:
            before.suspend()
        self._open_requests += 1
        number = self._requests = self._requests + 1
        if place is not None:
            self._setpoint = place
            place.after = number

        def ended(result: request.Result, now: float) -> None:
            self._open_requests -= 1
            if result.success:
                self._last_success = max(number, self._last_success)
            # Without an answer the gimbal may follow the place.
            if place is not None and self._setpoint is place and result.refused:
                self._setpoint = before
            if self._setpoint is not None:
                if self._setpoint.after < self._last_success:
                    self._setpoint = None
                elif not self._open_requests:
                    # Before that, the device may turn since it follows another request.
                    self._setpoint.resume(now)
            done(result, now)

        return ended

    # Setpoints

    def set_attitude(self, rotation: Quaternion, frame: YawFrame, now: float) -> str:
        """
        Send an attitude.

        :param rotation: with norm 1, from the FLU axes of the gimbal as in
            :class:`~..payload.mount_attitude.MountAttitude`.
        :return: why it was not sent, for people; '' if it was.
        """
        self._begin(now)
        absolute = (mavlink.GIMBAL_DEVICE_CAP_FLAGS_HAS_YAW_LOCK,
                    mavlink.GIMBAL_DEVICE_CAP_FLAGS_SUPPORTS_YAW_IN_EARTH_FRAME)
        reason = self.unavailable(now) or (
            self._missing(*absolute) if frame is YawFrame.EARTH else '')
        if not reason:
            self._cancel(_PLACES, now)
            message = self._message(frame, to_mavlink(rotation, frame), UNSET_VECTOR)
            self._setpoint = _Setpoint(
                self._manager, message, (rotation, frame), [now + delay for delay in REPEATS],
                self._setpoint is not None and self._setpoint.may_have_rate,
                after=self._requests)
            self._frame, self._frame_until = frame, now + LOCK_DELAY
            self._send(message)
        return reason

    def set_angles(self, angles: Vector, frame: YawFrame, now: float) -> str:
        """
        Send an attitude as roll, pitch and yaw in ROS, rad; NaN leaves an axis as it is.

        Such an axis keeps its angle in the last sent attitude, else its reported angle.

        :return: why it was not sent, for people; '' if it was.
        """
        if not any(map(math.isnan, angles)):
            return self.set_attitude(Quaternion.from_euler(*angles), frame, now)
        self._begin(now)
        if reason := self.unavailable(now):
            return reason
        base = None
        if self._setpoint and self._setpoint.attitude and self._setpoint.attitude[1] is frame:
            base = self._setpoint.attitude[0]
        elif self._attitude is not None:
            base = self._attitude.seen_from(frame)
        if base is None:
            return (f'gimbal {self.key} has not reported its attitude with a yaw relative to the '
                    f'{frame.value}, so no axis can be left as it is')
        return self.set_attitude(Quaternion.from_euler(*(
            old if math.isnan(new) else new
            for new, old in zip(angles, base.euler(), strict=True))), frame, now)

    def set_rates(self, rates: Vector, now: float) -> str:
        """
        Send rates of roll, pitch and yaw in ROS, rad/s; zero is sent after the time-out.

        :return: why they were not sent, for people; '' if they were.
        """
        self._begin(now)
        reason = self.unavailable(now)
        if not reason:
            self._cancel(_PLACES, now)
            self._send_rates(rates, now)
        return reason

    def _send_rates(self, rates: Vector, now: float) -> _Setpoint:
        frame = (YawFrame.EARTH if self._flags & mavlink.GIMBAL_DEVICE_FLAGS_YAW_LOCK
                 else YawFrame.VEHICLE)
        if now < self._frame_until:
            frame = self._frame
        message = self._message(frame, UNSET_QUATERNION, flu_frd(rates))
        setpoint = self._setpoint = _Setpoint(self._manager, message, after=self._requests)
        if rates == STILL:
            setpoint.zero_repeats = [now + delay for delay in REPEATS]
        else:
            setpoint.zero_at = now + self._settings.setpoint_timeout
        self._send(message)
        return setpoint

    def _message(
        self, frame: YawFrame, q: tuple[float, float, float, float], rates: Vector,
    ) -> GimbalManagerSetAttitude:
        flags = setpoint_flags(frame)
        if self._missing(mavlink.GIMBAL_DEVICE_CAP_FLAGS_HAS_YAW_LOCK):
            flags &= ~mavlink.GIMBAL_DEVICE_FLAGS_YAW_LOCK
        return GimbalManagerSetAttitude(*self._manager, flags, self.key.device_id, q, *rates)

    def _send(self, message: GimbalManagerSetAttitude) -> None:
        self._setpoints_sent += 1
        self._commands.send(message)

    def _end_motion(self, now: float) -> None:
        """Repeat no attitude, and end a rate or a place with a zero once it can be sent."""
        if self._setpoint is not None:
            self._setpoint.repeats.clear()
            if self._setpoint.moves:
                self._setpoint.zero_at = now

    def _repeat_zero(self, status: GimbalDeviceAttitudeStatus, now: float) -> None:
        """Send a zero again where it is due and the device still turns: it was lost."""
        setpoint = self._setpoint
        if (setpoint is None or setpoint.message is None or not self.in_control
                or not setpoint.zero_repeats or now < setpoint.zero_repeats[0]):
            return
        rates = status.angular_velocity_x, status.angular_velocity_y, status.angular_velocity_z
        turns = any(abs(rate) > TURNING for rate in rates)
        if not turns and not all(map(math.isfinite, rates)) and self._attitude is not None:
            # Two of its attitudes show whether it turns.
            if setpoint.seen is None or setpoint.seen[0].frame is not self._attitude.frame:
                setpoint.seen = self._attitude, now
            before, at = setpoint.seen
            if now < at + ATTITUDE_SPACING:
                return
            turns = before.rotation.angle_to(self._attitude.rotation) > TURNING * (now - at)
        del setpoint.zero_repeats[0]
        setpoint.seen = None
        if turns:
            self._send(setpoint.message)

    # Time

    def poll(self, now: float) -> None:
        """Do everything that is due."""
        self._check(now)
        self._change_holder(self._sources.poll(now), now)
        manager = self._active
        if manager is None:
            return
        for queue in manager.queues:
            queue.poll(now)
        self._poll_setpoint(now)
        if not self._connected:
            return
        if self._may_take and self._control is not None:
            self._may_take = False
            if self._control.primary is None:
                self._configure(True, now, self._taken_automatically)
        if manager.status_query.take(now):
            manager.target.request_status(now)
        if self._identity_query.take(now):
            manager.target.request_message(
                GimbalDeviceInformation.id, now, to=self.key.address)
        if self._interval_query.take(now):
            manager.target.send(
                mavlink.MAV_CMD_SET_MESSAGE_INTERVAL,
                (float(GimbalDeviceAttitudeStatus.id), self._settings.attitude_interval * 1e6),
                now, self._interval_answered, to=self.key.address)

    def _taken_automatically(self, result: request.Result, now: float) -> None:
        if not result.success:
            self._emit(events.AutomaticTakeFailed(self.key, result.message))

    def _interval_answered(self, result: CommandResult, now: float) -> None:
        if result.result is not None:
            self._interval_query.finish()

    def _poll_setpoint(self, now: float) -> None:
        setpoint = self._setpoint
        if setpoint is None or not self.in_control:
            return
        if now >= setpoint.zero_at:
            self._send_rates(STILL, now)
        elif setpoint.message and setpoint.repeats and now >= setpoint.repeats[0]:
            del setpoint.repeats[0]
            self._send(setpoint.message)

    def next_deadline(self) -> float:
        """Return when :meth:`poll` is due, infinity if never."""
        manager = self._active
        deadlines = [self._sources.next_deadline()]
        if manager is None:
            return deadlines[0]
        deadlines += (queue.next_deadline() for queue in manager.queues)
        if self._manager_heard:
            deadlines.append(manager.heard_at + SILENCE_LIMIT)
        if self._control is not None:
            deadlines.append(manager.status_at + STATUS_LIMIT)
        if self._connected:
            deadlines += (self._device_heard_at + SILENCE_LIMIT, self._identity_query.due,
                          self._interval_query.due, manager.status_query.due)
            if self._may_take and self._control is not None:
                return -math.inf
        if self._setpoint is not None and self.in_control:
            deadlines += self._setpoint.zero_at, *self._setpoint.repeats[:1]
        return min(deadlines)

    def snapshot(self, now: float) -> events.GimbalSnapshot:
        """Return the gimbal at this moment."""
        manager = self._active
        information = manager.information if manager else None
        return events.GimbalSnapshot(
            self.key, self.unreachable(now), (self._manager, *sorted(self._others)),
            self._capabilities(),
            self._device_ranges or (read_ranges(information) if information else None),
            self._identity, self._attitude, self._attitude_at, self._problem, self._flags,
            self._errors, self._control, self.in_control,
            manager.status_at if manager else -math.inf, self.enforces_control,
            self._setpoints_sent,
            self._sources.shown_holder, self._sources.since)


def _request(
    target: request.Target, change: request.Change[S], now: float, done: request.Done,
    earliest_start: Callable[[], float] = request.at_any_time,
) -> request.Request[S]:
    return request.Request(
        target, lambda now: change, lambda result, change, status, now: done(result, now),
        now=now, deadline=now + REQUEST_LIMIT, earliest_start=earliest_start, needs_status=True)


def _is_late(time_boot_ms: int, newest: int) -> bool:
    """Return whether a status is older than the newest one."""
    # The counter wraps.
    return 0 < (newest - time_boot_ms) % (1 << 32) < LATE_LIMIT


def _no_status(manager: Address, status_at: float, now: float) -> str:
    text = f'manager {manager} has sent no GIMBAL_MANAGER_STATUS'
    return text if status_at == -math.inf else f'{text} for {format_seconds(now - status_at)}'


def _silence(what: str, heard_at: float, now: float) -> str:
    if heard_at == -math.inf:
        return f'{what} has not been heard'
    return f'nothing from {what} for {format_seconds(now - heard_at)}'
