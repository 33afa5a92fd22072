# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The messages in the tables of answers and symptoms, compared with the texts of the package."""

import ast
from pathlib import Path
import re

import pytest
from support.tables import table

ROOT = Path(__file__).parents[2]
ANSWERS, SYMPTOMS = (
    (ROOT / 'doc' / f'{page}.md').read_text() for page in ('protocol', 'troubleshooting'))
WORD = re.compile(r'[A-Za-z]+(?:_[A-Za-z]+)*')
# Words of MAVLink and ROS, and names in examples.
OTHERS = {'such', 'over', 'shutdown', 'load', 'safety', 'operator', 'joystick', 'brightnes'}
CELLS = [*(row[0] for row in table(ANSWERS, '`message`')),
         *re.findall(r'^\| (`.*?) \|', SYMPTOMS, re.MULTILINE)]
MESSAGES = [message for cell in CELLS for message in re.findall('`(.+?)`', cell)]


def texts(path: Path) -> set[str]:
    """Return the texts of a module without docstrings, and the parts of its f-strings."""
    nodes = [*ast.walk(ast.parse(path.read_text()))]
    docstrings = {id(node.value) for node in nodes if isinstance(node, ast.Expr)}
    return {node.value for node in nodes if isinstance(node, ast.Constant)
            and isinstance(node.value, str) and id(node) not in docstrings}


@pytest.fixture(scope='module')
def runs() -> set[tuple[str, ...]]:
    """Return all whole texts and, for pages that shorten one, its runs of three words."""
    found = [WORD.findall(text.lower()) for path in (ROOT / 'illuminator_ros').rglob('*.py')
             for text in texts(path)]
    return {tuple(words) for words in found} | {
        tuple(words[at:at + 3]) for words in found for at in range(len(words) - 2)}


@pytest.mark.parametrize('message', MESSAGES)
def test_a_message_consists_of_texts_of_the_package(
        message: str, runs: set[tuple[str, ...]]) -> None:
    words = WORD.findall(message.lower())
    known = {at for first in range(len(words)) for end in range(first + 1, len(words) + 1)
             if tuple(words[first:end]) in runs for at in range(first, end)}

    assert [word for at, word in enumerate(words)
            if at not in known and len(word) > 2 and '_' not in word and word not in OTHERS] == []


def test_messages_of_all_tables_are_found() -> None:
    assert len(MESSAGES) > 50
    assert any('camera' in message for message in MESSAGES)
