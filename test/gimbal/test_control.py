# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Control of a gimbal: taking, releasing and losing it, and the requests that need it."""

from __future__ import annotations

from collections.abc import Callable
import math
import re

from illuminator_ros.geometry.mount_attitude import STILL
from illuminator_ros.gimbal.commands import Control, Rates
from illuminator_ros.gimbal.events import (
    AutomaticTakeFailed,
    ControlChanged,
    GimbalKey,
)
from illuminator_ros.gimbal.gimbal import Gimbal
from illuminator_ros.gimbal.messages import (
    DEVICE_ID_PARAM,
    GimbalManagerSetAttitude,
    GimbalManagerStatus,
    rates_of,
)
from illuminator_ros.mavlink import messages as mav
from illuminator_ros.mavlink.dialect import mavlink, short_names
from illuminator_ros.payload.device_events import DeviceDisconnected
from illuminator_ros.payload.messages import GeoPoint
from illuminator_ros.payload.requests import Done
import pytest
from support.gimbals import (
    ALL,
    AUTOPILOT,
    clear_roi,
    DEVICE,
    FakeManager,
    in_control,
    OTHER,
    OURS,
    PLACE,
    retract,
    Rig,
    set_neutral,
    set_yaw_lock,
    setpoint,
    steps,
)

CONFIGURE = mavlink.MAV_CMD_DO_GIMBAL_MANAGER_CONFIGURE
NONE = mav.Address(0, 0)
Ask = Callable[[Gimbal, float, Done], None]


def commands(rig: Rig, command: int) -> list[tuple[float, ...]]:
    """Return the params of the commands of a kind that were sent."""
    return [(one.param1, one.param2, one.param3, one.param4, one.param5, one.param6, one.param7)
            for one in rig.messages(mav.CommandLong) if one.command == command]


def asked(rig: Rig, ask: Ask, seconds: float = 3.0) -> tuple[bool, str]:
    """Return the outcome of a request."""
    ask(rig.gimbal, rig.now, rig.done)
    rig.run(seconds)
    (result,) = rig.results
    rig.results.clear()
    return result.success, result.message


@pytest.mark.parametrize('secondary', [NONE, mav.Address(255, 190)])
def test_gm_16_control_is_taken_and_released_as_the_status_shows(secondary: mav.Address) -> None:
    rig = Rig(FakeManager(primary=OTHER, secondary=secondary)).run(3.0)

    success, message = asked(rig, Gimbal.take_control)

    assert success, message
    assert message.startswith('control taken, confirmed by GIMBAL_MANAGER_STATUS')
    assert (rig.managers[0].primary, rig.managers[0].secondary) == (OURS, secondary)
    # Explicit ids, never -2; the secondary component is left unchanged.
    assert commands(rig, CONFIGURE) == [(1, 193, -1, -1, 0, 0, 154)]
    success, message = asked(rig, Gimbal.release_control)
    assert success, message
    assert commands(rig, CONFIGURE)[1:] == [(-3, -3, -3, -3, 0, 0, 154)]
    assert [(event.ours, event.was_lost) for event in rig.all_of(ControlChanged)] == [
        (False, False), (True, False), (False, False)]


def test_time_of_control_is_that_of_its_last_change() -> None:
    rig = Rig(FakeManager(primary=OTHER)).run(3.0)
    taken_at = rig.now
    assert rig.gimbal.snapshot(rig.now).control_since < taken_at - 2.0

    assert asked(rig, Gimbal.take_control, 10.0)[0]

    assert taken_at <= rig.gimbal.snapshot(rig.now).control_since < taken_at + 1.5


@pytest.mark.parametrize(('fields', 'text'), [
    ({'results': {CONFIGURE: mavlink.MAV_RESULT_DENIED}},
     'manager 1/1 refused "take control": MAV_RESULT_DENIED (1 try, 0 ms); '
     '1/195 has control and must release it first'),
    ({'results': {CONFIGURE: mavlink.MAV_RESULT_TEMPORARILY_REJECTED}},
     '; 1/195 has control: the log of the manager may have the reason'),
    # ArduPilot before 4.5 has neither the command nor the status.
    ({'results': {CONFIGURE: mavlink.MAV_RESULT_UNSUPPORTED}, 'reports': False},
     'manager 1/1 refused "take control": MAV_RESULT_UNSUPPORTED (1 try, 20 ms); manager 1/1 has '
     'sent no GIMBAL_MANAGER_STATUS'),
    ({'applies': False}, 'but GIMBAL_MANAGER_STATUS shows primary 1/195, secondary none'),
    ({'reports': False}, 'control taken not confirmed: MAV_RESULT_ACCEPTED, but no '
     'GIMBAL_MANAGER_STATUS came within 1.0'),
    ({'answers': False}, 'no acknowledgement')])
def test_gm_16_control_that_no_status_shows_is_not_a_success(
        fields: dict[str, object], text: str) -> None:
    rig = Rig(FakeManager(primary=OTHER, **fields)).run(8.0)  # type: ignore[arg-type]

    success, message = asked(rig, Gimbal.take_control, 8.0)

    assert not success
    assert text in message
    assert not rig.gimbal.reports.in_control


def test_control_that_was_requested_may_be_there_until_the_manager_has_refused_it() -> None:
    rig = Rig(FakeManager()).run(3.0)
    rig.managers[0].results[CONFIGURE] = mavlink.MAV_RESULT_DENIED
    rig.gimbal.take_control(rig.now, rig.done)

    before = rig.gimbal.has_any_control
    rig.run(1.0)

    assert (before, rig.gimbal.has_any_control) == (True, False)


def test_release_without_control_sends_nothing() -> None:
    rig = Rig(FakeManager(primary=OTHER)).run(3.0)

    assert asked(rig, Gimbal.release_control, 0.1) == (
        True, 'not in control: primary 1/195, secondary none')
    assert commands(rig, CONFIGURE) == []


def test_gm_16_release_after_an_unconfirmed_take_is_asked_of_the_manager() -> None:
    rig = Rig(FakeManager()).run(3.0)
    manager = rig.managers[0]
    manager.reports = False
    assert not asked(rig, Gimbal.take_control)[0]
    assert (manager.primary, rig.gimbal.has_any_control) == (OURS, True)

    manager.reports = True
    success, message = asked(rig, Gimbal.release_control)

    assert success, message
    assert (manager.primary, rig.gimbal.has_any_control) == (NONE, False)


@pytest.mark.parametrize('is_restarted', [False, True])
def test_gm_16_control_that_an_earlier_status_showed_is_asked_of_the_manager_again(
        is_restarted: bool) -> None:
    rig = in_control()
    if is_restarted:
        # It rejects commands while it listens for other managers, and sends no status.
        rig.managers[0].results[CONFIGURE] = mavlink.MAV_RESULT_TEMPORARILY_REJECTED
        rig.managers[0].reports = False

    assert asked(rig, Gimbal.take_control, 5.0)[0] is not is_restarted


def test_gm_18_a_request_ends_with_the_manager_that_got_it_and_the_next_goes_to_the_other_one(
        ) -> None:
    rig = Rig(FakeManager(answers=False), FakeManager(OTHER, device_alive=False)).run(4.0)
    used = rig.gimbal.snapshot(rig.now).managers[0]
    first, second = sorted(rig.managers, key=lambda one: one.address != used)
    first.answers, first.alive, second.answers = False, False, True
    rig.run(2.0)
    rig.gimbal.take_control(rig.now, rig.done)
    rig.run(1.5)

    assert [one.message for one in rig.results] == ['the manager was lost']

    rig.gimbal.take_control(rig.now, rig.done)
    rig.run(1.0)
    assert rig.results[-1].success
    assert (first.primary, second.primary) == (mav.Address(0, 0), OURS)


def test_a_request_that_waits_for_another_ends_with_the_link() -> None:
    rig = Rig(FakeManager(answers=False)).run(3.0)
    for ask in Gimbal.take_control, Gimbal.release_control:
        ask(rig.gimbal, rig.now, rig.done)
    rig.component.link_closed(rig.now, 'cable pulled')

    assert [one.message for one in rig.results] == [
        'superseded by release control', 'cable pulled']
    rig.component.link_opened(rig.now)
    assert len(commands(rig.run(5.0), CONFIGURE)) == 2


def test_requests_are_confirmed_after_one_during_which_the_process_paused() -> None:
    rig = Rig(FakeManager()).run(3.0)
    rig.gimbal.take_control(rig.now, rig.done)
    rig.run(0.02)
    rig.now += 8.0
    rig.receive(AUTOPILOT, rig.managers[0].status())
    rig.run(3.0)
    rig.results.clear()

    asks = [Gimbal.release_control, Gimbal.take_control]
    assert [asked(rig, ask, 6.0)[0] for ask in asks] == [True, True]


@pytest.mark.parametrize('primary', [OURS, NONE])
def test_gm_16_release_includes_secondary_control(primary: mav.Address) -> None:
    rig = Rig(FakeManager(primary=primary, secondary=OURS)).run(3.0)

    success, message = asked(rig, Gimbal.release_control)

    assert success, message
    assert rig.managers[0].secondary == NONE
    rig.managers[0].secondary, rig.managers[0].applies = OURS, False
    success, message = asked(rig.run(1.0), Gimbal.release_control, 6.0)
    assert not success
    assert 'secondary 1/193' in message


def test_gm_17_lost_control_is_told_and_not_taken_back() -> None:
    rig = in_control(auto_take_control=True)

    rig.managers[0].primary = OTHER
    rig.run(10.0)

    assert rig.all_of(ControlChanged)[-1] == ControlChanged(
        GimbalKey(DEVICE), Control(OURS), Control(OTHER), False, was_lost=True)
    rig.managers[0].primary = NONE
    rig.run(10.0)
    assert commands(rig, CONFIGURE) == []


@pytest.mark.parametrize(('before', 'after', 'counts'), [
    (5000, 5200, True), (5000, 5000, True), (5000, 4800, False), (60000, 100, True),
    (2**32 - 100, 100, True), (100, 2**32 - 100, False)])
def test_gm_14_status_counts_unless_it_is_late(before: int, after: int, counts: bool) -> None:
    rig = Rig(FakeManager(streams=False)).run(1.0)

    for time, primary in (before, OTHER), (after, OURS):
        rig.receive(AUTOPILOT, GimbalManagerStatus(time, 0, 154, *primary, 0, 0))

    assert rig.gimbal.reports.in_control is counts


def status_requests(rig: Rig) -> int:
    return sum(one[0] == GimbalManagerStatus.id
               for one in commands(rig, mavlink.MAV_CMD_REQUEST_MESSAGE))


def test_gm_14_control_is_not_known_without_a_status_though_the_manager_is_heard() -> None:
    rig = in_control(setpoint_timeout=5.0)
    assert status_requests(rig) <= 1

    rig.managers[0].reports = False
    rig.run(5.5)
    assert rig.gimbal.reports.in_control
    assert status_requests(rig) >= 2
    assert rig.send(Rates((0.0, 0.0, 0.1))) == ''
    rig.run(0.6)

    assert rig.all_of(ControlChanged)[-1].after is None
    assert [one.angular_velocity_z for one in rig.messages(GimbalManagerSetAttitude)] == [-0.1, 0]
    assert rig.send(Rates((0.0, 0.0, 0.1))).startswith(
        'manager 1/1 has sent no GIMBAL_MANAGER_STATUS for 6.')
    rig.managers[0].reports = True
    assert rig.run(0.5).gimbal.reports.in_control


@pytest.mark.parametrize('ask', [Gimbal.take_control, Gimbal.release_control, clear_roi])
def test_gm_14_status_is_out_of_date_for_a_call_that_comes_before_the_poll(ask: Ask) -> None:
    rig = in_control()
    rig.now += 60.0

    ask(rig.gimbal, rig.now, rig.done)

    assert rig.results[0].message.startswith(
        'gimbal 1/154 is not connected: nothing from manager 1/1 for 60.')
    assert not rig.gimbal.reports.in_control


@pytest.mark.parametrize('beat', [10, 50], ids=['', 'and a heartbeat each 5 s'])
def test_control_is_known_of_a_manager_that_sends_its_status_on_request_only(beat: int) -> None:
    rig = Rig(FakeManager(primary=OURS, streams=False, beat=beat)).run(60.0)

    assert [event.ours for event in rig.all_of(ControlChanged)] == [True]
    assert rig.all_of(DeviceDisconnected) == []
    assert status_requests(rig) <= 25
    rig.managers[0].primary = OTHER
    rig.run(3.2)
    assert rig.all_of(ControlChanged)[-1].was_lost


def test_control_is_not_known_in_a_silence_of_the_manager_of_a_silent_device() -> None:
    rig = Rig(FakeManager(primary=OURS, device_alive=False)).run(3.0)
    assert rig.gimbal.reports.in_control
    rig.managers[0].alive = False

    assert not rig.run(3.5).gimbal.reports.in_control


@pytest.mark.parametrize(('primary', 'was_lost'), [(OURS, False), (NONE, True), (OTHER, True)])
def test_control_is_not_known_in_a_silence_and_compared_with_control_before_afterwards(
        primary: mav.Address, was_lost: bool) -> None:
    rig = in_control()
    rig.managers[0].alive = False
    rig.run(4.0)
    assert not rig.gimbal.reports.in_control
    assert rig.all_of(ControlChanged)[-1] == ControlChanged(
        GimbalKey(DEVICE), Control(OURS), None, False, was_lost=False)
    assert 'not connected: nothing from manager 1/1' in asked(rig, Gimbal.take_control, 0.1)[1]
    rig.managers[0].alive, rig.managers[0].primary = True, primary
    rig.run(2.0)

    assert rig.all_of(ControlChanged)[-1] == ControlChanged(
        GimbalKey(DEVICE), Control(OURS), Control(primary if primary.system else None),
        primary == OURS, was_lost)


@pytest.mark.parametrize(('primary', 'result', 'failures'), [
    (NONE, mavlink.MAV_RESULT_ACCEPTED, []), (OTHER, mavlink.MAV_RESULT_ACCEPTED, []),
    (NONE, mavlink.MAV_RESULT_DENIED, [
        'manager 1/1 refused "take control": MAV_RESULT_DENIED (1 try, 0 ms); '
        'no component has control: the log of the manager may have the reason'])])
def test_control_is_taken_automatically_only_where_no_component_has_it(
        primary: mav.Address, result: int, failures: list[str]) -> None:
    manager = FakeManager(primary=primary, results={CONFIGURE: result})
    rig = Rig(manager, auto_take_control=True).run(5.0)

    assert rig.gimbal.reports.in_control is (primary == NONE and not failures)
    assert len(commands(rig, CONFIGURE)) == (primary == NONE)
    assert [event.message for event in rig.all_of(AutomaticTakeFailed)] == failures


def test_gm_19_ardupilot_is_not_taken_for_a_manager_that_enforces_control() -> None:
    rig = Rig(FakeManager(autopilot=mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA)).run(3.0)

    success, message = asked(rig, Gimbal.take_control)

    assert success
    assert message.endswith('; ArduPilot also obeys components without control')
    assert not rig.gimbal.snapshot(rig.now).enforces_control
    assert in_control().gimbal.snapshot(0.0).enforces_control


FLAG_REQUESTS: list[tuple[Ask, int, bool, int]] = [
    (set_neutral, mavlink.GIMBAL_DEVICE_FLAGS_NEUTRAL, True,
     mavlink.GIMBAL_DEVICE_CAP_FLAGS_HAS_NEUTRAL),
    (retract, mavlink.GIMBAL_DEVICE_FLAGS_RETRACT, True,
     mavlink.GIMBAL_DEVICE_CAP_FLAGS_HAS_RETRACT),
    (lambda gimbal, now, done: set_yaw_lock(gimbal, True, now, done),
     mavlink.GIMBAL_DEVICE_FLAGS_YAW_LOCK, True, mavlink.GIMBAL_DEVICE_CAP_FLAGS_HAS_YAW_LOCK),
    (lambda gimbal, now, done: set_yaw_lock(gimbal, False, now, done),
     mavlink.GIMBAL_DEVICE_FLAGS_YAW_LOCK, False, 0)]


# Requests for a pose are commands; a command for the yaw lock would turn the gimbal.
POSES, YAW_LOCK_REQUESTS = FLAG_REQUESTS[:2], FLAG_REQUESTS[2:]


@pytest.mark.parametrize(('ask', 'flag', 'on', 'needed'), FLAG_REQUESTS)
def test_gm_3_flag_is_a_success_only_if_the_device_shows_it(
        ask: Ask, flag: int, on: bool, needed: int) -> None:
    rig = in_control()
    rig.managers[0].flags = 0 if on else flag
    rig.run(1.0)

    success, message = asked(rig, ask)

    assert success, message
    rig.managers[0].applies = False
    rig.managers[0].flags = 0 if on else flag
    rig.run(1.0)
    success, message = asked(rig, ask)
    assert not success
    assert 'GIMBAL_DEVICE_ATTITUDE_STATUS shows' in message


@pytest.mark.parametrize(('ask', 'flag', 'on', 'needed'), POSES)
def test_gm_3_a_pose_is_requested_by_a_command_with_its_flag_alone(
        ask: Ask, flag: int, on: bool, needed: int) -> None:
    rig = in_control()

    asked(rig, ask)

    ((p1, p2, p3, p4, flags, p6, device_id),) = commands(
        rig, mavlink.MAV_CMD_DO_GIMBAL_MANAGER_PITCHYAW)
    assert all(map(math.isnan, (p1, p2, p3, p4)))
    assert (p6, device_id) == (0, 154)
    assert int(flags) & mavlink.GIMBAL_DEVICE_FLAGS_YAW_IN_VEHICLE_FRAME
    assert int(flags) & flag


@pytest.mark.parametrize('lost', [0, 2])
@pytest.mark.parametrize(('ask', 'flag', 'on', 'needed'), YAW_LOCK_REQUESTS)
def test_gm_3_the_yaw_lock_is_set_by_a_rate_of_zero_with_its_flag_until_it_is_shown(
        ask: Ask, flag: int, on: bool, needed: int, lost: int) -> None:
    rig = in_control()
    manager = rig.managers[0]
    manager.flags = 0 if on else flag
    rig.run(1.0)
    rig.send(Rates((0.0, 0.2, 0.0)))
    rig.run(0.1)
    before = len(manager.received)
    manager.applies = not lost

    ask(rig.gimbal, rig.now, rig.done)
    while not rig.results:
        manager.applies = len(manager.received) >= before + lost
        rig.run(0.02)

    # No command: PX4 reads its unset angles as 0.
    assert commands(rig, mavlink.MAV_CMD_DO_GIMBAL_MANAGER_PITCHYAW) == []
    sent = manager.received[before:]
    # The lock and the stop send it again, each until an attitude shows what it is for.
    assert lost < len(sent) <= lost + 4
    assert {rates_of(one) for one in sent} == {STILL}
    assert all(math.isnan(value) for one in sent for value in one.q)
    assert {bool(one.flags & flag) for one in sent} == {on}
    assert [one.success for one in rig.results] == [True]
    rig.run(3.0)
    assert len(manager.received) - before <= lost + 6


@pytest.mark.parametrize('ask', [ask for ask, *_ in FLAG_REQUESTS])
def test_flag_that_no_status_shows_is_not_a_success(ask: Ask) -> None:
    rig = Rig(FakeManager(primary=OURS, device_reports=False)).run(3.0)

    success, message = asked(rig, ask)

    assert not success
    assert 'not confirmed: ' in message
    assert 'no GIMBAL_DEVICE_ATTITUDE_STATUS came within' in message


@pytest.mark.parametrize(('ask', 'needed'), [
    (ask, needed) for ask, _, _, needed in FLAG_REQUESTS if needed])
def test_gm_3_request_for_what_the_gimbal_lacks_is_refused(
        ask: Ask, needed: int) -> None:
    rig = Rig(FakeManager(primary=OURS, capabilities=ALL & ~needed)).run(3.0)

    assert asked(rig, ask) == (
        False, f'gimbal 1/154 does not have {short_names("GIMBAL_DEVICE_CAP_FLAGS")[needed]}')
    assert commands(rig, mavlink.MAV_CMD_DO_GIMBAL_MANAGER_PITCHYAW) == []


def test_gm_8_place_to_point_at_is_sent_with_full_precision_above_sea_level() -> None:
    rig = in_control()

    success, message = asked(rig, lambda gimbal, now, done: gimbal.request(
        GeoPoint(47.3977419, 8.5455938, 488.5), now, done))

    assert success
    assert message.startswith('MAV_RESULT_ACCEPTED (1 try')
    (sent,) = rig.messages(mav.CommandInt)
    assert (sent.command, sent.frame, sent.param1, sent.x, sent.y, sent.z) == (
        195, 0, 154, 473977419, 85455938, 488.5)
    assert asked(rig, clear_roi)[0]
    assert commands(rig, mavlink.MAV_CMD_DO_SET_ROI_NONE) == [(154, 0, 0, 0, 0, 0, 0)]


def set_roi(gimbal: Gimbal, now: float, done: Done) -> None:
    gimbal.request(PLACE, now, done)


@pytest.mark.parametrize(('ask', 'command', 'wish'), [
    (retract, mavlink.MAV_CMD_DO_GIMBAL_MANAGER_PITCHYAW, 'retract'),
    (set_roi, mavlink.MAV_CMD_DO_SET_ROI_LOCATION, 'point at 47, 8.5, 500 m'),
    (clear_roi, mavlink.MAV_CMD_DO_SET_ROI_NONE, 'point at no place')])
def test_refusal_names_the_request_the_manager_and_who_has_control(
        ask: Ask, command: int, wish: str) -> None:
    rig = in_control()
    rig.managers[0].results[command] = mavlink.MAV_RESULT_DENIED

    refusal = re.escape(f'manager 1/1 refused "{wish}": MAV_RESULT_DENIED')
    success, message = asked(rig, ask)
    assert not success
    assert re.fullmatch(rf'{refusal} \(1 try, \d+ ms\); this node has control: the log of the '
                        'manager may have the reason', message)
    rig.managers[0].device_alive = False
    rig.run(4.0)
    success, message = asked(rig, ask)
    assert not success
    assert re.match(rf'{refusal} \(1 try, [^)]*\); nothing from device 1/154 for ', message)
    rig.managers[0].device_alive = True
    rig.run(1.0)
    # Another player takes control while the command is in flight.
    ask(rig.gimbal, rig.now, rig.done)
    rig.managers[0].primary = OTHER
    rig.receive(AUTOPILOT, rig.managers[0].status())
    rig.run(1.0)
    assert rig.results[0].message == 'no control of gimbal 1/154: primary 1/195, secondary none'


@pytest.mark.parametrize(('primary', 'reason'), [
    (OTHER, 'primary 1/195, secondary none'),
    (NONE, 'primary none, secondary none; take control first')])
@pytest.mark.parametrize('ask', [*(ask for ask, *_ in FLAG_REQUESTS), clear_roi, set_roi])
def test_gm_14_request_without_control_is_not_sent_and_tells_who_has_it(
        ask: Ask, primary: mav.Address, reason: str) -> None:
    rig = Rig(FakeManager(primary=primary)).run(3.0)

    assert asked(rig, ask) == (False, f'no control of gimbal 1/154: {reason}')
    assert not {one.command for one in rig.managers[0].commands} & set(DEVICE_ID_PARAM)


@pytest.mark.parametrize('ask', [
    Gimbal.take_control, *(ask for ask, *_ in FLAG_REQUESTS), clear_roi, set_roi])
def test_a_request_that_may_have_waited_during_a_stop_of_the_process_is_refused(
        ask: Ask) -> None:
    rig = in_control()

    rig.component.stalled(7.0, rig.now)
    ask(rig.gimbal, rig.now, rig.done)
    rig.gimbal.release_control(rig.now, rig.done)
    rig.run(1.0)

    assert [one.success for one in rig.results] == [False, True]
    assert rig.results[0].message == (
        'the request may be 7.00 s old, since this process was stopped as long; repeat it')


@pytest.mark.parametrize('second', [2, 171])
def test_gm_28_requests_and_setpoints_name_one_of_the_gimbals_of_a_manager(second: int) -> None:
    first, other = FakeManager(), FakeManager(device_id=second)
    rig = Rig(first, other).run(5.0)
    gimbal = next(one for one in rig.client.gimbals.values() if one.key.device_id == second)

    gimbal.take_control(rig.now, rig.done)
    rig.run(3.0)
    setpoint(gimbal, Rates((0.0, 0.1, 0.0)), rig.now)
    rig.run(1.0)

    assert rig.results[0].success
    assert [one.key.device_id for one in rig.client.gimbals.values()
            if one.reports.in_control] == [second]
    assert first.received == []
    assert steps(one.angular_velocity_y for one in other.received) == [pytest.approx(-0.1), 0.0]
