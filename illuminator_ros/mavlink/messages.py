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

"""
The MAVLink messages that this package reads and writes.

The classes are pymavlink's, from its ``common`` dialect. The published wheels are built from
ArduPilot's fork of the definitions, which has neither ILLUMINATOR_STATUS (440) nor
COMPONENT_INFORMATION_BASIC (396); both are added here in pymavlink's own form, and only where
the installed pymavlink lacks them.
"""

from __future__ import annotations

from enum import IntEnum
import struct
from typing import Any, NamedTuple

from pymavlink.dialects.v20 import common as _common

Message = _common.MAVLink_message

# https://mavlink.io/en/messages/common.html#ILLUMINATOR_STATUS
STATUS_ID = 440
# https://mavlink.io/en/messages/common.html#COMPONENT_INFORMATION_BASIC
INFORMATION_ID = 396


class Address(NamedTuple):
    """The address of a MAVLink component: system id and component id, each 0..255."""

    system: int
    component: int

    def __str__(self) -> str:
        return f'{self.system}/{self.component}'


class MavCmd(IntEnum):
    """The commands of MAV_CMD that this package sends or serves."""

    ILLUMINATOR_ON_OFF = 405
    DO_ILLUMINATOR_CONFIGURE = 406
    SET_MESSAGE_INTERVAL = 511
    REQUEST_MESSAGE = 512


class MavResult(IntEnum):
    """MAV_RESULT, complete; pymavlink lacks NOT_IN_CONTROL."""

    ACCEPTED = 0
    TEMPORARILY_REJECTED = 1
    DENIED = 2
    UNSUPPORTED = 3
    FAILED = 4
    IN_PROGRESS = 5
    CANCELLED = 6
    COMMAND_LONG_ONLY = 7
    COMMAND_INT_ONLY = 8
    COMMAND_UNSUPPORTED_MAV_FRAME = 9
    NOT_IN_CONTROL = 10


class MavType(IntEnum):
    """The values of MAV_TYPE that matter here."""

    GCS = 6
    SUBMARINE = 12
    ONBOARD_CONTROLLER = 18
    ILLUMINATOR = 44


MAV_AUTOPILOT_ARDUPILOTMEGA = 3
MAV_AUTOPILOT_INVALID = 8
MAV_STATE_UNINIT = 0
MAV_STATE_ACTIVE = 4
MAV_COMP_ID_AUTOPILOT1 = 1
MAV_COMP_ID_ILLUMINATOR = 243
MAVLINK_VERSION = 3


def result_name(result: int) -> str:
    """Return the name of a MAV_RESULT, for example ``MAV_RESULT_DENIED``; any int is accepted."""
    try:
        return f'MAV_RESULT_{MavResult(result).name}'
    except ValueError:
        return f'MAV_RESULT {result} (unknown)'


class _Field(NamedTuple):
    name: str
    type: str  # noqa: A003
    code: str
    units: str = ''
    enum: str = ''
    display: str = ''


def _define(name: str, id_: int, crc_extra: int, fields: list[_Field], order: list[str]) -> Any:
    """
    Make a message class in the form that pymavlink's generator gives to its own.

    :param fields: the fields in the order of the XML definition.
    :param order: their names in the order on the wire: by size, largest first (MAVLink
        serialization, "Field reordering").
    """
    by_name = {field.name: field for field in fields}
    names = [field.name for field in fields]
    strings = [field.name for field in fields if field.type == 'char']
    layout = struct.Struct('<' + ''.join(by_name[n].code for n in order))

    def __init__(self: Any, *values: Any, **named: Any) -> None:
        Message.__init__(self, id_, name)
        self._fieldnames = names
        self._instance_field = None
        self._instance_offset = -1
        given = dict(zip(names, values, strict=False), **named)
        if len(values) > len(names) or given.keys() != by_name.keys():
            raise TypeError(f'{name} takes exactly the fields {", ".join(names)}')
        for field in strings:
            value = given[field]
            setattr(self, f'_{field}_raw', value)
            given[field] = value.partition(b'\0')[0].decode('ascii', errors='replace')
        self.__dict__.update(given)

    def pack(self: Any, mav: Any, force_mavlink1: bool = False) -> Any:
        return self._pack(mav, crc_extra, encode_payload(self), force_mavlink1=force_mavlink1)

    return type(f'MAVLink_{name.lower()}_message', (Message,), {
        '__doc__': f'{name} of the MAVLink common message set.',
        '__init__': __init__,
        'pack': pack,
        'id': id_,
        'msgname': name,
        'fieldnames': names,
        'ordered_fieldnames': order,
        'fieldtypes': [field.type for field in fields],
        'fielddisplays_by_name': {field.name: field.display for field in fields if field.display},
        'fieldenums_by_name': {field.name: field.enum for field in fields if field.enum},
        'fieldunits_by_name': {field.name: field.units for field in fields if field.units},
        # The types alone, without the lengths of arrays.
        'native_format': bytearray(
            b'<' + b''.join(b'c' if by_name[n].type == 'char' else by_name[n].code.encode()
                            for n in order)),
        'orders': [order.index(n) for n in names],
        'lengths': [1] * len(names),
        'array_lengths': [int(by_name[n].code[:-1] or 0) for n in order],
        'crc_extra': crc_extra,
        'unpacker': layout,
        'instance_field': None,
        'instance_offset': -1,
    })


def _installed(id_: int, name: str, crc_extra: int, fields: list[_Field], order: list[str]) -> Any:
    return _common.mavlink_map.get(id_) or _define(name, id_, crc_extra, fields, order)


IlluminatorStatus = _installed(STATUS_ID, 'ILLUMINATOR_STATUS', 66, [
    _Field('uptime_ms', 'uint32_t', 'I', 'ms'),
    _Field('enable', 'uint8_t', 'B'),
    _Field('mode_bitmask', 'uint8_t', 'B', enum='ILLUMINATOR_MODE'),
    _Field('error_status', 'uint32_t', 'I', enum='ILLUMINATOR_ERROR_FLAGS', display='bitmask'),
    _Field('mode', 'uint8_t', 'B', enum='ILLUMINATOR_MODE'),
    _Field('brightness', 'float', 'f', '%'),
    _Field('strobe_period', 'float', 'f', 's'),
    _Field('strobe_duty_cycle', 'float', 'f', '%'),
    _Field('temp_c', 'float', 'f'),
    _Field('min_strobe_period', 'float', 'f', 's'),
    _Field('max_strobe_period', 'float', 'f', 's'),
], ['uptime_ms', 'error_status', 'brightness', 'strobe_period', 'strobe_duty_cycle', 'temp_c',
    'min_strobe_period', 'max_strobe_period', 'enable', 'mode_bitmask', 'mode'])

ComponentInformationBasic = _installed(INFORMATION_ID, 'COMPONENT_INFORMATION_BASIC', 50, [
    _Field('time_boot_ms', 'uint32_t', 'I', 'ms'),
    _Field('capabilities', 'uint64_t', 'Q', enum='MAV_PROTOCOL_CAPABILITY', display='bitmask'),
    _Field('time_manufacture_s', 'uint32_t', 'I', 's'),
    _Field('vendor_name', 'char', '32s'),
    _Field('model_name', 'char', '32s'),
    _Field('software_version', 'char', '24s'),
    _Field('hardware_version', 'char', '24s'),
    _Field('serial_number', 'char', '32s'),
], ['capabilities', 'time_boot_ms', 'time_manufacture_s', 'vendor_name', 'model_name',
    'software_version', 'hardware_version', 'serial_number'])

Heartbeat = _common.MAVLink_heartbeat_message
CommandLong = _common.MAVLink_command_long_message
CommandInt = _common.MAVLink_command_int_message
CommandAck = _common.MAVLink_command_ack_message

# What is decoded. Every other message is foreign: its header is looked at, its payload is not.
HANDLED: dict[int, Any] = {
    cls.id: cls for cls in (
        Heartbeat, CommandInt, CommandLong, CommandAck, IlluminatorStatus,
        ComponentInformationBasic)
}


class Layout(NamedTuple):
    """What checks a frame: the CRC_EXTRA of its message, and the longest payload known of it."""

    crc_extra: int
    size: int


# Every message that can be checked, by message id.
LAYOUTS: dict[int, Layout] = {
    id_: Layout(cls.crc_extra, cls.unpacker.size)
    for id_, cls in {**_common.mavlink_map, **HANDLED}.items()
}

# As they stand in a frame, three bytes: the ids of what is decoded, and the CRC_EXTRA of what
# can be checked and is not.
HANDLED_IDS = frozenset(id_.to_bytes(3, 'little') for id_ in HANDLED)
FOREIGN: dict[bytes, bytes] = {
    id_.to_bytes(3, 'little'): bytes((layout.crc_extra,))
    for id_, layout in LAYOUTS.items() if id_ not in HANDLED
}


def encode_payload(message: Any) -> bytes:
    """Return the payload of a message as it goes on the wire, trailing zeros not yet cut."""
    cls = type(message)
    if 'char' in cls.fieldtypes:
        values = [wire_value(message, name) for name in cls.ordered_fieldnames]
    else:
        values = [getattr(message, name) for name in cls.ordered_fieldnames]
    return bytes(cls.unpacker.pack(*values))


def wire_value(message: Any, field: str) -> Any:
    """
    Return a field as it is on the wire; a char field is bytes, terminated or not.

    pymavlink shows char fields as ASCII text and keeps the bytes beside it.
    """
    return getattr(message, f'_{field}_raw', getattr(message, field))


def decode_payload(message_id: int, payload: bytes) -> Any:
    """
    Return the message object for a checked payload.

    A short payload is filled with zeros (MAVLink 2 cuts them, MAVLink 1 has no extension
    fields), and what goes beyond the known fields is ignored, as extensions must be: there is a
    38-byte ILLUMINATOR_STATUS in the field.

    :raises KeyError: if the message is not one of :data:`HANDLED`.
    """
    cls = HANDLED[message_id]
    size = cls.unpacker.size
    values = cls.unpacker.unpack(payload[:size].ljust(size, b'\0'))
    return cls(*(values[i] for i in cls.orders))


def heartbeat(mav_type: int, *, state: int = MAV_STATE_ACTIVE) -> Any:
    """Return the HEARTBEAT of a component that is not an autopilot (heartbeat protocol)."""
    return Heartbeat(mav_type, MAV_AUTOPILOT_INVALID, 0, 0, state, MAVLINK_VERSION)
