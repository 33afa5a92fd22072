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

"""What is made of the figures: targets, tables, files, plots, exit status."""

from __future__ import annotations

import json

from bench.report import as_json, from_json, lines, machine, markdown
from bench.rows import at_most, one, quantiles, Row, Target, times
from bench.run import main
import pytest

SLOW = Row('~/thing', 'ms', {'p50': 3.0, 'p99': 9.0}, {'peer': {'p50': 2.0, 'p99': 3.0}},
           [times({'p50': 3.0}, {'p50': 2.0}, 1.6, 'p50'),
            times({'p99': 9.0}, {'p99': 3.0}, 2.0, 'p99')],
           'a note', {'bridge': [3.0, 9.0], 'peer': [2.0, 3.0]})
CURVE = [Row(f'CPU, {count}', '%', one(count), targets=[],
             curves={'lights': (float(count), {'bridge': 1.0})}) for count in (1, 10)]


@pytest.fixture
def stored(tmp_path):
    """Return a file that holds a run with one target missed."""
    path = tmp_path / 'run.json'
    path.write_text(json.dumps(as_json([SLOW, *CURVE], machine(), {'thing': 1.0})))
    return path


@pytest.mark.parametrize(('value', 'met'), [(59.0, True), (60.0, True), (60.1, False)])
def test_a_target_is_met_up_to_its_limit(value, met):
    assert at_most(value, 60.0, 'B/s').met is met


def test_a_promise_in_proportion_is_to_the_peer_of_the_same_run():
    assert [target.met for target in SLOW.targets] == [True, False]
    assert SLOW.ratios == {'p50': 1.5, 'p99': 3.0}


def test_quantiles_are_values_that_have_been_measured():
    assert quantiles([float(number) for number in range(100)]) == {
        'p50': 50.0, 'p95': 95.0, 'p99': 99.0}


def test_a_row_tells_figures_ratio_and_targets():
    assert lines(SLOW) == [
        '~/thing (p50, p99): 3 / 9 ms; a note',
        '    peer: 2 / 3 ms',
        '    ratio: 1.5 / 3',
        '    p50 at most 1.6 times the peer: met (1.5, limit 1.6)',
        '    p99 at most 2 times the peer: MISSED (3, limit 2)']


def test_the_table_names_the_machine_and_what_is_missed():
    about = {**machine(), 'cpu': 'A fast one'}
    text = markdown([SLOW, Row('bytes', 'B/s', one(21.0)),
                     Row('back', 's', {'p50': 0.1, 'max': 0.2})], about)
    assert 'A fast one' in text
    assert ('| `~/thing` (a note) | 3 / 9 ms | peer: 2 / 3 ms | 1.5 / 3 | '
            'p50 at most 1.6 times the peer: met<br>'
            'p99 at most 2 times the peer: MISSED |') in text
    assert '| bytes | 21 B/s | | | |' in text
    assert '| back (p50, max) | 0.1 / 0.2 s | | | |' in text


def test_a_run_that_was_kept_is_the_same_afterwards(stored):
    values = json.loads(stored.read_text())
    assert from_json(values) == [SLOW, *CURVE]
    assert values['machine']['cores'] > 0
    assert values['machine']['packages']['pymavlink'] != 'unknown'


def test_a_missed_target_is_told_and_is_no_failure(stored, capsys):
    assert main(['--from', str(stored)]) == 0
    assert '1 of 2 targets met' in capsys.readouterr().out


def test_the_table_is_all_that_is_printed_where_it_is_asked_for(stored, capsys):
    assert main(['--from', str(stored), '--markdown']) == 0
    values = json.loads(stored.read_text())
    assert capsys.readouterr().out == markdown(from_json(values), values['machine']) + '\n'


def test_a_missed_target_is_a_failure_where_that_is_asked_for(stored):
    assert main(['--from', str(stored), '--check']) == 1


def test_a_plot_is_drawn_of_distributions_and_of_curves(stored, tmp_path):
    pytest.importorskip('matplotlib')
    assert main(['--from', str(stored), '--plot', str(tmp_path / 'plots')]) == 0
    drawn = {path.name: path.read_bytes() for path in (tmp_path / 'plots').iterdir()}
    assert set(drawn) == {'thing.png', 'cpu_lights.png'}
    assert all(data.startswith(b'\x89PNG') for data in drawn.values())


def test_a_limit_of_nothing_is_named_so():
    assert at_most(0.0, 0.0, 'frames') == Target('0 frames', 0.0, 0.0)
