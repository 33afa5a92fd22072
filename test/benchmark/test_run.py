# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The benchmark measures a subject beside its peers; its figures are not checked."""

import subprocess
import sys

from support.processes import environment, ROOT


def run(*arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, '-m', 'tools.bench', *arguments], env=environment(), cwd=ROOT,
        text=True, capture_output=True, timeout=110)


def test_subject_yields_rows_with_its_peers_and_whether_each_target_was_met() -> None:
    result = run('--quick', '--repeat', '2', 'noise')
    assert result.returncode == 0, result.stderr
    rows = [line for line in result.stdout.splitlines() if line.startswith('| ')]
    assert len(rows) == 2
    for row in rows:
        what, ours, peers, ratio, targets = map(str.strip, row.strip('|').split('|'))
        assert (what, ours) == ('good frames recovered from noise', '100 %')
        assert peers.startswith("pymavlink's parser: ")
        assert float(ratio) > 1
        assert targets == 'at most 0 frames missing: met'
    assert ('good frames recovered from noise: at most 0 frames missing: met in 2 of 2 (0 to 0)'
            in result.stdout)
