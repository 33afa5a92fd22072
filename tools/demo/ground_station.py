# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""A ground station: a second MAVLink sender that changes the light, without ROS."""

from __future__ import annotations

from queue import SimpleQueue

from illuminator_ros.mavlink.command_sender import Command, CommandResult, CommandSender
from illuminator_ros.mavlink.component import Component
from illuminator_ros.mavlink.dialect import mavlink
from illuminator_ros.mavlink.link import Link
from illuminator_ros.mavlink.messages import Address
from illuminator_ros.mavlink.url import parse_url

ADDRESS = Address(255, 190)


class GroundStation:
    """Sends commands to a light."""

    def __init__(self, url: str) -> None:
        self._commands = CommandSender(ADDRESS)
        component = Component(self._commands, [], mav_type=mavlink.MAV_TYPE_GCS)
        self._link = Link(parse_url(url), component, label=url)
        self._link.start()

    def configure(self, light: Address, mode: int, brightness: float, strobe_period: float,
                  duty_cycle: float, timeout: float = 5.0) -> CommandResult:
        """
        Send MAV_CMD_DO_ILLUMINATOR_CONFIGURE and return its result.

        :param brightness: %, 0..100.
        :param strobe_period: s; 0 means no strobe.
        :param duty_cycle: %, 0..100.
        :param timeout: s.
        """
        command = Command(light, mavlink.MAV_CMD_DO_ILLUMINATOR_CONFIGURE,
                          (mode, brightness, strobe_period, duty_cycle))
        results: SimpleQueue[CommandResult] = SimpleQueue()

        def start(now: float) -> None:
            self._commands.start(command, now, lambda result, now: results.put(result),
                                 deadline=now + timeout)

        self._link.call(start)
        return results.get(timeout=timeout + 1.0)

    def close(self) -> None:
        """Close the link."""
        self._link.stop()
