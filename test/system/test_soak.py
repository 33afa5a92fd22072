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
