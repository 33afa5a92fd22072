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
Measures the bridge beside its peers, and prints each figure with its target.

    make bench                                  all of it, 5 minutes; needs ROS (rclpy)
    python3 bench/run.py --only enable status   these subjects
    python3 bench/run.py --repeat 3             targets judged by the median of three runs
    python3 bench/run.py --json run.json        and keep all figures
    python3 bench/run.py --from run.json --markdown    show a run that was kept

Exit status: 0; 1 if a measurement fails, or with --check if a target is missed; 2 if an argument
is wrong. Measure on a machine without other load. A missed target is printed; it is a failure
with --check only.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
import importlib
import json
import os
from pathlib import Path
import signal
import sys
import tempfile
import time
from typing import Any, TextIO

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / 'test')]

from bench.report import as_json, from_json, lines, machine, markdown  # noqa: E402
from bench.rows import median_of, Row  # noqa: E402
from bench.subjects import SUBJECTS  # noqa: E402


def measure(
    names: Sequence[str], to: TextIO, **options: Any,
) -> tuple[list[Row], dict[str, float], list[str]]:
    """
    Return the rows of some subjects, the time of each, s, and the subjects that failed.

    :param to: the stream to which each row is printed as soon as it is measured.
    :param options: see :class:`bench.rig.Bench`.
    """
    # Slow, and not needed to show a run that was kept.
    from bench.rig import Bench, own_domain

    rows: list[Row] = []
    took: dict[str, float] = {}
    failed = []
    with tempfile.TemporaryDirectory() as home, own_domain() as domain:
        os.environ['ROS_HOME'] = home
        bench = Bench(domain=domain, **options)
        for number, name in enumerate(names, 1):
            bench.say(f'{number}/{len(names)} {name}: {SUBJECTS[name]}')
            began = time.monotonic()
            try:
                for row in importlib.import_module(f'bench.subjects.{name}').measure(bench):
                    rows.append(row)
                    print('\n'.join(lines(row)), file=to, flush=True)
            except Exception as error:
                # The other subjects are measured nevertheless.
                failed.append(name)
                print(f'{name} FAILED: {error!r}', file=sys.stderr, flush=True)
                if bench.quick:
                    raise
            took[name] = round(time.monotonic() - began, 1)
    return rows, took, failed


def parser() -> argparse.ArgumentParser:
    """Return the parser of the command line."""
    subjects = '\n'.join(f'  {name:14} {text}' for name, text in SUBJECTS.items())
    result = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter,
        epilog=f'subjects:\n{subjects}')
    result.add_argument('--only', nargs='+', choices=SUBJECTS, metavar='SUBJECT',
                        help='measure these only')
    result.add_argument('--quick', action='store_true',
                        help='do as little as possible, to test the benchmark itself')
    result.add_argument('--repeat', type=int, default=1, metavar='N',
                        help='measure N times: medians, and the range of each ratio')
    result.add_argument('--soak', type=float, default=15.0, metavar='SECONDS',
                        help='time in which memory must not grow (default: %(default)g)')
    result.add_argument('--lights', type=int, nargs='+', default=[1, 10, 100], metavar='N',
                        help='numbers of lights for the subject nodes (default: 1 10 100)')
    result.add_argument('--json', type=Path, metavar='FILE', help='write all figures here')
    result.add_argument('--markdown', action='store_true',
                        help='print the table of doc/performance.md')
    result.add_argument('--from', dest='stored', type=Path, metavar='FILE',
                        help='measure nothing, show the file that --json wrote')
    result.add_argument('--check', action='store_true',
                        help='exit with 1 if a target is missed')
    return result


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the benchmark; return the exit status."""
    options = parser().parse_args(arguments)
    # A shell ignores SIGINT for programs that it starts in the background, and for their children.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    # With --markdown, stdout has the table only.
    to = sys.stderr if options.markdown else sys.stdout
    about: dict[str, Any]
    failed: list[str] = []
    if options.stored:
        values = json.loads(options.stored.read_text())
        rows, about, took = from_json(values), values['machine'], values['took']
        if not options.markdown:
            print('\n'.join(line for row in rows for line in lines(row)))
    else:
        about = machine()
        names = options.only or list(SUBJECTS)
        runs = []
        for number in range(options.repeat):
            if options.repeat > 1:
                print(f'run {number + 1} of {options.repeat}', file=to)
            rows, took, missing = measure(
                names, to, quick=options.quick, soak=options.soak, lights=options.lights)
            runs.append(rows)
            failed += missing
        rows = median_of(runs)
        if options.repeat > 1:
            print(f'median of {options.repeat} runs', file=to)
            print('\n'.join(line for row in rows for line in lines(row)), file=to)
    if options.json:
        options.json.write_text(json.dumps(as_json(rows, about, took), indent=1) + '\n')
    if options.markdown:
        print(markdown(rows, about))
    targets = [(row, target) for row in rows for target in row.targets]
    missed = [(row, target) for row, target in targets if not target.met]
    print(f'{len(targets) - len(missed)} of {len(targets)} targets met, {len(rows)} rows, '
          f'{sum(took.values()):.0f} s', *(f'FAILED: {name}' for name in failed), sep='; ',
          file=to)
    if options.quick:
        print('  --quick: the figures mean nothing', file=to)
    for row, target in missed:
        print(f'  missed: {row.what}: {target.text} ({target.value:.3g}, limit '
              f'{target.limit:.3g})', file=to)
    return 1 if failed or (options.check and missed) else 0


if __name__ == '__main__':
    sys.exit(main())
