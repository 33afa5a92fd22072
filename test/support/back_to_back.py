# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Both sides of the illuminator protocol wired together: real bytes, a clock that jumps."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any

from illuminator_ros.illuminator.events import LightEvent, LightSnapshot
from illuminator_ros.illuminator.light import Light
from illuminator_ros.illuminator.settings import LightSettings
from illuminator_ros.illuminator.simulated import SimulatedIlluminator
from illuminator_ros.illuminator.simulated_properties import IlluminatorProperties
from illuminator_ros.mavlink import messages as mav
from illuminator_ros.mavlink.component import Endpoint
from illuminator_ros.payload.device_events import DeviceFound
from illuminator_ros.payload.requests import Result
from illuminator_ros.simulation.simulated import SimulatedComponent, SimulatedComponents
from support.client import Client
from support.records import Answer, Recorder
from support.wire import Faults, Line, START

BRIDGE = mav.Address(1, 193)
ONE_LIGHT = (IlluminatorProperties(),)


class Pair(Line):
    """
    A controller and lights, with a line between them.

    :param lights: what to simulate, or an endpoint such as a
        :class:`~support.fake_light.FakeLight`.
    :param there: the faults of the line towards the lights.
    :param back: its faults towards the controller; None means the same as ``there``.
    :param uptime: s for which simulated lights have been on at the beginning.
    :ivar now: s.
    """

    def __init__(
        self, lights: Sequence[IlluminatorProperties] | Endpoint = ONE_LIGHT, *,
        settings: LightSettings | None = None, there: Faults | None = None,
        back: Faults | None = None, seed: int | str = 0, uptime: float = 100.0,
        command_timeout: float = 0.25, command_retries: int = 3,
        on_light: Callable[[Light], None] = lambda light: None,
    ) -> None:
        self.recorders: dict[mav.Address, Recorder] = {}
        self._on_light = on_light
        self.controller = Client(
            BRIDGE, settings or LightSettings(), command_timeout=command_timeout,
            command_retries=command_retries)
        self.controller.events.subscribe(self._take)
        self.other = (lights if isinstance(lights, Endpoint)
                      else SimulatedComponents(map(SimulatedIlluminator, lights), START - uptime))
        there = there or Faults()
        super().__init__(self.controller, self.other, there=there, back=back or there, seed=seed,
                         keeps=True)

    def _take(self, event: LightEvent) -> None:
        if isinstance(event, DeviceFound):
            self.recorders[event.key] = Recorder()
            self._on_light(self.controller.lights[event.key])
        else:
            self.recorders[event.key](event)

    # Participants

    @property
    def light(self) -> Light:
        """Return the light that the controller has found first."""
        light: Light = next(iter(self.controller.lights.values()))
        return light

    @property
    def snapshot(self) -> LightSnapshot:
        """Return the state of that light."""
        return self.light.snapshot(self.now)

    @property
    def recorder(self) -> Recorder:
        """Return the events of that light."""
        return self.recorders[self.light.address]

    @property
    def devices(self) -> Sequence[SimulatedComponent[SimulatedIlluminator]]:
        """Return the simulated lights."""
        assert isinstance(self.other, SimulatedComponents)
        return self.other.components

    @property
    def device(self) -> SimulatedComponent[SimulatedIlluminator]:
        """Return the first simulated light."""
        return self.devices[0]

    @property
    def lamp(self) -> SimulatedIlluminator:
        """Return the state of the first simulated light."""
        return self.device.device

    def open(self) -> None:  # noqa: A003
        """See :class:`Line`."""
        super().open()
        self.turn()

    def settle(self, seconds: float = 3.5) -> Pair:
        """Let both sides discover each other, until the line is empty."""
        self.run(seconds)
        return self

    # Requests

    def ask_enable(
        self, on: bool, light: Light | None = None, *, is_call: bool = True,
    ) -> Answer:
        """Begin to switch a light on or off."""
        answer = Answer(self.now)
        (light or self.light).enable(on, self.now, answer, is_call=is_call)
        self.turn()
        return answer

    def ask_configure(self, light: Light | None = None, **changes: Any) -> Answer:
        """Begin to configure a light."""
        answer = Answer(self.now)
        (light or self.light).configure(changes, self.now, answer)
        self.turn()
        return answer

    def ask_refresh(self) -> Answer:
        """Begin to request status and identity."""
        answer = Answer(self.now)
        self.light.refresh(self.now, answer)
        self.turn()
        return answer

    def wait_for(self, answer: Answer) -> Result:
        """Wait for the result of a request, and return it."""
        self.run_until(lambda: answer.results)
        return answer.result

    def enable(self, on: bool) -> Result:
        """Switch the light on or off and return the result."""
        return self.wait_for(self.ask_enable(on))

    def configure(self, **changes: Any) -> Result:
        """Configure the light and return the result."""
        return self.wait_for(self.ask_configure(**changes))

    # Sent messages

    def commands(self, *kinds: int, since: float = 0.0) -> list[Any]:
        """Return the commands that the controller has sent, tries included, all or some kinds."""
        return [message for at, message in self.commands_at(*kinds) if at >= since]

    def commands_at(self, *kinds: int) -> Iterator[tuple[float, Any]]:
        """Return the same with the times of sending."""
        return ((at, message) for at, message in self.near.sent
                if isinstance(message, mav.CommandLong | mav.CommandInt)
                and (not kinds or message.command in kinds))
