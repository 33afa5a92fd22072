# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""A simulated light on a bench."""

from __future__ import annotations

from typing import Any

from illuminator_ros.illuminator.simulated import SimulatedIlluminator
from illuminator_ros.illuminator.simulated_properties import (
    FAULTS,
    IlluminatorBehaviour,
    IlluminatorProperties,
)
from support.bench import DeviceBench


class LightBench(DeviceBench):
    """One simulated light with faults, which has just been switched on."""

    def __init__(
        self, *faults: str, properties: IlluminatorProperties | None = None, seed: int = 0,
        **fields: Any,
    ) -> None:
        behaviour = fields.pop('behaviour', IlluminatorBehaviour())
        for fault in faults:
            behaviour = FAULTS.add(behaviour, fault)
        super().__init__(SimulatedIlluminator(properties or IlluminatorProperties(
            behaviour=behaviour, seed=seed, **fields)))
        self.lamp: SimulatedIlluminator = self.device

    def status(self) -> Any:
        """Return the ILLUMINATOR_STATUS of this moment."""
        return self.lamp.status(self.now)

    def shown(self) -> tuple[float, ...]:
        """Return mode, brightness, strobe period and duty cycle as the status reports them."""
        status = self.status()
        return (status.mode, status.brightness, status.strobe_period, status.strobe_duty_cycle)
