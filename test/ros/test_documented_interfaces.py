# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The nodes as they run, compared with the pages, the SROS2 policies and the files in config/."""

from collections.abc import Iterator
import contextlib
from dataclasses import dataclass
from importlib import import_module
import json
from pathlib import Path
import re
import subprocess
from typing import Any
import xml.etree.ElementTree as ET

from diagnostic_msgs.msg import DiagnosticArray
from illuminator_ros.mavlink.link import Link
from illuminator_ros.rededge.input_states import Input
import pytest
from rcl_interfaces.srv import SetParameters
from rclpy.parameter import parameter_dict_from_yaml_file
from rclpy.qos import DurabilityPolicy, ReliabilityPolicy
from support.embedded import refusal
from support.gimbals import FakeManager, served_gimbals
from support.graph import Entity, interface
from support.light import Address, eventually, ServedLight
from support.ports import free_port
from support.processes import ended, python, ROOT
from support.ros import bridge_arguments, Parameters, Ros, STREAM
from support.tables import diagnostic_values, parameter_file, table
import yaml

CONFIG = ROOT / 'config'
ANALYZERS = yaml.safe_load(
    (CONFIG / 'diagnostics_aggregator.yaml').read_text())['/**']['ros__parameters']
JOYSTICK = parameter_file('joystick')
FOXGLOVE = json.loads((CONFIG / 'foxglove_layout.json').read_text())
PLOTJUGGLER = ET.parse(CONFIG / 'plotjuggler_layout.xml').getroot()
CURVES = [curve.attrib['name'] for curve in PLOTJUGGLER.iter('curve')]
PLOTS = [series['value'] for panel in FOXGLOVE['configById'].values()
         for series in panel.get('paths', [])]
# The rules of a policy, and the part of a node's interface that each names.
RULES = {('topic', 'publish'): 'publishers', ('topic', 'subscribe'): 'subscriptions',
         ('service', 'reply'): 'services', ('service', 'request'): 'clients'}
NUMBERS = {'boolean', 'float', 'double', 'uint32'}
SHOWN = {'brightness', 'temperature', 'connected', 'enabled', 'error_flags'}
SOURCES = ('safety', 'operator', 'autonomy')
OF_EVERY_NODE = re.compile('parameter|logger|type_description|rosout|/clock$')
# Services that an operator does not need, and topics that each node has.
INTERNAL = {'get_logger_levels', 'set_logger_levels', 'get_type_description'}
OF_OPERATOR = {'/clock', '/parameter_events', '/rosout'}
OF_DRIVER = {'/gimbal/fix', *(f'/gimbal_manager/{topic}' for topic in (
    'device/attitude', 'device/setpoint', 'fix', 'imu', 'odometry'))}
QOS = {'state': (ReliabilityPolicy.RELIABLE, DurabilityPolicy.TRANSIENT_LOCAL),
       'stream': (ReliabilityPolicy.RELIABLE, DurabilityPolicy.VOLATILE)}
STATUSES = {
    'lights': {f'{node}: {part}' for node in ('illuminator', 'illuminator_1_244')
               for part in ('link', 'lamp')},
    'gimbals': {'gimbal: link', 'gimbal: device', 'gimbal_1_155: device',
                'gimbal_manager: link', 'gimbal_manager: device', 'gimbal_manager: manager'},
    'cameras': {'rededge: link', 'rededge: camera'}}


@dataclass(frozen=True)
class Node:
    """
    A node with all options of its interface.

    :param tables: the tables with its topics and services: page and heading.
    :param parameters: the parameters that it is started with.
    :param operator: the node that its policy permits to use it.
    """

    tables: tuple[tuple[str, str], ...]
    parameters: dict[str, Any]
    operator: str

    @property
    def rows(self) -> list[list[str]]:
        """Return the rows of its tables, without backquotes."""
        found = [row for page, heading in self.tables for row in table(
            (ROOT / 'doc' / f'{page}.md').read_text().replace('`', ''), heading)]
        return [row for row in found if '/NAME/' not in row[0]] + [
            [row[0].replace('NAME', source), *row[1:]]
            for row in found for source in (*SOURCES, 'default')
            if '/NAME/' in row[0] and (source != 'default' or 'release' in row[0])]


ACCEPTED = ('published', 'accepted', 'of a source')
OF_GIMBAL = tuple(('gimbal', heading) for heading in ACCEPTED)
OF_MANAGER = tuple(('gimbal_manager', f'{heading} by the manager')
                   for heading in ('published', 'subscribed'))
WITH_SOURCES = {'sources': f'[{", ".join(SOURCES)}]'}
NODES = {
    'illuminator': Node(tuple(('reference', heading) for heading in ACCEPTED), {
        **WITH_SOURCES, 'beam_range': 5.0, 'target_component': 243}, 'operator'),
    'gimbal': Node(OF_GIMBAL, WITH_SOURCES, 'gimbal_operator'),
    'gimbal_manager': Node((*OF_GIMBAL, *OF_MANAGER), {
        **WITH_SOURCES, 'gimbal_device_id': 1}, 'gimbal_manager_operator'),
    'rededge': Node(tuple(('rededge', heading) for heading in (
        'subscribed', 'published', 'service')), {}, 'rededge_operator'),
}
each_node = pytest.mark.parametrize('name', NODES)


@dataclass(frozen=True)
class Running:
    """The interfaces of all nodes, their diagnostics, and the QoS of their publishers."""

    interfaces: dict[str, Entity]
    reported: dict[str, set[str]]
    qos: dict[str, tuple[ReliabilityPolicy, DurabilityPolicy]]

    @property
    def topics(self) -> dict[str, str]:
        """Return the types of all published topics."""
        return {topic: type_ for one in self.interfaces.values()
                for topic, type_ in one.publishers.items()}


@pytest.fixture(scope='module')
def running(ros: Ros) -> Iterator[Running]:
    """Run all nodes, two lights and two gimbals, by the clock of the machine."""
    ports = {name: free_port() for name in NODES}
    with contextlib.ExitStack() as stack:
        for name, node in NODES.items():
            module = name if name == 'rededge' else 'bridge'
            stack.enter_context(ended(python(
                f'illuminator_ros.{module}', *bridge_arguments(
                    ports[name], '-r', f'__node:={name}', payloads=f'[{name}]',
                    use_sim_time=True, diagnostics_period=0.1, **node.parameters),
                env={'ROS_DOMAIN_ID': str(ros.domain)})))
        for component in (243, 244):
            stack.enter_context(ServedLight(
                ports['illuminator'], Address(1, component), link=Link))
        stack.enter_context(served_gimbals(
            ports['gimbal'], FakeManager(), FakeManager(device_id=155)))
        recorder, reported = ros.subscribe(DiagnosticArray, '/diagnostics', STREAM), {}

        def all_report() -> bool:
            arrays = recorder.messages
            recorder.clear()
            reported.update({
                status.name: {'level', *(value.key for value in status.values)}
                for array in arrays for status in array.status})
            return set().union(*STATUSES.values()) <= reported.keys()
        eventually(all_report)
        interfaces = {name: interface(ros, name, [
            row[0].replace('~', f'/{name}') for row in node.rows]) for name, node in NODES.items()}
        infos = {topic: ros.node.get_publishers_info_by_topic(topic)[0].qos_profile
                 for one in interfaces.values() for topic in one.publishers}
        yield Running(interfaces, reported, {
            topic: (qos.reliability, qos.durability) for topic, qos in infos.items()})


def own_names(name: str, running: Running) -> dict[str, str]:
    """Return the topics and services of a node, and their types, as pages write them."""
    offered = running.interfaces[name]
    return {
        one.replace(f'/{name}/', '~/'): re.sub('/(msg|srv)/', '/', type_)
        for one, type_ in (offered.publishers | offered.subscriptions | offered.services).items()
        if not OF_EVERY_NODE.search(one) or one == '/rededge/time_reference'}


@each_node
def test_page_has_the_topics_and_services_of_the_node(name: str, running: Running) -> None:
    rows = NODES[name].rows

    assert own_names(name, running) == {topic: type_ for topic, type_, *_ in rows}
    for topic, _, quality, *_ in rows:
        if quality in QOS:
            assert running.qos[topic.replace('~', f'/{name}')] == QOS[quality], topic


def test_pages_have_each_value_of_the_diagnostics_of_all_nodes(running: Running) -> None:
    documented = {part: diagnostic_values(page, f'{node}: {part}') for page, node, part in (
        ('protocol', 'illuminator', 'link'), ('protocol', 'illuminator', 'lamp'),
        ('gimbal', 'gimbal', 'device'), ('gimbal_manager', 'gimbal_manager', 'manager'),
        ('rededge', 'rededge', 'camera'))}
    inputs = '|'.join(sorted((name.value for name in Input), reverse=True))

    for status, keys in running.reported.items():
        node, _, part = status.partition(': ')
        names = {re.sub(rf'^({inputs})(?=_|$)', 'INPUT', key) if part == 'camera' else
                 key.replace('gimbals', 'lights') for key in keys}
        assert names <= {*documented[part], 'level', 'node'}, status


@each_node
def test_dump_of_the_parameters_of_a_node_can_be_loaded_again(
    ros: Ros, running: Running, name: str, tmp_path: Path,
) -> None:
    """As by ``ros2 param dump`` and ``ros2 param load``."""
    node, file = Parameters(ros, f'/{name}'), tmp_path / 'dump.yaml'
    names = node.names()
    file.write_text(yaml.safe_dump({f'/{name}': {
        'ros__parameters': dict(zip(names, node.get(*names), strict=True))}}))
    loaded = parameter_dict_from_yaml_file(str(file), target_nodes=[f'/{name}'])

    results = node.start(
        SetParameters, 'set_parameters', parameters=[*loaded.values()]).result().results

    assert {*loaded} == {*names} and 'use_sim_time' in names
    assert [(name, one.reason) for name, one in zip(loaded, results, strict=True)
            if not one.successful] == []


def permitted(policy: str, node: str, element: str, action: str) -> list[str]:
    """Return the full names that a policy permits a node to use."""
    root = ET.parse(CONFIG / 'sros2' / f'{policy}.policy.xml').getroot()
    [profile] = [one for one in root.iter('profile') if one.attrib['node'] == node]
    rules = [rule for rule in profile if action in rule.attrib]
    assert all(rule.attrib == {action: 'ALLOW'} for rule in rules)
    return sorted(str(name.text).replace('~', f'/{node}')
                  for rule in rules for name in rule.iter(element))


@pytest.mark.parametrize(('rule', 'part'), RULES.items(), ids=RULES.values())
@each_node
def test_policy_permits_the_node_its_interface_and_nothing_else(
    running: Running, name: str, rule: tuple[str, str], part: str,
) -> None:
    assert permitted(name, name, *rule) == sorted(getattr(running.interfaces[name], part))


@each_node
def test_policy_permits_the_operator_all_that_the_node_offers_but_its_internals(
    running: Running, name: str,
) -> None:
    offered, operator = running.interfaces[name], NODES[name].operator
    # The vehicle and the driver of a gimbal use these.
    others = OF_OPERATOR | OF_DRIVER

    assert {*permitted(name, operator, 'topic', 'subscribe')} - OF_OPERATOR == (
        set(offered.publishers) - others)
    assert {*permitted(name, operator, 'topic', 'publish')} - OF_OPERATOR == (
        set(offered.subscriptions) - others)
    assert {*permitted(name, operator, 'service', 'request')} == {
        service for service in offered.services if service.rpartition('/')[2] not in INTERNAL}


@pytest.mark.parametrize('file', ['sources', 'gimbal_sources'])
def test_example_of_sources_has_parameters_that_the_bridge_accepts(
    own_ros: Ros, file: str,
) -> None:
    given = parameter_file(file)

    assert {*SOURCES} <= {*given['sources']}
    assert file == 'gimbal_sources' or refusal(own_ros.context, **given) == ''


def field_type(message: str, path: list[str]) -> str:
    """Return the type of a field of a message."""
    package, _, name = message.split('/')
    fields = getattr(import_module(f'{package}.msg'), name).get_fields_and_field_types()
    kind: str = fields[path[0]]
    return field_type(kind.replace('/', '/msg/'), path[1:]) if path[1:] else kind


def test_foxglove_layout_plots_published_fields(running: Running) -> None:
    for path in PLOTS:
        topic, *fields = path.split('.')
        assert field_type(running.topics[topic], fields) in NUMBERS | {'string'}, path
    assert {path.split('.')[0].removeprefix('/illuminator/') for path in PLOTS} >= {*SHOWN, 'mode'}
    assert {path.split('/')[1] for path in PLOTS} == {'illuminator', 'gimbal', 'rededge'}
    for panel in FOXGLOVE['configById'].values():
        for topic in filter(None, [*panel.get('topics', {}), panel.get('topicToRender')]):
            assert topic in running.topics


def test_bag_qos_has_the_latched_topics_of_all_nodes(running: Running) -> None:
    profiles = yaml.safe_load((CONFIG / 'bag_qos.yaml').read_text())

    latched = {topic for topic, (_, durability) in running.qos.items()
               if durability is DurabilityPolicy.TRANSIENT_LOCAL}
    # publish_tf is off here; each node has the other one, whose QoS is that of ROS.
    assert {*profiles} == latched - {'/rosout'} | {'/tf_static'}


def test_plotjuggler_layout_selects_and_plots_published_numbers(running: Running) -> None:
    diagnosed = {f'{name}/{key}' for name, keys in running.reported.items() for key in keys}

    for curve in CURVES:
        if curve.startswith('/diagnostics/'):
            # PlotJuggler names the values TOPIC/HARDWARE_ID/NAME/KEY.
            _, _, key = curve.rpartition('/illuminator: ')
            assert f'illuminator: {key}' in diagnosed
        else:
            [topic] = [one for one in running.topics if curve.startswith(f'{one}/')]
            fields = curve.removeprefix(f'{topic}/').split('/')
            assert field_type(running.topics[topic], fields) in NUMBERS
    assert {name.split('/')[2] for name in CURVES if name.startswith('/illuminator/')} >= SHOWN


def test_joystick_commands_are_topics_of_the_bridge_and_the_axis_covers_0_to_100_percent(
    running: Running,
) -> None:
    accepted = running.interfaces['illuminator'].subscriptions
    for command in JOYSTICK.values():
        assert command['type'] == 'topic'
        assert accepted['/' + command['topic_name']] == command['interface_type']
    # joy_teleop publishes axis * scale + offset, and refuses an integer for a Float32.
    mapping = JOYSTICK['dim']['axis_mappings']['data']
    assert [axis * mapping['scale'] + mapping['offset'] for axis in (-1, 0, 1)] == [0, 50, 100]
    assert {type(mapping['scale']), type(mapping['offset'])} == {float}
    values = {name: command['message_value']['data']['value']
              for name, command in JOYSTICK.items() if 'message_value' in command}
    assert values == {'switch_on': True, 'switch_off': False}
    assert [len(JOYSTICK[name]['deadman_buttons']) for name in values] == [2, 1]


def groups(status: str) -> list[str]:
    """Return the groups of the aggregator that take a status."""
    # GenericAnalyzer::match compares the published names in this way.
    return [name for name, one in ANALYZERS.items()
            if any(re.fullmatch(pattern, status) for pattern in one['regex'])]


@pytest.mark.parametrize(('file', 'name'), [
    ('bag_qos.yaml', '^/\\w+/'), ('foxglove_layout.json', '"/(?!diag)\\w+/'),
    ('plotjuggler_layout.xml', '(?<=[";/])/?(?:illuminator|uav1/illuminator)[/:]')])
def test_commands_of_the_ros_page_give_the_files_of_tools_for_a_namespace(
        file: str, name: str) -> None:
    [command] = re.findall(rf'^(sed .* {file}) >', (ROOT / 'doc/ros.md').read_text(), re.MULTILINE)
    made = subprocess.run(command, shell=True, cwd=CONFIG, check=True, capture_output=True,
                          text=True).stdout
    before, after = (re.findall(name, text, re.MULTILINE)
                     for text in ((CONFIG / file).read_text(), made))

    assert len(before) == len(after) > 0
    assert all('uav1/' in one for one in after)


def test_aggregator_takes_each_status_of_all_devices_and_no_others(running: Running) -> None:
    for namespace in ('', 'uav1/', 'fleet/uav1/'):
        assert {group: {name for name in names if groups(namespace + name) == [group]}
                for group, names in STATUSES.items()} == STATUSES
    assert all(map(groups, running.reported))
    assert set(ANALYZERS['lights']['expected']) <= STATUSES['lights']
    assert not any(map(groups, (
        'illuminator_driver: link', 'illuminator: battery', 'my illuminator: lamp')))
    for analyzer in ANALYZERS.values():
        assert analyzer['type'] == 'diagnostic_aggregator/GenericAnalyzer'
        # A status is not stale between two publications with the default period, 1 s.
        assert analyzer['timeout'] > 3.0
