# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""
The messages of the camera; MAVLink 1 carries them without extension fields.

Fields and scales are as in MAVLink, with these deviations of the camera:

- PING: a request has the target 0/0; the reply has its ``seq`` and the requester's address.
- PARAM_REQUEST_READ: a ``param_index`` of -1 requests the parameter ``param_id``.
- PARAM_VALUE: the four bytes of ``param_value`` are a value of the type ``param_type``.
- GPS_RAW_INT: ``time_usec`` is UTC since the UNIX epoch, ``alt`` above mean sea level.
- GPS_STATUS: the camera only shows it on its web page.
- DIGICAM_CONTROL: the camera takes ``shot``, a :class:`Shot`, and ignores the rest.
- MOUNT_STATUS: pitch (a), roll (b) and yaw (c) of the camera in the vehicle, 0.01 degrees.
- CAMERA_STATUS: ``event_id`` is CAMERA_STATUS_TYPE_TRIGGER; ``img_idx`` as in CAMERA_FEEDBACK.
- CAMERA_FEEDBACK: an image that was requested by DIGICAM_CONTROL; ``img_idx`` counts such images
  since power on. Position in 1e-7 degrees and m above mean sea level. Roll, pitch and yaw (ZYX,
  degrees, yaw 0..360) turn north, east, down into top of the image, right of the image, line of
  sight: all are zero for a camera that looks straight down with the top of its images to the
  north. The manufacturer does not name the axes; these are the axes of image metadata. ``flags``
  is CAMERA_FEEDBACK_CLOSEDLOOP: the image was taken.
"""

from __future__ import annotations

from enum import IntEnum
import struct
from typing import NamedTuple

from ..mavlink.dialect import mavlink, raw

Ping = mavlink.MAVLink_ping_message
ParamRequestRead = mavlink.MAVLink_param_request_read_message
ParamValue = mavlink.MAVLink_param_value_message
GpsRawInt = mavlink.MAVLink_gps_raw_int_message
GpsStatus = mavlink.MAVLink_gps_status_message
DigicamControl = mavlink.MAVLink_digicam_control_message
MountStatus = mavlink.MAVLink_mount_status_message
CameraStatus = mavlink.MAVLink_camera_status_message
CameraFeedback = mavlink.MAVLink_camera_feedback_message


class Shot(IntEnum):
    """``shot`` of DIGICAM_CONTROL: an image of the survey, or of the calibration panel."""

    SURVEY = 1
    PANEL = 2


class Firmware(NamedTuple):
    """A version of the camera's software."""

    major: int
    minor: int
    patch: int

    def __str__(self) -> str:
        return '.'.join(map(str, self))

    @classmethod
    def parse(cls, text: str) -> Firmware:
        """
        Read ``1.5.5``.

        :raises ValueError: if the text is not a version.
        """
        parts = text.split('.')
        if len(parts) != 3 or not all(one.isdecimal() and int(one) < 256 for one in parts):
            raise ValueError(f'{text!r} is not a version such as 1.5.5')
        return cls(*map(int, parts))

    @classmethod
    def from_value(cls, message: ParamValue) -> Firmware | None:
        """Return the version that a message reports, None if it reports another parameter."""
        if raw(message, 'param_id').rstrip(b'\0') != VERSION_PARAMETER:
            return None
        return cls(*struct.pack('<f', message.param_value)[:3])

    def value(self) -> ParamValue:
        """Return the message that reports this version."""
        (bits,) = struct.unpack('<f', bytes((*self, 0)))
        return ParamValue(VERSION_PARAMETER, bits, mavlink.MAV_PARAM_TYPE_UINT32, 1, 0)


VERSION_PARAMETER = b'~swVersion'
# The firmware that brought captures; its use of system and component ids; and parameters.
CAPTURES, IDS, PARAMETERS = Firmware(1, 5, 5), Firmware(3, 3, 0), Firmware(7, 1, 0)
