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

"""The pages about the ROS interface, and what the bridge has."""

import dataclasses
from pathlib import Path
import re
from typing import Any

from illuminator_ros.cli.bridge import Executable, usage
from illuminator_ros.cli.monitor import key_bindings, model
from illuminator_ros.cli.monitor import ros_graph as graph
from illuminator_ros.cli.monitor.run import parser
from illuminator_ros.illuminator.messages import IlluminatorStatus
from illuminator_ros.illuminator.model import ErrorFlag
from illuminator_ros.illuminator.ros.diagnostics import FLAG_LEVELS
from illuminator_ros.illuminator.ros.parameters import DEVICE_PARAMETERS, LIGHT_PARAMETERS
from illuminator_ros.mavlink.messages import CommandAck, ComponentInformationBasic, MavCmd
from illuminator_ros.ros.parameters import LINK_PARAMETERS as SHARED_PARAMETERS
from illuminator_ros.ros.parameters import ParameterSpec
import pytest
from rclpy.qos import DurabilityPolicy, ReliabilityPolicy
from support.light import eventually
from support.ros import Ros
from support.tables import table
import yaml

ROOT = Path(__file__).resolve().parents[2]
README = (ROOT / 'README.md').read_text()
YAML = (ROOT / 'config' / 'bridge.yaml').read_text()
REFERENCE, PROTOCOL, MONITOR, BEAM, PERFORMANCE = (
    (ROOT / 'doc' / f'{page}.md').read_text()
    for page in ('reference', 'protocol', 'monitor', 'beam', 'performance'))
LINK_PARAMETERS = (*SHARED_PARAMETERS, *LIGHT_PARAMETERS)
PARAMETERS = (*LINK_PARAMETERS, *DEVICE_PARAMETERS)
LEVELS = {b'\0': 'OK', b'\1': 'WARN', b'\2': 'ERROR'}
QOS = {'state': (ReliabilityPolicy.RELIABLE, DurabilityPolicy.TRANSIENT_LOCAL),
       'stream': (ReliabilityPolicy.RELIABLE, DurabilityPolicy.VOLATILE)}
EVERY_NODE_HAS = re.compile('parameter|logger|type_description|rosout|clock')


def range_of(spec: ParameterSpec) -> str:
    """Return the values that a parameter may have, as the reference shows them."""
    return ', '.join(f'`{one}`' for one in spec.choices) or spec.shown_range


def meaning_of(spec: ParameterSpec) -> str:
    """Return the meaning of a parameter as tools show it, without choices and unit."""
    extra = spec.descriptor(read_only=False).additional_constraints
    return spec.description if not extra or spec.choices else f'{spec.description}; {extra}'


def test_the_reference_has_the_parameters_of_the_link() -> None:
    rows = [[cell.replace('`', '') for cell in cells]
            for cells in table(REFERENCE, 'parameter of the link')]

    assert rows == [[spec.name, spec.shown_default, range_of(spec).replace('`', ''), spec.unit,
                     meaning_of(spec)] for spec in LINK_PARAMETERS]


def test_the_reference_has_the_parameters_of_the_light() -> None:
    kinds = {float: 'double', str: 'string'}

    assert table(REFERENCE, 'parameter of the light') == [
        [f'`{spec.name}`', kinds[type(spec.default)], range_of(spec), spec.unit,
         meaning_of(spec)] for spec in DEVICE_PARAMETERS]


def test_the_parameter_file_has_each_link_parameter_with_its_default() -> None:
    given = yaml.safe_load(YAML)['/**']['ros__parameters']

    assert [(name, type(value), value) for name, value in given.items()] == [
        (spec.name, type(spec.default), spec.default) for spec in LINK_PARAMETERS]


@pytest.mark.parametrize('spec', PARAMETERS, ids=lambda spec: spec.name)
def test_parameter_file_and_help_have_each_parameter_with_its_unit(spec: ParameterSpec) -> None:
    limits = f'{range_of(spec)} {spec.unit}'.replace('`', '').strip()
    shown = re.escape(spec.description + (f' ({limits})' if limits else ''))
    unit = f'# {re.escape(spec.unit)}(,|$)' if spec.unit else ''

    assert re.search(rf'^  {spec.name} +.*{shown}$', usage(Executable()), re.MULTILINE)
    assert re.search(rf'^    (# )?{spec.name}: .+{unit}', YAML, re.MULTILINE)


def interface(node: Any) -> tuple[set[tuple[str, str]], ...]:
    """Return the topics that the bridge publishes, and the topics and services it accepts."""
    published, subscribed, served = ({
        (topic.replace('/illuminator/', '~/'), re.sub('/(msg|srv)/', '/', types[0]))
        for topic, types in getattr(node, f'get_{kind}_names_and_types_by_node')(
            'illuminator', '/') if not EVERY_NODE_HAS.search(topic)}
        for kind in ('publisher', 'subscriber', 'service'))
    return published, subscribed | served


@pytest.mark.parametrize('settings', [{'beam_range': 5.0}], scope='module')
def test_the_reference_has_the_topics_and_services_of_the_node(
    ros: Ros, shared_bridge: Any,
) -> None:
    node, page = ros.node, REFERENCE.replace('`', '')
    published = table(page, 'published')
    expected = {(topic, type_) for topic, type_, *_ in published}, {
        (name, type_) for name, type_, _ in table(page, 'accepted')}

    eventually(lambda: ('illuminator', '/') in node.get_node_names_and_namespaces())
    eventually(lambda: interface(node) == expected)

    for topic, _, quality, _ in published:
        [info] = node.get_publishers_info_by_topic(topic.replace('~', '/illuminator'))
        assert (info.qos_profile.reliability, info.qos_profile.durability) == QOS[quality], topic


def test_the_readme_names_the_topics_services_and_parameters_of_the_reference() -> None:
    names = re.findall(r'`([~/\w]+)`', README.partition('## Topics and services')[2].partition(
        '\n## ')[0].partition('- ')[2])

    assert names[:-len(DEVICE_PARAMETERS)] == [
        name.strip('`') for name, *_ in table(REFERENCE, 'published')] + sorted((
            name.strip('`') for name, *_ in table(REFERENCE, 'accepted')),
            key=lambda name: (name.startswith('~/cmd/'), 'brightness' in name, name))
    assert set(names[-len(DEVICE_PARAMETERS):]) == {spec.name for spec in DEVICE_PARAMETERS}


def test_the_readme_has_the_executables() -> None:
    package = ROOT / 'illuminator_ros'
    modules = {*(path.stem for path in package.glob('[!_]*.py')),
               *(path.parent.name for path in package.glob('*/__main__.py'))}

    assert {row[0].strip('`') for row in table(README, 'executable')} == modules


@pytest.mark.parametrize('message', [CommandAck, IlluminatorStatus, ComponentInformationBasic],
                         ids=lambda message: message.name)
def test_the_protocol_page_has_each_field_of_a_message(message: Any) -> None:
    fields: dict[str, set[str]] = {}
    name = ''
    for cells in table(PROTOCOL, 'message'):
        name = cells[0] or name
        fields.setdefault(name, set()).update(re.findall('`([^`]+)`', cells[1]))

    assert fields[message.name] == {field.name for field in dataclasses.fields(message)}


def test_the_protocol_page_has_each_command_and_error_flag() -> None:
    assert {cells[0] for cells in table(PROTOCOL, 'command')} == {
        f'MAV_CMD_{command.name} ({command.value})' for command in MavCmd}
    rows = {cells[0]: cells[1:] for cells in table(PROTOCOL, 'ILLUMINATOR_ERROR_FLAGS')}
    for flag in ErrorFlag:
        level, text = FLAG_LEVELS[flag]
        assert rows[f'{flag.name} ({flag.value})'] == [LEVELS[level], text]


def test_the_monitor_page_has_the_keys_states_and_limits_of_the_code() -> None:
    assert [(tuple(re.findall('`([^`]+)`', cells[0])), cells[1])
            for cells in table(MONITOR, 'key')] == [
                (keys, text) for keys, text, _ in key_bindings.BINDINGS]
    assert [cells[0] for cells in table(MONITOR, 'state')] == [
        f'`{state.value}`' for state in model.State]
    assert all(f'`{topic}`' in MONITOR for topic in graph.SIGNATURE)
    for text in (f'for {model.SILENCE:g} s', f'within {graph.ANSWER_LIMIT:g} s',
                 f'`--wait` {parser().get_default("wait"):g} s'):
        assert text in MONITOR
