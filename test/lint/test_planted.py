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

"""What is planted is found: none of the linters' plugins is missing, none of their rules off."""

from pathlib import Path
import subprocess
import sys

import pytest

ROOT = Path(__file__).parents[2]
pytestmark = pytest.mark.timeout(300)
PROPERTY = '''class Light:
    """A light."""

    @property
    def name(self) -> str:
        """The name."""
        return ''
'''
FLAKE8 = {
    'A001': 'list = 1\n',
    'A002': 'def act(id):\n    return id\n',
    'B901': 'try:\n    print()\nexcept:\n    pass\n',
    'C408': 'things = dict()\n',
    'CNL100': 'class Light:\n    def act(self):\n        pass\n',
    'D300': "def act():\n    '''Act.'''\n",
    'D400': 'def act():\n    """Act"""\n',
    'E128': 'print(1,\n  2)\n',
    'E303': 'import os\n\n\n\nprint(os)\n',
    'E501': f'number = {"1" * 99}\n',
    'E711': 'def act(a):\n    return a == None\n',
    'F401': 'import os\n',
    'F811': 'def act():\n    pass\n\n\ndef act():\n    pass\n',
    'F841': 'def act():\n    number = 1\n',
    'I100': 'import sys\nimport os\nprint(os, sys)\n',
    'I101': 'from os import sep, path\nprint(path, sep)\n',
    'I201': 'import os\nimport pytest\nprint(os, pytest)\n',
    'Q000': 'name = "light"\n',
    'W291': 'number = 1 \n',
    'W391': 'number = 1\n\n',
}
PEP257 = {code: source for code, source in FLAKE8.items() if code.startswith('D')} | {
    'D213': 'def act():\n    """Act.\n\n    And more.\n    """\n', 'D401': PROPERTY}
# What ruff calls it, and its source; the rest is left to flake8.
RUFF = {code: code for code in FLAKE8
        if code[0] in 'CDEFQ' and code not in ('CNL100', 'E128', 'E303')} | {
    'B901': 'E722', 'I100': 'I001', 'I101': 'I001', 'I201': 'I001', 'W291': 'W291'}


def found(linter: str, folder: Path, sources: dict[str, str]) -> str:
    """Return what a linter of ament prints of some sources."""
    pytest.importorskip(f'ament_{linter}.main', reason=f'ament_{linter} is not installed')
    for code, source in sources.items():
        (folder / f'planted_{code.lower()}.py').write_text(source)
    outcome = subprocess.run(
        [sys.executable, '-m', f'ament_{linter}.main', '.'], cwd=folder, text=True,
        stdout=subprocess.PIPE, stderr=subprocess.STDOUT, timeout=120)
    assert outcome.returncode == 1, outcome.stdout
    return outcome.stdout


@pytest.fixture(scope='module')
def flake8(tmp_path_factory: pytest.TempPathFactory) -> str:
    """Return what ament_flake8 finds."""
    return found('flake8', tmp_path_factory.mktemp('flake8'), FLAKE8)


@pytest.fixture(scope='module')
def pep257(tmp_path_factory: pytest.TempPathFactory) -> str:
    """Return what ament_pep257 finds."""
    return found('pep257', tmp_path_factory.mktemp('pep257'), PEP257)


@pytest.mark.parametrize('code', FLAKE8)
def test_ament_flake8_finds(flake8: str, code: str) -> None:
    assert any(f'planted_{code.lower()}.py' in line and f' {code} ' in line
               for line in flake8.splitlines())


@pytest.mark.parametrize('code', PEP257)
def test_ament_pep257_finds(pep257: str, code: str) -> None:
    assert any(f'planted_{code.lower()}.py' in line and f' {code}: ' in line
               for line in pep257.splitlines())


@pytest.mark.parametrize('code', RUFF)
def test_ruff_finds(code: str) -> None:
    """It is quicker, and puts right what it can."""
    pytest.importorskip('ruff', reason='ruff is not installed')

    outcome = subprocess.run(
        [sys.executable, '-m', 'ruff', 'check', '--no-cache', '--output-format=concise',
         '--stdin-filename', 'planted.py', '-'],
        cwd=ROOT, input=FLAKE8[code], text=True, capture_output=True, timeout=120)

    assert f' {RUFF[code]} ' in outcome.stdout
