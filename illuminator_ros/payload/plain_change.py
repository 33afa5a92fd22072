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

"""A change of a property of a device that a few values and functions describe."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Generic, TypeVar

from ..mavlink.command_sender import CommandPosition

S = TypeVar('S')


@dataclass(frozen=True)
class PlainChange(Generic[S]):
    """
    A :class:`~.confirmed_command.Change` that needs no class of its own.

    :param status_name: of the status that shows the change, '' if none does.
    """

    command: int
    params: tuple[float, ...]
    goal: str
    position: CommandPosition | None = None
    status_name: str = ''
    shown_by: Callable[[S], bool | None] = lambda status: None
    actual: Callable[[S], str] = lambda status: ''
    note: str = ''
    is_idempotent: bool = True
    is_repeated: bool = False

    def evidence(self, status: S) -> str:
        """See :class:`~.confirmed_command.Change`."""
        return f'confirmed by {self.status_name}'
