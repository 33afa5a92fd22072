# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""A winch beside a light: one link, one address, unchanged shared modules."""

from typing import Any

from illuminator_ros.cli.payloads import PAYLOADS
from illuminator_ros.cli.simulator.components import components, Scenario, scenario
from illuminator_ros.cli.simulator.console import execute
from illuminator_ros.cli.simulator.options import parser, payload_types
from illuminator_ros.illuminator.client import IlluminatorClient
from illuminator_ros.illuminator.settings import LightSettings
from illuminator_ros.mavlink.command_sender import CommandSender
from illuminator_ros.mavlink.component import Component, Endpoint
from illuminator_ros.mavlink.dialect import mavlink
from illuminator_ros.mavlink.messages import (
    Address,
    CommandAck,
    CommandLong,
    Heartbeat,
    Message,
)
from illuminator_ros.payload.requests import Result
from illuminator_ros.simulation.simulated import SimulatedComponents
from payloads.winch import WINCH, WinchClient, WinchReport
import pytest

PAYLOAD_TYPES = {**PAYLOADS, 'winch': WINCH}
BRIDGE, LIGHT, DECK = Address(1, 193), Address(1, 243), Address(1, 169)


def simulated(*arguments: str, file: object = None) -> SimulatedComponents[Any]:
    """Return the components of ``simulator --payload illuminator,winch`` with more arguments."""
    args = ['--payload', 'illuminator,winch', *arguments]
    types = payload_types(args, PAYLOAD_TYPES)
    options = parser(types, PAYLOAD_TYPES).parse_args(args)
    content = scenario(file, 'f.yaml', types) if file else Scenario()
    return SimulatedComponents(components(options, content, types), 0.0)


class Vehicle:
    """A light and a winch on one link, and one component that is a client of both."""

    def __init__(self) -> None:
        self.devices = simulated()
        commands = CommandSender(BRIDGE)
        self.lights = IlluminatorClient(commands, LightSettings())
        self.winches = WinchClient(commands)
        self.reports: list[WinchReport] = []
        self.results: list[Result] = []
        self.sent: list[tuple[Address, Message]] = []
        self.lost: tuple[type[Message], ...] = ()
        self.winches.events.subscribe(self.reports.append)
        self.component = Component(commands, [self.lights, self.winches])
        self.now = 0.0
        self.component.link_opened(self.now)
        self.run(3.5)

    def release(self, length: float) -> None:
        def done(result: Result, now: float) -> None:
            self.results.append(result)

        self.winches.winches[DECK].release(length, self.now, done)

    def run(self, seconds: float, step: float = 0.01) -> None:
        end = self.now + seconds
        while self.now < end:
            ends: tuple[Endpoint, Endpoint] = (self.devices, self.component)
            for side, other in (ends, ends[::-1]):
                side.schedule.run(self.now)
                while side.outgoing:
                    source, message = side.outgoing.popleft()
                    self.sent.append((source, message))
                    if not isinstance(message, self.lost):
                        other.receive(source, message, self.now)
            self.now += step


@pytest.fixture
def vehicle() -> Vehicle:
    return Vehicle()


def test_one_component_with_one_heartbeat_finds_both(vehicle: Vehicle) -> None:
    assert (set(vehicle.lights.lights), set(vehicle.winches.winches)) == ({LIGHT}, {DECK})
    beats = [one for one, message in vehicle.sent if isinstance(message, Heartbeat)]
    assert beats.count(BRIDGE) == beats.count(LIGHT) == beats.count(DECK) == 4


def test_each_payload_gets_the_result_of_its_own_request(vehicle: Vehicle) -> None:
    lit: list[Result] = []
    vehicle.lights.lights[LIGHT].enable(
        True, vehicle.now, lambda result, now: lit.append(result))
    for length in (5.0, -9.0):
        vehicle.release(length)
        vehicle.run(1.0)
    assert [one.success for one in lit] == [True]
    assert [one.message.partition(' (')[0] for one in vehicle.results] == [
        '5 m released, confirmed by WINCH_STATUS: MAV_RESULT_ACCEPTED',
        'refused: MAV_RESULT_DENIED']
    assert vehicle.reports[-1] == WinchReport(DECK, 5.0)


@pytest.mark.parametrize(('fault', 'message'), [
    ('refuse=failed', 'refused: MAV_RESULT_FAILED'),
    ('lie', 'but WINCH_STATUS shows 0 m'), ('drop=1', 'no acknowledgement')])
def test_a_release_that_is_not_shown_by_a_status_is_no_success(
        fault: str, message: str, vehicle: Vehicle) -> None:
    for component in vehicle.devices.components:
        component.behave(component.device.faults.add(component.behaviour, fault), vehicle.now)
    vehicle.release(5.0)
    vehicle.run(5.0)
    (result,) = vehicle.results
    assert (result.success, message in result.message) == (False, True), result.message


def test_a_release_whose_acknowledgement_is_lost_is_sent_once_and_confirmed_by_the_status(
        vehicle: Vehicle) -> None:
    vehicle.lost = (CommandAck,)
    vehicle.release(2.0)
    vehicle.release(2.0)
    vehicle.run(5.0)

    assert [(one.success, one.message.partition(' (')[0]) for one in vehicle.results] == [
        (False, 'a release is under way'),
        (True, '2 m released, confirmed by WINCH_STATUS, without an acknowledgement')]
    assert sum(isinstance(message, CommandLong) and message.command == mavlink.MAV_CMD_DO_WINCH
               for _, message in vehicle.sent) == 1
    assert vehicle.reports[-1] == WinchReport(DECK, 2.0)


@pytest.mark.parametrize(('commanded', 'left'), [(False, set()), (True, {DECK})])
def test_a_silent_winch_is_forgotten_unless_it_was_commanded(
        vehicle: Vehicle, commanded: bool, left: set[Address]) -> None:
    if commanded:
        vehicle.release(1.0)
        vehicle.run(1.0)
    for component in vehicle.devices.components:
        component.behave(
            component.device.faults.add(component.behaviour, 'silence'), vehicle.now)
    vehicle.run(60.0, step=0.5)
    assert set(vehicle.winches.winches) == {DECK}
    vehicle.run(5.0, step=0.5)
    assert set(vehicle.winches.winches) == left


def test_the_console_gives_each_command_to_the_components_that_have_it() -> None:
    devices = simulated('--light', '1/9=bow', '--winch', '1/8=deck').components
    assert execute('on', devices, 0.0) == 'done'
    assert 'no command' in execute('deck on', devices, 0.0)
    assert [one.snapshot(0.0).text.split()[:3] for one in devices] == [
        ['1/9', 'bow', 'ON'], ['1/8', 'deck', '0.0']]


def test_a_file_lists_components_of_each_payload() -> None:
    file = {'lights': [{'id': '1/9'}], 'winches': [{'id': '1/8', 'name': 'deck'}], 'seed': 4}
    assert [(str(one.address), one.name) for one in simulated(file=file).components] == [
        ('1/9', ''), ('1/8', 'deck')]
