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

import pytest
from support.light import free_port
from support.processes import run
from support.ros import own_domain, Ros, running_bridge

# Each: the arguments behind --ros-args, and what the line says. KEYS is a folder with key files.
WRONG: dict[str, tuple[tuple[str, ...], str]] = {
    'a number that is NaN': (
        ('-p', 'brightness:=.nan'), 'parameter brightness nan is not a finite number'),
    'an infinite number': (
        ('-p', 'strobe_period:=.inf'), 'parameter strobe_period inf is not a finite number'),
    'a number out of range': (
        ('-p', 'brightness:=101'), 'parameter brightness 101 % is out of range: 0 to 100 %'),
    'a negative number': (
        ('-p', 'strobe_period:=-1.0'), 'parameter strobe_period -1 s is out of range: 0 to 3600'),
    'a string for a number': (
        ('-p', 'brightness:=bright'), "parameter brightness 'bright' is no number"),
    'a boolean for a number': (
        ('-p', 'strobe_duty_cycle:=true'), 'parameter strobe_duty_cycle True is no number'),
    'a list for a number': (
        ('-p', 'brightness:=[1.0, 2.0]'), 'parameter brightness [1.0, 2.0] is no number'),
    'a mode that is none': (
        ('-p', 'mode:=disco'), "mode 'disco' is none of internal_control, external_sync"),
    'a number for a string': (
        ('-p', 'frame_id:=7'), 'parameter frame_id: 7 is no string'),
    'a string for an integer': (
        ('-p', 'system_id:=one'), "parameter system_id: 'one' is no integer"),
    'a double for an integer': (
        ('-p', 'command_retries:=1.5'), 'parameter command_retries: 1.5 is no integer'),
    'an id out of range': (
        ('-p', 'target_system:=300'), 'parameter target_system: 300 is out of range: 0 to 255'),
    'an id that nobody may have': (
        ('-p', 'component_id:=0'), 'parameter component_id: 0 is out of range: 1 to 255'),
    'a time-out below a heartbeat': (
        ('-p', 'heartbeat_timeout:=1.0'),
        'parameter heartbeat_timeout: 1.0 s is out of range: 1.1 to 3600 s'),
    'a time-out that is NaN': (
        ('-p', 'command_timeout:=.nan'), 'parameter command_timeout: nan s is out of range'),
    'a URL of an unknown kind': (
        ('-p', 'connection_url:=http://x'),
        "parameter connection_url: connection URL 'http://x': unknown scheme 'http'"),
    'a URL with a wrong port': (
        ('-p', 'connection_url:=udpin://127.0.0.1:99999'), 'port 99999 is outside 1..65535'),
    'an empty URL': (
        ('-p', 'connection_url:=""'), "connection URL '': it is empty"),
    'a name without ids': (
        ('-p', 'names:=[belly]'), "parameter names: 'belly' is not of the form 1/244=belly"),
    'a name that is none': (
        ('-p', 'names:=["1/244=2 fast"]'), "names: '2 fast' in '1/244=2 fast' is no node name"),
    'an empty name': (
        ('-p', 'names:=["1/244="]'), "names: '' in '1/244=' is no node name"),
    'a name for two lights': (
        ('-p', 'names:=[1/244=belly, 1/245=belly]'), "'1/245=belly' repeats an address or a name"),
    'two names for a light': (
        ('-p', 'names:=[1/244=belly, 1/244=nose]'), "'1/244=nose' repeats an address or a name"),
    'an unknown signing mode': (
        ('-p', 'signing_mode:=maybe'),
        "parameter signing_mode: 'maybe' is none of off, sign, require"),
    'signing without a key': (
        ('-p', 'signing_mode:=require'), 'parameter signing_key_file: no key file is given'),
    'a key file that is missing': (
        ('-p', 'signing_mode:=sign', '-p', 'signing_key_file:=KEYS/none'),
        "KEYS/none': No such file or directory"),
    'a key that others can read': (
        ('-p', 'signing_mode:=require', '-p', 'signing_key_file:=KEYS/open'),
        'can be read by others (mode 0644); make it private: chmod 600 KEYS/open'),
    'a key that is too short': (
        ('-p', 'signing_mode:=require', '-p', 'signing_key_file:=KEYS/short'), 'holds 3 bytes'),
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
    'an unknown log level': (
        ('--log-level', 'banana'), "Couldn't parse log level: '--log-level banana'"),
}


@pytest.fixture(scope='module')
def keys(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with files that cannot be used."""
    folder = tmp_path_factory.mktemp('keys')
    (folder / 'open').write_text('a long passphrase')
    (folder / 'open').chmod(0o644)
    (folder / 'short').write_text('abc')
    (folder / 'short').chmod(0o600)
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


@pytest.mark.parametrize(('wrong', 'right'), [
    ('brightnes', 'brightness'), ('conection_url', 'connection_url'),
    ('target_sytem', 'target_system'), ('strobe_periode', 'strobe_period'),
])
def test_a_misspelt_name_is_warned_about(ros: Ros, wrong: str, right: str) -> None:
    with running_bridge(ros.domain, free_port(), **{wrong: 1}) as bridge:
        bridge.wait_for(f"parameter '{wrong}' is unknown and ignored; did you mean '{right}'?")


@pytest.mark.parametrize('given', ['off', "'off'"])
def test_off_means_off_although_yaml_takes_it_for_a_boolean(ros: Ros, given: str) -> None:
    with running_bridge(ros.domain, free_port(), signing_mode=given) as bridge:
        assert bridge.running


@pytest.mark.parametrize('name', ['heartbeat_timeout', 'status_interval', 'command_timeout'])
def test_an_integer_is_taken_for_a_double(ros: Ros, name: str) -> None:
    with running_bridge(ros.domain, free_port(), **{name: 2}) as bridge:
        assert bridge.running


def test_a_parameter_of_another_node_is_nobody_s_mistake(ros: Ros, tmp_path: Path) -> None:
    file = tmp_path / 'shared.yaml'
    file.write_text('/**: {ros__parameters: {robot_description: x, use_sim_time: false}}')

    with running_bridge(ros.domain, free_port(), '--params-file', str(file)) as bridge:
        assert bridge.count('WARN') == 0
