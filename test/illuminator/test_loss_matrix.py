# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Two thousand commands over lines that lose, repeat, reorder, delay and corrupt frames."""

from __future__ import annotations

import itertools

import pytest
from support.lossy_line import CONFIRMED, Run
from support.wire import Faults

COMMANDS = 120
KINDS = ('drop', 'duplicate', 'reorder', 'delay', 'corrupt')
# Name -> faults of the line towards the lights, and faults on the way back.
LINES: dict[str, tuple[tuple[str, ...], tuple[str, ...]]] = {
    **{kind: ((kind,), (kind,)) for kind in KINDS},
    'all of these': (KINDS, KINDS),
    'drop, to the lights': (('drop',), ()),
    'delay, from the lights': ((), ('delay',)),
}


# The share of commands that must be confirmed, though the users call again at once.
LEAST = {('drop', 0.0): 1.0, ('drop', 0.3): 0.98, ('drop', 0.5): 0.88}


def play(line: str, share: float) -> Run:
    there, back = (Faults(**dict.fromkeys(kinds, share)) for kinds in LINES[line])
    return Run(there, back, f'{line} {share}', commands=COMMANDS)


@pytest.mark.parametrize(('line', 'share'), [
    ('drop', 0.0), *itertools.product(LINES, (0.3, 0.5))])
def test_every_command_has_one_outcome_and_it_is_true(line: str, share: float) -> None:
    run = play(line, share)
    assert list(run.untruths()) == []
    confirmed = run.outcomes[CONFIRMED] / len(run.requests)
    print(f'{line} {share:.0%}: {confirmed:.1%} confirmed')
    assert confirmed >= LEAST.get((line, share), 0.0)
