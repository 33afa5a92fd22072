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

"""Lights that were there before the link, or their own power, was lost."""

from __future__ import annotations

from illuminator_ros.illuminator.client import MAX_ASKED
from illuminator_ros.illuminator.simulated_properties import IlluminatorProperties
from illuminator_ros.mavlink.messages import Address, MavCmd
import pytest
from support.back_to_back import Pair
from support.fake_light import FakeLight


class Unaware(FakeLight):
    """Does not notice that the link was opened, and goes on as before."""

    def link_opened(self, now: float) -> None:
        pass


def test_a_light_is_back_before_its_next_heartbeat() -> None:
    light = Unaware(stream=0)
    pair = Pair(light).settle()
    pair.close()
    light.heartbeat.due = pair.now + 60
    pair.open()
    pair.run(0.1)
    assert pair.light.connected


def test_no_more_lights_are_looked_for_at_once_than_a_slow_line_bears() -> None:
    pair = Pair([IlluminatorProperties(address=Address(1, 1 + i))
                 for i in range(3 * MAX_ASKED)]).settle()
    pair.close()
    pair.open()
    assert len(pair.commands(MavCmd.REQUEST_MESSAGE, since=pair.now)) == MAX_ASKED


CYCLES = 200


def left_behind(pair: Pair) -> dict[str, int]:
    """Return how much of each thing is kept that comes and goes with requests."""
    return {'lights': len(pair.controller.lights), 'commands': len(pair.controller.sender)}


@pytest.mark.parametrize(('dark', 'events'), [
    (0.5, ['restarted']), (4.0, ['lost', 'connected', 'restarted'])],
    ids=['too short to be lost', 'lost'])
def test_two_hundred_power_cycles_are_each_told_once_and_configured_and_leave_nothing_behind(
    fake: FakeLight, dark: float, events: list[str],
) -> None:
    pair = Pair(fake).settle()
    assert pair.configure(brightness=40).success
    pair.run(10.0)
    before, begun = left_behind(pair), pair.now
    pair.recorder.events.clear()

    for _ in range(CYCLES):
        fake.silent = True
        pair.run(dark)
        fake.silent = False
        fake.restart(pair.now)
        pair.run(1.0)
        assert fake.fields['brightness'] == 40.0
        pair.run(4.0)

    assert [event.partition(':')[0] for event in pair.recorder.events] == CYCLES * events
    assert len(pair.commands(MavCmd.DO_ILLUMINATOR_CONFIGURE, since=begun)) == CYCLES
    assert pair.light.restarts == CYCLES
    assert left_behind(pair) == before
