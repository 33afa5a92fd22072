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

"""Why no light is heard, in one sentence."""

from types import SimpleNamespace
from typing import Any

from illuminator_ros.mavlink.dialect import Source
from illuminator_ros.mavlink.signing import SigningCounters
from illuminator_ros.mavlink.statistics import SequenceCounter, Traffic
from illuminator_ros.ros.diagnostics import why_nothing_is_heard
import pytest


@pytest.mark.parametrize(('traffic', 'signing', 'reason'), [
    ({}, {}, 'nothing comes in'),
    ({'bytes_received': 90}, {}, '90 bytes came and no good frame, as with a wrong baud rate'),
    ({'bytes_received': 90, 'sources': {Source(1, 1): SequenceCounter(received=4)}}, {},
     '4 frames came, none from an illuminator'),
    ({'bytes_received': 90}, {'bad': 3},
     '3 frames refused for their signature, made with another key'),
    ({'bytes_received': 90}, {'unsigned': 2}, '2 frames refused because they are not signed'),
])
def test_the_likeliest_reason_is_named(
    traffic: dict[str, Any], signing: dict[str, int], reason: str,
) -> None:
    state: Any = SimpleNamespace(
        traffic=Traffic(**traffic), signing=SigningCounters(**signing))
    assert why_nothing_is_heard(state) == reason
