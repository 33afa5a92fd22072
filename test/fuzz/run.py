# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""
Attacks both sides of the protocol with hostile input for a given time.

Everything between the socket and the observers takes part: channel, framing, signing, routes,
controller or simulated lights, in all signing modes, beside honest requests. The same seed sends
the same input. test/support/attacked_link.py has the conditions that must hold.

    python3 test/fuzz/run.py --seconds 60 --seed 1
    python3 test/fuzz/run.py --only 1/17        one round again, as a finding names it

Exit status: 0 if nothing was found, 1 otherwise.
"""

from __future__ import annotations

import argparse
import itertools
from pathlib import Path
import resource
import sys
import time
import traceback

TEST = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(TEST.parent), str(TEST)]

from illuminator_ros.mavlink.signing import SigningMode  # noqa: E402
from support.attacked_link import ATTACKED  # noqa: E402

KINDS = list(itertools.product(ATTACKED, SigningMode))
# Datagrams of one round: enough to fill every table, few enough to repeat a finding quickly.
ROUND = 10_000
# Rounds after which memory must not grow any more, and the tolerance, MB.
WARM_UP = 12
MAX_GROWTH = 8.0


def memory_mb() -> float:
    """Return the memory in use, MB."""
    pages = int(Path('/proc/self/statm').read_text().split()[1])
    return pages * resource.getpagesize() / 1e6


def play(seed: str, number: int, inputs: int = ROUND) -> bool:
    """Play one round; return whether there was no finding, and print the finding."""
    name, mode = KINDS[number % len(KINDS)]
    attacked = ATTACKED[name]((seed, number), mode)
    try:
        while attacked.inputs < inputs:
            attacked.attack()
        attacked.check_bounds()
        attacked.check_service()
    except Exception:
        print(f'\nFINDING in round {seed}/{number}: {name}, signing {mode.value}, after '
              f'{attacked.inputs} inputs')
        traceback.print_exc(file=sys.stdout)
        for data, peer in attacked.last:
            print(f'last input from {peer}: {data.hex()}')
        print(f'again: python3 test/fuzz/run.py --only {seed}/{number}\n', flush=True)
        return False
    finally:
        attacked.close()
    return True


def main() -> int:
    """Run it."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--seconds', type=float, default=60.0, help='default: %(default)s')
    parser.add_argument('--seed', default='0', help='any text (default: %(default)s)')
    parser.add_argument('--only', metavar='SEED/ROUND', help='one round again')
    options = parser.parse_args()
    if options.only:
        seed, _, number = options.only.rpartition('/')
        return int(not play(seed, int(number)))
    begun, findings, warm = time.monotonic(), 0, 0.0
    for number in itertools.count():
        if time.monotonic() - begun >= options.seconds:
            break
        findings += not play(options.seed, number)
        warm = memory_mb() if number == WARM_UP else warm
        if number % WARM_UP == 0:
            print(f'{number + 1} rounds of {ROUND} inputs, {findings} findings, '
                  f'{memory_mb():.1f} MB', flush=True)
    grown = memory_mb() - warm if warm else 0.0
    print(f'{findings} findings, memory {grown:+.1f} MB since round {WARM_UP}')
    return int(findings > 0 or grown > MAX_GROWTH)


if __name__ == '__main__':
    sys.exit(main())
