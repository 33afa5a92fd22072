#!/usr/bin/env python3
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

"""
Attacks both sides of the protocol with hostile input for as long as is wanted.

Everything between the socket and the observers takes part: channel, framing, signing, routes,
controller or simulated lights, in all signing modes, while honest requests go on. What must hold
is in test/support/siege.py. The same seed sends the same input.

    python3 test/fuzz/run.py --seconds 60 --seed 1
    python3 test/fuzz/run.py --only 1/17        one round again, as a finding names it

Exit status: 0 if nothing was found, 1 otherwise.
"""

from __future__ import annotations

import argparse
from collections import Counter
import itertools
from pathlib import Path
import resource
import sys
import time
import traceback

TEST = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(TEST.parent), str(TEST)]

from illuminator_ros.mavlink.signing import SigningMode  # noqa: E402
from support.siege import Siege, SIEGES  # noqa: E402

# Datagrams of one round: enough to fill every table, few enough to find one of them again.
ROUND = 10_000
# Rounds after which memory must not grow any more, and by how much it may (MB).
WARM_UP = 12
MAX_GROWTH = 8.0
# s between signs of life.
REPORT_INTERVAL = 10.0


class Figures:
    """Counters of a run."""

    def __init__(self) -> None:
        self.begun = time.monotonic()
        self.rounds = 0
        self.totals: Counter[str] = Counter()
        self.findings: list[str] = []
        self.warm_mb = 0.0

    def add(self, siege: Siege) -> None:
        """Count a round that is over."""
        counters, signing = siege.link._receiver.counters, siege.link._signing.counters
        self.rounds += 1
        self.totals.update(
            inputs=siege.inputs, frames=counters.frames, crc_errors=counters.crc_errors,
            unknown_ids=counters.unknown_ids, skipped_bytes=counters.skipped_bytes,
            believed=siege.link._traffic.frames_received, good_signatures=signing.good,
            bad_signatures=signing.bad, replayed=signing.replayed,
            requests=len(getattr(siege, 'results', [])))
        if self.rounds == WARM_UP:
            self.warm_mb = memory_mb()

    @property
    def growth_mb(self) -> float:
        """By how much memory has grown since it should not any more."""
        return memory_mb() - self.warm_mb if self.warm_mb else 0.0

    def show(self) -> None:
        """Print a line."""
        seconds = time.monotonic() - self.begun
        print(f'{self.totals["inputs"]} inputs in {self.rounds} rounds, {seconds:.0f} s, '
              f'{self.totals["inputs"] / seconds:.0f} inputs/s, {len(self.findings)} findings, '
              f'memory {memory_mb():.1f} MB ({self.growth_mb:+.1f})', flush=True)


def memory_mb() -> float:
    """Return the memory in use, MB."""
    pages = int(Path('/proc/self/statm').read_text().split()[1])
    return pages * resource.getpagesize() / 1e6


def play(seed: str, number: int, figures: Figures) -> None:
    """Play one round."""
    kinds = list(itertools.product(SIEGES, SigningMode))
    name, mode = kinds[number % len(kinds)]
    siege: Siege | None = None
    try:
        siege = SIEGES[name]((seed, number), mode)
        while siege.inputs < ROUND:
            siege.attack()
        siege.check_bounds()
        siege.check_service()
    except Exception as error:
        figures.findings.append(f'{type(error).__name__}: {error}')
        print(f'\nFINDING in round {seed}/{number}: {name}, signing {mode.value}, after '
              f'{siege.inputs if siege else 0} inputs')
        traceback.print_exc(file=sys.stdout)
        for data, peer in siege.last if siege else []:
            print(f'last input from {peer}: {data.hex()}')
        print(f'again: python3 test/fuzz/run.py --only {seed}/{number}\n', flush=True)
    if siege:
        figures.add(siege)
        siege.close()


def main() -> int:
    """Run it."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--seconds', type=float, default=60.0, help='default: %(default)s')
    parser.add_argument('--seed', default='0', help='any text (default: %(default)s)')
    parser.add_argument('--only', metavar='SEED/ROUND', help='one round again')
    options = parser.parse_args()
    figures = Figures()
    if options.only:
        seed, _, number = options.only.rpartition('/')
        play(seed, int(number), figures)
    else:
        shown = figures.begun
        for number in itertools.count():
            if time.monotonic() - figures.begun >= options.seconds:
                break
            play(options.seed, number, figures)
            if time.monotonic() - shown >= REPORT_INTERVAL:
                shown = time.monotonic()
                figures.show()
    figures.show()
    print(', '.join(f'{name} {count}' for name, count in sorted(figures.totals.items())))
    if figures.growth_mb > MAX_GROWTH:
        figures.findings.append('memory')
        print(f'FINDING: memory has grown by {figures.growth_mb:.1f} MB')
    for finding, count in Counter(figures.findings).items():
        print(f'found {count} times: {finding[:200]}')
    return 1 if figures.findings else 0


if __name__ == '__main__':
    sys.exit(main())
