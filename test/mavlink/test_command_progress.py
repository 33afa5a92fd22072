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

"""Commands that take long: MAV_RESULT_IN_PROGRESS."""

from __future__ import annotations

from illuminator_ros.mavlink.command import CommandStatus, PROGRESS_TIMEOUT
from illuminator_ros.mavlink.messages import MavResult
import pytest
from support.command_rig import ACCEPTED, FAILED, IN_PROGRESS, LONG, REJECTED, Rig


def test_nothing_is_resent_once_it_is_in_progress() -> None:
    rig = Rig()
    run = rig.start()
    for second in range(20):
        rig.ack(IN_PROGRESS, progress=second * 5)
        rig.run(1.0)
    rig.ack(ACCEPTED)
    assert run.outcome.accepted
    assert len(run.frames) == 1


def test_nothing_is_resent_when_the_progress_stops() -> None:
    rig = Rig()
    run = rig.start()
    rig.ack(IN_PROGRESS, progress=40)
    rig.run(LONG)
    assert run.status is CommandStatus.PROGRESS_STOPPED
    assert run.outcome.progress == 40
    assert len(run.frames) == 1


def test_each_report_of_progress_lengthens_the_wait() -> None:
    rig = Rig()
    run = rig.start()
    for _ in range(3):
        rig.ack(IN_PROGRESS)
        assert rig.sender.next_deadline() == pytest.approx(rig.now + PROGRESS_TIMEOUT)
        rig.run(PROGRESS_TIMEOUT - 0.01)
    assert run.outcomes == []
    rig.run(0.01)
    assert run.outcome.elapsed == pytest.approx(3 * PROGRESS_TIMEOUT - 0.02)


def test_progress_after_a_resend_ends_the_resending() -> None:
    rig = Rig([], [IN_PROGRESS])
    run = rig.ended()
    assert run.status is CommandStatus.PROGRESS_STOPPED
    assert len(run.frames) == 2


@pytest.mark.parametrize(('reported', 'known'), [(0, 0), (100, 100), (101, None), (255, None)])
def test_progress_above_100_is_not_known(reported: int, known: int | None) -> None:
    rig = Rig()
    run = rig.start()
    rig.ack(IN_PROGRESS, progress=reported)
    rig.ack(FAILED)
    assert run.outcome.progress == known
    assert '%' not in str(run.outcome)


@pytest.mark.parametrize('result', [
    ACCEPTED, MavResult.DENIED, FAILED, MavResult.CANCELLED, MavResult.COMMAND_INT_ONLY,
    MavResult.COMMAND_LONG_ONLY, 200])
def test_every_other_result_ends_what_is_in_progress(result: int) -> None:
    rig = Rig([IN_PROGRESS, result])
    run = rig.ended()
    assert (run.status, run.result) == (CommandStatus.ANSWERED, result)
    assert len(run.frames) == 1


@pytest.mark.parametrize('tries', [1, 2])
def test_rejection_of_a_resend_or_a_copy_does_not_end_the_try_at_work(tries: int) -> None:
    rig = Rig()
    run = rig.start()
    rig.run(0.6 * (tries - 1))
    assert len(run.frames) == tries
    rig.ack(IN_PROGRESS)
    rig.ack(REJECTED)
    assert run.outcomes == []
    rig.ack(ACCEPTED)
    assert run.outcome.accepted


def test_progress_after_a_temporary_rejection_ends_the_resending() -> None:
    rig = Rig()
    run = rig.start()
    rig.ack(REJECTED)
    rig.ack(IN_PROGRESS)
    rig.run(LONG)
    assert run.status is CommandStatus.PROGRESS_STOPPED
    assert len(run.frames) == 1
