# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The modules and state diagrams of the design page, compared with the code."""

from pathlib import Path
import re
from types import ModuleType

from illuminator_ros.mavlink import command_sender as command
from illuminator_ros.mavlink import link_state
from illuminator_ros.mavlink.dialect import short_names
import pytest
from support.tables import transitions

ROOT = Path(__file__).parents[2]
PACKAGE = ROOT / 'illuminator_ros'
PAGE = (ROOT / 'doc' / 'design.md').read_text()


def listed_modules() -> list[str]:
    """Return the paths in the layout, the first block of code, in its order."""
    folders: list[tuple[int, str]] = []
    modules = []
    for line in PAGE.split('```')[1].splitlines()[2:]:
        indent = len(line) - len(line.lstrip())
        folders = [folder for folder in folders if folder[0] < indent]
        for name in re.findall(r'[\w/]+(?:\.py|/)(?=,|\s|$)', line.strip().partition('  ')[0]):
            if name.endswith('/'):
                folders.append((indent, name))
            else:
                modules.append(''.join(folder for _, folder in folders) + name)
    return modules


def test_the_layout_names_each_module_once() -> None:
    modules = [str(path.relative_to(PACKAGE)) for path in PACKAGE.rglob('*.py')
               if path.name != '__init__.py']

    assert sorted(listed_modules()) == sorted(modules)


@pytest.mark.parametrize(('module', 'first'), [
    (link_state, ('OPENING', 'OPENED')), (command, ('SENT', 'TEMPORARILY_REJECTED'))], ids=str)
def test_a_diagram_has_the_transitions_of_the_table(
        module: ModuleType, first: tuple[str, str]) -> None:
    assert sorted(transitions(PAGE, *first)) == sorted(
        (state.name, short_names('MAV_RESULT')[by] if isinstance(by, int) else by.name, after.name)
        for (state, by), after in module.TRANSITIONS.items() if after.name != 'STOPPED')
