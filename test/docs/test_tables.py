# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The tables that ``make doc-tables`` writes are those of the pages."""

from pathlib import Path

import pytest
from tools.doc_tables import ros_tables, tool_tables, written


def differing(pages: dict[Path, str]) -> list[str]:
    return [path.name for path, text in pages.items() if text != path.read_text()]


def test_make_doc_tables_changes_no_table_of_the_tools() -> None:
    assert differing(written(tool_tables())) == []


def test_make_doc_tables_changes_no_table_of_ros_and_the_monitor() -> None:
    pytest.importorskip('rclpy')
    pytest.importorskip('textual')

    assert differing(written(ros_tables())) == []
