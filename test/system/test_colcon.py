# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The package as ``colcon build`` installs it."""

import configparser
import contextlib
import os
from pathlib import Path
import re
import shlex
import shutil
import signal
import subprocess
import sys

import pytest
from support.ports import free_port
from support.processes import ended, environment, Program, python, ROOT
from support.ros import Ros

COLCON = shutil.which('colcon', path=f'{Path(sys.executable).parent}:/usr/bin')
LEFT_OUT = shutil.ignore_patterns(
    '.*', '__pycache__', '*.egg-info', 'build', 'install', 'log', 'tools')
EXECUTABLES = ('bridge', 'conformance', 'discover', 'doctor', 'monitor', 'set', 'simulator')

pytestmark = [pytest.mark.skipif(COLCON is None, reason='colcon is not installed'),
              pytest.mark.timeout(300)]


def colcon(workspace: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    """Run colcon as in a shell without packages of this project."""
    path = {'PATH': f'{Path(sys.executable).parent}:/usr/bin:/bin'}
    return subprocess.run([str(COLCON), *arguments], cwd=workspace, text=True, timeout=120,
                          capture_output=True, env={**environment(path), 'PYTHONPATH': ''})


@pytest.fixture(scope='module')
def workspace(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a workspace with a copy of the package, built."""
    workspace = tmp_path_factory.mktemp('workspace')
    shutil.copytree(ROOT, workspace / 'src' / 'illuminator_ros', ignore=LEFT_OUT)
    outcome = colcon(workspace, 'build')
    assert outcome.returncode == 0, outcome.stderr
    return workspace


@pytest.fixture(scope='module')
def prefix(workspace: Path) -> Path:
    """Return the install prefix of the package."""
    return workspace / 'install' / 'illuminator_ros'


@pytest.fixture
def installed(prefix: Path) -> dict[str, str]:
    """Return an environment in which the package is the installed one."""
    [site] = (prefix / 'lib').glob('python*/site-packages')
    return {'PYTHONPATH': str(site)}


def test_modules_and_files_that_ros_looks_for_are_installed(prefix: Path) -> None:
    [site] = (prefix / 'lib').glob('python*/site-packages')
    share = prefix / 'share' / 'illuminator_ros'
    modules = {path.relative_to(ROOT) for path in (ROOT / 'illuminator_ros').rglob('*.py')}
    files = {path.relative_to(ROOT) for folder in ('config', 'examples', 'launch')
             for path in (ROOT / folder).rglob('*.*') if path.suffix != '.pyc'}

    assert {path.relative_to(site) for path in site.glob('illuminator_ros/**/*.py')} == modules
    assert (site / 'illuminator_ros' / 'py.typed').is_file()
    assert [path for path in (*files, Path('package.xml')) if not (share / path).is_file()] == []
    assert (prefix / 'share/ament_index/resource_index/packages/illuminator_ros').is_file()


def test_executables_are_where_ros2_run_looks_for_them_and_print_their_help(
    prefix: Path, installed: dict[str, str], tmp_path: Path,
) -> None:
    folder = prefix / 'lib' / 'illuminator_ros'
    assert [name for name in EXECUTABLES if not os.access(folder / name, os.X_OK)] == []
    for name in ('bridge', 'simulator'):
        outcome = subprocess.run(
            [folder / name, '--help'], env=environment(installed), cwd=tmp_path, text=True,
            capture_output=True, timeout=30)

        assert (outcome.returncode, outcome.stderr) == (0, '')
        assert outcome.stdout.startswith(f'usage: {name} ')


def test_the_systemd_unit_is_installed_for_a_user_and_runs_two_lights(
        own_ros: Ros, workspace: Path, tmp_path: Path) -> None:
    # The page has the command that adapts the unit, and one for a virtual environment.
    adapt, _ = re.findall(r'^(sed .*) \|\n', (ROOT / 'doc' / 'ros.md').read_text(), re.M)
    text = subprocess.run(
        ['bash', '-c', adapt], capture_output=True, text=True, check=True, env={
            'USER': 'diver', 'HOME': str(tmp_path), 'SHARE': str(
                workspace / 'install/illuminator_ros/share/illuminator_ros')}).stdout
    assert '/home/pilot' not in text
    assert 'User=diver' in text
    unit = configparser.ConfigParser(interpolation=None)
    unit.optionxform = str  # type: ignore[assignment,method-assign]
    unit.read_string(text)
    service = unit['Service']
    (tmp_path / 'ws').symlink_to(workspace)
    command = service['ExecStart'].replace('/etc/illuminator_ros', str(tmp_path))
    path = f'{Path(sys.executable).parent}:/usr/bin:/bin'
    with contextlib.ExitStack() as stack:
        bridges = []
        for name in ('bow', 'stern'):
            url = f'127.0.0.1:{free_port()}'
            (tmp_path / f'{name}.yaml').write_text(
                (ROOT / 'config' / 'bridge.yaml').read_text().replace('127.0.0.1:14590', url))
            bridge = stack.enter_context(ended(Program(
                *shlex.split(command.replace('%i', name)),
                env={'ROS_DOMAIN_ID': str(own_ros.domain), 'PATH': path})))
            stack.enter_context(ended(python('illuminator_ros.simulator', f'udpout://{url}')))
            bridges.append((name, bridge))
        for name, bridge in bridges:
            bridge.wait_for(f'[{name}]: light 1/243 connected')
            cmdline = Path(f'/proc/{bridge.pid}/cmdline').read_text()
            assert cmdline.split('\0')[1].endswith('/bridge')
            assert bridge.end(signal.SIGTERM) == 0
    assert (service['Restart'], service['RestartPreventExitStatus']) == ('on-failure', '2')
    assert float(service['TimeoutStopSec']) > 2
    assert unit['Unit']['StartLimitIntervalSec'] == '0'
    if verify := shutil.which('systemd-analyze'):
        verified = subprocess.run(
            [verify, 'verify', str(ROOT / 'config' / 'illuminator@.service')],
            capture_output=True, text=True)
        assert (verified.returncode, verified.stderr) == (0, '')


def test_the_unit_for_a_virtual_environment_is_verified_and_differs_in_its_command(
    tmp_path: Path,
) -> None:
    def lines(name: str) -> list[str]:
        return [line for line in (ROOT / 'config' / name).read_text().splitlines()
                if not line.startswith('#')]

    units = [lines(f'illuminator{kind}@.service') for kind in ('', '_venv')]
    [command] = [one for one in units[1] if one not in units[0]]
    assert command.startswith('ExecStart=/home/pilot/venv/bin/illuminator-bridge --ros-args ')
    if verify := shutil.which('systemd-analyze'):
        # It has to find the command.
        unit = tmp_path / 'illuminator@.service'
        _, adapt = re.findall(r'^(sed .*) \|\n', (ROOT / 'doc' / 'ros.md').read_text(), re.M)
        adapted = subprocess.run(
            ['bash', '-c', adapt], capture_output=True, text=True, check=True,
            env={'USER': 'root', 'HOME': str(tmp_path), 'SHARE': str(ROOT)}).stdout
        assert '/home/pilot' not in adapted
        unit.write_text(adapted.replace(f'{tmp_path}/venv/bin/illuminator-bridge', sys.executable))
        verified = subprocess.run([verify, 'verify', str(unit)], capture_output=True, text=True)
        assert (verified.returncode, verified.stderr) == (0, '')
