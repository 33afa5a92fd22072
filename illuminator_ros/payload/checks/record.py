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

"""A record of the messages of one device, bounded in memory."""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Callable, Iterable
from dataclasses import astuple
from typing import cast, TypeVar

from ..identity import Identity
from ...mavlink import messages
from ...mavlink.dialect import base_size, mavlink
from ...mavlink.frame import Frame
from ...mavlink.messages import command_name, CommandAck, Message, result_name

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


def _protocol_text(message: Message) -> str:
    if isinstance(message, CommandAck):
        target = messages.target_of(message)
        progress = message.result == mavlink.MAV_RESULT_IN_PROGRESS
        return (f'COMMAND_ACK {command_name(message.command)}: {result_name(message.result)}'
                + (f', progress {message.progress}' if progress else '')
                + (f' to {target}' if any(target) else ''))
    if isinstance(message, messages.Heartbeat):
        return f'HEARTBEAT type {message.type}, autopilot {message.autopilot}'
    if isinstance(message, messages.ComponentInformationBasic):
        identity = astuple(Identity.from_message(message))
        return f'{message.get_type()} {", ".join(map(repr, identity))}'
    return message.get_type()


class Record:
    """
    The messages of a device, and a line of text for each message to or from it.

    :param classes: the classes of messages that are kept.
    :param describe: returns the text of a message of the payload, '' for its name.
    :ivar versions: the number of frames of the device by MAVLink version.
    :ivar odd_lengths: the latest wrong length of its MAVLink 1 frames, by message name.
    :ivar log: the lines.
    """

    def __init__(
        self, classes: Iterable[type[Message]], describe: Callable[[Message], str],
    ) -> None:
        self.versions: Counter[int] = Counter()
        self.odd_lengths: dict[str, int] = {}
        self.log: History[str] = History()
        self._received: dict[type[Message], History[tuple[float, Message]]] = {
            cls: History() for cls in classes}
        self._describe = describe
        self._began: float | None = None

    def text(self, message: Message) -> str:
        """Return the text of a message."""
        return self._describe(message) or _protocol_text(message)

    def note(self, direction: str, text: str, now: float) -> None:
        """Add a line to the log."""
        self._began = now if self._began is None else self._began
        self.log.append(f'{now - self._began:8.3f} s {direction} {text}')

    def add(self, message: Message, now: float) -> None:
        """Add a message of the device."""
        if (received := self._received.get(type(message))) is not None:
            received.append((now, message))

    def inspect(self, frame: Frame, cls: type[Message]) -> None:
        """Count a frame of the device."""
        self.versions[frame.version] += 1
        if frame.version == 1 and len(frame.payload) != base_size(cls):
            self.odd_lengths[cls.msgname] = len(frame.payload)

    def received(self, cls: type[M]) -> History[tuple[float, M]]:
        """Return the messages of a class that the device has sent, with their times, s."""
        return cast(History[tuple[float, M]], self._received.get(cls, History()))

    @property
    def identity(self) -> str:
        """Return the names that the device has sent, '' if there are none."""
        received = self.received(messages.ComponentInformationBasic)
        one = Identity.from_message(received[-1][1]) if received else Identity()
        return ', '.join(filter(None, (one.vendor, one.model, one.serial_number)))
