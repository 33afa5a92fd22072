# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The checks of conformance against our gimbal manager."""

from __future__ import annotations

from typing import Any

from illuminator_ros.checks.requirements import CheckVerdict
from illuminator_ros.gimbal.axes import Range
from illuminator_ros.gimbal.checks import manager
from illuminator_ros.gimbal.manager_control import ControlSettings, Role
from illuminator_ros.payload.arbitration import Policy
import pytest
from support.checks_run import ChecksRun
from support.gimbal_manager import OURS
from support.gimbal_vehicle import managed_vehicle
from support.wire import START

SERVO: dict[str, Any] = {
    'device_id': 1, 'ranges': (Range(0.0, 0.0), Range(-1.5, 0.5), Range(-2.5, 2.5))}


@pytest.mark.parametrize('settings', [{}, SERVO], ids=['mavlink', 'without mavlink'])
@pytest.mark.parametrize('policy', Policy)
def test_the_manager_conforms_with_and_without_a_mavlink_device(
        policy: Policy, settings: dict[str, Any]) -> None:
    controller, _, vehicle = managed_vehicle(ControlSettings(policy), START, **settings)
    done = ChecksRun(manager.CHECKS, vehicle, target=OURS).finish()
    assert done.failed == set()
    assert {'take', 'one-player', 'set-attitude', 'roi', 'no-control-messages'} <= (
        done.names(CheckVerdict.PASS))
    assert controller.control.holder(Role.PRIMARY) is None
