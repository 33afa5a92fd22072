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

"""What a light reports to be wrong with it."""

from __future__ import annotations

from enum import IntFlag


class ErrorFlag(IntFlag):
    """ILLUMINATOR_ERROR_FLAGS."""

    THERMAL_THROTTLING = 1
    OVER_TEMPERATURE_SHUTDOWN = 2
    THERMISTOR_FAILURE = 4


# The flags under which a light is less bright than it was told to be.
DIMMING_FLAGS = ErrorFlag.THERMAL_THROTTLING | ErrorFlag.OVER_TEMPERATURE_SHUTDOWN
# An int: since Python 3.11 the complement of an IntFlag has no unknown bits.
KNOWN_FLAGS = int(DIMMING_FLAGS | ErrorFlag.THERMISTOR_FAILURE)


def flag_names(flags: int) -> list[str]:
    """Return readable names of error flags; unknown bits as one hexadecimal number."""
    names = [flag.name.lower().replace('_', ' ') for flag in ErrorFlag
             if flag & flags and flag.name]
    if unknown := flags & ~KNOWN_FLAGS:
        names.append(f'unknown flags 0x{unknown:x}')
    return names
