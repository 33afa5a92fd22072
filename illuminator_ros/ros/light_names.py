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

"""What the nodes of further lights are called, and which names given for that are of no use."""

from __future__ import annotations

from collections.abc import Callable, Container, Mapping
import math

from ..mavlink.messages import Address

# s from the first light on, after which the others are there that are switched on with it.
PATIENCE = 10.0


class LightNames:
    """
    The names of nodes by the addresses of lights.

    :param given: the parameter ``names``.
    :param first: the name of the first node, from which the others follow.
    :param served: tells whether a light at an address would be served at all.
    :param warn: shows a line in the log.
    """

    def __init__(
        self, given: Mapping[Address, str], first: str, *, served: Callable[[Address], bool],
        warn: Callable[[str], object],
    ) -> None:
        self._given = given
        self._first = first
        self._served = served
        self._warn = warn
        self._due = math.inf

    def of(self, source: Address) -> str:
        """Return the name of a further light's node."""
        return self._given.get(source) or f'{self._first}_{source.system}_{source.component}'

    def begin(self, source: Address, now: float) -> None:
        """Take note of the light that the first node serves."""
        self._due = now + PATIENCE
        if name := self._given.get(source):
            self._warn(
                f'names: {source}={name} is not used, since light {source} is served by the first '
                f'node, {self._first}: -r __node:={name} names that, target_system and '
                'target_component choose its light')

    def look(self, heard: Container[Address], now: float) -> None:
        """Say once which names are of lights that are not there; callable from any thread."""
        if now < self._due:
            return
        self._due = math.inf
        for source, name in self._given.items():
            if not self._served(source):
                self._warn(f'names: {source}={name} is not used, since only_target leaves light '
                           f'{source} alone')
            elif source not in heard:
                self._warn(f'names: {source}={name} is not used yet, since no light {source} has '
                           'been heard')
