# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

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
