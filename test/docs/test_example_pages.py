# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Pages show each program of examples/ whole, and import what there is."""

from pathlib import Path
import re

import pytest
from support.processes import ROOT

PAGES = [path.read_text() for path in (ROOT / 'doc').glob('*.md')]


@pytest.mark.parametrize('example', sorted((ROOT / 'examples').glob('*.py')),
                         ids=lambda path: path.stem)
def test_an_example_is_whole_in_one_page_but_for_its_licence(example: Path) -> None:
    program = example.read_text().partition('\n\n')[2]

    assert [page.count(f'```python\n{program}```') for page in PAGES
            if f'examples/{example.name}' in page] == [1]
    assert len(re.findall('^# Change these: ', program, re.M)) == 1


@pytest.mark.parametrize('line', sorted(
    {*re.findall('^from illuminator_ros.* import .*', '\n'.join(PAGES), re.M)}))
def test_a_page_imports_what_the_package_has(line: str) -> None:
    exec(line, {})
