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

"""The files in config/ name the topics, types and services that a real bridge has."""

import contextlib
from importlib import import_module
import json
from pathlib import Path
import re
from typing import Any
import xml.etree.ElementTree as ET

from diagnostic_msgs.msg import DiagnosticArray
import pytest
from support.embedded import refusal
from support.gimbals import FakeManager, served_gimbals
from support.graph import Interface, interface
from support.light import Address, eventually, ServedLight
from support.ports import free_port
from support.processes import ended, python
from support.ros import bridge_arguments, Ros, running_bridge, STREAM
import yaml

CONFIG = Path(__file__).parents[2] / 'config'
ANALYZERS = yaml.safe_load(
    (CONFIG / 'diagnostics_aggregator.yaml').read_text())['/**']['ros__parameters']
JOYSTICK = yaml.safe_load((CONFIG / 'joystick.yaml').read_text())['/**']['ros__parameters']
FOXGLOVE = json.loads((CONFIG / 'foxglove_layout.json').read_text())
PLOTJUGGLER = ET.parse(CONFIG / 'plotjuggler_layout.xml').getroot()
CURVES = [curve.attrib['name'] for curve in PLOTJUGGLER.iter('curve')]
PLOTS = [series['value'] for panel in FOXGLOVE['configById'].values()
         for series in panel.get('paths', [])]
POLICY, GIMBAL_POLICY = (
    ET.parse(CONFIG / 'sros2' / f'{name}.policy.xml').getroot()
    for name in ('illuminator', 'gimbal'))
# The rules of a policy, and the part of a node's interface that each names.
RULES = {('topic', 'publish'): 'publishers', ('topic', 'subscribe'): 'subscriptions',
         ('service', 'reply'): 'services', ('service', 'request'): 'clients'}
NUMBERS = {'boolean', 'float', 'double', 'uint32'}
SHOWN = {'brightness', 'temperature', 'connected', 'enabled', 'error_flags'}


@pytest.fixture(scope='module')
def settings() -> dict[str, Any]:
    """With everything that makes the node do more."""
    return {'use_sim_time': True, 'beam_range': 5.0, 'diagnostics_period': 0.1,
            'sources': "['safety', 'operator', 'autonomy']"}


@pytest.fixture(scope='module')
def offered(ros: Ros, shared_bridge: object) -> Interface:
    """Return the interface of the bridge's first node."""
    return interface(ros)


def field_type(message: str, path: list[str]) -> str:
    """Return the type of a field of a message."""
    package, _, name = message.split('/')
    fields = getattr(import_module(f'{package}.msg'), name).get_fields_and_field_types()
    kind: str = fields[path[0]]
    return field_type(kind.replace('/', '/msg/'), path[1:]) if path[1:] else kind


def test_foxglove_layout_plots_published_fields(offered: Interface) -> None:
    paths = [path for path in PLOTS if path.startswith('/illuminator/')]
    for path in paths:
        topic, *fields = path.split('.')
        assert field_type(offered.publishers[topic], fields) in NUMBERS | {'string'}, path
    assert {path.split('.')[0].removeprefix('/illuminator/') for path in paths} >= {*SHOWN, 'mode'}
    for panel in FOXGLOVE['configById'].values():
        for topic in filter(None, [*panel.get('topics', {}), panel.get('topicToRender')]):
            assert topic in offered.publishers


def test_plotjuggler_layout_selects_and_plots_published_numbers(
    ros: Ros, offered: Interface,
) -> None:
    topics = offered.publishers
    array = ros.subscribe(DiagnosticArray, '/diagnostics', STREAM).wait(
        lambda array: len(array.status) == 2)
    diagnosed = {f'{status.name}/{key}' for status in array.status
                 for key in ['level', *(value.key for value in status.values)]}
    for curve in CURVES:
        if curve.startswith('/diagnostics/'):
            # PlotJuggler calls them TOPIC/HARDWARE_ID/NAME/KEY.
            _, _, key = curve.rpartition('/illuminator: ')
            assert f'illuminator: {key}' in diagnosed
        else:
            [topic] = [topic for topic in topics if curve.startswith(f'{topic}/')]
            fields = curve.removeprefix(f'{topic}/').split('/')
            assert field_type(topics[topic], fields) in NUMBERS
    assert {name.split('/')[2] for name in CURVES if name.startswith('/illuminator/')} >= SHOWN


def test_joystick_commands_are_topics_of_the_bridge_and_the_axis_covers_0_to_100_percent(
    offered: Interface,
) -> None:
    for command in JOYSTICK.values():
        assert command['type'] == 'topic'
        assert offered.subscriptions[
            '/' + command['topic_name']] == command['interface_type']
    # joy_teleop publishes axis * scale + offset, and refuses an integer for a Float32.
    mapping = JOYSTICK['dim']['axis_mappings']['data']
    assert [axis * mapping['scale'] + mapping['offset'] for axis in (-1, 0, 1)] == [0, 50, 100]
    assert {type(mapping['scale']), type(mapping['offset'])} == {float}
    values = {name: command['message_value']['data']['value']
              for name, command in JOYSTICK.items() if 'message_value' in command}
    assert values == {'switch_on': True, 'switch_off': False}
    assert [len(JOYSTICK[name]['deadman_buttons']) for name in values] == [2, 1]


def permitted(
    node: str, element: str, action: str, policy: ET.Element = POLICY,
) -> list[str]:
    """Return the names in full of what a policy lets a node do."""
    [profile] = [one for one in policy.iter('profile') if one.attrib['node'] == node]
    rules = [rule for rule in profile if action in rule.attrib]
    assert all(rule.attrib == {action: 'ALLOW'} for rule in rules)
    names = [str(name.text) for rule in rules for name in rule.iter(element)]
    return [f'/{node}{name[1:]}' if name.startswith('~') else name for name in names]


@pytest.mark.parametrize(('rule', 'part'), RULES.items(), ids=RULES.values())
def test_policy_permits_the_bridge_its_interface_and_nothing_else(
    offered: Interface, rule: tuple[str, str], part: str,
) -> None:
    assert sorted(permitted('illuminator', *rule)) == sorted(getattr(offered, part))


def test_policy_permits_the_operator_all_that_the_bridge_offers_but_its_internals(
    ros: Ros, offered: Interface,
) -> None:
    own = {'/clock', '/diagnostics', '/parameter_events', '/rosout'}
    internal = {f'/illuminator/{name}' for name in (
        'get_logger_levels', 'set_logger_levels', 'get_type_description')}
    mine = interface(ros, 'tester', ['/tester/get_type_description'])

    assert set(permitted('operator', 'topic', 'subscribe')) - own == set(
        offered.publishers) - own
    assert set(permitted('operator', 'topic', 'publish')) - own == set(
        offered.subscriptions) - own
    assert set(permitted('operator', 'service', 'request')) == set(offered.services) - internal
    assert sorted(permitted('operator', 'service', 'reply')) == sorted(
        name.replace('/tester/', '/operator/') for name in mine.services)
    assert set(mine.publishers) <= set(permitted('operator', 'topic', 'publish'))


def test_policy_permits_a_source_its_own_names_only() -> None:
    names = permitted('mission', 'topic', 'publish') + permitted('mission', 'service', 'request')

    assert {name for name in names if name.startswith('/illuminator/')} == {
        f'/illuminator/autonomy/{name}'
        for name in ('cmd/brightness', 'cmd/enable', 'enable', 'release')}


def test_example_of_sources_has_parameters_that_the_bridge_accepts(own_ros: Ros) -> None:
    given = yaml.safe_load((CONFIG / 'sources.yaml').read_text())['/**']['ros__parameters']

    assert refusal(own_ros.context, **given) == ''


def groups(status: str) -> list[str]:
    """Return the groups of the aggregator that take a status."""
    # As GenericAnalyzer::match does with the names as they are published.
    return [name for name, one in ANALYZERS.items()
            if any(re.fullmatch(pattern, status) for pattern in one['regex'])]


def test_aggregator_takes_each_status_of_all_lights_and_no_others(
    own_ros: Ros, port: int,
) -> None:
    nodes = ('illuminator', 'illuminator_1_244')
    names = {f'{node}: {part}' for node in nodes for part in ('link', 'lamp')}
    with (running_bridge(own_ros.domain, port, diagnostics_period=0.1, target_component=243),
          ServedLight(port), ServedLight(port, Address(1, 244))):
        recorder = own_ros.subscribe(DiagnosticArray, '/diagnostics', STREAM)
        eventually(lambda: names <= {status.name for array in list(recorder.messages)
                                     for status in array.status})

    assert all(groups(name) == ['lights'] for name in names)
    assert set(ANALYZERS['lights']['expected']) <= names
    assert not any(map(groups, (
        'illuminator_driver: link', 'illuminator: battery', 'my illuminator: lamp')))
    for analyzer in ANALYZERS.values():
        assert analyzer['type'] == 'diagnostic_aggregator/GenericAnalyzer'
        # A status of the default period, 1 s, is not stale between two.
        assert analyzer['timeout'] > 3.0


def test_layout_aggregator_and_policy_know_the_names_of_gimbals_and_the_camera(
    own_ros: Ros, port: int,
) -> None:
    wanted = {
        'gimbals': {'gimbal: link', 'gimbal: device', 'gimbal_1_155: device',
                    'gimbal_manager: link', 'gimbal_manager: device', 'gimbal_manager: manager'},
        'cameras': {'rededge: link', 'rededge: camera'}}
    with contextlib.ExitStack() as stack:
        for name, parameters in (
                ('gimbal', {'sources': '[safety, operator, autonomy]'}), ('rededge', {}),
                ('gimbal_manager', {'gimbal_device_id': 1})):
            stack.enter_context(ended(python(
                f'illuminator_ros.{"rededge" if name == "rededge" else "gimbal"}',
                *bridge_arguments(
                    port if name == 'gimbal' else free_port(), '-r', f'__node:={name}',
                    diagnostics_period=0.1, payloads=f'[{name}]', **parameters),
                env={'ROS_DOMAIN_ID': str(own_ros.domain)})))
        stack.enter_context(served_gimbals(port, FakeManager(), FakeManager(device_id=155)))
        recorder = own_ros.subscribe(DiagnosticArray, '/diagnostics', STREAM)
        eventually(lambda: set().union(*wanted.values()) <= {
            status.name for array in list(recorder.messages) for status in array.status})
        topics = {
            topic: types[0] for topic, types in own_ros.node.get_topic_names_and_types()}
        offered = interface(own_ros, 'gimbal', [
            '/diagnostics', '/gimbal/autonomy/cmd/roi', '/gimbal/autonomy/release'])

    for rule, part in RULES.items():
        assert sorted(permitted('gimbal', *rule, GIMBAL_POLICY)) == sorted(
            getattr(offered, part))
    names = {status.name for array in recorder.messages for status in array.status}
    assert {group: {name for name in names if groups(name) == [group]} & wanted[group]
            for group in wanted} == wanted
    assert all(map(groups, names))
    others = [path for path in PLOTS if not path.startswith('/illuminator/')]
    assert {path.split('/')[1] for path in others} == {'gimbal', 'rededge'}
    for path in others:
        topic, *fields = path.split('.')
        assert field_type(topics[topic], fields) in NUMBERS | {'string'}, path
