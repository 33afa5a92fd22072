# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Without consent no light strobes or dazzles, no gimbal moves, and no camera takes an image."""

from dataclasses import replace

from illuminator_ros.checks.requirements import CheckVerdict
from illuminator_ros.illuminator.model import Configuration, Mode
from illuminator_ros.illuminator.simulated_properties import (
    FAULTS,
    IlluminatorProperties,
    PROFILES,
)
from illuminator_ros.mavlink.dialect import mavlink
from illuminator_ros.mavlink.messages import Address
from illuminator_ros.simulation.simulated import CommandReply, Effect
import pytest
from support.checks_run import ChecksRun, KINDS, start

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


def watch(one: ChecksRun) -> list[Configuration]:
    """Return a list that gets the configuration of a light after each change that leaves it on."""
    seen: list[Configuration] = []
    apply = one.component.apply

    def noted(effect: Effect, now: float) -> None:
        apply(effect, now)
        if one.device.enabled:
            seen.append(one.device.configuration)
    one.component.apply = noted
    return seen


def dazzling(seen: list[Configuration]) -> list[Configuration]:
    # A comparison with NaN is false, so NaN counts as dazzling. Under external sync the other
    # signal may strobe.
    return [one for one in seen if not (
        one.brightness <= 20.0 and one.strobe_period == 0
        and one.mode is Mode.INTERNAL_CONTROL)]


@pytest.mark.parametrize('kind', KINDS)
def test_checks_that_need_consent_are_skipped_without_it_and_change_nothing(kind: str) -> None:
    one = start(kind, consent=False)
    if 'gimbal' in kind:
        one.device.motion.turn(-0.5, 0.4, one.link.now)
    one.finish()
    assert {found.requirement.name for found in one.runner.results
            if 'not agreed to; see --yes' in found.detail
            } == {found.name for found in one.checks.requirements if found.needs_consent}
    assert one.runner.passed
    if 'gimbal' in kind:
        assert one.device.motion.angles == (0.0, -0.5, 0.4)
        assert getattr(one.device, 'primary', Address(0, 0)) == Address(0, 0)
    if kind == 'rededge':
        assert not one.device.images
        assert one.runner.restored == 'nothing was changed'


@pytest.mark.parametrize(('light', 'fault'), [
    *((LIGHTS['switch'], fault) for fault in (None, *FAULTS)),
    *((LIGHTS['brightness is the switch'], fault) for fault in (
        None, 'slow', 'lie', 'anything', 'disobey', 'on-bright'))])
def test_without_consent_a_light_is_on_at_low_brightness_only(
        light: IlluminatorProperties, fault: str | None) -> None:
    one = start('illuminator', *([fault] if fault else []), of=light, consent=False,
                only=SWITCHING if fault else ())
    seen = watch(one)
    one.finish()
    assert seen or fault
    # Only ON shows that ON sets another brightness.
    assert len(dazzling(seen)) == (fault == 'on-bright')


@all_lights
@pytest.mark.parametrize('configuration', [
    BRIGHT, replace(BRIGHT, brightness=10.0, strobe_period=0.5, strobe_duty_cycle=50.0),
    replace(BRIGHT, brightness=10.0, mode=Mode.EXTERNAL_SYNC),
], ids=['bright', 'strobing', 'external sync'])
def test_without_consent_a_light_that_cannot_be_dimmed_is_not_switched_on(
        light: IlluminatorProperties, configuration: Configuration) -> None:
    one = start('illuminator', of=light, consent=False)
    execute, one.device.configuration = one.device.execute, configuration
    one.device.execute = (
        lambda source, command, now: CommandReply(mavlink.MAV_RESULT_FAILED)
        if command.command == mavlink.MAV_CMD_DO_ILLUMINATOR_CONFIGURE
        else execute(source, command, now))
    seen = watch(one)
    one.finish()
    assert seen == []
    for name in ('on', 'off', 'on-off-values', 'other-target', 'command-int', 'repeated'):
        assert one.result(name).verdict is CheckVerdict.SKIPPED
        assert 'cannot be changed: not agreed to; see --yes' in one.result(name).detail
    assert {'mode-internal', 'brightness', 'brightness-values'} <= one.failed


@pytest.mark.parametrize('consent', [False, True])
def test_a_light_that_dazzles_without_consent_is_switched_off_and_ends_the_run(
        consent: bool) -> None:
    one = start('illuminator', 'on-bright', consent=consent)
    seen = watch(one)
    one.finish()
    assert one.failed == {'on-configuration'}
    assert not one.runner.passed
    assert one.result('strobe').verdict is (CheckVerdict.PASS if consent else CheckVerdict.SKIPPED)
    if not consent:
        assert one.result('on-configuration').detail == one.runner.restored.partition('; the')[0]
        assert one.runner.restored == (
            'stopped: it is on, mode internal_control, brightness 100 %, strobe_period 0 s, '
            'strobe_duty_cycle 0 %; without consent it must neither strobe nor be brighter than '
            '20 %; the light is as it was')
        assert len(seen) == 1
        assert not one.device.enabled


def test_a_light_that_dazzles_while_it_is_restored_is_left_off() -> None:
    one = start('illuminator', 'on-bright', consent=False, only=('brightness',))
    one.device.enabled, one.device.configuration = True, replace(BRIGHT, brightness=30.0)
    seen = watch(one)
    one.finish()
    assert one.runner.restored.startswith('stopped: it is on, ')
    assert 'THE LIGHT IS NOT AS IT WAS (enable): it was on, ' in one.runner.restored
    assert len(dazzling(seen)) == 1
    assert not one.device.enabled


def test_the_brightness_that_a_light_had_before_the_run_does_not_end_the_run() -> None:
    one = start('illuminator', consent=False)
    one.device.enabled, one.device.configuration = True, replace(
        BRIGHT, strobe_period=0.5, strobe_duty_cycle=50.0)
    assert one.finish().failed == set()
    assert one.runner.restored == 'the light is as it was'


def test_a_light_that_its_brightness_switches_on_does_not_get_back_a_brightness_that_dazzles(
) -> None:
    one = start('illuminator', 'configure-on', consent=False)
    one.device.configuration = BRIGHT
    seen = watch(one)
    one.finish()
    assert one.failed == {'configure-switch'}
    assert one.runner.restored.startswith(
        'THE LIGHT IS NOT AS IT WAS (configuration, which would switch it on): it was off, ')
    assert dazzling(seen) == []
    assert not one.device.enabled


@pytest.mark.parametrize('kind', ['gimbal', 'gimbal_manager'])
def test_a_gimbal_that_turns_beyond_its_range_is_stopped_and_ends_the_run(kind: str) -> None:
    one = start(kind, 'no-limits')
    one.link.run_until(lambda: one.session.danger, within=200.0)
    motion, stopped = one.device.motion, one.device.motion.angles
    one.finish()
    assert one.failed == {'range'}
    assert 'beyond its range of pitch, -120.0 to 45.0 deg' in one.result('range').detail
    assert one.result('retract').detail == 'stopped'
    assert 'IS NOT AS IT WAS (attitude): it was pitch 0.0, yaw 0.0 deg' in one.runner.restored
    assert motion.angles == pytest.approx(stopped, abs=0.02)
    assert not one.runner.passed


def test_a_camera_that_takes_more_images_than_announced_ends_the_run() -> None:
    one = start('rededge', 'burst=30').finish()
    assert one.failed == {'capture-status'}
    assert one.result('capture-status').detail == 'stopped: it took 21 images instead of about 15'
    assert len(one.device.images) == 30
    assert not one.runner.passed
