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

"""What is found wrong with a link that is open."""

from __future__ import annotations

from illuminator_ros.illuminator.light import Settings
from illuminator_ros.mavlink.frame import DecoderCounters
from illuminator_ros.mavlink.link_state import LinkState
from illuminator_ros.mavlink.messages import Address, heartbeat, MavType
from illuminator_ros.mavlink.signing import SigningCounters
from illuminator_ros.mavlink.statistics import Traffic
from illuminator_ros.ros.diagnostics import link_findings, WARN
import pytest
from support.client import Client

LIGHT = Address(1, 243)
# s; longer than all that is asked when a light is found, and sent again.
LONG = 30.0


@pytest.fixture
def controller() -> Client:
    """Return one that has asked a light, and was not answered."""
    one = Client(Address(1, 194), Settings(), command_timeout=0.1, command_retries=0)
    hear(one, 0.0)
    while (due := one.next_deadline()) < LONG:
        one.poll(due)
        hear(one, due)
    return one


def hear(controller: Client, now: float) -> None:
    """Have the light heard."""
    controller.receive(LIGHT, heartbeat(MavType.ILLUMINATOR), now)


def found(controller: Client, *, signed: int) -> list[tuple[bytes, str]]:
    """Return what is found while so many signed frames have come."""
    state = LinkState(True, 0.0, 'test', '', 1, 1, Traffic(), DecoderCounters(),
                      SigningCounters(unchecked=signed))
    return link_findings(
        state, controller, controller.client, controller.lights[LIGHT], now=LONG, started=0.0)


def test_who_signs_and_does_not_answer_wants_signed_commands(controller: Client) -> None:
    ((level, text),) = found(controller, signed=1)
    assert level == WARN
    assert text == ('commands go unanswered, and the others sign their frames while signing_mode '
                    'is off')


def test_silence_alone_says_nothing_of_signing(controller: Client) -> None:
    assert found(controller, signed=0) == []


def test_it_is_over_once_one_is_answered(controller: Client) -> None:
    controller.sender.unanswering.clear()
    assert found(controller, signed=1) == []
