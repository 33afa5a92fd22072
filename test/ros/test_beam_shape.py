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

"""The shape, the colour and the blinking of a beam, without ROS."""

import ast
import math
from pathlib import Path

from hypothesis import given
from hypothesis import strategies as st
from illuminator_ros.illuminator.model import Status
from illuminator_ros.ros import beam as module
from illuminator_ros.ros.beam import Beam, cone, Look, MAX_ALPHA, Point, SIDES
import pytest
from support.fake_light import status_message

EXTERNAL_SYNC = 2


def status(**fields: float) -> Status:
    """Return the status of a light that is on."""
    return Status.from_message(status_message(**{'enable': 1, **fields}))


def strobe(period: float, duty: float, brightness: float = 100.0) -> Beam:
    """Return a beam that strobes since time 0."""
    beam = Beam()
    beam.take(status(strobe_period=period, strobe_duty_cycle=duty, brightness=brightness), 0.0)
    return beam


def flashes(beam: Beam, until: float) -> list[tuple[float, bool]]:
    """Return when it changes and whether it is lit then, as a timer would see it."""
    now, seen = 0.0, []
    while now < until:
        seen.append((round(now, 6), beam.look(now).alpha > 0))
        now += beam.changes_in(now)
    return seen


def normal(a: Point, b: Point, c: Point) -> Point:
    """Return what points away from the side on which the corners run counter-clockwise."""
    (u, v, w), (x, y, z) = ([q - p for p, q in zip(a, other, strict=True)] for other in (b, c))
    return v * z - w * y, w * x - u * z, u * y - v * x


def test_it_needs_no_ros() -> None:
    tree = ast.parse(Path(module.__file__).read_text())
    roots = {alias.name.partition('.')[0] for node in ast.walk(tree)
             if isinstance(node, ast.Import) for alias in node.names}
    roots |= {str(node.module).partition('.')[0] for node in ast.walk(tree)
              if isinstance(node, ast.ImportFrom) and not node.level}

    assert roots == {'__future__', 'dataclasses', 'math', 'typing'}


class TestCone:
    lengths = st.floats(0.1, 10_000)
    angles = st.floats(0.01, 3.0)

    def test_it_has_a_triangle_for_each_side(self) -> None:
        assert len(cone(10.0, 0.5)) == 3 * SIDES

    @given(lengths, angles)
    def test_each_triangle_begins_at_the_apex_which_is_the_origin(
        self, length: float, angle: float,
    ) -> None:
        assert set(cone(length, angle)[::3]) == {(0.0, 0.0, 0.0)}

    @given(lengths, angles)
    def test_its_rim_is_a_circle_around_x_under_half_the_opening_angle(
        self, length: float, angle: float,
    ) -> None:
        for x, y, z in [*cone(length, angle)[1::3], *cone(length, angle)[2::3]]:
            assert x == length
            assert math.atan2(math.hypot(y, z), x) == pytest.approx(angle / 2)

    def test_a_right_angle_opens_as_far_as_the_beam_is_long(self) -> None:
        assert {round(math.hypot(y, z), 9) for _, y, z in cone(8.0, math.pi / 2)[1::3]} == {8.0}

    @given(lengths, angles)
    def test_its_normals_point_outwards_and_back(self, length: float, angle: float) -> None:
        corners = cone(length, angle)
        for at in range(0, len(corners), 3):
            apex, one, other = corners[at:at + 3]
            x, y, z = normal(apex, one, other)
            assert x < 0
            assert y * (one[1] + other[1]) + z * (one[2] + other[2]) > 0

    def test_it_is_closed_all_round(self) -> None:
        corners = cone(1.0, 1.0)

        assert sorted(corners[1::3]) == sorted(corners[2::3])
        assert len(set(corners[1::3])) == SIDES


class TestLook:
    def test_there_is_none_before_the_first_status(self) -> None:
        assert Beam().look(0.0) == Look(0.0)

    @pytest.mark.parametrize(('brightness', 'alpha'), [(100.0, MAX_ALPHA), (50.0, MAX_ALPHA / 2),
                                                       (1.0, MAX_ALPHA / 100), (0.0, 0.0)])
    def test_its_opacity_follows_the_brightness(self, brightness: float, alpha: float) -> None:
        beam = Beam()

        beam.take(status(brightness=brightness), 0.0)

        assert beam.look(5.0) == Look(pytest.approx(alpha))

    def test_there_is_none_while_the_light_is_off(self) -> None:
        beam = Beam()
        beam.take(status(), 0.0)

        beam.take(status(enable=0), 1.0)

        assert beam.look(1.0) == Look(0.0)

    def test_there_is_none_after_the_light_is_lost(self) -> None:
        beam = strobe(1.0, 50.0)

        beam.lose()

        assert beam.look(0.0) == Look(0.0)
        assert beam.changes_in(0.0) == math.inf

    @pytest.mark.parametrize('flags', [1, 2, 4, 0x100])
    def test_any_error_flag_makes_it_one_of_an_error(self, flags: int) -> None:
        beam = Beam()

        beam.take(status(error_status=flags), 0.0)

        assert beam.look(0.0) == Look(MAX_ALPHA, error=True)

    def test_the_error_goes_with_its_flag(self) -> None:
        beam = Beam()
        beam.take(status(error_status=1), 0.0)

        beam.take(status(), 1.0)

        assert beam.look(1.0) == Look(MAX_ALPHA)

    @pytest.mark.parametrize('nonsense', [
        {'enable': 7}, {'brightness': math.nan}, {'brightness': 500.0},
        {'strobe_period': -1.0}, {'strobe_duty_cycle': math.inf}])
    def test_what_cannot_be_true_leaves_it_as_it_is(self, nonsense: dict[str, float]) -> None:
        beam = Beam()
        beam.take(status(brightness=40.0), 0.0)

        changed = beam.take(status(**{'brightness': 40.0, **nonsense}), 1.0)

        assert not changed
        assert beam.look(1.0) == Look(pytest.approx(0.4 * MAX_ALPHA))

    def test_a_status_that_says_the_same_is_no_change(self) -> None:
        beam = strobe(1.0, 50.0)

        assert not beam.take(status(strobe_period=1.0, strobe_duty_cycle=50.0), 0.7)
        assert beam.take(status(strobe_period=1.0, strobe_duty_cycle=51.0), 0.8)


class TestStrobe:
    def test_it_is_lit_for_the_duty_cycle_of_each_period(self) -> None:
        assert flashes(strobe(2.0, 25.0), 5.0) == [
            (0.0, True), (0.5, False), (2.0, True), (2.5, False), (4.0, True), (4.5, False)]

    def test_a_status_meanwhile_does_not_disturb_its_rhythm(self) -> None:
        beam = strobe(2.0, 25.0)

        beam.take(status(strobe_period=2.0, strobe_duty_cycle=25.0, brightness=10.0), 0.7)

        assert flashes(beam, 3.0) == [(0.0, True), (0.5, False), (2.0, True), (2.5, False)]

    @pytest.mark.parametrize(('period', 'duty'), [(0.0, 50.0), (1.0, 0.0), (1.0, 100.0)])
    def test_what_is_no_strobe_is_steady_and_fully_bright(
        self, period: float, duty: float,
    ) -> None:
        beam = strobe(period, duty)

        assert beam.changes_in(0.3) == math.inf
        assert beam.look(0.9) == Look(MAX_ALPHA)

    def test_ten_flashes_a_second_are_drawn(self) -> None:
        assert flashes(strobe(0.1, 50.0), 0.17) == [(0.0, True), (0.05, False), (0.1, True),
                                                    (0.15, False)]

    def test_a_faster_one_is_steady_at_its_mean_brightness(self) -> None:
        beam = strobe(0.02, 30.0, brightness=50.0)

        assert beam.changes_in(0.0) == math.inf
        assert {round(beam.look(at / 1000).alpha, 9) for at in range(40)} == {
            round(0.5 * 0.3 * MAX_ALPHA, 9)}

    @pytest.mark.parametrize(('duty', 'lit'), [(1.0, 0.05), (99.0, 0.95)])
    def test_flashes_and_gaps_are_drawn_long_enough_to_be_seen(
        self, duty: float, lit: float,
    ) -> None:
        assert flashes(strobe(1.0, duty), 1.0) == [(0.0, True), (lit, False)]

    def test_external_sync_is_steady_since_nobody_knows_its_rhythm(self) -> None:
        beam = Beam()

        beam.take(status(mode=EXTERNAL_SYNC, strobe_period=1.0, strobe_duty_cycle=10.0), 0.0)

        assert beam.changes_in(0.0) == math.inf
        assert beam.look(0.9) == Look(MAX_ALPHA)

    def test_a_light_that_is_off_does_not_blink(self) -> None:
        beam = strobe(1.0, 50.0)

        beam.take(status(enable=0, strobe_period=1.0, strobe_duty_cycle=50.0), 0.1)

        assert beam.changes_in(0.1) == math.inf

    @given(st.floats(0.1, 3600.0), st.floats(0.001, 99.999), st.floats(0.0, 1e6))
    def test_it_changes_within_each_period_and_never_at_once(
        self, period: float, duty: float, now: float,
    ) -> None:
        assert 0 < strobe(period, duty).changes_in(now) <= period
