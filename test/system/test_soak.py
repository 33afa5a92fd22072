# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""A short soak; ``make soak`` runs a long one."""

from __future__ import annotations

from pathlib import Path
import sys

import pytest
from support.processes import Program, ROOT


@pytest.mark.timeout(120)
def test_bridge_that_went_through_faults_serves_and_has_not_grown(tmp_path: Path) -> None:
    soak = Program(sys.executable, str(ROOT / 'test/soak/run.py'), '--seconds', '6', '--seed',
                   'test', cwd=tmp_path)
    assert soak.wait(110.0) == 0, soak.log
    assert 'PROBLEM' not in soak.log
    assert 'bridge: after the warm-up' in soak.log
