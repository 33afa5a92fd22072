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

"""The table of the loss matrix, which pytest prints at its end."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field

import pytest

KINDS = ('confirmed', 'no acknowledgement', 'not shown', 'no status', 'not sent', 'light lost')


@dataclass
class LossTable:
    """
    The outcomes of commands over each line.

    :ivar cells: by fault and share, how many commands ended in which way.
    """

    cells: dict[tuple[str, float], Counter[str]] = field(default_factory=dict)
    untrue: int = 0

    def lines(self) -> list[str]:
        """Return the table: commands that succeeded, %, with the failures below."""
        shares = sorted({share for _, share in self.cells})
        names = list(dict.fromkeys(name for name, _ in self.cells))
        total: Counter[str] = sum(self.cells.values(), Counter())
        rows = ['confirmed, %'.ljust(24) + ''.join(f'{share:7.0%}' for share in shares)]
        for name in names:
            row = name.ljust(24)
            for share in shares:
                cell = self.cells.get((name, share))
                row += f'{100 * cell["confirmed"] / cell.total():7.1f}' if cell else ' ' * 7
            rows.append(row.rstrip())
        ends = ', '.join(f'{total[kind]} {kind}' for kind in KINDS if total[kind])
        return [*rows, f'{total.total()} commands, each with one outcome: {ends}',
                f'{self.untrue} outcomes untrue']


LOSS_TABLE: pytest.StashKey[LossTable] = pytest.StashKey()
