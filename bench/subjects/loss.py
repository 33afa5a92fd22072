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

"""Commands through 30 % loss each way, and beside it repeated and reordered frames."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
import importlib.util
from typing import Any

from ..rig import Bench, ROOT
from ..rows import at_most, one, Row

MATRIX = ROOT / 'test/illuminator/test_loss_matrix.py'
LINE, SHARE = 'drop, duplicate and reorder', 0.3


def matrix() -> Any:
    """Return the module of the test that plays the whole matrix."""
    spec = importlib.util.spec_from_file_location('test_loss_matrix', MATRIX)
    assert spec and spec.loader
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def measure(bench: Bench) -> Iterator[Row]:
    """Play one cell of the matrix in simulated time, and judge what each command came to."""
    module = matrix()
    module.COMMANDS = bench.amount(module.COMMANDS, 20)
    module.LINES[LINE] = (('drop', 'duplicate', 'reorder'),) * 2
    for line in ('drop', LINE):
        _, requests, judge = module.play(line, SHARE)
        judgements = [judge.judge(request) for request in requests]
        kinds = Counter(kind for kind, _ in judgements)
        untrue = sum(bool(wrong) for _, wrong in judgements)
        several = sum(len(request.answer.results) != 1 for request in requests)
        yield Row(f'commands confirmed, {line}: {SHARE:.0%} each way', '%',
                  one(100 * kinds['confirmed'] / len(requests)),
                  targets=[at_most(untrue, 0, 'outcomes untrue'),
                           at_most(several, 0, 'with no or several outcomes')],
                  note=f'{len(requests)} commands')
