# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0


"""``publish_tf``: the frames agree with the topics, and each has one parent (REP 103, REP 105)."""

from collections.abc import Iterator
import math
import os
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

from geometry_msgs.msg import QuaternionStamped
from illuminator_ros.geometry.mount_attitude import to_mavlink, YawFrame
from illuminator_ros.geometry.rotation import Quaternion
from illuminator_ros.mavlink.dialect import mavlink
import pytest
from rclpy.qos import DurabilityPolicy, ReliabilityPolicy
from support.fake_camera import running_camera
from support.gimbals import FakeManager, served_gimbals
from support.light import Address, ServedLight
from support.processes import ended, python, ROOT
from support.recording import Recorder
from support.ros import Parameters, Ros, running_bridge, STATE, STREAM
from support.tf2_messages import tf2_path, transforms
from visualization_msgs.msg import Marker

DOWN_LEFT = Quaternion.from_euler(0.0, math.radians(45), math.radians(30))
BOTH: dict[str, Any] = {
    'payloads': '["illuminator", "gimbal"]', 'publish_tf': True, 'beam_range': 20.0,
    'frame_id': 'base_link', 'mounted_on': 154}


@pytest.fixture(scope='module')
def tf2(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    """Return the type of the messages on /tf, which programs of this module find too."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv('PYTHONPATH', tf2_path(tmp_path_factory.mktemp('tf2')))
        from tf2_msgs.msg import TFMessage
        yield TFMessage


def rotation(q: Any) -> Quaternion:
    return Quaternion(q.w, q.x, q.y, q.z)


def frame(recorder: Recorder, child: str) -> Any:
    """Return the newest transform of a frame."""
    def of(message: Any) -> list[Any]:
        return [one for one in transforms(message) if one.child_frame_id == child]

    return of(recorder.wait(of))[-1]


@pytest.mark.parametrize('yaw', YawFrame)
def test_frames_of_gimbal_and_beam_agree_with_attitude_and_marker_in_either_yaw_frame(
    own_ros: Ros, port: int, tf2: Any, yaw: YawFrame,
) -> None:
    heading = 0.5
    gimbal = FakeManager(q=to_mavlink(DOWN_LEFT, yaw), delta_yaw=heading)
    gimbal.flags = yaw.flag
    # A yaw to the left from east; the vehicle's heading is to the right from north.
    to_vehicle = Quaternion.from_euler(
        0.0, 0.0, 0.0 if yaw is YawFrame.VEHICLE else heading - math.pi / 2)
    with (running_bridge(own_ros.domain, port, **BOTH), ServedLight(port, enable=1),
          served_gimbals(port, gimbal)):
        moving = own_ros.subscribe(tf2, '/tf', STREAM)
        attitude = own_ros.subscribe(QuaternionStamped, '/gimbal/attitude', STREAM).wait()
        marker = own_ros.subscribe(Marker, '/illuminator/beam').wait(
            lambda one: bool(one.action == Marker.ADD))
        line = own_ros.subscribe(Marker, '/gimbal/line_of_sight').wait()
        pose, beam = frame(moving, 'gimbal'), frame(moving, 'illuminator_beam')

    parents = {one.child_frame_id: one.header.frame_id
               for message in moving.messages for one in transforms(message)}
    assert parents == {'gimbal': 'base_link_stabilized', 'illuminator_beam': 'base_link'}
    seen = to_vehicle * rotation(attitude.quaternion)
    assert rotation(pose.transform.rotation).angle_to(seen) == pytest.approx(0, abs=1e-3)
    assert rotation(beam.transform.rotation).angle_to(
        rotation(marker.pose.orientation)) == pytest.approx(0, abs=1e-3)
    assert beam.header.frame_id == marker.header.frame_id
    assert beam.header.stamp.sec > 0
    assert (line.header.frame_id, line.type) == (pose.child_frame_id, Marker.ARROW)


def test_gimbal_whose_yaw_relative_to_the_vehicle_is_unknown_has_no_frame(
    own_ros: Ros, port: int, tf2: Any,
) -> None:
    gimbal = FakeManager(q=to_mavlink(DOWN_LEFT, YawFrame.EARTH))
    gimbal.flags = mavlink.GIMBAL_DEVICE_FLAGS_YAW_IN_EARTH_FRAME
    with (running_bridge(own_ros.domain, port, **BOTH), ServedLight(port),
          served_gimbals(port, gimbal)):
        moving = own_ros.subscribe(tf2, '/tf', STREAM)
        own_ros.subscribe(QuaternionStamped, '/gimbal/attitude', STREAM).wait(count=3)
        own_ros.synchronize()

    assert moving.messages == []


def test_fixed_beam_is_one_latched_message_with_the_frames_of_all_lights(
    own_ros: Ros, port: int, tf2: Any,
) -> None:
    with (running_bridge(own_ros.domain, port, publish_tf=True, frame_id='mast',
                         target_component=243) as bridge,
          ServedLight(port), ServedLight(port, Address(1, 244))):
        bridge.wait_for('light 1/244 is served by')
        static = own_ros.subscribe(tf2, '/tf_static', STATE)
        message = static.wait(lambda one: len(transforms(one)) == 2)
        [info] = own_ros.node.get_publishers_info_by_topic('/tf_static')

    assert {(one.header.frame_id, one.child_frame_id, rotation(one.transform.rotation))
            for one in transforms(message)} == {
        ('mast', 'illuminator_beam', Quaternion()),
        ('mast', 'illuminator_1_244_beam', Quaternion())}
    assert (info.qos_profile.durability, info.qos_profile.reliability) == (
        DurabilityPolicy.TRANSIENT_LOCAL, ReliabilityPolicy.RELIABLE)


def test_fixed_camera_has_a_static_frame_that_follows_its_parameters(
        own_ros: Ros, tf2: Any) -> None:
    with (running_camera() as camera,
          ended(python('illuminator_ros.rededge', f'serial://{camera.device}:57600', '--ros-args',
                       '-p', 'publish_tf:=true', '-p', 'mount_pitch:=30',
                       env={'ROS_DOMAIN_ID': str(own_ros.domain)})) as node):
        node.wait_for('/100 connected')
        static = own_ros.subscribe(tf2, '/tf_static', STATE)
        first = frame(static, 'rededge')
        static.clear()
        assert Parameters(own_ros, '/rededge').set(mount_pitch=0.0)[0].successful
        second = frame(static, 'rededge')

    assert first.header.frame_id == 'base_link'
    # Down, and 30 degrees forward.
    assert rotation(first.transform.rotation).rotate((1.0, 0.0, 0.0)) == pytest.approx(
        (0.5, 0.0, -math.sqrt(0.75)), abs=1e-6)
    down = rotation(second.transform.rotation)
    assert down.rotate((1.0, 0.0, 0.0)) == pytest.approx((0.0, 0.0, -1.0), abs=1e-6)
    # The top of the image is ahead.
    assert down.rotate((0.0, 0.0, 1.0)) == pytest.approx((1.0, 0.0, 0.0), abs=1e-6)


def test_without_tf2_msgs_one_line_says_so_and_the_bridge_works(own_ros: Ros, port: int) -> None:
    hidden = Path(os.environ['HOME']) / 'hidden'
    (hidden / 'tf2_msgs').mkdir(parents=True)
    (hidden / 'tf2_msgs' / '__init__.py').write_text("raise ImportError('hidden')\n")
    with (pytest.MonkeyPatch.context() as patch):
        patch.setenv('PYTHONPATH', str(hidden))
        with (running_bridge(own_ros.domain, port, publish_tf=True) as bridge,
              ServedLight(port, enable=1)):
            Parameters(own_ros).wait(mode='internal_control')
            assert bridge.count('publish_tf: tf2_msgs is not installed') == 1
            assert own_ros.node.count_publishers('/tf') == 0


def test_urdf_hangs_the_light_on_the_frame_of_the_gimbal() -> None:
    robot = ElementTree.parse(ROOT / 'config' / 'searchlight.urdf').getroot()
    links = {link.attrib['name'] for link in robot.iter('link')}

    assert [[end.attrib['link'] for end in joint if end.tag in ('parent', 'child')]
            for joint in robot.iter('joint')] == [['gimbal', 'searchlight']]
    assert links == {'searchlight', 'gimbal'}
