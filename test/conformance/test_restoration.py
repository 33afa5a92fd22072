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

"""The light is afterwards as it was before, whatever happens."""

from dataclasses import replace

from illuminator_ros.illuminator.checks.catalogue import REQUIREMENTS
from illuminator_ros.illuminator.faults import FAULTS
from illuminator_ros.illuminator.model import Configuration, Mode
from illuminator_ros.illuminator.simulated_properties import IlluminatorProperties
from illuminator_ros.mavlink.messages import STATUS_ID
from illuminator_ros.payload.checks.requirement import Verdict
import pytest
from support.conformance_run import Run

BEFORE = Configuration(Mode.EXTERNAL_SYNC, 60.0, 0.5, 25.0)
SHOULD_NOT_MATTER = sorted(set(FAULTS) - {
    # These keep the light from doing what it is told, or from being heard.
    'silence', 'refuse', 'lie', 'no-stop', 'reboot', 'toggle', 'no-resume'})


def prepared(*faults, **options):
    """Return a run against a light that somebody uses."""
    run = Run(faults=faults, **options)
    run.press(enabled=True)
    run.lamp.configuration = BEFORE
    return run


def state(run):
    return run.lamp.enabled, run.lamp.configuration


def test_switch_and_configuration_are_brought_back():
    run = prepared().finish()
    assert state(run) == (True, BEFORE)
    assert run.suite.restored == 'the light is as it was'


@pytest.mark.parametrize('fault', SHOULD_NOT_MATTER)
def test_switch_and_configuration_are_brought_back_from_a_light_that_misbehaves(fault):
    run = prepared(fault).finish()
    assert run.lamp.enabled is True
    assert run.lamp.configuration.differences(BEFORE) == []


@pytest.mark.parametrize('interval', [0.2, 1.0, 3.0])
def test_a_default_rate_is_brought_back(interval):
    run = Run(IlluminatorProperties(status_interval=interval)).finish()
    assert run.light.interval(STATUS_ID) == interval


def test_a_rate_that_somebody_has_set_is_brought_back():
    run = Run()
    run.set_interval(0.4)
    assert run.finish().light.interval(STATUS_ID) == pytest.approx(0.4)


def test_a_stream_that_somebody_has_stopped_stays_so():
    run = Run(IlluminatorProperties(status_interval=0.0)).finish()
    assert run.light.interval(STATUS_ID) == 0.0


@pytest.mark.parametrize('after', [0.5 + 0.7 * step for step in range(52)])
def test_an_interrupted_run_brings_it_back(after):
    run = prepared()
    run.link.run(after)
    run.interrupt()
    run.finish()
    assert state(run) == (True, BEFORE)
    assert len(run.suite.results) == len(REQUIREMENTS)


def test_bringing_it_back_is_not_interrupted():
    run = prepared()
    run.link.run_until(lambda: run.session.runner.restoring, within=100.0)
    assert state(run) != (True, BEFORE)
    run.interrupt()
    run.finish()
    assert state(run) == (True, BEFORE)


def test_an_interrupted_run_checks_nothing_more():
    run = Run()
    run.link.run(8.0)
    run.interrupt()
    assert run.finish().result('uptime').detail == 'interrupted'
    assert not run.suite.passed
    assert run.link.now < 1000.0 + 8.0 + 5.0


def test_a_run_that_is_interrupted_before_it_begins_ends():
    run = Run()
    run.interrupt()
    run.finish()
    assert run.session.runner.interrupted
    assert {one.detail for one in run.suite.results} == {'interrupted'}


def test_a_check_with_an_error_in_it_fails_and_the_light_is_brought_back():
    async def broken(tester):
        await tester.switch(False)
        raise ZeroDivisionError('oops')

    run = prepared(requirements=[
        replace(one, check=broken) if one.name == 'on' else one for one in REQUIREMENTS]).finish()
    assert run.failed == {'on'}
    assert 'ZeroDivisionError' in run.result('on').detail
    assert state(run) == (True, BEFORE)


def test_a_light_that_cannot_be_brought_back_is_said_to_be_changed():
    run = prepared()
    run.link.run(20.0)
    run.fault('refuse')
    run.finish()
    assert run.suite.restored.startswith('THE LIGHT IS NOT AS IT WAS (')
    assert 'it was on, mode external_sync, brightness 60 %' in run.suite.restored
    assert not run.suite.passed


def test_a_light_that_is_silent_for_a_while_is_brought_back_when_it_is_heard_again():
    run = prepared()
    run.link.run(20.0)
    run.light.behave(replace(run.light.behaviour, silence=14.0), run.link.now)
    run.finish()
    assert state(run) == (True, BEFORE)


def test_a_light_that_says_nothing_of_its_state_is_not_changed():
    run = prepared()
    run.set_interval(-1)
    run.fault('no-request')
    run.light.behave(replace(run.light.behaviour, status_on_change=False), run.link.now)
    run.finish()
    assert state(run) == (True, BEFORE)
    assert run.result('on').verdict is Verdict.SKIPPED
    assert 'could not be restored' in run.result('on').detail
