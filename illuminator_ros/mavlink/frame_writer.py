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

"""The way out of a link: sequence numbers, framing and signing; no I/O, and time is passed in."""

from __future__ import annotations

import random
from typing import Any

from .frame import encode_frame, Frame
from .loopback_filter import LoopbackFilter
from .messages import Address, encode_payload
from .signing import Signing


class FrameWriter:
    """
    Makes frames of messages, and recognises them when they come back.

    :ivar sequences: the next sequence number of each address that was sent from.
    """

    def __init__(self, signing: Signing) -> None:
        self.sequences: dict[Address, int] = {}
        self._signing = signing
        self._echoes = LoopbackFilter()

    def frame(self, source: Address, message: Any, now: float, unix_time: float) -> bytes:
        """Return a message as it goes on the wire."""
        # Begun anywhere: two that were started together with one address are then told apart.
        sequence = self.sequences.get(source, random.randrange(256))
        self.sequences[source] = (sequence + 1) & 0xFF
        payload = encode_payload(message)
        self._echoes.sent(source, sequence, message.id, payload, now)
        frame = encode_frame(
            message.id, payload, sequence=sequence, source=source,
            crc_extra=message.crc_extra, signed=self._signing.signs)
        return self._signing.sign(frame, unix_time) if self._signing.signs else frame

    def is_echo(self, frame: Frame, now: float) -> bool:
        """Return whether a frame is one of ours that has come back."""
        return frame.source in self.sequences and self._echoes.has(frame, now)
