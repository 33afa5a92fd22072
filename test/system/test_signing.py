# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""MAVLink 2 signing between the programs: only a sender that has the key is heard."""

from collections.abc import Callable
from pathlib import Path
import socket

from illuminator_ros.mavlink.signing import ticks
from illuminator_ros.mavlink.signing_files import TimestampStore
from illuminator_ros.ros.ros_home import state_folder
import pytest
from support.ports import free_port
from support.ros import Parameters, Ros, running_bridge, running_simulator
from support.waiting import PATIENCE

SECRET = 'correct horse'
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


def test_bridge_signs_on_from_the_time_stamp_that_the_run_before_has_stored(
    own_ros: Ros, key_file: KeyFile,
) -> None:
    key, later = key_file(SECRET), ticks(4e9)
    TimestampStore(key, 'bridge 1/193', state_folder()).store(later, 0.0, last=True)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as light:
        light.bind(('127.0.0.1', 0))
        light.settimeout(PATIENCE)
        url = f'udpout://127.0.0.1:{light.getsockname()[1]}'
        with running_bridge(own_ros.domain, 0, connection_url=url, signing_mode='sign',
                            signing_key_file=key):
            signature = light.recv(280)[-13:]

    assert later < int.from_bytes(signature[1:7], 'little') < later + 1000
