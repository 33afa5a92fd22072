# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Recorders of messages that arrive from ROS in another thread."""

from __future__ import annotations

from collections.abc import Callable
import threading
from typing import Any

from support.waiting import Log, PATIENCE


class Recorder(Log[Any]):
    """Keeps the messages of a topic, and waits for them."""

    @property
    def messages(self) -> list[Any]:
        """Return all messages."""
        return list(self)

    @property
    def values(self) -> list[Any]:
        """Return the ``data`` of all messages."""
        return [message.data for message in self]

    def wait(self, wanted: Callable[[Any], Any] = lambda message: True, count: int = 1) -> Any:
        """Wait for ``count`` messages with a property, and return the last of them."""
        return self.wait_for(wanted, count=count)

    def wait_value(self, value: Any) -> None:
        """Wait until a message has this ``data``."""
        self.wait(lambda message: message.data == value)


class Call:
    """A service call in progress."""

    def __init__(self, future: Any) -> None:
        self._future = future
        self._answered = threading.Event()
        future.add_done_callback(lambda future: self._answered.set())

    @property
    def answered(self) -> bool:
        """Whether the answer has come."""
        return self._answered.is_set()

    def answers_within(self, timeout: float) -> bool:
        """Wait for the answer, and return whether it came in time."""
        return self._answered.wait(timeout)

    def result(self, timeout: float = PATIENCE) -> Any:
        """Wait for the answer and return it."""
        assert self._answered.wait(timeout), f'no answer within {timeout} s'
        return self._future.result()
