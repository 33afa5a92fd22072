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


"""The page, the parameter file and the policy of the camera, and what its node has."""

from pathlib import Path
import re
from typing import Any
import xml.etree.ElementTree as ET

from illuminator_ros.rededge.conversions import FIELDS
from illuminator_ros.rededge.ros.camera_node import MOUNT_PARAMETERS, PARAMETERS, REDEDGE
import pytest
from support.graph import Interface, interface
from support.ports import free_port
from support.processes import ended, python
from support.ros import Ros
from support.tables import table
import yaml

ROOT = Path(__file__).resolve().parents[2]
PAGE = (ROOT / 'doc' / 'rededge.md').read_text()
POLICY = ET.parse(ROOT / 'config' / 'sros2' / 'rededge.policy.xml').getroot()
SPECS = (*PARAMETERS, *MOUNT_PARAMETERS)
OF_EVERY_NODE = re.compile('parameter|logger|type_description|rosout|clock')


@pytest.fixture(scope='module')
def offered(ros: Ros) -> Any:
    """Return the interface of the running node."""
    with ended(python('illuminator_ros.rededge', f'udpin://127.0.0.1:{free_port()}', '--ros-args',
                      '-p', 'use_sim_time:=true', env={'ROS_DOMAIN_ID': str(ros.domain)})):
        yield interface(ros, 'rededge', ('/diagnostics', '/clock', '/rededge/time_reference',
                                         '/rededge/set_parameters_atomically'))


def test_the_page_has_the_topics_and_services_of_the_node(offered: Interface) -> None:
    for heading, found in (('subscribed', offered.subscriptions),
                           ('published', offered.publishers), ('service', offered.services)):
        assert {row[0].strip('`'): row[1].strip('`') for row in table(PAGE, heading)} == {
            name.replace('/rededge/', '~/'): re.sub('/(msg|srv)/', '/', type_)
            for name, type_ in found.items() if not OF_EVERY_NODE.search(name)
            or name == '/rededge/time_reference'}


def test_the_page_has_each_parameter() -> None:
    rows = [[cell.replace('`', '') for cell in cells]
            for cells in table(PAGE, 'parameter of the camera')]
    assert rows == [[spec.name, spec.shown_default, spec.shown_range, spec.unit, spec.description]
                    for spec in SPECS]


def test_the_parameter_file_has_each_parameter_with_its_default() -> None:
    content = yaml.safe_load((ROOT / 'config' / 'rededge.yaml').read_text())
    given = content['/**']['ros__parameters']
    # While it is not set, diagnostics warn.
    assert given == {
        'connection_url': REDEDGE.link_defaults['connection_url'],
        **{spec.name: spec.default for spec in SPECS if spec.name != 'geoid_separation'}}


def test_the_page_has_the_table_of_fields() -> None:
    assert table(PAGE, 'message') == [
        [cls.name, f'`{name}`', field.source, field.unit,
         '' if field.scale is None else f'{field.scale:g}',
         f'{field.low:.10g} to {field.high:.10g}',
         '' if field.unknown is None else str(field.unknown)]
        for cls, fields in FIELDS.items() for name, field in fields.items()]


def test_each_requirement_names_a_test_that_names_it() -> None:
    tests = set(re.findall(r'^def (test_\w+)', '\n'.join(
        path.read_text() for path in (ROOT / 'test').rglob('test_*.py')), re.MULTILINE))
    rows = {row[0]: row[2].strip('`') for row in table(PAGE, 'requirement')}

    assert list(rows) == [f'RE-{number}' for number in range(1, 31)]
    assert set(rows.values()) <= tests
    for requirement, name in rows.items():
        assert re.search(rf'_{requirement.lower().replace("-", "_")}(_|$)', name)


def permitted(node: str, element: str, action: str) -> set[str]:
    """Return the names in full of what the policy lets a node do."""
    [profile] = [one for one in POLICY.iter('profile') if one.attrib['node'] == node]
    return {str(name.text).replace('~', f'/{node}') for rule in profile
            if rule.attrib == {action: 'ALLOW'} for name in rule.iter(element)}


def test_the_policy_permits_the_node_its_interface_and_the_robot_to_use_it(
        offered: Interface) -> None:
    internal = {f'/rededge/{name}' for name in (
        'get_logger_levels', 'set_logger_levels', 'get_type_description')}

    assert permitted('rededge', 'topic', 'publish') == set(offered.publishers)
    assert permitted('rededge', 'topic', 'subscribe') == set(offered.subscriptions)
    assert permitted('rededge', 'service', 'reply') == set(offered.services)
    own = {'/parameter_events', '/rosout', '/clock'}
    assert permitted('rededge_operator', 'topic', 'publish') - own == (
        set(offered.subscriptions) - own)
    assert permitted('rededge_operator', 'topic', 'subscribe') - own == (
        set(offered.publishers) - own)
    assert permitted('rededge_operator', 'service', 'request') == set(offered.services) - internal
