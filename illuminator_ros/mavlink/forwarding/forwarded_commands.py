# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The commands of others that were forwarded lately, and their senders; no I/O, no clock."""

from __future__ import annotations

from typing import NamedTuple

from ..dialect import decode
from ..frame import Frame
from ..messages import Address, AnyCommand, CommandInt, CommandLong

# s; a device shows the effect of a command within its status interval.
MEMORY = 3.0
# Targets and commands that are remembered.
MAX_COMMANDS = 64
_CLASSES: dict[int, type[AnyCommand]] = {cls.id: cls for cls in (CommandLong, CommandInt)}


class _Sent(NamedTuple):
    source: Address
    first_param: float
    at: float


class ForwardedCommands:
    """Remembers the last command of each kind to each target."""

    def __init__(self) -> None:
        self._sent: dict[tuple[Address, int], _Sent] = {}

    def add(self, frame: Frame, now: float) -> None:
        """Note a frame that is forwarded, if it has a command."""
        cls = _CLASSES.get(frame.message_id)
        if cls is None:
            return
        command = decode(cls, frame.payload)
        key = Address(command.target_system, command.target_component), command.command
        self._sent.pop(key, None)
        self._sent[key] = _Sent(frame.source, command.param1, now)
        if len(self._sent) > MAX_COMMANDS:
            del self._sent[next(iter(self._sent))]

    def sender(
        self, target: Address, command: int, now: float, first_param: float | None = None,
    ) -> Address | None:
        """
        Return who has lately sent a command to a component, to all of its system, or to all.

        :param first_param: the value that the command must have had, None for any.
        """
        found = [sent for to in (target, Address(target.system, 0), Address(0, 0))
                 if (sent := self._sent.get((to, command))) and now - sent.at <= MEMORY
                 and first_param in (None, sent.first_param)]
        return max(found, key=lambda sent: sent.at).source if found else None
