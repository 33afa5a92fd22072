# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""
The MAVLink dialect: pymavlink's ardupilotmega, with the messages that no wheel of pymavlink has.

The classes here have the form that pymavlink generates. A class of a newer wheel takes the place
of the one here as soon as it has the same fields.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cache, partial
from itertools import accumulate
import struct
from typing import Any, cast, TypeVar

from pymavlink.dialects.v20 import ardupilotmega

# The name of a dialect in pymavlink's examples.
mavlink = ardupilotmega
M = TypeVar('M', bound=mavlink.MAVLink_message)

# The seed of the checksum by message id: of all messages of the dialect, and of the messages of
# common.xml that PX4 sends and the dialect lacks. Frames that cannot be checked count as lost.
CRC_EXTRA: dict[int, int] = {
    8: 117, 80: 14, 290: 251, 291: 10, 300: 217, 334: 72, 336: 245, 361: 93, 371: 10, 372: 26,
    380: 232, 395: 0, 397: 182, 400: 110, 401: 183, 410: 160, 411: 106, 412: 33, 413: 77, 435: 134,
    436: 193, 437: 30, 440: 66,
    **{id_: cls.crc_extra for id_, cls in mavlink.mavlink_map.items()},
}

# Results of common.xml that the dialect lacks.
MAV_RESULT_COMMAND_UNSUPPORTED_MAV_FRAME = 9
for _value, _name in ((6, 'MAV_RESULT_CANCELLED'), (10, 'MAV_RESULT_NOT_IN_CONTROL'),
                      (9, 'MAV_RESULT_COMMAND_UNSUPPORTED_MAV_FRAME')):
    if not hasattr(mavlink, _name):
        setattr(mavlink, _name, _value)
        mavlink.enums['MAV_RESULT'][_value] = mavlink.EnumEntry(_name, '')


def enum_name(enum: str, value: int) -> str:
    """Return the name of a value of an enum, such as MAV_TYPE_GCS; the value where it has none."""
    entry = mavlink.enums[enum].get(value)
    return entry.name if entry else f'{enum} {value}'


def register(cls: type[M]) -> type[M]:
    """
    Add a message to the dialect, in place of another message with its id.

    :param cls: in the form that pymavlink's ``mavgen`` generates from the definition.
    :return: the class that the dialect has from now on: its own, if that has all of the fields.
    """
    known = mavlink.mavlink_map.get(cls.id)
    if known and known.msgname == cls.msgname and {*cls.fieldnames} <= {*known.fieldnames}:
        return cast('type[M]', known)
    mavlink.mavlink_map[cls.id] = cls
    CRC_EXTRA[cls.id] = cls.crc_extra
    setattr(mavlink, f'MAVLink_{cls.msgname.lower()}_message', cls)
    setattr(mavlink, f'MAVLINK_MSG_ID_{cls.msgname}', cls.id)
    return cls


@cache
def _attributes(cls: type[mavlink.MAVLink_message]) -> dict[str, str]:
    """Return the attributes of the fields as on the wire, in that order; strings have one more."""
    strings = {field for field, type_ in zip(cls.fieldnames, cls.fieldtypes, strict=True)
               if type_ == 'char'}
    return {field: f'_{field}_raw' if field in strings else field
            for field in cls.ordered_fieldnames}


def raw(message: mavlink.MAVLink_message, field: str) -> Any:
    """Return the value of a field; of a string all bytes, which pymavlink keeps apart."""
    cls: Any = type(message)  # its __hash__ confuses mypy
    return getattr(message, _attributes(cls)[field])


def encode(message: mavlink.MAVLink_message) -> bytes:
    """
    Return the payload, extension fields included, trailing zeros not yet cut.

    Unlike ``pack`` it changes nothing in the message, which may still be compared.

    :raises struct.error: if a value does not fit into its field.
    """
    cls: Any = type(message)  # its __hash__ confuses mypy
    values = [*map(partial(getattr, message), _attributes(cls).values())]
    if max(message.lengths) > 1:
        values = [one for value, length in zip(values, message.lengths, strict=True)
                  for one in (value if length > 1 else (value,))]
    return message.unpacker.pack(*values)


def decode(cls: type[M], payload: bytes) -> M:
    """
    Return the message of a checked payload.

    A short payload is filled with zeros: MAVLink 2 cuts them, and MAVLink 1 has no extension
    fields. Bytes beyond the known fields are ignored, as extensions must be.

    ``MAVLink.decode`` of the whole frame would check it again and take twice the time. It strips
    zeros from strings, and fills in the header, with which equal messages are unequal.
    """
    size = cls.unpacker.size
    values = cls.unpacker.unpack(payload[:size].ljust(size, b'\0'))
    if len(values) != len(cls.orders):
        ends = [*accumulate(cls.lengths)]
        values = tuple(values[end - 1] if length == 1 else values[end - length:end]
                       for end, length in zip(ends, cls.lengths, strict=True))
    # The constructors of the classes have the fields as parameters.
    return cast('Callable[..., M]', cls)(*map(values.__getitem__, cls.orders))


def replaced(message: M, **fields: Any) -> M:
    """Return a copy of a message with other values of some fields."""
    values = {field: raw(message, field) for field in message.fieldnames}
    return cast('Callable[..., M]', type(message))(**values | fields)


def base_size(cls: type[mavlink.MAVLink_message]) -> int:
    """
    Return the size of the payload without extension fields, as MAVLink 1 sends it.

    A registered class with extension fields has it in ``mavlink_1_size``.
    """
    # Only where MAVLink 1 is spoken: the import takes 11 MB.
    from pymavlink.dialects.v10 import ardupilotmega as mavlink_1

    size = mavlink_1.mavlink_map.get(cls.id, cls).unpacker.size
    return int(getattr(cls, 'mavlink_1_size', size))


@cache
def entry_names(enum: str) -> Mapping[int, str]:
    """Return the names of the entries of an enum, such as ``MAV_RESULT_DENIED``, by value."""
    return {value: entry.name for value, entry in sorted(mavlink.enums.get(enum, {}).items())
            if not entry.name.endswith('_ENUM_END')}


@cache
def short_names(enum: str) -> Mapping[int, str]:
    """Return the same names without the enum's name, such as ``DENIED``."""
    return {value: name.removeprefix(f'{enum}_') for value, name in entry_names(enum).items()}


def flag_names(enum: str, flags: int) -> list[str]:
    """Return readable names of the flags that are set; unknown ones as one hexadecimal number."""
    if not flags:
        return []
    known = short_names(enum)
    names = [name.lower().replace('_', ' ') for flag, name in known.items() if flag & flags]
    unknown = flags & ~sum(known)
    return [*names, f'unknown flags 0x{unknown:x}'] if unknown else names


def line_of(message: mavlink.MAVLink_message) -> str:
    """Return a message in a line, for people, with the names of the entries of enums."""
    def shown(field: str) -> str:
        value, enum = getattr(message, field), message.fieldenums_by_name.get(field)
        if enum and message.fielddisplays_by_name.get(field) != 'bitmask' and value in (
                names := entry_names(enum)):
            return names[value]
        # repr, since the text of a string may hold control characters.
        return f'{value:g}' if isinstance(value, float) else repr(value)

    return ' '.join((
        message.get_type(), *(f'{field}={shown(field)}' for field in message.fieldnames)))


def _text(string: bytes) -> str:
    return string.partition(b'\0')[0].decode('ascii', errors='replace')


@register
class MAVLink_component_information_basic_message(mavlink.MAVLink_message):
    """https://mavlink.io/en/messages/common.html#COMPONENT_INFORMATION_BASIC."""

    id = 396  # noqa: A003 - as pymavlink names it
    msgname = 'COMPONENT_INFORMATION_BASIC'
    fieldnames = ['time_boot_ms', 'capabilities', 'time_manufacture_s', 'vendor_name',
                  'model_name', 'software_version', 'hardware_version', 'serial_number']
    ordered_fieldnames = ['capabilities', 'time_boot_ms', *fieldnames[2:]]
    fieldtypes = ['uint32_t', 'uint64_t', 'uint32_t', 'char', 'char', 'char', 'char', 'char']
    fielddisplays_by_name = {'capabilities': 'bitmask'}
    fieldenums_by_name = {'capabilities': 'MAV_PROTOCOL_CAPABILITY'}
    fieldunits_by_name = {'time_boot_ms': 'ms', 'time_manufacture_s': 's'}
    native_format = bytearray(b'<QIIccccc')
    orders = [1, 0, 2, 3, 4, 5, 6, 7]
    lengths = [1] * 8
    array_lengths = [0, 0, 0, 32, 32, 24, 24, 32]
    crc_extra = 50
    unpacker = struct.Struct('<QII32s32s24s24s32s')

    def __init__(
        self, time_boot_ms: int, capabilities: int, time_manufacture_s: int, vendor_name: bytes,
        model_name: bytes, software_version: bytes, hardware_version: bytes, serial_number: bytes,
    ) -> None:
        super().__init__(self.id, self.msgname)
        self._fieldnames = self.fieldnames
        self.time_boot_ms = time_boot_ms
        self.capabilities = capabilities
        self.time_manufacture_s = time_manufacture_s
        self._vendor_name_raw, self.vendor_name = vendor_name, _text(vendor_name)
        self._model_name_raw, self.model_name = model_name, _text(model_name)
        self._software_version_raw = software_version
        self.software_version = _text(software_version)
        self._hardware_version_raw = hardware_version
        self.hardware_version = _text(hardware_version)
        self._serial_number_raw, self.serial_number = serial_number, _text(serial_number)

    def pack(self, mav: mavlink.MAVLink, force_mavlink1: bool = False) -> bytes:
        """Return the frame."""
        return self._pack(mav, self.crc_extra, encode(self), force_mavlink1)
