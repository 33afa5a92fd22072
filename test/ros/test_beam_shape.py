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

"""The shape, the colour and the blinking of a beam."""

import math

from hypothesis import given
from hypothesis import strategies as st
from illuminator_ros.illuminator.model import Status
from illuminator_ros.ros.beam import Beam, cone, Look, MAX_ALPHA, SIDES
import pytest
from support.fake_light import status_message

EXTERNAL_SYNC = 2


def beam_of(*reports: dict[str, float]) -> Beam:
    """Return the beam of a light that is on and sends these statuses, one a second."""
    beam = Beam()
    for now, report in enumerate(reports):
        beam.take(Status.from_message(status_message(**{'enable': 1, **report})), float(now))
    return beam


def strobe(period: float, duty: float, **fields: float) -> dict[str, float]:
    return {'strobe_period': period, 'strobe_duty_cycle': duty, **fields}


def flashes(beam: Beam, until: float) -> list[tuple[float, bool]]:
    """Return when it changes and whether it is lit then, as a timer would see it."""
    now, seen = 0.0, []
    while now < until:
        seen.append((round(now, 6), beam.look(now).alpha > 0))
        now += beam.changes_in(now)
    return seen


@given(st.floats(0.1, 10_000), st.floats(0.01, 3.0))
def test_cone_is_closed_with_its_apex_at_the_origin_and_normals_pointing_outwards(
    length: float, angle: float,
) -> None:
    corners = cone(length, angle)

    assert len(corners) == 3 * SIDES
    assert set(corners[::3]) == {(0.0, 0.0, 0.0)}
    assert sorted(corners[1::3]) == sorted(corners[2::3])
    assert len(set(corners[1::3])) == SIDES
    for (x, y, z), (x2, y2, z2) in zip(corners[1::3], corners[2::3], strict=True):
        assert x == x2 == length
        assert math.atan2(math.hypot(y, z), x) == pytest.approx(angle / 2)
        normal = (y * z2 - z * y2, z * x2 - x * z2, x * y2 - y * x2)
        assert normal[0] < 0
        assert normal[1] * (y + y2) + normal[2] * (z + z2) > 0


@pytest.mark.parametrize(('reports', 'look'), [
    ([], Look(0.0)),
    ([{'brightness': 100.0}], Look(MAX_ALPHA)),
    ([{'brightness': 1.0}], Look(pytest.approx(MAX_ALPHA / 100))),
    ([{}, {'enable': 0}], Look(0.0)),
    ([strobe(1.0, 50.0, enable=0)], Look(0.0)),
    *(([{'error_status': flags}], Look(MAX_ALPHA, error=True)) for flags in (1, 2, 4, 0x100)),
    ([{'error_status': 1}, {}], Look(MAX_ALPHA)),
    *(([{'brightness': 40.0}, {'brightness': 40.0, **nonsense}],
       Look(pytest.approx(0.4 * MAX_ALPHA))) for nonsense in (
        {'enable': 7}, {'brightness': math.nan}, {'brightness': 500.0},
        {'strobe_period': -1.0}, {'strobe_duty_cycle': math.inf})),
    # A strobe that is none, has no known rhythm, or is faster than ten flashes a second.
    *(([strobe(period, duty)], Look(MAX_ALPHA))
      for period, duty in ((0.0, 50.0), (1.0, 100.0))),
    ([strobe(1.0, 10.0, mode=EXTERNAL_SYNC)], Look(MAX_ALPHA)),
    ([strobe(0.02, 30.0, brightness=50.0)], Look(pytest.approx(0.15 * MAX_ALPHA))),
])
def test_steady_beam_has_the_look_of_the_last_plausible_status(
    reports: list[dict[str, float]], look: Look,
) -> None:
    beam = beam_of(*reports)

    assert [beam.look(now) for now in (5.0, 5.013, 5.9)] == [look] * 3
    assert beam.changes_in(5.0) == math.inf


def test_lost_light_has_no_beam() -> None:
    beam = beam_of(strobe(1.0, 50.0))

    beam.lose()

    assert (beam.look(0.0), beam.changes_in(0.0)) == (Look(0.0), math.inf)


@pytest.mark.parametrize(('reports', 'until', 'expected'), [
    # The second status, which changes the brightness only, keeps the rhythm.
    ([strobe(2.0, 25.0), strobe(2.0, 25.0, brightness=10.0)], 5.0, [
        (0.0, True), (0.5, False), (2.0, True), (2.5, False), (4.0, True), (4.5, False)]),
    ([strobe(0.1, 50.0)], 0.17, [(0.0, True), (0.05, False), (0.1, True), (0.15, False)]),
    # Flashes and gaps last long enough to be seen.
    ([strobe(1.0, 1.0)], 1.0, [(0.0, True), (0.05, False)]),
    ([strobe(1.0, 99.0)], 1.0, [(0.0, True), (0.95, False)]),
])
def test_strobe_is_lit_for_the_duty_cycle_of_each_period(
    reports: list[dict[str, float]], until: float, expected: list[tuple[float, bool]],
) -> None:
    assert flashes(beam_of(*reports), until) == expected


@given(st.floats(0.1, 3600.0), st.floats(0.001, 99.999), st.floats(0.0, 1e6))
def test_strobe_changes_within_each_period_and_never_at_once(
    period: float, duty: float, now: float,
) -> None:
    assert 0 < beam_of(strobe(period, duty)).changes_in(now) <= period
