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

"""The identity of a component: COMPONENT_INFORMATION_BASIC."""

from __future__ import annotations

from dataclasses import dataclass

from ..mavlink.dialect import raw
from ..mavlink.messages import ComponentInformationBasic


@dataclass(frozen=True, slots=True)
class Identity:
    """A COMPONENT_INFORMATION_BASIC; a field that the component leaves empty is ''."""

    vendor: str = ''
    model: str = ''
    software_version: str = ''
    hardware_version: str = ''
    serial_number: str = ''

    @classmethod
    def from_message(cls, message: ComponentInformationBasic) -> Identity:
        """Read a message; a full field has no terminator, and some fields are not printable."""
        return cls(*(text(raw(message, field)) for field in (
            'vendor_name', 'model_name', 'software_version', 'hardware_version',
            'serial_number')))


def text(field: bytes) -> str:
    """Return the printable text of a char field, up to its terminator if it has one."""
    shown = field.partition(b'\0')[0].decode('utf-8', errors='replace')
    return ''.join(c if c.isprintable() else '?' for c in shown).strip()
