#!/usr/bin/env python3
# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""
Sends commands to simulated lights over faulty lines, and compares each outcome with the light.

Each run of 400 commands draws the faults of the line in each direction (latency to 0.5 s, jitter
and reordering within half of it, loss, repetition, corruption), the behaviour of the lights, such
as a restart each 7 s, whether users wait for answers, and how often their requests are equal. Time
is simulated, so 500 outcomes take a second. An outcome is untrue if the light was not as a success
says at any time between the question and the answer, if a failure gives a wrong reason, or if a
command does not have exactly one outcome. The state shown at the end must be the state of the
light.

    python3 test/soak/loss.py --outcomes 1000000
    python3 test/soak/loss.py --outcomes 100000 --delays    and half of the frames up to 1 s later
    python3 test/soak/loss.py --outcomes 1 --seed 17        the one run of a seed

Exit status: 0 if all outcomes are true, or with --delays, 1 if not.
"""

from __future__ import annotations

import argparse
from collections import Counter
from dataclasses import replace
import itertools
from pathlib import Path
import random
import sys
from typing import Any

TEST = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(TEST.parent), str(TEST)]

from support.lossy_line import FAULTLESS, OUTCOMES, Run  # noqa: E402
from support.wire import Faults  # noqa: E402

KINDS = ('drop', 'duplicate', 'delay', 'corrupt')
BEHAVIOURS: tuple[dict[str, Any], ...] = (
    {}, {}, {'apply_after': 0.005}, {'apply_after': 0.2}, {'slow': 0.1}, {'progress': 0.5},
    {'status_on_change': False}, {'acks_target': False}, {'answers_command_int': False},
    {'reboot_interval': 7.0})


def line(draw: random.Random, *, delays: bool) -> Faults:
    """Return the faults of one direction: each kind in half of the runs, up to a share of 0.5."""
    kinds = {kind: draw.uniform(0.0, 0.5) for kind in KINDS if draw.random() < 0.5}
    latency = draw.choice((0.0005, 0.002, 0.05, 0.2, 0.5))
    if delays:
        return Faults(**{**kinds, 'delay': 0.5}, latency=latency, longest_delay=1.0)
    return Faults(**kinds, latency=latency, longest_delay=latency / 2)


def play(seed: int, *, delays: bool) -> Run:
    """Return the run of a seed."""
    draw = random.Random(seed)
    there, back = line(draw, delays=delays), line(draw, delays=delays)
    return Run(there, back, str(seed), impatience=draw.choice((0.0, 0.2)),
               levels=draw.choice((101, 3)),
               behaviour=replace(FAULTLESS, **draw.choice(BEHAVIOURS)))


def main() -> int:
    """Play runs until there are enough outcomes."""
    parser = argparse.ArgumentParser(description=__doc__.split('\n')[1])
    parser.add_argument('--outcomes', type=int, default=100_000)
    parser.add_argument('--seed', type=int, default=0, help='of the first run (0)')
    parser.add_argument('--delays', action='store_true',
                        help='delay half of the frames by up to a second')
    arguments = parser.parse_args()
    outcomes: Counter[str] = Counter()
    untrue = 0
    for seed in itertools.count(arguments.seed):
        run = play(seed, delays=arguments.delays)
        outcomes += run.outcomes
        for text in run.untruths():
            untrue += 1
            print(f'seed {seed}: {text}', flush=True)
        if outcomes.total() >= arguments.outcomes:
            break
    for name in OUTCOMES:
        print(f'{outcomes[name]:8} {name}')
    print(f'{outcomes.total():8} outcomes, {untrue} untrue, seeds {arguments.seed} to {seed}')
    return 1 if untrue and not arguments.delays else 0


if __name__ == '__main__':
    sys.exit(main())
