# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

r"""
One gimbal, and how a request to it becomes a message and is stopped again.

It has the parts of a light (:mod:`~..illuminator.light`), with two tables of requests::

    move, yaw lock -> requests \
                                newest -> Property -> commands: control, a pose, a place
    control        -> control  /      \-> SetpointStream -> messages: setpoints, a zero
    status, acknowledgement, deadline -> Requests.end, SetpointStream.followed

**Wanted.** A :data:`~.commands.Move` is one field: a pose, a place or none, an attitude, or rates.
A newer move ends the older one, whatever served it; only a place of a topic waits for the place
that is under way. An attitude stays open until another request ends it, a rate until its time-out.
The yaw lock is a field of its own, since setpoints may go on while it is awaited; it ends the move
and stops the gimbal. All sources need control, so its table has no sources. When the hold of a
source ends, its requests end: the next holder sends its own.

**Followed.** No status shows a setpoint or a place. :class:`~.setpoint_stream.SetpointStream`
keeps the move that the gimbal follows as far as is known. A refused move leaves it as it is; a
place without an answer may be followed.

**Sent.** :meth:`Gimbal._step` runs after each request, status and deadline. A rate that is no
longer wanted gets a zero, before the command that replaces it. Then
:class:`~.rate_stop.RateStop` sends the zero until an attitude shows that the gimbal stands:
nothing else would end a rate whose zero was lost. It waits while a command is under way that may
turn the gimbal, and ends with the success of such a command, with a new rate, or with control.

**Not solved well.** Two programs that share a source replace the moves of each other. A place that
was superseded may still be executed, after the request that replaced it.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable
from dataclasses import dataclass
import math
from typing import Any

from . import events
from . import messages as gimbal
from .axes import known_ranges
from .commands import Attitude, describe_flags, Flag, Move, point, Rates, SETPOINTS
from .gimbal_commands import CONTROL, GimbalCommands, POSE
from .gimbal_reports import GimbalReports
from .setpoint_stream import MOVE, SetpointStream, YAW_LOCK
from ..geometry.mount_attitude import YawFrame
from ..geometry.rotation import Quaternion, Vector
from ..mavlink.command_sender import CommandSender
from ..mavlink.dialect import mavlink
from ..mavlink.durations import format_seconds
from ..mavlink.messages import Address
from ..payload.attempt import Served
from ..payload.command_sources import DEFAULT, SourceSettings
from ..payload.device_events import DeviceHeld
from ..payload.messages import GeoPoint, GimbalDeviceAttitudeStatus
from ..payload.requests import Done, Goal, REPEAT_TIME, Request, Requests, Result, Values, Why

# s; the limits of requests for a pose, a place or control, and for the yaw lock. A release of
# control waits as long until an attitude shows that the gimbal stands, and at the end of the
# process, which has less than a second, for the last time.
REQUEST_LIMIT, LOCK_LIMIT, STOP_LIMIT_AT_END = 5.0, 2.0, 0.45
# s by which a status may be late: one that shows the lock sooner may be older than the request.
STATUS_DELAY = 0.2
# rad; the largest difference of a reported attitude that shows the sent attitude.
SHOWN_ANGLE = 0.02
# The result of a setpoint, which is not acknowledged.
SENT = Result(True, 'sent')


def describe(values: Values) -> str:
    """Describe the values of a request, for people."""
    (field, value), = values.items()
    if field == CONTROL:
        return 'take control' if value else 'release control'
    if isinstance(value, SETPOINTS):
        return 'a setpoint'
    return value.wish if isinstance(value, Flag) else point(0, value).label


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
    :ivar requests: for a move and for the yaw lock, and the claims of their sources.
    :ivar control: the requests for control, which have no source: all sources need it.
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
        self.control = Requests(f'gimbal {key}', None, describe)
        self._commands = commands
        self._settings = settings
        self._emit = emit
        self._commanded = GimbalCommands(key, manager, commands, self.poll)
        self.setpoints = SetpointStream(
            key, self.reports, commands.send,
            lambda stands: emit(events.RateStopped(key, stands, self.setpoints.rate_stop.turns)))
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
            self._end(reason, now, CONTROL, MOVE, YAW_LOCK)
        self.update(now)
        self._step(now)

    def receive_status(
        self, source: Address, status: gimbal.GimbalManagerStatus, now: float,
    ) -> None:
        """Receive GIMBAL_MANAGER_STATUS of the gimbal."""
        manager = self.reports.announce(source, now)
        if manager is not None and manager.receive_status(status, now):
            self.update(now)
            self._step(now, self._commanded.reported(CONTROL, status, now)
                       if manager is self.reports.manager else ())

    def receive_attitude(self, status: GimbalDeviceAttitudeStatus, now: float) -> None:
        """Receive GIMBAL_DEVICE_ATTITUDE_STATUS of the device."""
        device, setpoints = self.reports.device, self.setpoints
        if not device.receive_status(status, now):
            return
        self.update(now)
        self._step(now, self._commanded.reported(POSE, status, now))
        for one in self.requests.live():
            lock = one.values.get(YAW_LOCK)
            if lock is not None and now >= one.since + STATUS_DELAY and lock.is_shown(status):
                self._end_one(one, Result(True, (
                    f'{lock.goal}, confirmed by {status.msgname} '
                    f'({format_seconds(now - one.since)})')), now)
        setpoints.reported(status, now)
        for one in self._releases:
            if not setpoints.may_turn and one.not_before > now:
                one.not_before, one.deadline = now, now + REQUEST_LIMIT
        self._step(now)
        self._emit(events.AttitudeReceived(
            self.key, device.attitude, device.flags, device.errors))

    def update(self, now: float) -> None:
        """Follow changes of the manager, of the connection, and of control."""
        self._commands.schedule.by(self.poll, now)
        reports, setpoints = self.reports, self.setpoints
        if reports.choose(now):
            self._end('the manager was lost', now, CONTROL, MOVE)
            self._step(now)
            self._commanded = GimbalCommands(
                self.key, reports.manager.address, self._commands, self.poll)
        if reports.connect(now):
            for one in self.requests.standing:
                one.may_be_repeated = False
            self._take_due = self._settings.auto_take_control
        is_first = reports.last_control is None
        if not reports.update_control(now, is_releasing=bool(self._releases),
                                      may_turn=setpoints.may_have_rate):
            return
        if not reports.in_control:
            self._end(self.unavailable(now), now, MOVE, YAW_LOCK)
        if reports.control is None:
            if setpoints.may_have_rate:
                # The manager that had shown this component in control takes the zero.
                manager = reports.manager
                setpoints.stop(now, can_send=(
                    not reports.link_problem and manager.control is not None
                    and manager.control.primary == self._commands.address))
        elif is_first or not reports.in_control:
            setpoints.control_changed(now, is_ours=reports.in_control)

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
                    if self._releases else ''))

    def _begin(self, now: float) -> None:
        """Begin a request or a setpoint of a user, which may come before the poll that is due."""
        self.was_commanded = True
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
        reports, due = self.reports, -math.inf
        if (self.setpoints.may_turn and (reports.control is None or reports.in_control)
                and reports.manager.liveness.is_heard(now)):
            # No command stops a gimbal everywhere: PX4 reads unset angles as 0.
            self.setpoints.stop(now, can_send=True)
            due = now + STOP_LIMIT_AT_END if self._commands.refusal else math.inf
        # Nothing that comes after the zero may turn the gimbal, as ArduPilot would let it.
        self._end_commands('superseded by a release of control', now, superseded=True)
        self._request_control(False, now, done, not_before=due)

    def _request_control(
        self, take: bool, now: float, done: Done, *, not_before: float = -math.inf,
    ) -> None:
        control, refusal = self.reports.control, self._commands.refusal
        new = Request(
            {CONTROL: take}, Why.END if refusal else Why.REQUEST, now, done=done, is_call=True,
            not_before=not_before, deadline=now + REQUEST_LIMIT,
            detail=f'superseded by {describe({CONTROL: take})}')
        if reason := (refusal if take else '') or self.reports.absence(now):
            self._end_one(new, Result(False, reason), now)
        elif not take and control is not None and not self.has_any_control:
            # PX4 would take the system id from another component of our system.
            self._end_one(new, Result(True, f'not in control: {control}'), now)
        else:
            self._may_have_control |= take
            self.control.put(new, now)
        self._step(now)

    @property
    def _releases(self) -> list[Request]:
        """Return the requests to release control."""
        return [one for one in self.control.live() if not one.values[CONTROL]]

    def _step(self, now: float, ended: Iterable[Served[Any]] = ()) -> None:
        """
        Send what is wanted, and answer those whose requests have ended.

        :param ended: the requests that a command has ended.
        """
        for served in ended:
            self._end_one(served.request, served.result, now)
        live, control = self.requests.live(), self.control.live()
        newest = live[-1] if live else None
        # The zero that ends a rate comes before the command of a pose or a place.
        self.setpoints.begin(newest, now, can_send=self.reports.in_control)
        if newest is not None and isinstance(newest.values.get(MOVE), SETPOINTS):
            self.requests.reply(newest, SENT)
        for served in self._commanded.step(Goal.strongest(control, CONTROL, now),
                                           Goal.strongest(live, MOVE, now), now):
            self._end_one(served.request, served.result, now)
        self.requests.send_replies(now)
        self.control.send_replies(now)
        self._set_due(now)

    def _end_one(self, one: Request, result: Result, now: float) -> None:
        (field, value), = one.values.items()
        if field == MOVE and not isinstance(value, SETPOINTS):
            self.setpoints.ended(value, result)
        elif field == CONTROL:
            if result.success or result.refused and value:
                self._may_have_control = False
            note = ('' if not result.success else self.setpoints.lack_of_stop if not value else
                    '' if self.reports.manager.enforces_control else
                    'ArduPilot also obeys components without control')
            if note:
                result = result._replace(message=f'{result.message}; {note}')
        if result.refused:
            result = self.reports.explained(result, describe(one.values), now)
        (self.control if field == CONTROL else self.requests).end(one, result, now)

    def _end(self, message: str, now: float, *fields: str, superseded: bool = False) -> None:
        """End the open requests for some fields."""
        result = Result(False, message, superseded=superseded)
        for one in self.requests.standing + self.control.standing:
            if one.is_open and not one.values.keys().isdisjoint(fields):
                self._end_one(one, result, now)

    def close(self, now: float) -> None:
        """Answer all requests; :meth:`release_control` is still possible."""
        refusal = self._commands.refusal
        self._end(refusal, now, YAW_LOCK, CONTROL, MOVE, superseded=True)
        self.requests.close(Result(False, refusal, superseded=True), now)
        self._step(now)

    def change_settings(self, settings: GimbalSettings, now: float) -> None:
        """Take other settings: ``setpoint_timeout`` and the time-out of ``sources`` may differ."""
        self._settings = settings
        for one in self.requests.live():
            if isinstance(one.values.get(MOVE), Rates):
                one.deadline = min(one.deadline, now + settings.setpoint_timeout)
        if settings.sources:
            self.requests.claims.set_lease(settings.sources.timeout)
            self._expire(now)
        self._set_due(now)

    # Sources

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
        """End the requests that may turn the gimbal or stop it later, and a rate or a place."""
        has_place = self.setpoints.has_place
        self._end(message, now, MOVE, YAW_LOCK, superseded=superseded)
        self._step(now)
        if has_place:
            self.setpoints.stop(now, can_send=self.reports.in_control)

    # Requests

    @property
    def wanted_move(self) -> Move:
        """Return the move that is wanted, else the one that the gimbal follows; None for none."""
        return self.setpoints.wanted

    def request(
        self, wish: Move, now: float, done: Done, *, is_call: bool = True, source: str = DEFAULT,
    ) -> None:
        """
        Ask for a move, or for the yaw lock, which stops the gimbal (GM-3).

        A setpoint is sent at once. A place of a topic waits for the place that is under way.

        :param is_call: whether a caller waits for the result; else a topic asks for it.
        """
        self._begin(now)
        self._expire(now)
        requests = self.requests
        held = requests.refusal(source)
        if requests.are_ranked and not held and requests.commander != source:
            self._end_commands(f'held by {source}', now)
        if not is_call:
            requests.claim(source, now)
        if reason := held or self.unavailable(now) or self.reports.missing(*_needed(wish)):
            done(Result(False, reason), now)
            return
        is_lock = isinstance(wish, Flag) and not wish.is_pose
        limit = (self._settings.setpoint_timeout if isinstance(wish, Rates) else
                 math.inf if isinstance(wish, Attitude) else
                 LOCK_LIMIT if is_lock else REQUEST_LIMIT)
        new = Request({YAW_LOCK if is_lock else MOVE: wish}, Why.REQUEST, now, source, done,
                      is_call, deadline=now + limit)
        if not is_call and self._is_repetition(new, now):
            done(Result(False, 'repeated', superseded=True), now)
            return
        result = Result(False, f'superseded by {describe(new.values)}', superseded=True)
        for old in requests.standing[:]:
            if old.is_open and _ends(new, old):
                self._end_one(old, result, now)
        requests.put(new, now)
        self._step(now)

    def _is_repetition(self, new: Request, now: float) -> bool:
        """Return whether a message of a topic asks for nothing new."""
        old, move = self.requests.repeated(new), new.values[MOVE]
        if old is None or isinstance(move, Rates) or self.wanted_move != move:
            return False
        is_shown = False
        if isinstance(move, Attitude):
            if self.setpoints.rate_stop.turns is not False:
                return False
            shown = self.reports.device.seen_from(move.frame)
            is_shown = shown is not None and shown.angle_to(move.rotation) < SHOWN_ANGLE
        return is_shown or now < old.since + REPEAT_TIME

    def set_angles(
        self, angles: Vector, frame: YawFrame, now: float, done: Done, *, source: str = DEFAULT,
    ) -> None:
        """
        Ask for an attitude as roll, pitch and yaw in ROS, rad; NaN leaves an axis as it is.

        Such an axis keeps its angle in the last sent attitude, else its reported angle.
        """
        if any(map(math.isnan, angles)):
            last = self.setpoints.followed
            base = (last.rotation if isinstance(last, Attitude) and last.frame is frame
                    else self.reports.device.seen_from(frame))
            if base is None:
                done(Result(False, self.unavailable(now) or (
                    f'gimbal {self.key} has not reported its attitude with a yaw relative to the '
                    f'{frame.value}, so no axis can be left as it is')), now)
                return
            # Rounded, so that the next message asks for the same attitude.
            roll, pitch, yaw = (round(old, 6) if math.isnan(new) else new
                                for new, old in zip(angles, base.euler(), strict=True))
            angles = roll, pitch, yaw
        self.request(Attitude(Quaternion.from_euler(*angles), frame), now, done, is_call=False,
                     source=source)

    # Time

    def poll(self, now: float) -> None:
        """Do everything that is due."""
        def taken(result: Result, now: float) -> None:
            if not result.success:
                self._emit(events.AutomaticTakeFailed(self.key, result.message))

        self.update(now)
        self._expire(now)
        for one in self.requests.overdue(now) + self.control.overdue(now):
            self._end_one(one, self._out_of_time(one, now), now)
        self._step(now, self._commanded.poll(now))
        if self.reports.in_control:
            self.setpoints.poll(now, may_stop=not self._commanded.may_move)
        control = self.reports.control
        if self._take_due and self.reports.is_connected and control is not None:
            self._take_due = False
            if control.primary is None:
                self._request_control(True, now, taken)
        self.reports.poll(now)
        self._set_due(now)

    def _out_of_time(self, one: Request, now: float) -> Result:
        """Return the result of a request that has ended without a command."""
        (field, value), = one.values.items()
        if field == CONTROL:
            state = (self.reports.lack_of_control(now)
                     or 'control is kept, and the zero is sent again')
            return Result(False, f'{self.setpoints.lack_of_stop}, {REQUEST_LIMIT:g} s after a '
                          f'rate of zero: {state}')
        if field == MOVE:
            return SENT if isinstance(value, SETPOINTS) else Result(
                False, f'{describe(one.values)}: not sent, an earlier command was under way')
        device, name = self.reports.device, GimbalDeviceAttitudeStatus.msgname
        shown = (f'{name} shows {describe_flags(device.flags)}'
                 if device.attitude_at >= one.since + STATUS_DELAY else f'no {name} came')
        advice = '; the device may need the heading of the vehicle' if value.is_set else ''
        return Result(
            False, f'{value.goal} not confirmed: {shown} within {LOCK_LIMIT:g} s{advice}')

    def _set_due(self, now: float) -> None:
        """Have :meth:`poll` called when it is due."""
        reports = self.reports
        if self._take_due and reports.is_connected and reports.control is not None:
            due = -math.inf
        else:
            due = min(self.requests.next_due(now), self.control.next_due(now),
                      self._commanded.due, reports.due,
                      self.setpoints.due(may_stop=not self._commanded.may_move)
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


def _needed(wish: Move) -> tuple[int, ...]:
    """Return the capabilities of which a gimbal must have one."""
    if isinstance(wish, Attitude) and wish.frame is YawFrame.EARTH:
        return (mavlink.GIMBAL_DEVICE_CAP_FLAGS_HAS_YAW_LOCK,
                mavlink.GIMBAL_DEVICE_CAP_FLAGS_SUPPORTS_YAW_IN_EARTH_FRAME)
    return (wish.needed if isinstance(wish, Flag) else 0,)


def _ends(new: Request, old: Request) -> bool:
    """Return whether a request for a move or the yaw lock ends an older one."""
    (field, wish), (old_field, before) = *new.values.items(), *old.values.items()
    if old_field == YAW_LOCK:
        return field == MOVE and not isinstance(wish, SETPOINTS)
    # Of places of a topic the newest is sent when one has ended.
    waits = not new.is_call and isinstance(wish, GeoPoint) and isinstance(before, GeoPoint)
    return wish != before and not waits
