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

"""The benchmark measures each subject; its figures are not checked."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import Future, ThreadPoolExecutor
import json
import math
from pathlib import Path
import subprocess
import sys
from typing import Any

from bench.subjects import SUBJECTS
import pytest
from support.processes import environment, ROOT

Rows = list[dict[str, Any]]
AT_ONCE = 4
# Peers that each subject must measure.
BESIDE = {
    'enable': {'empty SetBool server', 'straightforward script'},
    'status': {'bare publisher and subscriber', 'a datagram in, a message out'},
    'foreign': {'recv_match', 'bare receive loop'},
    'burst': {'recv_match'},
    'noise': {"pymavlink's parser"},
    'memory': {'empty node'},
    'startup': {'empty node', 'empty node, its service'},
    'lights': {'one light'},
    'parallel': {'undisturbed'},
}


def run(*arguments: str) -> subprocess.CompletedProcess[str]:
    """Run the benchmark to its end."""
    return subprocess.run(
        [sys.executable, str(ROOT / 'bench/run.py'), *arguments], env=environment(), cwd=ROOT,
        text=True, capture_output=True, timeout=110)


@pytest.fixture(scope='module')
def runs(tmp_path_factory: pytest.TempPathFactory) -> Iterator[dict[str, Future[Rows]]]:
    """Return for each subject a run that is in progress; most of a run is waiting."""
    directory = tmp_path_factory.mktemp('runs')
    with ThreadPoolExecutor(AT_ONCE) as pool:
        yield {subject: pool.submit(measured, subject, directory / f'{subject}.json')
               for subject in SUBJECTS}


def measured(subject: str, path: Path) -> Rows:
    """Return the rows of a subject, as the benchmark writes them."""
    result = run('--quick', '--only', subject, '--json', str(path))
    assert result.returncode == 0, result.stdout + result.stderr
    return list(json.loads(path.read_text())['rows'])


@pytest.mark.timeout(120)
@pytest.mark.parametrize('subject', SUBJECTS)
def test_subject_yields_rows_with_its_peers(
    subject: str, runs: dict[str, Future[Rows]],
) -> None:
    rows = runs[subject].result()
    assert rows
    for row in rows:
        assert row['ours'], row['what']
        figures = [row['ours'], *row['peers'].values()]
        assert all(math.isfinite(value) for each in figures for value in each.values())
        assert all(set(peer) == set(row['ours']) for peer in row['peers'].values())
    assert BESIDE.get(subject, set()) <= {name for row in rows for name in row['peers']}


def test_unknown_subject_is_a_usage_error() -> None:
    result = run('--only', 'nothing')
    assert result.returncode == 2
    assert "'nothing'" in result.stderr
