# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Messages of which only the newest is worth sending; no I/O, no clock."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

from .messages import Address, Message, target_of

# Classes of messages that are sent together, in this order, and replaced together. In a group of
# one class, a message replaces only those for the same target and gimbal device.
StreamGroup = Sequence[type[Message]]
# s for which a group is worth sending: a line may be blocked for long.
MAX_AGE = 0.5
NO_TARGET = Address(0, 0)


class _Stream(NamedTuple):
    place: int
    target: Address = NO_TARGET
    device_id: int = 0


@dataclass
class _Held:
    """
    Messages of one stream.

    :param since: when the first one was taken, s.
    """

    since: float
    messages: list[tuple[Address, Message]] = field(default_factory=list)


class ConflatingQueue:
    """
    Holds messages of streams until the line has room, and drops those that newer ones replace.

    A slow line would otherwise carry them late, and other messages behind them.

    The most urgent group is first, unless it was the last one: at any rate of its messages the
    other groups have their turns. Streams of one group have theirs in the order in which they
    began to wait.

    :param groups: the most urgent first.
    :ivar dropped: messages that were dropped for newer ones, or for their age.
    """

    def __init__(self, groups: Sequence[StreamGroup]) -> None:
        self.dropped = 0
        # The group of each class, its position in the group, and whether it is the only one.
        self._places = {cls: (place, position, len(group) == 1)
                        for place, group in enumerate(groups)
                        for position, cls in enumerate(group)}
        # In the order in which they began to wait.
        self._held: dict[_Stream, _Held] = {}
        # The group that was taken last.
        self._last = -1

    def __bool__(self) -> bool:
        return bool(self._held)

    @property
    def _next(self) -> _Stream:
        return min(self._held, key=lambda stream: (stream.place == self._last, stream.place))

    @property
    def is_urgent(self) -> bool:
        """Return whether the most urgent group is next."""
        return bool(self._held) and self._next.place == 0

    @property
    def first(self) -> Message:
        """Return the first message that is next."""
        return self._held[self._next].messages[0][1]

    def hold(self, source: Address, message: Message, now: float) -> bool:
        """Take a message, if it belongs to a stream; return whether it does."""
        if type(message) not in self._places:
            return False
        place, position, is_alone = self._places[type(message)]
        stream = (_Stream(place, target_of(message), getattr(message, 'gimbal_device_id', 0))
                  if is_alone else _Stream(place))
        held = self._held.setdefault(stream, _Held(now))
        # A message that does not follow the last one begins a new set: the held one is dropped.
        if held.messages and self._places[type(held.messages[-1][1])][1] >= position:
            self.dropped += len(held.messages)
            self._held[stream] = held = _Held(now)
        held.messages.append((source, message))
        return True

    def pop(self, now: float) -> list[tuple[Address, Message]]:
        """Return the messages that are next; none if they are old."""
        stream = self._next
        held = self._held.pop(stream)
        if now < held.since + MAX_AGE:
            self._last = stream.place
            return held.messages
        self.dropped += len(held.messages)
        return []

    def pop_for(self, target: Address) -> list[tuple[Address, Message]]:
        """Return the messages of streams for one target, which a message to it must follow."""
        if target == NO_TARGET:
            return []
        streams = [stream for stream in self._held if stream.target == target]
        return [one for stream in streams for one in self._held.pop(stream).messages]

    def clear(self) -> None:
        """Drop all: the link is closed."""
        self._held.clear()
