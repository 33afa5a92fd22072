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

"""What nobody has agreed to is not done: no strobe, and no 100 %."""

from dataclasses import replace

from illuminator_ros.conformance.requirement import Verdict
from illuminator_ros.conformance.requirements import REQUIREMENTS
from illuminator_ros.illuminator.behaviour import PROFILES
from illuminator_ros.illuminator.device_properties import DeviceProperties
from illuminator_ros.simulator.settings import properties
import pytest
from support.conformance_run import Run

DAZZLING = {one.name for one in REQUIREMENTS if one.dazzles}


def watched(run):
    """Have a run note how bright its light shines, and whether it strobes, at any time."""
    seen = []
    device, apply = run.light, run.light._apply

    def noted(change, now):
        apply(change, now)
        if device.enabled:
            seen.append(device.configuration)
    device._apply = noted
    return seen


def test_without_consent_what_dazzles_is_skipped():
    run = Run(consent=False).finish()
    assert run.names(Verdict.SKIPPED) == DAZZLING
    assert 'not agreed to' in run.result('strobe').detail
    assert run.suite.passed


@pytest.mark.parametrize('light', [
    DeviceProperties(),
    replace(properties({'profile': 'ardusub'}, PROFILES['ardusub'].source), modes=(1, 2)),
], ids=['switch', 'brightness is the switch'])
def test_without_consent_it_is_on_at_low_brightness_only(light):
    run = Run(light, consent=False)
    seen = watched(run)
    run.finish()
    before = run.suite._before
    ours = [one for one in seen if one.brightness != before.brightness]
    assert ours
    assert all(one.brightness <= 20.0 and one.strobe_period == 0 for one in ours)


def test_with_consent_it_strobes_and_shines():
    run = Run(consent=True)
    seen = watched(run)
    run.finish()
    assert max(one.brightness for one in seen) == 100.0
    assert run.result('strobe').verdict is Verdict.PASS


def test_only_some_requirements_can_be_checked():
    run = Run(only=('heartbeat', 'on')).finish()
    assert [one.requirement.name for one in run.suite.results] == ['heartbeat', 'on']


def test_what_changes_nothing_leaves_the_light_alone():
    run = Run(only=('heartbeat', 'status-request', 'information-request'))
    seen = watched(run)
    assert run.finish().suite.restored == 'nothing was changed'
    assert seen == []
