# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The Two Commandments: only one manager of a gimbal is active."""

from __future__ import annotations

from collections.abc import Callable
import math

from illuminator_ros.gimbal.manager import RequestRefused
from illuminator_ros.gimbal.manager_state import (
    MANAGER_TIMEOUT,
    ManagerInput,
    ManagerState,
    StateChanged,
    TRANSITIONS,
)
from illuminator_ros.gimbal.messages import (
    GimbalDeviceSetAttitude,
    GimbalManagerInformation,
    GimbalManagerStatus,
)
from illuminator_ros.mavlink.dialect import mavlink, replaced
from illuminator_ros.mavlink.messages import Address, CommandLong, Message
import pytest
from support.gimbal_manager import (
    attitude_status,
    AUTOPILOT,
    configure,
    DEVICE,
    euler,
    GUEST,
    information,
    ManagerRig,
    of,
    PILOT,
    pitch_yaw,
    request,
)

OTHER = Address(1, 191)


def status(device_id: int = DEVICE.component) -> GimbalManagerStatus:
    return GimbalManagerStatus(0, 0, device_id, 0, 0, 0, 0)


def reached(state: ManagerState) -> ManagerRig:
    rig = ManagerRig(active=False)
    if state is ManagerState.NO_DEVICE:
        rig.device_is_there = False
        rig.run(4.0)
    elif state is ManagerState.LISTENING:
        rig.run(0.5)
    else:
        rig.run(5.0)
        if state is ManagerState.INACTIVE:
            rig.give(OTHER, status())
    assert rig.manager.tracker.state is state
    return rig


@pytest.mark.parametrize('is_device', [False, True])
def test_line_that_is_lost_beside_another_one_loses_the_device_if_it_has_it(
        is_device: bool) -> None:
    rig = reached(ManagerState.ACTIVE)
    lost = rig.manager.tracker.device if is_device else OTHER
    assert lost
    rig.component.components_lost([lost], rig.now, 'cut')
    assert rig.manager.tracker.state is (
        ManagerState.NO_DEVICE if is_device else ManagerState.ACTIVE)


@pytest.mark.parametrize('input_', ManagerInput)
@pytest.mark.parametrize('state', ManagerState)
def test_each_input_leads_to_the_state_of_the_table(
        state: ManagerState, input_: ManagerInput) -> None:
    rig = reached(state)
    if input_ is ManagerInput.DEVICE_HEARD:
        rig.device_is_there = True
        rig.run(0.5)
    elif input_ is ManagerInput.DEVICE_LOST:
        rig.component.link_closed(rig.now, 'cut')
    elif input_ is ManagerInput.MANAGER_HEARD:
        rig.give(OTHER, status())
    elif input_ is ManagerInput.MANAGER_LOST:
        rig.run(MANAGER_TIMEOUT)
        rig.give(PILOT)
    elif state is not ManagerState.INACTIVE:
        rig.run(2.6)
    expected = TRANSITIONS.get((state, input_), state)

    if (state, input_) == (ManagerState.LISTENING, ManagerInput.MANAGER_LOST):
        # The time of LISTENING ends meanwhile.
        expected = ManagerState.ACTIVE
    assert rig.manager.tracker.state is expected


@pytest.mark.parametrize('message', [
    status(), GimbalManagerInformation(0, 0, DEVICE.component, *(0.0,) * 6)])
@pytest.mark.parametrize('when', [ManagerState.LISTENING, ManagerState.ACTIVE])
def test_gm_18_another_manager_of_the_device_makes_ours_inactive_and_is_named(
        when: ManagerState, message: GimbalManagerStatus | GimbalManagerInformation) -> None:
    rig = reached(when)

    rig.give(OTHER, message)
    begun = rig.now
    rig.run(1.0)

    assert of(StateChanged, rig.events)[-1] == StateChanged(
        when, ManagerState.INACTIVE, DEVICE.component, DEVICE, OTHER)
    assert rig.messages(GimbalManagerStatus, begun) == []
    assert [rig.result(PILOT, command) for command in (
        configure(*PILOT), request(GimbalManagerInformation))] == [mavlink.MAV_RESULT_DENIED] * 2


def test_gm_19_an_inactive_manager_gives_the_device_no_setpoint() -> None:
    rig = ManagerRig()
    rig.take(PILOT)
    rig.points(PILOT)

    rig.run(0.1)
    begun = rig.now
    rig.give(OTHER, status())
    rig.run(2.0, each=rig.heartbeats(PILOT))

    assert rig.points(PILOT) == rig.messages(GimbalDeviceSetAttitude, begun) == []


def test_setpoints_and_offsets_end_when_the_manager_becomes_inactive() -> None:
    rig = ManagerRig()
    rig.take(PILOT)
    rig.give(GUEST, configure(-1, -1, *GUEST))
    rig.points(GUEST, 0.1)
    rig.give(OTHER, status())
    begun = rig.now
    rig.points(PILOT, 0.3)
    [refused] = of(RequestRefused, rig.events)
    assert refused.reason == 'the manager is not active: inactive'
    rig.run(MANAGER_TIMEOUT + 5.0, each=rig.heartbeats(PILOT, GUEST))

    assert rig.manager.tracker.state is ManagerState.ACTIVE
    assert rig.messages(GimbalDeviceSetAttitude, begun) == []
    assert [euler(one) for one in rig.points(PILOT, 0.2)] == [(0.0, 0.2, 0.0)]


def cut_the_line(rig: ManagerRig) -> None:
    rig.device_is_there = False
    rig.run(4.0)
    rig.device_is_there = True


@pytest.mark.parametrize('interrupt', [cut_the_line, lambda rig: rig.give(OTHER, status())])
def test_a_rate_ends_when_the_manager_is_active_again(
        interrupt: Callable[[ManagerRig], object]) -> None:
    rig = ManagerRig()
    rig.take(PILOT)
    rig.give(PILOT, pitch_yaw(pitch_rate=0.0, yaw_rate=0.3))
    rig.run(0.1)
    interrupt(rig)
    interrupted = rig.now
    rig.run(MANAGER_TIMEOUT + 5.0)

    assert rig.manager.tracker.state is ManagerState.ACTIVE
    sent = rig.messages(GimbalDeviceSetAttitude, interrupted)
    assert sent
    assert {(one.angular_velocity_x, one.angular_velocity_y, one.angular_velocity_z)
            for one in sent} == {(0.0, 0.0, 0.0)}
    assert all(math.isnan(one.q[0]) for one in sent)


def test_gm_24_a_device_with_a_manager_of_its_own_keeps_ours_inactive() -> None:
    rig = reached(ManagerState.LISTENING)

    rig.give(DEVICE, status(1))

    assert rig.manager.tracker.state is ManagerState.INACTIVE
    assert rig.manager.tracker.other == DEVICE


@pytest.mark.parametrize(('source', 'device_id'), [
    (OTHER, 171), (Address(2, 191), DEVICE.component)])
def test_gm_26_the_manager_of_another_device_leaves_ours_active(
        source: Address, device_id: int) -> None:
    rig = ManagerRig()

    rig.give(source, status(device_id))

    assert rig.manager.tracker.state is ManagerState.ACTIVE


def test_gm_18_managers_that_send_no_status_are_asked_before_ours_announces_anything() -> None:
    rig = reached(ManagerState.LISTENING)

    asked = [one for one in rig.messages(CommandLong) if one.target_system == 0]

    assert [one.param1 for one in asked] == [GimbalManagerInformation.id]
    assert rig.messages(GimbalManagerStatus) == []


@pytest.mark.parametrize('address', [Address(1, 195), Address(1, 193), Address(1, 186)])
@pytest.mark.parametrize('apart', [0.0, 1.0])
def test_gm_18_of_two_managers_that_begin_together_one_becomes_active(
        apart: float, address: Address) -> None:
    # At first both managers listen until the same moment.
    first = ManagerRig(active=False, draws=(0.5, 0.0))
    first.run(apart)
    second = ManagerRig(active=False, address=address, draws=(0.5 - apart / 2, 0.5))
    second.now = first.now
    seen = [0, 0]
    for _ in range(400):
        for rig in (first, second):
            rig.run(0.05)
        # Both have run: each starts before it hears the other.
        sent = len(first.sent), len(second.sent)
        for index, rig in enumerate((first, second)):
            for _, message in rig.sent[seen[index]:sent[index]]:
                (second, first)[index].give(rig.component.address, message)
            seen[index] = sent[index]

    assert first.manager.tracker.state is ManagerState.ACTIVE
    assert second.manager.tracker.state is ManagerState.INACTIVE
    assert second.manager.tracker.other == first.component.address


@pytest.mark.parametrize('message', [
    replaced(attitude_status(), gimbal_device_id=1), information(gimbal_device_id=1)])
def test_an_autopilot_that_reports_a_gimbal_on_its_outputs_is_not_taken_for_a_device(
        message: Message) -> None:
    rig = reached(ManagerState.NO_DEVICE)

    rig.give(AUTOPILOT, message)

    assert rig.manager.tracker.device is None


@pytest.mark.parametrize(('state', 'reason'), [
    (ManagerState.NO_DEVICE, 'a gimbal device has not been heard; heard: 2/154'),
    (ManagerState.LISTENING, 'the manager listens for other managers'),
    (ManagerState.ACTIVE, ''), (ManagerState.INACTIVE, '1/191 manages gimbal 1/154 too')])
def test_the_reason_why_a_gimbal_is_not_managed_names_what_is_heard(
        state: ManagerState, reason: str) -> None:
    rig = reached(state)
    # A gimbal of another system is not managed.
    rig.give(Address(2, 154), attitude_status())

    assert rig.manager.tracker.state is state
    assert rig.manager.tracker.inactive_reason == reason


def test_manager_names_the_devices_that_are_heard_instead_of_its_own() -> None:
    rig = ManagerRig(device_id=171, active=False)
    rig.run(1.0)

    assert rig.manager.tracker.inactive_reason == (
        'gimbal device 171 has not been heard; heard: 1/154')
