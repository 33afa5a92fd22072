# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The package's metadata, as the tools of ROS and pip read it."""

import ast
import functools
from pathlib import Path
import re
import shutil
import subprocess
import sys

from catkin_pkg.package import parse_package
from illuminator_ros.cli.entry_point import OLDEST
from illuminator_ros.mavlink.transport.serial import OLDEST_PYSERIAL
import pytest
from support.ports import free_port
from support.processes import Program

ROOT = Path(__file__).parents[1]
PACKAGE = 'illuminator_ros'
# Modules and packages whose rosdep key differs from their name; fastcrc comes with pymavlink.
KEYS = {'fastcrc': 'python3-pymavlink-pip', 'hypothesis': 'python3-hypothesis',
        'numpy': 'python3-numpy',
        'pymavlink': 'python3-pymavlink-pip', 'pytest': 'python3-pytest',
        'pytest-timeout': 'python3-pytest-timeout', 'pyserial': 'python3-serial',
        'pyyaml': 'python3-yaml',
        'scipy': 'python3-scipy', 'serial': 'python3-serial',
        'yaml': 'python3-yaml',
        'catkin_pkg': 'python3-catkin-pkg-modules'}

pytestmark = pytest.mark.timeout(300)
# Modules of the extra "monitor", without a rosdep key; argcomplete comes with ros2cli.
# rich comes with textual, aiohttp with textual-serve.
OPTIONAL = {'textual', 'rich', 'textual_serve', 'aiohttp', 'argcomplete'}
# Further ones without a key. Tests skip if one is absent.
PEERS = {'cyclonedds', 'mavsdk', *OPTIONAL}


@functools.cache
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


def copy_to(folder: Path) -> Path:
    """Return a copy of the released files."""
    return shutil.copytree(ROOT, folder / PACKAGE, ignore=shutil.ignore_patterns(
        '.*', '__pycache__', '*.egg-info', 'build', 'install', 'log', 'test'))


@pytest.fixture
def copy(tmp_path: Path) -> Path:
    return copy_to(tmp_path)


def test_version_is_the_same_everywhere() -> None:
    assert len(set(versions(ROOT))) == 1


class Declared:
    """The requirements in pyproject.toml."""

    def __init__(self) -> None:
        tomllib = pytest.importorskip('tomllib', reason='Python 3.10 does not read TOML')
        text = tomllib.loads((ROOT / 'pyproject.toml').read_text())
        self.own: list[str] = text['project']['dependencies']
        self.extras: dict[str, list[str]] = text['project']['optional-dependencies']
        self.groups: dict[str, list[str]] = text['dependency-groups']

    def packages(self, *lists: list[str]) -> dict[str, str]:
        """Return the packages of lists, and the own ones, with the oldest version, '' if any."""
        return {re.split(r'\[|<|>', text)[0]: text.partition('>=')[2].partition(',')[0]
                for texts in (self.own, *lists) for text in texts}


@pytest.fixture
def declared() -> Declared:
    return Declared()


def test_package_xml_has_the_python_packages_of_pyproject(declared: Declared) -> None:
    package = parse_package(str(ROOT))
    programs = declared.packages(declared.extras['serial'], declared.extras['yaml'])
    tests = {**programs, **declared.packages(declared.extras['test'])}

    for names, depends in ((programs, package.exec_depends),
                           (tests, package.exec_depends + package.test_depends)):
        assert {KEYS[name] for name in names if name != 'setuptools'} == {
            depend.name for depend in depends if depend.name.startswith('python3-')}


def test_documentation_and_programs_name_the_oldest_versions_of_pyproject(
        declared: Declared) -> None:
    oldest = declared.packages(*declared.extras.values(), *declared.groups.values())
    texts = [(path.relative_to(ROOT), path.read_text()) for path in (
        ROOT / 'README.md', ROOT / 'Dockerfile', *ROOT.glob('doc/*.md'),
        *ROOT.glob('.github/*/*'), *(ROOT / PACKAGE).rglob('*.py'))]

    named = {(name, *pair) for name, text in texts
             for pair in re.findall(r"'([\w-]+)>=([\d.]+)'", text)}

    assert {name for name, _, _ in named} >= {Path('doc/monitor.md'), Path('doc/ros.md')}
    assert [one for one in named if oldest.get(one[1]) != one[2]] == []
    names = {'rclpy': 'ros-jazzy-rclpy', 'textual_serve': 'textual-serve'}
    assert [one for one in OLDEST.values() if oldest[names.get(one[0], one[0])] != one[1]] == []
    assert '.'.join(map(str, OLDEST_PYSERIAL)) == oldest['pyserial']


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

    assert needed - declared - PEERS == set()


@pytest.fixture(scope='module')
def installed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder into which pip has installed the package."""
    pytest.importorskip('wheel', reason='wheel is not installed')
    copy, folder = copy_to(tmp_path_factory.mktemp('clean')), tmp_path_factory.mktemp('prefix')
    output(copy, '-m', 'pip', 'install', '--no-index', '--no-deps', '--no-build-isolation',
           '--ignore-installed', '--prefix', str(folder), '.')
    return folder


def test_pip_installs_executables_with_names_that_hide_no_other_program(
        installed: Path) -> None:
    assert {path.name for path in (installed / 'bin').iterdir()} == {
        f'illuminator-{name}' for name in (
            'bridge', 'conformance', 'discover', 'doctor', 'gimbal', 'gimbal_manager',
            'monitor', 'rededge', 'set', 'simulator')}


def test_installed_tools_work(installed: Path) -> None:
    port, bin_ = free_port(), installed / 'bin'
    [site] = installed.glob('lib/python*/site-packages')
    env = {'PYTHONPATH': str(site)}
    simulator = Program(
        str(bin_ / 'illuminator-simulator'), f'udpin://127.0.0.1:{port}', env=env, cwd=site)
    try:
        simulator.wait_for('1/243')
        checks = Program(
            str(bin_ / 'illuminator-conformance'), f'udpout://127.0.0.1:{port}', '--yes',
            '--only', 'on', '--only', 'off', env=env, cwd=site)
        assert checks.wait() == 0, checks.log
        assert 'PASS' in checks.log
    finally:
        simulator.kill()
