# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The state diagrams of the design page, compared with the code."""

from pathlib import Path
from types import ModuleType

from illuminator_ros.mavlink import command_sender as command
from illuminator_ros.mavlink import link_state
from illuminator_ros.mavlink.dialect import short_names
import pytest
from support.tables import transitions

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / 'doc' / 'design.md').read_text()


@pytest.mark.parametrize(('module', 'first'), [
    (link_state, ('OPENING', 'OPENED')), (command, ('SENT', 'TEMPORARILY_REJECTED'))], ids=str)
def test_a_diagram_has_the_transitions_of_the_table(
        module: ModuleType, first: tuple[str, str]) -> None:
    assert sorted(transitions(PAGE, *first)) == sorted(
        (state.name, short_names('MAV_RESULT')[by] if isinstance(by, int) else by.name, after.name)
        for (state, by), after in module.TRANSITIONS.items() if after.name != 'STOPPED')
