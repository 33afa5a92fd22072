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

"""Licence headers and package.xml, checked without ament_copyright and ament_xmllint."""

import hashlib
from pathlib import Path
import re
import subprocess
from xml.etree import ElementTree

from catkin_pkg.package import parse_package
import pytest

ROOT = Path(__file__).parents[2]
HEADER = (ROOT / 'setup.py').read_text().partition('\n\n')[0]
# Of the licence as its authors publish it.
LICENCE = 'cfc7749b96f63bd31c3c42b5c471bf756814053e847c10f3eb003417bc523d30'


def files(pattern: str) -> list[Path]:
    """Return the files of this repository, or of the copy of it that is tested."""
    listed = subprocess.run(
        ['git', 'ls-files', '--cached', '--others', '--exclude-standard', pattern], cwd=ROOT,
        text=True, capture_output=True, check=False).stdout.split()
    found = [ROOT / name for name in listed] or list(ROOT.rglob(pattern))
    return sorted(path for path in found if path.exists() and not any(
        part.startswith('.') for part in path.relative_to(ROOT).parts))


def has_header(source: str) -> bool:
    """Return whether a file begins with the whole header, behind a shebang at most."""
    return re.sub(r'\A#!.*\n\n?', '', source).startswith(f'{HEADER}\n')


def words(text: str) -> str:
    """Return the words of a text, one blank apart."""
    return ' '.join(text.split())


def test_header_quotes_the_licence() -> None:
    notice = (ROOT / 'LICENSE').read_text().rpartition('Copyright [yyyy]')[2]
    _, _, terms = words(notice).partition('Licensed under')

    assert words(HEADER.replace('#', '')).endswith(f'Licensed under{terms}')


@pytest.mark.parametrize('path', files('*.py'), ids=lambda path: str(path.relative_to(ROOT)))
def test_file_begins_with_the_licence_header(path: Path) -> None:
    assert has_header(path.read_text())


def test_licence_is_complete() -> None:
    assert hashlib.sha256((ROOT / 'LICENSE').read_bytes()).hexdigest() == LICENCE


def test_contributing_quotes_the_terms_of_the_licence() -> None:
    licence = words((ROOT / 'LICENSE').read_text())
    terms = re.search(r'5\. Submission of Contributions\..*?such Contributions\.', licence)

    assert terms is not None
    assert terms[0] in words((ROOT / 'CONTRIBUTING.md').read_text())


@pytest.mark.parametrize('path', files('*.xml'), ids=lambda path: str(path.relative_to(ROOT)))
def test_xml_file_is_well_formed(path: Path) -> None:
    ElementTree.parse(path)


def test_manifest_is_valid_by_rep_149() -> None:
    warnings: list[str] = []

    package = parse_package(str(ROOT / 'package.xml'), warnings=warnings)

    assert (package.package_format, package.get_build_type(), warnings) == (
        3, 'ament_python', [])
    assert {url.type for url in package.urls} == {'website', 'repository', 'bugtracker'}
    assert [(ROOT / licence.file).is_file() for licence in package.licenses] == [True]
