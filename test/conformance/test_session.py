# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The session: the device that is checked, others on the link, and bounded memory."""

from collections.abc import Sequence
import tracemalloc

from illuminator_ros.checks.record import MAX_ENTRIES
from illuminator_ros.checks.session import Conditions
from illuminator_ros.gimbal import messages as gimbal
from illuminator_ros.gimbal.checks import manager
from illuminator_ros.illuminator.checks.requirements import CHECKS
from illuminator_ros.illuminator.messages import IlluminatorStatus
from illuminator_ros.illuminator.simulated_properties import (
    FAULTS,
    IlluminatorBehaviour,
    IlluminatorProperties,
)
from illuminator_ros.mavlink.messages import Address, CommandAck, heartbeat
from illuminator_ros.payload.messages import GimbalDeviceAttitudeStatus as AttitudeStatus
from illuminator_ros.rededge.simulated import RedEdgeProperties
import pytest
from support.checks_run import OURS, run, start

FIRST, SECOND = Address(1, 243), Address(1, 244)
BAD = IlluminatorProperties(address=SECOND, behaviour=FAULTS.add(
    FAULTS.add(IlluminatorBehaviour(), 'nan'), 'lie'))


def test_the_first_light_is_checked_and_another_one_neither_changed_nor_judged() -> None:
    one = start('illuminator', others=[BAD])
    other = one.devices.components[1].device
    other.enabled, before = True, other.configuration
    one.finish()
    assert one.session.components.found == FIRST
    assert one.session.components.devices == {FIRST, SECOND}
    assert one.failed == set()
    assert (other.enabled, other.configuration) == (True, before)


def test_the_target_is_checked() -> None:
    one = run('illuminator', others=[BAD], target=SECOND)
    assert one.session.components.found == SECOND
    assert {'not-a-number', 'status-agrees'} <= one.failed


@pytest.mark.parametrize(('addresses', 'target', 'text'), [
    ((), Address(9, 9), '9/9 was not heard within 10 s; nothing else was heard'),
    ((243, 244), Address(9, 9), '9/9 was not heard within 10 s; heard instead: 1/243 and 1/244'),
    ((243, 244), None, 'no light was heard within 10 s, that is, no HEARTBEAT with '
     'MAV_TYPE_ILLUMINATOR or ILLUMINATOR_STATUS; heard instead: 1/243 and 1/244'),
    (range(1, 12), Address(9, 9), '9/9 was not heard within 10 s; heard instead: 1/1, 1/2, 1/3, '
     '1/4, 1/5, 1/6, 1/7, 1/8 and 3 more'),
])
def test_without_the_light_heartbeat_fails_and_names_the_components_that_were_heard(
        addresses: Sequence[int], target: Address | None, text: str) -> None:
    silent = FAULTS.add(IlluminatorBehaviour(), 'silence')
    other = FAULTS.add(FAULTS.add(IlluminatorBehaviour(), 'type=18'), 'no-request')
    first, *others = [IlluminatorProperties(
        address=Address(1, n), behaviour=other, status_interval=0.0)
        for n in addresses] or [IlluminatorProperties(behaviour=silent)]
    one = run('illuminator', of=first, others=others, target=target)
    assert one.failed == {'heartbeat'}
    assert one.result('heartbeat').detail == text
    assert one.result('on').detail == 'no light was found'
    assert not one.runner.passed


@pytest.mark.parametrize(('others', 'reason'), [
    ([Address(1, n) for n in range(200, 256)], 'each component id from 200 of system 1 is in use'),
    ([Address(n, 1) for n in range(1, 241)], 'each system id up to 240 is in use')])
def test_a_check_that_needs_an_unused_address_is_skipped_on_a_link_without_one(
        others: Sequence[Address], reason: str) -> None:
    one = start('illuminator', only=('other-target',))
    one.session.components.heard.update(others)
    assert one.finish().failed == set()
    assert one.result('other-target').detail == reason


def test_a_flood_from_the_light_takes_a_bounded_memory() -> None:
    session = CHECKS.session(Conditions(OURS))
    status = IlluminatorStatus(1, 0, 3, 0, 1, 10.0, 0.0, 0.0, 20.0, 0.05, 10.0)
    flood = (heartbeat(44), status, CommandAck(405, 0))

    async def command() -> None:
        await session.command(405, 1.0)

    def receive(count: int) -> int:
        for number in range(count):
            session.receive(FIRST, flood[number % len(flood)], 0.001 * number)
        return tracemalloc.get_traced_memory()[0]

    session.runner.run(command())
    tracemalloc.start()
    before = receive(3 * MAX_ENTRIES)
    grown = receive(MAX_ENTRIES) - before
    tracemalloc.stop()

    assert grown < 500_000


def test_a_manager_without_its_status_is_found_by_its_information() -> None:
    one = run('gimbal_manager', 'no-status', only=('heartbeat', 'status-stream'))
    assert one.session.components.found == Address(1, 154)
    assert one.failed == {'status-stream'}


def test_the_attitude_of_a_manager_is_that_of_the_device_that_it_names() -> None:
    session, managed = manager.CHECKS.session(Conditions(OURS)), Address(1, 193)
    session.receive(managed, gimbal.GimbalManagerStatus(0, 0, 154, 0, 0, 0, 0), 1.0)
    for component in (154, 171):
        session.receive(Address(1, component), AttitudeStatus(
            0, 0, component, 32, (1.0, 0.0, 0.0, 0.0), 0.0, 0.0, 0.0, 0), 1.0)
    assert [one.time_boot_ms for _, one in session.received(AttitudeStatus)] == [154]


def test_a_camera_is_one_device_whatever_its_system_id_re_8() -> None:
    one = run('rededge', address=Address(1, 100), target=Address(9, 100))
    assert not one.failed
    assert one.session.components.devices == one.session.components.heard == {Address(255, 100)}


def test_a_component_other_than_100_is_not_a_camera_re_7() -> None:
    one = run('rededge', others=[RedEdgeProperties(Address(255, 101))])
    assert not one.failed
    assert one.session.components.devices == {Address(255, 100)}
    absent = run('rededge', address=Address(255, 101))
    assert absent.failed == {'heartbeat'}
    assert absent.result('heartbeat').detail.startswith(
        'no camera was heard within 10 s, that is, no HEARTBEAT from component 100')
