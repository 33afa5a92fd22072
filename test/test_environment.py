# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""tools/environment.py, which makes ``.venv``, with interpreters that only log their calls."""

import os
from pathlib import Path
import shutil
import subprocess
import sys

import pytest
from support.fork_server import handle_signals_by_default

ROOT = Path(__file__).parents[1]
PYTHON = r"""#!/bin/sh
echo "{version}: $*" >> {folder}/log
case "$*" in
  *import\ numpy*) echo numpy==1.26.4 ;;
  "-c "*) echo "$0 3.{version}" ;;
  "-m venv "*)
    for venv; do :; done
    mkdir -p "$venv/bin"
    echo "include-system-site-packages = $(echo "$*" | grep -q system-site && echo true)" \
        > "$venv/pyvenv.cfg"
    cp "$0" "$venv/bin/python" ;;
  "-m pip "*) cp {folder}/uv "$(dirname "$0")" ;;
esac
"""
# FAULT is a command that it runs instead of an installation.
UV = """#!/bin/sh
case "$*" in
  *--help) echo {options}; exit ;;
esac
echo "uv: $*" >> {folder}/log
eval "$FAULT"
"""
MAKE_AGAIN = '. When make is run again, it goes on from here\n'


class Project:
    """A copy of the tool in a folder, where Python 3.12 is installed."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        (folder / 'tools').mkdir()
        (folder / 'bin').mkdir()
        shutil.copy(ROOT / 'tools' / 'environment.py', folder / 'tools')
        shutil.copy(ROOT / 'pyproject.toml', folder)
        self.program('uv', UV, options='--group')
        self.program('bin/python3', PYTHON, version='12')

    def program(self, path: str, text: str, **values: str) -> None:
        """Write an executable."""
        (self.folder / path).parent.mkdir(parents=True, exist_ok=True)
        (self.folder / path).write_text(text.format(folder=self.folder, **values))
        (self.folder / path).chmod(0o755)

    def run(self, *arguments: str, machine: str = 'x86_64', **environment: str) -> tuple[int, str]:
        """Run the tool; return its exit status and output."""
        clean = {name: value for name, value in os.environ.items()
                 if name not in ('PYTHON', 'ROS_DISTRO')}
        path = f'{self.folder / "bin"}:/usr/bin:/bin'
        tool = ('import os, runpy, sys, types; '
                f'os.uname = lambda: types.SimpleNamespace(machine={machine!r}); '
                'sys.argv[0] = "tools/environment.py"; '
                'runpy.run_path(sys.argv[0], run_name="__main__")')
        outcome = subprocess.run(
            [sys.executable, '-c', tool, *(arguments or ('demo',))], cwd=self.folder,
            env={**clean, 'PATH': path, **environment}, text=True, timeout=60,
            stdout=subprocess.PIPE, stderr=subprocess.STDOUT, preexec_fn=handle_signals_by_default)
        return outcome.returncode, outcome.stdout

    def calls(self) -> str:
        """Return the calls since the last time, but those for versions."""
        log = self.folder / 'log'
        lines = log.read_text().splitlines() if log.exists() else []
        log.write_text('')
        return '\n'.join(line for line in lines if ' -c ' not in line)


@pytest.fixture
def project(tmp_path: Path) -> Project:
    return Project(tmp_path)


def test_demonstration_gets_its_packages_and_the_tests_add_theirs(project: Project) -> None:
    assert project.run('demo')[0] == 0
    venv = project.folder / '.venv'
    assert project.calls().splitlines() == [
        f'12: -m venv --without-pip {venv}',
        '12: -m ensurepip --default-pip',
        '12: -m pip install --only-binary uv --retries 2 uv>=0.7',
        f'uv: pip install --python {venv}/bin/python -r pyproject.toml --editable . '
        '--extra monitor --extra serial --group jazzy']

    assert project.run('test')[0] == 0
    assert project.calls() == (
        f'uv: pip install --python {venv}/bin/python -r pyproject.toml --editable . --all-extras '
        '--group test --group jazzy --group lint --group peers')


def test_nothing_is_installed_while_the_declared_packages_are_there(project: Project) -> None:
    project.run('test')
    project.calls()

    assert [project.run(use) for use in ('test', 'demo')] == [(0, '')] * 2
    assert project.calls() == ''

    text = (project.folder / 'pyproject.toml').read_text()
    (project.folder / 'pyproject.toml').write_text(text.replace('pymavlink>=', 'pymavlink>=9'))
    project.run('demo')
    assert project.calls().startswith('uv: pip install')


@pytest.mark.parametrize(('fault', 'message'), [
    ('echo "No space left on device (os error 28)"; exit 1',
     'the disk is full; the demonstration needs 0.5 GB, the tests 1.5'),
    ('echo "Caused by: error sending request for url (URL)"; exit 1',
     'no package index answers over the network'),
    ('echo "x No solution found"; exit 1', 'x No solution found\n'),
    ('kill -INT $PPID; sleep 5', 'interrupted'),
], ids=['full disk', 'no network', 'anything else', 'Ctrl-C'])
def test_failed_installation_is_explained_and_the_next_run_completes_it(
        project: Project, fault: str, message: str) -> None:
    status, output = project.run(FAULT=fault)
    assert (status, output.partition('\n')[2]) == (1, f'environment: {message}{MAKE_AGAIN}')

    status, output = project.run()
    assert (status, 'its installation was interrupted' in output) == (0, True)
    assert project.run() == (0, '')


def test_python_without_venv_module_is_explained(project: Project) -> None:
    project.program('bin/python3', PYTHON.replace(
        '"-m venv "*)', '"-m venv "*) echo "python3: No module named venv"; exit 1 ;; no)'),
        version='12')

    assert project.run()[1].endswith(
        'environment: this Python has no venv module; on Debian and Ubuntu: '
        f'sudo apt install python3-venv{MAKE_AGAIN}')


def test_rclpy_and_numpy_of_a_sourced_ros_are_used(project: Project) -> None:
    status, output = project.run('test', ROS_DISTRO='kilted')

    assert (status, 'the sourced ROS 2 Kilted' in output) == (0, True)
    calls = project.calls()
    assert 'venv --without-pip --system-site-packages ' in calls
    assert calls.endswith('--all-extras --group test numpy==1.26.4')


def test_another_distribution_than_the_sourced_one_is_refused(project: Project) -> None:
    assert project.run('test', 'kilted', ROS_DISTRO='jazzy') == (
        1, 'environment: ROS jazzy is sourced; use another terminal for ROS=kilted\n')


def test_venv_made_without_ros_is_made_anew_when_ros_is_sourced(project: Project) -> None:
    project.run()

    assert 'made without ROS, which is sourced now' in project.run(ROS_DISTRO='jazzy')[1]


@pytest.mark.parametrize('shim', ['exit 127', 'echo "$0 3.9"'], ids=['does not run', 'too old'])
def test_chosen_python_that_cannot_be_used_is_named(project: Project, shim: str) -> None:
    project.program('bin/python3.9', f'#!/bin/sh\n{shim}\n')

    status, output = project.run(PYTHON='python3.9')

    assert (status, project.calls()) == (1, '')
    assert output.startswith('environment: python3.9 starts no Python 3.10 to 3.13')


def test_machine_without_wheels_is_told_what_to_do(project: Project) -> None:
    status, output = project.run(machine='aarch64')

    assert (status, project.calls()) == (1, '')
    assert 'Source ROS 2 Jazzy, or use its image: see "Platforms" in doc/ros.md' in output
