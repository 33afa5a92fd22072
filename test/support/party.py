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

"""An honest participant at the far end of a link."""

from __future__ import annotations

from typing import Any

from illuminator_ros.mavlink.frame import Decoder, encode_frame
from illuminator_ros.mavlink.messages import Address, encode_payload, LAYOUTS
from illuminator_ros.mavlink.signing import Signing, SigningMode
from support.messages import decode_payload, HANDLED

# Of all who sign.
KEY = bytes(range(32))


class Party:
    """Makes frames of messages, signed and numbered, and messages of frames."""

    def __init__(self, source: Address, mode: SigningMode) -> None:
        self.source = source
        self._signing = Signing(mode, KEY if mode is not SigningMode.OFF else b'', link_id=7)
        self._sequence = 0
        self._decoder = Decoder()

    def frame(self, message: Any, now: float) -> bytes:
        """Return a message as it goes on the wire."""
        self._sequence = (self._sequence + 1) & 0xFF
        data = encode_frame(
            message.id, encode_payload(message), sequence=self._sequence, source=self.source,
            crc_extra=LAYOUTS[message.id].crc_extra, signed=self._signing.signs)
        return self._signing.sign(data, 1.7e9 + now) if self._signing.signs else data

    def messages(self, data: bytes) -> list[Any]:
        """Return the messages in a datagram."""
        return [decode_payload(frame.message_id, frame.payload)
                for frame in self._decoder.feed(data) if frame.message_id in HANDLED]
