# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The examples in the help of simulator, conformance and discover."""

from collections.abc import Callable
from pathlib import Path
import re
import shlex
import shutil
import sys

from illuminator_ros.cli.conformance import run as conformance
from illuminator_ros.cli.discover import run as discover
from illuminator_ros.cli.payloads import PAYLOADS
from illuminator_ros.cli.simulator.options import parser, payload_types
import pytest

STARTED = [
    ('/opt/ws/install/lib/illuminator_ros/{}', 'ros2 run illuminator_ros {}'),
    ('/opt/ws/install/my_winch/lib/my_winch/{}', 'ros2 run my_winch {}'),
    ('/home/me/venv/bin/illuminator-{}', 'illuminator-{}'),
    ('/home/me/src/illuminator_ros/{}.py', 'python3 -m illuminator_ros.{}'),
    ('/home/me/venv/lib/illuminator_ros/{}.py', '.venv/bin/python -m illuminator_ros.{}')]


@pytest.fixture(autouse=True)
def interpreter(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """Run by the interpreter that the command names."""
    command = request.getfixturevalue('command')
    python = '.venv/bin/python' if command.startswith('.venv') else shutil.which('python3')
    monkeypatch.setattr(sys, 'executable', str(Path.cwd() / str(python)))


def examples(text: str) -> list[str]:
    return [line.strip() for line in re.findall(r'^examples:\n((?:  .+\n)+)', text, re.M)[0]
            .splitlines()]


@pytest.mark.parametrize(('started', 'command'), STARTED)
@pytest.mark.parametrize('payload', PAYLOADS)
def test_an_example_of_the_simulator_runs_as_the_simulator_was_started(
    started: str, command: str, payload: str, monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(sys, 'argv', [started.format('simulator')])
    text = parser(payload_types(['--payload', payload], PAYLOADS)).format_help()
    begin = command.format('simulator')

    assert examples(text)
    for line in examples(text):
        assert line.startswith(begin)
        arguments = shlex.split(line.removeprefix(begin), comments=True)
        parser(payload_types(arguments, PAYLOADS)).parse_args(arguments)


@pytest.mark.parametrize(('started', 'command'), STARTED)
@pytest.mark.parametrize(('name', 'parse'), [
    ('conformance', conformance.parse), ('discover', discover.parse)])
def test_an_example_of_a_tool_runs_as_the_tool_was_started(
    started: str, command: str, name: str, parse: Callable[[list[str]], object],
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setattr(sys, 'argv', [started.format(name)])
    with pytest.raises(SystemExit):
        parse(['--help'])
    lines = examples(capsys.readouterr().out)
    begin = command.format(name)

    assert lines
    for line in lines:
        assert line.startswith(begin)
        parse(shlex.split(line.removeprefix(begin), comments=True))
