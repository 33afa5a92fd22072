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

"""The package's metadata, as the tools of ROS and pip read it."""

import ast
from pathlib import Path
import shutil
import subprocess
import sys

from catkin_pkg.changelog import get_changelog_from_path
from catkin_pkg.package import parse_package
from catkin_pkg.package_version import (
    get_forthcoming_label,
    update_changelog_sections,
    update_versions,
)
import pytest
import yaml

ROOT = Path(__file__).parents[1]
PACKAGE = 'illuminator_ros'
# Modules whose rosdep key is another than their name; fastcrc comes with pymavlink.
KEYS = {'fastcrc': 'python3-pymavlink-pip', 'hypothesis': 'python3-hypothesis',
        'pymavlink': 'python3-pymavlink-pip', 'pytest': 'python3-pytest',
        'rich': 'python3-rich', 'scipy': 'python3-scipy', 'serial': 'python3-serial',
        'yaml': 'python3-yaml',
        'catkin_pkg': 'python3-catkin-pkg-modules'}

pytestmark = pytest.mark.timeout(300)
# Extras of setup.py.
OPTIONAL = {'python3-rich'}
# Without a rosdep key; tests skip where it is absent.
PEERS = {'mavsdk'}


def imported(folder: Path) -> set[str]:
    """Return the modules that the Python files of a folder import, of whatever package."""
    names = set()
    for path in folder.rglob('*.py'):
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.Import):
                names |= {alias.name.partition('.')[0] for alias in node.names}
            elif isinstance(node, ast.ImportFrom) and not node.level:
                names.add(str(node.module).partition('.')[0])
    return names - sys.stdlib_module_names


def output(folder: Path, *arguments: str) -> str:
    """Return what Python prints in a folder."""
    return subprocess.run([sys.executable, *arguments], cwd=folder, text=True, timeout=120,
                          capture_output=True, check=True).stdout.strip()


def versions(folder: Path) -> list[str]:
    """Return the version as package.xml, setup.py and the imported package have it."""
    return [
        parse_package(str(folder)).version,
        output(folder, 'setup.py', '--version').splitlines()[-1],
        output(folder, '-c', f'import {PACKAGE}; print({PACKAGE}.__version__)')]


@pytest.fixture
def copy(tmp_path: Path) -> Path:
    """Return a copy of what is released."""
    return shutil.copytree(ROOT, tmp_path / PACKAGE, ignore=shutil.ignore_patterns(
        '.*', '__pycache__', '*.egg-info', 'build', 'install', 'log', 'test'))


def test_version_is_the_same_everywhere() -> None:
    assert len(set(versions(ROOT))) == 1


def test_release_sets_the_version_everywhere(copy: Path) -> None:
    update_versions({str(copy): parse_package(str(copy))}, '12.3.4')

    assert versions(copy) == ['12.3.4'] * 3


def test_release_names_the_forthcoming_changes(copy: Path) -> None:
    path = str(copy / 'CHANGELOG.rst')
    changelog = get_changelog_from_path(path, PACKAGE)
    label = get_forthcoming_label(changelog.rst)
    assert label == 'Forthcoming'

    update_changelog_sections({PACKAGE: (path, changelog, label)}, '12.3.4')

    released = get_changelog_from_path(path, PACKAGE)
    assert '``bridge``' in str(released.get_content_of_version('12.3.4')[0])


def test_package_declares_its_imports() -> None:
    declared = {depend.name for depend in parse_package(str(ROOT)).exec_depends}

    needed = {KEYS.get(name, name) for name in imported(ROOT / PACKAGE) - {PACKAGE}}

    assert needed - declared == OPTIONAL


def test_package_declares_what_its_launch_files_need() -> None:
    declared = {depend.name for depend in parse_package(str(ROOT)).exec_depends}

    assert {path.suffixes[-2:] == ['.launch', '.xml'] for path in ROOT.glob('launch/*')} == {True}
    assert declared >= {'ros2launch', 'launch_ros', 'launch_xml'}


def test_package_declares_the_imports_of_its_tests() -> None:
    package = parse_package(str(ROOT))
    declared = {depend.name for depend in package.exec_depends + package.test_depends}
    own = {path.stem for path in (*ROOT.glob('*'), *ROOT.glob('*/*'))} - {PACKAGE}

    modules = imported(ROOT / 'test') | imported(ROOT / PACKAGE)
    needed = {KEYS.get(name, name) for name in modules - own - {PACKAGE}}

    assert needed - declared - PEERS == set()


def test_quality_declaration_names_each_dependency() -> None:
    keys = {key: module for module, key in KEYS.items() if module != 'fastcrc'}
    titles = {'serial': 'pyserial', 'yaml': 'PyYAML'}
    text = (ROOT / 'QUALITY_DECLARATION.md').read_text().partition('5.i ROS')[2]

    for depend in parse_package(str(ROOT)).exec_depends:
        module = keys.get(depend.name, depend.name)
        assert titles.get(module, module) in text


def test_pip_installs_executables_with_names_that_hide_no_other_program(
    copy: Path, tmp_path: Path,
) -> None:
    pytest.importorskip('wheel', reason='wheel is not installed')
    output(copy, '-m', 'pip', 'install', '--no-index', '--no-deps', '--no-build-isolation',
           '--ignore-installed', '--prefix', str(tmp_path / 'prefix'), '.')

    assert {path.name for path in (tmp_path / 'prefix' / 'bin').iterdir()} == {
        f'illuminator-{name}' for name in (
            'bridge', 'conformance', 'gimbal', 'gimbal_manager', 'monitor', 'rededge',
            'simulator')}


def test_workflow_builds_on_jazzy_and_runs_ci_run() -> None:
    workflow = yaml.safe_load((ROOT / '.github' / 'workflows' / 'ci.yaml').read_text())
    jazzy, without_ros = (workflow['jobs'][name] for name in ('jazzy', 'without-ros'))
    steps = {step['uses'].partition('@')[0]: step for step in jazzy['steps']}

    # YAML 1.1 takes the key "on" for a truth value.
    assert set(workflow[True]) >= {'push', 'pull_request'}
    assert {job['runs-on'] for job in workflow['jobs'].values()} == {'ubuntu-24.04'}
    assert steps['ros-tooling/setup-ros']['with']['required-ros-distributions'] == 'jazzy'
    built = steps['ros-tooling/action-ros-ci']
    assert (built['with']['package-name'], built['with']['target-ros2-distro']) == (
        PACKAGE, 'jazzy')
    assert built['env']['PIP_BREAK_SYSTEM_PACKAGES'] == '1'
    [command] = [step['run'] for step in without_ros['steps'] if step.get('run') == '.ci/run']
    assert (ROOT / command).stat().st_mode & 0o111
