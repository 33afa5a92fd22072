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

"""
Time that hardly passes by itself, for what runs in other processes too.

Lights and bridges of the tests live by a clock that is slow, so that a machine which stands still
for a second makes nothing time out; a test that wants something to time out sets it forward.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
import mmap
import os
from pathlib import Path
import selectors
import time
from typing import Any

from illuminator_ros.mavlink.link import Link
from support.waiting import eventually

# s of this clock in one real s.
SPEED = 0.05
# Real s after which a sleeping link looks at the clock again: it may have been set forward.
LOOK_INTERVAL = 0.05
# s on the clock at its beginning: 0 as a time is found out.
START = 1000.0
VARIABLE = 'ILLUMINATOR_ROS_TEST_CLOCK'


class SlowClock:
    """
    A clock that all who open the same file share.

    :ivar path: of the file.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        with path.open('r+b') as file:
            self._ahead = memoryview(mmap.mmap(file.fileno(), 8)).cast('d')

    def __call__(self) -> float:
        return START + time.monotonic() * SPEED + self._ahead[0]

    def forward(self, seconds: float) -> None:
        """Let time pass, s of this clock."""
        self._ahead[0] += seconds

    @property
    def environment(self) -> Mapping[str, str]:
        """Return what tells another process of this clock."""
        return {VARIABLE: str(self.path)}


def _open_clock() -> SlowClock:
    if path := os.environ.get(VARIABLE):
        return SlowClock(Path(path))
    # A file in memory: it goes with the last process that has it, however that ends.
    descriptor = os.memfd_create('clock of tests')
    os.write(descriptor, bytes(8))
    return SlowClock(Path(f'/proc/{os.getpid()}/fd/{descriptor}'))


CLOCK = _open_clock()


def pass_time_until(condition: Callable[[], Any], step: float = 1.0) -> None:
    """
    Let time pass until something is so.

    Only for where nothing else is meanwhile to be in time: how often the others come to do
    something in a step is not certain.
    """
    def passed() -> Any:
        if not (result := condition()):
            CLOCK.forward(step)
        return result

    eventually(passed, 'what time was to bring')


class _SlowSelector(selectors.DefaultSelector):

    def select(self, timeout: float | None = None) -> Any:
        seconds = LOOK_INTERVAL if timeout is None else timeout / SPEED
        return super().select(min(seconds, LOOK_INTERVAL))


class SlowLink(Link):
    """A link that lives by the slow clock."""

    def __init__(self, *arguments: Any, **named: Any) -> None:
        super().__init__(*arguments, clock=CLOCK, **named)
        self._selector.close()
        self._selector = _SlowSelector()
        self._selector.register(self._wake_out, selectors.EVENT_READ)
