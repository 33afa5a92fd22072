# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""One gimbal: requests and setpoints of this component, and its control of the gimbal."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable
from dataclasses import dataclass
import math
from typing import Any

from . import events
from . import messages as gimbal
from .axes import known_ranges
from .commands import Flag, setpoint_flags
from .gimbal_reports import GimbalReports
from .gimbal_requests import (
    CONTROL,
    describe,
    GimbalRequests,
    PLACE,
    POSE,
    REQUEST_LIMIT,
    YAW_LOCK,
    YawLock,
)
from .repetition import Repetition
from .setpoint_stream import SetpointStream, SuspendedBy
from ..mavlink.command_sender import CommandSender
from ..mavlink.dialect import mavlink
from ..mavlink.messages import Address
from ..payload.attempt import Served
from ..payload.command_sources import DEFAULT, SourceSettings
from ..payload.device_events import DeviceHeld
from ..payload.messages import GeoPoint, GimbalDeviceAttitudeStatus
from ..payload.mount_attitude import STILL, Wxyz, YawFrame
from ..payload.requests import Done, Request, Requests, Result, Why
from ..payload.rotation import Quaternion, Vector

# s for which a release of control waits until an attitude shows that the gimbal stands; and at the
# end of the process, which has less than a second.
STOP_LIMIT, STOP_LIMIT_AT_END = 5.0, 0.45
# rad; the largest difference of a reported attitude that shows the sent attitude.
SHOWN_ANGLE = 0.02


SUSPENDED_BY = {POSE: SuspendedBy.POSE, PLACE: SuspendedBy.PLACE}


def wish(field: str, value: Any) -> str:
    """Return what a request asks for, for people."""
    if field == CONTROL:
        return 'take control' if value else 'release control'
    return describe({field: value}) if field == PLACE else str(value.wish)


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


class Gimbal:
    """
    One gimbal device, for a component that may control it; in the link's thread.

    Every change but control itself needs primary control, which GIMBAL_MANAGER_STATUS must show.

    :param manager: has announced it.
    :param emit: takes its events.
    :ivar was_commanded: whether a user has ever sent it a request or a setpoint.
    :ivar requests: for poses, places and the yaw lock, and the claims of their sources.
    :ivar setpoints: of this component.
    :ivar reports: of its managers and its device; :meth:`update` follows each change of them.
    """

    def __init__(
        self, key: events.GimbalKey, manager: Address, commands: CommandSender,
        settings: GimbalSettings, emit: Callable[[events.GimbalEvent], None],
    ) -> None:
        self.key = key
        self.was_commanded = False
        self.reports = GimbalReports(key, manager, commands, settings.attitude_interval, emit)
        self.requests = Requests(
            f'gimbal {key}', settings.sources, describe,
            lambda change, now: emit(DeviceHeld(key, change)))
        self._commands = commands
        self._settings = settings
        self._emit = emit
        self._commanded = GimbalRequests(key, manager, commands, self.requests, self.poll)
        self.setpoints = SetpointStream(
            self._message, commands.send, settings.setpoint_timeout,
            lambda stands: emit(events.RateStopped(key, stands, self.setpoints.rate_stop.turns)))
        self._yaw_lock = YawLock(self.requests, self.setpoints.hold)
        self._repetition = Repetition()
        # Whether control must be taken as soon as no component has it.
        self._take_due = False
        # Whether a request for control is under way, or was neither refused nor confirmed.
        self._may_have_control = False

    # Reports

    @property
    def lost_at(self) -> float:
        """Return when it was last heard, s."""
        return self.reports.heard_at

    def components_lost(self, lost: Collection[Address], now: float, reason: str) -> None:
        """Record that some components cannot be reached, and the reason."""
        if self.reports.lose(lost, now, reason):
            self._repetition.forget()
            self._end(reason, now, YAW_LOCK)
        if self.reports.manager.address in lost:
            self._end(reason, now, CONTROL, POSE, PLACE)
        self.update(now)
        self._step(now)

    def take_status(
        self, source: Address, status: gimbal.GimbalManagerStatus, now: float,
    ) -> None:
        """Take GIMBAL_MANAGER_STATUS of the gimbal."""
        manager = self.reports.announce(source, now)
        if manager is not None and manager.take_status(status, now):
            self.update(now)
            if manager is self.reports.manager:
                self._step(now, self._commanded.reported(CONTROL, status, now))
            else:
                self._step(now)

    def take_attitude(self, status: GimbalDeviceAttitudeStatus, now: float) -> None:
        """Take GIMBAL_DEVICE_ATTITUDE_STATUS of the device."""
        device, setpoints = self.reports.device, self.setpoints
        if not device.take_status(status, now):
            return
        self.update(now)
        self._step(now, self._commanded.reported(POSE, status, now))
        self._yaw_lock.reported(status, now)
        setpoints.reported(status, now)
        if not setpoints.may_turn:
            self._commanded.release_now(now)
        self._step(now)
        self._emit(events.AttitudeReceived(
            self.key, device.attitude, device.flags, device.errors))

    def update(self, now: float) -> None:
        """Follow changes of the manager, of the connection, and of control."""
        self._commands.schedule.by(self.poll, now)
        reports, setpoints = self.reports, self.setpoints
        if reports.choose(now):
            self._end('the manager was lost', now, CONTROL, POSE, PLACE)
            self._step(now)
            self._commanded = GimbalRequests(
                self.key, reports.manager.address, self._commands, self.requests, self.poll)
        if reports.connect(now):
            self._repetition.forget()
            self._take_due = self._settings.auto_take_control
        is_first = reports.last_control is None
        if not reports.update_control(now, is_releasing=bool(self._commanded.releases),
                                      may_turn=setpoints.may_have_rate):
            return
        self._repetition.forget()
        if not reports.in_control:
            self._end(self.unavailable(now), now, YAW_LOCK)
        if reports.control is None:
            # The manager that had shown this component in control takes the zero.
            manager = reports.manager
            setpoints.control_unknown(now, can_send=(
                not reports.link_problem and manager.control is not None
                and manager.control.primary == self._commands.address))
        elif is_first or not reports.in_control:
            setpoints.control_changed(now, is_lost=not reports.in_control)

    # Control

    @property
    def has_any_control(self) -> bool:
        """Whether this component has primary or secondary control, as far as it is known."""
        control = self.reports.control
        return self._may_have_control or (
            control is not None and control.includes(self._commands.address))

    def unavailable(self, now: float) -> str:
        """Return why the gimbal cannot be commanded now, for people; '' if it can."""
        return (self._commands.refusal or self._commands.lateness(now)
                or self.reports.lack_of_control(now)
                or (f'control of gimbal {self.key} is being released'
                    if self._commanded.releases else ''))

    def _begin(self, now: float) -> None:
        """Begin a request or a setpoint of a user, which may come before the poll that is due."""
        self.was_commanded = True
        # A later setpoint or request must not be undone.
        self._yaw_lock.stop_resending()
        self.update(now)

    def take_control(self, now: float, done: Done) -> None:
        """Take primary control; succeed only if GIMBAL_MANAGER_STATUS shows it."""
        self._begin(now)
        if reason := self._commands.lateness(now):
            done(Result(False, reason), now)
        else:
            self._request_control(True, now, done)

    def release_control(self, now: float, done: Done) -> None:
        """
        Stop, and release control.

        It succeeds only if an attitude shows that the gimbal stands, and GIMBAL_MANAGER_STATUS
        that control is released. The end of the process does not wait for that attitude.
        """
        self._begin(now)
        # Nothing that comes after the zero may turn the gimbal, as ArduPilot would let it.
        may_turn, due = self.setpoints.may_turn, -math.inf
        self._end_commands('superseded by a release of control', now, superseded=True)
        reports = self.reports
        if may_turn and reports.may_have_control and reports.manager.liveness.is_heard(now):
            # No command stops a gimbal everywhere: PX4 reads unset angles as 0.
            self.setpoints.set_rates(STILL, now)
            due = now + (STOP_LIMIT_AT_END if self._commands.refusal else STOP_LIMIT)
        self._request_control(False, now, done, due=due)

    def _request_control(
        self, take: bool, now: float, done: Done, *, due: float = -math.inf,
    ) -> None:
        control = self.reports.control
        if refusal := (self._commands.refusal if take else '') or self.reports.absence(now):
            done(Result(False, refusal), now)
        elif not take and control is not None and not self.has_any_control:
            # PX4 would take the system id from another component of our system.
            done(_with_stop(self.setpoints, Result(True, f'not in control: {control}')), now)
        else:
            self._may_have_control |= take
            self._commanded.request_control(
                take, now, done, due=due, is_end=bool(self._commands.refusal))
        self._step(now)

    def _step(self, now: float, ended: Iterable[Served[Any]] = ()) -> None:
        """
        Send what is wanted, and answer those whose requests have ended.

        :param ended: the requests that a command has ended.
        """
        for served in ended:
            self._end_one(served.request, served.result, now)
        if not self._commands.refusal and self.setpoints.may_turn:
            for one in self._commanded.releases:
                if -math.inf < one.due <= now and not one.is_served:
                    self._end_one(one, Result(
                        False, f'{self.setpoints.lack_of_stop}, {STOP_LIMIT:g} s after a rate of '
                        'zero: control is kept, and the zero is sent again'), now)
        for served in self._commanded.step(now):
            self._end_one(served.request, served.result, now)
        self._yaw_lock.step(now)
        self.requests.answer(now)
        self._commanded.control.answer(now)
        self._set_due()

    def _end_one(self, one: Request, result: Result, now: float) -> None:
        (field, value), = one.values.items()
        if field in (POSE, PLACE):
            self.setpoints.request_ended(SUSPENDED_BY[field], result, now)
        elif field == CONTROL:
            if result.success or result.refused and value:
                self._may_have_control = False
            if not value:
                result = _with_stop(self.setpoints, result)
            elif result.success and not self.reports.manager.enforces_control:
                result = result._replace(message=f'{result.message}; ArduPilot also obeys '
                                                 'components without control')
        if result.refused:
            result = self.reports.explained(result, wish(field, value), now)
        (self._commanded.control if field == CONTROL else self.requests).end(one, result, now)

    def _end(self, message: str, now: float, *fields: str, superseded: bool = False) -> None:
        """End the open requests for some fields."""
        result = Result(False, message, superseded=superseded)
        for one in (*self.requests.standing, *self._commanded.control.standing):
            if one.is_open and not one.values.keys().isdisjoint(fields):
                self._end_one(one, result, now)

    def close(self, now: float) -> None:
        """Answer all requests; :meth:`release_control` is still possible."""
        refusal = self._commands.refusal
        self._end(refusal, now, YAW_LOCK, CONTROL, POSE, PLACE, superseded=True)
        self.requests.close(Result(False, refusal, superseded=True), now)
        self._step(now)

    def change_settings(self, settings: GimbalSettings, now: float) -> None:
        """Take other settings: ``setpoint_timeout`` and the time-out of ``sources`` may differ."""
        self._settings = settings
        self.setpoints.change_timeout(settings.setpoint_timeout, now)
        if settings.sources:
            self.requests.claims.set_lease(settings.sources.timeout)
            self._expire(now)
        self._set_due()

    # Sources

    def claim(self, source: str, now: float, *, is_call: bool = False) -> str:
        """
        Let a source command the gimbal, and end what other sources have sent.

        A stream claims the gimbal at once, a call when it has succeeded.

        :return: why the source may not command the gimbal, '' if it may.
        """
        self._expire(now)
        requests = self.requests
        refusal = requests.refusal(source)
        if requests.are_ranked and not refusal and requests.commander != source:
            self._end_commands(f'held by {source}', now)
        if not is_call:
            requests.claim(source, now)
            self._set_due()
        return refusal

    def release(self, source: str, now: float) -> str:
        """
        Release the gimbal: the next lower source that has claimed it then holds it.

        :return: the source that holds it now, '' if none does.
        """
        self._expire(now)
        if self.requests.are_ranked and source == self.requests.commander:
            self._end_commands(f'{source} has released the gimbal', now)
        self.requests.release(source, now)
        self._step(now)
        return self.requests.shown_holder or ''

    def _expire(self, now: float) -> None:
        """End the hold of a source that was silent."""
        before = self.requests.claims.holder
        change = self.requests.expire(now)
        # The call of a higher source may be under way.
        if change is not None and before is not None and not self.requests.refusal(before):
            self._end_commands(f'the hold of {before} has ended (source_timeout)', now)

    def _end_commands(self, message: str, now: float, *, superseded: bool = False) -> None:
        """End the setpoint, and the requests that may turn the gimbal or stop it later."""
        self._repetition.forget()
        self.setpoints.end(now)
        self._end(message, now, POSE, PLACE, YAW_LOCK, superseded=superseded)
        self._step(now)

    # Requests

    def set_flag(
        self, flag: Flag, now: float, done: Done, *, source: str = DEFAULT,
    ) -> None:
        """Turn to a pose; or stop, and lock or unlock the yaw (GM-3)."""
        self._begin(now)
        self._repetition.forget()
        message = f'superseded by {flag.goal}'
        if reason := (self.claim(source, now, is_call=True) or self.unavailable(now)
                      or self.reports.missing(flag.needed)):
            done(Result(False, reason), now)
            return
        if flag.is_pose:
            self._end(message, now, PLACE, YAW_LOCK, superseded=True)
            self.setpoints.suspend(now, SuspendedBy.POSE)
        else:
            self._end(message, now, POSE, PLACE, superseded=True)
        until = now + REQUEST_LIMIT if flag.is_pose else math.inf
        self.requests.put(Request(
            {POSE if flag.is_pose else YAW_LOCK: flag}, Why.REQUEST, now, source, done,
            is_call=True, until=until), now)
        self._step(now)

    def set_roi(
        self, place: GeoPoint | None, now: float, done: Done, *, is_stream: bool = False,
        source: str = DEFAULT,
    ) -> None:
        """
        Point at a place, or at none.

        :param is_stream: whether its publisher repeats it, so that a newer one replaces it. An
            equal one is sent once a second, as no status shows it, and else not answered.
        """
        self._begin(now)
        if reason := self.claim(source, now, is_call=True) or self.unavailable(now):
            done(Result(False, reason), now)
            return
        if not is_stream:
            self._repetition.forget()
        elif self._repetition.is_needless(place, now, is_shown=False, moves=False):
            return
        self.setpoints.suspend(now, SuspendedBy.PLACE, is_place=place is not None)
        self.requests.put(Request(
            {PLACE: place}, Why.REQUEST, now, source, done, is_call=not is_stream,
            until=now + REQUEST_LIMIT), now)
        self._step(now)

    # Setpoints

    def set_attitude(self, rotation: Quaternion, frame: YawFrame, now: float) -> str:
        """
        Send an attitude, unless it equals the one before and the gimbal shows it.

        :param rotation: with norm 1, from the FLU axes of the gimbal as in
            :class:`~..payload.mount_attitude.MountAttitude`.
        :return: why it was not sent, for people; '' if it was.
        """
        self._begin(now)
        reason = self.unavailable(now) or (self.reports.missing(
            mavlink.GIMBAL_DEVICE_CAP_FLAGS_HAS_YAW_LOCK,
            mavlink.GIMBAL_DEVICE_CAP_FLAGS_SUPPORTS_YAW_IN_EARTH_FRAME,
        ) if frame is YawFrame.EARTH else '')
        attitude = self.reports.device.attitude
        shown = None if attitude is None else attitude.seen_from(frame)
        # Angles that leave an axis as it is have rounded values.
        if not reason and not self._repetition.is_needless(
                (*(round(one, 6) for one in rotation), frame), now,
                is_shown=shown is not None and shown.angle_to(rotation) < SHOWN_ANGLE,
                moves=self.setpoints.rate_stop.turns is not False):
            self._end('superseded by a setpoint', now, POSE, PLACE, superseded=True)
            self._step(now)
            self.setpoints.set_attitude(rotation, frame, now)
            self._set_due()
        return reason

    def set_angles(self, angles: Vector, frame: YawFrame, now: float) -> str:
        """
        Send an attitude as roll, pitch and yaw in ROS, rad; NaN leaves an axis as it is.

        Such an axis keeps its angle in the last sent attitude, else its reported angle.

        :return: why it was not sent, for people; '' if it was.
        """
        if any(map(math.isnan, angles)):
            self._begin(now)
            if reason := self.unavailable(now):
                return reason
            base, attitude = self.setpoints.attitude(frame), self.reports.device.attitude
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
        self._begin(now)
        reason = self.unavailable(now)
        if not reason:
            self._repetition.forget()
            self._end('superseded by a setpoint', now, POSE, PLACE, superseded=True)
            self._step(now)
            self.setpoints.set_rates(rates, now)
            self._set_due()
        return reason

    def _message(
        self, frame: YawFrame, q: Wxyz, rates: Vector,
    ) -> gimbal.GimbalManagerSetAttitude:
        flags = setpoint_flags(frame)
        if self.reports.missing(mavlink.GIMBAL_DEVICE_CAP_FLAGS_HAS_YAW_LOCK):
            flags &= ~mavlink.GIMBAL_DEVICE_FLAGS_YAW_LOCK
        return gimbal.GimbalManagerSetAttitude(
            *self.reports.manager.address, flags, self.key.device_id, q, *rates)

    # Time

    def poll(self, now: float) -> None:
        """Do everything that is due."""
        def taken(result: Result, now: float) -> None:
            if not result.success:
                self._emit(events.AutomaticTakeFailed(self.key, result.message))

        self.update(now)
        self._expire(now)
        self._yaw_lock.poll(now)
        self._step(now, self._commanded.poll(now))
        if self.reports.in_control:
            self.setpoints.poll(now, may_stop=not self._commanded.may_turn)
        control = self.reports.control
        if self._take_due and self.reports.is_connected and control is not None:
            self._take_due = False
            if control.primary is None:
                self._request_control(True, now, taken)
        self.reports.poll(now)
        self._set_due()

    def _set_due(self) -> None:
        """Have :meth:`poll` called when it is due."""
        reports = self.reports
        if self._take_due and reports.is_connected and reports.control is not None:
            due = -math.inf
        else:
            due = min(self.requests.claims.due, self._yaw_lock.due, self._commanded.due,
                      reports.due, self.setpoints.due(may_stop=not self._commanded.may_turn)
                      if reports.in_control else math.inf)
        self._commands.schedule.at(self.poll, due)

    def snapshot(self, now: float) -> events.GimbalSnapshot:
        """Return the gimbal at this moment."""
        reports, device, requests = self.reports, self.reports.device, self.requests
        manager, information = reports.manager, reports.manager.information
        is_free = reports.control is None or reports.control.primary in (
            None, self._commands.address)
        return events.GimbalSnapshot(
            self.key, reports.unreachable(now), reports.heard_managers, reports.capabilities,
            device.ranges or (known_ranges(information) if information else None),
            device.identity, device.attitude, device.attitude_at, device.problem, device.flags,
            device.errors, reports.control, reports.control_since, self.reports.in_control,
            manager.status_at, manager.enforces_control, self.setpoints.sent,
            self.setpoints.has_place, self.setpoints.unstopped_since if is_free else None,
            self.setpoints.rate_stop.turns,
            requests.shown_holder, requests.claims.since)


def _with_stop(setpoints: SetpointStream, result: Result) -> Result:
    """Return the result of a release of control, which names a gimbal that may still turn."""
    if result.success and setpoints.may_turn:
        return result._replace(message=f'{result.message}; {setpoints.lack_of_stop}')
    return result
