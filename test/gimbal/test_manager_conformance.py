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

"""The checks of conformance against our gimbal manager."""

from __future__ import annotations

from typing import Any

from illuminator_ros.gimbal.axes import Range
from illuminator_ros.gimbal.checks.manager import CHECKS
from illuminator_ros.gimbal.manager_control import ControlSettings, Role
from illuminator_ros.mavlink.messages import Address
from illuminator_ros.payload.arbitration import Policy
from illuminator_ros.payload.checks.requirement import Verdict
from illuminator_ros.payload.checks.runner import CheckRunner
from illuminator_ros.payload.checks.session import Conditions
import pytest
from support.gimbal_manager import OURS
from support.gimbal_vehicle import managed_vehicle
from support.virtual_link import START, VirtualLink

SERVO: dict[str, Any] = {
    'device_id': 1, 'ranges': (Range(0.0, 0.0), Range(-1.5, 0.5), Range(-2.5, 2.5))}


@pytest.mark.parametrize('settings', [{}, SERVO], ids=['mavlink', 'without mavlink'])
@pytest.mark.parametrize('policy', Policy)
def test_the_manager_conforms_with_and_without_a_mavlink_device(
        policy: Policy, settings: dict[str, Any]) -> None:
    manager, _, vehicle = managed_vehicle(ControlSettings(policy), START, **settings)
    session = CHECKS.session(Conditions(Address(255, 190), OURS))
    session.consent = True
    link = VirtualLink(session, vehicle)
    runner = CheckRunner(CHECKS, session, CHECKS.requirements)

    async def main() -> None:
        await session.find(10.0, 4.5)
        await runner.run('')

    session.runner.run(main())
    link.run_until(lambda: not session.runner.running, within=3600.0)

    verdicts = {one.requirement.name: one.verdict for one in runner.results}
    assert {name for name, verdict in verdicts.items() if verdict is Verdict.FAIL} == set()
    assert {'take', 'one-player', 'set-attitude', 'roi', 'no-control-messages'} <= {
        name for name, verdict in verdicts.items() if verdict is Verdict.PASS}
    assert manager.control.holder(Role.PRIMARY) is None
