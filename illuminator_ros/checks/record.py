# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""A record of the messages of one device, bounded in memory."""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Iterable
from typing import cast, TypeVar

from ..mavlink.dialect import base_size
from ..mavlink.frame import Frame
from ..mavlink.messages import Message

T = TypeVar('T')
M = TypeVar('M', bound=Message)

# The most entries that are kept of each record.
MAX_ENTRIES = 10_000


class History(deque[T]):
    """
    The newest entries, so that a flood of messages takes a bounded memory.

    :ivar total: entries ever appended.
    """

    def __init__(self) -> None:
        super().__init__(maxlen=MAX_ENTRIES)
        self.total = 0

    def append(self, entry: T, /) -> None:
        """Append an entry; drop the oldest entry if there is no room."""
        super().append(entry)
        self.total += 1

    def since(self, count: int) -> list[T]:
        """Return the entries that were appended after the first ``count`` and are still kept."""
        return list(self)[max(len(self) - (self.total - count), 0):]


class Record:
    """
    The messages of a device, and a line of text for each message to or from it.

    :param classes: the classes of messages that are kept.
    :ivar versions: the number of frames of the device by MAVLink version.
    :ivar odd_lengths: the latest wrong length of its MAVLink 1 frames, by message name.
    :ivar log: the lines.
    """

    def __init__(self, classes: Iterable[type[Message]]) -> None:
        self.versions: Counter[int] = Counter()
        self.odd_lengths: dict[str, int] = {}
        self.log: History[str] = History()
        self._received: dict[type[Message], History[tuple[float, Message]]] = {
            cls: History() for cls in classes}
        self._began: float | None = None

    def note(self, direction: str, text: str, now: float) -> str:
        """Add a line to the log, and return it."""
        self._began = now if self._began is None else self._began
        self.log.append(f'{now - self._began:8.3f} s {direction} {text}')
        return self.log[-1]

    def add(self, message: Message, now: float) -> None:
        """Add a message of the device."""
        self._received[type(message)].append((now, message))

    def inspect(self, frame: Frame, cls: type[Message]) -> None:
        """Count a frame of the device."""
        self.versions[frame.version] += 1
        if frame.version == 1 and len(frame.payload) != base_size(cls):
            self.odd_lengths[cls.msgname] = len(frame.payload)

    def received(self, cls: type[M]) -> History[tuple[float, M]]:
        """Return the messages of a class that the device has sent, with their times, s."""
        return cast(History[tuple[float, M]], self._received.get(cls, History()))
