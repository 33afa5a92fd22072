# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""A light and an autopilot behind the real mavlink-router, with the configurations of the page."""

from __future__ import annotations

from collections.abc import Iterator
import contextlib
from pathlib import Path
import re
import shlex
import shutil
from typing import Any

import pytest
from support.ports import free_port
from support.processes import ended, Program, python, ROOT
from support.ros import bridge_arguments, Ros
from support.waiting import eventually

PAGE = (ROOT / 'doc' / 'routers.md').read_text()
ROUTER = shutil.which('mavlink-routerd')
pytestmark = [
    pytest.mark.skipif(ROUTER is None, reason='mavlink-routerd is not installed'),
    pytest.mark.timeout(180)]


class Ports:
    """The devices and ports of the page, and those of the test in their place."""

    def __init__(self, folder: Path) -> None:
        self.mavros, self.bridge, self.station = (free_port() for _ in range(3))
        self._folder = folder

    def of_test(self, text: str) -> str:
        for page, ours in ((14540, self.mavros), (14590, self.bridge), (14550, self.station)):
            text = text.replace(str(page), str(ours))
        return text.replace('/dev/', f'{self._folder}/')


@pytest.fixture
def ports(tmp_path: Path) -> Iterator[Ports]:
    """Run a light and an autopilot on serial lines."""
    with contextlib.ExitStack() as stack:
        for name, options in (('ttyUSB0', ''),
                              ('ttyACM0', '--payload gimbal_manager --component-id 1')):
            stack.enter_context(ended(python(
                'illuminator_ros.simulator', f'pty://{tmp_path}/{name}', '--plain',
                *options.split())))
            eventually((tmp_path / name).exists)
        yield Ports(tmp_path)


def configuration(folder: Path, text: str) -> list[str]:
    """Return the command with a configuration file."""
    (folder / 'main.conf').write_text(text)
    return [str(ROUTER), '--conf-file', str(folder / 'main.conf')]


@contextlib.contextmanager
def router(command: list[str]) -> Iterator[Program]:
    program = Program(*command)
    try:
        program.wait_for('Opened UDP')
        yield program
    finally:
        program.kill()


def bridge(ros: Ros, url: str) -> Any:
    return ended(python(
        'illuminator_ros.bridge', *bridge_arguments(0, connection_url=url),
        env={'ROS_DOMAIN_ID': str(ros.domain)}))


def file_of_the_page() -> str:
    return str(re.findall(r'main.conf`:\n\n```\n(.*?)```', PAGE, re.DOTALL)[0])


def filtered(text: str) -> str:
    """Return a configuration with the messages that the page lists for filters."""
    [ours, light] = re.findall(r'must pass ([\d, and]+),|endpoint ([\d, and]+)\.', PAGE)
    ours, light = (','.join(re.findall(r'\d+', ''.join(found))) for found in (ours, light))
    text = text.replace('Port = 14590\n', f'Port = 14590\nAllowMsgIdOut = {ours}\n')
    return text.replace(
        '[UartEndpoint light]\n', f'[UartEndpoint light]\nAllowMsgIdOut = {light}\n')


@pytest.mark.parametrize('kind', ['file', 'command line', 'filtered', 'server'])
def test_the_light_is_commanded_through_the_router_and_so_it_is_after_its_restart(
        own_ros: Ros, ports: Ports, tmp_path: Path, kind: str) -> None:
    text = file_of_the_page()
    url = 'udpin://127.0.0.1:14590'
    if kind == 'command line':
        [line] = re.findall(r'^mavlink-routerd (.*)$', PAGE, re.MULTILINE)
        command = [str(ROUTER), *shlex.split(ports.of_test(line))]
    else:
        if kind == 'filtered':
            text = filtered(text)
        if kind == 'server':
            [url] = re.findall(r'`Mode = Server` .*? then needs `(\S+)`', PAGE, re.DOTALL)
            before, ours = text.split('[UdpEndpoint illuminator]')
            text = f'{before}[UdpEndpoint illuminator]{ours.replace("Normal", "Server", 1)}'
        command = configuration(tmp_path, ports.of_test(text))
    with bridge(own_ros, ports.of_test(url)) as served:
        for restart in (1, 2):
            with router(command):
                served.wait_for('light 1/243 connected', count=restart)
                for on in (True, False):
                    answer = own_ros.enable(on)
                    assert 'confirmed by ILLUMINATOR_STATUS' in answer.message
            served.wait_for('light 1/243 lost', count=restart)
