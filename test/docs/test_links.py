# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The form of the Markdown pages: links, lines, map."""

from pathlib import Path
import re

import pytest

ROOT = Path(__file__).parents[2]
README = ROOT / 'README.md'
PAGES = [*sorted(ROOT.glob('*.md')), *sorted((ROOT / 'doc').glob('*.md'))]
LONGEST = 120


def without_code(page: Path) -> str:
    """Return a page without its blocks of code."""
    return re.sub(r'^ *(```|~~~).*?^ *\1', '', page.read_text(), flags=re.MULTILINE | re.DOTALL)


def links(page: Path) -> list[str]:
    """Return the targets of the links of a page, except web addresses."""
    targets = re.findall(r'\]\(([^)\s]+)\)', without_code(page))
    return [target for target in targets if not target.startswith('http')]


def anchors(page: Path) -> set[str]:
    """Return the anchors that GitHub makes of the headings of a page."""
    headings = re.findall(r'^#+ (.+)$', without_code(page), re.MULTILINE)
    return {re.sub(r'[^\w\- ]', '', heading.lower()).replace(' ', '-') for heading in headings}


@pytest.mark.parametrize('page', PAGES, ids=lambda page: page.name)
def test_every_link_of_a_page_has_a_target(page: Path) -> None:
    for link in links(page):
        path, _, anchor = link.partition('#')
        target = page.parent / path if path else page

        assert target.exists(), link
        assert not anchor or anchor in anchors(target), link


@pytest.mark.parametrize('page', PAGES, ids=lambda page: page.name)
def test_lines_except_table_rows_are_wrapped(page: Path) -> None:
    long = [line for line in without_code(page).splitlines()
            if len(line) > LONGEST and not re.match(r'\||!\[', line)]

    assert long == []


def test_the_map_lists_every_page_once() -> None:
    pages = re.findall(r'\]\((\w+\.md)\)', (ROOT / 'doc' / 'README.md').read_text())

    assert sorted(pages) == sorted(
        page.name for page in (ROOT / 'doc').glob('*.md') if page.name != 'README.md')
