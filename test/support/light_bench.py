# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""A simulated light on a bench: commands in, messages out, time as an argument."""

from __future__ import annotations

from typing import Any

from illuminator_ros.illuminator.simulated import SimulatedIlluminator
from illuminator_ros.illuminator.simulated_properties import (
    FAULTS,
    IlluminatorBehaviour,
    IlluminatorProperties,
)
from illuminator_ros.mavlink.messages import Address, CommandInt, CommandLong
from illuminator_ros.simulation.simulated import SimulatedComponent

GROUND = Address(255, 190)


class LightBench:
    """
    One simulated light.

    :ivar now: s.
    :ivar sent: each message that it has sent, with its time, since it was last cleared.
    """

    def __init__(
        self, *faults: str, properties: IlluminatorProperties | None = None, seed: int = 0,
        **fields: Any,
    ) -> None:
        behaviour = fields.pop('behaviour', IlluminatorBehaviour())
        for fault in faults:
            behaviour = FAULTS.add(behaviour, fault)
        self.component: SimulatedComponent[SimulatedIlluminator] = SimulatedComponent(
            SimulatedIlluminator(properties or IlluminatorProperties(
                behaviour=behaviour, seed=seed, **fields)), 0.0)
        self.lamp = self.component.device
        self.now = 0.0
        self.sent: list[tuple[float, Any]] = []

    def run(self, seconds: float) -> list[Any]:
        """Let time pass and return the messages that are sent meanwhile."""
        before, end = len(self.sent), self.now + seconds
        while (due := self.component.next_deadline()) <= end:
            self.now = max(self.now, due)
            self.component.poll(self.now)
            self._collect()
        self.now = end
        return [message for _, message in self.sent[before:]]

    def _collect(self) -> None:
        self.sent += [(self.now, message) for _, message in self.component.outgoing]
        self.component.outgoing.clear()

    def command(
        self, command: int, *params: float, target: tuple[int, int] | None = None,
        form: type = CommandLong,
    ) -> list[Any]:
        """Send a command and return the messages that answer it at once."""
        before, to = len(self.sent), target or self.component.address
        one, two, three, four, *_ = values = [*params, *[0.0] * (7 - len(params))]
        self.component.receive(GROUND, (
            CommandInt(*to, 0, command, 0, 0, one, two, three, four, 0, 0, 0.0)
            if form is CommandInt else CommandLong(*to, command, 0, *values)), self.now)
        self._collect()
        return [message for _, message in self.sent[before:]]

    def result(self, command: int, *params: float, **options: Any) -> int:
        """Send a command and return the MAV_RESULT that answers it."""
        return int(self.command(command, *params, **options)[0].result)

    def of(self, kind: type) -> list[tuple[float, Any]]:
        """Return the messages of one class that were sent, with their times."""
        return [(at, message) for at, message in self.sent if isinstance(message, kind)]

    def status(self) -> Any:
        """Return the ILLUMINATOR_STATUS of this moment."""
        return self.component.device.status(self.now)

    def shown(self) -> tuple[float, ...]:
        """Return mode, brightness, strobe period and duty cycle as the status reports them."""
        status = self.status()
        return (status.mode, status.brightness, status.strobe_period, status.strobe_duty_cycle)
