# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""
Make a virtual environment of what pyproject.toml declares for the demonstration or the tests.

``environment.py (demo | test) [jazzy | kilted]``, with any Python from 3.7, installs the wheels
of a ROS distribution into ``.venv`` or ``.venv-kilted``. Where ROS is sourced (ROS_DISTRO is set),
its own rclpy is used, and only the other packages are installed.
"""

from __future__ import annotations

import os
from pathlib import Path
import re
import shutil
import subprocess
import sys
import time

ROOT = Path(__file__).resolve().parent.parent
SOURCED = os.environ.get('ROS_DISTRO', '')
VERSIONS = ('3.12', '3.11', '3.10', '3.13')
# Options of uv: packages for any machine, and those that a ROS installation has. The tests
# include the demonstration.
PACKAGES = {'demo': ('--extra monitor --extra serial', '--group {}'),
            'test': ('--all-extras --group test', '--group {} --group lint --group peers')}
# Settings that redirect the installation; ROS's own paths are not for the installers.
REDIRECTIONS = 'PYTHON(PATH|HOME)|LD_LIBRARY_PATH|(PIP|UV)_(TARGET|PREFIX|USER|SYSTEM_PYTHON)'
# Signs in the output of an installer that failed, and the cause of each.
CAUSES = {
    'No space left on device': 'the disk is full; the demonstration needs 0.5 GB, the tests 1.5',
    'No module named .?(venv|ensurepip)':
        'this Python has no venv module; on Debian and Ubuntu: sudo apt install python3-venv',
    'onnection|sending request|resolution|timed out': 'no package index answers over the network'}
AGAIN = 'When make is run again, it goes on from here'


def output(*command: str) -> str:
    """Return what a command prints to stdout, '' if it does not run."""
    return subprocess.run(['env', *command], capture_output=True, text=True).stdout


def interpreter(command: str) -> tuple[str, str]:
    """Return the path of the Python that a command or shim starts, and its version; '' if none."""
    question = 'import sys; print(sys.executable, "%d.%d" % sys.version_info[:2])'
    return output(command, '-c', question).strip().rpartition(' ')[::2]


def find_interpreter() -> tuple[str, str]:
    """Return a Python that the packages exist for; ``PYTHON`` in the environment decides."""
    # ROS's own modules are made for one Python, the system's.
    chosen = os.environ.get('PYTHON') or SOURCED and 'python3'
    names = [chosen] if chosen else ['python3', *(f'python{version}' for version in VERSIONS)]
    for name in names:
        path, version = interpreter(name)
        if version in VERSIONS or SOURCED and version:
            return path, version
    sys.exit(f'environment: {" or ".join(names)} starts no Python 3.10 to 3.13, for which there '
             'are ROS 2 wheels; install one and name it: PYTHON=/path/to/python3.12 make demo')


def reason_for_new_venv(venv: Path, stamp: Path) -> str:
    """Return why a virtual environment must be replaced, '' if it can be kept."""
    version = interpreter(str(venv / 'bin' / 'python'))[1]
    if not version:
        return 'there is none that runs'
    if stamp.exists() and not stamp.read_text():
        return 'its installation was interrupted'
    if not SOURCED and version not in VERSIONS:
        return f'there are no ROS 2 wheels for its Python {version}'
    if os.environ.get('PYTHON') and find_interpreter()[1] != version:
        return f'it has Python {version}, and PYTHON asks for another'
    if SOURCED and 'packages = true' not in (venv / 'pyvenv.cfg').read_text():
        return 'it was made without ROS, which is sourced now'
    return ''


def run(*command: str) -> None:
    """Run a step and show its progress; if it fails, say why and end."""
    clean = {name: value for name, value in os.environ.items() if not re.match(REDIRECTIONS, name)}
    step = subprocess.Popen(command, cwd=str(ROOT), env=clean, stdout=subprocess.PIPE,
                            stderr=subprocess.STDOUT, text=True)
    text = ''
    for line in step.stdout or ():
        text += line
        if sys.stdout.isatty():
            print(f'  {line.strip()[:76]:76}', end='\r', flush=True)
    if step.wait():
        causes = [cause for sign, cause in CAUSES.items() if re.search(sign, text)]
        sys.exit(f'environment: {(causes or [text[-2000:]])[0]}. {AGAIN}')


def main(use: str, ros: str = '') -> None:
    """Make the environment unless it is there and has the packages."""
    venv = ROOT / ('.venv' if ros in ('', 'jazzy') else f'.venv-{ros}')
    ros = ros or SOURCED or 'jazzy'
    if SOURCED not in ('', ros):
        sys.exit(f'environment: ROS {SOURCED} is sourced; use another terminal for ROS={ros}')
    # Says what was installed; it is empty until then.
    stamp = venv / 'made-of'
    declared = (ROOT / 'pyproject.toml').read_text().partition('[tool.ruff]')[0] + SOURCED
    reason = reason_for_new_venv(venv, stamp)
    if not reason and stamp.exists() and stamp.read_text() in (declared + use, declared + 'test'):
        return
    if not SOURCED and (os.uname().machine, sys.platform) != ('x86_64', 'linux'):
        sys.exit('environment: there are ROS 2 wheels for x86_64 Linux only. Source ROS 2 '
                 f'{ros.title()}, or use its image: see "Platforms" in doc/ros.md')
    start = time.time()
    python, uv = (str(venv / 'bin' / name) for name in ('python', 'uv'))
    if reason:
        base, version = find_interpreter()
        print(f'making {venv.name} ({reason}): {base} (Python {version}) with '
              f'{"the sourced" if SOURCED else "wheels of"} ROS 2 {ros.title()}', flush=True)
        shutil.rmtree(str(venv), ignore_errors=True)
        options = ['--without-pip', *(['--system-site-packages'] if SOURCED else [])]
        run(base, '-m', 'venv', *options, str(venv))
    stamp.write_text('')
    own, more = PACKAGES[use]
    if SOURCED:
        # ROS's modules are compiled for this version; uv does not see the system's packages.
        more = output('python3', '-c', 'import numpy; print("numpy==" + numpy.__version__)')
    # An old one has not the option --group.
    found = shutil.which('uv') or uv
    if '--group' not in output(found, 'pip', 'install', '--help'):
        found = uv
        run(python, '-m', 'ensurepip', '--default-pip')
        run(python, '-m', 'pip', 'install', '--only-binary', 'uv', '--retries', '2', 'uv>=0.7')
    # Editable, so that the package and its commands work from each folder.
    run(found, 'pip', 'install', '--python', python, '-r', 'pyproject.toml', '--editable', '.',
        *own.split(), *more.format(ros).split())
    stamp.write_text(declared + use)
    print(f'{venv.name}: installed what make {use} needs in {time.time() - start:.0f} s')


if __name__ == '__main__':
    try:
        main(*sys.argv[1:])
    except (KeyboardInterrupt, OSError) as error:
        sys.exit(f'environment: {str(error) or "interrupted"}. {AGAIN}')
