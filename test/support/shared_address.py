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

"""Several lights that answer from one address."""

from __future__ import annotations

from typing import Any

from illuminator_ros.illuminator.light import Light, Settings
from illuminator_ros.illuminator.simulated import SimulatedIlluminator
from illuminator_ros.illuminator.simulated_properties import IlluminatorProperties
from illuminator_ros.mavlink.component import Endpoint
from illuminator_ros.mavlink.dialect import mavlink
from illuminator_ros.mavlink.messages import Address, CommandAck, heartbeat
from illuminator_ros.payload.attempt import Result
from illuminator_ros.payload.simulated import SimulatedComponent
from support.client import Client
from support.fake_light import FakeLight
from support.frames import Codec, LIGHT
from support.simulated_link import SimulatedLink

BRIDGE = Address(1, 193)


class TwoDevices:
    """
    Two simulated lights with one address, each with its own sequence numbers, on a link.

    :param numbers: the first sequence number of each.
    :param later: s by which the second one was started later.
    """

    def __init__(self, numbers: tuple[int, int], later: float) -> None:
        self.link = SimulatedLink(Client(BRIDGE, Settings()), self._take)
        self.lights = [
            SimulatedComponent(
                SimulatedIlluminator(IlluminatorProperties()), self.link.now - 100.0 + one)
            for one in (0.0, later)]
        self._codecs = [Codec(), Codec()]
        for codec, number in zip(self._codecs, numbers, strict=True):
            for _ in range(number):
                codec.frame(LIGHT, heartbeat(mavlink.MAV_TYPE_ILLUMINATOR))
        self._near = Codec()

    def _take(self, data: bytes, peer: object) -> None:
        for source, message in self._near.messages(data):
            for light in self.lights:
                light.receive(source, message, self.link.now)
        self._flush()

    def _flush(self) -> None:
        for light, codec in zip(self.lights, self._codecs, strict=True):
            while light.outgoing:
                frame = codec.frame(*light.outgoing.popleft())
                self.link.socket.inbox.append((frame, ('127.0.0.1', 20_000)))

    def run(self, seconds: float) -> None:
        """Let time pass."""
        until = self.link.now + seconds
        while self.link.now < until:
            for light in self.lights:
                light.poll(self.link.now)
            self._flush()
            due = min(*(light.next_deadline() for light in self.lights), until)
            self.link.run(due - self.link.now + 0.001)

    def enable(self, on: bool) -> Result:
        """Switch the light on or off, as the client sees one, and return the result."""
        results: list[Result] = []
        self.link.ask(lambda now: self.light.enable(
            on, now, lambda result, now: results.append(result)))
        self.run(3.0)
        [result] = results
        return result

    @property
    def light(self) -> Light:
        """Return the light as the client sees it."""
        client = self.link.endpoint
        assert isinstance(client, Client)
        light: Light = client.lights[LIGHT]
        return light


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
        self.lights = lights
        for number, light in enumerate(lights):
            light.outgoing = self.outgoing
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

    def poll(self, now: float) -> None:
        for light in self.lights:
            light.poll(now)

    def next_deadline(self) -> float:
        return min(light.next_deadline() for light in self.lights)
