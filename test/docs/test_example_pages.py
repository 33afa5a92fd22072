# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Pages link to each program of examples/, and import what there is."""

from pathlib import Path
import re

import pytest
from support.processes import ROOT

PAGES = [path.read_text() for path in (ROOT / 'doc').glob('*.md')]


@pytest.mark.parametrize('example', sorted((ROOT / 'examples').glob('*.py')),
                         ids=lambda path: path.stem)
def test_an_example_has_a_link_and_the_command_that_copies_it_in_one_page(example: Path) -> None:
    assert [page.count(f'/examples/{example.name} .') for page in PAGES
            if f'](../examples/{example.name})' in page] == [1]
    assert len(re.findall('^# Change these: ', example.read_text(), re.M)) == 1


@pytest.mark.parametrize('line', sorted(
    {*re.findall('^from illuminator_ros.* import .*', '\n'.join(PAGES), re.M)}))
def test_a_page_imports_what_the_package_has(line: str) -> None:
    exec(line, {})
