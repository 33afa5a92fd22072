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

"""Message classes: definitions, checked against the MAVLink guide and pymavlink's generator."""

from __future__ import annotations

from dataclasses import asdict, dataclass
import struct

from illuminator_ros.illuminator.messages import STATUS_ID
from illuminator_ros.mavlink import messages as mav
from illuminator_ros.mavlink.crc_extra import DIALECT
from pymavlink.dialects.v20 import ardupilotmega, common
import pytest
from support.frames import frame_of, only
from support.messages import EVERY_MESSAGE, INFORMATION, STATUS
from support.reference_dialect import generated

each_message = pytest.mark.parametrize('message', EVERY_MESSAGE, ids=lambda one: one.name)


def test_status_and_information_lie_on_the_wire_as_specified() -> None:
    assert (STATUS.id, STATUS.crc_extra, INFORMATION.id, INFORMATION.crc_extra) == (
        440, 66, 396, 50)
    assert STATUS.encode() == struct.pack(
        '<IIffffffBBBBBB', 123456, 5, 62.5, 0.25, 40.0, 71.5, 0.0625, 10.0, 1, 3, 2, 25, 1, 154)
    assert INFORMATION.encode() == struct.pack(
        '<QII32s32s24s24s32s', 1 << 40, 5000, 1_600_000_000, b'Maker', b'Torch', b'1.2.3',
        b'B', b'SN-7')


@each_message
def test_cut_zeros_and_unknown_extensions_change_no_known_field(message: mav.Message) -> None:
    payload = message.encode()

    for variant in (payload.rstrip(b'\0'), payload, payload + bytes(range(1, 50))):
        read = type(message).decode(variant)
        assert read.encode() == payload
    assert not type(message).decode(b'').encode().strip(b'\0')


def test_mavlink_1_acknowledgement_has_neither_progress_nor_target() -> None:
    assert mav.CommandAck.base_size == 3
    assert mav.CommandAck.decode(struct.pack('<HB', 405, 4)) == mav.CommandAck(405, 4)


def test_value_that_does_not_fit_its_field_is_refused() -> None:
    with pytest.raises(struct.error):
        mav.CommandAck(405, 256).encode()


def test_frames_of_all_messages_of_pymavlink_can_be_checked() -> None:
    # A newer pymavlink may have more messages, but these must have the same layout.
    known = ardupilotmega.mavlink_map
    assert {id_: (known[id_].crc_extra, known[id_].unpacker.size) for id_ in DIALECT} == DIALECT
    assert {*common.mavlink_map, STATUS_ID} <= {*mav.LAYOUTS}


def test_a_message_of_another_dialect_is_read_in_place_of_the_one_with_its_id(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setitem(mav.LAYOUTS, 180, mav.LAYOUTS[180])

    @mav.define(180, 'WINCH_LOAD')
    @dataclass(slots=True)
    class WinchLoad(mav.Message):
        load: mav.Float

    frame = only(frame_of(WinchLoad(12.5)))
    assert WinchLoad.decode(frame.payload) == WinchLoad(12.5)


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
    known = generated({id_: (name, fields)})[id_]
    assert mav.LAYOUTS[id_] == (known.crc_extra, known.unpacker.size)


def test_every_result_has_a_name_of_its_own() -> None:
    names = [mav.result_name(result) for result in range(256)]

    assert len(set(names)) == 256
    assert names[4:6] == ['MAV_RESULT_FAILED', 'MAV_RESULT_IN_PROGRESS']
    assert names[77] == 'MAV_RESULT 77 (unknown)'


def test_heartbeat_is_that_of_an_active_component_and_not_of_an_autopilot() -> None:
    assert asdict(mav.heartbeat(mav.MavType.ILLUMINATOR)) == {
        'type': common.MAV_TYPE_ILLUMINATOR, 'autopilot': common.MAV_AUTOPILOT_INVALID,
        'base_mode': 0, 'custom_mode': 0, 'system_status': common.MAV_STATE_ACTIVE,
        'mavlink_version': 3}


def test_address_reads_as_system_and_component() -> None:
    assert str(mav.Address(1, 243)) == '1/243'
