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

"""One gimbal: its managers and its device, requests and setpoints."""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import dataclass
import math
from typing import TypeVar

from . import events
from . import messages as gimbal
from .axes import known_ranges, Ranges
from .commands import Flag, NEUTRAL, point, RETRACT, setpoint_flags, YAW_LOCKS
from .gimbal_control import GimbalControl, REQUEST_LIMIT
from .remote_managers import (
    is_late,
    RemoteManager,
    RemoteManagers,
    silence,
    SILENCE_LIMIT,
    STOP_LIMIT,
)
from .setpoint_stream import SetpointStream, SuspendedBy
from .yaw_lock import YawLock
from ..mavlink.command_sender import CommandResult, CommandSender
from ..mavlink.dialect import mavlink, short_names
from ..mavlink.messages import Address
from ..mavlink.retries import GIMBAL_MESSAGE, Retries
from ..payload.arbitration import Cause, HolderChanged
from ..payload.command_sources import Sources, SourceSettings
from ..payload.confirmed_command import Desired, Done, Result
from ..payload.device_events import DeviceConnected, DeviceDisconnected, DeviceHeld
from ..payload.device_property import answer, Caller, Outcome, Property
from ..payload.liveness import Liveness
from ..payload.messages import GeoPoint, GimbalDeviceAttitudeStatus
from ..payload.mount_attitude import MountAttitude, Wxyz, YawFrame
from ..payload.rotation import Quaternion, Vector

S = TypeVar('S')


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


class _Device:
    """
    The reports of the device of a gimbal; times are s.

    :param interval: between its attitudes; 0 for its own.
    :ivar without_id: of attitudes that may be those of another gimbal.
    :ivar problem: why the last status has no attitude, '' if it has one.
    """

    def __init__(self, address: Address, interval: float) -> None:
        self.liveness = Liveness(SILENCE_LIMIT)
        self.without_id = Liveness(SILENCE_LIMIT)
        self.attitude_at = -math.inf
        self._status_time = 0
        self.attitude: MountAttitude | None = None
        self.problem = ''
        self.flags = self.errors = 0
        self.identity: events.DeviceIdentity | None = None
        self.ranges: Ranges | None = None
        self._address = address
        self._interval = interval
        self.connected()

    def connected(self) -> None:
        """Request everything from now on: the device may have restarted."""
        self._identity_query = Retries(GIMBAL_MESSAGE)
        self._interval_query = Retries(
            GIMBAL_MESSAGE, -math.inf if self._interval else math.inf)

    def take_information(self, message: gimbal.GimbalDeviceInformation) -> None:
        """Take its identity and its ranges."""
        self.identity, self.ranges = events.DeviceIdentity.of(message), known_ranges(message)
        self._identity_query.stop()

    def take_status(self, status: GimbalDeviceAttitudeStatus, now: float) -> bool:
        """Take its attitude and its flags; return whether the status counts: late ones do not."""
        self.liveness.hear(now)
        if is_late(status.time_boot_ms, self._status_time):
            return False
        self._status_time, self.attitude_at = status.time_boot_ms, now
        self.flags, self.errors = status.flags, status.failure_flags
        try:
            self.attitude, self.problem = MountAttitude.from_status(status), ''
        except ValueError as error:
            self.attitude, self.problem = None, str(error)
        return True

    def poll(self, manager: RemoteManager, now: float) -> None:
        """Request what it does not send by itself."""
        if self._identity_query.begin_try(now):
            manager.request(gimbal.GimbalDeviceInformation.id, now, to=self._address)
        if self._interval_query.begin_try(now):
            manager.send(
                mavlink.MAV_CMD_SET_MESSAGE_INTERVAL,
                (float(GimbalDeviceAttitudeStatus.id), self._interval * 1e6), now,
                self._interval_answered, to=self._address)

    def next_deadline(self) -> float:
        """Return when :meth:`poll` is due, s."""
        return min(self._identity_query.due, self._interval_query.due)

    def _interval_answered(self, result: CommandResult, now: float) -> None:
        if result.result is not None:
            self._interval_query.stop()


class Gimbal:
    """
    One gimbal device, for a component that may control it; in the link's thread.

    Every change but control itself needs primary control, which GIMBAL_MANAGER_STATUS must show.

    :param manager: has announced it.
    :param emit: takes its events.
    :ivar was_commanded: whether a user has ever sent it a request or a setpoint.
    """

    def __init__(
        self, key: events.GimbalKey, manager: Address, commands: CommandSender,
        settings: GimbalSettings, emit: Callable[[events.GimbalEvent], None],
    ) -> None:
        self.key = key
        self.was_commanded = False
        self._commands = commands
        self._settings = settings
        self._emit = emit
        self._managers = RemoteManagers(key, manager, commands, emit)
        self._device = _Device(key.address, settings.attitude_interval)
        self._control = GimbalControl(key, commands.address, emit)
        self._setpoints = SetpointStream(
            self._message, commands.send, settings.setpoint_timeout,
            lambda: self._manager.pose_frame())
        self._yaw_lock = YawLock(self._setpoints.hold)
        self._sources = Sources(settings.sources)
        self._connected = False
        self._link_problem = ''

    # Liveness

    @property
    def _manager(self) -> RemoteManager:
        return self._managers.used

    def components_lost(self, lost: Collection[Address], now: float, reason: str) -> None:
        """Record that some components cannot be reached, and the reason."""
        if self.key.address in lost or self._manager.address in lost:
            self._link_problem = reason
            self._yaw_lock.cancel(reason, now)
        self._managers.components_lost(lost, now, reason)
        if self.key.address in lost:
            self._device.liveness.lose(now)
        self._check(now)
        self._settle(now)

    @property
    def lost_at(self) -> float:
        """Return when a manager last announced the gimbal or its device was last heard, s."""
        return max(self._managers.announced_at, self._device.liveness.heard_at)

    def heard(self, address: Address, now: float, autopilot: int) -> None:
        """Take the heartbeat of a component, which may be the device or one of its managers."""
        manager = self._managers.get(address)
        is_device = address == self.key.address and not self.key.number
        if manager is not None:
            manager.liveness.hear(now)
            manager.autopilot = autopilot
        if is_device:
            self._device.liveness.hear(now)
        if manager is not None or is_device:
            self._check(now)

    def heard_without_id(self, now: float) -> None:
        """Note a message of its device or of another gimbal of the same address."""
        self._device.without_id.hear(now)

    @property
    def addresses(self) -> set[Address]:
        """Return the addresses of its device and of its managers."""
        return {self.key.address, *self._managers.all}

    def lacks_information_of(self, address: Address) -> bool:
        """Return whether a component manages it without GIMBAL_MANAGER_INFORMATION so far."""
        manager = self._managers.get(address)
        return manager is not None and manager.information is None

    def unreachable(self, now: float) -> str:
        """Return why the gimbal is not connected, for people; '' if it is."""
        manager = self._manager
        if not manager.liveness.is_heard(now):
            return self._link_problem or silence(
                f'manager {manager.address}', manager.liveness.heard_at, now)
        device = self._device
        if device.liveness.is_heard(now):
            return ''
        if device.without_id.is_heard(now):
            return (f'{self.key.address} has several gimbals and sends attitudes without '
                    'gimbal_device_id, so they cannot be told apart')
        return self._link_problem or silence(
            f'device {self.key}', device.liveness.heard_at, now)

    def _check(self, now: float) -> None:
        """Choose the manager, and report changes of connection and control."""
        self._managers.choose(now)
        reason = self.unreachable(now)
        if self._connected is bool(reason):
            self._connected = not reason
            if reason:
                self._emit(DeviceDisconnected(self.key, reason))
            else:
                self._link_problem = ''
                self._control.take_due = self._settings.auto_take_control
                self._device.connected()
                self._emit(DeviceConnected(
                    self.key, f'manager {self._manager.address}'))
        control = self._manager.known_control(now)
        if control == self._control.known:
            return
        is_first = self._control.update(control, self._manager, now)
        if not self.in_control:
            self._yaw_lock.cancel(self.unavailable(now), now)
        if control is None:
            # The manager that had shown this component in control takes the zero.
            last = self._manager.control
            self._setpoints.control_unknown(
                now, is_heard=self._manager.liveness.is_heard(now), can_send=(
                    not self._link_problem and last is not None
                    and last.primary == self._commands.address))
        elif not self.in_control:
            self._setpoints.control_lost()
        elif is_first:
            self._setpoints.control_found()

    # Messages

    def take_information(
        self, source: Address, message: gimbal.GimbalManagerInformation, now: float,
    ) -> None:
        """Take GIMBAL_MANAGER_INFORMATION of the gimbal."""
        if manager := self._managers.announce(source, now):
            manager.information = message
            self._check(now)

    def take_status(self, source: Address, status: gimbal.GimbalManagerStatus, now: float) -> None:
        """Take GIMBAL_MANAGER_STATUS of the gimbal."""
        manager = self._managers.announce(source, now)
        if manager is not None and manager.take_status(status, now):
            self._check(now)
            manager.confirm_control(status, now)
            self._settle(now)

    def take_device_information(self, message: gimbal.GimbalDeviceInformation) -> None:
        """Take GIMBAL_DEVICE_INFORMATION of the device."""
        self._device.take_information(message)

    def take_attitude(self, status: GimbalDeviceAttitudeStatus, now: float) -> None:
        """Take GIMBAL_DEVICE_ATTITUDE_STATUS of the device."""
        device, manager = self._device, self._manager
        if not device.take_status(status, now):
            return
        self._check(now)
        manager.confirm_pose(status, now)
        self._settle(now)
        self._yaw_lock.reported(status, now)
        self._setpoints.reported(status, device.attitude, now, may_send=(
            self.in_control
            and not (manager.pose_changes.desired or manager.place_changes.desired)))
        if manager.is_releasing and self._setpoints.stands:
            self._setpoints.forget()
            manager.release_due = -math.inf
        self._emit(events.AttitudeReceived(
            self.key, device.attitude, device.flags, device.errors))

    # Control

    @property
    def in_control(self) -> bool:
        """Whether this component has primary control, and the manager is heard."""
        return self._control.is_ours

    @property
    def has_any_control(self) -> bool:
        """Whether this component has primary or secondary control, as far as it is known."""
        return self._control.has_any

    def unavailable(self, now: float) -> str:
        """Return why the gimbal cannot be commanded now, for people; '' if it can."""
        return (self._commands.refusal or self._commands.lateness(now) or self._absence(now)
                or (self._manager.lack_of_status(now) if self._control.known is None
                    else self._control.lack(self._manager)))

    def _absence(self, now: float) -> str:
        """Return that the manager is lost, for people; '' if it is heard."""
        if self._manager.liveness.is_heard(now):
            return ''
        return f'gimbal {self.key} is not connected: {self.unreachable(now)}'

    def _begin(self, now: float) -> None:
        """Begin a request or a setpoint of a user, which may come before the poll that is due."""
        self.was_commanded = True
        # A later setpoint or request must not be undone.
        self._yaw_lock.stop_resending()
        self._check(now)

    def take_control(self, now: float, done: Done) -> None:
        """Take primary control; succeed only if GIMBAL_MANAGER_STATUS shows it."""
        self._begin(now)
        self._request_control(True, now, done)

    def release_control(self, now: float, done: Done) -> None:
        """Stop, and release control; succeed only if GIMBAL_MANAGER_STATUS shows it."""
        self._begin(now)
        manager, setpoints = self._manager, self._setpoints
        # Nothing that comes after the zero may turn the gimbal, as ArduPilot would let it.
        self._cancel_moves('superseded by a release of control', now, superseded=True)
        may_turn = setpoints.may_turn
        setpoints.end(now)
        if may_turn and manager.liveness.is_heard(now):
            # No command stops a gimbal everywhere: PX4 reads unset angles as 0.
            setpoints.stop(now)
            manager.release_due = now + STOP_LIMIT
        self._request_control(False, now, done)

    def _request_control(self, take: bool, now: float, done: Done) -> None:
        refusal = self._commands.refusal if take else ''
        if refusal := refusal or self._absence(now):
            done(Result(False, refusal), now)
            return
        wish = 'take control' if take else 'release control'
        result = self._control.request(take, self._manager, now, Caller(done, now, detail=wish))
        if result is not None:
            done(self._released(result), now)
        self._settle(now)

    def _released(self, result: Result) -> Result:
        """Take the result of a release of control."""
        self._manager.release_due = -math.inf
        if result.success and self._setpoints.may_turn:
            return result._replace(
                message=f'{result.message}; no attitude shows that the gimbal stands')
        return result

    def _settle(self, now: float) -> None:
        """Answer the callers whose requests have ended."""
        for manager in list(self._managers.all.values()):
            for changes, outcome in manager.take_outcomes():
                answer(outcome.callers, self._ended(manager, changes, outcome, now), now)

    def _ended(
        self, manager: RemoteManager, changes: Property[S], outcome: Outcome[S], now: float,
    ) -> Result:
        """Return the result of a request, for its callers."""
        result = outcome.result
        if changes is manager.pose_changes:
            self._setpoints.request_ended(SuspendedBy.POSE, result)
        elif changes is manager.place_changes:
            self._setpoints.request_ended(SuspendedBy.PLACE, result)
        elif outcome.desired.change.params[0] == gimbal.REMOVE_SENDER:
            result = self._released(self._control.ended(False, result, manager))
        else:
            result = self._control.ended(True, result, manager)
        wish = outcome.callers[0].detail if outcome.callers else ''
        return self._explained(result, manager, wish, now) if result.refused else result

    def _explained(
        self, result: Result, manager: RemoteManager, wish: str, now: float,
    ) -> Result:
        """Add the manager, the wish and the control to a refusal."""
        known = self._control.known
        primary = known and known.primary
        if primary and not self.in_control and result.permanent:
            advice = f'{primary} has control and must release it first'
        else:
            who = 'this node' if self.in_control else primary or 'no component'
            advice = self.unreachable(now) or (
                f'{who} has control: the log of the manager may have the reason'
                if known is not None else manager.lack_of_status(now))
        reason = result.message.removeprefix('refused: ')
        return result._replace(
            message=f'manager {manager.address} refused "{wish}": {reason}; {advice}')

    def close(self, now: float) -> None:
        """Answer all requests; :meth:`release_control` is still possible."""
        self._yaw_lock.cancel(self._commands.refusal, now, superseded=True)
        self._managers.close(self._commands.refusal, now)
        self._settle(now)

    def change_settings(self, settings: GimbalSettings, now: float) -> None:
        """Take other settings: ``setpoint_timeout`` and the time-out of ``sources`` may differ."""
        self._settings = settings
        self._setpoints.change_timeout(settings.setpoint_timeout, now)
        if settings.sources:
            self._sources.set_lease(settings.sources.timeout)
            self._take_holder(self._sources.poll(now), now)

    # Sources

    def claim(self, source: str, now: float) -> str:
        """Claim the gimbal for a stream; return any refusal of its source, '' for none."""
        self._take_holder(self._sources.poll(now), now)
        self._take_over(source, now)
        self._take_holder(self._sources.claim(source, now), now)
        return self._sources.refusal(source)

    def begin_call(self, source: str, now: float) -> str:
        """Begin a call; return why its source may not command the gimbal, '' if it may."""
        self._take_holder(self._sources.poll(now), now)
        if refusal := self._sources.refusal(source):
            return refusal
        self._take_over(source, now)
        self._sources.begin_call(source)
        return ''

    def end_call(self, source: str, now: float, *, success: bool) -> None:
        """End a call, which claims the gimbal if it has succeeded."""
        self._take_holder(self._sources.end_call(source, now, success=success), now)

    def refusal(self, source: str) -> str:
        """Return why a source may not command the gimbal, for people; '' if it may."""
        return self._sources.refusal(source)

    def release(self, source: str, now: float) -> str:
        """
        Release the gimbal: the next lower source that has claimed it then holds it.

        :return: the source that holds it now, '' if none does.
        """
        self._take_holder(self._sources.poll(now), now)
        self._take_holder(self._sources.release(source, now), now)
        return self._sources.holder or ''

    def _take_over(self, source: str, now: float) -> None:
        """End the setpoint and the requests of another source, unless it is a higher one."""
        if self._sources.takes_over(source):
            self._end_commands(f'held by {source}', now)

    def _take_holder(self, change: HolderChanged[str] | None, now: float) -> None:
        """Take a change of the source that holds the gimbal."""
        if change is None:
            return
        if change.cause is not Cause.CLAIM:
            self._end_commands(f'held by {change.after or "no source"}', now)
        self._emit(DeviceHeld(self.key, change))

    def _end_commands(self, message: str, now: float) -> None:
        self._setpoints.end(now)
        self._cancel_moves(message, now)
        self._settle(now)

    # Requests

    def set_neutral(self, now: float, done: Done) -> None:
        """Turn the gimbal to its neutral position."""
        self._set_flag(NEUTRAL, now, done)

    def retract(self, now: float, done: Done) -> None:
        """Turn the gimbal to its retracted position."""
        self._set_flag(RETRACT, now, done)

    def set_yaw_lock(self, lock: bool, now: float, done: Done) -> None:
        """Stop; then hold the yaw against the earth, or let it follow the vehicle (GM-3)."""
        self._begin(now)
        flag = YAW_LOCKS[lock]
        if reason := self.unavailable(now) or self._missing(flag.needed):
            done(Result(False, reason), now)
            return
        self._manager.cancel_moves(f'superseded by {flag.goal}', now, superseded=True)
        self._yaw_lock.want(flag, now, done)

    def _set_flag(self, flag: Flag, now: float, done: Done) -> None:
        self._begin(now)
        if reason := self.unavailable(now) or self._missing(flag.needed):
            done(Result(False, reason), now)
            return
        self._end_place_changes(flag.goal, now)
        self._yaw_lock.cancel(f'superseded by {flag.goal}', now, superseded=True)
        self._setpoints.suspend(now, SuspendedBy.POSE)
        self._manager.pose_changes.want(
            Desired(flag.change(self.key.device_id), limit=REQUEST_LIMIT), now,
            Caller(done, now, detail=flag.wish))
        self._settle(now)

    def _capabilities(self) -> int | None:
        information = self._manager.information
        return None if information is None else information.cap_flags

    def _missing(self, *enough: int) -> str:
        """Return that the gimbal has none of some capabilities, '' if it has or may have one."""
        known = self._capabilities()
        if known is None or any(one & known == one for one in enough):
            return ''
        names = [short_names('GIMBAL_DEVICE_CAP_FLAGS')[one] for one in enough]
        return f'gimbal {self.key} does not have {" or ".join(names)}'

    def clear_roi(self, now: float, done: Done) -> None:
        """Stop pointing at a place."""
        self.set_roi(None, now, done)

    def set_roi(
        self, place: GeoPoint | None, now: float, done: Done, *, is_stream: bool = False,
    ) -> None:
        """
        Point at a place, or at none.

        :param is_stream: whether its publisher repeats it, so that a newer one replaces it.
        """
        self._begin(now)
        if reason := self.unavailable(now):
            done(Result(False, reason), now)
            return
        change = point(self.key.device_id, place)
        self._setpoints.suspend(now, SuspendedBy.PLACE, is_place=place is not None)
        self._manager.request_place(
            Desired(change, limit=REQUEST_LIMIT), now,
            Caller(done, now, is_stream=is_stream, detail=change.goal))
        self._settle(now)

    # Setpoints

    def set_attitude(self, rotation: Quaternion, frame: YawFrame, now: float) -> str:
        """
        Send an attitude.

        :param rotation: with norm 1, from the FLU axes of the gimbal as in
            :class:`~..payload.mount_attitude.MountAttitude`.
        :return: why it was not sent, for people; '' if it was.
        """
        reason = self._begin_setpoint(now) or (self._missing(
            mavlink.GIMBAL_DEVICE_CAP_FLAGS_HAS_YAW_LOCK,
            mavlink.GIMBAL_DEVICE_CAP_FLAGS_SUPPORTS_YAW_IN_EARTH_FRAME,
        ) if frame is YawFrame.EARTH else '')
        if not reason:
            self._end_place_changes('a setpoint', now)
            self._setpoints.set_attitude(rotation, frame, now)
        return reason

    def set_angles(self, angles: Vector, frame: YawFrame, now: float) -> str:
        """
        Send an attitude as roll, pitch and yaw in ROS, rad; NaN leaves an axis as it is.

        Such an axis keeps its angle in the last sent attitude, else its reported angle.

        :return: why it was not sent, for people; '' if it was.
        """
        if any(map(math.isnan, angles)):
            if reason := self._begin_setpoint(now):
                return reason
            base, attitude = self._setpoints.attitude(frame), self._device.attitude
            if base is None and attitude is not None:
                base = attitude.seen_from(frame)
            if base is None:
                return (f'gimbal {self.key} has not reported its attitude with a yaw relative to '
                        f'the {frame.value}, so no axis can be left as it is')
            roll, pitch, yaw = (old if math.isnan(new) else new
                                for new, old in zip(angles, base.euler(), strict=True))
            angles = roll, pitch, yaw
        return self.set_attitude(Quaternion.from_euler(*angles), frame, now)

    def set_rates(self, rates: Vector, now: float) -> str:
        """
        Send rates of roll, pitch and yaw in ROS, rad/s; zero is sent after the time-out.

        :return: why they were not sent, for people; '' if they were.
        """
        reason = self._begin_setpoint(now)
        if not reason:
            self._end_place_changes('a setpoint', now)
            self._setpoints.set_rates(rates, now)
        return reason

    def _begin_setpoint(self, now: float) -> str:
        self._begin(now)
        return self.unavailable(now)

    def _cancel_moves(self, message: str, now: float, *, superseded: bool = False) -> None:
        """End the requests that may turn the gimbal, or stop it later."""
        self._manager.cancel_moves(message, now, superseded=superseded)
        self._yaw_lock.cancel(message, now, superseded=superseded)

    def _end_place_changes(self, newer: str, now: float) -> None:
        """Send no place again, which would undo a later setpoint or request."""
        self._manager.cancel_places(f'superseded by {newer}', now, superseded=True)

    def _message(
        self, frame: YawFrame, q: Wxyz, rates: Vector,
    ) -> gimbal.GimbalManagerSetAttitude:
        flags = setpoint_flags(frame)
        if self._missing(mavlink.GIMBAL_DEVICE_CAP_FLAGS_HAS_YAW_LOCK):
            flags &= ~mavlink.GIMBAL_DEVICE_FLAGS_YAW_LOCK
        return gimbal.GimbalManagerSetAttitude(
            *self._manager.address, flags, self.key.device_id, q, *rates)

    # Time

    def poll(self, now: float) -> None:
        """Do everything that is due."""
        self._check(now)
        self._take_holder(self._sources.poll(now), now)
        manager, control = self._manager, self._control
        manager.poll(now)
        self._yaw_lock.poll(now)
        self._settle(now)
        if self.in_control:
            self._setpoints.poll(now)
        if not self._connected:
            return
        if control.take_due and control.known is not None:
            control.take_due = False
            if control.known.primary is None:
                self._request_control(True, now, self._taken_automatically)
        if manager.status_query.begin_try(now):
            manager.request(gimbal.GimbalManagerStatus.id, now)
        self._device.poll(manager, now)

    def _taken_automatically(self, result: Result, now: float) -> None:
        if not result.success:
            self._emit(events.AutomaticTakeFailed(self.key, result.message))

    def next_deadline(self) -> float:
        """Return when :meth:`poll` is due, infinity if never."""
        manager = self._manager
        is_known = self._control.known is not None
        if self._connected and is_known and self._control.take_due:
            return -math.inf
        due = min(self._sources.next_deadline(), self._yaw_lock.next_deadline(),
                  manager.next_deadline())
        if is_known:
            due = min(due, manager.control_deadline())
        if self._connected:
            due = min(due, manager.liveness.silent_at, manager.status_query.due,
                      self._device.liveness.silent_at, self._device.next_deadline())
        return min(due, self._setpoints.next_deadline()) if self.in_control else due

    def snapshot(self, now: float) -> events.GimbalSnapshot:
        """Return the gimbal at this moment."""
        manager, device, sources = self._manager, self._device, self._sources
        information = manager.information
        return events.GimbalSnapshot(
            self.key, self.unreachable(now), self._managers.addresses, self._capabilities(),
            device.ranges or (known_ranges(information) if information else None),
            device.identity, device.attitude, device.attitude_at, device.problem, device.flags,
            device.errors, self._control.known, self._control.since, self.in_control,
            manager.status_at, manager.enforces_control, self._setpoints.sent,
            sources.shown_holder, sources.since)
