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

"""Log lines on the error flags of one light."""

from __future__ import annotations

import math

from .diagnostics import flag_findings
from ..model import flag_names
from ...ros.diagnostics import Finding, OK

# s between two lines on one flag.
PAUSE = 5.0


class FlagLog:
    """
    Reports when each flag is set and cleared, at most every :data:`PAUSE`.

    A change within the pause is reported after it, so that the last line on a flag is true.
    """

    def __init__(self) -> None:
        # By flag, the name in its last line and the time, s; '' where that said it is cleared.
        self._told: dict[int, tuple[str, float]] = {}

    def take(self, flags: int, now: float) -> list[Finding]:
        """
        Return the lines to log, of level OK for a flag that was cleared.

        :param flags: those of a status; all unknown bits share one line.
        :param now: when it was received, s.
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
