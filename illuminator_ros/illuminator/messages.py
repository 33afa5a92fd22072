# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The message of illuminators, which no wheel of pymavlink has, in the form of pymavlink's."""

from __future__ import annotations

import struct

from ..mavlink.dialect import encode, mavlink, register


@register
class MAVLink_illuminator_status_message(mavlink.MAVLink_message):
    """
    https://mavlink.io/en/messages/common.html#ILLUMINATOR_STATUS.

    The last three fields are extensions of a vendor, 0 where a light does not have them.

    :ivar zoom_level: %.
    :ivar color_mode: 0 white, 1 red, 2 blue, 255 not applicable.
    :ivar gimbal_device_id: of the gimbal that the light is on, 0 for none.
    """

    id = 440  # noqa: A003 - as pymavlink names it
    msgname = 'ILLUMINATOR_STATUS'
    fieldnames = ['uptime_ms', 'enable', 'mode_bitmask', 'error_status', 'mode', 'brightness',
                  'strobe_period', 'strobe_duty_cycle', 'temp_c', 'min_strobe_period',
                  'max_strobe_period', 'zoom_level', 'color_mode', 'gimbal_device_id']
    ordered_fieldnames = ['uptime_ms', 'error_status', *fieldnames[5:11], 'enable',
                          'mode_bitmask', 'mode', *fieldnames[11:]]
    fieldtypes = ['uint32_t', 'uint8_t', 'uint8_t', 'uint32_t', 'uint8_t', *['float'] * 6,
                  *['uint8_t'] * 3]
    fielddisplays_by_name = {'error_status': 'bitmask'}
    fieldenums_by_name = {'mode_bitmask': 'ILLUMINATOR_MODE', 'mode': 'ILLUMINATOR_MODE',
                          'error_status': 'ILLUMINATOR_ERROR_FLAGS'}
    fieldunits_by_name = {'uptime_ms': 'ms', 'brightness': '%', 'strobe_period': 's',
                          'strobe_duty_cycle': '%', 'min_strobe_period': 's',
                          'max_strobe_period': 's'}
    native_format = bytearray(b'<IIffffffBBBBBB')
    orders = [0, 8, 9, 1, 10, 2, 3, 4, 5, 6, 7, 11, 12, 13]
    lengths = [1] * 14
    array_lengths = [0] * 14
    crc_extra = 66
    unpacker = struct.Struct('<IIffffffBBBBBB')

    def __init__(
        self, uptime_ms: int, enable: int, mode_bitmask: int, error_status: int, mode: int,
        brightness: float, strobe_period: float, strobe_duty_cycle: float, temp_c: float,
        min_strobe_period: float, max_strobe_period: float, zoom_level: int = 0,
        color_mode: int = 0, gimbal_device_id: int = 0,
    ) -> None:
        super().__init__(self.id, self.msgname)
        self._fieldnames = self.fieldnames
        self.uptime_ms = uptime_ms
        self.enable = enable
        self.mode_bitmask = mode_bitmask
        self.error_status = error_status
        self.mode = mode
        self.brightness = brightness
        self.strobe_period = strobe_period
        self.strobe_duty_cycle = strobe_duty_cycle
        self.temp_c = temp_c
        self.min_strobe_period = min_strobe_period
        self.max_strobe_period = max_strobe_period
        self.zoom_level = zoom_level
        self.color_mode = color_mode
        self.gimbal_device_id = gimbal_device_id

    def pack(self, mav: mavlink.MAVLink, force_mavlink1: bool = False) -> bytes:
        """Return the frame."""
        return self._pack(mav, self.crc_extra, encode(self), force_mavlink1)


IlluminatorStatus = MAVLink_illuminator_status_message
STATUS_ID = IlluminatorStatus.id
