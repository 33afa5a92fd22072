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

"""The aggregator's file puts what real nodes publish where an operator looks for it."""

from pathlib import Path
import re
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray
from illuminator_ros.ros.parameters import LINK_PARAMETERS
import pytest
from support.light import Address, free_port, ServedLight
from support.ros import Ros, running_bridge, STREAM
import yaml

FILE = Path(__file__).parents[2] / 'config' / 'diagnostics_aggregator.yaml'
LIGHTS = yaml.safe_load(FILE.read_text())['/**']['ros__parameters']['lights']
# The parameters that GenericAnalyzer reads, by type.
KNOWN = {'type': str, 'path': str, 'regex': list, 'startswith': list, 'contains': list,
         'expected': list, 'timeout': float, 'remove_prefix': list, 'num_items': int,
         'discard_stale': bool, 'find_and_remove_prefix': list}


def matches(name: str, analyzer: dict[str, Any] = LIGHTS) -> bool:
    """Return what GenericAnalyzer::match does: it sees names as they are published."""
    return (any(re.fullmatch(pattern, name) for pattern in analyzer.get('regex', []))
            or any(name.startswith(start) for start in analyzer.get('startswith', []))
            or any(part in name for part in analyzer.get('contains', [])))


def test_the_analyzer_has_parameters_that_it_reads() -> None:
    assert LIGHTS['type'] == 'diagnostic_aggregator/GenericAnalyzer'
    for name, value in LIGHTS.items():
        assert type(value) is KNOWN[name]


def test_all_that_a_bridge_with_two_lights_publishes_is_found(own_ros: Ros) -> None:
    port = free_port()
    with (running_bridge(own_ros.domain, port, target_component=243), ServedLight(port),
          ServedLight(port, Address(1, 244))):
        recorder = own_ros.subscribe(DiagnosticArray, '/diagnostics', STREAM)
        names = set()
        for node in ('illuminator', 'illuminator_1_244'):
            array = recorder.wait(lambda array, node=node: [
                status.name for status in array.status] == [f'{node}: link', f'{node}: lamp'],
                30.0)
            names |= {status.name for status in array.status}

    assert len(names) == 4
    assert all(map(matches, names))
    assert set(LIGHTS['expected']) <= names


@pytest.mark.parametrize('name', [
    'illuminator_driver: link', 'illuminator: battery', 'my illuminator: lamp', 'modem: link'])
def test_what_others_publish_is_not_taken(name: str) -> None:
    assert not matches(name)


def test_a_status_is_not_stale_between_two_of_the_default_period() -> None:
    [period] = [spec.default for spec in LINK_PARAMETERS if spec.name == 'diagnostics_period']
    assert LIGHTS['timeout'] > 3 * period


def test_what_is_expected_is_matched_too_or_it_would_stay_missing() -> None:
    assert all(map(matches, LIGHTS['expected']))
