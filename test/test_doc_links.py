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

"""What the pages for people point at is there."""

from pathlib import Path
import re

import pytest

ROOT = Path(__file__).parents[1]
PAGES = [*sorted(ROOT.glob('*.md')), *sorted((ROOT / 'doc').glob('*.md'))]
README = ROOT / 'README.md'


def prose(page: Path) -> str:
    """Return a page without its blocks of code, in which brackets and ``#`` mean other things."""
    return re.sub(r'^ *(```|~~~).*?^ *\1', '', page.read_text(), flags=re.MULTILINE | re.DOTALL)


def links(page: Path) -> list[str]:
    """Return where a page points at, addresses on the web left out."""
    targets = re.findall(r'\]\(([^)\s]+)\)', prose(page))
    return [target for target in targets if not target.startswith('http')]


def anchors(page: Path) -> set[str]:
    """Return the anchors that a page's headings get on GitHub."""
    headings = re.findall(r'^#+ (.+)$', prose(page), re.MULTILINE)
    return {re.sub(r'[^\w\- ]', '', heading.lower()).replace(' ', '-') for heading in headings}


@pytest.mark.parametrize(
    ('page', 'link'), [(page, link) for page in PAGES for link in links(page)],
    ids=lambda value: value.name if isinstance(value, Path) else value)
def test_a_link_leads_somewhere(page: Path, link: str) -> None:
    path, _, anchor = link.partition('#')
    target = page.parent / path if path else page

    assert target.exists()
    assert not anchor or anchor in anchors(target)


@pytest.mark.parametrize('page', sorted((ROOT / 'doc').glob('*.md')), ids=lambda page: page.name)
def test_the_readme_lists_each_page(page: Path) -> None:
    _, _, index = prose(README).partition('## Documentation')

    assert f'](doc/{page.name})' in index


def test_the_readme_is_read_in_one_go() -> None:
    assert len(README.read_text().splitlines()) <= 260
