# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""
Run the ros2 commands of the README and of doc/ with the real command line.

ROS 2 and the package must be sourced. Simulated devices and their nodes run meanwhile in a ROS
domain of their own. The exit status is 1 if a command fails. A command that needs a package that
is not installed is skipped and named.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
import contextlib
import os
from pathlib import Path
import random
import re
import shlex
import signal
import subprocess
import sys
import tempfile
import time
from typing import NamedTuple

ROOT = Path(__file__).resolve().parent.parent
PACKAGE = 'illuminator_ros'
# Names that stand for a package of the reader.
PLACEHOLDERS = ('my_robot', 'my_winch', 'winch')
# Verbs that come with packages of their own.
VERBS = {'security': 'sros2'}
PACKAGES_OF_LAUNCH_FILES = {'joystick.launch.xml': 'joy'}
# s that a program runs before it is ended, that it may take to end, and that a command may take.
RUNNING_TIME, END_LIMIT, COMMAND_LIMIT = 5.0, 5.0, 20.0
# Attempts of a command whose result takes time, such as the turn of a gimbal.
ATTEMPTS = 4
TOLERANCE = 0.02
# The devices and nodes that the commands use.
STAGE = (
    f'ros2 run {PACKAGE} simulator --payload illuminator,gimbal_manager',
    f'ros2 run {PACKAGE} simulator udpout://127.0.0.1:14592 --payload rededge',
    f'ros2 run {PACKAGE} simulator udpout://127.0.0.1:14593 --payload gimbal',
    f'ros2 run {PACKAGE} bridge --ros-args -p payloads:="[illuminator, gimbal]" '
    '-p beam_range:=20.0 -p mounted_on:=1 -p frame_id:=base_link '
    """-p sources:="['safety', 'operator', 'default', 'autonomy']" -p source_timeout:=1.0""",
    f'ros2 run {PACKAGE} rededge',
    f'ros2 run {PACKAGE} gimbal_manager udpin://127.0.0.1:14593')


class Command(NamedTuple):
    """
    A documented command.

    :param expected: the comment behind it.
    """

    page: str
    text: str
    expected: str


class Failed(Exception):
    """A command had an unexpected result, which the text names."""


def commands() -> Iterator[Command]:
    """Yield the ros2 commands of the pages in their order."""
    for page in (ROOT / 'README.md', *sorted((ROOT / 'doc').glob('*.md'))):
        for block in re.findall(r'```\w*\n(.*?)```', page.read_text(), re.S):
            for line in re.sub(r'\\\n\s*', '', block).splitlines():
                text, _, expected = line.strip().removeprefix('$ ').partition('  #')
                if text.startswith('ros2 '):
                    yield Command(page.name, text.strip(), expected.strip())


def is_installed(package: str) -> bool:
    """Return whether a ROS package is installed."""
    return not subprocess.run(
        ['ros2', 'pkg', 'prefix', package], capture_output=True, check=False).returncode


def missing(command: Command) -> str:
    """Return what a command needs and is not there, '' if it can be run."""
    words = shlex.split(command.text)
    if found := [name for name in PLACEHOLDERS if name in command.text]:
        return f'{found[0]} stands for a package of the reader'
    if unset := [name for name in re.findall(r'\$(\w+)', command.text)
                 if name not in os.environ]:
        return f'the variable {unset[0]} belongs to a loop of the page'
    needed = [VERBS.get(words[1], ''), *(
        package for file, package in PACKAGES_OF_LAUNCH_FILES.items() if file in words)]
    if words[1] in ('run', 'launch'):
        needed.append(words[2])
    return ', '.join(f'{name} is not installed' for name in filter(None, needed)
                     if not is_installed(name))


@contextlib.contextmanager
def started(text: str, folder: Path) -> Iterator[subprocess.Popen[str]]:
    """Start a program; end it, and the programs that it has started, as Ctrl-C would."""
    if ' monitor' in text and '--once' not in text and '--web' not in text:
        # It needs a terminal.
        text = f'script -qec {shlex.quote(text)} /dev/null'
    # A shell ignores SIGINT for what it starts in the background, as nohup does.
    program = subprocess.Popen(
        ['env', '--default-signal=INT', 'bash', '-c', f'exec {text}'], cwd=folder, text=True,
        stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
        start_new_session=True)
    try:
        yield program
    finally:
        with contextlib.suppress(ProcessLookupError):
            os.killpg(program.pid, signal.SIGINT)
        try:
            program.wait(END_LIMIT)
        except subprocess.TimeoutExpired:
            with contextlib.suppress(ProcessLookupError):
                os.killpg(program.pid, signal.SIGKILL)
            program.wait()


def run_program(command: Command, folder: Path) -> None:
    """Run a program that does not end by itself."""
    with started(command.text, folder) as program:
        with contextlib.suppress(subprocess.TimeoutExpired):
            program.wait(RUNNING_TIME)
        ended = program.returncode
    assert program.stdout is not None
    output = program.stdout.read()
    # Programs of others, such as joy_teleop, end with a traceback after Ctrl-C in "ros2 launch".
    judged = output.partition('user interrupted with ctrl-c')[0]
    if ended or 'Traceback' in judged or 'process has died' in judged:
        raise Failed(output[-500:] or f'status {ended}')
    if program.returncode == -signal.SIGKILL:
        raise Failed(f'did not end within {END_LIMIT:g} s of Ctrl-C')
    words = shlex.split(command.text)
    if words[1:3] == ['topic', 'pub'] and 'publishing #' not in output:
        raise Failed(f'nothing was published: {output[-500:]}')
    # A line of dashes follows each message.
    if words[1:3] == ['topic', 'echo'] and '---' not in output:
        raise Failed(f'nothing was received: {output[-500:]}')


def run_command(command: Command, folder: Path) -> None:
    """Run a command that ends, and compare its output with the page."""
    try:
        result = subprocess.run(
            ['bash', '-c', command.text], cwd=folder, capture_output=True, text=True,
            timeout=COMMAND_LIMIT, check=False)
    except subprocess.TimeoutExpired:
        raise Failed(f'no end within {COMMAND_LIMIT:g} s') from None
    output = result.stdout + result.stderr
    if result.returncode or 'failed' in output or 'success=False' in output:
        raise Failed(f'status {result.returncode}: {output[-500:]}')
    if command.expected.startswith('data: ') and command.expected.split(',')[0] not in output:
        raise Failed(f'{command.expected!r} expected: {output[-500:]}')
    if re.fullmatch(r'[-\d., ]+', command.expected):
        seen = [float(number) for number in re.findall(r': (-?[\d.]+(?:e-?\d+)?)$', output, re.M)]
        wanted = [float(number) for number in command.expected.split(',')]
        if len(seen) != len(wanted) or any(
                abs(one - other) > TOLERANCE for one, other in zip(seen, wanted, strict=True)):
            raise Failed(f'{wanted} expected: {seen}')


def ends(command: Command) -> bool:
    """Return whether a command ends by itself."""
    words = shlex.split(command.text)
    if words[1] == 'topic':
        return '--once' in words or '-1' in words
    return words[1] not in ('run', 'launch') or bool(
        {'--once', '--show-args'} & {*words})


def run(command: Command, folder: Path) -> None:
    """Run a command, again where its result takes time; raises Failed."""
    for attempt in range(ATTEMPTS):
        try:
            return (run_command if ends(command) else run_program)(command, folder)
        except Failed:
            if attempt == ATTEMPTS - 1:
                raise
            time.sleep(1.0)
    return None


def main() -> int:
    """Run the commands; return the exit status."""
    parser = argparse.ArgumentParser(description=(__doc__ or '').strip().partition('\n')[0])
    parser.add_argument('pages', nargs='*', help='such as safety.md; by default all')
    pages = parser.parse_args().pages
    os.environ['ROS_DOMAIN_ID'] = str(random.randrange(1, 101))
    os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] = 'LOCALHOST'
    os.environ['SHARE'] = subprocess.run(
        ['ros2', 'pkg', 'prefix', '--share', PACKAGE], capture_output=True, text=True,
        check=True).stdout.strip()
    failures = 0
    with tempfile.TemporaryDirectory() as name, contextlib.ExitStack() as stage:
        folder = Path(name)
        os.environ['ROS_LOG_DIR'] = name
        (folder / 'boat.yaml').write_text(
            Path(os.environ['SHARE'], 'config', 'bridge.yaml').read_text())
        (folder / 'light.key').touch(0o600)
        (folder / 'light.key').write_text(random.randbytes(32).hex())
        devices: list[str] = []
        for command in commands():
            if pages and command.page not in pages:
                continue
            # A node of the stage would have the ports and names of a program that is run.
            wanted = list(STAGE) if ends(command) or command.text.startswith('ros2 topic') else []
            if wanted != devices:
                stage.close()
                devices = wanted
                for text in devices:
                    stage.enter_context(started(text, folder))
                time.sleep(RUNNING_TIME if devices else 0.0)
            reason = missing(command)
            outcome = 'skipped' if reason else 'OK'
            try:
                if not reason:
                    run(command, folder)
            except Failed as failed:
                failures, outcome, reason = failures + 1, 'FAILED', str(failed)
            print(f'{outcome:8}{command.page:16}{command.text}'
                  + (f'\n{"":24}{reason}' if reason else ''), flush=True)
    subprocess.run(['ros2', 'daemon', 'stop'], capture_output=True, check=False)
    return 1 if failures else 0


if __name__ == '__main__':
    sys.exit(main())
