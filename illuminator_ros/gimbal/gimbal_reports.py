# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The reports on a gimbal: of the managers that announce it, and of its device."""

from __future__ import annotations

from collections.abc import Callable, Collection
import math

from . import events
from . import messages as gimbal
from .axes import known_ranges, Ranges
from .commands import Control
from ..geometry.mount_attitude import MountAttitude, YawFrame
from ..geometry.rotation import Quaternion
from ..mavlink.command_sender import Command, CommandResult, CommandSender, request_message
from ..mavlink.dialect import mavlink, short_names
from ..mavlink.durations import format_seconds
from ..mavlink.messages import Address, result_name
from ..mavlink.retries import Retries, RetryPolicy
from ..payload.device_events import DeviceConnected, DeviceDisconnected
from ..payload.liveness import Liveness
from ..payload.messages import GimbalDeviceAttitudeStatus
from ..payload.requests import Result

GIMBAL_MESSAGE = RetryPolicy('a message of a gimbal or its manager', 1.0, 60.0)
# s of silence after which a manager or a device is lost.
SILENCE_LIMIT = 3.0
# s since the last GIMBAL_MANAGER_STATUS after which it is requested (ArduPilot does not stream it,
# PX4 does every 2 s), before a manager with a heartbeat each 5 s is lost; and after which control
# is unknown.
STATUS_REQUEST_DELAY, STATUS_LIMIT = 2.5, 6.0
# s without an attitude after which an interval is requested where none is configured, before the
# lack of attitudes is reported; and that interval.
ATTITUDE_REQUEST_DELAY, ATTITUDE_INTERVAL = 1.5, 0.2
# ms by which a status may be older than the one before it; with a longer step back, its sender has
# restarted.
LATE_LIMIT = 1000
# The most managers of one gimbal; further ones are ignored.
MAX_MANAGERS = 4


def _is_late(time_boot_ms: int, newest: int) -> bool:
    """Return whether a status is older than the newest one."""
    # The counter wraps.
    return 0 < (newest - time_boot_ms) % (1 << 32) < LATE_LIMIT


def _silence(what: str, liveness: Liveness, now: float) -> str:
    """Return that something is silent, for people."""
    age = now - liveness.heard_at
    return f'nothing from {what} for {format_seconds(age)}' if math.isfinite(age) else (
        f'{what} has not been heard')


class RemoteManager:
    """
    The reports of one manager of a gimbal. Times are s.

    :ivar autopilot: MAV_AUTOPILOT, None while unknown; likewise ``information``.
    :ivar control: the components in control in its last status.
    """

    def __init__(self, address: Address) -> None:
        self.address = address
        self.liveness = Liveness(SILENCE_LIMIT)
        self.status_at = -math.inf
        self.autopilot: int | None = None
        self.information: gimbal.GimbalManagerInformation | None = None
        self.control: Control | None = None
        self.status_query = Retries(GIMBAL_MESSAGE)
        self._status_time = 0

    @property
    def enforces_control(self) -> bool:
        """Whether it refuses components without control, as far as it is known."""
        return self.autopilot != mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA

    def known_control(self, now: float) -> Control | None:
        """Return the components in control, None if they are not known."""
        is_known = self.liveness.is_heard(now) and now < self.status_at + STATUS_LIMIT
        return self.control if is_known else None

    def lack_of_status(self, now: float) -> str:
        """Return that its status is missing, for people."""
        text = f'manager {self.address} has sent no GIMBAL_MANAGER_STATUS'
        age = now - self.status_at
        return f'{text} for {format_seconds(age)}' if math.isfinite(age) else text

    def receive_status(self, status: gimbal.GimbalManagerStatus, now: float) -> bool:
        """Receive a status; return whether it counts: late ones do not."""
        if _is_late(status.time_boot_ms, self._status_time):
            return False
        self._status_time = status.time_boot_ms
        self.status_at, self.control = now, Control.of(status)
        self.status_query = Retries(GIMBAL_MESSAGE, now + STATUS_REQUEST_DELAY)
        return True


class AttitudeRequest:
    """
    Requests GIMBAL_DEVICE_ATTITUDE_STATUS of a device that does not send it as configured.

    :param address: of the sender of the attitudes.
    :param interval: between attitudes, 0 for its own interval.
    :ivar refusal: the MAV_RESULT by which it has refused an interval, '' for none.
    """

    def __init__(self, address: Address, commands: CommandSender, interval: float) -> None:
        self.refusal = ''
        self._address = address
        self._commands = commands
        self._interval = interval
        self.connected(math.inf)

    @property
    def due(self) -> float:
        """Return when :meth:`poll` is due, s."""
        return self._query.due

    def connected(self, now: float) -> None:
        """Request the configured interval: the device may have restarted."""
        self._lacks_interval = bool(self._interval)
        self._query = Retries(GIMBAL_MESSAGE)
        self.expect(now)

    def expect(self, now: float) -> None:
        """Note that attitudes must come from now on."""
        if not self._lacks_interval:
            self._query.due = now + max(ATTITUDE_REQUEST_DELAY, 2.5 * self._interval)

    def received(self, now: float) -> None:
        """Note an attitude."""
        if not self._lacks_interval:
            self._query = Retries(GIMBAL_MESSAGE)
            self.expect(now)

    def poll(self, now: float) -> None:
        """Request an interval if that is due."""
        if self._query.begin_try(now):
            microseconds = (self._interval or ATTITUDE_INTERVAL) * 1e6
            self._commands.start(
                Command(self._address, mavlink.MAV_CMD_SET_MESSAGE_INTERVAL,
                        (float(GimbalDeviceAttitudeStatus.id), microseconds)), now,
                self._answered)

    def _answered(self, result: CommandResult, now: float) -> None:
        if result.result is not None:
            self.refusal = '' if result.accepted else result_name(result.result)
            self._lacks_interval = False
            due = self._query.due
            self.expect(now)
            # Without attitudes the waits between requests go on growing.
            self._query.due = max(self._query.due, due)


class RemoteDevice:
    """
    The reports of the device of a gimbal. Times are s.

    :param interval: between its attitudes; 0 for its own.
    :ivar without_id: of attitudes that may be those of another gimbal.
    :ivar problem: why the last status has no attitude, '' if it has one.
    :ivar request: of its attitudes; likewise ``identity_query``.
    """

    def __init__(self, address: Address, commands: CommandSender, interval: float) -> None:
        self.liveness, self.without_id = (
            Liveness(max(SILENCE_LIMIT, 2.5 * interval)) for _ in range(2))
        self.attitude_at = -math.inf
        self.attitude: MountAttitude | None = None
        self.problem = ''
        self.flags = self.errors = 0
        self.identity: events.DeviceIdentity | None = None
        self.ranges: Ranges | None = None
        self._status_time = 0
        self.request = AttitudeRequest(address, commands, interval)
        self.identity_query = Retries(GIMBAL_MESSAGE)

    def connected(self, now: float) -> None:
        """Request everything from now on: the device may have restarted."""
        self.identity_query = Retries(GIMBAL_MESSAGE)
        self.request.connected(now)

    def receive_information(self, message: gimbal.GimbalDeviceInformation) -> None:
        """Receive its identity and its ranges."""
        self.identity, self.ranges = events.DeviceIdentity.of(message), known_ranges(message)
        self.identity_query.stop()

    def receive_status(self, status: GimbalDeviceAttitudeStatus, now: float) -> bool:
        """Take its attitude and its flags; return whether the status counts: late ones do not."""
        self.liveness.hear(now)
        if _is_late(status.time_boot_ms, self._status_time):
            return False
        self._status_time, self.attitude_at = status.time_boot_ms, now
        self.request.received(now)
        self.flags, self.errors = status.flags, status.failure_flags
        try:
            self.attitude, self.problem = MountAttitude.from_status(status), ''
        except ValueError as error:
            self.attitude, self.problem = None, str(error)
        return True

    def seen_from(self, frame: YawFrame) -> Quaternion | None:
        """Return its rotation relative to a frame, None if it is not known."""
        return None if self.attitude is None else self.attitude.seen_from(frame)


class GimbalReports:
    """
    The reports on one gimbal: whether it is connected, and who controls it. Times are s.

    :param first: the manager that has announced the gimbal.
    :param interval: between attitudes of the device; 0 for its own.
    :param emit: takes the events.
    :ivar manager: the manager in use: the first that is heard, until it is lost.
    :ivar managers: each that has announced the gimbal, by address.
    :ivar control: the components in control, None if they are not known; likewise the last known
        ones, ``last_control``.
    :ivar control_since: when ``control`` changed last.
    :ivar link_problem: why components cannot be reached, for people; '' while they can.
    """

    def __init__(
        self, key: events.GimbalKey, first: Address, commands: CommandSender, interval: float,
        emit: Callable[[events.GimbalEvent], None],
    ) -> None:
        self.manager = RemoteManager(first)
        self.managers = {first: self.manager}
        self.device = RemoteDevice(key.address, commands, interval)
        self.is_connected = False
        self.control: Control | None = None
        self.last_control: Control | None = None
        self.control_since = 0.0
        self.link_problem = ''
        self._key = key
        self._us = commands.address
        self._commands = commands
        self._emit = emit
        self._announced_at = -math.inf
        self._others: set[Address] = set()

    # Reception

    def announce(self, address: Address, now: float) -> RemoteManager | None:
        """Note an announcement; return the manager, None if there are too many."""
        if self._announced_at == -math.inf:
            self.device.request.expect(now)
        self._announced_at = now
        if address not in self.managers and len(self.managers) < MAX_MANAGERS:
            self.managers[address] = RemoteManager(address)
        if manager := self.managers.get(address):
            manager.liveness.hear(now)
        return manager

    def heard(self, address: Address, now: float, autopilot: int) -> bool:
        """Take a heartbeat; return whether it is one of the device or of a manager."""
        if manager := self.managers.get(address):
            manager.liveness.hear(now)
            manager.autopilot = autopilot
        is_device = address == self._key.address and not self._key.number
        if is_device:
            self.device.liveness.hear(now)
        return is_device or manager is not None

    def lose(self, lost: Collection[Address], now: float, reason: str) -> bool:
        """Lose components at once; return whether requests cannot reach the gimbal any more."""
        for address in self.managers.keys() & lost:
            self.managers[address].liveness.lose(now)
        if self._key.address in lost:
            self.device.liveness.lose(now)
        is_cut = self._key.address in lost or self.manager.address in lost
        if is_cut:
            self.link_problem = reason
        return is_cut

    # Changes

    def choose(self, now: float) -> bool:
        """Use another manager if the used one is lost, and report further ones."""
        heard = [one for one in self.managers.values() if one.liveness.is_heard(now)]
        if not heard:
            return False
        before = self.manager
        if before not in heard:
            self.manager = heard[0]
            self._emit(events.ManagerChanged(self._key, before.address, self.manager.address))
        others = {one.address for one in heard} - {self.manager.address}
        for other in others - self._others:
            self._emit(events.SecondManager(self._key, self.manager.address, other))
        self._others = others
        return self.manager is not before

    def connect(self, now: float) -> bool:
        """Report a change of the connection; return whether the gimbal is connected by it."""
        reason = self.unreachable(now)
        if self.is_connected is not bool(reason):
            return False
        self.is_connected = not reason
        if reason:
            self._emit(DeviceDisconnected(self._key, reason))
            return False
        self.link_problem = ''
        self.device.connected(now)
        self._emit(DeviceConnected(self._key, f'manager {self.manager.address}'))
        return True

    def update_control(self, now: float, *, is_releasing: bool, may_turn: bool) -> bool:
        """
        Report a change of control; return whether it has changed.

        :param is_releasing: whether this component is releasing it.
        :param may_turn: whether the gimbal may turn at a rate of this component.
        """
        before, control = self.last_control, self.manager.known_control(now)
        if control == self.control:
            return False
        self.control, self.control_since = control, now
        self.last_control = control or before
        was_lost = (before is not None and before.primary == self._us and control is not None
                    and not self.in_control and not is_releasing)
        self._emit(events.ControlChanged(
            self._key, before, control, self.in_control, was_lost, was_lost and may_turn))
        return True

    # Facts

    @property
    def heard_at(self) -> float:
        """Return when a manager last announced the gimbal or its device was last heard."""
        return max(self._announced_at, self.device.liveness.heard_at)

    @property
    def addresses(self) -> set[Address]:
        """Return the addresses of its device and of its managers."""
        return {self._key.address, *self.managers}

    @property
    def heard_managers(self) -> tuple[Address, ...]:
        """Return the manager that is used, and the others that are heard."""
        return self.manager.address, *sorted(self._others)

    def lacks_information_of(self, address: Address) -> bool:
        """Return whether a component manages it without GIMBAL_MANAGER_INFORMATION so far."""
        manager = self.managers.get(address)
        return manager is not None and manager.information is None

    def unreachable(self, now: float) -> str:
        """Return why the gimbal is not connected, for people; '' if it is."""
        manager, device = self.manager, self.device
        if not manager.liveness.is_heard(now):
            return self.link_problem or _silence(
                f'manager {manager.address}', manager.liveness, now)
        if device.liveness.is_heard(now):
            return ''
        if device.without_id.is_heard(now):
            return (f'{self._key.address} has several gimbals and sends attitudes without '
                    'gimbal_device_id, so they cannot be told apart')
        if self.link_problem or not self._key.number:
            return self.link_problem or _silence(f'device {self._key}', device.liveness, now)
        age = now - device.attitude_at
        ago = f' for {format_seconds(age)}' if math.isfinite(age) else ''
        refused = (f', and refuses MAV_CMD_SET_MESSAGE_INTERVAL for it ({device.request.refusal})'
                   if device.request.refusal else '')
        return (f'{self._key.address} is heard and sends no {GimbalDeviceAttitudeStatus.msgname}'
                f'{ago}{refused}: enable the message there (ArduPilot: stream rate EXTRA3)')

    @property
    def _can_request_attitudes(self) -> bool:
        """Whether the sender of the attitudes is heard: the device, or its manager."""
        sender = self.manager if self._key.number else self.device
        return sender.liveness.connected

    def absence(self, now: float) -> str:
        """Return that the manager is lost, for people; '' if it is heard."""
        if self.manager.liveness.is_heard(now):
            return ''
        return f'gimbal {self._key} is not connected: {self.unreachable(now)}'

    @property
    def in_control(self) -> bool:
        """Whether this component has primary control, and the manager is heard."""
        return self.control is not None and self.control.primary == self._us

    def lack_of_control(self, now: float) -> str:
        """Return why this component does not control the gimbal, for people; '' if it does."""
        if reason := self.absence(now):
            return reason
        if self.control is None:
            return self.manager.lack_of_status(now)
        todo = '' if self.control.primary else '; take control first'
        return ('' if self.in_control else
                f'no control of gimbal {self._key}: {self.control}{todo}')

    def explained(self, result: Result, wish: str, now: float) -> Result:
        """Add the manager, the wish and the control to a refusal."""
        primary = self.control and self.control.primary
        if primary and not self.in_control and result.permanent:
            advice = f'{primary} has control and must release it first'
        else:
            who = 'this node' if self.in_control else primary or 'no component'
            advice = self.unreachable(now) or (
                f'{who} has control: the log of the manager may have the reason'
                if self.control is not None else self.manager.lack_of_status(now))
        reason = result.message.removeprefix('refused: ')
        return result._replace(
            message=f'manager {self.manager.address} refused "{wish}": {reason}; {advice}')

    @property
    def capabilities(self) -> int | None:
        """Return the capabilities, None if the manager has not sent them."""
        information = self.manager.information
        return None if information is None else information.cap_flags

    def missing(self, *enough: int) -> str:
        """Return that the gimbal has none of some capabilities, '' if it has or may have one."""
        known = self.capabilities
        if known is None or any(one & known == one for one in enough):
            return ''
        names = [short_names('GIMBAL_DEVICE_CAP_FLAGS')[one] for one in enough]
        return f'gimbal {self._key} does not have {" or ".join(names)}'

    # Time

    def poll(self, now: float) -> None:
        """Request what a connected gimbal does not send by itself."""
        if self.is_connected:
            for query, address, message in (
                    (self.manager.status_query, self.manager.address, gimbal.GimbalManagerStatus),
                    (self.device.identity_query, self._key.address,
                     gimbal.GimbalDeviceInformation)):
                if query.begin_try(now):
                    self._commands.start(request_message(address, message.id), now)
        if self._can_request_attitudes:
            self.device.request.poll(now)

    @property
    def due(self) -> float:
        """Return when :meth:`poll` is due, or connection or control may have changed, s."""
        manager = self.manager
        due = math.inf if self.control is None else min(
            manager.liveness.silent_at, manager.status_at + STATUS_LIMIT)
        if self.is_connected:
            due = min(due, manager.liveness.silent_at, manager.status_query.due,
                      self.device.liveness.silent_at, self.device.identity_query.due)
        return min(due, self.device.request.due) if self._can_request_attitudes else due
