# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The properties of messages by which frames are forwarded, from pymavlink's classes."""

from __future__ import annotations

from enum import IntEnum
from functools import cache
from typing import NamedTuple

from .dialect import decode, mavlink
from .frame import Frame
from .messages import Address

# The guide on message signing forbids to pass on the key, which this message has in the clear.
NEVER_FORWARDED = frozenset({mavlink.MAVLINK_MSG_ID_SETUP_SIGNING})
_NO_FIELD = -1
_URGENT_NAMES = ('COMMAND_',)
# Messages that are parts of a conversation or of a text; also those that end with _ACK, and all
# with a target.
_KEPT_NAMES = ('PARAM_', 'MISSION_', 'LOG_', 'FILE_TRANSFER_PROTOCOL', 'SERIAL_CONTROL',
               'STATUSTEXT')


class Priority(IntEnum):
    """
    The order in which a slow line sends frames; the last is dropped first.

    ``URGENT``: commands, acknowledgements and heartbeats. ``KEPT``: other messages of which each
    matters. ``NEWEST``: messages of which only the newest of a sender matters.
    """

    URGENT = 0
    KEPT = 1
    NEWEST = 2


class Traits(NamedTuple):
    """
    The properties of one message.

    :param system_at: the position of the target's system id in the payload, and
        ``component_at``; negative where the message has none.
    :param replaced: whether a newer message of the same sender makes an older one useless.
    :param instance: the position of the field that distinguishes several of these in one sender.
    """

    system_at: int = _NO_FIELD
    component_at: int = _NO_FIELD
    priority: Priority = Priority.KEPT
    replaced: bool = False
    instance: slice = slice(0)


@cache
def traits_of(message_id: int) -> Traits:
    """Return the traits of a message; of an unknown one no target is known."""
    cls = mavlink.mavlink_map.get(message_id)
    if cls is None:
        return Traits()
    # Each byte of this payload is its own position.
    positions = decode(cls, bytes(range(cls.unpacker.size)))
    system_at, component_at = (int(getattr(positions, name, _NO_FIELD))
                               for name in ('target_system', 'target_component'))
    name = cls.msgname
    is_heartbeat = message_id == mavlink.MAVLINK_MSG_ID_HEARTBEAT
    if name.startswith(_URGENT_NAMES) or name.endswith('_ACK') or is_heartbeat:
        priority = Priority.URGENT
    elif name.startswith(_KEPT_NAMES) or system_at != _NO_FIELD:
        priority = Priority.KEPT
    else:
        priority = Priority.NEWEST
    return Traits(system_at, component_at, priority, priority is Priority.NEWEST or is_heartbeat,
                  _instance(cls))


def _instance(cls: type[mavlink.MAVLink_message]) -> slice:
    field = getattr(cls, 'instance_field', None)
    if field is None:
        return slice(0)
    start = cls.instance_offset
    length = cls.array_lengths[cls.ordered_fieldnames.index(field)]
    return slice(start, start + max(length, 1))


def target_of(frame: Frame) -> Address:
    """Return the address that a frame is for; an id is 0 where the frame does not name it."""
    traits, payload = traits_of(frame.message_id), frame.payload
    # MAVLink 2 cuts trailing zeros.
    size = len(payload)
    system = payload[traits.system_at] if 0 <= traits.system_at < size else 0
    component = payload[traits.component_at] if 0 <= traits.component_at < size else 0
    return Address(system, component)


def name_of(message_id: int) -> str:
    """Return the name of a message, or its id as a text."""
    cls = mavlink.mavlink_map.get(message_id)
    return cls.msgname if cls else str(message_id)
