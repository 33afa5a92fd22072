# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The log of a node: lines of one kind are limited in rate, and those left out are counted."""

from illuminator_ros.ros import throttled_log as log
import pytest
from rclpy.logging import get_logger


class Clock:
    now = 0.0

    def __call__(self) -> float:
        return self.now


@pytest.fixture
def clock() -> Clock:
    return Clock()


@pytest.fixture
def node_log(clock: Clock) -> log.NodeLog:
    return log.NodeLog(get_logger('light'), clock)


def lines(capfd: pytest.CaptureFixture[str]) -> list[str]:
    return [line.partition('[light]: ')[2] for line in ''.join(capfd.readouterr()).splitlines()]


def test_lines_of_a_kind_are_limited_and_the_last_one_left_out_is_written_with_their_number(
    node_log: log.NodeLog, clock: Clock, capfd: pytest.CaptureFixture[str],
) -> None:
    for number in range(log.BURST + 5):
        node_log.warning(f'line {number}', 'kind')
    node_log.flush()
    assert lines(capfd) == [f'line {number}' for number in range(log.BURST)]

    clock.now = log.PERIOD
    node_log.flush()
    node_log.flush()
    assert lines(capfd) == [f'line {log.BURST + 4} (4 similar lines left out)']

    node_log.warning('next', 'kind')
    assert lines(capfd) == ['next']


def test_lines_of_other_kinds_and_of_none_are_not_held_back(
    node_log: log.NodeLog, capfd: pytest.CaptureFixture[str],
) -> None:
    for _ in range(2 * log.BURST):
        node_log.warning('of one kind', 'kind')
        node_log.warning('of no kind')
    node_log.warning('of another', 'other')

    written = lines(capfd)
    assert written.count('of one kind') == log.BURST
    assert written.count('of no kind') == 2 * log.BURST
    assert written[-1] == 'of another'


def test_kinds_beyond_the_limit_are_left_out_until_others_have_ended(
    node_log: log.NodeLog, clock: Clock, capfd: pytest.CaptureFixture[str],
) -> None:
    for number in range(log.MAX_KINDS + 1):
        node_log.warning('text', f'kind {number}')
    assert len(lines(capfd)) == log.MAX_KINDS

    clock.now = log.PERIOD
    node_log.flush()
    node_log.warning('text', 'one more')
    assert lines(capfd) == ['text']


def test_line_that_another_program_can_cause_is_cut_to_a_length(
    node_log: log.NodeLog, capfd: pytest.CaptureFixture[str],
) -> None:
    node_log.warning('x' * log.MAX_LENGTH, 'kind')
    node_log.warning('x' * 2 * log.MAX_LENGTH, 'kind')

    assert lines(capfd) == ['x' * log.MAX_LENGTH, 'x' * log.MAX_LENGTH + '...']


def test_a_stream_that_fails_is_logged_once_for_each_reason_and_again_after_a_pause(
    node_log: log.NodeLog, clock: Clock, capfd: pytest.CaptureFixture[str],
) -> None:
    def fail(reason: str, stream: str = 'cmd/brightness') -> None:
        clock.now += 0.5
        node_log.stream_failed(reason, stream)

    for number in range(20):
        fail(f'light 1/243 is lost: no heartbeat for {number}.5 s')
    assert lines(capfd) == ['light 1/243 is lost: no heartbeat for 0.5 s']
    fail('refused')
    fail('refused', 'cmd/enable')
    fail('light 1/243 is lost: no heartbeat for 1.5 s')
    assert len(lines(capfd)) == 3
    clock.now += log.REPETITION
    fail('light 1/243 is lost: no heartbeat for 9.5 s')
    assert lines(capfd) == ['light 1/243 is lost: no heartbeat for 9.5 s']
