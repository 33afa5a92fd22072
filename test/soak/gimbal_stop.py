#!/usr/bin/env python3
# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""
Turns simulated gimbals over lines that lose frames, and checks that they stand a minute later.

In each run a program turns the gimbal at a rate for a second, and then ends it in one of four
ways: it dies, asks for a rate of zero, releases control, or its source releases the gimbal. In
half of the runs nothing reaches the manager for up to 20 s then. Time is simulated. The manager
obeys primary control only; its device reports its rates or not.

    python3 test/soak/gimbal_stop.py --runs 2000
    python3 test/soak/gimbal_stop.py --runs 1 --seed 17 --loss 50

Exit status: 0 if all gimbals stand, 1 if not.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from dataclasses import dataclass, field
import math
from pathlib import Path
import random
import statistics
import sys

TEST = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(TEST.parent), str(TEST)]

from illuminator_ros.geometry.rotation import Quaternion  # noqa: E402
from illuminator_ros.gimbal.commands import Rates  # noqa: E402
from illuminator_ros.gimbal.messages import GimbalManagerSetAttitude, rates_of  # noqa: E402
from illuminator_ros.mavlink.messages import Address, Message  # noqa: E402
from illuminator_ros.payload.command_sources import SourceSettings  # noqa: E402
from support.gimbals import FakeManager, NAN, OURS, Rig  # noqa: E402

RATE = (0.0, 0.0, 0.3)
SOURCE = 'pilot'
# s after the end of a rate in which the gimbal must stop.
LIMIT = 60.0
STEP = 0.1


@dataclass
class TurningManager(FakeManager):
    """
    A manager whose device turns as it is told, behind a line that loses frames each way.

    :ivar turning: the rate of its yaw, rad/s.
    """

    loss: float = 0.0
    measures_rates: bool = True
    draw: random.Random = field(default_factory=random.Random)
    turning: float = 0.0
    _yaw: float = 0.0

    def _arrives(self, message: object) -> bool:
        return self.draw.random() >= self.loss

    def sent_each(self, tenth: int) -> list[tuple[Address, Message]]:
        self._yaw += self.turning * 0.1
        self.q = Quaternion.from_euler(0.0, 0.0, self._yaw)
        self.rates = (0.0, 0.0, self.turning) if self.measures_rates else (NAN, NAN, NAN)
        return [*filter(self._arrives, super().sent_each(tenth))]

    def take(self, source: Address, message: Message) -> list[tuple[Address, Message]]:
        if not (self.hears and self._arrives(message)):
            return []
        if isinstance(message, GimbalManagerSetAttitude) and self.primary == source:
            self.turning = rates_of(message)[2]
        return [*filter(self._arrives, super().take(source, message))]


# The end of the rate.
ENDS: dict[str, Callable[[Rig], object]] = {
    'dies': lambda rig: None,
    'zero': lambda rig: rig.send(Rates(), SOURCE),
    'release of control': lambda rig: rig.gimbal.release_control(rig.now, rig.done),
    'release of the source': lambda rig: rig.gimbal.release(SOURCE, rig.now)}


def play(seed: int, loss: float) -> tuple[str, float]:
    """Return how the rate ended, and after how long the gimbal stood, s; infinity for never."""
    draw = random.Random(seed)
    manager = TurningManager(primary=OURS, measures_rates=draw.random() < 0.5, draw=draw)
    rig = Rig(manager, sources=SourceSettings((SOURCE,))).run(4.0)
    manager.loss = loss
    while not manager.turning:
        for _ in range(20):
            rig.send(Rates(RATE), SOURCE)
            rig.run(0.06)
    way = draw.choice(list(ENDS))
    manager.hears = draw.random() < 0.5
    ENDS[way](rig)
    begun, outage = rig.now, draw.uniform(0.0, 20.0)
    while rig.now < begun + LIMIT:
        if not (manager.turning or rig.gimbal.setpoints.may_turn):
            return way, rig.now - begun
        manager.hears |= rig.now >= begun + outage
        rig.run(STEP)
    return way, math.inf if manager.turning else LIMIT


def main() -> int:
    """Play the runs of each loss."""
    parser = argparse.ArgumentParser(description=__doc__.split('\n')[1])
    parser.add_argument('--runs', type=int, default=200, help='for each loss (200)')
    parser.add_argument('--seed', type=int, default=0, help='of the first run (0)')
    parser.add_argument('--loss', type=int, nargs='*', default=(20, 30, 50),
                        help='%% of the frames in each direction (20 30 50)')
    arguments = parser.parse_args()
    failures = 0
    for loss in arguments.loss:
        times = []
        for seed in range(arguments.seed, arguments.seed + arguments.runs):
            way, seconds = play(seed, loss / 100)
            times.append(seconds)
            if seconds == math.inf:
                failures += 1
                print(f'seed {seed}, loss {loss} %, {way}: turns {LIMIT:g} s later', flush=True)
        print(f'loss {loss} %: {sum(map(math.isinf, times))} of {len(times)} turn {LIMIT:g} s '
              f'later; shown to stand after {statistics.median(times):.1f} s (median), '
              f'{max(times):.1f} s (longest)', flush=True)
    return 1 if failures else 0


if __name__ == '__main__':
    sys.exit(main())
