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

from illuminator_ros.illuminator.checks.catalogue import REQUIREMENTS
from illuminator_ros.illuminator.faults import FAULTS
from illuminator_ros.illuminator.model import Configuration, Mode
from illuminator_ros.illuminator.simulated_properties import IlluminatorProperties, PROFILES
from illuminator_ros.illuminator.simulated_settings import properties
from illuminator_ros.mavlink.messages import MavResult
from illuminator_ros.payload.checks.requirement import Verdict
from illuminator_ros.payload.simulated import CommandReply
import pytest
from support.conformance_run import Run

LIGHTS = {
    'switch': IlluminatorProperties(),
    'brightness is the switch': replace(
        properties({'profile': 'ardusub'}, PROFILES['ardusub'].address), modes=(1, 2)),
}
BRIGHT = Configuration(Mode.INTERNAL_CONTROL, 100.0, 0.0, 0.0)
# What may switch a light on that takes what it must not.
SWITCHING = ('other-target', 'repeated', 'on', 'on-off-values', 'mode-internal', 'mode-external',
             'brightness-values', 'not-a-number')
DAZZLING = {one.name for one in REQUIREMENTS if one.needs_consent}


def watched(run):
    """Have a run note how bright its light shines, and whether it strobes, at any time."""
    seen = []
    apply = run.light.apply

    def noted(change, now):
        apply(change, now)
        if run.lamp.enabled:
            seen.append(run.lamp.configuration)
    run.light.apply = noted
    return seen


def test_without_consent_what_dazzles_is_skipped():
    run = Run(consent=False).finish()
    assert run.names(Verdict.SKIPPED) == DAZZLING
    assert 'not agreed to' in run.result('strobe').detail
    assert run.suite.passed


def dazzling(seen):
    # Written so that NaN is, too; and in external sync another signal may make it strobe.
    return [one for one in seen if not (
        one.brightness <= 20.0 and one.strobe_period == 0
        and one.mode is Mode.INTERNAL_CONTROL)]


@pytest.mark.parametrize('light', LIGHTS.values(), ids=LIGHTS)
def test_without_consent_it_is_on_at_low_brightness_only(light):
    run = Run(light, consent=False)
    seen = watched(run)
    run.finish()
    assert seen
    assert dazzling(seen) == []


@pytest.mark.parametrize('fault', FAULTS)
@pytest.mark.parametrize('light', LIGHTS.values(), ids=LIGHTS)
def test_without_consent_no_light_dazzles_whatever_is_wrong_with_it(light, fault):
    run = Run(light, faults=(fault,), consent=False, only=SWITCHING)
    seen = watched(run)
    run.finish()
    assert dazzling(seen) == []


class TestALightThatTakesNoConfiguration:

    def run(self, light, configuration, **options):
        """Return what such a light was like while it was on, and the run."""
        run = Run(light, **options)
        run.lamp.configuration = configuration
        execute = run.light.device.execute
        run.light.device.execute = lambda command, now: (
            CommandReply(MavResult.FAILED) if command.command == 406 else execute(command, now))
        seen = watched(run)
        return run.finish(), seen

    @pytest.mark.parametrize('light', LIGHTS.values(), ids=LIGHTS)
    @pytest.mark.parametrize('configuration', [
        Configuration(Mode.INTERNAL_CONTROL, 100.0, 0.0, 0.0),
        Configuration(Mode.INTERNAL_CONTROL, 10.0, 0.5, 50.0),
        Configuration(Mode.EXTERNAL_SYNC, 10.0, 0.0, 0.0),
    ], ids=['bright', 'strobing', 'in external sync'])
    def test_it_is_not_switched_on_without_consent(self, light, configuration):
        run, seen = self.run(light, configuration, consent=False)
        assert seen == []
        for name in ('on', 'off', 'on-off-values', 'other-target', 'command-int', 'repeated'):
            assert run.result(name).verdict is Verdict.SKIPPED
            assert 'cannot be changed: not agreed to; see --yes' in run.result(name).detail

    def test_the_reason_has_its_brightness(self):
        run, _ = self.run(IlluminatorProperties(), BRIGHT, consent=False, only=('on',))
        assert run.result('on').detail.startswith('switched on, it would shine at 100 %')

    def test_it_is_all_the_same_told_that_it_takes_none(self):
        run, _ = self.run(IlluminatorProperties(), BRIGHT, consent=False)
        assert {'mode-internal', 'brightness', 'brightness-values'} <= run.failed

    def test_it_is_switched_on_where_it_is_dim(self):
        run, seen = self.run(
            IlluminatorProperties(), replace(BRIGHT, brightness=15.0), consent=False)
        assert {one.brightness for one in seen} == {15.0}
        assert run.result('on').verdict is Verdict.PASS

    def test_it_is_switched_on_with_consent(self):
        run, seen = self.run(IlluminatorProperties(), BRIGHT, consent=True)
        assert seen
        assert run.result('on').verdict is Verdict.PASS


def test_a_light_that_brightness_switches_on_gets_no_wrong_one_without_consent():
    run = Run(LIGHTS['brightness is the switch'], faults=('anything',), consent=False).finish()
    for name in ('brightness-values', 'not-a-number'):
        assert 'its brightness switches it on' in run.result(name).detail


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
