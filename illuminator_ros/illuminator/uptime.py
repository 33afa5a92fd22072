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
What a light's uptime tells: time goes on, it has restarted, or the frame is an old one.

And how old: see :class:`SendingTimes`.
"""

from __future__ import annotations

from enum import Enum
import math

WRAP_MS = 1 << 32
# s; a frame later than this is not late, it is from another life of the light.
MAX_LATE = 5.0
# Slack for clocks and links: s, and a share of the time passed.
SLACK = 2.0
DRIFT = 0.05
# How wrong the clock of a light may be, as a share: an oscillator without a crystal.
CLOCK_ERROR = 0.02
# s for which a status is compared with. A clock that is still more wrong makes statuses look
# old, but by no more than a part of this, so what they confirm is confirmed a little later.
MEMORY = 5.0


class Uptime(Enum):
    """What an uptime means beside the last one."""

    RUNNING = 'running'
    RESTARTED = 'restarted'
    LATE = 'late'
    NO_CLOCK = 'no clock'


def compare_uptime(last_ms: int, new_ms: int, elapsed: float) -> Uptime:
    """
    Compare the uptime of a status with that of the newest one before.

    :param elapsed: s between the two on our clock, >= 0.

    The uptime wraps after 49.7 days. A light that was out of hearing for long may have restarted
    and show a greater uptime than before, but never one greater than the time since.
    """
    if new_ms == last_ms:
        # The same status twice or within a millisecond, or a light that has no clock.
        return Uptime.RUNNING if elapsed < SLACK else Uptime.NO_CLOCK
    ahead = (new_ms - last_ms - elapsed * 1000.0 + WRAP_MS / 2) % WRAP_MS - WRAP_MS / 2
    slack = 1000.0 * (SLACK + DRIFT * elapsed)
    forward = (new_ms - last_ms) % WRAP_MS < WRAP_MS / 2
    if abs(ahead) <= slack and forward:
        return Uptime.RUNNING
    if new_ms <= 1000.0 * (elapsed + SLACK / 4):
        return Uptime.RESTARTED
    if forward:
        return Uptime.RUNNING
    late_ms = (last_ms - new_ms) % WRAP_MS
    return Uptime.LATE if late_ms <= 1000.0 * MAX_LATE else Uptime.RESTARTED


class SendingTimes:
    """
    Tells when statuses were sent, at the latest, from their uptimes.

    A frame that was on its way for long has an uptime that lags behind those of quicker frames.
    Where nothing is known, or the light has no clock, a status counts as sent when it came.
    """

    def __init__(self) -> None:
        # The least delayed status of late, and when it came: by then it had been sent.
        self._uptime_ms = 0
        self._came_at = -math.inf
        # What uptimes differ by multiples of: some lights count in seconds. 0 is no clock.
        self._step_ms = 0

    def sent_by(self, uptime_ms: int, now: float) -> float:
        """Return the latest time at which a status that has just come can have been sent, s."""
        if self._came_at > -math.inf:
            ahead_ms = (uptime_ms - self._uptime_ms + WRAP_MS // 2) % WRAP_MS - WRAP_MS // 2
            self._step_ms = math.gcd(self._step_ms, ahead_ms)
            slack = self._step_ms / 1000 + CLOCK_ERROR * (now - self._came_at)
            sent_by = self._came_at + ahead_ms / 1000 + slack
            if self._step_ms and sent_by < now < self._came_at + MEMORY:
                return sent_by
        self._uptime_ms, self._came_at = uptime_ms, now
        return now
