# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Discovery and liveness of lights."""

from __future__ import annotations

from typing import Any

from illuminator_ros.illuminator import events
from illuminator_ros.illuminator.settings import LightSettings
from illuminator_ros.mavlink import messages as mav
from illuminator_ros.mavlink.dialect import mavlink
from illuminator_ros.payload.device_events import DeviceConnected, DeviceForgotten, DeviceFound
from illuminator_ros.payload.discovery import MAX_CANDIDATES, MAX_DEVICES
import pytest
from support.back_to_back import BRIDGE, Pair
from support.client import Client
from support.fake_light import FakeLight, LIGHT, status_message

ILLUMINATOR = mav.heartbeat(mavlink.MAV_TYPE_ILLUMINATOR)
ANSWER = mav.CommandAck(mavlink.MAV_CMD_REQUEST_MESSAGE, 0, 0, 0, *BRIDGE)
FORGED = [mav.Address(system, component) for system in (2, 3) for component in range(1, 200)]


class Heard(Client):
    """A client with an open link, which keeps the events."""

    def __init__(self, **options: Any) -> None:
        super().__init__(BRIDGE, LightSettings(), **options)
        self.heard: list[events.LightEvent] = []
        self.events.subscribe(self.heard.append)
        self.link_opened(0.0)

    def run(self, until: float) -> None:
        """Let time pass without a peer."""
        while (due := self.schedule.due) <= until:
            self.schedule.run(due)


@pytest.fixture
def client() -> Heard:
    return Heard()


@pytest.mark.parametrize('source', [
    LIGHT, mav.Address(1, 1), mav.Address(255, 0), mav.Address(7, 190), mav.Address(1, 255)])
@pytest.mark.parametrize('messages', [[ILLUMINATOR, ANSWER], [status_message()]],
                         ids=['heartbeat and answer', 'status'])
def test_a_light_is_found_by_its_messages_at_any_address(
    client: Heard, source: mav.Address, messages: list[mav.Message],
) -> None:
    for message in messages:
        client.receive(source, message, 0.0)
    assert list(client.lights) == [source]
    assert client.lights[source].connected
    assert client.heard[:2] == [DeviceFound(source), DeviceConnected(source)]


@pytest.mark.parametrize('message', [
    ILLUMINATOR, mav.heartbeat(mavlink.MAV_TYPE_ONBOARD_CONTROLLER), mav.heartbeat(0), ANSWER,
    mav.ComponentInformationBasic(0, 0, 0, b'maker', b'torch', b'1', b'1', b'n'),
], ids=lambda message: type(message).__name__)
def test_one_message_that_any_component_may_send_announces_no_light(
    client: Heard, message: mav.Message,
) -> None:
    client.receive(LIGHT, message, 0.0)
    assert client.lights == {}
    assert client.heard == []


def test_forged_heartbeats_do_not_keep_a_real_light_out() -> None:
    pair = Pair(FakeLight(stream=0.0))
    for source in FORGED:
        pair.controller.receive(source, ILLUMINATOR, pair.now)
    pair.run(4.0)
    assert list(pair.controller.lights) == [LIGHT]
    assert pair.enable(True).success


def test_forged_heartbeats_get_25_commands_a_second_at_most_and_hide_no_light() -> None:
    pair = Pair(FakeLight(stream=0.0))
    for source in FORGED[:320]:
        pair.controller.receive(source, ILLUMINATOR, pair.now)
        pair.run(1 / 32)
    pair.run(1.0)
    commands = pair.commands(mavlink.MAV_CMD_REQUEST_MESSAGE)
    assert len(commands) <= 25 * 11
    assert list(pair.controller.lights) == [LIGHT]


def test_candidates_are_bounded_cost_few_commands_and_give_way_to_a_status(client: Heard) -> None:
    for source in FORGED:
        client.receive(source, ILLUMINATOR, 0.0)
    targets = {message.target_component for _, message in client.outgoing
               if hasattr(message, 'target_component')}
    assert len(targets) <= MAX_CANDIDATES
    client.receive(LIGHT, status_message(), 0.0)
    assert list(client.lights) == [LIGHT]


def test_silent_lights_that_were_never_commanded_give_their_places_to_others(
    client: Heard,
) -> None:
    for source in FORGED[:MAX_DEVICES]:
        client.receive(source, status_message(), 0.0)
    client.lights[FORGED[0]].enable(True, 0.0, lambda result, now: None)
    client.run(55.0)
    assert len(client.lights) == MAX_DEVICES
    client.run(70.0)
    client.receive(LIGHT, status_message(), 70.0)
    assert list(client.lights) == [FORGED[0], LIGHT]
    forgotten = [event.key for event in client.heard
                 if isinstance(event, DeviceForgotten)]
    assert sorted(forgotten) == FORGED[1:MAX_DEVICES]
    assert [light.address for light in client.lights_by_address] == [LIGHT, FORGED[0]]


def test_a_light_that_is_not_wanted_is_named_and_not_commanded() -> None:
    client = Heard(wanted=lambda source: source.system == 2)
    for system in (1, 2):
        client.receive(mav.Address(system, 243), status_message(), 0.0)
    assert list(client.lights) == [mav.Address(2, 243)]
    assert list(client.discovery.ignored) == [mav.Address(1, 243)]
    assert {message.target_system for _, message in client.outgoing
            if hasattr(message, 'target_system')} == {2}
