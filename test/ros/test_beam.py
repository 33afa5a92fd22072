# Copyright 2026 The illuminator_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.

"""``~/beam``: what RViz and Foxglove get to show the light."""

import itertools
import subprocess
import sys

from illuminator_ros.ros import beam_output
import pytest
from rclpy.duration import Duration
from rclpy.qos import DurabilityPolicy, ReliabilityPolicy
from support.embedded import embedded_bridge
from support.light import Address, free_port, ServedLight
from support.processes import environment
from support.recording import Recorder
from support.ros import Parameters, Ros, running_bridge, STREAM
from support.slow import pass_time_until
from visualization_msgs.msg import Marker

BEAM = {'beam_range': 20, 'beam_angle': 1.0, 'frame_id': 'bow'}
# What the statuses below go back to.
STEADY = {'enable': 1, 'mode': 1, 'strobe_period': 0.0, 'strobe_duty_cycle': 0.0,
          'error_status': 0}
# %; a brightness that was not there before tells a beam from those before it.
LEVELS = itertools.count(60.0, 0.5)
THROTTLED = 1
# So slow that on the clock of the tests it hardly gets on by itself.
HALF = 4.0
STROBE = {'strobe_period': 2 * HALF, 'strobe_duty_cycle': 50.0}


@pytest.fixture(scope='module')
def settings() -> dict[str, object]:
    """Show the beam."""
    return BEAM


@pytest.fixture
def beam(ros: Ros, light: ServedLight) -> Recorder:
    """Return the beam of a light that is on and steady."""
    recorder = ros.subscribe(Marker, '/illuminator/beam')
    steady(light, recorder)
    recorder.clear()
    return recorder


def steady(light: ServedLight, beam: Recorder) -> None:
    """Have the light shine steadily, and wait until that is seen."""
    level = next(LEVELS)
    light.report(**STEADY, brightness=level)
    beam.wait(lambda marker: marker.color.a == pytest.approx(level / 200))


def shown(marker: Marker) -> bool:
    return marker.action == Marker.ADD and marker.color.a > 0


def gone(marker: Marker) -> bool:
    return marker.action == Marker.DELETE


def test_it_is_a_cone_along_x_in_the_frame_of_the_light(beam: Recorder) -> None:
    marker = beam.wait(shown)

    assert (marker.header.frame_id, marker.ns) == ('bow', 'illuminator')
    assert marker.type == Marker.TRIANGLE_LIST
    assert (marker.scale.x, marker.scale.y, marker.scale.z) == (1.0, 1.0, 1.0)
    assert marker.pose.orientation.w == 1.0
    assert {point.x for point in marker.points} == {0.0, 20.0}


def test_it_is_drawn_where_the_frame_is_now(beam: Recorder) -> None:
    marker = beam.wait(shown)

    assert marker.frame_locked
    assert (marker.header.stamp.sec, marker.header.stamp.nanosec) == (0, 0)


def test_its_opacity_follows_the_brightness(light: ServedLight, beam: Recorder) -> None:
    light.report(brightness=40.0)

    marker = beam.wait(lambda marker: shown(marker) and marker.color.a == pytest.approx(0.2))
    assert min(marker.color.r, marker.color.g, marker.color.b) > 0.7


def test_it_is_red_while_the_light_reports_an_error(
    light: ServedLight, beam: Recorder,
) -> None:
    light.report(error_status=THROTTLED)

    beam.wait(lambda marker: (marker.color.r, marker.color.g, marker.color.b) == (1.0, 0.0, 0.0))


def test_it_is_gone_when_the_light_is_off_and_back_when_it_is_on(
    light: ServedLight, beam: Recorder,
) -> None:
    light.report(enable=0)
    marker = beam.wait(gone)
    light.report(enable=1)

    assert (marker.ns, marker.id) == ('illuminator', 0)
    beam.wait(shown, count=2)


def test_it_is_gone_when_the_light_is_lost(light: ServedLight, beam: Recorder) -> None:
    light.fake.silent = True

    pass_time_until(lambda: any(map(gone, beam.messages)))


def test_it_blinks_with_the_strobe(ros: Ros, light: ServedLight, beam: Recorder) -> None:
    light.report(**STROBE)
    ros.catch_up()

    for look in (gone, shown, gone, shown):
        beam.clear()
        ros.outlast(HALF, ['/illuminator'])
        beam.wait(look)


def test_a_strobe_too_fast_to_be_drawn_is_steady_and_dimmer(
    light: ServedLight, beam: Recorder,
) -> None:
    light.report(brightness=100.0, strobe_period=0.0625, strobe_duty_cycle=50.0)

    beam.wait(lambda marker: shown(marker) and marker.color.a == pytest.approx(0.25), count=2)
    assert not any(map(gone, beam.messages))


def test_it_stops_blinking_with_the_strobe(
    ros: Ros, light: ServedLight, beam: Recorder,
) -> None:
    light.report(**STROBE)
    ros.catch_up()
    ros.outlast(HALF, ['/illuminator'])
    beam.wait(gone)

    steady(light, beam)
    beam.clear()
    for _ in range(2):
        ros.outlast(HALF, ['/illuminator'])
        steady(light, beam)

    assert not any(map(gone, beam.messages))


def test_it_is_refreshed_before_viewers_drop_it(light: ServedLight, beam: Recorder) -> None:
    light.fake.stream = 0.0

    marker = beam.wait(shown, count=2)

    assert marker.lifetime.sec == 5


def test_it_is_kept_for_who_subscribes_late(ros: Ros, beam: Recorder) -> None:
    [info] = ros.node.get_publishers_info_by_topic('/illuminator/beam')

    assert info.qos_profile.durability == DurabilityPolicy.TRANSIENT_LOCAL
    assert info.qos_profile.reliability == ReliabilityPolicy.RELIABLE


def test_who_keeps_no_state_gets_it_as_well(ros: Ros, beam: Recorder) -> None:
    """Subscribe as RViz does unless told otherwise: volatile."""
    volatile = ros.subscribe(Marker, '/illuminator/beam', STREAM)

    assert shown(volatile.wait())


def test_it_is_taken_away_when_the_bridge_ends(
    own_ros: Ros, port: int, monkeypatch: pytest.MonkeyPatch,
) -> None:
    # A busy machine needs longer than a bridge may take to its end.
    monkeypatch.setattr(beam_output, 'FAREWELL', Duration(seconds=10.0))
    with (embedded_bridge(own_ros.domain, port, beam_range=5.0),
          ServedLight(port, enable=1)):
        beam = own_ros.subscribe(Marker, '/illuminator/beam')
        beam.wait(shown)

    beam.wait(gone)


def test_it_blinks_in_real_time_whatever_the_clock_of_ros_says(
    own_ros: Ros, port: int,
) -> None:
    with (running_bridge(own_ros.domain, port, beam_range=5.0, use_sim_time=True),
          ServedLight(port, enable=1, **STROBE)):
        beam = own_ros.subscribe(Marker, '/illuminator/beam')
        beam.wait(shown)

        for look in (gone, shown):
            beam.clear()
            own_ros.outlast(HALF, ['/illuminator'])
            beam.wait(look)


def test_each_light_may_have_a_frame_and_a_beam_of_its_own(own_ros: Ros) -> None:
    port = free_port()
    with (running_bridge(
            own_ros.domain, port, '-p', 'belly:beam_range:=3.0', '-p', 'belly:frame_id:=keel',
            beam_range=20.0, frame_id='mast', target_component=243,
            names='["1/244=belly"]'),
          ServedLight(port, enable=1), ServedLight(port, Address(1, 244), enable=1)):
        first = own_ros.subscribe(Marker, '/illuminator/beam').wait(shown)
        further = own_ros.subscribe(Marker, '/belly/beam').wait(shown)

        assert [(m.ns, m.header.frame_id, m.points[1].x) for m in (first, further)] == [
            ('illuminator', 'mast', 20.0), ('belly', 'keel', 3.0)]
        assert Parameters(own_ros, '/belly').get('beam_range', 'beam_angle') == [3.0, 0.5]


class TestOffByDefault:

    def test_there_is_no_such_topic(self, own_ros: Ros, port: int) -> None:
        with running_bridge(own_ros.domain, port), ServedLight(port, enable=1):
            own_ros.find_publisher('/illuminator/enabled')
            own_ros.find_publisher('/illuminator/connected')
            Parameters(own_ros).wait(beam_range=0.0)

            assert own_ros.node.count_publishers('/illuminator/beam') == 0

    def test_nothing_of_it_is_imported(self) -> None:
        done = subprocess.run(
            [sys.executable, '-c', 'import sys; import illuminator_ros.ros.process; '
             'print([m for m in sys.modules if m.startswith("visualization_msgs")])'],
            env=environment(), text=True, capture_output=True, timeout=30)

        assert done.stdout == '[]\n', done.stderr
