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

"""Whether a status shows what was asked for, or what another one showed."""

from __future__ import annotations

from ..error_flags import DIMMING_FLAGS
from ..model import Configuration, NOTHING, Status


def differences(asked: Configuration, status: Status) -> list[str]:
    """Return the fields in which a status does not show what was asked for."""
    if not status.complete:
        return [text.split()[0] for text in status.invalid]
    shown = status.configuration(NOTHING)
    names = asked.differences(shown)
    if status.error_flags & DIMMING_FLAGS and shown.brightness < asked.brightness:
        names = [name for name in names if name != 'brightness']
    return names


def same(one: Status, other: Status) -> bool:
    """Return whether two statuses show the same switch and configuration."""
    if one.enabled != other.enabled or one.complete != other.complete:
        return False
    if not one.complete:
        return one.invalid == other.invalid
    first, second = one.configuration(NOTHING), other.configuration(NOTHING)
    names = first.differences(second)
    return not [name for name in names if name != 'brightness' or not (
        (one.error_flags | other.error_flags) & DIMMING_FLAGS)]
