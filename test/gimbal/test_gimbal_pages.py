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

"""The page about gimbals, the parameter file and the policy, and what the node has."""

from __future__ import annotations

import math
from pathlib import Path
import re
import xml.etree.ElementTree as ET

import pytest

pytest.importorskip('rclpy')

from illuminator_ros.gimbal.ros.gimbal_node import PUBLICATIONS, REQUESTS  # noqa: E402, I100
from illuminator_ros.gimbal.ros.gimbals import GIMBAL_PARAMETERS  # noqa: E402
from illuminator_ros.payload.mount_attitude import to_mavlink, YawFrame  # noqa: E402
from illuminator_ros.payload.rotation import Quaternion  # noqa: E402
from support.tables import table  # noqa: E402
import yaml  # noqa: E402

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / 'doc' / 'gimbal.md').read_text()
POLICY = ET.parse(ROOT / 'config' / 'sros2' / 'gimbal.policy.xml').getroot()
SOURCES = yaml.safe_load((ROOT / 'config' / 'gimbal_sources.yaml').read_text())[
    '/**']['ros__parameters']['sources']
INTERNAL = {'~/get_logger_levels', '~/set_logger_levels', '~/get_type_description'}


def column(heading: str, number: int = 0) -> list[str]:
    return [row[number].strip('`') for row in table(PAGE, heading)]


def test_page_has_the_topics_that_the_node_publishes() -> None:
    assert column('published')[:-1] == [f'~/{one.name}' for one in PUBLICATIONS]
    assert [text.rpartition('/')[2] for text in column('published', 1)[:-1]] == [
        one.type.__name__ for one in PUBLICATIONS]
    assert column('published', 2)[:-1] == [
        'stream' if one.qos else 'state' for one in PUBLICATIONS]


def test_page_has_the_services_of_the_node() -> None:
    services = {row[0].strip('`') for row in table(PAGE, 'accepted') if 'std_srvs' in row[1]}

    assert services == {f'~/{name}' for name in (*REQUESTS, 'set_yaw_lock')}


def test_page_and_file_have_the_parameters_with_their_defaults() -> None:
    assert [[cell.replace('`', '') for cell in row]
            for row in table(PAGE, 'parameter of the gimbal')] == [
        [spec.name, spec.shown_default, spec.shown_range, spec.unit, spec.description]
        for spec in GIMBAL_PARAMETERS]
    given = yaml.safe_load((ROOT / 'config' / 'gimbal.yaml').read_text())['/**']['ros__parameters']
    assert list(given.items())[1:] == [(spec.name, spec.default) for spec in GIMBAL_PARAMETERS]


def numbers(cell: str) -> list[float]:
    return [float(text) for text in cell.split(',')]


def same(text: str, *q: float) -> bool:
    """Return whether a quaternion of the page is this one, whatever its sign."""
    return any(numbers(text) == pytest.approx([sign * value for value in q], abs=6e-4)
               for sign in (1, -1))


def test_page_has_each_pose_in_both_conventions() -> None:
    poses = table(PAGE, 'pose')
    assert len(poses) == 6
    for pose, frame, ros, q_ros, mavlink, q_mavlink in poses:
        q = Quaternion.from_euler(*map(math.radians, numbers(ros)))
        components = to_mavlink(q, YawFrame(frame))
        assert same(q_ros, q.x, q.y, q.z, q.w), pose
        assert same(q_mavlink, *components), pose
        angles = Quaternion(*components).euler()
        assert [math.degrees(one) for one in angles] == pytest.approx(numbers(mavlink)), pose


def test_each_test_that_the_page_names_exists_and_names_its_rule() -> None:
    code = '\n'.join(path.read_text() for path in (ROOT / 'test').rglob('test_*.py'))
    for rules, _, *cells in table(PAGE, 'rule'):
        tests = re.findall('`(test_\\w+)`', ' '.join(cells))
        assert tests
        for name in tests:
            assert f'def {name}(' in code, name
            assert any(f'gm_{number}_' in name for number in re.findall(r'\d+', rules)), name


def permitted(node: str, element: str, action: str) -> set[str]:
    """Return what the policy lets a node do with its own names or those of the gimbal's node."""
    [profile] = [one for one in POLICY.iter('profile') if one.attrib['node'] == node]
    names = {str(name.text) for rule in profile if action in rule.attrib
             for name in rule.iter(element)}
    return {name.replace('/gimbal/', '~/') for name in names
            if name.startswith('~/' if node == 'gimbal' else '/gimbal/')}


def test_policy_permits_the_interface_of_the_page() -> None:
    published = {*column('published'), '~/source'} - {'/diagnostics'}
    of_a_source = ', '.join(row[0] for row in table(PAGE, 'of a source')).replace('`', '')
    accepted = {*column('accepted'), '~/default/release'}.union(*(
        of_a_source.replace('NAME', name).split(', ') for name in SOURCES if name != 'default'))
    topics = {name for name in accepted if '/cmd/' in name}
    parameters = {f'~/{name}' for name in (
        'describe_parameters', 'get_parameter_types', 'get_parameters', 'list_parameters',
        'set_parameters', 'set_parameters_atomically')}
    services = accepted - topics | parameters

    assert permitted('gimbal', 'topic', 'publish') == published
    assert permitted('gimbal', 'topic', 'subscribe') == topics
    assert permitted('gimbal', 'service', 'reply') == services | INTERNAL
    assert permitted('gimbal_operator', 'topic', 'subscribe') == published
    assert permitted('gimbal_operator', 'topic', 'publish') == topics
    assert permitted('gimbal_operator', 'service', 'request') == services
