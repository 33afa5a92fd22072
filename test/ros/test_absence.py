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

from illuminator_ros.illuminator.light import Settings
from illuminator_ros.mavlink.frame import DecoderCounters
from illuminator_ros.mavlink.link_state import LinkState
from illuminator_ros.mavlink.messages import Address, heartbeat, MavType
from illuminator_ros.mavlink.signing import SigningCounters
from illuminator_ros.mavlink.statistics import SequenceCounter, Traffic
from illuminator_ros.ros.diagnostics import link_findings, WARN, why_no_light, why_nothing_is_heard
import pytest
from support.client import Client


@pytest.mark.parametrize(('traffic', 'signing', 'reason'), [
    ({}, {}, 'nothing comes in'),
    ({'bytes_received': 90}, {}, '90 bytes came and no good frame, as with a wrong baud rate'),
    ({'bytes_received': 90, 'sources': {Address(1, 1): SequenceCounter(received=4)}}, {},
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


def state(reason: str = '') -> LinkState:
    """Return the state of a link, open if nothing speaks against it."""
    return LinkState(not reason, 0.0, 'the link', reason, 1, 1, Traffic(), DecoderCounters(),
                     SigningCounters())


def controller(*lights: Address, only_target: bool = False) -> Client:
    """Return one that has heard these lights."""
    one = Client(Address(1, 194), Settings(), wanted=lambda source: not only_target)
    for source in lights:
        one.receive(source, heartbeat(MavType.ILLUMINATOR), 0.0)
    return one


@pytest.mark.parametrize('only_target', [False, True])
def test_lights_outside_the_target_are_named(only_target: bool) -> None:
    heard = controller(Address(1, 243), Address(1, 244), only_target=only_target)
    assert why_no_light(state(), heard) == '1/243, 1/244 heard, none of which is the target'


def test_only_some_lights_outside_the_target_are_remembered() -> None:
    heard = controller(*(Address(1, one) for one in range(1, 100)), only_target=True)
    assert len(heard.left_alone) == 8


def test_diagnostics_and_answers_give_the_same_reason() -> None:
    heard = controller(Address(1, 243))
    found = link_findings(state(), heard, heard.client, None, now=7.3, started=0.0)
    assert found == [(WARN, f'no light connected for 7.30 s: {why_no_light(state(), heard)}')]


def test_a_link_that_is_not_open_is_the_reason_before_all_others() -> None:
    assert why_no_light(state('no such file'), controller(Address(1, 243))) == (
        'the link is not open: no such file')
