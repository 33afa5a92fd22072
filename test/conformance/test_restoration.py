# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""After a run a device is as it was, also after an interruption, an error or a fault."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from illuminator_ros.checks.requirements import CheckVerdict, Requirement
from illuminator_ros.gimbal.manager_setpoint import Setpoint
from illuminator_ros.illuminator.checks.requirements import REQUIREMENTS
from illuminator_ros.illuminator.checks.session import LightSession
from illuminator_ros.illuminator.model import Configuration, Mode
from illuminator_ros.mavlink.dialect import mavlink
from illuminator_ros.mavlink.messages import Address, CommandLong
import pytest
from support.checks_run import ChecksRun, start

BEFORE = Configuration(Mode.EXTERNAL_SYNC, 60.0, 0.5, 25.0)
# Faults of commands and statuses with which a light can still be restored.
RESTORABLE = ('slow', 'progress', 'busy', 'drop', 'duplicate', 'any-target', 'fixed-rate',
              'anything', 'disobey', 'configure-on', 'nan', 'no-clock')


def used(*faults: str, requirements: Sequence[Requirement[Any]] = ()) -> ChecksRun:
    """Return a run against a light that is on."""
    one = start('illuminator', *faults, requirements=requirements)
    one.device.enabled, one.device.configuration = True, BEFORE
    return one


def is_restored(one: ChecksRun) -> bool:
    return bool(one.device.enabled and not one.device.configuration.differences(BEFORE))


@pytest.mark.parametrize('faults', [(), *((fault,) for fault in RESTORABLE)])
def test_switch_and_configuration_are_restored(faults: tuple[str, ...]) -> None:
    one = used(*faults).finish()
    assert is_restored(one)
    assert one.runner.restored == 'the light is as it was'


@pytest.mark.parametrize('after', [0.0, *(0.5 + 2.1 * step for step in range(17))])
def test_an_interrupted_run_restores_the_light_and_checks_nothing_more(after: float) -> None:
    one = used()
    one.link.run(after)
    checked = len(one.runner.results)
    interrupted = one.link.now
    one.interrupt()
    one.finish()
    assert is_restored(one)
    assert len(one.runner.results) == len(REQUIREMENTS)
    assert {found.detail for found in one.runner.results[checked + 1:]} <= {'interrupted'}
    assert not one.runner.passed
    assert one.link.now < interrupted + 5.0


def test_restoring_is_not_interrupted() -> None:
    one = used()
    one.link.run_until(lambda: one.session.runner.restoring, within=100.0)
    assert not is_restored(one)
    one.interrupt()
    assert is_restored(one.finish())


def test_a_check_with_an_internal_error_fails_and_the_light_is_restored() -> None:
    async def broken(light: LightSession) -> None:
        await light.switch(False)
        raise ZeroDivisionError('oops')

    one = used(requirements=[replace(one, check=broken) if one.name == 'on' else one
                             for one in REQUIREMENTS]).finish()
    assert one.failed == {'on'}
    assert 'ZeroDivisionError' in one.result('on').detail
    assert is_restored(one)


def test_a_device_that_cannot_be_restored_is_reported_with_its_former_state() -> None:
    light = used()
    light.link.run(20.0)
    light.fault('refuse')
    light.finish()
    assert light.runner.restored.startswith('THE LIGHT IS NOT AS IT WAS (')
    assert 'it was on, mode external_sync, brightness 60 %' in light.runner.restored
    assert not light.runner.passed

    gimbal = start('gimbal')
    gimbal.device.motion.turn(-0.5, 0.0, gimbal.link.now)
    gimbal.link.run(15.0)
    gimbal.fault('lie')
    assert gimbal.finish().runner.restored == (
        'THE GIMBAL IS NOT AS IT WAS (attitude): it was pitch -28.6, yaw 0.0 deg')


def test_a_light_that_reports_no_status_is_not_changed() -> None:
    one = used()
    one.set_interval(-1)
    one.fault('no-request')
    one.component.behave(
        replace(one.component.behaviour, status_on_change=False), one.link.now)
    one.finish()
    assert is_restored(one)
    assert one.result('on').verdict is CheckVerdict.SKIPPED
    assert 'could not be restored' in one.result('on').detail


@pytest.mark.parametrize('kind', ['gimbal', 'gimbal_manager'])
@pytest.mark.parametrize('after', [5.0, 12.0, 20.0, 31.0])
def test_an_interrupted_run_turns_the_gimbal_back(kind: str, after: float) -> None:
    one = start(kind)
    motion = one.device.motion
    motion.turn(-0.5, 0.4, one.link.now)
    one.link.run(after)
    one.interrupt()
    one.finish()
    assert motion.angles == pytest.approx((0.0, -0.5, 0.4), abs=0.01)
    assert one.runner.restored in ('nothing was changed', f'the {one.checks.device} is as it was')


def test_control_is_given_back_to_the_player_that_had_it() -> None:
    one = start('gimbal_manager')
    player = Address(1, 195)
    one.component.receive(player, CommandLong(
        1, 154, mavlink.MAV_CMD_DO_GIMBAL_MANAGER_CONFIGURE, 0, *player, *player, 0, 0, 0),
        one.link.now)
    assert one.finish().failed == set()
    assert (one.device.primary, one.device.secondary) == (player, player)


@pytest.mark.parametrize('kind', ['gimbal', 'gimbal_manager'])
def test_a_gimbal_keeps_its_yaw_lock(kind: str) -> None:
    one = start(kind, drift=0.0)
    motion, lock = (one.device.motion, mavlink.GIMBAL_DEVICE_FLAGS_YAW_LOCK
                    | mavlink.GIMBAL_DEVICE_FLAGS_PITCH_LOCK)
    motion.obey(Setpoint(lock, angles=(0.0, -0.2, 0.1)), one.link.now)
    one.finish()
    assert motion.flags == lock
    assert motion.angles[1:] == pytest.approx((-0.2, 0.1), abs=0.05)
