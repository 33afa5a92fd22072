# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The state of the vehicle, as the autopilot on the link reports it."""

from illuminator_ros.gimbal.vehicle_state import VehicleState
from illuminator_ros.mavlink.messages import Address
from illuminator_ros.payload.messages import Attitude, GlobalPositionInt
import pytest

DEVICE = Address(1, 154)


@pytest.mark.parametrize('wrong', [
    Attitude(0, 1e30, 0.0, 0.5, 0.0, 0.0, 0.0), Attitude(0, 0.0, 0.0, 1e30, 0.0, 0.0, 0.0),
    Attitude(0, 0.0, 0.0, 0.5, 0.0, 0.0, 1e30),
    GlobalPositionInt(0, 900_000_001, 1, 0, 0, 0, 0, 0, 0),
    GlobalPositionInt(0, 1, -1_800_000_001, 0, 0, 0, 0, 0, 0),
    GlobalPositionInt(0, 0, 0, 0, 0, 0, 0, 0, 0)], ids=str)
def test_values_that_cannot_be_right_are_ignored(wrong: Attitude | GlobalPositionInt) -> None:
    vehicle = VehicleState()
    vehicle.receive(wrong, 1.0)
    assert vehicle.heading(1.0) is None
    assert vehicle.position.get(1.0) is None
    assert vehicle.for_device(DEVICE, 1.0) is None
