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

"""The messages on the wire, checked against the definitions and pymavlink's own generator."""

from __future__ import annotations

import importlib.util
import struct
from types import ModuleType
from typing import Any

from hypothesis import given, settings
from hypothesis import strategies as st
from illuminator_ros.mavlink import messages as dialect
from illuminator_ros.mavlink.messages import (
    Address,
    CommandAck,
    ComponentInformationBasic,
    decode_payload,
    encode_payload,
    HANDLED,
    IlluminatorStatus,
    INFORMATION_ID,
    LAYOUTS,
    MavCmd,
    MavResult,
    MavType,
    result_name,
    STATUS_ID,
)
from pymavlink.dialects.v20 import common
import pytest
from support.messages import EVERY_MESSAGE, INFORMATION, STATUS
from support.reference_dialect import DEFINITIONS, fields_of, Peer, reference, twin

ADDED = (IlluminatorStatus, ComponentInformationBasic)
SIZES = {'char': 1, 'uint8_t': 1, 'uint16_t': 2, 'uint32_t': 4, 'int32_t': 4, 'uint64_t': 8,
         'float': 4}


def base_fields(message_id: int) -> list[tuple[str, int, str]]:
    """Return type, array length (0 if none) and name, in the wire's order, no extensions."""
    fields = []
    for definition in DEFINITIONS[message_id][1]:
        if definition is None:
            break
        type_, name, _ = definition
        element, _, length = type_.removesuffix('_mavlink_version').rstrip(']').partition('[')
        fields.append((element, int(length or 0), name))
    # "Field reordering": by size, largest first, otherwise as defined.
    return sorted(fields, key=lambda field: -SIZES[field[0]])


def crc_extra(message_id: int) -> int:
    """Return CRC_EXTRA as the MAVLink guide says how to work it out, bit by bit."""
    text = DEFINITIONS[message_id][0].encode() + b' '
    for element, length, name in base_fields(message_id):
        text += f'{element} {name} '.encode() + (bytes([length]) if length else b'')
    crc = 0xFFFF
    for byte in text:
        crc ^= byte
        for _ in range(8):
            crc = crc >> 1 ^ (0x8408 if crc & 1 else 0)
    return crc & 0xFF ^ crc >> 8


# What goes over the wire

@pytest.mark.parametrize(('message', 'id_', 'crc', 'size'), [
    (IlluminatorStatus, 440, 66, 35),
    (ComponentInformationBasic, 396, 50, 160),
])
def test_has_the_id_checksum_seed_and_length_of_the_common_message_set(
        message: Any, id_: int, crc: int, size: int) -> None:
    assert (message.id, message.crc_extra, message.unpacker.size) == (id_, crc, size)


@pytest.mark.parametrize('message_id', DEFINITIONS)
def test_checksum_seed_follows_from_the_field_definitions(message_id: int) -> None:
    assert LAYOUTS[message_id].crc_extra == crc_extra(message_id)


@pytest.mark.parametrize('message', ADDED)
def test_wire_order_is_by_size_and_then_as_defined(message: Any) -> None:
    assert message.ordered_fieldnames == [name for _, _, name in base_fields(message.id)]


def test_status_lies_on_the_wire_as_the_specification_says() -> None:
    assert encode_payload(STATUS) == struct.pack(
        '<IIffffffBBB', 123456, 5, 62.5, 0.25, 40.0, 71.5, 0.0625, 10.0, 1, 3, 2)


def test_information_lies_on_the_wire_as_the_specification_says() -> None:
    assert encode_payload(INFORMATION) == struct.pack(
        '<QII32s32s24s24s32s', 1 << 40, 5000, 1_600_000_000, b'Maker', b'Torch', b'1.2.3',
        b'B', b'SN-7')


def test_status_of_38_bytes_reads_as_the_35_that_are_known() -> None:
    payload = encode_payload(STATUS) + bytes((50, 2, 154))
    assert fields_of([decode_payload(STATUS_ID, payload)]) == fields_of([STATUS])


@pytest.mark.parametrize('message', EVERY_MESSAGE, ids=lambda message: message.msgname)
def test_what_is_cut_off_or_follows_changes_no_known_field(message: Any) -> None:
    payload = encode_payload(message)
    for variant in (payload.rstrip(b'\0'), payload, payload + bytes(range(1, 50))):
        assert fields_of([decode_payload(message.id, variant)]) == fields_of([message])


@pytest.mark.parametrize('message_id', HANDLED)
def test_empty_payload_reads_as_zeros(message_id: int) -> None:
    message = decode_payload(message_id, b'')
    assert not encode_payload(message).strip(b'\0')


def test_acknowledgement_of_mavlink_1_has_no_target() -> None:
    ack = decode_payload(CommandAck.id, struct.pack('<HB', 405, 0))
    assert (ack.command, ack.target_system, ack.target_component) == (405, 0, 0)


# As pymavlink's own

@pytest.mark.parametrize('message', ADDED)
def test_class_has_what_pymavlinks_generator_gives_to_its_own(message: Any) -> None:
    generated = reference().mavlink_map[message.id]
    for name, value in vars(generated).items():
        if name.startswith('__') or name in ('pack', 'name', 'unpacker'):
            continue
        assert getattr(message, name) == value, name
    assert message.unpacker.format == generated.unpacker.format


@pytest.mark.parametrize('key', [None, bytes(range(32))], ids=['unsigned', 'signed'])
def test_status_packs_with_pymavlink_to_the_bytes_of_a_generated_one(key: bytes | None) -> None:
    ours, theirs = Peer(key=key, timestamp=7), Peer(key=key, timestamp=7)
    assert ours.encode(STATUS, 9) == theirs.encode(twin(STATUS), 9)


@given(st.lists(st.binary(max_size=40), min_size=5, max_size=5))
@settings(derandomize=True, deadline=None)
def test_char_fields_behave_as_generated_ones(values: list[bytes]) -> None:
    names = ('vendor_name', 'model_name', 'software_version', 'hardware_version',
             'serial_number')
    fields = {'time_boot_ms': 1, 'capabilities': 2, 'time_manufacture_s': 3,
              **dict(zip(names, values, strict=True))}
    ours = ComponentInformationBasic(**fields)
    theirs = reference().mavlink_map[INFORMATION_ID](**fields)
    assert ours.to_dict() == theirs.to_dict()
    assert str(ours) == str(theirs)
    assert Peer().encode(ours) == Peer().encode(theirs)
    assert encode_payload(ours) == encode_payload(theirs)


def test_pymavlinks_parser_reads_the_added_classes(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(common.mavlink_map, STATUS_ID, IlluminatorStatus)
    parser = common.MAVLink(None)
    (read,) = parser.parse_buffer(Peer().encode(twin(STATUS)))
    assert type(read) is IlluminatorStatus
    assert read.to_dict() == STATUS.to_dict()


@pytest.mark.parametrize('message', ADDED)
@pytest.mark.parametrize(('values', 'named'), [
    ((), {}),
    ((1, 2), {}),
    (tuple(range(12)), {}),
    ((), {'colour': 1}),
])
def test_takes_its_fields_and_no_others(message: Any, values: tuple, named: dict) -> None:
    with pytest.raises(TypeError, match=message.msgname):
        message(*values, **named)


# A pymavlink that has the messages itself, as one built from mavlink/mavlink does

@pytest.fixture
def with_a_complete_pymavlink(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    for message_id in (STATUS_ID, INFORMATION_ID):
        monkeypatch.setitem(
            common.mavlink_map, message_id, reference().mavlink_map[message_id])
    spec = importlib.util.spec_from_file_location('complete_dialect', dialect.__file__)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_classes_that_pymavlink_has_are_taken_from_it(
        with_a_complete_pymavlink: ModuleType) -> None:
    complete = with_a_complete_pymavlink
    generated = reference().mavlink_map
    assert complete.IlluminatorStatus is generated[STATUS_ID]
    assert complete.ComponentInformationBasic is generated[INFORMATION_ID]


@pytest.mark.parametrize('message', [STATUS, INFORMATION], ids=lambda message: message.msgname)
def test_generated_classes_encode_and_decode_as_the_added_ones(
        message: Any, with_a_complete_pymavlink: ModuleType) -> None:
    complete = with_a_complete_pymavlink
    payload = complete.encode_payload(twin(message))
    assert payload == encode_payload(message)
    assert fields_of([complete.decode_payload(message.id, payload)]) == fields_of([message])
    assert complete.wire_value(twin(INFORMATION), 'vendor_name') == b'Maker'


# Names and numbers

def test_every_message_of_pymavlink_can_be_checked() -> None:
    for message_id, message in common.mavlink_map.items():
        assert LAYOUTS[message_id] == (message.crc_extra, message.unpacker.size)
    assert LAYOUTS.keys() == common.mavlink_map.keys() | {STATUS_ID, INFORMATION_ID}


@pytest.mark.parametrize(('enum', 'prefix'), [
    (MavCmd, 'MAV_CMD'), (MavResult, 'MAV_RESULT'), (MavType, 'MAV_TYPE')])
def test_numbers_are_those_of_pymavlink_where_it_has_them(enum: Any, prefix: str) -> None:
    missing = {entry.name for entry in enum if not hasattr(common, f'{prefix}_{entry.name}')}
    assert missing <= {'CANCELLED', 'COMMAND_UNSUPPORTED_MAV_FRAME', 'NOT_IN_CONTROL'}
    for entry in enum:
        assert getattr(common, f'{prefix}_{entry.name}', entry) == entry


def test_commands_and_ids_are_those_of_the_illuminator_protocol() -> None:
    assert {command.name: int(command) for command in MavCmd} == {
        'ILLUMINATOR_ON_OFF': 405, 'DO_ILLUMINATOR_CONFIGURE': 406,
        'SET_MESSAGE_INTERVAL': 511, 'REQUEST_MESSAGE': 512}
    assert (MavType.ILLUMINATOR, MavType.ONBOARD_CONTROLLER) == (44, 18)
    assert dialect.MAV_COMP_ID_ILLUMINATOR == common.MAV_COMP_ID_ILLUMINATOR == 243


def test_every_result_has_a_name_of_its_own() -> None:
    names = [result_name(result) for result in range(256)]
    assert len(set(names)) == 256
    assert names[:11] == [f'MAV_RESULT_{name}' for name in (
        'ACCEPTED', 'TEMPORARILY_REJECTED', 'DENIED', 'UNSUPPORTED', 'FAILED', 'IN_PROGRESS',
        'CANCELLED', 'COMMAND_LONG_ONLY', 'COMMAND_INT_ONLY', 'COMMAND_UNSUPPORTED_MAV_FRAME',
        'NOT_IN_CONTROL')]
    assert all(str(result) in names[result] for result in range(11, 256))


def test_heartbeat_is_that_of_a_component_and_not_of_an_autopilot() -> None:
    message = dialect.heartbeat(MavType.ILLUMINATOR)
    assert message.type == common.MAV_TYPE_ILLUMINATOR
    assert message.autopilot == common.MAV_AUTOPILOT_INVALID
    assert message.system_status == common.MAV_STATE_ACTIVE
    assert message.base_mode == message.custom_mode == 0


def test_source_reads_as_system_and_component() -> None:
    assert str(Address(1, 243)) == '1/243'
