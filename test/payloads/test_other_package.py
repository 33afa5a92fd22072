# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The executables know a payload of another package by its entry point."""

from pathlib import Path
import sys

import pytest
from support.ports import free_port
from support.processes import ended, Program
from support.waiting import eventually
from support.winch_package import ENTRY_POINTS, install_winch


def output(*arguments: str, site: Path, entry_points: str = ENTRY_POINTS) -> list[str]:
    """Return the lines of a program that ends by itself with status 0."""
    with ended(Program(sys.executable, *arguments,
                       env=install_winch(site, entry_points))) as program:
        assert program.wait() == 0, program.lines
        return [line.rstrip('\n') for line in program.lines]


def test_conformance_knows_a_payload_of_another_package(tmp_path: Path) -> None:
    lines = output('-m', 'illuminator_ros.conformance', '--payload', 'winch', '--list',
                   site=tmp_path)
    assert any(line.startswith('release ') for line in lines)


def test_discover_finds_a_simulated_winch_and_names_the_command_that_serves_it(
        tmp_path: Path) -> None:
    port, env = free_port(), install_winch(tmp_path)
    with ended(Program(sys.executable, '-m', 'illuminator_ros.simulator',
                       f'udpout://127.0.0.1:{port}', '--payload', 'winch', env=env)), ended(
            Program(sys.executable, '-m', 'illuminator_ros.discover',
                    f'udpin://127.0.0.1:{port}', '--seconds', '4', env=env)) as discover:
        eventually(lambda: any(line.strip().startswith('run: ') for line in discover.lines))
        assert discover.wait() == 0
    assert any(f'bridge udpin://127.0.0.1:{port} --ros-args -p payloads:="[winch]"' in line
               for line in discover.lines), discover.lines


def test_the_file_of_a_winch_that_was_found_selects_its_payload(tmp_path: Path) -> None:
    output('-c', SET_UP, str(tmp_path), site=tmp_path)
    assert (tmp_path / 'deck.yaml').read_text() == (
        "deck:\n  ros__parameters:\n    connection_url: /dev/x\n    payloads: ['winch']\n")


SET_UP = """
import sys
from illuminator_ros.cli.discover.setup import set_up
sys.exit(set_up(
    [{'url': '/dev/x', 'components': [
        {'address': '1/169', 'kinds': ['winch'], 'served': True, 'signed': False}]}],
    ['device=1', 'name=deck', 'boot=no', 'folder=' + sys.argv[1]]))
"""
VIEWS = """
from illuminator_ros.cli.payloads import PAYLOADS
print(*PAYLOADS['winch'].load('view').topics)
"""


def test_the_monitor_has_the_view_of_a_payload_of_another_package(tmp_path: Path) -> None:
    pytest.importorskip('rclpy')
    assert output('-c', VIEWS, site=tmp_path) == ['line_length']


@pytest.mark.parametrize(('entry', 'reason'), [
    ('winch = my_winch.missing:WINCH', "ModuleNotFoundError: No module named 'my_winch.missing'"),
    ('winch = my_winch.winch:SIMULATED', 'it is not a PayloadType with a name of its own')])
def test_a_payload_that_cannot_be_imported_is_a_warning_and_the_others_work(
        entry: str, reason: str, tmp_path: Path) -> None:
    lines = output('-m', 'illuminator_ros.conformance', '--list', site=tmp_path,
                   entry_points=f'[illuminator_ros.payloads]\n{entry}\n')
    value = entry.partition(' = ')[2]
    assert f'payload winch ({value}) is ignored: {reason}' in lines
    assert len(lines) > 10
