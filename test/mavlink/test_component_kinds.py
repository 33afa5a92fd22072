# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The kind of a component, by its heartbeat and the messages that it sends."""

from illuminator_ros.cli.payloads import devices, PAYLOADS
from illuminator_ros.mavlink.device_kind import DeviceKind
from illuminator_ros.mavlink.dialect import mavlink
from illuminator_ros.mavlink.messages import Address, Heartbeat
from illuminator_ros.mavlink.search.component_kinds import described, kinds
import pytest

AUTOPILOT = mavlink.MAV_TYPE_SUBMARINE, mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA
NO_AUTOPILOT = mavlink.MAV_AUTOPILOT_INVALID
ILLUMINATOR_STATUS, MANAGER_STATUS, ATTITUDE = 440, 281, 285


def beat(kind: int, autopilot: int = NO_AUTOPILOT) -> Heartbeat:
    return Heartbeat(kind, autopilot, 0, 0, mavlink.MAV_STATE_ACTIVE, 3)


@pytest.mark.parametrize(('address', 'heartbeat', 'messages', 'expected'), [
    ('1/1', beat(*AUTOPILOT), [], ['autopilot', 'ArduPilot']),
    ('1/1', beat(2, mavlink.MAV_AUTOPILOT_PX4), [], ['autopilot', 'PX4']),
    ('1/1', beat(2, 200), [], ['autopilot']),
    # ArduSub has a light, and each autopilot may manage a gimbal, without another component.
    ('1/1', beat(*AUTOPILOT), [ILLUMINATOR_STATUS], ['autopilot', 'ArduPilot', 'light']),
    ('1/1', beat(*AUTOPILOT), [MANAGER_STATUS, ATTITUDE],
     ['autopilot', 'ArduPilot', 'gimbal manager', 'gimbal']),
    ('1/243', beat(44), [], ['light']),
    # A light need not know that autopilot must be MAV_AUTOPILOT_INVALID.
    ('255/0', beat(44, 0), [ILLUMINATOR_STATUS], ['light']),
    ('1/243', None, [ILLUMINATOR_STATUS], ['light']),
    ('1/154', beat(mavlink.MAV_TYPE_GIMBAL), [ATTITUDE], ['gimbal']),
    # As its serial API describes its heartbeat.
    ('1/100', beat(0, 1), [], ['MicaSense camera']),
    ('1/100', beat(mavlink.MAV_TYPE_CAMERA), [], ['camera']),
    ('255/190', beat(mavlink.MAV_TYPE_GCS), [], ['ground station']),
    ('1/191', beat(mavlink.MAV_TYPE_ONBOARD_CONTROLLER), [], ['onboard computer']),
    ('1/42', beat(mavlink.MAV_TYPE_WINCH), [], ['winch']),
    ('1/42', beat(250), [], ['type 250']),
    ('1/42', None, [], []),
])
def test_a_component_has_the_kinds_of_its_heartbeat_and_of_its_messages(
    address: str, heartbeat: Heartbeat | None, messages: list[int], expected: list[str],
) -> None:
    assert kinds(Address(*map(int, address.split('/'))), heartbeat, messages,
                 devices(PAYLOADS)) == expected


def test_a_payload_of_another_package_adds_the_kinds_of_its_devices() -> None:
    winch = DeviceKind('deck winch', 42, (9005,))
    address = Address(1, 169)
    assert kinds(address, beat(42), [], [winch]) == ['deck winch']
    assert kinds(address, beat(*AUTOPILOT), [9005], [winch]) == [
        'autopilot', 'ArduPilot', 'deck winch']
    assert kinds(address, None, [], [winch]) == []


def test_devices_of_payloads_are_described_by_their_names() -> None:
    heartbeats = {Address(1, 100): beat(0, 1), Address(1, 154): beat(mavlink.MAV_TYPE_GIMBAL),
                  Address(1, 243): beat(44)}
    assert described([*heartbeats], heartbeats, devices(PAYLOADS)) == (
        '1/100 (MicaSense camera), 1/154 (gimbal) and 1/243 (light)')


def test_only_the_first_components_are_described() -> None:
    heartbeats = {Address(1, component): beat(18) for component in range(10, 30, 2)}

    assert described([*heartbeats, Address(1, 1)], heartbeats, ()) == (
        '1/1 (no HEARTBEAT), '
        + ', '.join(f'1/{component} (onboard computer)' for component in range(10, 24, 2))
        + ' and 3 more')
