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

"""The newest entries of an unbounded sequence, so that a flood takes a bounded memory."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from itertools import islice
from typing import Generic, TypeVar

T = TypeVar('T')

LIMIT = 10_000


class History(Generic[T]):
    """
    Keeps the newest entries.

    :param limit: entries kept.
    :ivar count: entries ever appended.
    """

    def __init__(self, limit: int = LIMIT) -> None:
        self._entries: deque[T] = deque(maxlen=limit)
        self.count = 0

    def append(self, entry: T) -> None:
        """Append an entry; the oldest one is dropped where there is no room."""
        self._entries.append(entry)
        self.count += 1

    def since(self, count: int) -> list[T]:
        """Return the entries that were appended after the first ``count`` and are still kept."""
        return list(islice(self._entries, max(len(self) - (self.count - count), 0), None))

    @property
    def last(self) -> T:
        """Return the newest entry."""
        return self._entries[-1]

    def __iter__(self) -> Iterator[T]:
        return iter(self._entries)

    def __len__(self) -> int:
        return len(self._entries)
