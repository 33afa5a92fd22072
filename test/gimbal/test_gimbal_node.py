# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The node of a gimbal: every topic, service and parameter of its interface, over real UDP."""

from __future__ import annotations

from collections.abc import Callable, Iterator
import contextlib
import math
from pathlib import Path
import signal
from typing import Any

from illuminator_ros.geometry.mount_attitude import from_mavlink, to_mavlink, YawFrame
from illuminator_ros.geometry.rotation import Quaternion
from illuminator_ros.gimbal.messages import NO_COMPONENT, rates_of
from illuminator_ros.mavlink.dialect import mavlink
from illuminator_ros.mavlink.link import Link
from illuminator_ros.mavlink.messages import CommandInt
import pytest

pytest.importorskip('rclpy')

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus  # noqa: E402, I100
from geometry_msgs.msg import Quaternion as QuaternionMessage  # noqa: E402
from geometry_msgs.msg import QuaternionStamped, Vector3, Vector3Stamped  # noqa: E402
from illuminator_ros.gimbal.ros.diagnostics import device_findings  # noqa: E402, I100
from illuminator_ros.gimbal.ros.gimbals import GIMBAL_PARAMETERS  # noqa: E402, I100
from illuminator_ros.illuminator.ros.parameters import LIGHT_PARAMETERS  # noqa: E402
from illuminator_ros.ros.parameters import LINK_PARAMETERS  # noqa: E402
from rclpy.qos import ReliabilityPolicy  # noqa: E402
from sensor_msgs.msg import NavSatFix, NavSatStatus  # noqa: E402
from std_msgs.msg import Bool, Header, String  # noqa: E402
from std_srvs.srv import SetBool, Trigger  # noqa: E402
from support.gimbals import FakeManager, NAN, OTHER, OURS, Rig, served_gimbals  # noqa: E402
from support.ports import free_port  # noqa: E402
from support.processes import ended, Program, slow_python  # noqa: E402
from support.ros import (  # noqa: E402
    bridge_arguments,
    Parameters,
    repeated,
    Ros,
    running_bridge,
    start_bridge,
    start_slow_bridge,
    STREAM,
)
from support.slow import pass_time_until, SlowLink, time_passes  # noqa: E402
from support.waiting import eventually  # noqa: E402

EARTH, VEHICLE = Header(frame_id='odom'), Header(frame_id='base_link_stabilized')
# 45 degrees down and 30 to the left of the vehicle, in ROS and in MAVLink.
ROS_ANGLES = (0.0, math.radians(45), math.radians(30))
TURNED = Quaternion.from_euler(*ROS_ANGLES)
NODE_PARAMETERS = ('use_sim_time', 'start_type_description_service')
SET_BY_SERVICES = (mavlink.GIMBAL_DEVICE_FLAGS_NEUTRAL | mavlink.GIMBAL_DEVICE_FLAGS_RETRACT
                   | mavlink.GIMBAL_DEVICE_FLAGS_YAW_LOCK)
LOST = 'control of gimbal 1/154 lost: 1/195 has taken primary control'


def start_gimbal(ros: Ros, port: int, **parameters: Any) -> Program:
    return slow_python(
        'illuminator_ros.gimbal', *bridge_arguments(port, **parameters),
        env={'ROS_DOMAIN_ID': str(ros.domain)})


@contextlib.contextmanager
def bridge(ros: Ros, *managers: FakeManager, **parameters: Any) -> Iterator[Program]:
    """Run a bridge that serves gimbals, and fake managers that are connected to it."""
    port = free_port()
    with (ended(start_gimbal(ros, port, **parameters)) as program,
          served_gimbals(port, *managers, link=SlowLink), time_passes()):
        program.wait_for('connected, manager')
        yield program


@pytest.fixture(scope='module')
def served(ros: Ros) -> Iterator[tuple[Program, FakeManager]]:
    manager = FakeManager(
        q=to_mavlink(TURNED, YawFrame.VEHICLE), rates=(0.1, 0.2, 0.3), delta_yaw=0.5)
    with bridge(ros, manager, earth_frame='odom', geoid_separation=47.5) as program:
        yield program, manager


@pytest.fixture
def gimbal(ros: Ros, served: tuple[Program, FakeManager]) -> Iterator[FakeManager]:
    """Return the module's gimbal, which obeys and has received nothing yet."""
    manager = served[1]
    before = vars(manager).copy()
    # A release ends the repeated setpoints of the previous test if the gimbal then stands.
    manager.rates = (0.0, 0.0, 0.0)
    for name in ('take_control', 'release_control'):
        assert trigger(ros, name).success
    manager.rates = before['rates']
    manager.received.clear()
    manager.commands.clear()
    yield manager
    vars(manager).update(before, results={})


@pytest.fixture
def program(served: tuple[Program, FakeManager]) -> Program:
    return served[0]


def take_control(ros: Ros, gimbal: FakeManager) -> None:
    gimbal.primary = OURS
    ros.subscribe(Bool, '/gimbal/in_control').wait_value(True)


def trigger(ros: Ros, name: str, node: str = '/gimbal') -> Trigger.Response:
    answer: Trigger.Response = ros.call(Trigger, f'{node}/{name}', Trigger.Request())
    return answer


def publish(ros: Ros, name: str, message: Any) -> None:
    ros.publisher(type(message), f'/gimbal/{name}', '/gimbal').publish(message)


def values(vector: Any) -> tuple[float, float, float]:
    return vector.x, vector.y, vector.z


# Published

def test_gm_2_attitude_is_flu_and_its_frame_tells_what_yaw_is_relative_to(
        ros: Ros, gimbal: FakeManager) -> None:
    attitude = ros.subscribe(QuaternionStamped, '/gimbal/attitude', STREAM)
    angles = ros.subscribe(Vector3Stamped, '/gimbal/angles', STREAM)
    rates = ros.subscribe(Vector3Stamped, '/gimbal/angular_velocity', STREAM)
    lock = ros.subscribe(Bool, '/gimbal/yaw_lock')

    message = attitude.wait(lambda one: one.header.frame_id == 'base_link_stabilized')
    q = message.quaternion
    assert Quaternion(q.w, q.x, q.y, q.z).angle_to(TURNED) == pytest.approx(0, abs=1e-6)
    assert message.header.stamp.sec > 1_600_000_000
    assert values(angles.wait().vector) == pytest.approx(ROS_ANGLES, abs=1e-6)
    assert values(rates.wait().vector) == pytest.approx((0.1, -0.2, -0.3))
    assert lock.wait().data is False

    gimbal.q, gimbal.rates = to_mavlink(TURNED, YawFrame.EARTH), (NAN,) * 3
    gimbal.flags = (mavlink.GIMBAL_DEVICE_FLAGS_YAW_LOCK
                    | mavlink.GIMBAL_DEVICE_FLAGS_YAW_IN_EARTH_FRAME)
    lock.wait_value(True)
    earth = angles.wait(lambda one: one.header.frame_id == 'odom')
    assert values(earth.vector) == pytest.approx(ROS_ANGLES, abs=1e-6)
    ros.synchronize('/gimbal')
    angles.clear()
    rates.clear()
    angles.wait(count=4)
    assert not rates.messages


def test_controller_is_named_and_lost_control_is_logged_and_not_taken_back(
        ros: Ros, gimbal: FakeManager, program: Program) -> None:
    controller = ros.subscribe(String, '/gimbal/controller')
    gimbal.primary = OTHER
    controller.wait_value('primary 1/195, secondary none')
    take_control(ros, gimbal)
    controller.wait_value('primary 1/193, secondary none')
    lost = program.count(LOST)

    gimbal.primary, gimbal.secondary = OTHER, OURS
    controller.wait_value('primary 1/195, secondary 1/193')

    program.wait_for(LOST, count=lost + 1)
    ros.subscribe(Bool, '/gimbal/in_control').wait_value(False)
    take_control(ros, gimbal)
    gimbal.primary = NO_COMPONENT
    program.wait_for('control of gimbal 1/154 ended: no component has primary control')


# Services

def test_gm_16_control_is_taken_and_released_by_services(
        ros: Ros, gimbal: FakeManager) -> None:
    for name, primary in (('take_control', OURS), ('release_control', NO_COMPONENT)):
        answer = trigger(ros, name)
        assert answer.success, answer.message
        assert 'confirmed by GIMBAL_MANAGER_STATUS' in answer.message
        assert gimbal.primary == primary
    gimbal.results[mavlink.MAV_CMD_DO_GIMBAL_MANAGER_CONFIGURE] = mavlink.MAV_RESULT_DENIED
    answer = trigger(ros, 'take_control')
    assert not answer.success
    # Where the machine is busy, the answer may belong to an earlier command.
    assert 'MAV_RESULT_DENIED' in answer.message


def test_gm_3_positions_and_yaw_lock_are_set_by_services(ros: Ros, gimbal: FakeManager) -> None:
    take_control(ros, gimbal)
    lock = ros.subscribe(Bool, '/gimbal/yaw_lock')
    for name, request, flags in (
            ('neutral', Trigger.Request(), mavlink.GIMBAL_DEVICE_FLAGS_NEUTRAL),
            ('set_yaw_lock', SetBool.Request(data=True), mavlink.GIMBAL_DEVICE_FLAGS_YAW_LOCK),
            ('set_yaw_lock', SetBool.Request(data=False), 0),
            ('retract', Trigger.Request(), mavlink.GIMBAL_DEVICE_FLAGS_RETRACT)):
        service = SetBool if name == 'set_yaw_lock' else Trigger

        answer = ros.call(service, f'/gimbal/{name}', request)

        assert answer.success, answer.message
        assert gimbal.flags & SET_BY_SERVICES == flags
        lock.wait_value(bool(flags & mavlink.GIMBAL_DEVICE_FLAGS_YAW_LOCK))


def test_place_to_point_at_is_converted_from_the_ellipsoid_and_cleared_by_a_service(
        ros: Ros, gimbal: FakeManager, program: Program) -> None:
    take_control(ros, gimbal)

    publish(ros, 'cmd/roi', NavSatFix(latitude=47.39, longitude=8.54, altitude=535.5))

    # The command may be sent again if its acknowledgement is late.
    place, *_ = eventually(
        lambda: [one for one in gimbal.commands if isinstance(one, CommandInt)])
    assert (place.command, place.frame, place.x, place.y, place.z) == (
        195, 0, 473900000, 85400000, 488.0)
    assert trigger(ros, 'clear_roi').success
    publish(ros, 'cmd/roi', NavSatFix(latitude=91.0, longitude=8.54, altitude=0.0))
    program.wait_for('~/cmd/roi: ignored: latitude 91')


# The target

def test_gimbal_is_on_target_while_it_shows_the_angles_that_were_asked_for(
        ros: Ros, gimbal: FakeManager) -> None:
    take_control(ros, gimbal)
    on_target = ros.subscribe(Bool, '/gimbal/on_target')
    on_target.wait_value(False)

    publish(ros, 'cmd/angles', Vector3Stamped(
        header=VEHICLE, vector=Vector3(**dict(zip('xyz', ROS_ANGLES, strict=True)))))
    on_target.wait_value(True)
    gimbal.q = to_mavlink(Quaternion(), YawFrame.VEHICLE)
    on_target.wait_value(False)

    report(ros, 'in control', 'degrees off')
    gimbal.primary = OTHER
    report(ros, 'connected', 'no control of gimbal')


def test_gimbal_is_on_target_of_a_place_only_while_the_position_of_the_vehicle_is_known(
        ros: Ros, gimbal: FakeManager) -> None:
    take_control(ros, gimbal)
    on_target, roi = (ros.subscribe(*one) for one in (
        (Bool, '/gimbal/on_target'), (NavSatFix, '/gimbal/roi')))
    assert math.isnan(roi.wait(lambda one: one.status.status < 0).latitude)
    # The place is 45 degrees down in the north.
    gimbal.flags = mavlink.GIMBAL_DEVICE_FLAGS_YAW_IN_EARTH_FRAME
    gimbal.q = to_mavlink(
        Quaternion.from_euler(0.0, math.radians(45), math.radians(90)), YawFrame.EARTH)

    place = NavSatFix(latitude=47.0009, longitude=8.5, altitude=500.0)
    publish(ros, 'cmd/roi', place)
    roi.wait(lambda one: (one.status.status, one.latitude, one.longitude, one.altitude) == (
        0, place.latitude, place.longitude, place.altitude))
    on_target.wait_value(False)
    with repeated(ros.publisher(NavSatFix, '/gimbal/fix', '/gimbal'), NavSatFix(
            status=NavSatStatus(status=0), latitude=47.0, longitude=8.5, altitude=600.0)):
        on_target.wait_value(True)
    on_target.wait_value(False)

    assert trigger(ros, 'clear_roi').success
    roi.wait(lambda one: one.status.status < 0)


# Setpoints

@pytest.mark.parametrize(('header', 'frame'), [
    (EARTH, YawFrame.EARTH), (VEHICLE, YawFrame.VEHICLE)])
@pytest.mark.parametrize('as_angles', [True, False])
def test_gm_4_attitude_and_angles_are_the_same_setpoint(
        header: Header, frame: YawFrame, as_angles: bool, ros: Ros,
        gimbal: FakeManager) -> None:
    take_control(ros, gimbal)
    if as_angles:
        roll, pitch, yaw = ROS_ANGLES
        publish(ros, 'cmd/angles', Vector3Stamped(
            header=header, vector=Vector3(x=roll, y=pitch, z=yaw)))
    else:
        publish(ros, 'cmd/attitude', QuaternionStamped(header=header, quaternion=QuaternionMessage(
            x=2 * TURNED.x, y=2 * TURNED.y, z=2 * TURNED.z, w=2 * TURNED.w)))

    sent = eventually(lambda: gimbal.received)[0]

    assert from_mavlink(sent.q, frame).angle_to(TURNED) == pytest.approx(0, abs=1e-6)
    assert sent.flags & frame.flag


def test_rate_is_sent_and_a_zero_follows_after_a_timeout_that_may_be_set_while_the_node_runs(
        ros: Ros, gimbal: FakeManager) -> None:
    parameters = Parameters(ros, '/gimbal')
    assert parameters.set(setpoint_timeout=60)[0].successful
    gimbal.rates = (0.0, 0.0, 0.0)
    take_control(ros, gimbal)
    publish(ros, 'cmd/rate', Vector3Stamped(vector=Vector3(y=0.2, z=-0.1)))
    eventually(lambda: len(gimbal.received) == 1)

    assert parameters.set(setpoint_timeout=0.2)[0].successful
    eventually(lambda: len(gimbal.received) > 1)

    rate, *zeros = [rates_of(one) for one in gimbal.received]
    assert rate[1:] == pytest.approx((-0.2, 0.1))
    assert {*zeros} == {(0.0, 0.0, 0.0)}


def test_a_gimbal_that_turns_after_its_rate_is_an_error_and_keeps_control_until_it_stands(
        ros: Ros, gimbal: FakeManager, program: Program) -> None:
    take_control(ros, gimbal)
    gimbal.rates = (0.0, 0.0, 0.2)
    publish(ros, 'cmd/rate', Vector3Stamped(vector=Vector3(z=-0.2)))

    program.wait_for('gimbal 1/154 still turns, although its rate has ended')
    status = report(ros, 'after the end of its rate')
    assert (status.level, status.message.partition(' ')[0]) == (DiagnosticStatus.ERROR, 'turns')
    answer = trigger(ros, 'release_control')
    assert (answer.success, answer.message.partition(',')[0]) == (
        False, 'the gimbal still turns')
    assert gimbal.primary == OURS
    gimbal.rates = (0.0, 0.0, 0.0)
    program.wait_for('gimbal 1/154 stands')
    assert trigger(ros, 'release_control').success


def test_a_gimbal_whose_motion_after_a_rate_is_unknown_is_a_warning(
        ros: Ros, gimbal: FakeManager) -> None:
    take_control(ros, gimbal)
    gimbal.device_reports = False
    publish(ros, 'cmd/rate', Vector3Stamped(vector=Vector3(z=-0.2)))

    assert report(ros, 'its motion is unknown').level == DiagnosticStatus.WARN


def test_a_player_that_takes_control_of_a_gimbal_at_our_rate_is_named_with_that(
        ros: Ros, gimbal: FakeManager, program: Program) -> None:
    take_control(ros, gimbal)
    publish(ros, 'cmd/rate', Vector3Stamped(vector=Vector3(z=-0.2)))
    eventually(lambda: gimbal.received)
    gimbal.primary = OTHER

    program.wait_for('1/195 has taken primary control, and it may still turn at a rate of this')


@pytest.mark.parametrize(('topic', 'message', 'text'), [
    ('cmd/attitude', QuaternionStamped(header=Header(frame_id='map')),
     "frame_id 'map' is neither 'odom' nor 'base_link_stabilized'"),
    ('cmd/attitude', QuaternionStamped(header=EARTH, quaternion=QuaternionMessage(w=0.0)),
     '(0, 0, 0, 0) is not a rotation'),
    ('cmd/angles', Vector3Stamped(header=EARTH, vector=Vector3(x=math.inf)),
     'roll inf rad is beyond 3.1416 rad'),
    ('cmd/rate', Vector3Stamped(vector=Vector3(z=NAN)),
     'yaw rate nan rad/s is not within 6.2832 rad/s')])
def test_wrong_setpoint_is_refused_with_the_reason(
        topic: str, message: Any, text: str, ros: Ros, gimbal: FakeManager,
        program: Program) -> None:
    take_control(ros, gimbal)
    publish(ros, topic, message)

    program.wait_for(f'~/{topic}: ignored: {text}')
    assert gimbal.received == []


# Diagnostics

def report(ros: Ros, wanted: str, off: str = '') -> DiagnosticStatus:
    """Return the first status of the device whose message, and ``off_target``, have a text."""
    def statuses(array: DiagnosticArray) -> list[DiagnosticStatus]:
        return [one for one in array.status if one.name == 'gimbal: device'
                and wanted in one.message and off in off_target(one)]

    found: DiagnosticStatus = statuses(
        ros.subscribe(DiagnosticArray, '/diagnostics', STREAM).wait(statuses))[0]
    return found


def off_target(status: DiagnosticStatus) -> str:
    """Return why the gimbal is not on target."""
    return str({one.key: one.value for one in status.values}['off_target'])


def logged(program: Program, flags: str) -> str:
    """Return the level of the line about failure flags."""
    text = f'gimbal 1/154: failure flags: {flags}'
    program.wait_for(text)
    return next(line for line in program.lines if text in line).split()[0]


def test_diagnostics_name_flags_limits_identity_and_control(
        ros: Ros, gimbal: FakeManager, program: Program) -> None:
    take_control(ros, gimbal)
    status = report(ros, 'in control')
    shown = {one.key: one.value for one in status.values}
    assert (status.level, status.hardware_id) == (DiagnosticStatus.OK, '4d')
    assert {'vendor': 'Maker', 'model': 'Turn', 'firmware_version': '1.2.3',
            'controller': 'primary 1/193, secondary none', 'manager': '1/1',
            'yaw_frame': 'vehicle', 'pitch_rad': '0.785398', 'pitch_min_rad': '-0.5',
            'pitch_max_rad': '1.5'}.items() <= shown.items()
    assert 'has yaw lock' in shown['capabilities']
    assert float(shown['controller_s']) >= 0.0

    gimbal.failure_flags = (mavlink.GIMBAL_DEVICE_ERROR_FLAGS_MOTOR_ERROR
                            | mavlink.GIMBAL_DEVICE_ERROR_FLAGS_AT_PITCH_LIMIT | 1 << 20)
    status = report(ros, 'motor error')
    assert status.level == DiagnosticStatus.ERROR
    assert status.message == 'motor error; unknown flags 0x100000; at pitch limit'
    assert logged(program, 'at pitch limit, motor error') == '[WARN]'
    gimbal.failure_flags, gimbal.q = 0, (NAN,) * 4
    assert report(ros, 'attitude unknown').level == DiagnosticStatus.WARN
    assert logged(program, 'none') == '[INFO]'
    gimbal.reports = False
    assert report(ros, 'no GIMBAL_MANAGER_STATUS for').level == DiagnosticStatus.WARN


@pytest.mark.parametrize('parameters', [{}, {'geoid_separation': 0.0}])
def test_a_place_without_a_geoid_separation_is_a_warning_while_the_gimbal_points_at_it(
        own_ros: Ros, parameters: dict[str, float]) -> None:
    text = 'geoid_separation is not set, so the altitude of the place is taken as above'
    with bridge(own_ros, FakeManager(primary=OURS), **parameters) as program:
        own_ros.subscribe(Bool, '/gimbal/in_control').wait_value(True)
        assert report(own_ros, 'in control').level == DiagnosticStatus.OK
        for _ in range(2):
            publish(own_ros, 'cmd/roi', NavSatFix(latitude=47.39, longitude=8.54, altitude=535.5))
        if parameters:
            own_ros.synchronize('/gimbal')
        else:
            status = report(own_ros, text)
            assert status.level == DiagnosticStatus.WARN
            assert off_target(status) == 'geoid_separation is not set'
        assert trigger(own_ros, 'clear_roi').success
        assert report(own_ros, 'in control').level == DiagnosticStatus.OK
        assert program.count(text) == (not parameters)


def test_a_status_that_comes_on_request_only_is_requested_before_it_is_missed() -> None:
    rig = Rig(FakeManager(primary=OURS, streams=False)).run(4.0)
    found = []
    for _ in range(200):
        rig.run(0.1)
        found += device_findings(rig.gimbal.snapshot(rig.now), rig.now, interval=0.0,
                                 geoid_is_known=True)

    assert found == []


# Several gimbals, parameters, start and end

def test_gm_26_each_further_gimbal_has_a_node_and_a_second_manager_is_reported(
        own_ros: Ros) -> None:
    managers = [FakeManager(), FakeManager(device_id=2, primary=OTHER), FakeManager(OTHER, 2),
                FakeManager(OTHER, device_alive=False)]
    with bridge(own_ros, *managers, gimbal_device_id=154) as program:
        for node in ('gimbal', 'gimbal_1_2', 'gimbal_1_2_195'):
            own_ros.subscribe(Bool, f'/{node}/connected').wait_value(True)
        controllers = [own_ros.subscribe(String, f'/{node}/controller').wait().data
                       for node in ('gimbal_1_2', 'gimbal_1_2_195')]
        assert sorted(controllers) == [
            'primary 1/195, secondary none', 'primary none, secondary none']
        program.wait_for('announces gimbal 1/154 too')
        assert report(own_ros, 'announce the gimbal too: only 1/').level == DiagnosticStatus.WARN


@pytest.mark.parametrize('primary_is_lost', [False, True])
def test_control_is_released_when_the_node_ends_and_taken_at_the_start_if_asked(
        own_ros: Ros, primary_is_lost: bool) -> None:
    manager = FakeManager(autopilot=3)
    with bridge(own_ros, manager, auto_take_control='true') as program:
        own_ros.subscribe(Bool, '/gimbal/in_control').wait_value(True)
        assert 'exclusive control is not guaranteed' in report(own_ros, 'ArduPilot').message
        manager.secondary = OURS
        if primary_is_lost:
            manager.primary = NO_COMPONENT
            own_ros.subscribe(Bool, '/gimbal/in_control').wait_value(False)
        assert program.end() == 0
        assert (manager.primary, manager.secondary) == (NO_COMPONENT, NO_COMPONENT)
        assert program.count('gimbal 1/154: control released') == 1


@pytest.mark.parametrize(('start', 'link', 'line'), [
    (start_slow_bridge, SlowLink, 'gimbal 1/154: control released'),
    (start_bridge, Link, 'this node may still control gimbal 1/154: no confirmation in time')])
def test_the_release_at_the_end_is_in_the_log_of_the_node_of_the_gimbal(
        start: Callable[..., Program], link: type[Link], line: str, own_ros: Ros) -> None:
    port = free_port()
    manager = FakeManager(primary=OURS, answers=start is start_slow_bridge)
    with (ended(start(own_ros.domain, port, payloads='[illuminator, gimbal]')) as program,
          served_gimbals(port, manager, link=link)):
        with time_passes():
            own_ros.subscribe(Bool, '/gimbal/in_control').wait_value(True)
            # Several attitudes show that the gimbal stands, so that control can be released.
            own_ros.subscribe(QuaternionStamped, '/gimbal/attitude', STREAM).wait_for(
                lambda message: True, count=5)
        assert program.end() == 0
        [found] = [one for one in program.lines if line in one]
        assert '[gimbal]' in found


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_the_gimbal_stands_still_and_is_free_whatever_is_requested_at_the_end_of_its_node(
    own_ros: Ros, number: int,
) -> None:
    manager, port = FakeManager(primary=OURS), free_port()
    program = start_bridge(own_ros.domain, port, '-r', '__node:=gimbal', payloads='[gimbal]')
    try:
        with served_gimbals(port, manager, link=Link):
            own_ros.subscribe(Bool, '/gimbal/in_control').wait_value(True)
            turning = Vector3Stamped(vector=Vector3(z=0.2))
            with repeated(own_ros.publisher(Vector3Stamped, '/gimbal/cmd/rate'), turning):
                eventually(lambda: manager.received)
                own_ros.start(Trigger, '/gimbal/take_control', Trigger.Request())
                assert (program.end(number), 'Traceback' in program.log) == (0, False)
            eventually(lambda: manager.primary == NO_COMPONENT)
            assert not any(rates_of(manager.received[-1]))
    finally:
        program.kill()


def test_each_payload_reads_its_parameters_from_the_section_of_its_own_node(
        own_ros: Ros, tmp_path: Path) -> None:
    port, file = free_port(), tmp_path / 'boat.yaml'
    file.write_text(
        '/**: {ros__parameters: {geoid_separation: 20.0, sources: [pilot]}}\n'
        'illuminator: {ros__parameters: {payloads: [illuminator, gimbal], frame_id: hull}}\n'
        'mount: {ros__parameters: {earth_frame: odom, setpoint_timeout: 0.2, sources: [film]}}\n'
        'mount_1_9: {ros__parameters: {use_sim_time: true}}')
    manager = FakeManager(primary=OURS)
    with (running_bridge(
            own_ros.domain, port, '--params-file', str(file), '-r', 'gimbal:__node:=mount',
            '-p', 'mount:attitude_interval:=0.05', '-p', 'vehicle_frame:=deck') as program,
          served_gimbals(port, manager, link=SlowLink), time_passes()):
        eventually(lambda: [one for one in manager.commands if one.command == 511
                            and (one.param1, one.param2) == (285, 50_000)])
        mount, light = (Parameters(own_ros, node) for node in ('/mount', '/illuminator'))
        given = {'earth_frame': 'odom', 'vehicle_frame': 'deck', 'setpoint_timeout': 0.2,
                 'attitude_interval': 0.05, 'geoid_separation': 20.0, 'sources': ['film']}

        assert mount.get(*given) == [*given.values()]
        assert {*mount.names()} - {*NODE_PARAMETERS} == {one.name for one in GIMBAL_PARAMETERS}
        assert light.get('frame_id', 'sources') == ['hull', ['pilot']]
        assert {*light.names()} - {*NODE_PARAMETERS} == {
            one.name for one in (*LINK_PARAMETERS, *LIGHT_PARAMETERS)}
        assert program.count('WARN') == 0, program.log


def test_a_name_of_the_first_node_leaves_the_gimbal_beside_the_light_its_name(
        own_ros: Ros) -> None:
    # ros2 launch names the first node, too.
    with running_bridge(own_ros.domain, free_port(), '-r', '__node:=spot',
                        payloads='[illuminator, gimbal]'):
        for name in ('spot', 'gimbal'):
            assert own_ros.subscribe(Bool, f'/{name}/connected').wait().data is False


def test_node_of_a_gimbal_that_is_silent_for_long_is_removed(
        own_ros: Ros) -> None:
    port = free_port()
    with running_bridge(own_ros.domain, port, payloads='[gimbal]') as program:
        with (served_gimbals(port, FakeManager(), FakeManager(device_id=2), link=SlowLink),
              time_passes()):
            program.wait_for('is served by /illuminator_1_')
            eventually(lambda: len(own_ros.node.get_node_names()) == 3)
        pass_time_until(lambda: len(own_ros.node.get_node_names()) == 2, step=5.0)
        program.wait_for('was silent for long: /illuminator_1_')
        assert trigger(own_ros, 'neutral', '/illuminator').message.startswith(
            'no gimbal connected: no component announces a gimbal')


@pytest.mark.parametrize(('fields', 'selected', 'reason'), [
    ({'device_alive': False}, 0,
     'gimbal 1/154 is announced, but device 1/154 has not been heard'),
    ({}, 9, 'gimbal 1/154 is announced, but gimbal_device_id selects another one'),
    ({'device_id': 0}, 0, 'manager 1/1 announces a gimbal with gimbal_device_id 0, which names '
     'none: it may not have found its gimbal device')])
def test_answer_without_a_gimbal_names_the_reason_for_each_that_is_announced(
        fields: dict[str, Any], selected: int, reason: str, own_ros: Ros) -> None:
    port, manager = free_port(), FakeManager(**fields)
    with (ended(start_gimbal(own_ros, port, gimbal_device_id=selected)),
          served_gimbals(port, manager, link=SlowLink), time_passes()):
        eventually(lambda: trigger(own_ros, 'neutral').message
                   == f'no gimbal connected: {reason}')


@pytest.mark.parametrize(('name', 'reliability'), [
    *((name, ReliabilityPolicy.RELIABLE) for name in ('attitude', 'angles', 'roi')),
    ('rate', ReliabilityPolicy.BEST_EFFORT)])
def test_setpoint_that_is_not_repeated_is_subscribed_to_reliably(
        name: str, reliability: ReliabilityPolicy, ros: Ros, gimbal: FakeManager) -> None:
    (subscription,) = ros.node.get_subscriptions_info_by_topic(f'/gimbal/cmd/{name}')

    assert subscription.qos_profile.reliability is reliability


def test_lost_gimbal_is_reported(own_ros: Ros) -> None:
    manager = FakeManager()
    with bridge(own_ros, manager) as program:
        connected = own_ros.subscribe(Bool, '/gimbal/connected')
        connected.wait_value(True)
        manager.primary = OTHER
        program.wait_for('control of gimbal 1/154: primary 1/195')
        manager.alive = manager.device_alive = False
        connected.wait_value(False)
        program.wait_for('gimbal 1/154 lost: nothing from')
        assert report(own_ros, 'nothing from').level == DiagnosticStatus.ERROR

        controller = own_ros.subscribe(String, '/gimbal/controller')
        controller.wait_value('unknown')
        manager.alive = manager.device_alive = True
        controller.wait_value('primary 1/195, secondary none')
        # The components in control have not changed, so a second line is not logged.
        assert program.count('control of gimbal 1/154: ') == 1
