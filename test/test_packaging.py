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

from catkin_pkg.package import parse_package
from catkin_pkg.package_version import (
    update_versions,
)
import pytest

ROOT = Path(__file__).parents[1]
PACKAGE = 'illuminator_ros'
# Modules whose rosdep key differs from their name; fastcrc comes with pymavlink.
KEYS = {'fastcrc': 'python3-pymavlink-pip', 'hypothesis': 'python3-hypothesis',
        'numpy': 'python3-numpy',
        'pymavlink': 'python3-pymavlink-pip', 'pytest': 'python3-pytest',
        'scipy': 'python3-scipy', 'serial': 'python3-serial',
        'yaml': 'python3-yaml',
        'catkin_pkg': 'python3-catkin-pkg-modules'}

pytestmark = pytest.mark.timeout(300)
# Modules of the extra "monitor", without a rosdep key.
OPTIONAL = {'textual', 'textual_serve', 'aiohttp'}
# Further ones without a key. Tests skip if one is absent.
PEERS = {'mavsdk', *OPTIONAL}
# They make tf2_msgs where there is no ROS; a ROS installation has both.
GENERATORS = {'rosidl_adapter', 'rosidl_generator_c', 'rosidl_generator_py',
              'rosidl_generator_type_description', 'rosidl_typesupport_c',
              'rosidl_typesupport_fastrtps_c', 'rosidl_typesupport_introspection_c'}


def imported(folder: Path) -> set[str]:
    """Return the modules that the Python files of a folder import, of any package."""
    names = set()
    for path in folder.rglob('*.py'):
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.Import):
                names |= {alias.name.partition('.')[0] for alias in node.names}
            elif isinstance(node, ast.ImportFrom) and not node.level:
                names.add(str(node.module).partition('.')[0])
    # _typeshed exists for type checkers only.
    return names - sys.stdlib_module_names - {'_typeshed'}


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
    """Return a copy of the released files."""
    return shutil.copytree(ROOT, tmp_path / PACKAGE, ignore=shutil.ignore_patterns(
        '.*', '__pycache__', '*.egg-info', 'build', 'install', 'log', 'test'))


def test_version_is_the_same_everywhere() -> None:
    assert len(set(versions(ROOT))) == 1


def test_release_sets_the_version_everywhere(copy: Path) -> None:
    update_versions({str(copy): parse_package(str(copy))}, '12.3.4')

    assert versions(copy) == ['12.3.4'] * 3


def test_package_declares_its_imports() -> None:
    declared = {depend.name for depend in parse_package(str(ROOT)).exec_depends}

    needed = {KEYS.get(name, name) for name in imported(ROOT / PACKAGE) - {PACKAGE}}

    assert needed - declared == OPTIONAL


def test_package_declares_the_imports_of_its_tests() -> None:
    package = parse_package(str(ROOT))
    declared = {depend.name for depend in package.exec_depends + package.test_depends}
    own = {path.stem for path in (*ROOT.glob('*'), *ROOT.glob('*/*'))} - {PACKAGE}

    modules = imported(ROOT / 'test') | imported(ROOT / PACKAGE)
    needed = {KEYS.get(name, name) for name in modules - own - {PACKAGE}}

    assert needed - declared - PEERS - GENERATORS == set()


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
