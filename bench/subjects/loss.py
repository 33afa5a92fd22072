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

"""Commands over a line that loses, repeats and reorders 30 % of the frames each way."""

from __future__ import annotations

from collections.abc import Iterator

from support.faulty_wire import Faults
from support.lossy_line import COMMANDS, CONFIRMED, Run

from ..rig import Bench
from ..rows import at_most, one, Row

SHARE = 0.3


def measure(bench: Bench) -> Iterator[Row]:
    """Send commands in simulated time, and compare each outcome with the state of the light."""
    for kinds in (['drop'], ['drop', 'duplicate', 'reorder']):
        faults = Faults(**dict.fromkeys(kinds, SHARE))
        run = Run(faults, faults, str(kinds), commands=bench.amount(COMMANDS, 20))
        untrue = len(list(run.untruths()))
        several = sum(len(request.answer.results) != 1 for request in run.requests)
        yield Row(f'commands confirmed, {", ".join(kinds)}: {SHARE:.0%} each way', '%',
                  one(100 * run.outcomes[CONFIRMED] / len(run.requests)),
                  targets=[at_most(untrue, 0, 'outcomes untrue'),
                           at_most(several, 0, 'with no or several outcomes')],
                  note=f'{len(run.requests)} commands')
