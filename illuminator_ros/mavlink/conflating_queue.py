# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Messages of which only the newest is worth sending; no I/O, no clock."""

from __future__ import annotations

from collections.abc import Sequence

from .messages import Address, Message

# Classes of messages that are sent together, in this order, and replaced together.
StreamGroup = Sequence[type[Message]]
# s for which a group is worth sending: a line may be blocked for long.
MAX_AGE = 0.5


class ConflatingQueue:
    """
    Holds messages of streams until the line has room, and drops those that newer ones replace.

    A slow line would otherwise carry them late, and other messages behind them.

    The most urgent group is first, unless it was the last one: at any rate of its messages the
    other groups have their turns.

    :param groups: the most urgent first.
    :ivar dropped: messages that were dropped for newer ones, or for their age.
    """

    def __init__(self, groups: Sequence[StreamGroup]) -> None:
        self.dropped = 0
        # The group of each class, and its position in the group.
        self._places = {cls: (place, position) for place, group in enumerate(groups)
                        for position, cls in enumerate(group)}
        self._held: list[list[tuple[Address, Message]]] = [[] for _ in groups]
        # When the first message of each group was taken, s.
        self._since = [0.0 for _ in groups]
        # The group that was taken last.
        self._last = -1

    def __bool__(self) -> bool:
        return any(self._held)

    @property
    def _next(self) -> int:
        return min((place for place, held in enumerate(self._held) if held),
                   key=lambda place: (place == self._last, place))

    @property
    def is_urgent(self) -> bool:
        """Return whether the most urgent group is next."""
        return bool(self) and self._next == 0

    @property
    def first(self) -> Message:
        """Return the first message of the next group."""
        return self._held[self._next][0][1]

    def hold(self, source: Address, message: Message, now: float) -> bool:
        """Take a message, if it belongs to a stream; return whether it does."""
        if type(message) not in self._places:
            return False
        place, position = self._places[type(message)]
        held = self._held[place]
        # A message that does not follow the last one begins a new set: the held one is dropped.
        if held and self._places[type(held[-1][1])][1] >= position:
            self.dropped += len(held)
            held.clear()
        if not held:
            self._since[place] = now
        held.append((source, message))
        return True

    def take(self, now: float) -> list[tuple[Address, Message]]:
        """Return the messages of the next group; none if they are old."""
        place = self._next
        held, self._held[place] = self._held[place], []
        if now < self._since[place] + MAX_AGE:
            self._last = place
            return held
        self.dropped += len(held)
        return []

    def clear(self) -> None:
        """Drop all: the link is closed."""
        for held in self._held:
            held.clear()
