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

"""The drone's side of the illuminator protocol: finds lights and keeps each of them up to date."""

from __future__ import annotations

from collections.abc import Callable
import itertools
from typing import Any

from .events import AnyLightEvent, ClientSnapshot, LightFound
from .identity import Identity
from .light import Light, Settings
from .model import Status
from ..mavlink.command import CommandSender
from ..mavlink.deadline_queue import DeadlineQueue
from ..mavlink.messages import (
    Address,
    ComponentInformationBasic,
    Heartbeat,
    IlluminatorStatus,
    MavType,
)
from ..payload.events import Listeners

# Lights that are kept apart; one more is passed over, so that memory is bounded.
MAX_LIGHTS = 128
# Lights outside the target that are remembered, to name them where the target is not there.
MAX_LEFT_ALONE = 8
# Lost lights that are looked for at once, so that a slow line is not filled.
MAX_ASKED = 8


class IlluminatorClient:
    """
    Finds illuminators on a link by what they send, never by their ids.

    A component is one if its HEARTBEAT says so (MAV_TYPE_ILLUMINATOR) or if it sends
    ILLUMINATOR_STATUS; ArduSub's lights have no heartbeat of their own.

    :param commands: the command sender of the component that carries this payload.
    :param wanted: tells whether a light at an address is of interest; others are left alone.
    :ivar events: the events of all lights.
    :ivar lights: those found so far, by address, in the order in which they were found.
    :ivar left_alone: the first lights that are not wanted, by address.
    :ivar passed_over: whether there were more lights than :data:`MAX_LIGHTS`.
    """

    messages = (Heartbeat, IlluminatorStatus, ComponentInformationBasic)

    def __init__(
        self, commands: CommandSender, settings: Settings, *,
        wanted: Callable[[Address], bool] = lambda source: True,
    ) -> None:
        self.commands = commands
        self.settings = settings
        self.lights: dict[Address, Light] = {}
        self.left_alone: dict[Address, None] = {}
        self.passed_over = False
        self.events: Listeners[AnyLightEvent] = Listeners()
        self._wanted = wanted
        self._agenda: DeadlineQueue[Address] = DeadlineQueue()

    @property
    def commanded_or_found(self) -> list[Light]:
        """Return every light that may be on, by address."""
        return [self.lights[address] for address in sorted(self.lights)]

    def snapshot(self, now: float) -> ClientSnapshot:
        """Return what is known of all lights, for any thread; call it in the link's thread."""
        return ClientSnapshot(
            {address: light.snapshot(now) for address, light in self.lights.items()},
            tuple(self.left_alone), self.passed_over)

    def link_opened(self, now: float) -> None:
        """See :meth:`Payload.link_opened`."""
        # A returning light answers immediately; its own heartbeat may take a second.
        for light in self.lights.values():
            light.link_opened(now)
        lost = (light for light in self.lights.values() if not light.connected)
        for light in itertools.islice(lost, MAX_ASKED):
            light.request_status(now)

    def link_closed(self, now: float, reason: str) -> None:
        """See :meth:`Payload.link_closed`."""
        for light in self.lights.values():
            light.link_closed(reason)
        self._schedule_all()

    def receive(self, source: Address, message: Any, now: float) -> None:
        """See :meth:`Payload.receive`."""
        if isinstance(message, IlluminatorStatus):
            light = self._light(source)
            if light:
                light.take_status(Status.from_message(message), now)
        elif isinstance(message, Heartbeat):
            is_light = message.type == MavType.ILLUMINATOR
            light = self._light(source) if is_light else self.lights.get(source)
            if light:
                light.heard(now)
        elif isinstance(message, ComponentInformationBasic):
            light = self.lights.get(source)
            if light:
                light.take_information(Identity.from_message(message), now)
        self._schedule(source)

    def _schedule(self, source: Address) -> None:
        """Enter when a light has something to do, after anything that may have changed it."""
        light = self.lights.get(source)
        if light is not None:
            self._agenda.set(source, light.next_deadline())

    def _schedule_all(self) -> None:
        for source in self.lights:
            self._schedule(source)

    def _light(self, source: Address) -> Light | None:
        """Return the light at an address, a new one if need be; None if it is passed over."""
        light = self.lights.get(source)
        if light is None and self._wanted(source):
            if len(self.lights) >= MAX_LIGHTS:
                self.passed_over = True
                return None
            light = self.lights[source] = Light(
                source, self.commands, self.settings, self.events.emit,
                lambda: self._schedule(source))
            self.events.emit(LightFound(source))
        elif light is None and len(self.left_alone) < MAX_LEFT_ALONE:
            self.left_alone[source] = None
        return light

    def poll(self, now: float) -> None:
        """See :meth:`Payload.poll`."""
        # A command of any light may have ended.
        self._schedule_all()
        for source in self._agenda.due(now):
            self.lights[source].poll(now)
            self._schedule(source)

    def next_deadline(self) -> float:
        """See :meth:`Payload.next_deadline`."""
        return self._agenda.next_deadline()
