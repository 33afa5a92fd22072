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

"""Requests and parameters while several lights answer from one address."""

from __future__ import annotations

from typing import Any

from illuminator_ros.illuminator.events import (
    AddressShared,
    ChangeCause,
    LightEvent,
    StatusReceived,
)
from illuminator_ros.illuminator.model import Status
from illuminator_ros.illuminator.simulated_properties import FAULTS
from illuminator_ros.illuminator.status_tracker import AddressConflict
from illuminator_ros.mavlink.dialect import mavlink
from illuminator_ros.mavlink.messages import Address
import pytest
from support.back_to_back import Pair
from support.fake_light import FakeLight, status_message
from support.shared_address import SharedAddress, TwoDevices

AUTOPILOT = Address(1, 1)
ON_OFF, CONFIGURE = mavlink.MAV_CMD_ILLUMINATOR_ON_OFF, mavlink.MAV_CMD_DO_ILLUMINATOR_CONFIGURE


def two(
    *, boot: float = 0.0, offset: float = 0.01, streams: tuple[float, float] = (1.0, 1.0),
    **second: Any,
) -> tuple[Pair, list[FakeLight]]:
    """Return a pair with two lights behind one component, the second one different."""
    lights = [FakeLight(AUTOPILOT, heartbeat_type=None, stream=streams[0]),
              FakeLight(AUTOPILOT, heartbeat_type=None, stream=streams[1], **second)]
    lights[0].pushes = lights[1].pushes = True
    lights[1].boot = boot
    return Pair(SharedAddress(*lights, offset=offset)), lights


@pytest.fixture
def lights() -> list[FakeLight]:
    return []


@pytest.fixture
def different(lights: list[FakeLight]) -> Pair:
    """Return two lights of which one is on and less bright, for long enough to be detected."""
    pair, both = two(enable=1, brightness=40.0)
    lights += both
    return pair.settle(6.0)


@pytest.mark.parametrize('offset', [0.0, 0.01, 0.5])
def test_parameters_move_once_at_most_and_nothing_is_sent_while_lights_differ(
    offset: float,
) -> None:
    pair, lights = two(enable=1, brightness=40.0, offset=offset)
    pair.settle(60.0)
    assert [cause for cause, _ in pair.recorder.changes][1:] in ([], [ChangeCause.LIGHT])
    assert pair.commands(CONFIGURE, ON_OFF) == []
    assert pair.recorder.events == ['connected']
    assert len(pair.recorder.statuses) >= 110
    agreed = pair.snapshot.configuration
    for light in lights:
        # Lose a status.
        light.delay_status(1.0)
        pair.run(5.0)
    assert pair.snapshot.shared_address
    assert pair.snapshot.configuration == agreed
    pair.close()
    assert not pair.snapshot.shared_address


def test_a_status_is_published_before_it_shows_that_an_address_is_shared_and_an_event_tells_it(
) -> None:
    pair, _ = two(enable=1, brightness=40.0)
    events: list[tuple[type[LightEvent], bool]] = []

    def note(event: LightEvent) -> None:
        if isinstance(event, AddressShared):
            events.append((AddressShared, event.shared))
        elif isinstance(event, StatusReceived):
            # The event precedes the comparison with earlier statuses, which would delay topics.
            events.append((StatusReceived, pair.snapshot.shared_address))

    pair.controller.events.subscribe(note)
    pair.settle(6.0)
    # A node that is made later takes the events of the snapshot.
    assert AddressShared(pair.light.address, True) in pair.snapshot.events()
    pair.configure(brightness=70.0)
    pair.enable(True)
    pair.run(6.0)
    assert list(dict.fromkeys(events)) == [
        (StatusReceived, False), (AddressShared, True), (StatusReceived, True),
        (AddressShared, False)]
    assert [kind for kind, _ in events].count(AddressShared) == 2


def test_lights_with_different_clocks_do_not_look_restarted() -> None:
    pair = two(boot=-3600.0)[0].settle(10.0)
    restarts = pair.light.restarts
    assert pair.snapshot.shared_address
    pair.run(60.0)
    assert pair.light.restarts == restarts <= 3


@pytest.mark.parametrize('obeys', [True, False])
def test_a_switch_is_not_confirmed_while_several_lights_answer(
    different: Pair, lights: list[FakeLight], obeys: bool,
) -> None:
    lights[0].applies = obeys
    result = different.enable(True)
    assert [light.fields['enable'] for light in lights] == [int(obeys), 1]
    assert not result.success
    assert 'several lights answer as 1/1' in result.message


@pytest.mark.parametrize(('streams', 'boot'), [
    ((1.0, 1.0), 0.0), ((1.0, 1.0), 500.0), ((1.0, 0.2), 500.0), ((0.2, 1.0), 500.0)],
    ids=['one clock', 'equal rates', 'fast second', 'fast first'])
def test_a_switch_fails_where_one_of_two_lights_does_not_obey(
    streams: tuple[float, float], boot: float,
) -> None:
    pair, lights = two(boot=boot, streams=streams)
    lights[0].fields['enable'] = 1
    lights[0].pushes = lights[1].pushes = False
    pair.settle(15.0)
    assert pair.snapshot.shared_address
    # The second light only streams: it answers neither commands nor requests.
    lights[1].results = {ON_OFF: None, mavlink.MAV_CMD_REQUEST_MESSAGE: None}
    lights[1].applies = False
    for _ in range(10):
        result = pair.enable(True)
        assert not result.success, result.message
        pair.run(2.0)
    assert pair.light.restarts <= 1


@pytest.mark.parametrize('later', [0.002, 0.037, 1.2])
@pytest.mark.parametrize('numbers', [(0, 1), (0, 20), (0, 128), (5, 200)])
def test_two_equal_devices_started_together_are_told_apart_by_their_sequence_numbers(
    numbers: tuple[int, int], later: float,
) -> None:
    pair = TwoDevices(numbers, later)
    pair.run(40.0)
    assert pair.light.snapshot(pair.link.now).shared_address
    second = pair.lights[1]
    second.behave(FAULTS.add(second.behaviour, 'lie'), pair.link.now)
    for _ in range(10):
        result = pair.enable(True)
        assert not result.success, result.message


def test_two_devices_started_in_the_same_millisecond_are_taken_for_one() -> None:
    pair = TwoDevices((0, 0), 0.0)
    pair.run(40.0)
    assert not pair.light.snapshot(pair.link.now).shared_address


def test_light_whose_frames_come_again_over_a_slower_line_is_one_light() -> None:
    conflict = AddressConflict()
    for second in range(60):
        # The numbers of the slower line are 2 s and more than 64 frames behind.
        for sender, sent_at in ((0, 100 + second), (1, 98 + second)):
            conflict.take(Status.from_message(status_message(1000 * sent_at)),
                          100.1 + second + sender / 2, commanded=False, sender=sender)
    assert not conflict.detected


def test_a_set_makes_two_lights_equal_again(different: Pair) -> None:
    assert 'several lights answer as 1/1' in different.configure(brightness=70.0).message
    different.enable(True)
    different.run(6.0)
    assert not different.snapshot.shared_address
    assert different.snapshot.configuration
    assert different.snapshot.configuration.brightness == 70.0
