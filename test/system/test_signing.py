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

"""MAVLink 2 signing between the programs: only a sender that has the key is heard."""

from collections.abc import Callable
from pathlib import Path
import socket

from diagnostic_msgs.msg import DiagnosticArray
from illuminator_ros.mavlink.signing import ticks
from illuminator_ros.mavlink.signing_files import TimestampStore
import pytest
from support.ports import free_port
from support.ros import Parameters, Ros, running_bridge, running_simulator, STREAM
from support.slow import pass_time_until
from support.waiting import PATIENCE

SECRET, OTHER_SECRET = 'correct horse', 'battery staple'
KeyFile = Callable[[str], str]


@pytest.fixture
def key_file(tmp_path: Path) -> KeyFile:
    """Return a function that makes key files that only their owner can read."""
    def make(passphrase: str) -> str:
        path = tmp_path / passphrase.replace(' ', '_')
        path.write_text(passphrase)
        path.chmod(0o600)
        return str(path)
    return make


def link_value(key: str) -> Callable[[DiagnosticArray], int]:
    """Return a function that reads a value of the link from diagnostics."""
    def read(array: DiagnosticArray) -> int:
        return int({entry.key: entry.value for entry in array.status[0].values}[key])
    return read


def test_programs_with_the_same_key_find_each_other_and_show_it_nowhere(
    own_ros: Ros, key_file: KeyFile,
) -> None:
    port, key = free_port(), key_file(SECRET)
    with (running_bridge(own_ros.domain, port, signing_mode='require',
                         signing_key_file=key) as bridge,
          running_simulator(f'udpout://127.0.0.1:{port}', '--signing-mode', 'require',
                            '--signing-key-file', key) as simulator):
        parameters = Parameters(own_ros)
        parameters.wait(brightness=100.0)
        assert parameters.set(brightness=20)[0].successful

        values = parameters.get(*parameters.names())
        assert SECRET not in map(str, values)
        assert SECRET not in bridge.log + simulator.log


@pytest.mark.parametrize(('mode', 'simulator_mode', 'counter'), [
    ('require', 'off', 'unsigned_frames'), ('require', 'sign', 'signatures_bad')])
def test_sender_without_the_key_is_not_heard_and_its_frames_are_counted(
    own_ros: Ros, key_file: KeyFile, mode: str, simulator_mode: str, counter: str,
) -> None:
    port = free_port()
    options = () if simulator_mode == 'off' else (
        '--signing-mode', simulator_mode, '--signing-key-file', key_file(OTHER_SECRET))
    with (running_bridge(own_ros.domain, port, signing_mode=mode,
                         signing_key_file=key_file(SECRET)) as bridge,
          running_simulator(f'udpout://127.0.0.1:{port}', *options)):
        diagnostics = own_ros.subscribe(DiagnosticArray, '/diagnostics', STREAM)

        pass_time_until(lambda: any(map(link_value(counter), list(diagnostics.messages))))

        assert bridge.count('light 1/243 connected') == 0


def test_bridge_signs_on_from_the_time_stamp_that_the_run_before_has_stored(
    own_ros: Ros, key_file: KeyFile,
) -> None:
    key, later = key_file(SECRET), ticks(4e9)
    TimestampStore(key, 'bridge 1/194').store(later, last=True)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as light:
        light.bind(('127.0.0.1', 0))
        light.settimeout(PATIENCE)
        url = f'udpout://127.0.0.1:{light.getsockname()[1]}'
        with running_bridge(own_ros.domain, 0, connection_url=url, signing_mode='sign',
                            signing_key_file=key):
            signature = light.recv(280)[-13:]

    assert later < int.from_bytes(signature[1:7], 'little') < later + 1000


def test_light_that_requires_signing_is_recognised_while_signing_is_off(
    own_ros: Ros, key_file: KeyFile,
) -> None:
    port = free_port()
    with (running_bridge(own_ros.domain, port) as bridge,
          running_simulator(f'udpout://127.0.0.1:{port}', '--signing-mode', 'require',
                            '--signing-key-file', key_file(SECRET))):
        pass_time_until(lambda: bridge.count('light 1/243 connected'), step=0.1)
        diagnostics = own_ros.subscribe(DiagnosticArray, '/diagnostics', STREAM)

        pass_time_until(lambda: any(
            'commands are not answered' in array.status[0].message
            and 'signing_mode is off' in array.status[0].message
            for array in list(diagnostics.messages)))
        bridge.wait_for('signing_mode is off: set signing_mode and signing_key_file')
