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

"""After a run the light is as it was, also after an interruption, an error or a fault."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from illuminator_ros.illuminator.checks.requirements import REQUIREMENTS
from illuminator_ros.illuminator.checks.session import LightSession
from illuminator_ros.illuminator.model import Configuration, Mode
from illuminator_ros.illuminator.simulated_properties import FAULTS
from illuminator_ros.payload.checks.requirement import Requirement, Verdict
import pytest
from support.conformance_run import Run

BEFORE = Configuration(Mode.EXTERNAL_SYNC, 60.0, 0.5, 25.0)
# Faults with which a light sends messages and applies commands.
RESTORABLE = sorted(set(FAULTS) - {
    'silence', 'refuse', 'lie', 'no-stop', 'reboot', 'toggle', 'no-resume'})


def used(*faults: str, requirements: Sequence[Requirement[Any]] = REQUIREMENTS) -> Run:
    """Return a run against a light that is on."""
    run = Run(faults=faults, requirements=requirements)
    run.press(enabled=True)
    run.lamp.configuration = BEFORE
    return run


def is_restored(run: Run) -> bool:
    return run.lamp.enabled and run.lamp.configuration.differences(BEFORE) == []


@pytest.mark.parametrize('faults', [(), *((fault,) for fault in RESTORABLE)])
def test_switch_and_configuration_are_restored(faults: tuple[str, ...]) -> None:
    run = used(*faults).finish()
    assert is_restored(run)
    assert run.runner.restored == 'the light is as it was'


@pytest.mark.parametrize('after', [0.0, *(0.5 + 0.7 * step for step in range(52))])
def test_an_interrupted_run_restores_the_light_and_checks_nothing_more(after: float) -> None:
    run = used()
    run.link.run(after)
    checked = len(run.runner.results)
    interrupted = run.link.now
    run.interrupt()
    run.finish()
    assert is_restored(run)
    assert len(run.runner.results) == len(REQUIREMENTS)
    assert {one.detail for one in run.runner.results[checked + 1:]} <= {'interrupted'}
    assert not run.runner.passed
    assert run.link.now < interrupted + 5.0


def test_restoring_is_not_interrupted() -> None:
    run = used()
    run.link.run_until(lambda: run.session.runner.restoring, within=100.0)
    assert not is_restored(run)
    run.interrupt()
    assert is_restored(run.finish())


def test_a_check_with_an_internal_error_fails_and_the_light_is_restored() -> None:
    async def broken(light: LightSession) -> None:
        await light.switch(False)
        raise ZeroDivisionError('oops')

    run = used(requirements=[
        replace(one, check=broken) if one.name == 'on' else one for one in REQUIREMENTS]).finish()
    assert run.failed == {'on'}
    assert 'ZeroDivisionError' in run.result('on').detail
    assert is_restored(run)


def test_a_light_that_cannot_be_restored_is_reported_with_its_former_state() -> None:
    run = used()
    run.link.run(20.0)
    run.fault('refuse')
    run.finish()
    assert run.runner.restored.startswith('THE LIGHT IS NOT AS IT WAS (')
    assert 'it was on, mode external_sync, brightness 60 %' in run.runner.restored
    assert not run.runner.passed


def test_a_light_that_reports_no_status_is_not_changed() -> None:
    run = used()
    run.set_interval(-1)
    run.fault('no-request')
    run.light.behave(replace(run.light.behaviour, status_on_change=False), run.link.now)
    run.finish()
    assert is_restored(run)
    assert run.result('on').verdict is Verdict.SKIPPED
    assert 'could not be restored' in run.result('on').detail
