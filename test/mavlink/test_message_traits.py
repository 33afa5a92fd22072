# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The properties of messages by which frames are forwarded."""

from __future__ import annotations

from illuminator_ros.mavlink.dialect import decode, encode, mavlink, replaced
from illuminator_ros.mavlink.frame import Frame
from illuminator_ros.mavlink.message_traits import name_of, Priority, target_of, traits_of
from illuminator_ros.mavlink.messages import Address, Message
import pytest
from support.frames import LIGHT

URGENT, KEPT, NEWEST = Priority


def frame(message_id: int, payload: bytes) -> Frame:
    return Frame(2, 0, LIGHT, message_id, payload)


@pytest.mark.parametrize('cls', mavlink.mavlink_map.values(), ids=lambda cls: cls.msgname)
def test_the_target_of_a_frame_is_that_of_its_message(cls: type[Message]) -> None:
    names = [name for name in ('target_system', 'target_component') if name in cls.fieldnames]
    message = replaced(decode(cls, b''), **dict(zip(names, (7, 9), strict=False)))
    payload = encode(message)
    expected = Address(*(number if name in names else 0 for name, number in (
        ('target_system', 7), ('target_component', 9))))

    assert target_of(frame(cls.id, payload)) == expected
    # MAVLink 2 cuts trailing zeros.
    assert target_of(frame(cls.id, encode(decode(cls, b''))[:1])) == Address(0, 0)


def test_the_target_of_an_unknown_message_is_not_known() -> None:
    assert target_of(frame(8, bytes((7, 9, 7, 9)))) == Address(0, 0)
    assert name_of(8) == '8'


@pytest.mark.parametrize(('names', 'priority', 'is_replaced'), [
    (('COMMAND_LONG', 'COMMAND_INT', 'COMMAND_ACK', 'MISSION_ACK',
      'PARAM_EXT_ACK'), URGENT, False),
    (('HEARTBEAT',), URGENT, True),
    (('PARAM_VALUE', 'PARAM_SET', 'MISSION_ITEM_INT', 'MISSION_CURRENT', 'LOG_DATA', 'LOG_ENTRY',
      'FILE_TRANSFER_PROTOCOL', 'SERIAL_CONTROL', 'STATUSTEXT', 'GIMBAL_DEVICE_SET_ATTITUDE',
      'RC_CHANNELS_OVERRIDE', 'SET_ATTITUDE_TARGET'), KEPT, False),
    (('ATTITUDE', 'SERVO_OUTPUT_RAW', 'ILLUMINATOR_STATUS', 'GLOBAL_POSITION_INT',
      'BATTERY_STATUS', 'RADIO_STATUS'), NEWEST, True)])
def test_only_telemetry_and_heartbeats_are_replaced_and_telemetry_is_sent_last(
        names: tuple[str, ...], priority: Priority, is_replaced: bool) -> None:
    for name in names:
        traits = traits_of(getattr(mavlink, f'MAVLINK_MSG_ID_{name}'))
        assert (name, traits.priority, traits.replaced) == (name, priority, is_replaced)


@pytest.mark.parametrize(('message', 'instance'), [
    (mavlink.MAVLink_battery_status_message(3, 0, 0, 0, [0] * 10, 0, 0, 0, 0), b'\3'),
    (mavlink.MAVLink_named_value_float_message(0, b'speed', 1.0), b'speed\0\0\0\0\0'),
    (mavlink.MAVLink_attitude_message(0, 0, 0, 0, 0, 0, 0), b'')])
def test_several_of_one_message_in_a_sender_are_distinguished_by_their_instance(
        message: Message, instance: bytes) -> None:
    assert encode(message)[traits_of(message.get_msgId()).instance] == instance
