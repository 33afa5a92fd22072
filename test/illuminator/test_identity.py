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

"""The identity of a light: COMPONENT_INFORMATION_BASIC."""

from __future__ import annotations

from typing import Any

from illuminator_ros.mavlink.messages import (
    ComponentInformationBasic,
    decode_payload,
    encode_payload,
    INFORMATION_ID,
    MavCmd,
    MavResult,
)
from illuminator_ros.payload.identity import Identity, MAX_QUESTIONS, SETTLING_TIME, text
import pytest
from support.back_to_back import Pair
from support.fake_light import FakeLight


def questions(pair: Pair) -> list[Any]:
    return [command for command in pair.commands(MavCmd.REQUEST_MESSAGE)
            if command.param1 == INFORMATION_ID]


class Selective(FakeLight):
    """A light that answers a request for its identity with one result, or not at all."""

    def __init__(self, result: MavResult | None, **options: Any) -> None:
        super().__init__(**options)
        self.result = result

    def receive(self, source: Any, message: Any, now: float) -> None:
        usual = self.results
        if getattr(message, 'param1', None) == INFORMATION_ID:
            self.results = {MavCmd.REQUEST_MESSAGE: self.result}
        super().receive(source, message, now)
        self.results = usual


@pytest.mark.parametrize(('field', 'expected'), [
    (b'torch', 'torch'), (b'torch\0rubbish', 'torch'), (b'', ''), (b'x' * 32, 'x' * 32),
    (b' padded ', 'padded'), ('Lämp'.encode(), 'Lämp'), (b'a\x1b[31mb', 'a?[31mb'),
    (b'\xff\xfe', '\N{REPLACEMENT CHARACTER}' * 2), (b'a\nb', 'a?b'),
])
def test_a_char_field_is_printable_up_to_its_terminator(field: bytes, expected: str) -> None:
    assert text(field) == expected


def test_an_identity_is_read_from_the_wire() -> None:
    sent = ComponentInformationBasic(0, 0, 0, b'm' * 32, b'torch', b'1', b'2', b'n-1')
    message = decode_payload(ComponentInformationBasic, encode_payload(sent))
    assert Identity.from_message(message) == Identity('m' * 32, 'torch', '1', '2', 'n-1')


def test_the_identity_is_requested_once_and_kept(faked: Pair) -> None:
    faked.run(60.0)
    assert len(questions(faked)) == 1
    assert faked.snapshot.identity == Identity('maker', 'torch', '1.2', '3', 'T-1')
    assert faked.recorder.identities == [faked.snapshot.identity]


def test_the_identity_is_requested_again_after_an_absence(fake: FakeLight, faked: Pair) -> None:
    fake.silent = True
    faked.run(10.0)
    fake.identity = Identity(serial_number='T-2')
    fake.silent = False
    faked.run(3.0)
    assert faked.snapshot.identity == Identity(serial_number='T-2')


@pytest.mark.parametrize(('light', 'count', 'failure'), [
    (Selective(MavResult.DENIED), 1, 'refused: MAV_RESULT_DENIED'),
    (Selective(MavResult.UNSUPPORTED), 1, 'refused: MAV_RESULT_UNSUPPORTED'),
    (Selective(None), 4, 'no acknowledgement'),
])
def test_the_reason_for_a_missing_identity_is_named(
    light: FakeLight, count: int, failure: str,
) -> None:
    pair = Pair(light, command_retries=3).settle(30.0)
    assert len(questions(pair)) == count
    assert pair.snapshot.identity_is_settled
    result = pair.wait_for(pair.ask_refresh())
    assert f'COMPONENT_INFORMATION_BASIC: {failure}' in result.message


def test_an_identity_that_is_lost_is_requested_again() -> None:
    light = FakeLight()
    light.answers.discard(INFORMATION_ID)
    pair = Pair(light).settle(30.0)
    assert len(questions(pair)) == MAX_QUESTIONS
    light.answers.add(INFORMATION_ID)
    assert 'COMPONENT_INFORMATION_BASIC: received' in pair.wait_for(pair.ask_refresh()).message


def test_an_identity_counts_without_its_acknowledgement() -> None:
    light = Selective(None)
    pair = Pair(light).settle(0.1)
    light.send(light.information())
    pair.run(10.0)
    assert pair.snapshot.identity is not None


def test_a_light_that_ignores_the_request_confirms_changes_as_fast() -> None:
    pair = Pair(Selective(None, stream=0.0))
    pair.run_until(lambda: pair.controller.lights and pair.light.status)
    answer = pair.ask_enable(True)
    assert pair.wait_for(answer).success
    assert answer.seconds < 0.1


def test_the_identity_is_settled_after_a_while_without_an_answer() -> None:
    pair = Pair(Selective(None), command_timeout=5.0)
    pair.run_until(lambda: pair.controller.lights)
    assert not pair.snapshot.identity_is_settled
    pair.run(SETTLING_TIME)
    assert pair.snapshot.identity_is_settled
