# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The commands to the manager of a gimbal: for control, a pose, a place."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from .commands import configure, Flag, point, SETPOINTS
from .events import GimbalKey
from .messages import GimbalManagerStatus
from ..mavlink.command_sender import CommandSender
from ..mavlink.messages import Address
from ..payload.attempt import Served, Target
from ..payload.device_property import plan_of, Property
from ..payload.messages import GimbalDeviceAttitudeStatus
from ..payload.requests import Goal

# The properties that commands set. A request for control has no source: all sources need it.
CONTROL, POSE, PLACE = 'control', 'pose', 'place'


class GimbalCommands:
    """
    Sends one manager of a gimbal what is wanted by command. No I/O; times are s.

    :param poll: of the gimbal.
    """

    def __init__(
        self, key: GimbalKey, manager: Address, commands: CommandSender,
        poll: Callable[[float], None],
    ) -> None:
        us, device_id = commands.address, key.device_id
        # By name, when the newest status came, and the time between it and the one before, s.
        self._gaps: dict[str, tuple[float, float]] = {}
        # The status of the manager confirms control, the status of the device a pose:
        # ArduPilot's manager does not report the flags. No status shows the place.
        self._properties: dict[str, Property[Any]] = {
            CONTROL: Property(Target(
                manager, commands, 'gimbal manager', poll, GimbalManagerStatus.id,
                GimbalManagerStatus.msgname, needs_status=True),
                plan_of(lambda goal: configure(us, device_id, take=goal.values))),
            POSE: Property(Target(
                manager, commands, 'gimbal device', poll, GimbalDeviceAttitudeStatus.id,
                GimbalDeviceAttitudeStatus.msgname, key.address, needs_status=True),
                plan_of(lambda goal: goal.values.change(device_id))),
            PLACE: Property(Target(manager, commands, 'gimbal manager', poll), plan_of(
                lambda goal: point(device_id, goal.values)))}

    @property
    def may_move(self) -> bool:
        """Whether a command is under way that may turn the gimbal."""
        return any(self._properties[name].is_busy for name in (POSE, PLACE))

    def step(self, control: Goal | None, move: Goal | None, now: float) -> list[Served[Any]]:
        """Have what is wanted under way; return the requests of commands that were withdrawn."""
        goals = {CONTROL: control}
        if move is not None and not isinstance(move.values, SETPOINTS):
            # Another place, of a topic, may be under way.
            goals[POSE if isinstance(move.values, Flag) else PLACE] = move._replace(gives_way=True)
        return [served for name, one in self._properties.items() for served in one.steer(
            goals.get(name), now, None, self._gaps.get(name, (0.0, None))[1])]

    def reported(self, name: str, status: Any, now: float) -> list[Served[Any]]:
        """Receive a status that shows a property; return the requests that have ended."""
        before, _ = self._gaps.get(name, (now, 0.0))
        self._gaps[name] = now, now - before
        return self._properties[name].reported(status, now - before, now)

    def poll(self, now: float) -> list[Served[Any]]:
        """Do what is due; return the requests that have ended."""
        return [served for one in self._properties.values() for served in one.poll(now)]

    @property
    def due(self) -> float:
        """Return when :meth:`poll` has something to do, s."""
        return min(one.due for one in self._properties.values())
