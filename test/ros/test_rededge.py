# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The node over a serial line, with a camera that runs on pymavlink."""

from __future__ import annotations

from collections.abc import Callable, Iterator
import contextlib
import itertools
import math
import random
import threading
from typing import Any

from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs import msg as geometry
from illuminator_ros.mavlink.messages import Address
from nav_msgs.msg import Odometry
import pytest
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import Imu, NavSatFix, NavSatStatus, TimeReference
from std_msgs.msg import Bool, Header, UInt32
from std_srvs.srv import Trigger
from support.fake_camera import FakeCamera, running_camera
from support.frames import heartbeat_frame
from support.processes import ended, Program, python, slow_python
from support.ros import Parameters, Ros, STREAM
from support.slow import pass_time_until
from support.waiting import eventually

MODULE = 'illuminator_ros.rededge'
NORTH_WEST = geometry.Quaternion(w=0.3826834, x=0.0, y=0.0, z=0.9238795)
EXACT_LENGTHS = {0: 9, 2: 12, 4: 14, 24: 30, 25: 101, 30: 28, 33: 28, 155: 13, 158: 14}


@contextlib.contextmanager
def running_node(
    ros: Ros, camera: FakeCamera, start: Callable[..., Program] = python, **parameters: Any,
) -> Iterator[Program]:
    """Run the node; see :func:`ended` for its end."""
    given = [text for name, value in {'diagnostics_period': 0.1, **parameters}.items()
             for text in ('-p', f'{name}:={value}')]
    with ended(start(MODULE, f'serial://{camera.device}:57600', '--ros-args', *given,
                     env={'ROS_DOMAIN_ID': str(ros.domain)})) as node:
        node.wait_for('/100 connected')
        yield node


class Robot:
    """Publishes the state of a robot each 50 ms, in a thread of its own."""

    def __init__(self, ros: Ros) -> None:
        self.clock = ros.node.get_clock()
        self.velocity = True
        self.mount = False
        self.position: dict[str, Any] = {'latitude': 47.0, 'longitude': 8.0, 'altitude': 500.0}
        self.stamp: Callable[[], Time] = lambda: self.clock.now().to_msg()
        self._publishers = {
            name: ros.publisher(cls, f'/rededge/{name}', '/rededge') for name, cls in (
                ('fix', NavSatFix), ('velocity', geometry.TwistStamped), ('satellites', UInt32),
                ('imu', Imu))}
        self._ros = ros
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._run)

    def publish(self, name: str, message: Any) -> None:
        self._publishers[name].publish(message)

    def _run(self) -> None:
        while not self._ended.wait(0.05):
            header = Header(stamp=self.stamp(), frame_id='base_link')
            if self.velocity:
                self.publish('velocity', geometry.TwistStamped(header=header, twist=geometry.Twist(
                    linear=geometry.Vector3(x=3.0, y=-4.0, z=0.0))))
                self.publish('satellites', UInt32(data=9))
            self.publish('fix', NavSatFix(
                header=header, status=NavSatStatus(status=0), **self.position))
            # The nose points to the north-west.
            self.publish('imu', Imu(header=header, orientation=NORTH_WEST))
            if 'mount' in self._publishers:
                # The camera looks ahead and 45 degrees down.
                mount = geometry.Quaternion(
                    w=math.cos(math.pi / 8), x=0.0, y=math.sin(math.pi / 8), z=0.0)
                self.publish('mount', geometry.QuaternionStamped(header=header, quaternion=mount))

    def add_mount(self) -> None:
        publisher = self._ros.publisher(geometry.QuaternionStamped, '/rededge/mount', '/rededge')
        self._publishers = {**self._publishers, 'mount': publisher}

    def __enter__(self) -> Robot:
        self._thread.start()
        return self

    def __exit__(self, *exception: object) -> None:
        self._ended.set()
        self._thread.join()


def findings(ros: Ros) -> Callable[[], str]:
    """Return a function that returns the newest message of ``rededge: camera``."""
    record = ros.subscribe(DiagnosticArray, '/diagnostics', STREAM)

    def newest() -> str:
        found = [status.message for array in record.messages for status in array.status
                 if status.name == 'rededge: camera']
        return found[-1] if found else ''

    return newest


def call(ros: Ros, service: str) -> Trigger.Response:
    response: Trigger.Response = ros.call(
        Trigger, f'/rededge/{service}', Trigger.Request(), node='/rededge')
    return response


def test_the_camera_gets_all_that_ros_knows_in_frames_of_mavlink_1_re_1_re_2_re_3_re_4(
        own_ros: Ros) -> None:
    with (running_camera() as camera,
          running_node(own_ros, camera, send_gps_status='true', geoid_separation=48.0),
          Robot(own_ros) as robot):
        # The node sends MAVLink 1 even if it receives noise and MAVLink 2.
        camera.send(random.Random(1).randbytes(500) + heartbeat_frame(Address(9, 100)))
        position = camera.wait('GPS_RAW_INT', lambda one: one.satellites_visible == 9)
        attitude, gps_status = camera.wait('ATTITUDE'), camera.wait('GPS_STATUS')
        mount = camera.wait('MOUNT_STATUS')
        assert call(own_ros, 'ping').success
        assert call(own_ros, 'capture').success

        assert (position.lat, position.lon, position.alt, position.fix_type) == (
            470000000, 80000000, 452000, 3)
        assert (position.vel, position.cog) == (500, 14313)
        assert abs(position.time_usec - robot.clock.now().nanoseconds / 1e3) < 30e6
        assert math.degrees(attitude.yaw) == pytest.approx(-45, abs=0.01)
        assert (mount.target_component, mount.pointing_a) == (100, 0)
        assert gps_status.satellites_visible == 9
        assert {(one.system, one.component) for one in camera.frames} == {(1, 191)}
        assert {one.message_id: len(one.payload) for one in camera.frames} == {
            id_: size for id_, size in EXACT_LENGTHS.items() if id_ not in (2, 33)}


def test_fused_position_goes_with_system_time_and_alone_re_17_re_19(own_ros: Ros) -> None:
    with (running_camera() as camera,
          running_node(own_ros, camera, position_source='fused'), Robot(own_ros)):
        position = camera.wait('GLOBAL_POSITION_INT')
        assert (position.vx, position.vy, position.hdg) == (-400, 300, 65535)
        camera.wait('GLOBAL_POSITION_INT')
        ids = [one.message_id for one in camera.frames if one.message_id in (2, 24, 33)]
        assert ids[:4] == [2, 33, 2, 33]
        assert all(len(one.payload) == EXACT_LENGTHS[one.message_id] for one in camera.frames)


def test_services_and_topics_tell_what_the_camera_has_confirmed(own_ros: Ros) -> None:
    with (running_camera(feedback={'yaw': 90.0}) as camera,
          running_node(own_ros, camera, slow_python, geoid_separation=48.0,
                       heartbeat_timeout=60.0)):
        connected = own_ros.subscribe(Bool, '/rededge/connected')
        fix = own_ros.subscribe(NavSatFix, '/rededge/image/fix', STREAM)
        attitude = own_ros.subscribe(geometry.QuaternionStamped, '/rededge/image/attitude', STREAM)
        index = own_ros.subscribe(UInt32, '/rededge/image/index', STREAM)
        connected.wait_value(True)
        ping, image, panel = (call(own_ros, name) for name in ('ping', 'capture', 'capture_panel'))

        assert ping.message.endswith(' ms round trip')
        assert [one.success for one in (ping, image, panel)] == [True] * 3
        assert [one.message.partition(',')[0] for one in (image, panel)] == [
            'image 1 taken', 'image 2 taken']
        assert image.message.endswith(', without ~/fix, ~/imu or ~/attitude')
        assert [one.shot for one in camera.messages('DIGICAM_CONTROL')] == [1, 2]
        index.wait_value(2)
        eventually(lambda: len(fix.messages) == len(attitude.messages) == 2)
        [found, _] = fix.messages
        assert (found.latitude, found.longitude, found.altitude) == (47.0, 8.0, 500.0)
        [turned, _] = (one.quaternion for one in attitude.messages)
        # The camera looks down, and the top of the image is to the east.
        assert attitude.messages[0].header.frame_id == 'map'
        assert [abs(round(value, 3)) for value in (turned.w, turned.x, turned.y, turned.z)] == [
            0.707, 0.0, 0.707, 0.0]

        camera.answers = False
        silent = [own_ros.start(Trigger, f'/rededge/{name}', Trigger.Request(), '/rededge')
                  for name in ('ping', 'capture')]
        pass_time_until(lambda: all(one.answered for one in silent), step=0.25)
        assert [(one.result().success, one.result().message) for one in silent] == [
            (False, 'no reply to 2 PINGs'), (False, 'no answer to DIGICAM_CONTROL within 5.00 s')]


# 5 m/s to the north-west: in the axes of the earth, and of a body whose nose points there.
@pytest.mark.parametrize(('topic', 'message'), [
    ('velocity_with_covariance', geometry.TwistWithCovarianceStamped(
        twist=geometry.TwistWithCovariance(twist=geometry.Twist(
            linear=geometry.Vector3(x=-3.5355, y=3.5355))))),
    ('odometry', Odometry(
        pose=geometry.PoseWithCovariance(pose=geometry.Pose(orientation=NORTH_WEST)),
        twist=geometry.TwistWithCovariance(twist=geometry.Twist(
            linear=geometry.Vector3(x=5.0)))))])
def test_the_velocity_may_come_with_a_covariance_or_from_odometry_re_15(
        own_ros: Ros, topic: str, message: Any) -> None:
    with running_camera() as camera, running_node(own_ros, camera), Robot(own_ros) as robot:
        robot.velocity = False
        publisher = own_ros.publisher(type(message), f'/rededge/{topic}', '/rededge')

        def is_sent() -> bool:
            message.header.stamp = robot.stamp()
            publisher.publish(message)
            return any((one.vel, one.cog) == (500, 31500)
                       for one in camera.messages('GPS_RAW_INT'))

        eventually(is_sent)


def test_fixed_mount_is_set_at_run_time_and_gives_way_to_the_topic_re_23_re_27(
        own_ros: Ros) -> None:
    with running_camera() as camera, running_node(own_ros, camera, mount_roll=5):
        parameters = Parameters(own_ros, '/rededge')
        camera.wait('MOUNT_STATUS', lambda one: one.pointing_b == 500)
        [accepted, refused] = parameters.set(mount_pitch=12.5, mount_yaw=181.0)
        assert (accepted.successful, refused.successful) == (True, False)
        assert 'mount_yaw: 181.0 degrees is out of range' in refused.reason
        camera.wait('MOUNT_STATUS', lambda one: one.pointing_a == 1250)
        assert parameters.get('mount_roll', 'mount_pitch', 'mount_yaw') == [5.0, 12.5, 0.0]

        with Robot(own_ros) as robot:
            robot.add_mount()
            camera.wait('MOUNT_STATUS', lambda one: (
                one.pointing_a, one.pointing_b, one.pointing_c) == (4500, 0, 0))
            [refused] = parameters.set(mount_pitch=1.0)
            assert refused.reason.startswith('the mount is not fixed: ~/mount has')
        own_ros.synchronize('/rededge')

        def is_fed_no_angles() -> bool:
            """Return whether no mount and no attitude arrives between two heartbeats."""
            camera.frames.clear()
            camera.wait('HEARTBEAT')
            return {one.message_id for one in camera.frames} <= {0, 4, 24}

        # Some may still have been on the line.
        assert is_fed_no_angles() or is_fed_no_angles()


def test_rate_of_attitudes_may_be_set_while_the_node_runs(own_ros: Ros) -> None:
    with running_camera() as camera, running_node(own_ros, camera, attitude_rate=1), Robot(
            own_ros):
        camera.wait('ATTITUDE')
        assert Parameters(own_ros, '/rededge').set(attitude_rate=200)[0].successful

        eventually(lambda: any(
            newer.time_boot_ms - older.time_boot_ms < 300
            for older, newer in itertools.pairwise(camera.messages('ATTITUDE'))))


def test_no_fixed_mount_is_sent_where_the_topic_has_had_a_publisher_since_the_start_re_27(
        own_ros: Ros) -> None:
    own_ros.node.create_publisher(geometry.QuaternionStamped, '/rededge/mount', 10)
    with (running_camera() as camera,
          running_node(own_ros, camera, slow_python, heartbeat_timeout=60.0) as node):
        node.wait_for('~/mount has a publisher: the mount is not fixed')
        # One in 2 s.
        pass_time_until(lambda: len(camera.messages('PING')) > 3, step=0.5)
        assert not camera.messages('MOUNT_STATUS')


def test_simulated_time_is_no_utc_until_a_reference_tells_it_re_14(own_ros: Ros) -> None:
    with (running_camera() as camera,
          running_node(own_ros, camera, use_sim_time='true', geoid_separation=0)):
        clock = own_ros.publisher(Clock, '/clock', '/rededge')
        reference = own_ros.publisher(TimeReference, '/rededge/time_reference', '/rededge')
        newest, steps, now = findings(own_ros), itertools.count(), Time()
        # The time at which the recording begins, and begins again.
        begin = 100

        def stamp() -> Time:
            nonlocal now
            seconds, twentieths = divmod(next(steps), 20)
            now = Time(sec=begin + seconds, nanosec=twentieths * 50_000_000)
            clock.publish(Clock(clock=now))
            return now

        with Robot(own_ros) as robot:
            robot.stamp = stamp
            camera.wait('ATTITUDE')
            eventually(lambda: 'ROS time is simulated (use_sim_time), which is not UTC'
                       in newest())
            assert not camera.messages('GPS_RAW_INT')
            eventually(lambda: reference.publish(TimeReference(
                header=Header(stamp=now), time_ref=Time(sec=now.sec + 1_700_000_000)))
                or camera.messages('GPS_RAW_INT'))
            begin = 20
            eventually(lambda: 'ROS time has jumped: waiting for ~/time_reference' in newest())
        assert camera.messages('GPS_RAW_INT')[0].time_usec // 1_000_000 - 1_700_000_000 < 10_000


def test_diagnostics_name_each_input_that_is_missing_or_refused_re_30(own_ros: Ros) -> None:
    with running_camera() as camera, running_node(own_ros, camera) as node:
        newest = findings(own_ros)
        eventually(lambda: newest() == (
            'nothing received on ~/fix (/rededge/fix has no publisher); nothing received on ~/imu '
            'or ~/attitude (/rededge/imu has no publisher; /rededge/attitude has no publisher); '
            'geoid_separation is not set, so altitudes are above the ellipsoid'))
        with Robot(own_ros) as robot:
            eventually(lambda: newest().startswith('geoid_separation is not set'))
            robot.position['latitude'] = math.nan
            eventually(lambda: 'latitude of ~/fix: nan deg is outside -90 to 90 deg' in newest())
            node.wait_for('ago: latitude of ~/fix: nan deg is outside -90 to 90 deg')
        eventually(lambda: '~/imu: nothing for' in newest())
        camera.answers = False
        eventually(lambda: 'PINGs without a reply: the camera does not receive' in newest())


def test_a_required_input_that_never_comes_is_logged_with_its_topic_and_publishers(
        own_ros: Ros) -> None:
    with (running_camera() as camera,
          running_node(own_ros, camera, slow_python, heartbeat_timeout=60.0) as node):
        own_ros.publisher(Imu, '/rededge/imu', '/rededge')
        lines = ('nothing received on ~/fix (/rededge/fix has no publisher)',
                 'nothing received on ~/imu or ~/attitude (/rededge/imu has 1 publisher; '
                 '/rededge/attitude has no publisher)')
        pass_time_until(lambda: all(map(node.count, lines)), step=2.0)


def test_several_publishers_of_an_input_are_logged_and_in_the_diagnostics(own_ros: Ros) -> None:
    with running_camera() as camera, running_node(own_ros, camera) as node:
        newest = findings(own_ros)
        for _ in range(2):
            own_ros.node.create_publisher(NavSatFix, '/rededge/fix', 10)
        warning = ('~/fix: /rededge/fix has 2 publishers, so images may get values of each in '
                   'turn')
        node.wait_for(warning)
        eventually(lambda: warning in newest())


def test_a_capture_before_a_fixed_mount_is_sent_says_that_the_image_has_none(
        own_ros: Ros) -> None:
    with (running_camera() as camera,
          running_node(own_ros, camera, slow_python, heartbeat_timeout=60.0),
          Robot(own_ros)):
        camera.wait('GPS_RAW_INT')
        assert call(own_ros, 'capture').message.endswith(
            ', without attitude and mount (a publisher of ~/mount is still awaited)')


def test_reason_why_no_camera_is_heard_is_in_the_log(own_ros: Ros) -> None:
    with ended(slow_python(MODULE, 'memory://none',
                           env={'ROS_DOMAIN_ID': str(own_ros.domain)})) as node:
        node.wait_for('link open')
        pass_time_until(lambda: node.count('no camera connected: none heard yet on'), step=2.0)
