# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The dialect: what is added to pymavlink's, and payloads of messages."""

from __future__ import annotations

import random
import struct
from typing import Any

from illuminator_ros.mavlink import messages as mav
from illuminator_ros.mavlink.dialect import (
    base_size,
    CRC_EXTRA,
    decode,
    encode,
    flag_names,
    line_of,
    mavlink,
    raw,
    register,
    replaced,
)
from illuminator_ros.mavlink.frame_writer import FrameWriter
from illuminator_ros.mavlink.signing import Signing
from pymavlink.dialects.v20 import ardupilotmega
import pytest
from support.frames import frame_of, LIGHT, only
from support.messages import EVERY_MESSAGE, INFORMATION, STATUS
from support.reference_dialect import DEFINITIONS, generated

each_message = pytest.mark.parametrize('message', EVERY_MESSAGE, ids=lambda one: one.msgname)
ATTRIBUTES = ('msgname', 'fieldnames', 'ordered_fieldnames', 'fieldtypes', 'fielddisplays_by_name',
              'fieldenums_by_name', 'fieldunits_by_name', 'native_format', 'orders', 'lengths',
              'array_lengths', 'crc_extra')


@pytest.mark.parametrize('id_', DEFINITIONS)
def test_an_added_class_is_the_one_that_pymavlink_generates_from_the_definition(id_: int) -> None:
    cls, expected = mavlink.mavlink_map[id_], generated(DEFINITIONS)[id_]

    assert {one: getattr(cls, one) for one in ATTRIBUTES} == {
        one: getattr(expected, one) for one in ATTRIBUTES}
    assert cls.unpacker.format == expected.unpacker.format
    assert getattr(mavlink, f'MAVLink_{cls.msgname.lower()}_message') is cls
    values = {name: raw(message, name) for message in (STATUS, INFORMATION) if message.id == id_
              for name in cls.fieldnames}
    make: Any = cls
    mav_ = ardupilotmega.MAVLink(None)
    assert make(**values).pack(mav_) == expected(**values).pack(mav_)


def test_status_and_information_lie_on_the_wire_as_specified() -> None:
    assert (STATUS.id, STATUS.crc_extra, INFORMATION.id, INFORMATION.crc_extra) == (
        440, 66, 396, 50)
    assert encode(STATUS) == struct.pack(
        '<IIffffffBBBBBB', 123456, 5, 62.5, 0.25, 40.0, 71.5, 0.0625, 10.0, 1, 3, 2, 25, 1, 154)
    assert encode(INFORMATION) == struct.pack(
        '<QII32s32s24s24s32s', 1 << 40, 5000, 1_600_000_000, b'Maker', b'Torch', b'1.2.3',
        b'B', b'SN-7')


@pytest.fixture
def restored(monkeypatch: pytest.MonkeyPatch) -> None:
    """Restore the dialect after the test."""
    for id_ in (180, 440):
        monkeypatch.setitem(mavlink.mavlink_map, id_, mavlink.mavlink_map[id_])
        monkeypatch.setitem(CRC_EXTRA, id_, CRC_EXTRA[id_])
    for name in ('MAVLink_illuminator_status_message', 'MAVLINK_MSG_ID_ILLUMINATOR_STATUS'):
        monkeypatch.setattr(mavlink, name, getattr(mavlink, name))


@pytest.mark.usefixtures('restored')
def test_a_generated_message_of_another_dialect_is_read_in_place_of_the_one_with_its_id() -> None:
    load = register(generated({180: ('WINCH_LOAD', 'float load, uint8_t[2] drum enum=DRUM')})[180])

    message = decode(load, only(frame_of(load(12.5, [1, 2]))).payload)
    assert line_of(message) == 'WINCH_LOAD load=12.5 drum=(1, 2)'


@pytest.mark.usefixtures('restored')
@pytest.mark.parametrize(('cut', 'added', 'steps_aside'), [
    ('', '', True), ('', ', uint8_t new', True), (', uint8_t gimbal_device_id', '', False)])
def test_an_added_class_steps_aside_for_one_of_the_wheel_with_its_fields(
        cut: str, added: str, steps_aside: bool) -> None:
    name, fields = DEFINITIONS[440]
    of_wheel = generated({440: (name, fields.removesuffix(cut) + added)})[440]
    mavlink.mavlink_map[440] = of_wheel

    assert (register(type(STATUS)) is of_wheel) is steps_aside
    assert (mavlink.mavlink_map[440] is of_wheel) is steps_aside


@each_message
def test_cut_zeros_and_unknown_extensions_change_no_known_field(message: mav.Message) -> None:
    payload = encode(message)

    for variant in (payload.rstrip(b'\0'), payload, payload + bytes(range(1, 50))):
        read = decode(type(message), variant)
        assert encode(read) == payload
        assert read == message
    assert not encode(decode(type(message), b'')).strip(b'\0')


@pytest.mark.parametrize('id_', sorted(mavlink.mavlink_map))
def test_a_random_payload_has_the_values_that_pymavlink_reads(id_: int) -> None:
    cls = mavlink.mavlink_map[id_]
    payload = random.Random(id_).randbytes(cls.unpacker.size)
    pymavlink = ardupilotmega.MAVLink(None)
    frame = FrameWriter(Signing()).frame(LIGHT, decode(cls, payload), 0.0, 0.0)
    expected = pymavlink.decode(bytearray(frame))

    # As text: NaN is not equal to NaN, and pymavlink reads an array as a list.
    assert str(decode(cls, payload)).replace('(', '[').replace(')', ']') == (
        str(expected).replace('(', '[').replace(')', ']'))


@pytest.mark.parametrize(('message', 'part'), [
    (EVERY_MESSAGE[2], 'COMMAND_LONG target_system=1 target_component=243 '
     'command=MAV_CMD_DO_ILLUMINATOR_CONFIGURE confirmation=2 param1=1 param2=50 param3=0.25 '),
    (mav.CommandAck(405, 77), 'command=MAV_CMD_ILLUMINATOR_ON_OFF result=77 '),
    (replaced(STATUS, error_status=1), ' error_status=1 mode=ILLUMINATOR_MODE_EXTERNAL_SYNC '),
    (replaced(INFORMATION, model_name=b'a\x1b[31m\0b'), r" model_name='a\x1b[31m' ")])
def test_line_of_a_message_names_entries_of_enums_and_has_no_control_characters(
        message: mav.Message, part: str) -> None:
    assert part in line_of(message)


def test_mavlink_1_acknowledgement_has_neither_progress_nor_target() -> None:
    assert base_size(mav.CommandAck) == 3
    assert decode(mav.CommandAck, struct.pack('<HB', 405, 4)) == mav.CommandAck(405, 4)


def test_value_that_does_not_fit_its_field_is_refused() -> None:
    with pytest.raises(struct.error):
        encode(mav.CommandAck(405, 256))


def test_a_copy_with_another_value_keeps_the_other_fields() -> None:
    copy = replaced(INFORMATION, capabilities=7)

    assert encode(copy) == struct.pack('<Q', 7) + encode(INFORMATION)[8:]
    assert INFORMATION.capabilities == 1 << 40


@pytest.mark.parametrize(('id_', 'name', 'fields'), [
    (300, 'PROTOCOL_VERSION', 'uint16_t version, uint16_t min_version, uint16_t max_version, '
     'uint8_t[8] spec_version_hash, uint8_t[8] library_version_hash'),
    (410, 'EVENT', 'uint8_t destination_component, uint8_t destination_system, uint32_t id, '
     'uint32_t event_time_boot_ms, uint16_t sequence, uint8_t log_levels, uint8_t[40] arguments'),
    (411, 'CURRENT_EVENT_SEQUENCE', 'uint16_t sequence, uint8_t flags'),
    (436, 'CURRENT_MODE',
     'uint8_t standard_mode, uint32_t custom_mode, uint32_t intended_custom_mode')])
def test_frames_of_messages_that_px4_sends_and_pymavlink_lacks_can_be_checked(
        id_: int, name: str, fields: str) -> None:
    assert CRC_EXTRA[id_] == generated({id_: (name, fields)})[id_].crc_extra


def test_every_result_has_a_name_of_its_own() -> None:
    names = [mav.result_name(result) for result in range(256)]

    assert len(set(names)) == 256
    assert names[4:6] == ['MAV_RESULT_FAILED', 'MAV_RESULT_IN_PROGRESS']
    assert names[9:11] == [
        'MAV_RESULT_COMMAND_UNSUPPORTED_MAV_FRAME', 'MAV_RESULT_NOT_IN_CONTROL']
    assert names[77] == 'MAV_RESULT 77 (unknown)'
    assert mav.command_name(405) == 'MAV_CMD_ILLUMINATOR_ON_OFF'
    assert names[6] == 'MAV_RESULT_CANCELLED'


@pytest.mark.parametrize(('flags', 'names'), [
    (0, []), (5, ['thermal throttling', 'thermistor failure']),
    (0x8004, ['thermistor failure', 'unknown flags 0x8000'])])
def test_flags_have_readable_names(flags: int, names: list[str]) -> None:
    assert flag_names('ILLUMINATOR_ERROR_FLAGS', flags) == names


def test_heartbeat_is_that_of_an_active_component_and_not_of_an_autopilot() -> None:
    assert mav.heartbeat(mavlink.MAV_TYPE_ILLUMINATOR).to_dict() == {
        'mavpackettype': 'HEARTBEAT', 'type': mavlink.MAV_TYPE_ILLUMINATOR,
        'autopilot': mavlink.MAV_AUTOPILOT_INVALID, 'base_mode': 0, 'custom_mode': 0,
        'system_status': mavlink.MAV_STATE_ACTIVE, 'mavlink_version': 3}
