# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The pauses between tries to open a link, and the thread that tries."""

from __future__ import annotations

import itertools
import socket
import threading

from hypothesis import given
from hypothesis import strategies as st
from illuminator_ros.mavlink.connector import Backoff, Connector
from illuminator_ros.mavlink.transport.tcp import CONNECT_TIMEOUT
from illuminator_ros.mavlink.url import parse_url
import pytest
from support.ports import free_port
from support.waiting import PATIENCE


def pauses(count: int, jitter: float = 1.0, spent: float = 0.0) -> list[float]:
    """Return the pauses before the first try and after each failure."""
    backoff = Backoff(lambda: jitter)
    found = [backoff.pause(spent)]
    for _ in range(count):
        backoff.failed()
        found.append(backoff.pause(spent))
    return found


@given(st.integers(1, 50), st.floats(0, 1), st.floats(0, CONNECT_TIMEOUT))
def test_tries_begin_within_a_second_of_each_other_and_never_without_pause(
        failures: int, jitter: float, spent: float) -> None:
    longest, pause = pauses(failures)[-1], pauses(failures, jitter, spent)[-1]
    assert 0.025 <= pause <= longest * (0.5 + 0.5 * jitter)
    assert spent + pause < 1.0


def test_pause_is_none_after_success_and_short_after_an_answer() -> None:
    backoff = Backoff(lambda: 1.0)
    found = []
    for noted in (backoff.answered, backoff.succeeded):
        for _ in range(10):
            backoff.failed()
        noted()
        found.append(backoff.pause(0.0))
    assert found == [0.05, 0.0]


def test_connector_counts_the_time_of_a_try_in_its_pause() -> None:
    spent, ended = list[float](), threading.Event()

    class Recorded(Backoff):

        def pause(self, seconds: float) -> float:
            spent.append(seconds)
            if len(spent) > 2:
                one.stop()
                ended.set()
            return 0.0

    # No program listens there.
    one = Connector(
        parse_url(f'tcp://127.0.0.1:{free_port(socket.SOCK_STREAM)}'), lambda outcome: None,
        backoff=Recorded(), clock=itertools.count(0.0, 0.7).__next__)
    one.start()
    assert ended.wait(PATIENCE)
    assert spent == pytest.approx([0.0, 0.7, 0.7])
