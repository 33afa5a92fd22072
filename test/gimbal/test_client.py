# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Discovery and liveness of gimbals and their managers."""

from __future__ import annotations

from illuminator_ros.gimbal import client as limits
from illuminator_ros.gimbal import events
from illuminator_ros.gimbal.events import GimbalKey
from illuminator_ros.mavlink.dialect import mavlink
from illuminator_ros.mavlink.messages import Address, CommandLong, heartbeat
from illuminator_ros.payload.device_events import (
    DeviceConnected,
    DeviceDisconnected,
    DeviceForgotten,
    DeviceFound,
)
from illuminator_ros.payload.messages import GeoPoint, GlobalPositionInt
import pytest
from support.gimbals import ALL, AUTOPILOT, DEVICE, FakeManager, keys, NAN, OTHER, Rig

INFORMATION, DEVICE_INFORMATION = 280, 283


def requests(rig: Rig, message_id: int = INFORMATION) -> list[tuple[float, Address]]:
    """Return when a message was requested, and of which component."""
    return [(at, Address(one.target_system, one.target_component)) for at, one in rig.sent
            if isinstance(one, CommandLong) and one.command == mavlink.MAV_CMD_REQUEST_MESSAGE
            and one.param1 == message_id]


def test_gm_27_gimbal_is_found_by_the_information_of_its_manager() -> None:
    rig = Rig(FakeManager()).run(3.0)

    assert rig.all_of(DeviceFound) == [DeviceFound(GimbalKey(DEVICE))]
    assert rig.all_of(DeviceConnected) == [
        DeviceConnected(GimbalKey(DEVICE), f'manager {AUTOPILOT}')]
    assert not rig.all_of(DeviceDisconnected)
    assert [target for _, target in requests(rig)].count(AUTOPILOT) == 1
    snapshot = rig.gimbal.snapshot(rig.now)
    assert (snapshot.unreachable, snapshot.managers) == ('', (AUTOPILOT,))
    assert snapshot.identity is not None
    assert (snapshot.identity.vendor, snapshot.identity.firmware_version,
            snapshot.identity.uid) == ('Maker', '1.2.3', 77)
    # The ranges of the device take precedence over those of its manager.
    assert snapshot.ranges is not None
    assert snapshot.ranges[1] == (-1.5, 0.5)


@pytest.mark.parametrize(('managers', 'found'), [
    # Two gimbals behind the autopilot, one of them without MAVLink.
    ((FakeManager(), FakeManager(device_id=2)), [GimbalKey(DEVICE), GimbalKey(AUTOPILOT, 2)]),
    # Two devices without MAVLink behind one manager.
    ((FakeManager(device_id=1), FakeManager(device_id=6)),
     [GimbalKey(AUTOPILOT, 1), GimbalKey(AUTOPILOT, 6)]),
    # The same number behind two managers means two gimbals.
    ((FakeManager(device_id=1), FakeManager(OTHER, 1)),
     [GimbalKey(AUTOPILOT, 1), GimbalKey(OTHER, 1)]),
    # A manager on the device itself, and another vehicle.
    ((FakeManager(DEVICE), FakeManager(Address(2, 1))),
     [GimbalKey(DEVICE), GimbalKey(Address(2, 154))])])
def test_gm_25_gm_26_several_gimbals_behind_one_or_several_managers_are_told_apart(
        managers: tuple[FakeManager, ...], found: list[GimbalKey]) -> None:
    for number, manager in enumerate(managers):
        manager.delta_yaw = number / 10
    rig = Rig(*managers).run(6.0)

    assert sorted(keys(rig)) == sorted(found)
    assert {event.key for event in rig.all_of(DeviceConnected)} == set(found)
    headings = {event.key: event.attitude.heading for event in rig.all_of(events.AttitudeReceived)
                if event.attitude}
    assert len(set(headings.values())) == len(managers)


def test_attitude_of_an_older_device_without_an_id_is_that_of_the_only_gimbal() -> None:
    rig = Rig(FakeManager(device_id=1, attitude_number=0)).run(3.0)

    assert rig.all_of(DeviceConnected)
    assert rig.all_of(events.AttitudeReceived)[0].key == GimbalKey(AUTOPILOT, 1)


def test_attitudes_without_an_id_of_two_gimbals_are_named_as_the_reason() -> None:
    numbered = [FakeManager(device_id=number, attitude_number=0) for number in (1, 2)]
    rig = Rig(*numbered).run(3.0)

    assert {one.reports.unreachable(rig.now) for one in rig.client.gimbals.values()} == {
        '1/1 has several gimbals and sends attitudes without gimbal_device_id, so they cannot be '
        'told apart'}

    for manager in numbered:
        manager.attitude_number = manager.device_id
    rig.run(1.0)
    assert {one.reports.unreachable(rig.now) for one in rig.client.gimbals.values()} == {''}


def test_attitude_of_a_device_that_sends_its_component_id_as_its_id_is_its_own() -> None:
    rig = Rig(FakeManager(attitude_number=DEVICE.component)).run(3.0)

    assert rig.all_of(events.AttitudeReceived)[0].key == GimbalKey(DEVICE)


def test_manager_that_announces_no_device_yet_is_asked_again_when_it_reports_one() -> None:
    manager = FakeManager(device_id=0, device_alive=False)
    rig = Rig(manager).run(20.0)
    assert keys(rig) == []
    assert rig.client.managers_without_id(rig.now) == [AUTOPILOT]
    asked = len(requests(rig))

    manager.device_id, manager.device_alive = 154, True
    rig.run(1.0)

    assert asked < 8
    assert keys(rig) == [GimbalKey(DEVICE)]
    assert rig.client.managers_without_id(rig.now) == []


def test_gm_27_manager_that_tells_no_information_is_known_by_its_status() -> None:
    rig = Rig(FakeManager(announces=False)).run(30.0)

    assert rig.all_of(DeviceConnected)
    assert rig.gimbal.snapshot(rig.now).capabilities is None
    # The pauses grow.
    assert 3 <= len(requests(rig)) <= 15


def test_gm_27_information_that_comes_of_one_of_two_gimbals_is_requested_until_both_came() -> None:
    second = FakeManager(device_id=2, alive=False, announces=False)
    rig = Rig(FakeManager(device_id=1), second).run(3.0)

    second.alive = True
    rig.run(30.0)
    asked = len(requests(rig))
    second.announces = True
    rig.run(40.0)

    # The pauses grow, though the information of the first gimbal comes each time.
    assert 3 <= asked <= 8
    assert [one.snapshot(rig.now).capabilities for one in rig.client.gimbals.values()] == [ALL] * 2


@pytest.mark.parametrize('answer', [mavlink.MAV_RESULT_UNSUPPORTED, None])
def test_gm_27_hundred_components_are_asked_one_after_the_other(answer: int | None) -> None:
    rig = Rig()
    others = [Address(1, number) for number in range(30, 130)]
    for _ in range(60):
        for other in others:
            rig.receive(other, heartbeat(18))
        rig.run(1.0)

    asked = requests(rig)
    first: dict[Address, float] = {}
    for at, target in asked:
        first.setdefault(target, at)
    assert set(first) == set(others)
    # Each request of a silent component is four frames.
    busiest = max(sum(at <= other < at + 10 for other, _ in asked) for at, _ in asked)
    assert busiest <= 10 / limits.REQUEST_SPACING * 4 + 4
    starts = sorted(first.values())
    assert all(after - before >= limits.REQUEST_SPACING - 0.021
               for before, after in zip(starts, starts[1:], strict=False))


def test_autopilot_is_asked_before_other_components() -> None:
    rig = Rig()
    for number in range(30, 60):
        rig.receive(Address(1, number), heartbeat(18))
    # A status would cause a request, too.
    rig.managers.append(FakeManager(streams=False))
    rig.run(1.0)

    assert requests(rig)[0][1] == AUTOPILOT


def test_gimbals_beyond_a_limit_are_not_served_until_forged_ones_are_forgotten() -> None:
    rig = Rig(FakeManager()).run(3.0)
    for component in range(1, 255):
        rig.receive(Address(2, component), FakeManager(device_id=component).status())
    rig.run(1.0)

    assert len(keys(rig)) == limits.MAX_GIMBALS
    assert rig.client.discovery.limit_reached
    rig.run(60.1)
    assert keys(rig) == [GimbalKey(DEVICE)]
    assert not rig.client.discovery.limit_reached


def test_wanted_gimbal_is_found_among_forged_ones() -> None:
    rig = Rig(device_id=154)
    for component in range(10, 250):
        if component != 154:
            rig.receive(Address(1, 60), FakeManager(device_id=component).status())
    rig.managers.append(FakeManager())
    rig.run(3.0)

    assert [event.key for event in rig.all_of(DeviceConnected)] == [GimbalKey(DEVICE)]
    assert len(keys(rig)) == limits.MAX_GIMBALS + 1


@pytest.mark.parametrize(('silent', 'reason'), [
    ('alive', 'nothing from manager 1/1 for 3.'),
    ('device_alive', 'nothing from device 1/154 for 3.')])
def test_gimbal_is_lost_with_its_manager_or_its_device(silent: str, reason: str) -> None:
    rig = Rig(FakeManager()).run(3.0)
    setattr(rig.managers[0], silent, False)
    rig.run(4.5)
    assert rig.all_of(DeviceDisconnected)[-1].reason.startswith(reason)

    setattr(rig.managers[0], silent, True)
    rig.run(2.0)

    assert len(rig.all_of(DeviceConnected)) == 2
    assert rig.gimbal.snapshot(rig.now).unreachable == ''


def test_closed_link_loses_the_gimbal_at_once() -> None:
    rig = Rig(FakeManager()).run(3.0)

    rig.component.link_closed(rig.now, 'cable pulled')

    assert rig.all_of(DeviceDisconnected)[-1].reason == 'cable pulled'
    assert not rig.run(3.0).gimbal.snapshot(rig.now).unreachable


@pytest.mark.parametrize(('lost', 'is_connected'), [
    (DEVICE, False), (AUTOPILOT, False), (OTHER, True)])
def test_line_that_is_lost_beside_another_one_takes_the_gimbal_whose_device_or_manager_it_has(
        lost: Address, is_connected: bool) -> None:
    rig = Rig(FakeManager()).run(3.0)

    rig.component.components_lost([lost], rig.now, 'cable pulled')

    assert [event.reason for event in rig.all_of(DeviceDisconnected)] == (
        [] if is_connected else ['cable pulled'])
    assert not rig.run(3.0).gimbal.snapshot(rig.now).unreachable


@pytest.mark.parametrize('was_commanded', [False, True])
def test_silent_gimbal_is_forgotten_unless_it_was_commanded(was_commanded: bool) -> None:
    rig = Rig(FakeManager()).run(3.0)
    if was_commanded:
        rig.gimbal.release_control(rig.now, rig.done)
    rig.managers.clear()
    # Without a link only the removal of the gimbal is due.
    rig.component.link_closed(rig.now, 'cable pulled')
    rig.run(60.1)

    assert bool(rig.all_of(DeviceForgotten)) is not was_commanded
    assert bool(keys(rig)) is was_commanded


def test_gm_18_second_manager_of_a_gimbal_is_told_and_takes_over_when_the_first_is_lost() -> None:
    rig = Rig(FakeManager(), FakeManager(OTHER, device_alive=False)).run(4.0)
    key = GimbalKey(DEVICE)
    first, second = rig.gimbal.snapshot(rig.now).managers
    assert rig.all_of(events.SecondManager) == [events.SecondManager(key, first, second)]

    rig.managers[0 if first == AUTOPILOT else 1].alive = False
    rig.run(5.0)

    assert rig.all_of(events.ManagerChanged) == [events.ManagerChanged(key, first, second)]
    assert rig.gimbal.snapshot(rig.now).managers == (second,)


def test_gm_20_attitude_is_taken_from_the_device_itself_with_any_manager() -> None:
    rig = Rig(FakeManager(q=(NAN,) * 4)).run(3.0)

    assert rig.all_of(events.AttitudeReceived)[-1].attitude is None
    assert 'not a rotation' in rig.gimbal.snapshot(rig.now).attitude_problem
    assert {target for _, target in requests(rig, DEVICE_INFORMATION)} == {DEVICE}


def intervals(rig: Rig) -> list[tuple[int, float, float]]:
    """Return the intervals that were requested: of which component, message and time."""
    return [(one.target_component, one.param1, one.param2) for one in rig.messages(CommandLong)
            if one.command == mavlink.MAV_CMD_SET_MESSAGE_INTERVAL]


def test_attitude_interval_is_set_once_at_the_device() -> None:
    rig = Rig(FakeManager(), attitude_interval=0.05).run(20.0)

    assert intervals(rig) == [(154, 285, 50_000)]


@pytest.mark.parametrize('device_id', [1, 154])
def test_a_device_that_sends_attitudes_by_itself_keeps_its_interval(device_id: int) -> None:
    assert intervals(Rig(FakeManager(device_id=device_id)).run(20.0)) == []


@pytest.mark.parametrize(('device_id', 'sender'), [(1, 1), (154, 154)])
@pytest.mark.parametrize(('interval', 'requested'), [(0.0, 200_000), (0.1, 100_000)])
def test_attitudes_that_come_on_demand_only_are_requested_and_again_if_they_end(
        device_id: int, sender: int, interval: float, requested: float) -> None:
    manager = FakeManager(device_id=device_id, device_reports=False, on_demand=True)
    rig = Rig(manager, attitude_interval=interval).run(4.0)

    for _ in range(2):
        assert rig.gimbal.snapshot(rig.now).unreachable == ''
        assert manager.device_reports
        assert {*intervals(rig)} == {(sender, 285, requested)}
        rig.sent.clear()
        manager.device_reports = False
        rig.run(2.5)


@pytest.mark.parametrize(('results', 'refused'), [({}, ''), (
    {mavlink.MAV_CMD_SET_MESSAGE_INTERVAL: mavlink.MAV_RESULT_DENIED},
    ', and refuses MAV_CMD_SET_MESSAGE_INTERVAL for it (MAV_RESULT_DENIED)')])
def test_a_manager_that_sends_no_attitude_is_named_with_the_remedy(
        results: dict[int, int], refused: str) -> None:
    rig = Rig(FakeManager(device_id=1, device_reports=False, results=results)).run(60.0)

    assert rig.gimbal.reports.unreachable(rig.now) == (
        f'1/1 is heard and sends no GIMBAL_DEVICE_ATTITUDE_STATUS{refused}: enable the message '
        'there (ArduPilot: stream rate EXTRA3)')
    assert 3 <= len(intervals(rig)) <= 7


def test_a_gimbal_whose_attitudes_come_rarely_as_configured_is_not_lost_between_them() -> None:
    manager = FakeManager(device_id=1, device_reports=False)
    rig = Rig(manager, attitude_interval=5.0)
    for _ in range(6):
        rig.run(5.0)
        rig.receive(AUTOPILOT, manager.attitude())

    assert len(rig.all_of(DeviceConnected)) == 1
    assert rig.all_of(DeviceDisconnected) == []


def test_position_of_the_vehicle_is_that_of_the_autopilot_of_its_system() -> None:
    rig = Rig(FakeManager()).run(1.0)
    position = rig.client.vehicle(rig.gimbal.key).position
    for sender, latitude in ((AUTOPILOT, 47), (OTHER, 48), (Address(2, 1), 49)):
        rig.receive(sender, GlobalPositionInt(
            0, latitude * 10**7, 85 * 10**6, 500_000, 0, 0, 0, 0, 0))

    assert position.get(rig.now) == GeoPoint(47.0, 8.5, 500.0)
    assert position.get(rig.now + 1.0) is None
