# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""
Measures the bridge beside its peers, and prints the table of doc/performance.md.

    make bench                               everything; needs ROS (rclpy)
    python3 -m tools.bench enable status     these subjects, in the folder of the repository
    python3 -m tools.bench --repeat 3 enable   and how often each target was met

Exit status: 0; 1 if a measurement fails; 2 if an argument is wrong. Measure on a machine without
other load. A missed target is printed.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
import importlib
import os
from pathlib import Path
import platform
import signal
import sys
import time

from .rows import Row, Target
from .subjects import SUBJECTS

sys.path.append(str(Path(__file__).resolve().parents[2] / 'test'))


def measure(names: Sequence[str], rows: list[Row], *, quick: bool) -> list[str]:
    """Print and append the rows of some subjects; return the subjects that failed."""
    # Slow, and not needed for --help.
    from support.ports import claimed_domain

    from .rig import Bench

    failed = []
    os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] = 'LOCALHOST'
    # A program that a user starts has been compiled before.
    os.environ.pop('PYTHONDONTWRITEBYTECODE', None)
    with claimed_domain() as domain:
        os.environ['ROS_DOMAIN_ID'] = str(domain)
        for name in names:
            print(f'  {name}', file=sys.stderr, flush=True)
            try:
                module = importlib.import_module(f'tools.bench.subjects.{SUBJECTS[name]}')
                for row in getattr(module, name)(Bench(domain, quick)):
                    rows.append(row)
                    print(row, flush=True)
            except Exception as error:
                # The other subjects are measured nevertheless.
                failed.append(name)
                print(f'{name} FAILED: {error!r}', file=sys.stderr, flush=True)
    return failed


def summary(rows: Sequence[Row]) -> list[str]:
    """Return for each target how often it was met, and the values that were measured."""
    found: dict[str, list[Target]] = {}
    for row in rows:
        for target in row.targets:
            found.setdefault(f'{row.what}: {target.text}', []).append(target)
    lines = []
    for what, targets in found.items():
        values = sorted(target.value for target in targets)
        met = sum(target.is_met for target in targets)
        lines.append(f'{"   " if met == len(targets) else "!! "}{what}: met in {met} of '
                     f'{len(targets)} ({values[0]:.3g} to {values[-1]:.3g})')
    return lines


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the benchmark; return the exit status."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter,
        epilog=f'subjects: {", ".join(SUBJECTS)}')
    parser.add_argument('subjects', nargs='*', metavar='SUBJECT', help='measure these only')
    parser.add_argument('--quick', action='store_true',
                        help='do as little as possible, to test the benchmark itself')
    parser.add_argument('--repeat', type=int, default=1, metavar='N', help='measure N times')
    options = parser.parse_args(arguments)
    if unknown := set(options.subjects) - {*SUBJECTS}:
        parser.error(f'unknown subjects: {", ".join(map(repr, sorted(unknown)))}')
    # A shell ignores SIGINT for programs that it starts in the background, and for their children.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    began, rows, failed = time.monotonic(), list[Row](), list[str]()
    print(f'{os.cpu_count()} cores, load {os.getloadavg()[0]:.1f}, Linux {platform.release()}, '
          f'Python {platform.python_version()}')
    for _ in range(options.repeat):
        failed += measure(options.subjects or [*SUBJECTS], rows, quick=options.quick)
    print('\n'.join(summary(rows)))
    print(f'{len(rows)} rows, {time.monotonic() - began:.0f} s',
          *(f'FAILED: {name}' for name in failed), sep='; ')
    return 1 if failed else 0


if __name__ == '__main__':
    sys.exit(main())
