# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""``~/beam``: the marker that RViz and Foxglove draw."""

from collections.abc import Iterator
import math
from pathlib import Path

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from illuminator_ros.geometry.mount_attitude import to_mavlink, YawFrame
from illuminator_ros.geometry.rotation import Quaternion
import pytest
from rclpy.qos import DurabilityPolicy, ReliabilityPolicy
from support.gimbals import FakeManager, OTHER, served_gimbals
from support.light import Address, ServedLight
from support.ports import free_port
from support.processes import Program
from support.ros import Parameters, Ros, running_bridge, STREAM
from support.slow import pass_time_until, SlowLink
from visualization_msgs.msg import Marker


@pytest.fixture(scope='module')
def settings() -> dict[str, object]:
    return {'beam_range': 20, 'beam_angle': 1.0, 'frame_id': 'bow', 'use_sim_time': True}


def shown(marker: Marker) -> bool:
    return bool(marker.action == Marker.ADD and marker.color.a > 0)


def gone(marker: Marker) -> bool:
    return bool(marker.action == Marker.DELETE)


def test_beam_is_a_cone_along_x_that_is_deleted_while_the_light_is_off_or_lost(
    ros: Ros, light: ServedLight,
) -> None:
    beam = ros.subscribe(Marker, '/illuminator/beam')
    light.report(enable=1, brightness=60.0)
    marker = beam.wait(shown)
    [info] = ros.node.get_publishers_info_by_topic('/illuminator/beam')
    assert (marker.header.frame_id, marker.ns, marker.id) == ('bow', 'illuminator', 0)
    assert marker.type == Marker.TRIANGLE_LIST
    assert (marker.scale.x, marker.scale.y, marker.scale.z) == (1.0, 1.0, 1.0)
    assert marker.color.a == pytest.approx(0.3)
    assert {point.x for point in marker.points} == {0.0, 20.0}
    # Viewers draw the beam at the present position of the frame.
    assert marker.frame_locked
    assert (marker.header.stamp.sec, marker.header.stamp.nanosec) == (0, 0)
    assert info.qos_profile.durability == DurabilityPolicy.TRANSIENT_LOCAL
    assert info.qos_profile.reliability == ReliabilityPolicy.RELIABLE
    # The node publishes the beam again before viewers drop it.
    assert marker.lifetime.sec == 5
    assert shown(ros.subscribe(Marker, '/illuminator/beam', STREAM).wait())

    beam.clear()
    light.report(enable=0)
    assert (beam.wait(gone).ns, beam.wait(gone).id) == ('illuminator', 0)
    light.report(enable=1)
    beam.wait(shown)
    beam.clear()
    light.fake.silent = True
    pass_time_until(lambda: any(map(gone, beam.messages)))


@pytest.fixture
def two_beams(own_ros: Ros) -> Iterator[Program]:
    """Run a bridge with two lights, which are on and have beams of their own."""
    port = free_port()
    with (running_bridge(
            own_ros.domain, port, '-p', 'belly:beam_range:=3.0', '-p', 'belly:frame_id:=keel',
            beam_range=20.0, frame_id='mast', target_component=243,
            names='["1/244=belly"]') as bridge,
          ServedLight(port, enable=1), ServedLight(port, Address(1, 244), enable=1)):
        yield bridge


def test_each_light_has_a_beam_of_its_own_which_is_deleted_when_the_bridge_ends(
    own_ros: Ros, two_beams: Program,
) -> None:
    recorders = [own_ros.subscribe(Marker, f'/{node}/beam') for node in ('illuminator', 'belly')]

    markers = [recorder.wait(shown) for recorder in recorders]

    assert [(m.ns, m.header.frame_id, m.points[1].x) for m in markers] == [
        ('illuminator', 'mast', 20.0), ('belly', 'keel', 3.0)]
    assert Parameters(own_ros, '/belly').get('beam_range', 'beam_angle') == [3.0, 0.5]
    two_beams.end()
    for recorder in recorders:
        recorder.wait(gone)


def test_beam_is_off_by_default_and_its_messages_are_not_imported(
    own_ros: Ros, port: int,
) -> None:
    with running_bridge(own_ros.domain, port) as bridge, ServedLight(port, enable=1):
        own_ros.find_publisher('/illuminator/enabled')
        own_ros.find_publisher('/illuminator/connected')
        Parameters(own_ros).wait(beam_range=0.0)

        assert own_ros.node.count_publishers('/illuminator/beam') == 0
        loaded = Path(f'/proc/{bridge.pid}/maps').read_text()
        assert ('std_msgs' in loaded, 'visualization_msgs' in loaded) == (True, False)


@pytest.mark.parametrize(('parameter', 'reported'), [(154, 0), (0, 154)])
def test_beam_of_a_light_on_a_gimbal_points_where_the_gimbal_points(
    own_ros: Ros, port: int, parameter: int, reported: int,
) -> None:
    down_left = Quaternion.from_euler(0.0, math.radians(45), math.radians(30))
    gimbal = FakeManager(q=to_mavlink(down_left, YawFrame.VEHICLE))
    with (running_bridge(own_ros.domain, port, beam_range=20.0, frame_id='base_link',
                         mounted_on=parameter),
          ServedLight(port, enable=1, gimbal_device_id=reported) as light):
        beam = own_ros.subscribe(Marker, '/illuminator/beam')
        with served_gimbals(port, gimbal):
            def points_there(marker: Marker) -> bool:
                q = marker.pose.orientation
                return shown(marker) and Quaternion(q.w, q.x, q.y, q.z).angle_to(down_left) < 1e-3

            assert beam.wait(points_there).header.frame_id == 'base_link'
        light.report(enable=1)
        beam.clear()
        pass_time_until(lambda: any(map(gone, beam.messages)))


def test_gimbal_of_a_beam_that_is_not_heard_is_reported_with_those_that_are(
    own_ros: Ros, port: int,
) -> None:
    absence = ('no attitude of gimbal device 154 of system 1 has been heard, so the beam is not '
               'shown; heard: 171 of system 1')
    with (running_bridge(own_ros.domain, port, beam_range=20.0, mounted_on=154) as bridge,
          ServedLight(port, enable=1),
          served_gimbals(port, FakeManager(device_id=171), link=SlowLink)):
        recorder = own_ros.subscribe(DiagnosticArray, '/diagnostics', STREAM)
        pass_time_until(lambda: bridge.count(f'{absence}; set mounted_on'))

        lamp = recorder.wait(lambda array: any(
            absence in status.message for status in array.status))
        assert bridge.count('no attitude of gimbal device') == 1
        with served_gimbals(port, FakeManager(OTHER)):
            recorder.clear()
            recorder.wait(lambda array: any(
                status.name == 'illuminator: lamp' and absence not in status.message
                for status in array.status))
    assert [status.level for status in lamp.status if absence in status.message] == [
        DiagnosticStatus.WARN]
