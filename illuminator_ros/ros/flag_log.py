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

"""What the log says of the error flags of one light."""

from __future__ import annotations

import math

from .diagnostics import Finding, flag_findings, OK
from ..illuminator.error_flags import flag_names

# s between two lines on one flag.
PAUSE = 5.0


class FlagLog:
    """
    Tells the coming and the going of each flag.

    A flag that toggles is told of every :data:`PAUSE` at most. What has changed meanwhile is told
    after it, so that the last line on a flag comes to be true.
    """

    def __init__(self) -> None:
        # By flag, what was last told of it and when; no finding where it was told to be gone.
        self._told: dict[int, tuple[str, float]] = {}

    def take(self, flags: int, now: float) -> list[Finding]:
        """
        Return what is to be told, :data:`~.diagnostics.OK` for a flag that has gone.

        :param flags: those of a status; for bits that nobody knows, one line tells of all.
        :param now: when it came, s.
        """
        lines: list[Finding] = []
        found = flag_findings(flags)
        for flag in {**self._told, **found}:
            name = ', '.join(flag_names(flags & flag))
            told, told_at = self._told.get(flag, ('', -math.inf))
            if name == told or now < told_at + PAUSE:
                continue
            self._told[flag] = (name, now)
            if name:
                severity, text = found[flag]
                lines.append((severity, text if text == name else f'{name}: {text}'))
            else:
                lines.append((OK, f'{told} cleared'))
        return lines
