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

"""The package as ``colcon build`` installs it."""

from collections.abc import Iterator
from pathlib import Path
import shutil
import subprocess
import sys

import pytest
from support.light import free_port
from support.processes import ended, environment, Program, ROOT
from support.ros import Parameters, Ros

COLCON = shutil.which('colcon', path=f'{Path(sys.executable).parent}:/usr/bin')
SOURCES = ('illuminator_ros', 'resource', 'config', 'launch', 'package.xml', 'setup.py',
           'setup.cfg', 'LICENSE', 'README.md')


pytestmark = pytest.mark.skipif(COLCON is None, reason='colcon is not installed')


@pytest.fixture(scope='module')
def prefix(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Build a copy of the package and return where it is installed."""
    workspace = tmp_path_factory.mktemp('workspace')
    source = workspace / 'src' / 'illuminator_ros'
    source.mkdir(parents=True)
    for name in SOURCES:
        if (ROOT / name).is_dir():
            shutil.copytree(ROOT / name, source / name,
                            ignore=shutil.ignore_patterns('__pycache__'))
        elif (ROOT / name).exists():
            shutil.copy(ROOT / name, source / name)
    path = {'PATH': f'{Path(sys.executable).parent}:/usr/bin:/bin'}
    subprocess.run([str(COLCON), 'build'], cwd=workspace, check=True, capture_output=True,
                   timeout=50, env={**environment(path), 'PYTHONPATH': ''})
    return workspace / 'install' / 'illuminator_ros'


@pytest.fixture
def installed(prefix: Path) -> dict[str, str]:
    """Return an environment in which the package is what is installed."""
    [site] = (prefix / 'lib').glob('python*/site-packages')
    return {'PYTHONPATH': str(site)}


@pytest.mark.parametrize('path', [
    'share/ament_index/resource_index/packages/illuminator_ros',
    'share/illuminator_ros/package.xml',
    'share/illuminator_ros/config/bridge.yaml',
])
def test_what_ros_looks_for_is_installed(prefix: Path, path: str) -> None:
    assert (prefix / path).is_file()


def test_all_of_the_package_is_installed(prefix: Path) -> None:
    [site] = (prefix / 'lib').glob('python*/site-packages')
    sources = {path.relative_to(ROOT) for path in (ROOT / 'illuminator_ros').rglob('*.py')}

    assert {path.relative_to(site) for path in site.glob('illuminator_ros/**/*.py')} == sources
    assert (site / 'illuminator_ros' / 'py.typed').is_file()


@pytest.mark.parametrize('name', ['bridge', 'conformance', 'monitor', 'simulator'])
def test_the_executables_are_where_ros2_run_looks(
    prefix: Path, installed: dict[str, str], name: str, tmp_path: Path,
) -> None:
    executable = prefix / 'lib' / 'illuminator_ros' / name

    outcome = subprocess.run([executable, '--help'], env=environment(installed), cwd=tmp_path,
                             text=True, capture_output=True, timeout=30)

    assert (outcome.returncode, outcome.stderr) == (0, '')
    assert outcome.stdout.startswith(f'usage: {name} ')


@pytest.fixture
def programs(
    prefix: Path, installed: dict[str, str], own_ros: Ros, tmp_path: Path,
) -> Iterator[tuple[Program, Program]]:
    """Run both as installed."""
    url = f'127.0.0.1:{free_port()}'
    env = {**installed, 'ROS_DOMAIN_ID': str(own_ros.domain)}
    executables = prefix / 'lib' / 'illuminator_ros'
    with (ended(Program(str(executables / 'bridge'), '--ros-args', '-p',
                        f'connection_url:=udpin://{url}', env=env, cwd=tmp_path)) as bridge,
          ended(Program(str(executables / 'simulator'), f'udpout://{url}', env=env,
                        cwd=tmp_path)) as simulator):
        yield bridge, simulator


def test_the_installed_programs_find_each_other(
    own_ros: Ros, programs: tuple[Program, Program],
) -> None:
    programs[0].wait_for('light 1/243 connected')

    assert Parameters(own_ros).set(brightness=60)[0].successful
