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
from xml.etree import ElementTree

import pytest
from support.light import eventually
from support.ports import free_port
from support.processes import ended, environment, Program, ROOT
from support.ros import Parameters, Ros

COLCON = shutil.which('colcon', path=f'{Path(sys.executable).parent}:/usr/bin')
LEFT_OUT = shutil.ignore_patterns(
    '.*', '__pycache__', '*.egg-info', 'build', 'install', 'log', 'bench', 'demo')
# A part that is quick: that all tests pass is for "make test" to say.
PART = ('test/mavlink/test_url.py', 'test/illuminator/test_uptime.py')
PLANTED = """def test_passes() -> None:
    assert True


def test_fails() -> None:
    assert False, 'planted'
"""

pytestmark = [pytest.mark.skipif(COLCON is None, reason='colcon is not installed'),
              pytest.mark.timeout(300)]


def colcon(workspace: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    """Run colcon as in a shell that knows of no package of ours."""
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
    """Return where the package is installed."""
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
    'share/illuminator_ros/config/diagnostics_aggregator.yaml',
    'share/illuminator_ros/config/foxglove_layout.json',
    'share/illuminator_ros/config/joystick.yaml',
    'share/illuminator_ros/config/plotjuggler_layout.xml',
    'share/illuminator_ros/config/sros2/illuminator.policy.xml',
    'share/illuminator_ros/launch/bridge.launch.xml',
    'share/illuminator_ros/launch/demo.launch.xml',
    'share/illuminator_ros/launch/joystick.launch.xml',
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


def results(workspace: Path) -> tuple[int, str]:
    """Return exit status and output of ``colcon test-result``."""
    outcome = colcon(workspace, 'test-result', '--verbose')
    return outcome.returncode, outcome.stdout


def test_colcon_test_runs_the_tests_with_pytest(workspace: Path) -> None:
    outcome = colcon(workspace, 'test', '--pytest-args', *PART)
    status, output = results(workspace)

    assert (outcome.returncode, status) == (0, 0), output
    assert '0 errors, 0 failures, 0 skipped' in output
    report = ElementTree.parse(workspace / 'build' / 'illuminator_ros' / 'pytest.xml')
    assert {case.get('classname') for case in report.iter('testcase')} == {
        'illuminator_ros.test.mavlink.test_url', 'illuminator_ros.test.illuminator.test_uptime'}


def test_a_test_that_fails_is_in_the_result(workspace: Path) -> None:
    planted = workspace / 'src' / 'illuminator_ros' / 'test' / 'test_planted.py'
    planted.write_text(PLANTED)

    outcome = colcon(workspace, 'test', '--return-code-on-test-failure', '--pytest-args',
                     'test/test_planted.py')
    status, output = results(workspace)

    assert (outcome.returncode, status) == (1, 1)
    assert '2 tests, 0 errors, 1 failure, 0 skipped' in output
    assert 'test_fails' in output


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

    # These live by the usual clock: on a machine that stands still a set may come too late.
    eventually(lambda: Parameters(own_ros).set(brightness=60)[0].successful)
