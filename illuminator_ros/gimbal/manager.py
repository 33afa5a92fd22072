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

"""
A gimbal manager: it decides who controls a gimbal, and gives the device its setpoints.

In https://mavlink.io/en/services/gimbal_v2.html the players decide when control moves. In this
manager a policy decides. No I/O.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
import math
import random
from typing import TypeAlias

from .axes import AT_LIMIT, LEVEL, range_fields, Ranges, TURNING, UNLIMITED
from .manager_control import ControlArbiter, ControlSettings, Role, RoleHolderChanged
from .manager_setpoint import (
    AnySetpoint,
    clip,
    Clipped,
    Demand,
    direction,
    GimbalModel,
    in_vehicle_frame,
    nudge,
    POSES,
    read_demand,
    read_roi,
    resolve,
    Setpoint,
    stopped,
    turned,
    turned_by,
)
from .manager_state import ManagerState, StateChanged, StateTracker
from .messages import (
    AutopilotStateForGimbalDevice,
    DEVICE_ID_PARAM,
    GimbalDeviceInformation,
    GimbalDeviceSetAttitude,
    GimbalManagerInformation,
    GimbalManagerSetAttitude,
    GimbalManagerSetManualControl,
    GimbalManagerSetPitchyaw,
    GimbalManagerStatus,
    NO_COMPONENT,
    NON_MAVLINK_IDS,
)
from .vehicle_state import VehicleState
from ..mavlink import messages as mav
from ..mavlink.command_sender import Command, CommandResult, CommandSender
from ..mavlink.component import Payload
from ..mavlink.dialect import mavlink, replaced, short_names
from ..mavlink.messages import Address, AnyCommand, command_name, params_of
from ..payload.listeners import Listeners
from ..payload.messages import Attitude, GeoPoint, GimbalDeviceAttitudeStatus, GlobalPositionInt
from ..payload.mount_attitude import (
    AXES,
    MountAttitude,
    STILL,
    to_mavlink,
    UNSET_QUATERNION,
    YawFrame,
)
from ..payload.rotation import Quaternion, Vector

# s between GIMBAL_MANAGER_STATUS; between repetitions of a constant setpoint, at most 1 s by the
# specification; and between setpoints that follow a place, the vehicle or a rate.
STATUS_INTERVAL = 0.2
HOLD_INTERVAL = 0.9
FOLLOW_INTERVAL = 0.05
# s between statuses that are sent because control has changed.
CHANGE_INTERVAL = 0.1
# Requests for GIMBAL_DEVICE_INFORMATION without the message after which the manager announces the
# gimbal without it; s between these requests, and between later ones; and the longest time of one,
# which a device may prolong with progress, and command_timeout too.
INFORMATION_REQUESTS = 3
INFORMATION_DELAY, INFORMATION_INTERVAL = 0.5, 5.0
INFORMATION_TIMEOUT = 2.0
# s for which the manager does not send AUTOPILOT_STATE_FOR_GIMBAL_DEVICE after an autopilot has
# sent it, and the shortest time between two that the manager sends.
AUTOPILOT_SILENCE = 2.0
AUTOPILOT_INTERVAL = 0.02
# s after which the attitude of a device is out of date.
ATTITUDE_AGE = 1.0
# s within which two different heartbeats of one address show two senders.
IDENTITY_TIME = 3.0
HEADING_UNKNOWN = 'the heading of the vehicle is unknown'


@dataclass(frozen=True)
class ManagerSettings:
    """
    The settings of a manager.

    :param device_id: of its device: a component id, 1..6 for a device without MAVLink, or 0 for
        the first device that is heard.
    :param nudge_limit: the largest angle that a player in secondary control adds, rad.
    :param ranges: of the axes of a device without MAVLink.
    """

    control: ControlSettings = field(default_factory=ControlSettings)
    device_id: int = 0
    nudge_limit: float = math.radians(10)
    ranges: Ranges = UNLIMITED


@dataclass(frozen=True)
class DemandRefused:
    """A player's setpoint was refused."""

    player: Address
    reason: str


@dataclass(frozen=True)
class SetpointClipped:
    """Angles beyond the ranges of the device are clipped; once for an axis and a setpoint."""

    clipped: tuple[Clipped, ...]


@dataclass(frozen=True)
class SetpointSent:
    """A device without MAVLink must take a setpoint, which is mixed and clipped."""

    setpoint: Setpoint


@dataclass(frozen=True)
class AddressShared:
    """Two senders with different heartbeats use the address of one player."""

    player: Address


@dataclass(frozen=True)
class ReferenceLost:
    """
    The gimbal no longer follows its region of interest, or a yaw relative to north.

    :param unknown: the unknown value of the vehicle: ``position`` or ``heading``.
    """

    unknown: str


ManagerEvent: TypeAlias = (
    StateChanged | RoleHolderChanged | DemandRefused | SetpointClipped | SetpointSent
    | AddressShared | ReferenceLost)


class GimbalManager(Payload):
    """
    The manager of one gimbal.

    :param commands: sends everything, from the manager's address.
    :param draw: returns a random number, 0..1.
    :ivar events: each a :data:`ManagerEvent`.
    :ivar tracker: its state, its device and other managers.
    :ivar control: the players in primary and in secondary control.
    :ivar vehicle: the state of the vehicle, from the link or from ROS.
    :ivar model: the abilities of the device.
    """

    messages = (
        mav.Heartbeat, mav.CommandLong, mav.CommandInt, GimbalManagerInformation,
        GimbalManagerStatus, GimbalManagerSetAttitude, GimbalManagerSetPitchyaw,
        GimbalManagerSetManualControl, GimbalDeviceInformation, GimbalDeviceAttitudeStatus,
        AutopilotStateForGimbalDevice, Attitude, GlobalPositionInt)
    sends = (GimbalManagerInformation, GimbalManagerStatus, GimbalDeviceInformation,
             GimbalDeviceSetAttitude, GimbalDeviceAttitudeStatus, AutopilotStateForGimbalDevice)

    def __init__(
        self, commands: CommandSender, settings: ManagerSettings,
        draw: Callable[[], float] = random.random,
    ) -> None:
        self.events: Listeners[ManagerEvent] = Listeners()
        self.settings = settings
        self.address = commands.address
        self.control = ControlArbiter(settings.control)
        self.vehicle = VehicleState()
        self._commands = commands
        self.tracker = StateTracker(
            commands.address, settings.device_id, self._state_changed, draw)
        self.model = (GimbalModel() if self.tracker.has_mavlink
                      else GimbalModel.from_ranges(settings.ranges))
        self._information: GimbalDeviceInformation | None = None
        self._information_requests = 0
        # Whether a request for GIMBAL_MANAGER_INFORMATION came too early.
        self._is_awaited = False
        self._status: GimbalDeviceAttitudeStatus | None = None
        self._attitude: MountAttitude | None = None
        self._status_at = self._measured_at = -math.inf
        self._setpoint: Setpoint | None = None
        self._sent: Setpoint | None = None
        self._clipped: tuple[Clipped, ...] = ()
        # By axis, the demand whose clipped angle was reported.
        self._reported: dict[str, object] = {}
        self._lost: set[str] = set()
        self._changed_at = -math.inf
        self._offsets = STILL
        self._roi: GeoPoint | None = None
        self._send_due = self._status_due = self._information_due = math.inf
        self._autopilot_at = self._state_sent_at = -math.inf
        self._identities: dict[Address, tuple[tuple[int, int], float]] = {}
        self._handlers: dict[int, Callable[[Address, AnyCommand, float], int]] = {
            mavlink.MAV_CMD_DO_GIMBAL_MANAGER_CONFIGURE: self._configure,
            mavlink.MAV_CMD_DO_GIMBAL_MANAGER_PITCHYAW: self._pitch_yaw,
            mavlink.MAV_CMD_DO_SET_ROI_LOCATION: self._set_roi,
            mavlink.MAV_CMD_DO_SET_ROI_NONE: self._clear_roi}

    # Snapshots

    def status(self, now: float) -> GimbalManagerStatus:
        """Return GIMBAL_MANAGER_STATUS, which contains the players in control."""
        setpoint, device = self._setpoint, self._device_status(now)
        flags = 0 if setpoint is None else setpoint.device_flags
        accepts = (device is not None and device.flags
                   & mavlink.GIMBAL_DEVICE_FLAGS_ACCEPTS_YAW_IN_EARTH_FRAME)
        primary, secondary = (self.control.holder(role) or NO_COMPONENT for role in Role)
        return GimbalManagerStatus(
            mav.time_boot_ms(now),
            int(flags | (accepts and mavlink.GIMBAL_DEVICE_FLAGS_ACCEPTS_YAW_IN_EARTH_FRAME)),
            self.tracker.device_id, *primary, *secondary)

    # The payload

    def link_opened(self, now: float) -> None:
        """See :meth:`Payload.link_opened`."""
        self.tracker.link_opened(now)

    def link_closed(self, now: float, reason: str) -> None:
        """See :meth:`Payload.link_closed`."""
        self.tracker.link_closed(now)

    def receive(self, source: Address, message: mav.Message, now: float) -> None:
        """See :meth:`Payload.receive`."""
        if isinstance(message, AnySetpoint):
            self.take_setpoint(source, message, now)
        elif isinstance(message, mav.Heartbeat):
            self.control.heard(source, now)
            self._compare_identity(source, message, now)
            if message.type == mavlink.MAV_TYPE_GIMBAL:
                self.tracker.hear_device(source, now)
        elif isinstance(message, GimbalDeviceAttitudeStatus | GimbalDeviceInformation) and (
                message.gimbal_device_id in NON_MAVLINK_IDS):
            # An autopilot reports a gimbal on its outputs, but is not a gimbal device.
            return
        elif isinstance(message, GimbalDeviceAttitudeStatus):
            if self.tracker.hear_device(source, now):
                self.take_attitude(message, now)
        elif isinstance(message, GimbalDeviceInformation):
            if self.tracker.hear_device(source, now):
                self._information = message
                self._information_due = math.inf
                self.model = GimbalModel.from_information(message)
        elif isinstance(message, GimbalManagerInformation | GimbalManagerStatus):
            self.tracker.hear_manager(source, message.gimbal_device_id, now)
        elif source == Address(self.address.system, mavlink.MAV_COMP_ID_AUTOPILOT1):
            if isinstance(message, AutopilotStateForGimbalDevice):
                self._autopilot_at = now
            elif isinstance(message, Attitude | GlobalPositionInt):
                self.vehicle.take(message, now)
                self.vehicle_changed(now)

    def receive_conflicting(self, message: mav.Message, now: float) -> None:
        """See :meth:`Payload.receive_conflicting`."""
        if isinstance(message, GimbalManagerInformation | GimbalManagerStatus):
            self.tracker.hear_manager(self.address, message.gimbal_device_id, now)

    def execute(self, source: Address, command: AnyCommand, now: float) -> int | None:
        """See :meth:`Payload.execute`."""
        params = params_of(command)
        if command.command == mavlink.MAV_CMD_REQUEST_MESSAGE:
            return self._send_requested(params[0], now)
        if command.command == mavlink.MAV_CMD_SET_MESSAGE_INTERVAL:
            # Each player needs the status, so none may stop it.
            return mavlink.MAV_RESULT_DENIED if params[0] == GimbalManagerStatus.id else None
        handler = self._handlers.get(command.command)
        if handler is None:
            return None
        if params[DEVICE_ID_PARAM[command.command]] not in (0, self.tracker.device_id):
            return mavlink.MAV_RESULT_DENIED
        is_configure = command.command == mavlink.MAV_CMD_DO_GIMBAL_MANAGER_CONFIGURE
        # Control may be released at the end.
        if (inactive := self._inactivity()) and not (is_configure and self._commands.refusal):
            if not is_configure:
                self.events.emit(DemandRefused(source, inactive))
            return (mavlink.MAV_RESULT_DENIED if self.tracker.state is ManagerState.INACTIVE
                    else mavlink.MAV_RESULT_TEMPORARILY_REJECTED)
        return handler(source, command, now)

    def poll(self, now: float) -> None:
        """See :meth:`Payload.poll`."""
        self.tracker.poll(now)
        self._control_changed(self.control.poll(now), now)
        if now >= self._information_due:
            self._request_information(now)
        if now >= self._status_due:
            self._status_due = max(self._status_due + STATUS_INTERVAL, now)
            self._commands.send(self.status(now))
            self._send_awaited(now)
            if not self.tracker.has_mavlink and now >= self._measured_at + ATTITUDE_AGE:
                self._report_commanded(now)
        if now >= self._send_due:
            self._follow(now)

    def next_deadline(self) -> float:
        """See :meth:`Payload.next_deadline`."""
        return min(self.tracker.next_deadline(), self.control.next_deadline(),
                   self._information_due, self._status_due, self._send_due)

    # The device and the vehicle, from the link or from ROS

    def _report(self, status: GimbalDeviceAttitudeStatus, now: float) -> None:
        self._status, self._status_at = status, now
        try:
            self._attitude = MountAttitude.from_status(status)
        except ValueError:
            self._attitude = None
        if not self.tracker.has_mavlink and self.tracker.state is ManagerState.ACTIVE:
            flags = 0 if self._setpoint is None else self._setpoint.operation
            limits = sum(AT_LIMIT[AXES.index(one.axis)] for one in self._clipped)
            self._commands.send(replaced(
                status, flags=status.flags | flags, gimbal_device_id=self.tracker.device_id,
                failure_flags=status.failure_flags | limits))

    def _report_commanded(self, now: float) -> None:
        """Report the setpoint as the attitude of a device that reports no attitude."""
        attitude = self._sent and self._sent.attitude or Quaternion()
        heading = self.vehicle.heading(now)
        self._report(GimbalDeviceAttitudeStatus(
            0, 0, mav.time_boot_ms(now), mavlink.GIMBAL_DEVICE_FLAGS_YAW_IN_VEHICLE_FRAME,
            attitude, math.nan,
            math.nan, math.nan, 0, math.nan if heading is None else heading, math.nan), now)

    def take_attitude(self, status: GimbalDeviceAttitudeStatus, now: float) -> None:
        """Take the attitude of the device, from the link or, without MAVLink, from ROS."""
        self._measured_at = now
        self._report(status, now)

    def vehicle_changed(self, now: float) -> None:
        """Send the vehicle's state to the device, unless an autopilot does."""
        if (self.tracker.device is None or self.tracker.state is not ManagerState.ACTIVE
                or now < self._autopilot_at + AUTOPILOT_SILENCE
                or now < self._state_sent_at + AUTOPILOT_INTERVAL):
            return
        message = self.vehicle.for_device(self.tracker.device, now)
        if message is not None:
            self._state_sent_at = now
            self._commands.send(message)

    # Control

    def _configure(self, source: Address, command: AnyCommand, now: float) -> int:
        try:
            changes = self.control.configure(source, params_of(command), now)
        except ValueError:
            return mavlink.MAV_RESULT_DENIED
        if changes is None:
            return mavlink.MAV_RESULT_DENIED
        self._control_changed(changes, now)
        return mavlink.MAV_RESULT_ACCEPTED

    def _control_changed(self, changes: Sequence[RoleHolderChanged], now: float) -> None:
        for change in changes:
            if change.role is Role.SECONDARY:
                if self.control.primary.holder is None:
                    # The gimbal stays where it points, as below.
                    self._turn(now, self._offsets)
                self._offsets = STILL
            else:
                # The gimbal stays where it points until the next player sends a setpoint.
                offsets = STILL
                if change.after == self.control.holder(Role.SECONDARY):
                    # Offsets do not shift the setpoints of the player that sent them.
                    offsets, self._offsets = self._offsets, STILL
                self.stop(now, offsets)
            self.events.emit(change)
        if changes and self._status_due < math.inf and now >= self._changed_at + CHANGE_INTERVAL:
            # An additional status, so that players need not wait for the next regular one.
            self._changed_at = now
            self._commands.send(self.status(now))

    # The end

    def may_send_at_end(self, sent: Command | mav.Message) -> bool:
        """See :meth:`Payload.may_send_at_end`: reports, and setpoints without rates."""
        if isinstance(sent, GimbalDeviceSetAttitude):
            rates = (sent.angular_velocity_x, sent.angular_velocity_y, sent.angular_velocity_z)
            return not any(rate for rate in rates if not math.isnan(rate))
        return isinstance(sent, self.sends)

    def close(self, now: float) -> None:
        """See :meth:`Payload.close`: the device stays where it is, and follows nothing more."""
        self.stop(now)
        self._setpoint = None

    # Setpoints

    def stop(self, now: float, offsets: Vector = STILL) -> None:
        """End rates and the region of interest; offsets, rad, become part of the setpoint."""
        self._roi = None
        self._turn(now, offsets)
        self._setpoint = self._setpoint and stopped(self._setpoint)
        self._send(now)

    def take_setpoint(self, source: Address, message: AnySetpoint, now: float) -> None:
        """Take a setpoint of a player."""
        if (message.target_system not in (0, self.address.system)
                or message.target_component not in (0, self.address.component)
                or message.gimbal_device_id
                and message.gimbal_device_id != self.tracker.device_id):
            return
        try:
            demand = read_demand(message, self.model.ranges)
        except ValueError as error:
            refusal = f'{message.get_type()}: {error}'
        else:
            refusal = self._demand(source, demand, now)
        if refusal:
            self.events.emit(DemandRefused(source, refusal))

    def _answer(self, source: Address, refusal: str, now: float) -> int:
        """Return the result of a command; report a refusal, since a result has no reason."""
        if refusal:
            self.events.emit(DemandRefused(source, refusal))
        return mavlink.MAV_RESULT_DENIED if refusal else mavlink.MAV_RESULT_ACCEPTED

    def _pitch_yaw(self, source: Address, command: AnyCommand, now: float) -> int:
        *angles_and_rates, flags, _, _ = params_of(command)
        try:
            pitch, yaw, pitch_rate, yaw_rate = map(math.radians, angles_and_rates)
            demand = Demand.from_pitch_yaw(
                0 if math.isnan(flags) else int(flags), pitch, yaw, pitch_rate, yaw_rate)
        except (ValueError, OverflowError) as error:
            return self._answer(source, f'{command_name(command.command)}: {error}', now)
        return self._answer(source, self._demand(source, demand, now), now)

    def _demand(self, player: Address, demand: Demand, now: float) -> str:
        """Follow a player's demand; return why it is refused, or ''."""
        if inactive := self._inactivity():
            return inactive
        if self.control.primary.holder == player:
            return self._set(demand, now)
        if self.control.secondary.holder == player:
            if demand.flags & (mavlink.GIMBAL_DEVICE_FLAGS_RETRACT
                               | mavlink.GIMBAL_DEVICE_FLAGS_NEUTRAL) or not (
                    demand.attitude or any(map(math.isfinite, demand.angles))):
                return 'secondary control adds angles only'
            self._offsets = nudge(demand, self.settings.nudge_limit)
            self._send(now)
            return ''
        return self._lacks_control(player)

    def _inactivity(self) -> str:
        """Return that the manager gives no setpoints now, '' if it does."""
        if self._commands.refusal:
            return self._commands.refusal
        state = self.tracker.state
        return '' if state is ManagerState.ACTIVE else f'the manager is not active: {state.value}'

    def _lacks_control(self, player: Address) -> str:
        """Return why a player may not set the gimbal, '' if it has primary control."""
        holder = self.control.primary.holder
        if holder == player:
            return ''
        return f'{holder} has control' if holder else 'the player must take control first'

    def _set(self, demand: Demand, now: float) -> str:
        if lacking := self.model.lacks(demand.flags):
            names = (name for flag, name in short_names('GIMBAL_DEVICE_FLAGS').items()
                     if flag & lacking)
            return f'the gimbal does not have {", ".join(names)}'
        self._turn(now)
        current = self._current(demand, now)
        if isinstance(current, str):
            return current
        self._roi = None
        self._setpoint = resolve(demand, current, now, turns=not self.tracker.has_mavlink)
        self._send(now)
        return ''

    def _current(self, demand: Demand, now: float) -> Quaternion | str:
        """Return the attitude that a demand changes, or what is unknown of it."""
        if demand.is_pose or (demand.has_rates_only and self.tracker.has_mavlink):
            # Such a setpoint does not depend on the attitude.
            return Quaternion()
        if (demand.frame is YawFrame.EARTH and not self._accepts_earth_frame(now)
                and self._heading(now) is None):
            return HEADING_UNKNOWN
        return demand.attitude or self._pointing(demand.frame, now)

    def _pointing(self, frame: YawFrame, now: float) -> Quaternion | str:
        """Return the attitude of the setpoint, or else of the device, with a yaw in a frame."""
        heading = self._heading(now)
        # A device that has neither reported an attitude nor got a setpoint starts at 0.
        attitude, known = Quaternion(), YawFrame.VEHICLE
        if self._setpoint is not None and self._setpoint.attitude is not None:
            attitude, known = self._setpoint.attitude, self._setpoint.frame
        elif self._attitude is not None and self._device_status(now) is not None:
            seen = self._attitude.seen_from(frame, heading)
            return HEADING_UNKNOWN if seen is None else Quaternion(*to_mavlink(seen, frame))
        elif self._status is not None or self._sent is not None:
            return 'the attitude of the gimbal is unknown'
        if known is frame:
            return attitude
        return HEADING_UNKNOWN if heading is None else turned_by(
            attitude, heading if frame is YawFrame.EARTH else -heading)

    def _accepts_earth_frame(self, now: float) -> bool:
        status = self._device_status(now)
        return self.model.accepts_earth_frame(status.flags if status else None)

    def _device_status(self, now: float) -> GimbalDeviceAttitudeStatus | None:
        return self._status if now < self._status_at + ATTITUDE_AGE else None

    def _heading(self, now: float) -> float | None:
        """Return the vehicle's heading as the device reports it, else as the vehicle does."""
        # The heading in the status of a device without MAVLink is an older one of the vehicle.
        if (self.tracker.has_mavlink and self._attitude is not None
                and self._attitude.heading is not None
                and self._device_status(now) is not None):
            return self._attitude.heading
        return self.vehicle.heading(now)

    def _ahead(self, setpoint: Setpoint, now: float) -> float | None:
        """Return the direction from which the range of the yaw counts, None if unknown."""
        # A pose and rates have no attitude that is converted.
        is_relative = setpoint.frame is YawFrame.VEHICLE or setpoint.attitude is None
        return 0.0 if is_relative else self._heading(now)

    def _turn(self, now: float, offsets: Vector = STILL) -> None:
        """Turn the setpoint by the rates that the device does not follow, and by offsets."""
        self._setpoint = self._setpoint and turned(
            self._setpoint, now, self.model.ranges, self._ahead(self._setpoint, now), offsets,
            self._clipped)

    def _send(self, now: float) -> None:
        """Give the device the setpoint, with everything mixed and clipped."""
        self._turn(now)
        setpoint = self._setpoint
        if setpoint is None or self.tracker.state is not ManagerState.ACTIVE:
            self._send_due = math.inf
            return
        converts = setpoint.frame is YawFrame.EARTH and not self._accepts_earth_frame(now)
        ahead = self._ahead(setpoint, now)
        self._send_due = now + (
            FOLLOW_INTERVAL if setpoint.turning != STILL or converts or self._roi is not None
            else HOLD_INTERVAL)
        attitude, self._clipped = clip(
            setpoint, self.model.ranges, ahead, self._offsets, self._clipped)
        if self._clipped or self._reported:
            self._report_clipped(setpoint)
        sent = setpoint
        if attitude is not setpoint.attitude:
            sent = setpoint._replace(attitude=attitude)
        self._note_lost('heading', is_lost=converts and ahead is None)
        if converts:
            if ahead is None:
                return
            sent = in_vehicle_frame(sent, ahead)
        self._sent = sent
        if self.tracker.device is None:
            self.events.emit(SetpointSent(sent))
        else:
            self._commands.send(GimbalDeviceSetAttitude(
                *self.tracker.device, sent.device_flags, sent.attitude or UNSET_QUATERNION,
                *sent.rates))

    def _report_clipped(self, setpoint: Setpoint) -> None:
        """Report a clipped angle once, although it changes while the vehicle turns or moves."""
        demands: dict[str, object] = {
            axis: (setpoint.frame, self._roi or (
                math.copysign(1.0, rate) if rate else round(angle + offset, 6)))
            for axis, angle, offset, rate in zip(
                AXES, setpoint.target, self._offsets, setpoint.turning, strict=True)}
        self._reported = {axis: demand for axis, demand in self._reported.items()
                          if demand == demands[axis]}
        if new := tuple(one for one in self._clipped if one.axis not in self._reported):
            self._reported |= {one.axis: demands[one.axis] for one in new}
            self.events.emit(SetpointClipped(new))

    def _note_lost(self, name: str, *, is_lost: bool) -> None:
        """Report once that a value of the vehicle, which the setpoint needs, is unknown."""
        if is_lost and name not in self._lost:
            self.events.emit(ReferenceLost(name))
        self._lost = self._lost | {name} if is_lost else self._lost - {name}

    def _end_of_motion(self, now: float) -> Setpoint | None:
        """Return a rate of zero if the device turns, as a manager has left it that was killed."""
        status = self._device_status(now)
        if status is None or self._attitude is None or status.flags & POSES:
            return None
        rates = status.angular_velocity_x, status.angular_velocity_y, status.angular_velocity_z
        turns = any(abs(rate) > TURNING for rate in rates)
        return Setpoint(status.flags, self._attitude.frame, None, STILL) if turns else None

    # A region of interest

    def _set_roi(self, source: Address, command: AnyCommand, now: float) -> int:
        if refusal := self._lacks_control(source):
            return self._answer(source, refusal, now)
        read = read_roi(command)
        if isinstance(read, int):
            self.events.emit(DemandRefused(
                source, f'{command_name(command.command)}: no place, or an unknown frame'))
            return read
        place, is_relative = read
        above = self.vehicle.home_altitude if is_relative else 0.0
        if above is None or self.vehicle.position(now) is None or (
                self._heading(now) is None
                and not self._accepts_earth_frame(now)):
            self.events.emit(DemandRefused(
                source, 'the position or the heading of the vehicle is unknown'))
            return mavlink.MAV_RESULT_TEMPORARILY_REJECTED
        self._roi = place._replace(altitude=place.altitude + above)
        self._follow(now)
        return mavlink.MAV_RESULT_ACCEPTED

    def _clear_roi(self, source: Address, command: AnyCommand, now: float) -> int:
        if not (refusal := self._lacks_control(source)):
            self._roi = None
            self._send(now)
        return self._answer(source, refusal, now)

    def _roi_flags(self) -> int:
        return LEVEL | (0 if self.model.lacks(mavlink.GIMBAL_DEVICE_FLAGS_YAW_LOCK)
                        else mavlink.GIMBAL_DEVICE_FLAGS_YAW_LOCK)

    def _follow(self, now: float) -> None:
        """Send the setpoint, which follows the region of interest if there is one."""
        if self._roi is not None:
            position = self.vehicle.position(now)
            self._note_lost('position', is_lost=position is None)
            if position and (angles := direction(position, self._roi)) is not None:
                self._setpoint = Setpoint(
                    self._roi_flags(), YawFrame.EARTH, Quaternion.from_euler(0.0, *angles),
                    since=now)
        self._send(now)

    # Messages

    def _send_requested(self, message_id: float, now: float) -> int | None:
        message: mav.Message | None
        if message_id == GimbalManagerInformation.id:
            message = self._own_information(now)
        elif message_id == GimbalManagerStatus.id:
            message = self.status(now)
        elif message_id == GimbalDeviceInformation.id:
            message = self._device_information(now)
        else:
            return None
        if self.tracker.state is not ManagerState.ACTIVE or message is None:
            self._is_awaited |= message_id == GimbalManagerInformation.id
            return (mavlink.MAV_RESULT_DENIED if self.tracker.state is ManagerState.INACTIVE
                    else mavlink.MAV_RESULT_TEMPORARILY_REJECTED)
        self._commands.send(message)
        return mavlink.MAV_RESULT_ACCEPTED

    def _send_awaited(self, now: float) -> None:
        """Send GIMBAL_MANAGER_INFORMATION that was requested too early: clients may give up."""
        if self._is_awaited and (information := self._own_information(now)):
            self._is_awaited = False
            self._commands.send(information)

    def _own_information(self, now: float) -> GimbalManagerInformation | None:
        """Return GIMBAL_MANAGER_INFORMATION, None while GIMBAL_DEVICE_INFORMATION is awaited."""
        if (self.tracker.has_mavlink and self._information is None
                and self._information_requests < INFORMATION_REQUESTS):
            # Clients request the message once, and would never know the device's capabilities.
            return None
        # The manager itself computes the attitude towards a place.
        capabilities = (self.model.capabilities
                        | mavlink.GIMBAL_DEVICE_CAP_FLAGS_CAN_POINT_LOCATION_GLOBAL)
        return GimbalManagerInformation(
            mav.time_boot_ms(now), capabilities, self.tracker.device_id,
            **range_fields(self.model.ranges))

    def _device_information(self, now: float) -> GimbalDeviceInformation | None:
        """Return GIMBAL_DEVICE_INFORMATION, which clients may request from the manager."""
        if self.tracker.has_mavlink:
            return self._information and replaced(
                self._information, gimbal_device_id=self.tracker.device_id)
        return GimbalDeviceInformation(
            mav.time_boot_ms(now), b'illuminator_ros', b'gimbal behind ROS', b'', 0, 0, 0,
            self.model.capabilities & 0xFFFF, 0, **range_fields(self.model.ranges),
            gimbal_device_id=self.tracker.device_id, cap_flags2=0)

    def _request_information(self, now: float) -> None:
        self._information_due = math.inf
        if self.tracker.device is not None:
            self._commands.start(Command(
                self.tracker.device, mavlink.MAV_CMD_REQUEST_MESSAGE,
                (GimbalDeviceInformation.id,)),
                now, self._information_answered, deadline=now + INFORMATION_TIMEOUT)

    def _information_answered(self, result: CommandResult, now: float) -> None:
        if self._information is None and self.tracker.state is not ManagerState.NO_DEVICE:
            self._information_requests += 1
            self._information_due = now + (
                INFORMATION_DELAY if self._information_requests < INFORMATION_REQUESTS
                else INFORMATION_INTERVAL)

    def _state_changed(self, change: StateChanged, now: float) -> None:
        active = change.after is ManagerState.ACTIVE
        self._status_due = now if active else math.inf
        self._send_due = now if active else math.inf
        if active and self._setpoint is None:
            self._setpoint = self._end_of_motion(now)
        if change.after in (ManagerState.INACTIVE, ManagerState.NO_DEVICE):
            # Another manager may have moved the device, or the next device may be another one. But
            # a device that turns at a rate continues until a manager stops it.
            setpoint = self._setpoint
            self._setpoint = stopped(setpoint) if setpoint and setpoint.has_rates_only else None
            self._roi = None
            self._offsets = STILL
            self._clipped, self._reported = (), {}
        if change.after is ManagerState.LISTENING:
            # Another manager may send no status, but answers a request.
            self._commands.send(Command(
                Address(0, 0), mavlink.MAV_CMD_REQUEST_MESSAGE,
                (GimbalManagerInformation.id,)).message(0, as_int=False))
            if self.tracker.has_mavlink and self._information is None:
                self._information_due = now
        elif change.after is ManagerState.NO_DEVICE and self.tracker.has_mavlink:
            self._information, self._information_due = None, math.inf
            self._information_requests = 0
            self.model = GimbalModel()
        self.events.emit(change)

    def _compare_identity(self, source: Address, message: mav.Heartbeat, now: float) -> None:
        holders = [self.control.holder(role) for role in Role]
        self._identities = {
            one: identity for one, identity in self._identities.items() if one in holders}
        if source not in holders:
            return
        identity = message.type, message.autopilot
        before, at = self._identities.get(source, (identity, now))
        self._identities[source] = identity, now
        if before != identity and now < at + IDENTITY_TIME:
            self.events.emit(AddressShared(source))
