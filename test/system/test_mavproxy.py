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

"""Through MAVProxy, which knows no illuminators: the light is found and commanded all the same."""

from __future__ import annotations

from collections.abc import Callable, Iterator
import importlib.util
import sys
from typing import Any

from illuminator_ros.illuminator import operation
import pytest
from support.live_link import Bridge
from support.ports import free_port
from support.processes import ended, Program, python
from support.waiting import PATIENCE

pytestmark = pytest.mark.skipif(
    importlib.util.find_spec('MAVProxy') is None,
    reason='MAVProxy is not installed: pip install pyserial; pip install --no-deps MAVProxy')


@pytest.fixture(autouse=True)
def _patience(monkeypatch: pytest.MonkeyPatch) -> None:
    """Have no change fail because the machine stood still behind its acknowledgement."""
    monkeypatch.setattr(operation, 'CONFIRMATION_TIMEOUT', PATIENCE)


@pytest.fixture
def ports() -> tuple[int, int]:
    """Return the port of the light's side of the router, and that of the drone's."""
    return free_port(), free_port()


@pytest.fixture
def start_router(ports: tuple[int, int], tmp_path: Any) -> Iterator[Callable[[], Program]]:
    """Return a function that starts MAVProxy between the two ports."""
    started = []

    def start() -> Program:
        # Its other modules need far more than is installed for this.
        started.append(Program(
            sys.executable, '-u', '-m', 'MAVProxy.mavproxy', '--daemon', '--non-interactive',
            '--no-state', '--mav20', '--default-modules=output',
            f'--master=udpin:127.0.0.1:{ports[0]}', f'--out=udpout:127.0.0.1:{ports[1]}',
            cwd=tmp_path))
        started[-1].wait_for('Waiting for heartbeat', 30.0)
        return started[-1]

    yield start
    for router in started:
        router.kill()


@pytest.fixture
def bridge(ports: tuple[int, int]) -> Iterator[Bridge]:
    """Return the drone's side, without ROS."""
    one = Bridge(f'udpin://127.0.0.1:{ports[1]}')
    yield one
    one.stop()


@pytest.fixture
def simulator(ports: tuple[int, int]) -> Iterator[Program]:
    """Run a simulated light."""
    with ended(python('illuminator_ros.simulator', f'udpout://127.0.0.1:{ports[0]}')) as one:
        yield one


def test_a_light_behind_mavproxy_is_found_and_commanded(
    start_router: Callable[[], Program], simulator: Program, bridge: Bridge,
) -> None:
    start_router()
    light = bridge.wait_connected()
    for on in (True, False):
        result = bridge.enable(on, light)
        assert result.success, result.message
        assert 'confirmed by ILLUMINATOR_STATUS' in result.message


def test_a_light_is_back_after_a_restart_of_mavproxy(
    start_router: Callable[[], Program], simulator: Program, bridge: Bridge,
) -> None:
    router = start_router()
    bridge.wait_connected()
    router.kill()
    bridge.lights.wait_for(lambda entry: entry[0] == 'lost')
    start_router()
    light = bridge.wait_connected(2)
    assert bridge.enable(True, light).success
