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

"""The benchmark measures a subject beside its peers; its figures are not checked."""

import json
import math
from pathlib import Path
import subprocess
import sys

from support.processes import environment, ROOT


def run(*arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, str(ROOT / 'bench/run.py'), *arguments], env=environment(), cwd=ROOT,
        text=True, capture_output=True, timeout=110)


def test_subject_yields_rows_with_its_peers_which_are_printed_again_from_the_file(
    tmp_path: Path,
) -> None:
    file = str(tmp_path / 'run.json')
    assert run('--quick', '--only', 'noise', '--json', file).returncode == 0
    [row, *_] = json.loads(Path(file).read_text())['rows']
    for figures in (row['ours'], *row['peers'].values()):
        assert set(figures) == set(row['ours'])
        assert all(map(math.isfinite, figures.values()))
    assert set(row['peers']) == {"pymavlink's parser"}
    again = run('--from', file, '--markdown')
    assert (again.returncode, row['what'] in again.stdout) == (0, True)


def test_unknown_subject_is_a_usage_error() -> None:
    result = run('--only', 'nothing')
    assert (result.returncode, "'nothing'" in result.stderr) == (2, True)
