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

"""
Make ``.venv`` with the packages of the demonstration and the tests, and show the progress.

Runs with any Python from 3.7 and looks for a Python that has ROS 2 Jazzy wheels. Where ROS
is sourced (ROS_DISTRO is set), its own rclpy is used, and only the other packages are installed.
"""

from __future__ import annotations

import hashlib
import os
from pathlib import Path
import platform
import shutil
import subprocess
import sys
import time
from typing import NoReturn

ROOT = Path(__file__).resolve().parent.parent
VENV = ROOT / '.venv'
VENV_PYTHON = str(VENV / 'bin' / 'python')
ROS_DISTRO = os.environ.get('ROS_DISTRO')
VERSIONS = ((3, 12), (3, 11), (3, 10), (3, 13))

# Lower bounds: the oldest with which the tests have passed. The wheels of ROS 2 Jazzy stand in
# for a ROS installation; nothing of them is needed where ROS is sourced.
ROS = ['ros-jazzy-rclpy[fastrtps]>=7.1', 'ros-jazzy-common-interfaces>=5.3']
# textual and textual-serve, 40 MB with what they bring, show the monitor; nothing else needs them.
PACKAGE = ['pymavlink>=2.4.50', 'fastcrc>=0.3', 'pyserial>=3.5', 'textual>=8',
           'textual-serve>=1.1']
TEST = ['pytest>=8', 'pytest-timeout>=2.3', 'pytest-xdist>=3.8', 'hypothesis>=6.100',
        'pyyaml>=6', 'wheel>=0.38', 'ruff>=0.8', 'mypy>=1.13', 'colcon-common-extensions>=0.3',
        'catkin_pkg>=0.5', 'scipy>=1.10', 'matplotlib>=3.8']
# ROS's linters, which a ROS installation has, and the plugins for flake8 that rosdep and setup-ros
# install with them. flake8-builtins as in Ubuntu 24.04: later ones have rules that ROS does not.
LINT = ['ros-ament-lint>=0.17', 'ros-ament-flake8>=0.17', 'ros-ament-pep257>=0.17', 'flake8>=7',
        'pydocstyle>=6.3', 'flake8-blind-except>=0.2.1', 'flake8-builtins>=2.1,<2.2',
        'flake8-class-newline>=1.6', 'flake8-comprehensions>=3.14', 'flake8-deprecated>=2.2',
        'flake8-docstrings>=1.6', 'flake8-import-order>=0.18', 'flake8-quotes>=3.4']
# Independent of ROS and of this package: a MAVLink stack, which is the other player at a gimbal in
# the tests; a reader of recordings; another middleware.
PEERS = ['mavsdk>=4.1', 'mcap>=1.2', 'mcap-ros2-support>=0.5', 'cyclonedds>=11.0']
# A router for the tests, alone: run without a display it needs none of the gigabyte of graphics
# packages that it asks for.
ALONE = ['MAVProxy>=1.8.70']


def fail(reason: str) -> NoReturn:
    """Print what is wrong and end with status 1."""
    sys.exit('environment: ' + reason)


class Interpreter:
    """
    A Python, asked for its version.

    :ivar path: the interpreter itself, not the shim of a version manager that starts it; '' if it
        does not run.
    :ivar error: what it printed if it does not run.
    """

    def __init__(self, command: str) -> None:
        self.path = self.error = ''
        self.version = (0, 0)
        try:
            result = subprocess.run(
                [command, '-c', 'import sys; print(sys.executable, *sys.version_info[:2])'],
                capture_output=True, text=True)
        except OSError as error:
            self.error = str(error)
            return
        if result.returncode:
            self.error = result.stderr.strip()
            return
        self.path, major, minor = result.stdout.rsplit(maxsplit=2)
        self.version = (int(major), int(minor))

    def __str__(self) -> str:
        return '{} (Python {}.{})'.format(self.path, *self.version)


def find_interpreter() -> Interpreter:
    """Return a Python that the packages exist for; ``PYTHON`` in the environment decides."""
    chosen = os.environ.get('PYTHON')
    if chosen or ROS_DISTRO:
        # ROS's own modules are made for one Python, the system's.
        python = Interpreter(chosen or 'python3')
        if not python.path:
            fail(f'{chosen or "python3"} does not run:\n{python.error}')
        if not ROS_DISTRO and python.version not in VERSIONS:
            fail(f'{python} cannot be used: there are ROS 2 wheels for Python 3.10 to 3.13 only')
        return python
    names = ['python3', *('python{}.{}'.format(*version) for version in VERSIONS)]
    for name in names:
        python = Interpreter(name)
        if python.version in VERSIONS:
            return python
    fail(f'no Python 3.10 to 3.13 found (looked for {", ".join(names)}); there are ROS 2 wheels '
         'for these only. Install one and name it: PYTHON=/path/to/python3.12 make demo')


def requirements() -> list[str]:
    """Return the packages to install."""
    if ROS_DISTRO:
        return PACKAGE + TEST
    if platform.machine() not in ('x86_64', 'AMD64') or not sys.platform.startswith('linux'):
        fail(f'there are ROS 2 wheels for x86_64 Linux only, and this is {platform.machine()} '
             f'{sys.platform}. Either install ROS 2 Jazzy\n'
             '(https://docs.ros.org/en/jazzy/Installation.html) and run\n'
             '  source /opt/ros/jazzy/setup.bash && make demo\n'
             'or use its image, which exists for arm64 too:\n'
             '  docker run --rm -v "$PWD":/src -w /src ros:jazzy bash -c "apt-get update && '
             'apt-get install -y make python3-venv && make demo"')
    return ROS + PACKAGE + TEST + LINT + PEERS


def reason_for_new_venv() -> str:
    """Return why ``.venv`` must be replaced, '' if it can be kept, whatever its Python is."""
    if not VENV.exists():
        return 'there is none'
    old = Interpreter(VENV_PYTHON)
    if not old.path:
        return 'its Python does not run'
    if os.environ.get('PYTHON') and find_interpreter().version != old.version:
        return 'it has Python {}.{}, and PYTHON asks for another'.format(*old.version)
    if not ROS_DISTRO and old.version not in VERSIONS:
        return 'there are no ROS 2 wheels for its Python {}.{}'.format(*old.version)
    settings = (VENV / 'pyvenv.cfg').read_text()
    if ROS_DISTRO and 'include-system-site-packages = true' not in settings:
        return 'it was made without ROS, which is sourced now'
    return ''


def make_venv(python: Interpreter) -> None:
    """Make an empty virtual environment."""
    options = ['--system-site-packages'] if ROS_DISTRO else []
    shutil.rmtree(str(VENV), ignore_errors=True)
    result = subprocess.run(
        [python.path, '-m', 'venv', *options, str(VENV)], stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT, text=True)
    if result.returncode:
        package = 'python{}.{}-venv'.format(*python.version)
        fail(f'{python.path} -m venv failed; on Debian and Ubuntu: apt install {package}\n'
             f'{result.stdout.strip()}')


def install(packages: list[str]) -> None:
    """Install packages, one line of progress on a terminal, a few lines elsewhere."""
    start = time.time()
    # Inherited settings would redirect the installation, and ROS's own path is not for pip.
    environment = {name: value for name, value in os.environ.items()
                   if name not in ('PYTHONPATH', 'PYTHONHOME', 'PIP_TARGET', 'PIP_PREFIX',
                                   'PIP_USER', 'LD_LIBRARY_PATH')}
    pip = subprocess.Popen(
        [VENV_PYTHON, '-m', 'pip', 'install', '--disable-pip-version-check',
         '--progress-bar', 'off', *packages], env=environment, stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT, universal_newlines=True)
    lines = []
    shown = 0.0
    interactive = sys.stdout.isatty()
    for line in pip.stdout or ():
        lines.append(line)
        doing = line.strip().split(' (from')[0]
        due = time.time() - shown > (0.1 if interactive else 5.0)
        if doing.startswith(('Collecting', 'Downloading', 'Installing', 'Building')) and due:
            shown = time.time()
            text = f'  {shown - start:3.0f} s  {doing}'[:78]
            print('\r' + text.ljust(79) if interactive else text,
                  end='' if interactive else '\n', flush=True)
    if interactive:
        print('\r' + ' ' * 79 + '\r', end='')
    if pip.wait():
        print(''.join(lines[-30:]))
        fail(f'pip could not install {" ".join(packages)}')
    print(f'  {time.time() - start:3.0f} s  installed')


def main() -> None:
    """Make the environment unless it is there and has the packages."""
    packages = requirements()
    digest = hashlib.sha256(repr((packages, ALONE, ROS_DISTRO)).encode()).hexdigest()
    stamp = VENV / 'made-of'
    reason = reason_for_new_venv()
    if not reason and stamp.exists() and stamp.read_text() == digest:
        return
    if reason:
        python = find_interpreter()
        ros = f'ROS {ROS_DISTRO} is sourced' if ROS_DISTRO else 'with ROS 2 Jazzy, 810 MB on disk'
        print(f'making .venv ({reason}) with {python}; {ros}; about a minute', flush=True)
        make_venv(python)
    else:
        print(f'installing into .venv, {Interpreter(VENV_PYTHON)}', flush=True)
    install(packages)
    install(['--no-deps', *ALONE])
    stamp.write_text(digest)


if __name__ == '__main__':
    main()
