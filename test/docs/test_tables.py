# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The tables that ``make doc-tables`` writes are those of the pages."""

from pathlib import Path

import pytest
from tools.doc_tables import DOC, ros_tables, tool_tables, with_rows, written


def differing(pages: dict[Path, str]) -> list[str]:
    return [path.name for path, text in pages.items() if text != path.read_text()]


def test_make_doc_tables_changes_no_table_of_the_tools() -> None:
    assert differing(written(tool_tables())) == []


def test_make_doc_tables_changes_no_table_of_ros_and_the_monitor() -> None:
    pytest.importorskip('rclpy')
    pytest.importorskip('textual')

    assert differing(written(ros_tables())) == []


def test_each_table_is_written_as_a_whole_and_nothing_else_changes() -> None:
    tables = tool_tables()
    pages = {path: path.read_text() for path in written(tables)}

    for (page, heading), rows in tables.items():
        text = pages[DOC / f'{page}.md']
        emptied = with_rows(text, heading, [])

        assert emptied.count('\n') == text.count('\n') - len([*rows])
        assert with_rows(emptied, heading, rows) == text


def test_a_table_that_a_page_has_not_or_has_twice_is_an_error() -> None:
    table = '| fault | effect |\n|---|---|\n| `one` | two |\n'

    for text in ('', table + '\n' + table):
        with pytest.raises(ValueError, match="tables 'fault'"):
            with_rows(text, 'fault', [])
