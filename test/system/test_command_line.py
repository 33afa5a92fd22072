# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The programs on the command line: help, version, wrong arguments, missing packages."""

from importlib import import_module
import os
from pathlib import Path
import platform
import re
import shlex
import sys

from illuminator_ros import __version__
from illuminator_ros.cli import entry_point
from illuminator_ros.cli.simulator.options import parser
from illuminator_ros.illuminator.ros.parameters import DEVICE_PARAMETERS, LIGHT_PARAMETERS
from illuminator_ros.ros.parameters import LINK_PARAMETERS
import pytest
from support.ports import free_port
from support.processes import python, ROOT, run

PROGRAMS = ('bridge', 'simulator', 'monitor', 'discover')
MONITOR_REMEDY = "PIP_BREAK_SYSTEM_PACKAGES=1 pip install 'textual>=8' 'textual-serve>=1.1'"
ROS_REMEDY = 'source the setup file of ROS 2, as in "source /opt/ros/jazzy/setup.bash"'


@pytest.mark.parametrize('name', PROGRAMS)
def test_help_has_examples_and_exit_statuses_and_the_version_is_the_package_s(name: str) -> None:
    outcomes = [run(f'illuminator_ros.{name}', option) for option in ('--help', '-h')]
    version = run(f'illuminator_ros.{name}', '--version')

    for outcome in outcomes:
        assert (outcome.returncode, outcome.stderr) == (0, '')
        assert outcome.stdout.startswith(f'usage: {name} ')
        assert 'examples:' in outcome.stdout
        assert re.findall(r'\b\d\b', outcome.stdout.partition('exit status:')[2]) == [*'012']
    assert (version.returncode, version.stdout) == (0, f'{__version__}\n')
    assert f'<version>{__version__}</version>' in (ROOT / 'package.xml').read_text()


def test_help_names_every_parameter_option_and_form_of_url() -> None:
    bridge, simulator = (run(f'illuminator_ros.{name}', '--help').stdout
                         for name in ('bridge', 'simulator'))

    assert max(map(len, bridge.splitlines())) < 132
    for spec in (*LINK_PARAMETERS, *LIGHT_PARAMETERS, *DEVICE_PARAMETERS):
        assert re.search(rf'^  {spec.name} .*{re.escape(spec.description)}', bridge, re.M)
        if isinstance(spec.default, float) and spec not in DEVICE_PARAMETERS:
            assert re.search(rf'^  {spec.name} +{spec.default} {spec.unit} ', bridge, re.M)
    for form in ('udp://', 'udpin://', 'udpout://', 'tcp://', 'tcp-l://', 'serial://',
                 '/dev/ttyUSB0,57600', 'udpin:', 'ros2 service call', 'ros2 param set',
                 '--log-level debug', '--log-level illuminator:=debug'):
        assert form in bridge
    # In the order in which a new user needs them.
    places = [bridge.index(text) for text in (
        'ros2 param set', 'illuminator:=debug', '--log-level debug', 'connection URLs',
        '\n  strobe_period ', '\n  connection_url ', 'exit status')]
    assert places == sorted(places)
    for action in parser()._actions:
        assert (action.option_strings or [action.dest])[-1] in simulator


# The arguments of a program, and the content of the line; KEYS is a folder of bad files.
@pytest.mark.parametrize(('name', 'arguments', 'text'), [
    ('bridge', '--banana', "unknown argument '--banana'; parameters and names follow --ros-args"),
    ('bridge', '--ros-args -p brightness:=60 -- udpin://127.0.0.1:1 more', "argument 'more'"),
    ('bridge', 'http://x', "unknown scheme 'http'"),
    ('bridge', 'brightness:=60', "'brightness:=60'; parameters and names follow --ros-args"),
    ('bridge', 'udpin://127.0.0.1:1 --ros-args -p connection_url:=udpin://127.0.0.1:2',
     "'udpin://127.0.0.1:2', but the argument is 'udpin://127.0.0.1:1': give one of them only"),
    *(('bridge', f'--ros-args {arguments}', text) for arguments, text in (
        ('-p brightness:=.nan', 'parameter brightness nan is not a finite number'),
        ('-p mavlink_version:=1',
         'parameter mavlink_version: 1, but illuminator needs 2; a link sends one version'),
        ('-p payloads:=[kite]', "parameter payloads: 'kite' is not one of illuminator"),
        ('-p signing_mode:=require -p signing_key_file:=KEYS/open',
         'can be read by others (mode 0644); make it private: chmod 600 KEYS/open'),
        ('--params-file /nonexistent.yaml', "params file: '--params-file /nonexistent.yaml'"),
        ('--params-file KEYS/broken.yaml', 'KEYS/broken.yaml'),
        ('--params-file KEYS/tab.yaml',
         'parameter file KEYS/tab.yaml, line 2: it begins with a tab; YAML takes spaces only'),
        # A pipe, as in --params-file <(...), is empty when it is read again.
        ('--params-file KEYS/pipe', 'parameter file KEYS/pipe: it is not a regular file'),
        ('--params-file KEYS', 'parameter file KEYS: it is not a regular file'),
        ('-p brightness', '-p brightness: write -p brightness:=VALUE'),
        ("-r __node:=spot -p 'names:=[\"1/244=spot\"]'",
         "parameter names: '1/244=spot' is the name of the first node"),
        ('-r __node:=1st', "Couldn't parse remap rule: '-r __node:=1st'"),
        (f'-r __node:={"a" * 230}', 'cannot create the node: Invalid service name: topic length'),
        ('-r ~/enable:=/x -r ~/refresh:=/x', 'cannot create the node: '),
        ('-r ~/enabled:=/x -r ~/mode:=/x', 'cannot create the node: '),
        ('-p max_brightness=40', '-p max_brightness=40: write -p max_brightness:=40'),
        ('-r ~/enable', '-r ~/enable: write -r ~/enable:=VALUE'),
        ('--banana', "wrong ROS arguments, see bridge --help: ['--banana']"),
        ('-p use_sim_time:=maybe',
         "cannot create the node: Trying to set parameter 'use_sim_time' to 'maybe'"))),
    ('rededge', 'udpin:nowhere', "connection URL 'udpin:nowhere'"),
    *(('rededge', f'--ros-args -p {arguments}', text) for arguments, text in (
        ('mavlink_version:=2', 'parameter mavlink_version: 2, but rededge needs 1'),
        ('payloads:=[rededge,illuminator]',
         'parameter mavlink_version: 1, but rededge needs 1, illuminator needs 2'),
        ('component_id:=100', 'parameter component_id: 100 is the id of the camera'))),
    *(('gimbal', f'--ros-args -p {arguments}', text) for arguments, text in (
        ('earth_frame:=base_link_stabilized', 'two different names'),
        ('payloads:=[illuminator,gimbal]', "payloads: two nodes would be called 'gimbal'"),
        ('payloads:=[gimbal,illuminator] -p gimbal:max_brightness:=30.0',
         'max_brightness is given for gimbal, but is a parameter of /illuminator'))),
    ('monitor', '--banana', 'unrecognized arguments: --banana'),
    ('monitor', '--ros-args --banana', "wrong ROS arguments, see monitor --help: ['--banana']"),
    ('monitor', '--ros-args -r 1st:=x', "Couldn't parse remap rule: '-r 1st:=x'"),
    ('monitor', '--ros-args --params-file KEYS/pipe',
     'parameter file KEYS/pipe: it is not a regular file'),
    ('discover', 'http://x', "unknown scheme 'http'"),
    *((program, 'serial://auto', 'only the nodes and conformance look for a device')
      for program in ('discover', 'simulator')),
    ('discover', '--seconds 0', '--seconds: 0 is outside 1 to 3600'),
    ('simulator', '--banana', 'unrecognized arguments: --banana'),
    ('simulator', 'udpin://127.0.0.1:0', 'port 0 is outside 1..65535'),
    ('simulator', '--count 0', 'argument --count: 0 is outside 1 to 200'),
    ('simulator', '--status-interval nan', '--status-interval: nan is outside 0 to 3600'),
    ('simulator', '--mavlink-version 1', '--mavlink-version 1: a light needs MAVLink 2'),
    ('simulator', '--payload rededge,gimbal', 'a gimbal needs MAVLink 2: a link sends'),
    ('simulator', '--payload rededge --images /nowhere/x', '/nowhere/x: No such file'),
    ('simulator', '--signing-mode require', '--signing-key-file: no key file is given'),
    ('simulator', '--signing-key-file /etc/hostname',
     '--signing-key-file: a key file is given, but the signing mode is off'),
    ('simulator', '--signing-mode sign --signing-key-file /nonexistent',
     "--signing-key-file: key file '/nonexistent': No such file or directory"),
])
def test_wrong_argument_is_one_line_with_status_2(
    domain: int, tmp_path: Path, name: str, arguments: str, text: str,
) -> None:
    (tmp_path / 'open').write_text('a long passphrase')
    (tmp_path / 'open').chmod(0o644)
    (tmp_path / 'broken.yaml').write_text('illuminator: [')
    (tmp_path / 'tab.yaml').write_text('illuminator:\n\tros__parameters: {brightness: 5.0}\n')
    os.mkfifo(tmp_path / 'pipe')
    outcome = run(f'illuminator_ros.{name}', *shlex.split(
        arguments.replace('KEYS', str(tmp_path))), env={'ROS_DOMAIN_ID': str(domain)})

    # rcl may print a warning first.
    [line] = [line for line in outcome.stderr.splitlines() if not line.startswith('[WARN]')]
    assert line.startswith(f'{name}: ')
    assert text.replace('KEYS', str(tmp_path)) in line
    assert (outcome.returncode, outcome.stdout) == (2, '')


@pytest.mark.parametrize(('command', 'package', 'remedy'), [
    ('bridge', 'rclpy', ROS_REMEDY), ('monitor --web', 'textual_serve', MONITOR_REMEDY),
    ('bridge --ros-args -p beam_range:=5.0', 'visualization_msgs',
     'sudo apt install ros-jazzy-visualization-msgs'),
    ('discover', 'fastcrc', 'pip install fastcrc'),
])
def test_missing_package_is_one_line_with_its_remedy_and_status_1(
    command: str, package: str, remedy: str, tmp_path: Path,
) -> None:
    name, *arguments = command.split()
    outcome = run(f'illuminator_ros.{name}', *arguments, env=lacking(package, tmp_path))

    assert (outcome.returncode, outcome.stderr) == (
        1, f'{name}: {package} is not installed: {remedy}\n')


PYMAVLINK = 'pymavlink', '2.4.49', '2.4.50', "pip install 'pymavlink>=2.4.50'"
RCLPY = 'rclpy', '3.3.9', '7.1', 'install ROS 2 Jazzy or newer'


@pytest.mark.parametrize(('command', 'package'), [
    ('conformance udpin://:1', PYMAVLINK), ('bridge --help', PYMAVLINK), ('bridge', RCLPY),
    ('monitor --web', ('textual_serve', '1.0', '1.1', MONITOR_REMEDY))])
def test_old_package_is_one_line_with_its_version_and_remedy_and_status_1(
    command: str, package: tuple[str, str, str, str], tmp_path: Path,
) -> None:
    name, version, oldest, remedy = package
    for folder in ('', 'dialects', 'dialects/v20') if name == 'pymavlink' else ('',):
        (tmp_path / name / folder).mkdir()
        (tmp_path / name / folder / '__init__.py').touch()
    if name == 'pymavlink':
        (tmp_path / name / 'dialects/v20/ardupilotmega.py').touch()
    information = tmp_path / f'{name}-{version}.dist-info'
    information.mkdir()
    (information / 'METADATA').write_text(
        f'Metadata-Version: 2.1\nName: {name}\nVersion: {version}\n')
    program, *arguments = command.split()
    outcome = run(f'illuminator_ros.{program}', *arguments, env={
        'PYTHONPATH': f'{tmp_path}:{ROOT}'})

    assert (outcome.returncode, outcome.stderr) == (
        1, f'{program}: {name} {version} is too old; {oldest} or newer is needed: {remedy}\n')


@pytest.mark.parametrize(('package', 'remedy'), [
    ('pymavlink', "pip install 'pymavlink>=2.4.50'"),
    ('yaml', 'sudo apt install python3-yaml, or pip install pyyaml'), ('textual', MONITOR_REMEDY)])
def test_each_missing_package_has_a_remedy(
    package: str, remedy: str, monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setitem(sys.modules, package, None)

    assert entry_point.explained('bridge', lambda: bool(import_module(package))) == 1

    assert capsys.readouterr().err == f'bridge: {package} is not installed: {remedy}\n'


def test_old_python_is_one_line_with_its_version_and_status_1(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setattr(entry_point, 'OLDEST_PYTHON', (99, 1))

    assert entry_point.explained('bridge', lambda: 0) == 1

    version = platform.python_version()
    assert capsys.readouterr().err == (
        f'bridge: Python {version} is too old; 99.1 or newer is needed\n')


@pytest.mark.parametrize(('program', 'option', 'unbuffered'), [
    ('bridge', '--help', ''), ('simulator', '--version', '1')])
def test_help_that_cannot_be_written_is_one_line_with_status_1(
    program: str, option: str, unbuffered: str,
) -> None:
    outcome = run(f'illuminator_ros.{program}', option, redirection='> /dev/full',
                  env={'PYTHONUNBUFFERED': unbuffered})

    assert (outcome.returncode, outcome.stderr) == (
        1, f'{program}: standard output: No space left on device\n')


@pytest.mark.parametrize(('program', 'option'), [
    ('bridge', '--version'), ('conformance', '--list')])
def test_a_text_that_is_asked_for_needs_standard_output(program: str, option: str) -> None:
    outcome = run(f'illuminator_ros.{program}', option, redirection='>&-')

    assert (outcome.returncode, outcome.stderr) == (
        1, f'{program}: standard output is closed\n')


@pytest.mark.parametrize(('program', 'option'), [
    ('bridge', '--hel'), ('simulator', '--payl=rededge'), ('conformance', '--payl=rededge'),
    ('monitor', '--versio')])
def test_an_abbreviated_option_is_refused_with_status_2(program: str, option: str) -> None:
    outcome = run(f'illuminator_ros.{program}', option)

    assert (outcome.returncode, outcome.stdout) == (2, '')
    assert option in outcome.stderr


@pytest.mark.parametrize(('name', 'output'), [
    ('simulator', 'link open'), ('conformance --wait 0.1', 'no light was heard within')])
def test_tool_for_makers_of_lights_needs_only_what_pip_installs(
    tmp_path: Path, name: str, output: str,
) -> None:
    name, *arguments = name.split()
    program = python(f'illuminator_ros.{name}', f'udpin://127.0.0.1:{free_port()}', *arguments,
                     env=lacking('rclpy std_msgs yaml serial', tmp_path))
    try:
        program.wait_for(output)
    finally:
        program.kill()


def lacking(packages: str, directory: Path) -> dict[str, str]:
    """Return the environment of a program on a machine that lacks packages."""
    (directory / 'sitecustomize.py').write_text(
        f'import sys\nsys.modules.update(dict.fromkeys({packages.split()}))\n')
    return {'PYTHONPATH': f'{directory}:{ROOT}'}
