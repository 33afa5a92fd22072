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

"""Both sides of the illuminator protocol wired together: real bytes, a clock that jumps."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
import math
from typing import Any

from illuminator_ros.illuminator.events import LightEvent, LightSnapshot
from illuminator_ros.illuminator.light import Light
from illuminator_ros.illuminator.light_control import LightSettings
from illuminator_ros.illuminator.simulated import SimulatedIlluminator
from illuminator_ros.illuminator.simulated_properties import IlluminatorProperties
from illuminator_ros.mavlink import messages as mav
from illuminator_ros.mavlink.component import Endpoint
from illuminator_ros.mavlink.dialect import decode
from illuminator_ros.mavlink.frame import Decoder
from illuminator_ros.payload.confirmed_command import Result
from illuminator_ros.payload.device_events import DeviceFound
from illuminator_ros.simulation.simulated import SimulatedComponent, SimulatedComponents
from support.client import Client
from support.faulty_wire import Faults, FaultyWire
from support.frames import Codec
from support.records import Answer, Recorder

BRIDGE = mav.Address(1, 193)
ONE_LIGHT = (IlluminatorProperties(),)
# s; the initial time of a pair: not 0, so that a wrong use of 0 as a time shows.
START = 1000.0
# Turns at one moment: more of them mean that a link's thread would spin.
MAX_TURNS = 100


class _End:
    """One end of the line: an endpoint, its sequence numbers, and its decoder."""

    def __init__(self, endpoint: Endpoint, wire: FaultyWire) -> None:
        self.endpoint = endpoint
        self.wire = wire
        self.decoder = Decoder()
        self.classes = {cls.id: cls for cls in endpoint.messages}
        self.sent: list[tuple[float, Any]] = []
        self.received: list[tuple[float, mav.Address, Any]] = []
        self._codec = Codec()

    def flush(self, now: float) -> None:
        while self.endpoint.outgoing:
            source, message = self.endpoint.outgoing.popleft()
            if not self.wire.is_open:
                continue
            self.sent.append((now, message))
            self.wire.send(self._codec.frame(source, message), now)

    def take(self, data: bytes, now: float) -> None:
        for frame in self.decoder.feed(data):
            cls = self.classes.get(frame.message_id)
            if cls is not None:
                message = decode(cls, frame.payload)
                self.received.append((now, frame.source, message))
                self.endpoint.receive(frame.source, message, now)
                self.flush(now)


class Pair:
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
        self.now = START
        self.recorders: dict[mav.Address, Recorder] = {}
        self._on_light = on_light
        self.controller = Client(
            BRIDGE, settings or LightSettings(), command_timeout=command_timeout,
            command_retries=command_retries)
        self.controller.events.subscribe(self._take)
        self.other = (lights if isinstance(lights, Endpoint)
                      else SimulatedComponents(map(SimulatedIlluminator, lights), START - uptime))
        there = there or Faults()
        self.near = _End(self.controller, FaultyWire(there, f'{seed} there'))
        self.far = _End(self.other, FaultyWire(back or there, f'{seed} back'))
        self._turns = 0
        self.open()

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

    # Time

    def next_deadline(self) -> float:
        """Return when something happens next."""
        return min(self.controller.next_deadline(), self.other.next_deadline(),
                   self.near.wire.next_arrival(), self.far.wire.next_arrival())

    def step(self, until: float = math.inf) -> bool:
        """Advance to the next event, but to ``until`` at most; return whether there was one."""
        due = self.next_deadline()
        if due > until:
            self.now = max(self.now, until)
            return False
        self._turns = self._turns + 1 if due <= self.now else 0
        assert self._turns < MAX_TURNS, f'a link would spin: deadline {due} at {self.now}'
        self.now = max(self.now, due)
        self.turn()
        return True

    def turn(self) -> None:
        """Do what a link's thread does in one turn, at both ends."""
        for end, wire in ((self.far, self.near.wire), (self.near, self.far.wire)):
            for data in wire.receive(self.now):
                end.take(data, self.now)
        for end in (self.far, self.near):
            if self.now >= end.endpoint.next_deadline():
                end.endpoint.poll(self.now)
            end.flush(self.now)
        wakes_at = self.controller.next_deadline()
        for light in self.controller.lights.values():
            assert wakes_at <= light.next_deadline(), 'a link would sleep'

    def run(self, seconds: float) -> None:
        """Let time pass."""
        until = self.now + seconds
        while self.step(until):
            pass

    def run_until(self, condition: Callable[[], Any], *, within: float = 60.0) -> None:
        """Let time pass until a condition holds; raise an error after ``within`` s."""
        until = self.now + within
        while not condition():
            assert self.step(until), f'not so within {within} s'

    def settle(self, seconds: float = 3.5) -> Pair:
        """Let both sides discover each other, until the line is empty."""
        self.run(seconds)
        return self

    # The line

    def mend(self) -> None:
        """End the faults of the line."""
        for end in (self.near, self.far):
            end.wire.faults = Faults()

    def open(self) -> None:  # noqa: A003
        """Open the line."""
        self._switch(is_open=True)
        self.controller.link_opened(self.now)
        self.other.link_opened(self.now)
        self.turn()

    def close(self) -> None:
        """Close the line; frames on it are lost."""
        self._switch(is_open=False)
        self.controller.link_closed(self.now, 'closed')
        self.other.link_closed(self.now, 'closed')
        self.turn()

    def _switch(self, *, is_open: bool) -> None:
        for end in (self.near, self.far):
            end.wire.switch(is_open=is_open)
            end.decoder = Decoder()

    # Requests

    def ask_enable(
        self, on: bool, light: Light | None = None, *, is_stream: bool = False,
    ) -> Answer:
        """Begin to switch a light on or off."""
        answer = Answer(self.now)
        (light or self.light).control.enable(on, self.now, answer, is_stream=is_stream)
        self.turn()
        return answer

    def ask_configure(self, light: Light | None = None, **changes: Any) -> Answer:
        """Begin to configure a light."""
        answer = Answer(self.now)
        (light or self.light).control.configure(changes, self.now, answer)
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
