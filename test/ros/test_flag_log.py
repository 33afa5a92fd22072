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

"""What the log says of error flags: each change once, in time, and no flood."""

from illuminator_ros.ros.diagnostics import ERROR, OK, WARN
from illuminator_ros.ros.flag_log import FlagLog, PAUSE
import pytest

THROTTLING, SHUTDOWN, SENSOR = 1, 2, 4
TEXTS = {
    THROTTLING: (WARN, 'thermal throttling: dimmed because it is hot'),
    SHUTDOWN: (ERROR, 'over temperature shutdown: switched off because it is too hot'),
    SENSOR: (WARN, 'thermistor failure: temperature sensor failed'),
    0x18: (WARN, 'unknown flags 0x18'),
}


@pytest.fixture
def log() -> FlagLog:
    return FlagLog()


@pytest.mark.parametrize('flags', TEXTS)
def test_a_flag_is_told_when_it_comes(log: FlagLog, flags: int) -> None:
    assert log.take(0, 0.0) == []
    assert log.take(flags, 1.0) == [TEXTS[flags]]


@pytest.mark.parametrize('flags', TEXTS)
def test_it_is_told_once(log: FlagLog, flags: int) -> None:
    log.take(flags, 0.0)
    assert [log.take(flags, float(now)) for now in range(1, 100)] == 99 * [[]]


@pytest.mark.parametrize('flags', TEXTS)
def test_it_is_told_when_it_has_gone(log: FlagLog, flags: int) -> None:
    log.take(flags, 0.0)
    name = TEXTS[flags][1].partition(':')[0]
    assert log.take(0, PAUSE) == [(OK, f'{name} cleared')]
    assert log.take(0, 10 * PAUSE) == []


def test_a_worse_one_is_told_at_once(log: FlagLog) -> None:
    log.take(THROTTLING, 0.0)
    assert log.take(THROTTLING | SHUTDOWN, 0.1) == [TEXTS[SHUTDOWN]]


def test_a_flag_that_toggles_does_not_flood(log: FlagLog) -> None:
    lines = [line for step in range(1000) for line in log.take(SHUTDOWN * (step % 2), step / 100)]
    assert lines[0] == TEXTS[SHUTDOWN]
    assert len(lines) <= 1 + 10 / PAUSE


def test_the_last_line_comes_to_be_true(log: FlagLog) -> None:
    log.take(SHUTDOWN, 0.0)
    assert log.take(0, 1.0) == []
    assert log.take(0, PAUSE) == [(OK, 'over temperature shutdown cleared')]


def test_other_unknown_flags_are_told_too(log: FlagLog) -> None:
    log.take(0x8, 0.0)
    assert log.take(0x18, PAUSE) == [TEXTS[0x18]]
