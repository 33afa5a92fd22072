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

"""The page, the parameter file and the policy of the gimbal manager, and what its node has."""

from __future__ import annotations

from pathlib import Path
import re
import xml.etree.ElementTree as ET

import pytest

pytest.importorskip('rclpy')

from illuminator_ros.gimbal.ros.gimbals import GIMBAL_PARAMETERS  # noqa: E402, I100
from illuminator_ros.gimbal.ros.manager_node import MANAGER_PARAMETERS  # noqa: E402
from support.tables import table  # noqa: E402
import yaml  # noqa: E402

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / 'doc' / 'gimbal.md').read_text()


def names(policy: str, node: str, action: str) -> set[str]:
    """Return the names that a policy permits a node, without the name of the gimbal's node."""
    root = ET.parse(ROOT / 'config' / 'sros2' / policy).getroot()
    [profile] = [one for one in root.iter('profile') if one.attrib['node'] == node]
    return {re.sub('^/gimbal(_manager)?/', '/', str(name.text))
            for rule in profile if action in rule.attrib for name in rule}


def test_page_and_file_have_the_parameters_of_the_manager() -> None:
    assert [[cell.replace('`', '') for cell in row]
            for row in table(PAGE, 'parameter of the manager')] == [
        [spec.name, spec.shown_default, spec.shown_range, spec.unit, spec.description]
        for spec in MANAGER_PARAMETERS]
    path = ROOT / 'config' / 'gimbal_manager.yaml'
    given = yaml.safe_load(path.read_text())['/**']['ros__parameters']
    assert list(given.items())[1:] == [
        (spec.name, spec.default) for spec in (*GIMBAL_PARAMETERS, *MANAGER_PARAMETERS)]


def test_policy_permits_the_manager_the_names_of_a_gimbal_and_its_own() -> None:
    topics = {direction: {row[0].strip('`') for row in table(PAGE, 'topic of the manager')
                          if row[2] == direction} for direction in ('published', 'subscribed')}

    for role, own in (('', topics), ('_operator', {'published': set(), 'subscribed': set()})):
        for action, more in (('publish', own['published']), ('subscribe', own['subscribed']),
                             ('request', set()), ('reply', set())):
            assert names('gimbal_manager.policy.xml', f'gimbal_manager{role}', action) == names(
                'gimbal.policy.xml', f'gimbal{role}', action) | more


def test_each_test_of_the_managers_rules_exists_and_names_its_rule() -> None:
    code = '\n'.join(path.read_text() for path in (ROOT / 'test').rglob('test_*.py'))
    for rule, _, tests in table(PAGE, 'rule of the manager'):
        for name in re.findall('`(test_\\w+)`', tests):
            assert f'def {name}(' in code, name
            assert f'{rule.lower().replace("-", "_")}_' in name, name
