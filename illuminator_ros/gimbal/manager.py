# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""
A gimbal manager: it decides who controls a gimbal, and gives the device its setpoints.

In https://mavlink.io/en/services/gimbal_v2.html the players decide when control moves. In this
manager a policy decides. No I/O.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, field
import math
import random
from typing import TypeAlias

from . import messages as gimbal
from .axes import AT_LIMIT, range_fields, Ranges, UNLIMITED
from .commands import Control
from .managed_device import ManagedDevice
from .manager_control import ControlArbiter, ControlSettings, Role, RoleHolderChanged
from .manager_setpoint import AnySetpoint, read_roi, read_setpoint, Refused, Setpoint
from .manager_state import ManagerState, StateChanged, StateTracker
from .setpoint_mixer import SetpointEvent, SetpointMixer
from .vehicle_state import VehicleState
from ..geometry.mount_attitude import AXES, to_mavlink, YawFrame
from ..geometry.rotation import Quaternion
from ..mavlink import messages as mav
from ..mavlink.command_sender import Command, CommandSender, request_message
from ..mavlink.component import Payload
from ..mavlink.dialect import mavlink, replaced
from ..mavlink.messages import Address, AnyCommand, params_of
from ..payload.listeners import Listeners
from ..payload.messages import Attitude, GimbalDeviceAttitudeStatus, GlobalPositionInt

# s between GIMBAL_MANAGER_STATUS, and between those that are sent because control has changed.
STATUS_INTERVAL = 0.2
CHANGE_INTERVAL = 0.1
# s without an attitude of a device without MAVLink after which its setpoint is reported.
MEASURED_AGE = 1.0


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
class RequestRefused:
    """A setpoint or a command of a player was refused."""

    player: Address
    reason: str


@dataclass(frozen=True)
class AddressShared:
    """Two senders with different heartbeats use the address of one player."""

    player: Address


ManagerEvent: TypeAlias = (
    StateChanged | RoleHolderChanged | RequestRefused | AddressShared | SetpointEvent)


class GimbalManager(Payload):
    """
    The manager of one gimbal: messages and commands of players, and reports to them.

    :param commands: sends everything, from the manager's address.
    :param draw: returns a random number, 0..1.
    :param reported: called with each report to all players that is sent.
    :ivar events: each a :data:`ManagerEvent`.
    :ivar tracker: its state, its device and other managers.
    :ivar control: the players in primary and in secondary control.
    :ivar setpoints: of the device.
    :ivar vehicle: the state of the vehicle, from the link or from ROS.
    """

    messages = (
        mav.Heartbeat, mav.CommandLong, mav.CommandInt, gimbal.GimbalManagerInformation,
        gimbal.GimbalManagerStatus, gimbal.GimbalManagerSetAttitude,
        gimbal.GimbalManagerSetPitchyaw, gimbal.GimbalManagerSetManualControl,
        gimbal.GimbalDeviceInformation, GimbalDeviceAttitudeStatus,
        gimbal.AutopilotStateForGimbalDevice, Attitude, GlobalPositionInt)
    sends = (gimbal.GimbalManagerInformation, gimbal.GimbalManagerStatus,
             gimbal.GimbalDeviceInformation, gimbal.GimbalDeviceSetAttitude,
             GimbalDeviceAttitudeStatus, gimbal.AutopilotStateForGimbalDevice)
    streams = ((gimbal.GimbalDeviceSetAttitude,),)

    def __init__(
        self, commands: CommandSender, settings: ManagerSettings,
        draw: Callable[[], float] = random.random, *,
        reported: Callable[[mav.Message], None] = lambda message: None,
    ) -> None:
        self.events: Listeners[ManagerEvent] = Listeners()
        self.settings = settings
        self.address = commands.address
        self.control = ControlArbiter(settings.control)
        self.vehicle = VehicleState()
        self.tracker = StateTracker(
            commands.address, settings.device_id, self._state_changed, draw)
        self._commands = commands
        self._reported = reported
        self._device = ManagedDevice(self.tracker, commands, self.vehicle, settings.ranges)
        self.setpoints = SetpointMixer(
            self._device, self.vehicle, self.tracker, commands, self.events.emit)
        # Whether a request for GIMBAL_MANAGER_INFORMATION came too early.
        self._is_awaited = False
        self._measured_at = self._changed_at = -math.inf
        self._status_due = math.inf

    # The payload

    def link_opened(self, now: float) -> None:
        """See :meth:`Payload.link_opened`."""
        self.tracker.link_opened(now)
        self._commands.schedule.by(self.poll, now)

    def link_closed(self, now: float, reason: str) -> None:
        """See :meth:`Payload.link_closed`."""
        self.tracker.link_closed(now)
        self._commands.schedule.by(self.poll, now)

    def components_lost(self, lost: Collection[Address], now: float, reason: str) -> None:
        """See :meth:`Payload.components_lost`."""
        if self.tracker.device in lost:
            self.tracker.link_closed(now)
        elif self.control.primary.holder in lost:
            # Its control ends with its lease, unless it is heard again.
            self.setpoints.stop(now)
        self._commands.schedule.by(self.poll, now)

    def receive(self, source: Address, message: mav.Message, now: float) -> None:
        """See :meth:`Payload.receive`."""
        self._commands.schedule.by(self.poll, now)
        if isinstance(message, AnySetpoint):
            self.receive_setpoint(source, message, now)
        elif isinstance(message, mav.Heartbeat):
            if self.control.heard(source, message, now):
                self.events.emit(AddressShared(source))
            if message.type == mavlink.MAV_TYPE_GIMBAL:
                self.tracker.hear_device(source, now)
        elif isinstance(message, GimbalDeviceAttitudeStatus | gimbal.GimbalDeviceInformation):
            # An autopilot reports a gimbal on its outputs, but is not a gimbal device.
            if (message.gimbal_device_id in gimbal.NON_MAVLINK_IDS
                    or not self.tracker.hear_device(source, now)):
                return
            if isinstance(message, GimbalDeviceAttitudeStatus):
                self._receive_attitude(message, now)
            else:
                self._device.receive_information(message)
        elif isinstance(message, gimbal.GimbalManagerInformation | gimbal.GimbalManagerStatus):
            self.tracker.hear_manager(source, message.gimbal_device_id, now)
        elif source == Address(self.address.system, mavlink.MAV_COMP_ID_AUTOPILOT1):
            if isinstance(message, gimbal.AutopilotStateForGimbalDevice):
                self.vehicle.autopilot_sent(now)
            elif isinstance(message, Attitude | GlobalPositionInt):
                self.vehicle.receive(message, now)
                self.vehicle_changed(now)

    def receive_conflicting(self, message: mav.Message, now: float) -> None:
        """See :meth:`Payload.receive_conflicting`."""
        if isinstance(message, gimbal.GimbalManagerInformation | gimbal.GimbalManagerStatus):
            self.tracker.hear_manager(self.address, message.gimbal_device_id, now)
            self._commands.schedule.by(self.poll, now)

    def poll(self, now: float) -> None:
        """Do what is due."""
        self.tracker.poll(now)
        self._control_changed(self.control.poll(now), now)
        if now >= self._status_due:
            self._status_due = max(self._status_due + STATUS_INTERVAL, now)
            self._report(self.status(now))
            if self._is_awaited and (information := self._own_information(now)):
                # Clients may give up, so they need not request it again.
                self._is_awaited = False
                self._report(information)
            if not self.is_measured(now):
                # The setpoint of a device that reports no attitude is its attitude.
                sent = self.setpoints.sent
                self._receive_attitude(self._measured(
                    sent and sent.attitude or Quaternion(), YawFrame.VEHICLE, now), now)
        if now >= self.setpoints.due:
            self.setpoints.poll(now)
        self.setpoints.rate_stop.poll(now)
        self._commands.schedule.at(self.poll, min(
            self.tracker.due, self.control.due, self._status_due, self.setpoints.due,
            self.setpoints.rate_stop.due))

    def _state_changed(self, change: StateChanged, now: float) -> None:
        after = change.after
        self._status_due = now if after is ManagerState.ACTIVE else math.inf
        if after is ManagerState.ACTIVE:
            self.setpoints.activate(now)
        else:
            self.setpoints.deactivate(now, forget=after is not ManagerState.LISTENING)
        if after is ManagerState.LISTENING:
            # Another manager may send no status, but answers a request.
            self._commands.send(request_message(
                Address(0, 0), gimbal.GimbalManagerInformation.id).message(0, as_int=False))
            self._device.found(now)
        elif after is ManagerState.NO_DEVICE:
            self._device.lost()
        self.events.emit(change)

    # The end

    def may_send_at_end(self, sent: Command | mav.Message) -> bool:
        """See :meth:`Payload.may_send_at_end`: reports, and setpoints without rates."""
        if isinstance(sent, gimbal.GimbalDeviceSetAttitude):
            return not any(rate for rate in gimbal.rates_of(sent) if not math.isnan(rate))
        return isinstance(sent, self.sends)

    def close(self, now: float) -> None:
        """See :meth:`Payload.close`: the device stays where it is, and follows nothing more."""
        self.setpoints.close(now)
        self._commands.schedule.by(self.poll, now)

    # The device and the vehicle, from the link or from ROS

    def receive_attitude(self, value: tuple[Quaternion, YawFrame], now: float) -> None:
        """Receive the attitude of a device without MAVLink, from ROS."""
        self._measured_at = now
        self._receive_attitude(self._measured(to_mavlink(*value), value[1], now), now)
        self._commands.schedule.by(self.poll, now)

    def is_measured(self, now: float) -> bool:
        """Return whether the attitudes of the device are measured."""
        return self.tracker.has_mavlink or now < self._measured_at + MEASURED_AGE

    def _measured(
        self, q: Sequence[float], frame: YawFrame, now: float,
    ) -> GimbalDeviceAttitudeStatus:
        """Return the status of a device without MAVLink that has an attitude."""
        heading = self.vehicle.heading(now)
        return GimbalDeviceAttitudeStatus(
            0, 0, mav.time_boot_ms(now), int(frame.flag), q, math.nan, math.nan, math.nan, 0,
            math.nan if heading is None else heading, math.nan)

    def _receive_attitude(self, status: GimbalDeviceAttitudeStatus, now: float) -> None:
        self._device.receive_status(status, now)
        self.setpoints.rate_stop.reported(status, now)
        if not self.tracker.has_mavlink and self.is_active:
            setpoints = self.setpoints
            flags = 0 if setpoints.current is None else setpoints.current.operation
            limits = sum(AT_LIMIT[AXES.index(one.axis)] for one in setpoints.clipped)
            self._report(replaced(
                status, flags=status.flags | flags, gimbal_device_id=self.tracker.device_id,
                failure_flags=status.failure_flags | limits))

    def vehicle_changed(self, now: float) -> None:
        """Send the vehicle's state to the device, unless an autopilot does."""
        if self.tracker.device is not None and self.is_active and (
                message := self.vehicle.for_device(self.tracker.device, now)):
            self._commands.send(message)

    # Players

    def receive_setpoint(self, source: Address, message: AnySetpoint, now: float) -> None:
        """Receive a setpoint of a player."""
        if source == self.address and self._commands.refusal:
            # The client in this process ends its own rate, which has ended already.
            return
        if (message.target_system not in (0, self.address.system)
                or message.target_component not in (0, self.address.component)
                or message.gimbal_device_id not in (0, self.tracker.device_id)):
            return
        try:
            self._follow(source, read_setpoint(message, self._device.ranges), now)
        except ValueError as error:
            self.events.emit(RequestRefused(source, str(error)))

    def execute(self, source: Address, command: AnyCommand, now: float) -> int | None:
        """See :meth:`Payload.execute`."""
        self._commands.schedule.by(self.poll, now)
        params = params_of(command)
        if command.command == mavlink.MAV_CMD_REQUEST_MESSAGE:
            return self._send_requested(params[0], now)
        if command.command == mavlink.MAV_CMD_SET_MESSAGE_INTERVAL:
            # Each player needs the status, so none may stop it.
            is_status = params[0] == gimbal.GimbalManagerStatus.id
            return mavlink.MAV_RESULT_DENIED if is_status else None
        if command.command not in gimbal.DEVICE_ID_PARAM:
            return None
        device_id = params[gimbal.DEVICE_ID_PARAM[command.command]]
        try:
            if device_id not in (0, self.tracker.device_id):
                raise Refused(f'gimbal device id {device_id:g} is neither '
                              f'{self.tracker.device_id} nor 0 for all')
            if command.command != mavlink.MAV_CMD_DO_GIMBAL_MANAGER_CONFIGURE:
                self._move(source, command, now)
            # Control may be released at the end.
            elif self.is_active or self._commands.refusal:
                self._control_changed(self.control.configure(source, params, now), now)
            else:
                return self._inactive_result
        except (ValueError, OverflowError) as error:
            # The result of a command has no reason.
            self.events.emit(RequestRefused(source, str(error)))
            return error.result if isinstance(error, Refused) else mavlink.MAV_RESULT_DENIED
        return mavlink.MAV_RESULT_ACCEPTED

    def _move(self, source: Address, command: AnyCommand, now: float) -> None:
        """Follow angles, rates or a place."""
        self._check_active()
        if command.command == mavlink.MAV_CMD_DO_GIMBAL_MANAGER_PITCHYAW:
            *angles_and_rates, flags, _, _ = params_of(command)
            self._follow(source, Setpoint.from_pitch_yaw(
                0 if math.isnan(flags) else int(flags), *map(math.radians, angles_and_rates)), now)
        else:
            self._check_control(source)
            is_none = command.command == mavlink.MAV_CMD_DO_SET_ROI_NONE
            self.setpoints.point(None if is_none else read_roi(command), now)

    @property
    def is_active(self) -> bool:
        """Whether it announces the device and gives it setpoints."""
        return self.tracker.state is ManagerState.ACTIVE

    def _check_active(self) -> None:
        """Raise :class:`Refused` if the manager gives no setpoints now."""
        if self._commands.refusal or not self.is_active:
            raise Refused(self._commands.refusal or 'the manager is not active: '
                          f'{self.tracker.state.value}', self._inactive_result)

    @property
    def _inactive_result(self) -> int:
        """Return the result of commands while the manager is not active."""
        return (mavlink.MAV_RESULT_DENIED if self.tracker.state is ManagerState.INACTIVE
                else mavlink.MAV_RESULT_TEMPORARILY_REJECTED)

    def _control_changed(self, changes: Sequence[RoleHolderChanged], now: float) -> None:
        # The gimbal stays where it points until the next player sends a setpoint.
        for change in changes:
            if change.role is Role.SECONDARY:
                self.setpoints.end_offsets(now, keep=self.control.primary.holder is None)
            else:
                if change.after == self.control.holder(Role.SECONDARY):
                    # Offsets do not shift the setpoints of the player that sent them.
                    self.setpoints.end_offsets(now, keep=True)
                self.setpoints.stop(now)
            self.events.emit(change)
        if changes and self._status_due < math.inf and now >= self._changed_at + CHANGE_INTERVAL:
            # An additional status, so that players need not wait for the next regular one.
            self._changed_at = now
            self._report(self.status(now))

    def _follow(self, player: Address, request: Setpoint, now: float) -> None:
        """Follow the request of a player, unless it is refused."""
        self._check_active()
        if self.control.secondary.holder == player != self.control.primary.holder:
            self.setpoints.add(request, self.settings.nudge_limit, now)
        else:
            self._check_control(player)
            self.setpoints.set(request, now)

    def _check_control(self, player: Address) -> None:
        """Raise :class:`Refused` unless a player has primary control."""
        holder = self.control.primary.holder
        if holder != player:
            raise Refused(
                f'{holder} has control' if holder else 'the player must take control first')

    # Reports

    def _report(self, message: mav.Message) -> None:
        """Send a message to all players."""
        self._commands.send(message)
        self._reported(message)

    def status(self, now: float) -> gimbal.GimbalManagerStatus:
        """Return GIMBAL_MANAGER_STATUS, which contains the players in control."""
        setpoint, device = self.setpoints.current, self._device.status(now)
        flags = 0 if setpoint is None else setpoint.device_flags
        if device is not None:
            flags |= device.flags & mavlink.GIMBAL_DEVICE_FLAGS_ACCEPTS_YAW_IN_EARTH_FRAME
        control = Control(self.control.primary.holder, self.control.secondary.holder)
        return gimbal.GimbalManagerStatus(
            mav.time_boot_ms(now), flags, self.tracker.device_id, *control.params())

    def _send_requested(self, message_id: float, now: float) -> int | None:
        make: dict[int, Callable[[float], mav.Message | None]] = {
            gimbal.GimbalManagerInformation.id: self._own_information,
            gimbal.GimbalManagerStatus.id: self.status,
            gimbal.GimbalDeviceInformation.id: self._device_information}
        if message_id not in make:
            return None
        message = make[int(message_id)](now)
        if not self.is_active or message is None:
            self._is_awaited |= message_id == gimbal.GimbalManagerInformation.id
            return self._inactive_result
        self._report(message)
        return mavlink.MAV_RESULT_ACCEPTED

    def _own_information(self, now: float) -> gimbal.GimbalManagerInformation | None:
        """Return GIMBAL_MANAGER_INFORMATION, None while GIMBAL_DEVICE_INFORMATION is awaited."""
        if self._device.is_awaited:
            # Clients request the message once, and would never know the device's capabilities.
            return None
        # The manager itself computes the attitude towards a place.
        capabilities = (
            self._device.capabilities | mavlink.GIMBAL_MANAGER_CAP_FLAGS_CAN_POINT_LOCATION_GLOBAL)
        return gimbal.GimbalManagerInformation(
            mav.time_boot_ms(now), capabilities, self.tracker.device_id,
            **range_fields(self._device.ranges))

    def _device_information(self, now: float) -> gimbal.GimbalDeviceInformation | None:
        """Return GIMBAL_DEVICE_INFORMATION, which clients may request from the manager."""
        device_id, device = self.tracker.device_id, self._device
        if self.tracker.has_mavlink:
            return device.information and replaced(
                device.information, gimbal_device_id=device_id)
        return gimbal.GimbalDeviceInformation(
            mav.time_boot_ms(now), b'illuminator_ros', b'gimbal behind ROS', b'', 0, 0, 0,
            device.capabilities & 0xFFFF, 0, **range_fields(device.ranges),
            gimbal_device_id=device_id, cap_flags2=0)
