# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Finds gimbals by the managers that announce them, and keeps each of them up to date."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field
import math

from .events import GimbalEvent, GimbalKey
from .gimbal import Gimbal, GimbalSettings
from .gimbal_reports import GIMBAL_MESSAGE
from .messages import (
    GimbalDeviceInformation,
    GimbalManagerInformation,
    GimbalManagerSetAttitude,
    GimbalManagerStatus,
    NON_MAVLINK_IDS,
    rates_of,
    REMOVE_SENDER,
)
from .vehicle_state import VehicleState
from ..mavlink.command_sender import Command, CommandSender, request_message
from ..mavlink.component import Payload
from ..mavlink.dialect import mavlink
from ..mavlink.messages import Address, Heartbeat, Message
from ..mavlink.retries import Retries
from ..payload.discovery import Discovery, FORGET_AFTER
from ..payload.listeners import Listeners
from ..payload.messages import Attitude, GimbalDeviceAttitudeStatus, GlobalPositionInt

# The most gimbals, so that memory is bounded. The gimbal with the configured id is kept, too.
MAX_GIMBALS = 32
# Components that may be managers. A further component replaces a long silent one (FORGET_AFTER).
MAX_COMPONENTS = 256
# s of silence after which a component that is heard again may have restarted.
RETURN_AFTER = 5.0
# s between requests to different components, so that a slow line is not filled.
REQUEST_SPACING = 0.25
# s; the delay of the request to a component that is less likely to manage a gimbal.
UNLIKELY_DELAY = 1.0


@dataclass
class _Component:
    heard_at: float
    query: Retries = field(default_factory=lambda: Retries(GIMBAL_MESSAGE))
    # Whether it has announced a gimbal with the id 0.
    lacks_id: bool = False


class GimbalClient(Payload):
    """
    Finds gimbals on a link by GIMBAL_MANAGER_INFORMATION.

    The client requests it from each component that is heard, at growing intervals until it comes:
    the capability bits of managers are optional.

    :param commands: the command sender of the component that carries this payload.
    :param vehicle: that carries all gimbals, if it is known here.
    :param is_measured: returns whether attitudes are measured, which no message says, given s.
    :ivar events: the events of all gimbals.
    :ivar discovery: the gimbals that were announced.
    :ivar gimbals: in the order in which they were found.
    """

    messages = (Heartbeat, GimbalManagerInformation, GimbalManagerStatus, GimbalDeviceInformation,
                GimbalDeviceAttitudeStatus, Attitude, GlobalPositionInt)
    sends = (GimbalManagerSetAttitude,)
    streams = (sends,)

    def __init__(
        self, commands: CommandSender, settings: GimbalSettings,
        vehicle: VehicleState | None = None,
        is_measured: Callable[[float], bool] = lambda now: True,
    ) -> None:
        self.events: Listeners[GimbalEvent] = Listeners()
        self.discovery = Discovery[GimbalKey, Gimbal](
            commands.schedule, self.events.emit,
            limit=lambda key: MAX_GIMBALS + (key.device_id == self.settings.device_id))
        self.gimbals: Mapping[GimbalKey, Gimbal] = self.discovery.devices
        self.settings = settings
        self._commands = commands
        self.is_measured = is_measured
        self._vehicle = vehicle
        # By system id.
        self._vehicles: dict[int, VehicleState] = {}
        self._components: dict[Address, _Component] = {}
        self._next_query = -math.inf

    def change_settings(self, settings: GimbalSettings, now: float) -> None:
        """Take other settings, see :meth:`Gimbal.change_settings`."""
        self.settings = settings
        for gimbal in self.gimbals.values():
            gimbal.change_settings(settings, now)

    # Link

    def link_closed(self, now: float, reason: str) -> None:
        """See :meth:`Payload.link_closed`."""
        for gimbal in self.gimbals.values():
            gimbal.components_lost(gimbal.reports.addresses, now, reason)

    def components_lost(self, lost: Collection[Address], now: float, reason: str) -> None:
        """See :meth:`Payload.components_lost`."""
        for gimbal in self.gimbals.values():
            gimbal.components_lost(lost, now, reason)

    def receive(self, source: Address, message: Message, now: float) -> None:
        """See :meth:`Payload.receive`."""
        if isinstance(message, GimbalDeviceAttitudeStatus):
            if gimbal := self._sender(source, message.gimbal_device_id, now):
                gimbal.receive_attitude(message, now)
        elif isinstance(message, Heartbeat):
            self._hear(source, message, now)
            for gimbal in self.gimbals.values():
                if gimbal.reports.heard(source, now, message.autopilot):
                    gimbal.update(now)
        elif isinstance(message, GimbalManagerStatus):
            if gimbal := self._managed(source, message.gimbal_device_id, now):
                gimbal.receive_status(source, message, now)
                if gimbal.reports.lacks_information_of(source):
                    self._reopen(source, now)
        elif isinstance(message, GimbalManagerInformation):
            if gimbal := self._managed(source, message.gimbal_device_id, now):
                if manager := gimbal.reports.announce(source, now):
                    manager.information = message
                    gimbal.update(now)
                component = self._components.get(source)
                if component is not None and not any(
                        one.reports.lacks_information_of(source)
                        for one in self.gimbals.values()):
                    component.query.stop()
        elif isinstance(message, Attitude | GlobalPositionInt):
            if (source.component == mavlink.MAV_COMP_ID_AUTOPILOT1
                    and (vehicle := self._vehicles.get(source.system))):
                vehicle.receive(message, now)
        elif (isinstance(message, GimbalDeviceInformation)
                and (gimbal := self._sender(source, message.gimbal_device_id, now))):
            gimbal.reports.device.receive_information(message)

    # Gimbals

    def _managed(self, manager: Address, device_id: int, now: float) -> Gimbal | None:
        """Return the gimbal that a manager announces, None if there are too many."""
        if component := self._components.get(manager):
            component.lacks_id = not device_id
        if not device_id:
            # PX4 announces 0 until it has found its device.
            return None
        key = (GimbalKey(manager, device_id) if device_id in NON_MAVLINK_IDS else
               GimbalKey(Address(manager.system, device_id)))
        return self.discovery.hear(key, now, lambda key: Gimbal(
            key, manager, self._commands, self.settings, self.events.emit), proved=True)

    def _sender(self, source: Address, number: int, now: float) -> Gimbal | None:
        """
        Return the gimbal that has sent a message of a device.

        Implementations older than the field gimbal_device_id send 0 for each device. Some devices
        send their own component id instead of 0.
        """
        if number == source.component and number not in NON_MAVLINK_IDS:
            number = 0
        found = self.gimbals.get(GimbalKey(source, number))
        if found is None and not number:
            own = [one for key, one in self.gimbals.items() if key.address == source]
            found = own[0] if len(own) == 1 else None
            if len(own) > 1:
                for one in own:
                    one.reports.device.without_id.hear(now)
        return found

    def vehicle(self, key: GimbalKey) -> VehicleState:
        """Return the vehicle that carries a gimbal."""
        return self._vehicle or self._vehicles.setdefault(key.address.system, VehicleState())

    # Discovery

    def managers_without_id(self, now: float) -> list[Address]:
        """Return the managers that are heard and announce a gimbal with the id 0."""
        return [address for address, component in self._components.items()
                if component.lacks_id and now < component.heard_at + RETURN_AFTER]

    def _component(self, address: Address, now: float) -> _Component | None:
        """Return a component that may be a manager, None if there are too many."""
        components = self._components
        if address not in components:
            if len(components) >= MAX_COMPONENTS:
                silent = min(components, key=lambda one: components[one].heard_at)
                if now < components[silent].heard_at + FORGET_AFTER:
                    return None
                del components[silent]
            components[address] = _Component(now)
        return components[address]

    def _hear(self, source: Address, heartbeat: Heartbeat, now: float) -> None:
        is_known = source in self._components
        if component := self._component(source, now):
            is_likely = (heartbeat.autopilot != mavlink.MAV_AUTOPILOT_INVALID
                         or heartbeat.type == mavlink.MAV_TYPE_GIMBAL)
            if not is_known:
                component.query.due = now if is_likely else now + UNLIKELY_DELAY
            elif now >= component.heard_at + RETURN_AFTER:
                component.query = Retries(GIMBAL_MESSAGE)
            component.heard_at = now
            self._set_due()

    def _reopen(self, manager: Address, now: float) -> None:
        """Request the information of a manager that has sent a status but no information."""
        component = self._component(manager, now)
        if component is not None and component.query.due == math.inf:
            component.query = Retries(GIMBAL_MESSAGE, now)
            self._set_due()

    def _request_information(self, now: float) -> None:
        if now >= self._query_due():
            address, component = min(self._components.items(), key=lambda item: item[1].query.due)
            component.query.note_try(now)
            self._next_query = now + REQUEST_SPACING
            if now < component.heard_at + FORGET_AFTER:
                self._commands.start(request_message(address, GimbalManagerInformation.id), now)
        self._set_due()

    def _set_due(self) -> None:
        self._commands.schedule.at(self._request_information, self._query_due())

    def _query_due(self) -> float:
        return max(self._next_query, min(
            [one.query.due for one in self._components.values()], default=math.inf))

    # The end

    def may_send_at_end(self, sent: Command | Message) -> bool:
        """See :meth:`Payload.may_send_at_end`: a release of control, and rates of zero."""
        if isinstance(sent, Command):
            return (sent.command == mavlink.MAV_CMD_DO_GIMBAL_MANAGER_CONFIGURE
                    and sent.params[0] == REMOVE_SENDER)
        return (isinstance(sent, GimbalManagerSetAttitude)
                and not any((*map(math.isfinite, sent.q), *rates_of(sent))))

    def close(self, now: float) -> None:
        """See :meth:`Payload.close`."""
        for gimbal in self.gimbals.values():
            gimbal.close(now)
