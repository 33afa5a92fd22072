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

"""Whether what is promised in time is done in time; ``bench/promises.py`` has the promises."""

from __future__ import annotations

from collections.abc import Iterator
import importlib
import os

from ..rig import Bench
from ..rows import at_most, Row

# It takes two minutes with its own ten.
TRIES = 1


def measure(bench: Bench) -> Iterator[Row]:
    """Yield its rows as ours."""
    promises = importlib.import_module('bench.promises')
    before = dict(os.environ)
    try:
        measured = promises.measure(TRIES)
    finally:
        # It has a ROS domain of its own, and its own settings of the middleware.
        os.environ.clear()
        os.environ.update(before)
    for row in measured:
        yield Row(row.promise, 's', {'p50': row.p50, 'max': row.max},
                  targets=[at_most(row.max, row.limit, 's')],
                  note=f'{row.tries} tries')
