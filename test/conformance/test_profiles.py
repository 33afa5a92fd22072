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

"""The profiles against the suite: what is known of the lights in the field, and nothing else."""

from illuminator_ros.illuminator.checks.catalogue import REQUIREMENTS
from illuminator_ros.illuminator.simulated_properties import PROFILES
from illuminator_ros.illuminator.simulated_settings import properties
from illuminator_ros.payload.checks.requirement import Verdict
import pytest
from support.conformance_run import Run

# The reference emulator: its address, its strings of 28 characters, that it does what is for
# anybody, does not know COMMAND_INT, lets NaN in, sends at 1 Hz only, and has no clock.
DEVIATIONS = {
    'default': set(),
    'extended': set(),
    'reference': {'address', 'information-terminated', 'other-target', 'command-int',
                  'not-a-number', 'interval', 'uptime'},
    'ardusub': {'heartbeat-type', 'heartbeat-autopilot', 'information-request', 'not-a-number'},
}


def finished(profile, **settings):
    settings['profile'] = profile
    return Run(properties(settings, PROFILES[profile].address)).finish()


@pytest.mark.parametrize('profile', DEVIATIONS)
def test_a_profile_deviates_in_what_is_known_of_it_and_in_nothing_else(profile):
    assert finished(profile).failed == DEVIATIONS[profile]


def test_every_profile_is_checked():
    assert set(DEVIATIONS) == set(PROFILES)


def test_nothing_is_skipped_on_a_light_that_gets_hot():
    run = finished('default', time_scale=120.0)
    assert run.names(Verdict.SKIPPED) == set()
    assert len(run.suite.results) == len(REQUIREMENTS)
    assert run.suite.passed


def test_a_light_without_strobe_limits_is_not_made_to_strobe():
    run = finished('ardusub')
    assert {'strobe', 'strobe-values', 'duty-cycle'} < run.names(Verdict.SKIPPED)
    assert 'reports no strobe limits' in run.result('strobe').detail


@pytest.mark.parametrize('profile', PROFILES)
def test_every_profile_is_afterwards_as_it_was(profile):
    assert finished(profile).suite.restored == 'the light is as it was'
