# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The launch files: their arguments and names, compared with the programs and doc/ros.md."""

from functools import partial
from pathlib import Path
import re
import xml.etree.ElementTree as ET

from illuminator_ros.cli import bridge
from illuminator_ros.cli.payloads import PAYLOADS
from illuminator_ros.cli.simulator.options import parser
from illuminator_ros.illuminator.ros.parameters import LIGHT_PARAMETERS
from illuminator_ros.illuminator.simulated_properties import PROFILES
from illuminator_ros.rededge.input_states import Input
from illuminator_ros.ros.parameters import LINK_PARAMETERS
import pytest
import yaml

ROOT = Path(__file__).parents[1]
FILES = {path.name: ET.parse(path).getroot()
         for path in sorted((ROOT / 'launch').glob('*.launch.xml'))}
EVERY = pytest.mark.parametrize('launch', FILES.values(), ids=FILES)

OURS = 'illuminator_ros'
PAGE = (ROOT / 'doc' / 'ros.md').read_text()
FOREIGN = {'joy': {'joy_node'}, 'joy_teleop': {'joy_teleop'}}


def texts(launch: ET.Element) -> list[str]:
    """Return all texts that may hold substitutions."""
    return [value for element in launch.iter() for value in element.attrib.values()]


def declared(launch: ET.Element) -> list[str]:
    """Return the names of the arguments of a launch file."""
    return [argument.attrib['name'] for argument in launch.findall('arg')]


def executables() -> set[str]:
    """Return the names that setup.py installs."""
    return {*(path.stem for path in (ROOT / OURS / 'cli').iterdir()),
            *(name for name, value in vars(bridge).items() if isinstance(value, partial))}


@EVERY
def test_each_node_is_in_the_namespace(launch: ET.Element) -> None:
    assert {node.attrib.get('namespace') for node in launch.findall('node')} <= {
        '$(var namespace)'}


@pytest.mark.parametrize('name', FILES)
def test_launch_reads_the_file(name: str) -> None:
    frontend = pytest.importorskip('launch.frontend', reason='launch comes with ROS only')
    for plugin in ('launch_xml', 'launch_ros'):
        pytest.importorskip(plugin, reason='launch comes with ROS only')

    root, parser = frontend.Parser.load(str(ROOT / 'launch' / name))
    arguments = parser.parse_description(root).get_launch_arguments()

    assert [argument.name for argument in arguments] == declared(FILES[name])


@EVERY
def test_each_variable_is_declared_before_it_is_used(launch: ET.Element) -> None:
    known: set[str] = set()
    for element in launch:
        for part in element.iter():
            for text in part.attrib.values():
                assert set(re.findall(r'\$\(var ([^)]*)\)', text)) <= known, text
        if element.tag in ('arg', 'let'):
            known.add(element.attrib['name'])


@EVERY
def test_executables_are_installed(launch: ET.Element) -> None:
    defaults = {f'$(var {argument.attrib["name"]})': argument.attrib['default']
                for argument in launch.findall('arg')}
    started = [(node.attrib['pkg'], defaults.get(node.attrib['exec'], node.attrib['exec']))
               for node in launch.findall('node')]
    started += [(OURS, argument.attrib['value']) for argument in launch.findall('include/arg')
                if argument.attrib['name'] == 'executable']
    for executable in launch.findall('executable'):
        if executable.attrib['cmd'].startswith('$(var '):
            # The user's own program.
            continue
        names = re.findall(r'\$\(exec-in-pkg (\w+) (\w+)\)', executable.attrib['cmd'])
        started += [(package, name) for name, package in names]
        assert names
    for package, name in started:
        assert name in {OURS: executables(), **FOREIGN}[package]


@EVERY
def test_named_file_is_installed(launch: ET.Element) -> None:
    for text in texts(launch):
        text = text.replace(f'$(find-pkg-share {OURS})', str(ROOT))
        text = text.replace('$(dirname)', str(ROOT / 'launch'))
        if text.startswith(str(ROOT)):
            assert Path(text).is_file()
        assert '$(find-pkg-share' not in text


@EVERY
def test_included_file_declares_the_arguments_given_to_it(launch: ET.Element) -> None:
    for include in launch.findall('include'):
        included = FILES[Path(include.attrib['file']).name]
        given = {argument.attrib['name'] for argument in include.findall('arg')}
        assert given <= set(declared(included))


@EVERY
def test_each_node_is_restarted_where_respawn_is_true(launch: ET.Element) -> None:
    [respawn] = [one for one in launch.findall('arg') if one.attrib['name'] == 'respawn']

    assert respawn.attrib['default'] == 'false'
    assert [choice.attrib['value'] for choice in respawn.findall('choice')] == ['true', 'false']
    assert {(node.attrib['respawn'], node.attrib['respawn_delay'])
            for node in launch.iter('node')} <= {('$(var respawn)', '2.0')}


def test_each_input_of_the_camera_may_be_any_topic() -> None:
    launch = FILES['rededge.launch.xml']
    # By default a topic keeps its name.
    given = {argument.attrib['name'] for argument in launch.findall('arg')
             if argument.attrib.get('default', '') == f'~/{argument.attrib["name"]}'}
    remapped = {remap.attrib['from']: remap.attrib['to'] for remap in launch.iter('set_remap')}

    assert given == {one.value for one in Input}
    assert remapped == {f'~/{name}': f'$(var {name})' for name in given}


def test_parameter_of_the_bridge_exists_with_that_type() -> None:
    known = {spec.name: spec for spec in (*LINK_PARAMETERS, *LIGHT_PARAMETERS)}
    given = [param.attrib for param in FILES['bridge.launch.xml'].iterfind('node/param')]
    assert given
    for param in given:
        assert type(known[param['name']].default).__name__ == param['type']
    for node in FILES['bridge.launch.xml'].findall('node'):
        for name in re.findall(r'-p (\w+):=', node.attrib['ros_args']):
            assert name in known


def test_gimbal_on_the_link_of_the_light_is_a_payload_of_its_bridge() -> None:
    # A list of launch_ros becomes a tuple in the ROS argument; a string in quotes stays as it is.
    given = [yaml.safe_load(one.attrib['value'])
             for one in FILES['vehicle.launch.xml'].iter('set_parameter')
             if one.attrib['name'] == 'payloads']

    assert [yaml.safe_load(one) for one in given] == [
        ['illuminator', 'gimbal'], ['illuminator', 'gimbal_manager']]
    assert all(one in PAYLOADS for value in given for one in yaml.safe_load(value))


def test_simulator_accepts_the_arguments_of_the_demonstration() -> None:
    [simulator] = FILES['demo.launch.xml'].findall('executable')
    defaults = {argument.attrib['name']: argument.attrib['default']
                for argument in FILES['demo.launch.xml'].findall('arg')}
    command = re.sub(r'\$\(var (\w+)\)', lambda name: defaults[name[1]],
                     simulator.attrib['cmd'])
    options = parser().parse_args(command.partition(f'{OURS}) ')[2].split())
    assert (options.url, options.count) == ('udpout://127.0.0.1:14590', 1)
    [profile] = [argument.attrib['description'] for argument
                 in FILES['demo.launch.xml'].findall('arg')
                 if argument.attrib['name'] == 'profile']
    assert set(re.findall(r'\w+', profile.partition(':')[2])) - {'or'} == set(PROFILES)


def test_joystick_launch_file_remaps_each_topic_of_its_configuration() -> None:
    content = yaml.safe_load((ROOT / 'config' / 'joystick.yaml').read_text())
    used = {command['topic_name'] for command in content['/**']['ros__parameters'].values()}
    remapped = {remap.attrib['from']: remap.attrib['to']
                for remap in FILES['joystick.launch.xml'].iter('remap')}
    assert set(remapped) == used
    for before, after in remapped.items():
        assert after == before.replace('illuminator/', '$(var name)/$(var source)')


def test_page_names_each_installed_file() -> None:
    named = set(re.findall(r'\$SHARE/config/([\w/.@]+)', PAGE))
    assert named == {str(path.relative_to(ROOT / 'config'))
                     for path in (ROOT / 'config').rglob('*') if path.is_file()}
    assert set(re.findall(r'ros2 launch illuminator_ros (\S+)', PAGE)) == set(FILES)


def test_each_link_of_a_vehicle_has_its_section_in_the_parameter_file() -> None:
    sections = yaml.safe_load((ROOT / 'config' / 'vehicle.yaml').read_text())
    included = [FILES[Path(include.attrib['file']).name]
                for include in FILES['vehicle.launch.xml'].iterfind('group/include')]
    names = [one.attrib['default'] for launch in included for one in launch.findall('arg')
             if one.attrib['name'] == 'name']

    assert [*sections] == [f'/**/{name}' for name in names]
    for section in sections.values():
        assert 'connection_url' in section['ros__parameters']
