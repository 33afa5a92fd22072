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

"""Outcomes of a check other than that its requirement is met."""

from __future__ import annotations

from collections.abc import Iterable


class DeviceLost(Exception):
    """The device has stopped sending."""


class Skipped(Exception):
    """A requirement cannot be checked; the text gives the reason."""


class Failed(Exception):
    """
    The device does not meet a requirement; the text gives the deviation.

    :ivar lines: the lines of the log that show the deviation, None for all lines of the check.
    """

    def __init__(self, reason: str, lines: list[str] | None = None) -> None:
        super().__init__(reason)
        self.lines = lines


def fail_if(failures: Iterable[Failed | None]) -> None:
    """
    Raise if there are failures.

    :raises Failed: with all of them.
    """
    if found := [one for one in failures if one is not None]:
        raise Failed('; '.join(map(str, found)),
                     [line for one in found for line in one.lines or ()])
