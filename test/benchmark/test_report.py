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

"""Rows of the benchmark: targets, medians, tables, files and the exit status."""

from __future__ import annotations

import json
from pathlib import Path

from bench.report import as_json, from_json, lines, machine, markdown
from bench.rows import at_most, median_of, one, quantiles, Row, times
from bench.run import main
import pytest

SLOW = Row('~/thing', 'ms', {'p50': 3.0, 'p99': 9.0}, {'peer': {'p50': 2.0, 'p99': 3.0}},
           [times({'p50': 3.0}, {'p50': 2.0}, 1.6, 'p50'),
            times({'p99': 9.0}, {'p99': 3.0}, 2.0, 'p99')], 'a note')


@pytest.fixture
def stored(tmp_path: Path) -> Path:
    """Return a file with a run that missed one target."""
    path = tmp_path / 'run.json'
    path.write_text(json.dumps(as_json([SLOW], machine(), {'thing': 1.0})))
    return path


@pytest.mark.parametrize(('value', 'met'), [(59.0, True), (60.0, True), (60.1, False)])
def test_target_is_met_up_to_its_limit(value: float, met: bool) -> None:
    assert at_most(value, 60.0, 'B/s').met is met


def test_ratio_is_to_the_peer_of_the_same_run() -> None:
    assert [target.met for target in SLOW.targets] == [True, False]
    assert SLOW.ratios == {'p50': 1.5, 'p99': 3.0}


def test_quantile_is_a_measured_value() -> None:
    assert quantiles([float(number) for number in range(100)]) == {
        'p50': 50.0, 'p95': 95.0, 'p99': 99.0}


def test_repeated_runs_are_judged_by_the_median_and_show_the_range_of_the_ratio() -> None:
    runs = [[Row('x', 'ms', one(ours), {'peer': one(2.0)}, [times(one(ours), one(2.0), 1.6)])]
            for ours in (3.0, 8.0, 2.0)]

    [row] = median_of(runs)

    assert lines(row) == [
        'x: 3 ms', '    peer: 2 ms', '    ratio: 1.5 (1 to 4)',
        '    at most 1.6 times the peer: met (1.5, limit 1.6)']


def test_row_that_is_missing_in_one_run_is_kept() -> None:
    assert median_of([[SLOW], []]) == [SLOW]


def test_row_shows_figures_ratio_and_targets() -> None:
    assert lines(SLOW) == [
        '~/thing (p50, p99): 3 / 9 ms; a note',
        '    peer: 2 / 3 ms',
        '    ratio: 1.5 / 3',
        '    p50 at most 1.6 times the peer: met (1.5, limit 1.6)',
        '    p99 at most 2 times the peer: MISSED (3, limit 2)']


def test_table_names_machine_and_missed_targets() -> None:
    about = {**machine(), 'cpu': 'A fast one'}
    text = markdown([SLOW, Row('bytes', 'B/s', one(21.0)),
                     Row('back', 's', {'p50': 0.1, 'max': 0.2})], about)
    assert 'A fast one' in text
    assert ('| `~/thing` (a note) | 3 / 9 ms | peer: 2 / 3 ms | 1.5 / 3 | '
            'p50 at most 1.6 times the peer: met<br>'
            'p99 at most 2 times the peer: MISSED |') in text
    assert '| bytes | 21 B/s | | | |' in text
    assert '| back (p50, max) | 0.1 / 0.2 s | | | |' in text


def test_stored_run_is_read_back_unchanged(stored: Path) -> None:
    values = json.loads(stored.read_text())
    assert from_json(values) == [SLOW]
    assert values['machine']['cores'] > 0
    assert values['machine']['packages']['pymavlink'] != 'unknown'


@pytest.mark.parametrize(('options', 'status'), [((), 0), (('--check',), 1)])
def test_missed_target_is_a_failure_with_check_only(
    stored: Path, capsys: pytest.CaptureFixture[str], options: tuple[str, ...], status: int,
) -> None:
    assert main(['--from', str(stored), *options]) == status
    assert '1 of 2 targets met' in capsys.readouterr().out


def test_markdown_option_prints_the_table_only(
    stored: Path, capsys: pytest.CaptureFixture[str],
) -> None:
    assert main(['--from', str(stored), '--markdown']) == 0
    values = json.loads(stored.read_text())
    assert capsys.readouterr().out == markdown(from_json(values), values['machine']) + '\n'
