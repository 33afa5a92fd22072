# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The pages about gimbals and the camera: their rules and poses."""

import math
import re

from illuminator_ros.geometry.mount_attitude import to_mavlink, YawFrame
from illuminator_ros.geometry.rotation import Quaternion
import pytest
from support.processes import ROOT
from support.tables import table

GIMBAL, DESIGN = ((ROOT / 'doc' / f'{page}.md').read_text() for page in ('gimbal', 'design'))


def test_each_requirement_on_the_camera_is_listed_and_has_a_test() -> None:
    listed = [row[0] for row in table(DESIGN, 'requirement')]
    tested = {f'RE-{number}' for path in (ROOT / 'test').rglob('test_*.py')
              for name in re.findall(r'^def test(\w+)', path.read_text(), re.MULTILINE)
              for number in re.findall(r'_re_(\d+)', name)}

    assert listed == [f'RE-{number}' for number in range(1, 31)]
    assert {*listed} == tested


def numbers(cell: str) -> list[float]:
    return [float(text) for text in cell.split(',')]


def same(text: str, *q: float) -> bool:
    """Return whether a quaternion of the page is this one, whatever its sign."""
    return any(numbers(text) == pytest.approx([sign * value for value in q], abs=6e-4)
               for sign in (1, -1))


def test_the_page_of_gimbals_has_each_pose_in_both_conventions() -> None:
    poses = table(GIMBAL, 'pose')

    assert len(poses) == 6
    for pose, frame, ros, q_ros, mavlink, q_mavlink in poses:
        q = Quaternion.from_euler(*map(math.radians, numbers(ros)))
        components = to_mavlink(q, YawFrame(frame))
        assert same(q_ros, q.x, q.y, q.z, q.w), pose
        assert same(q_mavlink, *components), pose
        angles = Quaternion(*components).euler()
        assert [math.degrees(one) for one in angles] == pytest.approx(numbers(mavlink)), pose
