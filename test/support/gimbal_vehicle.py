# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""A vehicle on one link: an autopilot, a simulated gimbal, and its manager."""

from __future__ import annotations

import math
from typing import Any

from illuminator_ros.gimbal.manager import GimbalManager, ManagerSettings
from illuminator_ros.gimbal.manager_control import ControlSettings
from illuminator_ros.gimbal.simulated_device import GimbalProperties, SimulatedGimbal
from illuminator_ros.mavlink.command_sender import CommandSender
from illuminator_ros.mavlink.component import Component, Endpoint, HeartbeatTimer
from illuminator_ros.mavlink.dialect import mavlink
from illuminator_ros.mavlink.messages import Address, CommandAck, Message
from illuminator_ros.payload.messages import Attitude, GlobalPositionInt
from illuminator_ros.simulation.simulated import SimulatedComponents
from support.gimbal_manager import AUTOPILOT, DEVICE, OURS

HERE = 47.0, 8.0, 500.0
mavlink.MAV_TYPE_QUADROTOR = 2


class Autopilot(Endpoint):
    """Reports a vehicle that heads east."""

    messages = ()
    sends = (Attitude, GlobalPositionInt)

    def __init__(self) -> None:
        super().__init__()
        self._heartbeat = HeartbeatTimer(AUTOPILOT, mavlink.MAV_TYPE_QUADROTOR, self.outgoing,
                                         self.schedule)

    def link_opened(self, now: float) -> None:
        self._heartbeat.send(now)
        self.schedule.at(self._report, now)

    def receive(self, source: Address, message: Message, now: float) -> None:
        return

    def _report(self, now: float) -> None:
        self.schedule.at(self._report, now + 0.1)
        latitude, longitude, altitude = HERE
        for message in (
                Attitude(0, 0.0, 0.0, math.pi / 2, 0.0, 0.0, 0.0),
                GlobalPositionInt(0, round(latitude * 1e7), round(longitude * 1e7),
                                  round(altitude * 1e3), round(altitude * 1e3), 0, 0, 0, 0)):
            self.outgoing.append((AUTOPILOT, message))


class Vehicle(Endpoint):
    """
    Endpoints that hear each other and the link, as behind a router.

    :ivar acks: all acknowledgements that they have sent.
    """

    def __init__(self, *endpoints: Endpoint) -> None:
        super().__init__()
        self.endpoints = endpoints
        self.acks: list[CommandAck] = []
        self.messages = tuple(dict.fromkeys(cls for one in endpoints for cls in one.messages))
        self.sends = tuple(dict.fromkeys(cls for one in endpoints for cls in one.sends))

    def link_opened(self, now: float) -> None:
        for one in self.endpoints:
            one.link_opened(now)
        self._route(now)

    def receive(self, source: Address, message: Message, now: float) -> None:
        for one in self.endpoints:
            if type(message) in one.messages:
                one.receive(source, message, now)
        self._route(now)

    def poll(self, now: float) -> None:
        for one in self.endpoints:
            one.schedule.run(now)
        self._route(now)

    def _route(self, now: float) -> None:
        while any(one.outgoing for one in self.endpoints):
            for sender in self.endpoints:
                while sender.outgoing:
                    source, message = sender.outgoing.popleft()
                    self.outgoing.append((source, message))
                    if isinstance(message, CommandAck):
                        self.acks.append(message)
                    for one in self.endpoints:
                        if one is not sender and type(message) in one.messages:
                            one.receive(source, message, now)
        self.schedule.at(self.poll, min(one.schedule.due for one in self.endpoints))


def managed_vehicle(
    control: ControlSettings, now: float, **settings: Any,
) -> tuple[GimbalManager, SimulatedGimbal, Vehicle]:
    """Return a vehicle with a gimbal and its manager; ``settings`` are of the manager."""
    commands = CommandSender(OURS)
    manager = GimbalManager(commands, ManagerSettings(control, **settings), lambda: 0.25)
    device = SimulatedGimbal(GimbalProperties(DEVICE))
    devices = SimulatedComponents([device], now)
    return manager, device, Vehicle(Component(commands, [manager]), Autopilot(), devices)
