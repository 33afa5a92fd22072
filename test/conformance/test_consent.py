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

"""Without consent the light neither strobes nor shines brighter than 20 %."""

from dataclasses import replace

from illuminator_ros.illuminator.checks.requirements import REQUIREMENTS
from illuminator_ros.illuminator.model import Configuration, Mode
from illuminator_ros.illuminator.simulated_properties import (
    FAULTS,
    IlluminatorProperties,
    PROFILES,
)
from illuminator_ros.mavlink.dialect import mavlink
from illuminator_ros.payload.checks.requirement import Verdict
from illuminator_ros.payload.simulated import CommandReply
import pytest
from support.conformance_run import Run

LIGHTS = {
    'switch': IlluminatorProperties(),
    'brightness is the switch': replace(
        PROFILES['ardusub'].properties, modes=(Mode.INTERNAL_CONTROL, Mode.EXTERNAL_SYNC)),
}
BRIGHT = Configuration(Mode.INTERNAL_CONTROL, 100.0, 0.0, 0.0)
# Requirements whose checks switch on a light that accepts invalid commands.
SWITCHING = ('other-target', 'repeated', 'on', 'on-off-values', 'mode-internal', 'mode-external',
             'brightness-values', 'not-a-number')
all_lights = pytest.mark.parametrize('light', LIGHTS.values(), ids=LIGHTS)


def dazzling(seen: list[Configuration]) -> list[Configuration]:
    # A comparison with NaN is false, so NaN counts as dazzling. Under external sync the other
    # signal may strobe.
    return [one for one in seen if not (
        one.brightness <= 20.0 and one.strobe_period == 0
        and one.mode is Mode.INTERNAL_CONTROL)]


def rejecting(
    light: IlluminatorProperties, configuration: Configuration, *, consent: bool,
    only: tuple[str, ...] = (),
) -> tuple[Run, list[Configuration]]:
    """Return a run against a light that rejects every configuration, and its states while on."""
    run = Run(light, consent=consent)
    run.lamp.configuration = configuration
    execute = run.light.device.execute
    run.light.device.execute = (  # type: ignore[method-assign]
        lambda source, command, now: CommandReply(mavlink.MAV_RESULT_FAILED)
        if command.command == mavlink.MAV_CMD_DO_ILLUMINATOR_CONFIGURE
        else execute(source, command, now))
    seen = run.watch()
    return run.finish(), seen


def test_checks_that_need_consent_are_skipped_without_it() -> None:
    run = Run(consent=False).finish()
    assert {one.requirement.name for one in run.runner.results
            if 'not agreed to; see --yes' in one.detail
            } == {one.name for one in REQUIREMENTS if one.needs_consent}
    assert run.runner.passed


@all_lights
@pytest.mark.parametrize('fault', [None, *FAULTS])
def test_without_consent_a_light_is_on_at_low_brightness_only(
        light: IlluminatorProperties, fault: str | None) -> None:
    run = Run(light, faults=(fault,) if fault else (), consent=False,
              only=SWITCHING if fault else ())
    seen = run.watch()
    run.finish()
    assert seen or fault
    assert dazzling(seen) == []


@all_lights
@pytest.mark.parametrize('configuration', [
    BRIGHT, replace(BRIGHT, brightness=10.0, strobe_period=0.5, strobe_duty_cycle=50.0),
    replace(BRIGHT, brightness=10.0, mode=Mode.EXTERNAL_SYNC),
], ids=['bright', 'strobing', 'external sync'])
def test_without_consent_a_light_that_cannot_be_dimmed_is_not_switched_on(
        light: IlluminatorProperties, configuration: Configuration) -> None:
    run, seen = rejecting(light, configuration, consent=False)
    assert seen == []
    for name in ('on', 'off', 'on-off-values', 'other-target', 'command-int', 'repeated'):
        assert run.result(name).verdict is Verdict.SKIPPED
        assert 'cannot be changed: not agreed to; see --yes' in run.result(name).detail
    assert {'mode-internal', 'brightness', 'brightness-values'} <= run.failed
