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

"""MAVLink 2 signing between the programs: who has the key is heard (DESIGN.md, 3.7)."""

from collections.abc import Callable, Iterator
import contextlib
from pathlib import Path

from diagnostic_msgs.msg import DiagnosticArray
import pytest
from support.ports import free_port
from support.processes import Program
from support.ros import Parameters, Ros, running_bridge, running_simulator, STREAM
from support.slow import pass_time_until

KeyFile = Callable[[str], str]


@pytest.fixture
def key_file(tmp_path: Path) -> KeyFile:
    """Return what makes key files that only their owner can read."""
    def make(passphrase: str) -> str:
        path = tmp_path / passphrase.replace(' ', '_')
        path.write_text(passphrase)
        path.chmod(0o600)
        return str(path)
    return make


@contextlib.contextmanager
def simulator(port: int, *options: str) -> Iterator[Program]:
    with running_simulator(f'udpout://127.0.0.1:{port}', *options) as it:
        yield it


def link_value(key: str) -> Callable[[DiagnosticArray], int]:
    """Return what reads a value of the link from diagnostics."""
    def read(array: DiagnosticArray) -> int:
        return int({entry.key: entry.value for entry in array.status[0].values}[key])
    return read


def test_two_with_the_same_key_find_each_other(own_ros: Ros, key_file: KeyFile) -> None:
    port, key = free_port(), key_file('correct horse')
    with (running_bridge(own_ros.domain, port, signing_mode='require', signing_key_file=key),
          simulator(port, '--signing-mode', 'require', '--signing-key-file', key)):
        Parameters(own_ros).wait(brightness=100.0)

        assert Parameters(own_ros).set(brightness=20)[0].successful


@pytest.mark.parametrize(('options', 'counter'), [
    ((), 'unsigned_frames'),
    (('--signing-mode', 'sign', '--signing-key-file'), 'signatures_bad'),
], ids=['no key', 'another key'])
def test_who_has_not_the_key_is_not_heard_and_counted(
    own_ros: Ros, key_file: KeyFile, options: tuple[str, ...], counter: str,
) -> None:
    port = free_port()
    other = (*options, key_file('battery staple')) if options else ()
    with (running_bridge(own_ros.domain, port, signing_mode='require',
                         signing_key_file=key_file('correct horse')) as bridge,
          simulator(port, *other)):
        diagnostics = own_ros.subscribe(DiagnosticArray, '/diagnostics', STREAM)

        pass_time_until(lambda: any(map(link_value(counter), list(diagnostics.messages))))

        assert bridge.count('light 1/243 connected') == 0


def test_the_key_stands_in_no_parameter_and_no_log(own_ros: Ros, key_file: KeyFile) -> None:
    secret = 'correct horse'
    with running_bridge(own_ros.domain, free_port(), signing_mode='require',
                        signing_key_file=key_file(secret)) as bridge:
        parameters = Parameters(own_ros)

        values = [value for name in parameters.names() for value in parameters.get(name)]

        assert secret not in map(str, values)
        assert secret not in bridge.log
