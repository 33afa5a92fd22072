# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The shape, the colour and the opacity of a beam."""

import math
from typing import Any

from hypothesis import given
from hypothesis import strategies as st
from illuminator_ros.illuminator.model import Status
from illuminator_ros.illuminator.ros.beam import Beam, cone, MAX_ALPHA, SIDES
import pytest
from support.fake_light import status_message

EXTERNAL_SYNC = 2


def beam_of(*reports: dict[str, Any]) -> Beam:
    """Return the beam of a light that is on and sends these statuses."""
    beam = Beam()
    for report in reports:
        beam = beam.updated(Status.from_message(status_message(**{'enable': 1, **report})))
    return beam


def strobe(period: float, duty: float, **fields: float) -> dict[str, float]:
    return {'strobe_period': period, 'strobe_duty_cycle': duty, **fields}


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
    ([], (0.0, False)),
    ([{'brightness': 100.0}], (MAX_ALPHA, False)),
    ([{'brightness': 1.0}], (pytest.approx(MAX_ALPHA / 100), False)),
    ([{}, {'enable': 0}], (0.0, False)),
    ([strobe(1.0, 50.0, enable=0)], (0.0, False)),
    *(([{'error_status': flags}], (MAX_ALPHA, True)) for flags in (1, 2, 4, 0x100)),
    ([{'error_status': 1}, {}], (MAX_ALPHA, False)),
    *(([{'brightness': 40.0}, {'brightness': 40.0, **nonsense}],
       (pytest.approx(0.4 * MAX_ALPHA), False)) for nonsense in (
        {'enable': 7}, {'brightness': math.nan}, {'brightness': 500.0},
        {'strobe_period': -1.0}, {'strobe_duty_cycle': math.inf})),
    # A strobe is drawn at its mean brightness; the strobe of an external signal is unknown.
    *(([strobe(period, duty)], (MAX_ALPHA, False))
      for period, duty in ((0.0, 50.0), (1.0, 100.0))),
    ([strobe(1.0, 10.0, mode=EXTERNAL_SYNC)], (MAX_ALPHA, False)),
    ([strobe(2.0, 25.0)], (pytest.approx(MAX_ALPHA / 4), False)),
    ([strobe(2.0, 25.0), strobe(0.0, 25.0)], (MAX_ALPHA, False)),
    ([strobe(0.02, 30.0, brightness=50.0)], (pytest.approx(0.15 * MAX_ALPHA), False)),
])
def test_beam_has_the_look_of_the_last_plausible_status(
    reports: list[dict[str, Any]], look: tuple[float, bool],
) -> None:
    beam = beam_of(*reports)

    assert (beam.alpha, beam.error) == look
