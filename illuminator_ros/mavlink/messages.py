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
Message classes: the fields of a MAVLink message, and its payload's bytes.

A class is defined from its fields, as the XML definition lists them; the layout and CRC_EXTRA
follow from those (MAVLink guide, "Packet Serialization"). The classes here belong to services
that every component has. A payload defines its own, and names those that it handles. Frames of
all other messages of the dialects ardupilotmega and common are checked, but not decoded.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields
from enum import IntEnum
import struct
from typing import Annotated, Any, ClassVar, get_args, get_type_hints, NamedTuple, TypeVar

from fastcrc.crc16 import mcrf4xx

from .crc_extra import COMMON, DIALECT

UInt8 = Annotated[int, 'B']
UInt16 = Annotated[int, 'H']
UInt32 = Annotated[int, 'I']
UInt64 = Annotated[int, 'Q']
Int8 = Annotated[int, 'b']
Int16 = Annotated[int, 'h']
Int32 = Annotated[int, 'i']
Float = Annotated[float, 'f']
# The bytes of a string as they are on the wire, with or without a terminator.
Char16 = Annotated[bytes, '16s']
Char24 = Annotated[bytes, '24s']
Char32 = Annotated[bytes, '32s']
UInt8x20 = Annotated[tuple[int, ...], '20B']
Float4 = Annotated[tuple[float, float, float, float], '4f']
# param1 to param7 of a command.
Params = tuple[float, float, float, float, float, float, float]
_C_NAMES = {'B': 'uint8_t', 'H': 'uint16_t', 'I': 'uint32_t', 'Q': 'uint64_t', 'b': 'int8_t',
            'h': 'int16_t', 'i': 'int32_t', 'f': 'float', 's': 'char'}


class Address(NamedTuple):
    """The address of a MAVLink component: system id and component id, each 0..255."""

    system: int
    component: int

    def includes(self, other: Address) -> bool:
        """Return whether a message to this address is for a component; an id of 0 means all."""
        return self.system in (0, other.system) and self.component in (0, other.component)

    def __str__(self) -> str:
        return f'{self.system}/{self.component}'


class Layout(NamedTuple):
    """The values that check a frame: CRC_EXTRA, and the longest payload known of the message."""

    crc_extra: int
    size: int


class Message:
    """
    A message; its fields are as on the wire, and float32 is not rounded before it is sent.

    :cvar id: message id, 0..2^24 - 1.
    :cvar name: name in the XML definition.
    :cvar crc_extra: seeds the checksum, so that both sides have the same definition.
    :cvar base_size: bytes of the payload without extension fields, as MAVLink 1 sends it.
    :cvar full_size: bytes of the payload with them.
    :ivar sender: of a received message, which of several senders with one address has sent it, as
        far as their sequence numbers distinguish them; see :class:`~.statistics.SequenceCounter`.
    """

    sender: int = 0

    id: ClassVar[int]  # noqa: A003 - the term of the specification
    name: ClassVar[str]
    crc_extra: ClassVar[int]
    base_size: ClassVar[int]
    full_size: ClassVar[int]

    def encode(self) -> bytes:
        """
        Return the payload, extension fields included, trailing zeros not yet cut.

        :raises struct.error: if a value does not fit into its field.
        """
        raise NotImplementedError

    @classmethod
    def decode(cls: type[M], payload: bytes, sender: int = 0) -> M:
        """
        Return the message of a checked payload.

        A short payload is filled with zeros (MAVLink 2 cuts them, MAVLink 1 has no extension
        fields). Bytes beyond the known fields are ignored, as extensions must be: some lights send
        a 38-byte ILLUMINATOR_STATUS.

        :param sender: see :attr:`sender`.
        """
        raise NotImplementedError

    def __str__(self) -> str:
        """Return the message in a line, for people."""
        is_command = isinstance(self, CommandLong | CommandInt | CommandAck)
        return ' '.join((self.name, *(
            f'{field.name}={_shown(field.name if is_command else "", getattr(self, field.name))}'
            for field in fields(self))))  # type: ignore[arg-type]


M = TypeVar('M', bound=Message)
# Every message that can be checked, by message id.
LAYOUTS: dict[int, Layout] = {
    id_: Layout(*values) for id_, values in (DIALECT | COMMON).items()}


def define(id_: int, name: str, *, extensions: int = 0) -> Callable[[type[M]], type[M]]:
    """
    Complete a dataclass whose fields are those of a message, in the order of its definition.

    Its ``decode`` makes a message without ``__init__``.

    :param extensions: how many of the fields, the last ones, are extension fields.
    """
    def complete(cls: type[M]) -> type[M]:
        hints = get_type_hints(cls, include_extras=True)
        names = [field.name for field in fields(cls)]  # type: ignore[arg-type]
        codes = {one: get_args(hints[one])[1] for one in names}
        base = names[:len(names) - extensions]
        # "Field reordering": by size, largest first; extension fields are not reordered.
        base.sort(key=lambda one: -struct.calcsize('<' + codes[one][-1]))
        order = [*base, *names[len(base):]]
        layout = struct.Struct('<' + ''.join(codes[one] for one in order))
        seed = name.encode() + b' '
        for field in base:
            length, code = codes[field][:-1], codes[field][-1]
            seed += f'{_C_NAMES[code]} {field} '.encode()
            seed += bytes((int(length),)) if length else b''
        crc = mcrf4xx(seed)
        cls.id, cls.name, cls.crc_extra = id_, name, crc & 0xFF ^ crc >> 8
        cls.base_size = struct.calcsize('<' + ''.join(codes[one] for one in base))
        cls.full_size = layout.size
        # The values of the layout as text, by field.
        values: dict[str, str] = {}
        at = 0
        for one in order:
            count, code = codes[one][:-1], codes[one][-1]
            size = int(count) if count and code != 's' else 0
            values[one] = f'values[{at}:{at + size}]' if size else f'values[{at}]'
            at += size or 1
        sent = ', '.join(f'{"*" * (":" in values[one])}message.{one}' for one in order)
        # Made from text, as dataclasses do: attrgetter and loops take twice the time.
        namespace: dict[str, Any] = {
            'cls': cls, 'new': cls.__new__, 'pack': layout.pack, 'size': layout.size,
            'unpack': layout.unpack}
        exec('def encode(message):\n'
             f'    return pack({sent})\n'
             'def decode(payload, sender=0):\n'
             '    if len(payload) != size:\n'
             "        payload = payload[:size].ljust(size, b'\\0')\n"
             '    values = unpack(payload)\n'
             '    message = new(cls)\n'
             '    message.sender = sender\n'
             + ''.join(f'    message.{one} = {values[one]}\n' for one in names)
             + '    return message\n', namespace)
        cls.encode = namespace['encode']  # type: ignore[method-assign]
        cls.decode = staticmethod(namespace['decode'])  # type: ignore[method-assign]
        # A class may lack extension fields, which CRC_EXTRA does not cover. With another CRC_EXTRA
        # it is a message of another dialect that has the same id.
        if (known := LAYOUTS.get(id_)) is None or known.crc_extra != cls.crc_extra:
            LAYOUTS[id_] = Layout(cls.crc_extra, layout.size)
        return cls
    return complete


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


_RESULT_NAMES = {int(result): f'MAV_RESULT_{result.name}' for result in MavResult}


class MavType(IntEnum):
    """The values of MAV_TYPE that this package uses."""

    GCS = 6
    SUBMARINE = 12
    ONBOARD_CONTROLLER = 18
    ILLUMINATOR = 44


MAV_AUTOPILOT_ARDUPILOTMEGA = 3
MAV_AUTOPILOT_INVALID = 8
MAV_STATE_UNINIT = 0
MAV_STATE_ACTIVE = 4
MAV_COMP_ID_AUTOPILOT1 = 1
MAVLINK_VERSION = 3


def result_name(result: int) -> str:
    """Return the name of a MAV_RESULT, for example ``MAV_RESULT_DENIED``; any int is accepted."""
    return _RESULT_NAMES.get(result) or f'MAV_RESULT {result} (unknown)'


def command_name(command: int) -> str:
    """Return the name of a MAV_CMD that this package knows, or of a payload's enum."""
    try:
        one = command if isinstance(command, IntEnum) else MavCmd(command)
        return f'MAV_CMD_{one.name}'
    except ValueError:
        return f'MAV_CMD {command}'


def target_of(message: Message) -> Address:
    """Return the address that a message is for; an id is 0 where the message does not name it."""
    return Address(getattr(message, 'target_system', 0), getattr(message, 'target_component', 0))


def _shown(name: str, value: object) -> str:
    """Return the value of a field for people, by the field's name."""
    if isinstance(value, bytes):
        return repr(value.partition(b'\0')[0].decode(errors='replace'))
    if isinstance(value, float):
        return f'{value:g}'
    shown = {'command': command_name, 'result': result_name}.get(name)
    return shown(value) if shown and isinstance(value, int) else str(value)


@define(0, 'HEARTBEAT')
@dataclass(slots=True)
class Heartbeat(Message):
    """https://mavlink.io/en/messages/common.html#HEARTBEAT."""

    type: UInt8  # noqa: A003 - the field's name
    autopilot: UInt8
    base_mode: UInt8
    custom_mode: UInt32
    system_status: UInt8
    mavlink_version: UInt8


@define(75, 'COMMAND_INT')
@dataclass(slots=True)
class CommandInt(Message):
    """https://mavlink.io/en/messages/common.html#COMMAND_INT."""

    target_system: UInt8
    target_component: UInt8
    frame: UInt8
    command: UInt16
    current: UInt8
    autocontinue: UInt8
    param1: Float
    param2: Float
    param3: Float
    param4: Float
    x: Int32
    y: Int32
    z: Float

    @property
    def params(self) -> Params:
        """Return param1 to param7."""
        return self.param1, self.param2, self.param3, self.param4, self.x, self.y, self.z


@define(76, 'COMMAND_LONG')
@dataclass(slots=True)
class CommandLong(Message):
    """https://mavlink.io/en/messages/common.html#COMMAND_LONG."""

    target_system: UInt8
    target_component: UInt8
    command: UInt16
    confirmation: UInt8
    param1: Float
    param2: Float
    param3: Float
    param4: Float
    param5: Float
    param6: Float
    param7: Float

    @property
    def params(self) -> Params:
        """Return param1 to param7."""
        return (self.param1, self.param2, self.param3, self.param4, self.param5, self.param6,
                self.param7)


@define(77, 'COMMAND_ACK', extensions=4)
@dataclass(slots=True)
class CommandAck(Message):
    """https://mavlink.io/en/messages/common.html#COMMAND_ACK."""

    command: UInt16
    result: UInt8
    progress: UInt8 = 0
    result_param2: Int32 = 0
    target_system: UInt8 = 0
    target_component: UInt8 = 0


@define(396, 'COMPONENT_INFORMATION_BASIC')
@dataclass(slots=True)
class ComponentInformationBasic(Message):
    """https://mavlink.io/en/messages/common.html#COMPONENT_INFORMATION_BASIC."""

    time_boot_ms: UInt32
    capabilities: UInt64
    time_manufacture_s: UInt32
    vendor_name: Char32
    model_name: Char32
    software_version: Char24
    hardware_version: Char24
    serial_number: Char32


INFORMATION_ID = ComponentInformationBasic.id


def time_boot_ms(seconds: float) -> int:
    """Return a field value for a time since the start, s: ms, wrapping after 49.7 days."""
    return int(seconds * 1000) & 0xFFFFFFFF


def heartbeat(mav_type: int) -> Heartbeat:
    """Return the HEARTBEAT of a component that is not an autopilot (heartbeat protocol)."""
    return Heartbeat(
        mav_type, MAV_AUTOPILOT_INVALID, 0, 0, MAV_STATE_ACTIVE, MAVLINK_VERSION)
