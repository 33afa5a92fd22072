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

"""What the node cannot start with ends it with status 2 and one line that says what is wrong."""

from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
import re
import subprocess
from typing import Any

from illuminator_ros.cli.payloads import PAYLOADS
from illuminator_ros.ros.bridge import Bridge
from illuminator_ros.ros.node import PayloadNode
from illuminator_ros.ros.parameters import ParameterError
import pytest
from rclpy.parameter import Parameter
from support.ports import free_port
from support.processes import run
from support.ros import own_domain, Ros, running_bridge

# Each: the arguments behind --ros-args, and what the line says. KEYS is a folder with key files.
WRONG: dict[str, tuple[tuple[str, ...], str]] = {
    'a number that is NaN': (
        ('-p', 'brightness:=.nan'), 'parameter brightness nan is not a finite number'),
    'a number out of range': (
        ('-p', 'brightness:=101'), 'parameter brightness 101 % is out of range: 0 to 100 %'),
    'a string for a number': (
        ('-p', 'brightness:=bright'), "parameter brightness 'bright' is not a number"),
    'a mode that is none': (
        ('-p', 'mode:=disco'), "mode 'disco' is none of internal_control, external_sync"),
    'a URL of an unknown kind': (
        ('-p', 'connection_url:=http://x'),
        "parameter connection_url: connection URL 'http://x': unknown scheme 'http'"),
    'a name without ids': (
        ('-p', 'names:=[belly]'), "parameter names: 'belly' is not of the form 1/244=belly"),
    'a key without signing': (
        ('-p', 'signing_key_file:=KEYS/open'),
        'parameter signing_key_file: is given, but signing_mode is off'),
    'a name with ids that are none': (
        ('-p', 'names:=["²/244=x"]'), "parameter names: '²/244=x' is not of the form"),
    'names that are numbers': (('-p', 'names:=[1]'), 'parameter names: 1 is not of the form'),
    'an unknown signing mode': (
        ('-p', 'signing_mode:=maybe'),
        "parameter signing_mode: 'maybe' is none of off, sign, require"),
    'a key file that is missing': (
        ('-p', 'signing_mode:=sign', '-p', 'signing_key_file:=KEYS/none'),
        "KEYS/none': No such file or directory"),
    'a key that others can read': (
        ('-p', 'signing_mode:=require', '-p', 'signing_key_file:=KEYS/open'),
        'can be read by others (mode 0644); make it private: chmod 600 KEYS/open'),
    'a parameter file that is missing': (
        ('--params-file', '/nonexistent.yaml'), "params file: '--params-file /nonexistent.yaml'"),
    'a parameter file that is no YAML': (
        ('--params-file', 'KEYS/broken.yaml'), 'KEYS/broken.yaml'),
    'a parameter without a value': (
        ('-p', 'brightness'), "Couldn't parse parameter override rule: '-p brightness'"),
    'a node name that is none': (
        ('-r', '__node:=1st'), "Couldn't parse remap rule: '-r __node:=1st'"),
    'an unknown ROS argument': (
        ('--banana',), "wrong ROS arguments: ['--banana']"),
    'a clock setting of the wrong type': (
        ('-p', 'use_sim_time:=maybe'), "Trying to set parameter 'use_sim_time' to 'maybe'"),
}


# s; the first test waits for a program to be started for each of them.
pytestmark = pytest.mark.timeout(300)


@pytest.fixture(scope='module')
def keys(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with files that cannot be used."""
    folder = tmp_path_factory.mktemp('keys')
    (folder / 'open').write_text('a long passphrase')
    (folder / 'open').chmod(0o644)
    (folder / 'broken.yaml').write_text('illuminator: [')
    return folder


@pytest.fixture(scope='module')
def outcomes(keys: Path) -> Iterator[dict[str, Any]]:
    """Run the bridge with each of the wrong arguments, two at a time; return what came of it."""
    def start(arguments: tuple[str, ...]) -> subprocess.CompletedProcess[str]:
        return run('illuminator_ros.bridge', '--ros-args',
                   *(argument.replace('KEYS', str(keys)) for argument in arguments),
                   env={'ROS_DOMAIN_ID': str(domain)})

    with own_domain() as domain, ThreadPoolExecutor(2) as pool:
        yield dict(zip(WRONG, pool.map(start, (given for given, _ in WRONG.values())),
                       strict=True))


@pytest.mark.parametrize('what', WRONG)
def test_it_ends_the_start(outcomes: dict[str, Any], keys: Path, what: str) -> None:
    outcome, expected = outcomes[what], WRONG[what][1].replace('KEYS', str(keys))

    # rcl may warn before.
    own = [line for line in outcome.stderr.splitlines() if not re.match(r'\[WARN\]', line)]
    [line] = own
    assert line.startswith('bridge: ')
    assert expected in line
    assert outcome.stdout == ''
    assert outcome.returncode == 2


@pytest.mark.parametrize(('given', 'reason'), [
    ({'strobe_period': float('inf')}, 'strobe_period inf is not a finite number'),
    ({'strobe_period': -1.0}, 'strobe_period -1 s is out of range: 0 to 3600 s'),
    ({'strobe_duty_cycle': True}, 'strobe_duty_cycle True is not a number'),
    ({'brightness': [1.0, 2.0]}, 'brightness [1.0, 2.0] is not a number'),
    ({'mode': 1}, 'mode 1 is none of internal_control, external_sync'),
    ({'frame_id': 7}, 'frame_id: 7 is no string'),
    ({'beam_range': -1.0}, 'beam_range: -1.0 m is out of range: 0 to 10000 m'),
    ({'beam_angle': 30}, 'beam_angle: 30.0 rad is out of range: 0.01 to 3 rad'),
    ({'system_id': 'one'}, "system_id: 'one' is no integer"),
    ({'off_on_shutdown': 1}, 'off_on_shutdown: 1 is no boolean'),
    ({'command_retries': 1.5}, 'command_retries: 1.5 is no integer'),
    ({'target_system': 300}, 'target_system: 300 is out of range: 0 to 255'),
    ({'component_id': 0}, 'component_id: 0 is out of range: 1 to 255'),
    ({'heartbeat_timeout': 1.0}, 'heartbeat_timeout: 1.0 s is out of range: 1.1 to 3600 s'),
    ({'command_timeout': float('nan')}, 'command_timeout: nan s is out of range: 0.05 to 60 s'),
    ({'connection_url': 'udpin://127.0.0.1:99999'}, 'port 99999 is outside 1..65535'),
    ({'connection_url': ''}, "connection URL '': it is empty"),
    ({'names': ['1/244=2 fast']}, "names: '2 fast' is not a valid node name"),
    ({'names': ['1/244=']}, "names: '' is not a valid node name"),
    ({'names': ['1/999=belly']}, "names: '1/999=belly' is not of the form 1/244=belly"),
    ({'names': ['1/244=belly', '1/245=belly']}, "'1/245=belly' repeats an address or a name"),
    ({'names': ['1/244=belly', '1/244=nose']}, "'1/244=nose' repeats an address or a name"),
    ({'names': ['1/244=illuminator_1_250']},
     "'1/244=illuminator_1_250' is the name of light 1/250"),
    ({'signing_mode': 'require'}, 'signing_key_file: no key file is given'),
])
def test_the_reason_names_what_is_wrong(ros: Ros, given: dict[str, Any], reason: str) -> None:
    overrides = [Parameter(name, value=value) for name, value in given.items()]
    node = PayloadNode('illuminator', context=ros.context, parameter_overrides=overrides)

    with pytest.raises(ParameterError) as error:
        Bridge(node, [], PAYLOADS)

    node.destroy_node()
    assert reason in str(error.value)


def test_misspelt_names_are_warned_about(ros: Ros) -> None:
    misspelt = {'brightnes': 'brightness', 'conection_url': 'connection_url',
                'target_sytem': 'target_system', 'strobe_periode': 'strobe_period'}
    with running_bridge(ros.domain, free_port(), **dict.fromkeys(misspelt, 1)) as bridge:
        for wrong, right in misspelt.items():
            bridge.wait_for(
                f"parameter '{wrong}' is unknown and ignored; did you mean '{right}'?")


@pytest.mark.parametrize('given', ['off', "'off'"])
def test_off_means_off_although_yaml_takes_it_for_a_boolean(ros: Ros, given: str) -> None:
    with running_bridge(ros.domain, free_port(), signing_mode=given) as bridge:
        assert bridge.running


def test_integers_are_taken_for_doubles(ros: Ros) -> None:
    given = {'heartbeat_timeout': 2, 'status_interval': 2, 'command_timeout': 2}
    with running_bridge(ros.domain, free_port(), **given) as bridge:
        assert bridge.running


def test_a_parameter_of_another_node_is_nobody_s_mistake(ros: Ros, tmp_path: Path) -> None:
    file = tmp_path / 'shared.yaml'
    file.write_text('/**: {ros__parameters: {robot_description: x, use_sim_time: false}}')

    with running_bridge(ros.domain, free_port(), '--params-file', str(file)) as bridge:
        assert bridge.count('WARN') == 0
