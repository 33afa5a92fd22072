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

"""Random schedules of users, restarts, lost links and other senders end in the true state."""

from __future__ import annotations

from dataclasses import replace
import random

from illuminator_ros.illuminator.light import Light, Settings
from illuminator_ros.illuminator.model import Mode
from illuminator_ros.illuminator.simulated_properties import IlluminatorProperties
from illuminator_ros.illuminator.thermal import ThermalProperties
from illuminator_ros.mavlink.messages import Address
import pytest
from support.back_to_back import Pair
from support.faulty_wire import Faults
from support.records import Answer

SECONDS = 90.0
# s after the repair of the line within which all requests must be answered and all states known:
# for example, a restored configuration is sent again after 2 s.
RECOVERY = 12.0
# s; the tries of a command, its confirmation, and the requests before it in the queue.
LONGEST = 32.0
LIGHTS = [IlluminatorProperties(address=Address(1, one), thermal=ThermalProperties(rise=0.0))
          for one in (243, 244)]


class Chaos:
    """Takes random actions."""

    def __init__(self, seed: int) -> None:
        self.draw = random.Random(seed)
        faults = Faults(**{kind: self.draw.choice((0.0, 0.1, 0.3)) for kind in (
            'drop', 'duplicate', 'reorder', 'delay', 'corrupt')})
        settings = Settings(status_interval=self.draw.choice((0.0, 0.2)),
                            restore_configuration=self.draw.random() < 0.7)
        self.pair = Pair(LIGHTS, there=faults, settings=settings, seed=seed,
                         uptime=self.draw.choice((0.0, 1000.0)))
        self.lights = self.pair.devices
        self.sets: list[Answer] = []
        self.others: list[Answer] = []
        self.is_open = True

    def act(self) -> None:
        """Take one random action."""
        users = [self.enable, self.configure, self.publish, self.refresh] * 4
        self.draw.choice([*users, self.cut, self.open, self.restart, self.change, self.hush])()
        self.pair.turn()

    def light(self) -> Light | None:
        lights: list[Light | None] = [*self.pair.controller.lights.values()]
        return self.draw.choice(lights or [None])

    def answer(self, answers: list[Answer]) -> Answer:
        """Append a new answer to the list, and return it."""
        answer = Answer(self.pair.now)
        answers.append(answer)
        return answer

    def enable(self) -> None:
        if light := self.light():
            light.enable(self.draw.random() < 0.5, self.pair.now, self.answer(self.others))

    def configure(self) -> None:
        if light := self.light():
            values = {'brightness': self.draw.randrange(101),
                      'strobe_period': self.draw.choice((0, 1))}
            light.configure(values, self.pair.now, self.answer(self.sets))

    def publish(self) -> None:
        if light := self.light():
            for _ in range(self.draw.randint(1, 5)):
                light.set_brightness(float(self.draw.randrange(101)), self.pair.now)

    def refresh(self) -> None:
        if light := self.light():
            light.refresh(self.pair.now, self.answer(self.others))

    def cut(self) -> None:
        self.pair.close()
        self.is_open = False

    def open(self) -> None:  # noqa: A003
        if not self.is_open:
            self.pair.open()
            self.is_open = True

    def restart(self) -> None:
        self.draw.choice(self.lights).restart(self.pair.now)

    def change(self) -> None:
        """Let another sender change a light."""
        lamp = self.draw.choice(self.lights).device
        lamp.enabled = self.draw.random() < 0.5
        lamp.configuration = replace(
            lamp.configuration, mode=self.draw.choice(list(Mode)[1:]),
            brightness=float(self.draw.randrange(101)))

    def hush(self) -> None:
        """Lose all frames of the lights for 1 to 6 s; after 3 s a light is lost."""
        faults = self.pair.far.wire.faults
        self.pair.far.wire.faults = replace(faults, drop=1.0)
        self.pair.run(self.draw.uniform(1.0, 6.0))
        self.pair.far.wire.faults = faults


@pytest.mark.parametrize('seed', range(30))
def test_random_schedules_end_with_one_answer_each_and_the_true_state(seed: int) -> None:
    chaos = Chaos(seed)
    pair = chaos.pair
    end = pair.now + SECONDS
    while pair.now < end:
        chaos.act()
        pair.run(chaos.draw.choice((0.0, 0.01, 0.1, 0.5, 2.0)))
    pair.mend()
    chaos.open()
    pair.run(RECOVERY)

    assert {len(answer.results) for answer in chaos.sets + chaos.others} == {1}
    assert max(answer.seconds for answer in chaos.sets) <= 0.9
    assert max(answer.seconds for answer in chaos.others) <= LONGEST
    for simulated in chaos.lights:
        light = pair.controller.lights[simulated.address]
        assert light.connected
        followed = light.snapshot(pair.now).configuration
        assert followed is not None
        actual = simulated.device.configuration
        # Under external sync only the mode is followed.
        assert followed.mode is actual.mode
        assert followed == actual or actual.mode is Mode.EXTERNAL_SYNC
        assert light.status is not None
        assert light.status.enabled == simulated.device.enabled
        assert light.next_deadline() > pair.now
    assert pair.controller.sender.next_deadline() == float('inf')
