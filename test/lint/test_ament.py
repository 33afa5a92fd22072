# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The linters of ROS, each skipped where it is not installed, and of the file headers."""

import hashlib
from importlib.metadata import distributions
from pathlib import Path
import shutil
import subprocess
import sys

import pytest

ROOT = Path(__file__).parents[2]
# xmllint loads its schemas from the network where the system has no copy.
LINTERS = [pytest.param(name, marks=[pytest.mark.linter, getattr(pytest.mark, name)])
           for name in ('flake8', 'pep257', 'xmllint')]


def digests() -> dict[str, str]:
    """Return a digest of each Python file and of the versions of all packages."""
    installed = repr(sorted((one.name, one.version) for one in distributions())).encode()
    return {hashlib.sha256(installed + path.read_bytes()).hexdigest(): str(path.relative_to(ROOT))
            for folder in ROOT.glob('[!._]*') for path in (folder, *folder.rglob('*.py'))
            if path.suffix == '.py'}


@pytest.mark.timeout(300)
@pytest.mark.parametrize('name', LINTERS)
def test_linter_finds_nothing(name: str, cache: pytest.Cache) -> None:
    program = shutil.which(f'ament_{name}', path=f'{Path(sys.executable).parent}:/usr/bin:/bin')
    program = program or shutil.which(f'ament_{name}')
    if program is None:
        pytest.skip(f'ament_{name} is not installed')
    # These are slow, and look at each file by itself.
    files, key = digests() if name in ('flake8', 'pep257') else {}, f'lint/{name}'
    paths = [path for digest, path in files.items() if digest not in cache.get(key, [])]
    if files and not paths:
        return

    outcome = subprocess.run([program, *paths], cwd=ROOT, text=True, timeout=290,
                             stdout=subprocess.PIPE, stderr=subprocess.STDOUT)

    assert outcome.returncode == 0, outcome.stdout
    cache.set(key, [*files])


def test_each_file_names_its_copyright_and_licence() -> None:
    pytest.importorskip('reuse')

    outcome = subprocess.run([sys.executable, '-m', 'reuse', 'lint'], cwd=ROOT, text=True,
                             timeout=100, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)

    assert outcome.returncode == 0, outcome.stdout
