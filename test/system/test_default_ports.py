# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Programs without a URL find each other; the ways in of doc/start.md begin with them."""

from collections.abc import Iterator
import contextlib
from pathlib import Path
import shlex
import shutil
import socket
import sys

import pytest
from support.processes import ended, Program, python, ROOT

# Node -> its port, the arguments of its simulator, and the line of its log.
NODES = {
    'bridge': (14590, (), 'light 1/243 connected'),
    'rededge': (14592, ('--payload', 'rededge'), '/100 connected'),
}
WAYS = (ROOT / 'doc' / 'start.md').read_text().split('\n## ')[1:4]


@contextlib.contextmanager
def default_port(port: int) -> Iterator[None]:
    """Claim a port among all tests of this machine, or skip the test if it is taken."""
    with (socket.socket(socket.AF_UNIX) as claim,
          socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe):
        try:
            claim.bind(f'\0illuminator_ros_test_default_port_{port}')
            probe.bind(('127.0.0.1', port))
        except OSError:
            pytest.skip(f'UDP port {port} is taken')
        probe.close()
        yield


@pytest.mark.parametrize(('node', 'node_first'), [('bridge', True), ('rededge', False)])
def test_programs_without_a_url_find_each_other_whichever_starts_first(
        domain: int, node: str, node_first: bool) -> None:
    port, arguments, found = NODES[node]
    env = {'ROS_DOMAIN_ID': str(domain)}
    with default_port(port), contextlib.ExitStack() as programs:
        def start(name: str) -> Program:
            more = arguments if name == 'simulator' else ()
            return programs.enter_context(ended(python(f'illuminator_ros.{name}', *more, env=env)))

        started = {name: start(name) for name in (
            (node, 'simulator') if node_first else ('simulator', node))}
        started[node].wait_for(found)


def commands(way: str) -> list[tuple[list[str], str]]:
    """Return the commands of the first block of code, with the text that each prints."""
    block = way.split('```')[1].replace('\\\n', ' ')
    return [(shlex.split(command), text.strip()) for command, _, text in (
        line.partition(' # ') for line in block.strip().splitlines())]


def in_this_tree(command: list[str]) -> list[str]:
    """Return a command of the page as one that runs this tree; skip the rest without ros2."""
    if command[:2] == ['ros2', 'run']:
        return [sys.executable, '-m', '.'.join(command[2:4]), *command[4:]]
    if not shutil.which(command[0]):
        pytest.skip(f'{command[0]} is not installed, for {shlex.join(command)}')
    return command


@pytest.mark.parametrize('way', WAYS, ids=lambda way: way.partition('\n')[0])
def test_the_commands_of_a_way_in_print_in_an_empty_home_what_the_page_says(
    way: str, domain: int, tmp_path: Path,
) -> None:
    env = {'ROS_DOMAIN_ID': str(domain), 'HOME': str(tmp_path), 'ROS_HOME': f'{tmp_path}/.ros',
           'ROS_LOG_DIR': f'{tmp_path}/log'}
    with (default_port(14590), default_port(14592), contextlib.ExitStack() as programs):
        for command, text in commands(way):
            program = programs.enter_context(ended(Program(
                *in_this_tree(command), env=env, cwd=tmp_path)))
            if not {'run', 'echo', '-r'} & {*command}:
                assert program.wait() == 0, program.log
            if text:
                program.wait_for(text)
