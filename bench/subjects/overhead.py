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

"""The bytes of MAVLink that the bridge adds to a link with one light."""

from __future__ import annotations

from collections.abc import Iterator
import time

from ..light import serving
from ..rig import Bench, bridge, free_port
from ..rows import at_most, one, Row

# s; the requests to a light that was just discovered are not counted.
SETTLING, COUNTED = 6.0, 10.0
LIMIT = 60.0


def measure(bench: Bench) -> Iterator[Row]:
    """Count the bytes for a light that sends a status each second."""
    port = free_port()
    with bridge(f'udpin://127.0.0.1:{port}'), serving(port) as light:
        time.sleep(bench.amount(SETTLING, 0.2))
        before, seconds = light.received, bench.amount(COUNTED, 0.2)
        time.sleep(seconds)
        ours = (light.received - before) / seconds
    yield Row('bytes added to the link by the bridge', 'B/s', one(ours),
              targets=[at_most(ours, LIMIT, 'B/s')], note='without UDP and IP headers')
