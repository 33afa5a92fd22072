# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""A light is found and commanded through MAVProxy, which has no support for illuminators."""

import importlib.util
from pathlib import Path
import sys

import pytest
from support.ports import free_port
from support.processes import Program
from support.ros import Ros, running_bridge, running_simulator
from support.slow import pass_time_until

pytestmark = pytest.mark.skipif(
    importlib.util.find_spec('MAVProxy') is None,
    reason='MAVProxy is not installed: pip install pyserial; pip install --no-deps MAVProxy')


def start_router(near: int, far: int, directory: Path) -> Program:
    """Start MAVProxy between the light's port and the bridge's."""
    # Load only the module "output": others need packages that are not installed.
    router = Program(
        sys.executable, '-u', '-m', 'MAVProxy.mavproxy', '--daemon', '--non-interactive',
        '--no-state', '--mav20', '--default-modules=output',
        f'--master=udpin:127.0.0.1:{near}', f'--out=udpout:127.0.0.1:{far}', cwd=directory)
    router.wait_for('Waiting for heartbeat')
    return router


def test_light_behind_mavproxy_is_commanded_and_so_it_is_after_a_restart_of_mavproxy(
    own_ros: Ros, tmp_path: Path,
) -> None:
    near, far = free_port(), free_port()
    router = start_router(near, far, tmp_path)
    try:
        with (running_bridge(own_ros.domain, far) as bridge,
              running_simulator(f'udpout://127.0.0.1:{near}', '--status-interval', '0.01')):
            pass_time_until(lambda: bridge.count('light 1/243 connected'), step=0.1)
            for on in (True, False):
                response = own_ros.enable(on)
                assert response.success
                assert 'confirmed by ILLUMINATOR_STATUS' in response.message

            router.kill()
            pass_time_until(lambda: bridge.count('light 1/243 lost'))
            router = start_router(near, far, tmp_path)
            pass_time_until(lambda: bridge.count('light 1/243 connected') >= 2, step=0.1)
            assert own_ros.enable().success
    finally:
        router.kill()
