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

"""Which acknowledgement counts for which command."""

from __future__ import annotations

from illuminator_ros.mavlink.command import CommandStatus
from illuminator_ros.mavlink.messages import Address, MavResult
import pytest
from support.command_rig import ACCEPTED, DENIED, LIGHT, LONG, OURS, Rig

AUTOPILOT = Address(1, 1)


@pytest.mark.parametrize('source', [
    AUTOPILOT, Address(2, 243), Address(1, 244), Address(0, 0), OURS])
def test_acknowledgement_from_another_component_does_not_count(source: Address) -> None:
    rig = Rig()
    run = rig.start()
    rig.ack(MavResult.UNSUPPORTED, source=source)
    assert run.outcomes == []
    assert rig.sender.counters.unexpected_acks == 1
    rig.ack(ACCEPTED)
    assert run.outcome.accepted


def test_acknowledgement_of_another_command_does_not_count() -> None:
    rig = Rig()
    run = rig.start(405)
    rig.ack(DENIED, 406)
    assert run.outcomes == []


@pytest.mark.parametrize('target', [
    Address(255, 190), Address(1, 191), Address(2, 194), Address(255, 0), Address(0, 191)])
def test_acknowledgement_for_somebody_else_does_not_count(target: Address) -> None:
    rig = Rig()
    run = rig.start()
    rig.ack(DENIED, target=target)
    assert run.outcomes == []
    # Nor is it a mistake: a ground station may command the same light.
    assert rig.sender.counters.unexpected_acks == 0


@pytest.mark.parametrize('target', [OURS, Address(0, 0), Address(1, 0), Address(0, 194)])
def test_acknowledgement_for_us_or_for_nobody_counts(target: Address) -> None:
    rig = Rig()
    run = rig.start()
    rig.ack(ACCEPTED, target=target)
    assert run.outcome.accepted


def test_acknowledgement_before_anything_was_sent_counts_for_nothing() -> None:
    rig = Rig()
    rig.ack(ACCEPTED)
    assert rig.sender.counters.unexpected_acks == 1
    run = rig.ended()
    assert run.status is CommandStatus.NO_ANSWER


def test_repeated_acknowledgement_counts_once() -> None:
    rig = Rig()
    run = rig.start()
    for _ in range(3):
        rig.ack(ACCEPTED)
    assert run.outcome.accepted
    assert rig.sender.counters.unexpected_acks == 2


def test_contradicting_acknowledgement_after_the_first_changes_nothing() -> None:
    rig = Rig()
    run = rig.start()
    rig.ack(DENIED)
    rig.ack(ACCEPTED)
    assert run.outcome.result == DENIED


def test_acknowledgement_after_the_timeout_counts_for_nothing() -> None:
    rig = Rig()
    run = rig.ended()
    rig.ack(ACCEPTED)
    assert run.status is CommandStatus.NO_ANSWER
    assert rig.sender.counters.unexpected_acks == 1


def test_late_acknowledgement_of_an_earlier_try_counts() -> None:
    rig = Rig()
    run = rig.start()
    rig.run(1.2)
    assert len(run.frames) == 3
    rig.ack(ACCEPTED)
    assert (run.outcome.accepted, run.outcome.tries) == (True, 3)


def test_one_component_does_not_answer_for_all() -> None:
    rig = Rig()
    run = rig.start(target=Address(1, 0))
    rig.ack(ACCEPTED, source=LIGHT)
    rig.run(LONG)
    assert run.status is CommandStatus.NO_ANSWER
