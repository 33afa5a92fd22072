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
