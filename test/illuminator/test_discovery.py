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

"""Which components on a link are taken for lights."""

import math

from illuminator_ros.illuminator.client import MAX_LIGHTS
from illuminator_ros.illuminator.events import LightFound
from illuminator_ros.illuminator.light import Settings
from illuminator_ros.illuminator.simulated_properties import IlluminatorProperties
from illuminator_ros.mavlink.component import CONFLICT_MEMORY
from illuminator_ros.mavlink.messages import (
    Address,
    CommandAck,
    ComponentInformationBasic,
    Heartbeat,
    heartbeat,
    IlluminatorStatus,
    MavType,
)
import pytest
from support.back_to_back import BRIDGE, Pair
from support.client import Client
from support.fake_light import FakeLight, status_message

ILLUMINATOR = heartbeat(MavType.ILLUMINATOR)
SUBMARINE = 12


@pytest.fixture
def controller() -> Client:
    controller = Client(BRIDGE, Settings())
    controller.link_opened(0.0)
    return controller


def test_our_heartbeat_goes_out_before_anything_else():
    pair = Pair().settle()
    kinds = [message.id for _, message in pair.near.sent]
    assert kinds[0] == Heartbeat.id
    assert len(set(kinds)) > 1


def test_our_heartbeat_says_what_we_are(controller):
    (source, message), = controller.outgoing
    assert source == BRIDGE
    assert (message.type, message.autopilot) == (MavType.ONBOARD_CONTROLLER, 8)


def test_our_heartbeat_comes_once_a_second(controller):
    for tenth in range(50):
        controller.poll(tenth / 10)
    assert len(controller.outgoing) == 5


def test_nothing_is_sent_before_the_link_is_open():
    controller = Client(BRIDGE, Settings())
    controller.poll(0.0)
    assert not controller.outgoing


def test_nothing_is_sent_after_the_link_was_closed(controller):
    controller.receive(Address(1, 243), ILLUMINATOR, 0.0)
    controller.outgoing.clear()
    controller.link_closed(0.1, 'lost')
    for second in range(10):
        controller.poll(float(second))
    assert not controller.outgoing
    assert controller.next_deadline() == math.inf


def test_whoever_comes_within_hearing_gets_a_heartbeat_at_once(controller):
    controller.outgoing.clear()
    controller.link_opened(0.1)
    assert [type(message) for _, message in controller.outgoing] == [Heartbeat]


@pytest.mark.parametrize('source', [
    Address(1, 243), Address(1, 1), Address(255, 0), Address(7, 190), Address(1, 255)])
@pytest.mark.parametrize('message', [ILLUMINATOR, status_message()], ids=['heartbeat', 'status'])
def test_a_light_is_known_by_what_it_sends_from_whatever_address(controller, source, message):
    controller.receive(source, message, 0.0)
    assert list(controller.lights) == [source]
    assert controller.lights[source].connected


@pytest.mark.parametrize('message', [
    heartbeat(MavType.ONBOARD_CONTROLLER), heartbeat(SUBMARINE), heartbeat(0),
    CommandAck(405, 0, 0, 0, 1, 194),
    ComponentInformationBasic(0, 0, 0, b'maker', b'torch', b'1', b'1', b'n'),
], ids=lambda message: message.name)
def test_the_id_of_an_illuminator_proves_nothing(controller, message):
    controller.receive(Address(1, 243), message, 0.0)
    assert controller.lights == {}


def test_each_light_is_announced_once_in_the_order_of_appearance():
    found = []
    controller = Client(BRIDGE, Settings())
    controller.events.subscribe(
        lambda event: found.append(event.address) if isinstance(event, LightFound) else None)
    for source in (Address(1, 244), Address(1, 243), Address(1, 244)):
        controller.receive(source, ILLUMINATOR, 0.0)
        controller.receive(source, status_message(), 0.0)
    assert found == [Address(1, 244), Address(1, 243)]


def test_further_lights_are_passed_over_when_there_are_too_many(controller):
    sources = [Address(system, component) for system in (2, 3) for component in range(256)]
    for source in sources[:MAX_LIGHTS]:
        controller.receive(source, ILLUMINATOR, 0.0)
    assert not controller.passed_over
    for source in sources[MAX_LIGHTS:]:
        controller.receive(source, ILLUMINATOR, 0.0)
        controller.receive(source, status_message(), 0.0)
    assert controller.passed_over
    assert list(controller.lights) == sources[:MAX_LIGHTS]


def test_a_light_that_is_not_wanted_is_left_alone():
    controller = Client(BRIDGE, Settings(), wanted=lambda source: source.system == 2)
    for system in (1, 2):
        controller.receive(Address(system, 243), ILLUMINATOR, 0.0)
        controller.receive(Address(system, 243), status_message(), 0.0)
    assert list(controller.lights) == [Address(2, 243)]
    assert {message.target_system for _, message in controller.outgoing} == {2}


def test_a_heartbeat_from_our_own_address_is_a_clash_for_a_while(controller):
    assert not controller.address_conflict(0.0)
    controller.receive(BRIDGE, heartbeat(SUBMARINE), 5.0)
    assert controller.address_conflict(5.0)
    assert controller.address_conflict(5.0 + CONFLICT_MEMORY - 0.1)
    assert not controller.address_conflict(5.0 + CONFLICT_MEMORY)


@pytest.mark.parametrize('message', [ILLUMINATOR, status_message()], ids=['heartbeat', 'status'])
def test_nobody_at_our_own_address_is_a_light(controller, message):
    controller.receive(BRIDGE, message, 0.0)
    assert controller.lights == {}


def test_several_lights_are_known_apart():
    sources = [Address(1, 243), Address(1, 244), Address(2, 243)]
    pair = Pair([IlluminatorProperties(address=source) for source in sources]).settle()
    light = pair.controller.lights[sources[1]]
    answer = pair.ask_enable(True, light)
    assert pair.wait_for(answer).success
    pair.run(2.0)
    states = {source: light.status.enabled for source, light in pair.controller.lights.items()}
    assert states == {sources[0]: False, sources[1]: True, sources[2]: False}


def test_a_light_without_a_heartbeat_of_its_own_lives_by_its_statuses():
    pair = Pair(FakeLight(Address(1, 1), heartbeat_type=None)).settle()
    pair.run(60.0)
    assert pair.recorder.events == ['connected']


def test_a_light_found_by_its_status_lives_by_the_heartbeat_of_its_autopilot():
    fake = FakeLight(Address(1, 1), heartbeat_type=SUBMARINE)
    pair = Pair(fake).settle()
    fake.stream = 0.0
    fake.answers.clear()
    pair.run(60.0)
    assert pair.recorder.events == ['connected']


def test_the_statuses_that_a_light_sends_are_all_passed_on(pair):
    before = len(pair.recorder.statuses)
    pair.run(10.0)
    received = [message for _, _, message in pair.near.received
                if isinstance(message, IlluminatorStatus)]
    assert len(pair.recorder.statuses) == len(received) >= before + 10


def test_the_address_of_everybody_is_nobody():
    pair = Pair(FakeLight(Address(0, 7))).settle()
    assert not pair.controller.lights
