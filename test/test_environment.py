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

"""tools/environment.py, which makes ``.venv``, with interpreters that only log their calls."""

import os
from pathlib import Path
import shutil
import subprocess
import sys

import pytest

ROOT = Path(__file__).parents[1]
INTERPRETER = """#!/bin/sh
echo "{version}: $*" >> {log}
case "$1 $2" in
  "-c "*) echo "$0 3 {version}" ;;
  "-m venv") mkdir -p "$3/bin" && touch "$3/pyvenv.cfg" && cp "$0" "$3/bin/python" ;;
esac
"""


class Project:
    """A copy of the tool in a folder with a ``.venv`` of Python 3.11 and some interpreters."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.log = folder / 'log'
        self.log.touch()
        (folder / 'tools').mkdir()
        (folder / 'bin').mkdir()
        (folder / '.venv' / 'bin').mkdir(parents=True)
        (folder / '.venv' / 'pyvenv.cfg').touch()
        shutil.copy(ROOT / 'tools' / 'environment.py', folder / 'tools')
        self.program('.venv/bin/python', INTERPRETER.format(version=11, log=self.log))
        for version in (12, 13):
            self.program(f'bin/python3.{version}',
                         INTERPRETER.format(version=version, log=self.log))

    def program(self, path: str, text: str) -> None:
        """Write an executable."""
        (self.folder / path).write_text(text)
        (self.folder / path).chmod(0o755)

    def run(self, *arguments: str, **environment: str) -> tuple[int, str]:
        """Run the tool; return its exit status and output."""
        clean = {name: value for name, value in os.environ.items()
                 if name not in ('PYTHON', 'ROS_DISTRO')}
        path = f'{self.folder / "bin"}:/usr/bin:/bin'
        outcome = subprocess.run(
            [sys.executable, *(arguments or ('tools/environment.py',))], cwd=self.folder,
            env={**clean, 'PATH': path, **environment}, text=True, timeout=60,
            stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
        return outcome.returncode, outcome.stdout

    def calls(self) -> str:
        """Return the calls of the interpreters, the first words of each."""
        return self.log.read_text()


@pytest.fixture
def project(tmp_path: Path) -> Project:
    return Project(tmp_path)


def test_venv_of_another_python_is_kept_and_installed_into(project: Project) -> None:
    status, output = project.run()

    assert (status, output.splitlines()[0].startswith('installing into .venv')) == (0, True)
    assert '11: -m pip install' in project.calls()
    assert '-m venv' not in project.calls()


def test_venv_is_made_anew_if_python_asks_for_another_version(project: Project) -> None:
    status, output = project.run(PYTHON='python3.13')

    assert (status, 'PYTHON asks for another' in output) == (0, True)
    assert '13: -m venv' in project.calls()
    assert '13: -m pip install' in project.calls()


@pytest.mark.parametrize(('shim', 'message'), [
    ('echo "pyenv: python3.9: command not found" >&2; exit 127',
     'pyenv: python3.9: command not found'),
    ('echo "$0 3 9"', 'there are ROS 2 wheels for Python 3.10 to 3.13 only'),
], ids=['shim of a version that is not there', 'version without wheels'])
def test_chosen_python_that_cannot_be_used_is_explained(
    project: Project, shim: str, message: str,
) -> None:
    project.program('bin/python3.9', f'#!/bin/sh\n{shim}\n')

    status, output = project.run(PYTHON='python3.9')

    assert (status, message in output) == (1, True), output
    assert 'venv' not in project.calls()


def test_machine_without_wheels_gets_two_ways_to_go_on(project: Project) -> None:
    status, output = project.run('-c', (
        "import platform, runpy; platform.machine = lambda: 'aarch64'; "
        "runpy.run_path('tools/environment.py', run_name='__main__')"))

    assert (status, project.calls()) == (1, '')
    for text in ('this is aarch64', 'source /opt/ros/', 'docker run '):
        assert text in output
