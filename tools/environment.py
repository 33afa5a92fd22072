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
Make ``.venv`` with all that the demonstration and the tests need, and show what is going on.

Runs with any Python from 3.7 and looks for one that there are ROS 2 Jazzy wheels for. Where ROS
is sourced (ROS_DISTRO is set) its own rclpy is used, and only what it lacks is installed.
"""

import hashlib
import os
from pathlib import Path
import platform
import shutil
import subprocess
import sys
import time

ROOT = Path(__file__).resolve().parent.parent
VENV = ROOT / '.venv'
VERSIONS = ((3, 12), (3, 11), (3, 10), (3, 13))

# Lower bounds: the oldest with which the tests have passed. The wheels of ROS 2 Jazzy stand in
# for a ROS installation; nothing of them is needed where ROS is sourced.
ROS = ['ros-jazzy-rclpy[fastrtps]>=7.1', 'ros-jazzy-common-interfaces>=5.3']
# rich, 14 MB with what it brings, draws the monitor; nothing else needs it.
PACKAGE = ['pymavlink>=2.4.50', 'fastcrc>=0.3', 'pyserial>=3.5', 'rich>=13.3']
TEST = ['pytest>=8', 'pytest-timeout>=2.3', 'pytest-xdist>=3.5', 'hypothesis>=6.100',
        'pyyaml>=6', 'ruff>=0.8', 'mypy>=1.13', 'colcon-common-extensions>=0.3',
        'catkin_pkg>=0.5',
        # Draws the plots of the benchmark, which would rot untested.
        'matplotlib>=3.9']
# ROS's linters, which a ROS installation has, and the plugins for flake8 that rosdep and setup-ros
# install with them. flake8-builtins as in Ubuntu 24.04: later ones have rules that ROS does not.
LINT = ['ros-ament-lint>=0.17', 'ros-ament-flake8>=0.17', 'ros-ament-pep257>=0.17', 'flake8>=7',
        'pydocstyle>=6.3', 'flake8-blind-except>=0.2.1', 'flake8-builtins>=2.1,<2.2',
        'flake8-class-newline>=1.6', 'flake8-comprehensions>=3.14', 'flake8-deprecated>=2.2',
        'flake8-docstrings>=1.6', 'flake8-import-order>=0.18', 'flake8-quotes>=3.4']
# A router for the tests, alone: run without a display it needs none of the gigabyte of graphics
# packages that it asks for.
ALONE = ['MAVProxy>=1.8.70']


def fail(reason):
    """Say what is wrong and end with status 1."""
    sys.exit('environment: ' + reason)


def version_of(python):
    """Return major and minor version of an interpreter, None if it does not run."""
    try:
        text = subprocess.check_output(
            [python, '-c', 'import sys; print(*sys.version_info[:2])'],
            stderr=subprocess.DEVNULL, universal_newlines=True)
    except (OSError, subprocess.CalledProcessError):
        return None
    return tuple(map(int, text.split()))


def interpreter():
    """Return a Python that the packages exist for; ``PYTHON`` in the environment decides."""
    chosen = os.environ.get('PYTHON')
    if chosen or 'ROS_DISTRO' in os.environ:
        # ROS's own modules are made for one Python, the system's.
        python = shutil.which(chosen or 'python3')
        if python is None or version_of(python) is None:
            fail('{} is no Python'.format(chosen or 'python3'))
        return python
    names = ['python3'] + ['python{}.{}'.format(*version) for version in VERSIONS]
    for name in names:
        python = shutil.which(name)
        if python and version_of(python) in VERSIONS:
            return python
    return fail('no Python 3.10 to 3.13 found (looked for {}); there are ROS 2 wheels for these '
                'only'.format(', '.join(names)))


def requirements():
    """Return what is to be installed."""
    if 'ROS_DISTRO' in os.environ:
        return PACKAGE + TEST
    if platform.machine() not in ('x86_64', 'AMD64') or not sys.platform.startswith('linux'):
        fail(f'the ROS 2 wheels are for x86_64 Linux, this is {platform.machine()} '
             f'{sys.platform}; source a ROS 2 Jazzy installation first')
    return ROS + PACKAGE + TEST + LINT


def make_venv(python):
    """Make an empty virtual environment."""
    options = ['--system-site-packages'] if 'ROS_DISTRO' in os.environ else []
    shutil.rmtree(str(VENV), ignore_errors=True)
    result = subprocess.run(
        [python, '-m', 'venv'] + options + [str(VENV)], stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT, text=True)
    if result.returncode:
        package = 'python{}.{}-venv'.format(*version_of(python))
        fail(f'{python} -m venv failed; on Debian and Ubuntu: apt install {package}\n'
             f'{result.stdout.strip()}')


def install(packages):
    """Install packages, one line of progress on a terminal, a few lines elsewhere."""
    start = time.time()
    # Inherited settings would redirect the installation, and ROS's own path is not for pip.
    environment = {name: value for name, value in os.environ.items()
                   if name not in ('PYTHONPATH', 'PYTHONHOME', 'PIP_TARGET', 'PIP_PREFIX',
                                   'PIP_USER', 'LD_LIBRARY_PATH')}
    pip = subprocess.Popen(
        [str(VENV / 'bin' / 'python'), '-m', 'pip', 'install', '--disable-pip-version-check',
         '--progress-bar', 'off'] + packages, env=environment, stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT, universal_newlines=True)
    lines = []
    shown = 0.0
    for line in pip.stdout:
        lines.append(line)
        doing = line.strip().split(' (from')[0]
        interactive = sys.stdout.isatty()
        due = time.time() - shown > (0.1 if interactive else 5.0)
        if doing.startswith(('Collecting', 'Downloading', 'Installing', 'Building')) and due:
            shown = time.time()
            text = f'  {shown - start:3.0f} s  {doing}'[:78]
            print('\r' + text.ljust(79) if interactive else text,
                  end='' if interactive else '\n', flush=True)
    if sys.stdout.isatty():
        print('\r' + ' ' * 79 + '\r', end='')
    if pip.wait():
        print(''.join(lines[-30:]))
        fail('pip could not install {}'.format(' '.join(packages)))
    print(f'  {time.time() - start:3.0f} s  installed')


def main():
    """Make the environment unless it is there and made of the same things."""
    python = interpreter()
    packages = requirements()
    recipe = repr((python, version_of(python), packages, ALONE, os.environ.get('ROS_DISTRO')))
    stamp = VENV / 'made-of'
    digest = hashlib.sha256(recipe.encode()).hexdigest()
    if stamp.exists() and stamp.read_text() == digest:
        return
    ros = 'ROS {} is sourced'.format(os.environ['ROS_DISTRO']) if 'ROS_DISTRO' in os.environ \
        else 'with ROS 2 Jazzy, 750 MB on disk'
    print('making .venv with Python {}.{} ({}); about a minute'.format(
        *version_of(python), ros), flush=True)
    make_venv(python)
    install(packages)
    install(['--no-deps'] + ALONE)
    stamp.write_text(digest)


if __name__ == '__main__':
    main()
