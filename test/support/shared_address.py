# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Several lights that answer from one address."""

from __future__ import annotations

from typing import Any

from illuminator_ros.mavlink.component import Endpoint
from illuminator_ros.mavlink.messages import Address, CommandAck
from support.fake_light import FakeLight


class SharedAddress(Endpoint):
    """
    Lights behind one component, as in ArduSub: each reports, and the component answers.

    :param lights: lights with one address; commands reach all of them.
    :param offset: s by which the statuses of each come after those of the one before.
    """

    messages = FakeLight.messages

    def __init__(self, *lights: FakeLight, offset: float = 0.0) -> None:
        super().__init__()
        # The first light sends the heartbeats.
        self.outgoing = lights[0].outgoing
        self.schedule = lights[0].schedule
        self.lights = lights
        for number, light in enumerate(lights):
            light.outgoing = self.outgoing
            light.use(self.schedule)
            light.beats = light.beats and not number
            light.delay_status(number * offset)

    def link_opened(self, now: float) -> None:
        for light in self.lights:
            light.link_opened(now)

    def receive(self, source: Address, message: Any, now: float) -> None:
        for number, light in enumerate(self.lights):
            before = len(self.outgoing)
            light.receive(source, message, now)
            sent = [self.outgoing.pop() for _ in range(len(self.outgoing) - before)]
            self.outgoing += [one for one in reversed(sent)
                              if not (number and isinstance(one[1], CommandAck))]
