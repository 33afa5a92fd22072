# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The node of a gimbal manager: ROS as a player, as the driver of a gimbal, and as the vehicle."""

from __future__ import annotations

from collections.abc import Iterator
import contextlib
import math
import socket
from typing import Any

from illuminator_ros.geometry.rotation import Quaternion  # noqa: E402
from illuminator_ros.gimbal.simulated_device import GimbalProperties, SimulatedGimbal
from illuminator_ros.mavlink.messages import Address, Message
from illuminator_ros.simulation.simulated import SimulatedComponents
import pytest

pytest.importorskip('rclpy')

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus  # noqa: E402, I100
from geometry_msgs import msg as geometry  # noqa: E402
from illuminator_ros.gimbal.ros.conversions import read_fix, read_place  # noqa: E402
from illuminator_ros.gimbal.ros.manager_node import (  # noqa: E402
    _read_imu,
    _read_odometry,
    MANAGER_PARAMETERS,
    manager_settings,
)
from illuminator_ros.ros.parameters import ParameterError  # noqa: E402
from illuminator_ros.ros.throttled_log import BURST, MAX_KINDS  # noqa: E402
from nav_msgs.msg import Odometry  # noqa: E402
from sensor_msgs.msg import Imu, NavSatFix, NavSatStatus  # noqa: E402
from std_msgs.msg import Bool, Header, String  # noqa: E402
from std_srvs.srv import SetBool, Trigger  # noqa: E402
from support.frames import Codec  # noqa: E402
from support.gimbal_manager import configure, DEVICE, OURS, PILOT, pitch_yaw  # noqa: E402
from support.gimbals import FakeManager, served_gimbals  # noqa: E402
from support.live_link import EndpointLink  # noqa: E402
from support.ports import free_port  # noqa: E402
from support.processes import ended, Program  # noqa: E402
from support.ros import Ros, start_slow_bridge, STREAM  # noqa: E402
from support.slow import CLOCK, SlowLink, time_passes  # noqa: E402
from support.waiting import eventually  # noqa: E402

NODE = '/gimbal_manager'
VEHICLE = Header(frame_id='base_link_stabilized')


@contextlib.contextmanager
def device(port: int) -> Iterator[SimulatedGimbal]:
    """Serve a simulated gimbal over UDP, by the slow clock."""
    gimbal = SimulatedGimbal(GimbalProperties(DEVICE))
    with EndpointLink(f'udpout://127.0.0.1:{port}', SimulatedComponents([
            gimbal], CLOCK()), kind=SlowLink):
        yield gimbal


@contextlib.contextmanager
def manager(ros: Ros, port: int, **parameters: Any) -> Iterator[Program]:
    with ended(start_slow_bridge(ros.domain, port, '-r', f'__node:={NODE[1:]}',
                                 payloads='[gimbal_manager]', **parameters)) as program:
        yield program


def trigger(ros: Ros, name: str) -> Trigger.Response:
    answer: Trigger.Response = ros.call(
        Trigger, f'{NODE}/{name}', Trigger.Request(), node=NODE)
    return answer


def turned(roll: float, pitch: float, yaw: float) -> geometry.Quaternion:
    """Return a rotation, deg."""
    q = Quaternion.from_euler(*map(math.radians, (roll, pitch, yaw)))
    return geometry.Quaternion(w=q.w, x=q.x, y=q.y, z=q.z)


def report(ros: Ros, text: str) -> DiagnosticStatus:
    """Return the status of the manager with a text in its message."""
    recorder = ros.subscribe(DiagnosticArray, '/diagnostics', STREAM)

    def wanted(array: Any) -> list[DiagnosticStatus]:
        return [one for one in array.status
                if one.name.endswith('manager') and text in one.message]

    return wanted(recorder.wait(wanted))[0]


@pytest.mark.timeout(180)
def test_ros_points_a_mavlink_gimbal_and_tells_it_where_north_is(
        own_ros: Ros) -> None:
    port = free_port()
    with manager(own_ros, port) as program, device(port) as gimbal:
        with time_passes():
            own_ros.subscribe(Bool, f'{NODE}/connected').wait_value(True)
            program.wait_for('gimbal 1/154 is managed')
            answer = trigger(own_ros, 'take_control')
            assert answer.success, answer.message
            own_ros.subscribe(String, f'{NODE}/controller').wait_value(
                f'primary {OURS}, secondary none')
            own_ros.publisher(geometry.QuaternionStamped, f'{NODE}/cmd/attitude', NODE).publish(
                geometry.QuaternionStamped(header=VEHICLE, quaternion=turned(0, 20, 10)))
            # ROS: pitch down and yaw left are positive.
            eventually(lambda: [round(math.degrees(one)) for one in gimbal.motion.angles]
                       == [0, -20, -10])
            status = report(own_ros, 'active')
            assert status.level == DiagnosticStatus.OK
            assert {one.key: one.value for one in status.values}['primary_control'] == str(OURS)

            # The vehicle heads north, 10 m/s; ROS counts yaw from the east.
            imu = Imu(orientation=turned(0, 0, 90), angular_velocity=geometry.Vector3(z=0.0))
            odometry = Odometry(twist=geometry.TwistWithCovariance(
                twist=geometry.Twist(linear=geometry.Vector3(x=10.0))))
            odometry.pose.pose.orientation = imu.orientation
            publishers = [(own_ros.publisher(type(one), f'{NODE}/{name}', NODE), one)
                          for name, one in (('imu', imu), ('odometry', odometry))]

            def north_is_known() -> bool:
                for publisher, message in publishers:
                    publisher.publish(message)
                return gimbal.motion.heading_known(gimbal.motion.now)

            eventually(north_is_known)
        # The heading stays valid, since time hardly passes.
        north_is_known()
        own_ros.synchronize(NODE)
        assert own_ros.call(
            SetBool, f'{NODE}/set_yaw_lock', SetBool.Request(data=True)).success
        # The release of control is confirmed by a later status.
        with time_passes():
            assert program.end() == 0


@pytest.mark.timeout(180)
def test_gm_22_ros_drives_a_gimbal_without_mavlink(own_ros: Ros) -> None:
    port = free_port()
    # The link is open once a peer is heard.
    with time_passes(), device(port), manager(
            own_ros, port, gimbal_device_id=1, pitch_max=0.5, auto_take_control='true'):
        setpoint = own_ros.subscribe(geometry.QuaternionStamped, f'{NODE}/device/setpoint', STREAM)
        attitude = own_ros.subscribe(geometry.QuaternionStamped, f'{NODE}/attitude', STREAM)
        own_ros.subscribe(Bool, f'{NODE}/in_control').wait_value(True)
        own_ros.publisher(geometry.QuaternionStamped, f'{NODE}/cmd/attitude', NODE).publish(
            geometry.QuaternionStamped(header=VEHICLE, quaternion=turned(0, 60, 10)))

        message = setpoint.wait()
        q = message.quaternion
        assert message.header.frame_id == 'base_link_stabilized'
        assert Quaternion(q.w, q.x, q.y, q.z).euler() == pytest.approx(
            (0.0, 0.5, math.radians(10)), abs=1e-5)
        reported = geometry.QuaternionStamped(header=VEHICLE, quaternion=turned(0, 5, 5))
        driver = own_ros.publisher(geometry.QuaternionStamped, f'{NODE}/device/attitude', NODE)
        eventually(lambda: driver.publish(reported) or any(
            abs(one.quaternion.y - reported.quaternion.y) < 1e-6 for one in attitude.messages))


@pytest.mark.timeout(180)
def test_sources_of_ros_hold_the_gimbal_by_rank_and_release_it(
        own_ros: Ros) -> None:
    def point(source: str, yaw: float) -> None:
        own_ros.publisher(geometry.Vector3Stamped, f'{NODE}/{source}cmd/angles', NODE).publish(
            geometry.Vector3Stamped(header=VEHICLE, vector=geometry.Vector3(z=math.radians(yaw))))

    port = free_port()
    names = "['safety', 'operator', 'autonomy']"
    with manager(own_ros, port, sources=names, diagnostics_period=0.1) as program, \
            device(port) as gimbal, time_passes():
        def turned_to(yaw: float) -> bool:
            return round(math.degrees(gimbal.motion.angles[2])) == -yaw

        source = own_ros.subscribe(String, f'{NODE}/source')
        source.wait_value('')
        own_ros.subscribe(Bool, f'{NODE}/connected').wait_value(True)
        program.wait_for('gimbal 1/154 is managed')
        assert trigger(own_ros, 'take_control').success
        point('safety/', 20.0)
        source.wait_value('safety')
        eventually(lambda: turned_to(20.0))

        point('autonomy/', 10.0)
        program.wait_for('~/autonomy/cmd/angles: ignored: held by safety')
        point('', 5.0)
        program.wait_for('~/cmd/angles: ignored: held by safety')
        own_ros.publisher(NavSatFix, f'{NODE}/operator/cmd/roi', NODE).publish(NavSatFix())
        program.wait_for('~/operator/cmd/roi: ignored: held by safety')
        assert trigger(own_ros, 'default/release').message == 'held by safety'
        for name in ('neutral', 'retract', 'clear_roi', 'release_control'):
            answer = trigger(own_ros, name)
            assert (answer.success, answer.message) == (False, 'held by safety'), name
        assert own_ros.call(SetBool, f'{NODE}/set_yaw_lock', SetBool.Request(
            data=True)).message == 'held by safety'
        assert trigger(own_ros, 'take_control').success
        own_ros.subscribe(DiagnosticArray, '/diagnostics', STREAM).wait(lambda array: any(
            (value.key, value.value) == ('holder', 'safety')
            for status in array.status for value in status.values))
        assert turned_to(20.0)

        assert [trigger(own_ros, f'{name}/release').message
                for name in ('safety', 'operator')] == ['held by operator', 'held by autonomy']
        program.wait_for('gimbal 1/154 is held by autonomy: operator has released it')
        point('autonomy/', 10.0)
        eventually(lambda: turned_to(10.0))
        # The refused services of the plain interface have left no claim.
        assert trigger(own_ros, 'autonomy/release').message == 'held by no source'
        assert trigger(own_ros, 'neutral').success
        assert trigger(own_ros, 'default/release').message == 'held by no source'
        source.wait_value('')
        assert trigger(own_ros, 'release_control').success


@pytest.mark.timeout(180)
def test_gm_18_another_manager_is_named_with_an_error(own_ros: Ros) -> None:
    port = free_port()
    other = FakeManager(Address(1, 191), device_alive=False)
    with (manager(own_ros, port) as program, device(port),
          served_gimbals(port, other, link=SlowLink), time_passes()):
        program.wait_for('[ERROR]')
        program.wait_for('1/191 manages gimbal 1/154 too: this manager is inactive')
        assert report(own_ros, '1/191 manages').level == DiagnosticStatus.ERROR
        assert not trigger(own_ros, 'take_control').success


class Players:
    """Sends messages of players, each time from another UDP port."""

    def __init__(self, port: int) -> None:
        self._address = '127.0.0.1', port
        self._codec = Codec()

    def send(self, player: Address, *messages: Message) -> None:
        with socket.socket(type=socket.SOCK_DGRAM) as sender:
            sender.sendto(b''.join(self._codec.frame(player, one) for one in messages),
                          self._address)


@pytest.mark.timeout(180)
def test_rate_of_any_player_ends_with_the_node(own_ros: Ros) -> None:
    port = free_port()
    with (time_passes(), device(port) as gimbal,
          manager(own_ros, port, lease=3600.0) as program):
        program.wait_for('gimbal 1/154 is managed')
        Players(port).send(PILOT, configure(*PILOT), pitch_yaw(pitch_rate=0.0, yaw_rate=0.01))
        eventually(lambda: gimbal.motion.rates[2])

        assert program.end() == 0

        eventually(lambda: not gimbal.motion.rates[2])
        assert gimbal.motion.angles[2] < 0.5


@pytest.mark.timeout(180)
def test_players_neither_flood_the_log_nor_hold_back_the_error_about_another_manager(
        own_ros: Ros) -> None:
    port = free_port()
    players = Players(port)
    other = FakeManager(Address(1, 191), device_alive=False)
    with (manager(own_ros, port, policy='takeover') as program, device(port), time_passes()):
        program.wait_for('gimbal 1/154 is managed')
        for number in range(2 * MAX_KINDS):
            player = Address(2 + number // 100, 1 + number % 100)
            players.send(player, pitch_yaw(0.1, 0.1), configure(*player))
        with served_gimbals(port, other, link=SlowLink):
            program.wait_for('1/191 manages gimbal 1/154 too')
        # A busy machine may need more than one period.
        assert BURST <= program.count('is refused: ') <= 5 * BURST
        # The client in the same process reports changes of control, too.
        changes = program.count(' control: ') + program.count('control of gimbal')
        assert BURST <= changes <= 5 * BURST


DEFAULTS = {one.name: one.default for one in MANAGER_PARAMETERS} | {'gimbal_device_id': 0}


def test_parameters_give_the_settings_of_the_manager() -> None:
    settings = manager_settings(
        {**DEFAULTS, 'priority': ['255/190', 'ros'], 'overruling': ['1/1'], 'policy': 'priority',
         'pitch_min': -0.2, 'pitch_max': 1.5}, OURS)

    assert settings.control.priority == (Address(255, 190), OURS)
    assert settings.control.overruling == {Address(1, 1)}
    # MAVLink: pitch up is positive.
    assert settings.ranges[1] == (-1.5, 0.2)


@pytest.mark.parametrize(('name', 'value'), [
    ('priority', ['255']), ('priority', ['0/1']), ('overruling', ['1/256']),
    ('overruling', ['pilot']), ('pitch_min', 2.0)])
def test_wrong_parameters_are_named(name: str, value: object) -> None:
    with pytest.raises(ParameterError, match=name):
        manager_settings({**DEFAULTS, name: value}, OURS)


def test_gm_8_a_position_of_the_vehicle_needs_a_fix() -> None:
    fix = NavSatFix(latitude=47.0, longitude=8.0, altitude=500.0)
    fix.status.status = NavSatStatus.STATUS_FIX
    assert read_fix(fix, 50.0) == (47.0, 8.0, 450.0)

    fix.status.status = NavSatStatus.STATUS_NO_FIX
    with pytest.raises(ValueError, match='no fix'):
        read_fix(fix, 50.0)


@pytest.mark.parametrize('value', [1e39, -math.inf])
def test_values_of_the_vehicle_beyond_all_limits_are_refused(value: float) -> None:
    upright = geometry.Quaternion(w=1.0)
    odometries = [Odometry(twist=geometry.TwistWithCovariance(twist=twist)) for twist in (
        geometry.Twist(linear=geometry.Vector3(y=value)),
        geometry.Twist(angular=geometry.Vector3(z=value)))]
    for odometry in odometries:
        odometry.pose.pose.orientation = upright
        with pytest.raises(ValueError, match='is beyond'):
            _read_odometry(odometry)
    with pytest.raises(ValueError, match='is beyond'):
        _read_imu(Imu(orientation=upright, angular_velocity=geometry.Vector3(z=value)))
    with pytest.raises(ValueError, match='is not a place'):
        read_place(NavSatFix(latitude=47.0, longitude=8.0, altitude=value), 0.0)


def test_list_of_a_wrong_type_is_refused_without_the_example_of_another_parameter() -> None:
    [spec] = [one for one in MANAGER_PARAMETERS if one.name == 'overruling']
    with pytest.raises(ParameterError, match='overruling: 255 is not a list') as refused:
        spec.check(255)
    assert 'names' not in str(refused.value)
