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
The messages of the camera; MAVLink 1 carries them without extension fields.

Fields and scales are as in MAVLink; the docstrings name the deviations of the camera.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
import struct
from typing import NamedTuple

from ..mavlink import messages as mav

MAV_COMP_ID_CAMERA = 100


class CameraStatusType(IntEnum):
    """CAMERA_STATUS_TYPES that the camera sends as ``event_id``."""

    TRIGGER = 1


class CameraFeedbackFlags(IntEnum):
    """CAMERA_FEEDBACK_FLAGS that the camera sends: the image was taken."""

    CLOSEDLOOP = 3


class Shot(IntEnum):
    """``shot`` of DIGICAM_CONTROL: an image of the survey, or of the calibration panel."""

    SURVEY = 1
    PANEL = 2


@mav.define(4, 'PING')
@dataclass(slots=True)
class Ping(mav.Message):
    """A request has the target 0/0; the reply has its ``seq`` and the requester's address."""

    time_usec: mav.UInt64
    seq: mav.UInt32
    target_system: mav.UInt8
    target_component: mav.UInt8


@mav.define(20, 'PARAM_REQUEST_READ')
@dataclass(slots=True)
class ParamRequestRead(mav.Message):
    """A ``param_index`` of -1 requests the parameter ``param_id``."""

    target_system: mav.UInt8
    target_component: mav.UInt8
    param_id: mav.Char16
    param_index: mav.Int16


@mav.define(22, 'PARAM_VALUE')
@dataclass(slots=True)
class ParamValue(mav.Message):
    """The four bytes of ``param_value`` are a value of the type ``param_type``."""

    param_id: mav.Char16
    param_value: mav.Float
    param_type: mav.UInt8
    param_count: mav.UInt16
    param_index: mav.UInt16


@mav.define(24, 'GPS_RAW_INT')
@dataclass(slots=True)
class GpsRawInt(mav.Message):
    """``time_usec`` is UTC since the UNIX epoch, ``alt`` above mean sea level."""

    time_usec: mav.UInt64
    fix_type: mav.UInt8
    lat: mav.Int32
    lon: mav.Int32
    alt: mav.Int32
    eph: mav.UInt16
    epv: mav.UInt16
    vel: mav.UInt16
    cog: mav.UInt16
    satellites_visible: mav.UInt8


@mav.define(25, 'GPS_STATUS')
@dataclass(slots=True)
class GpsStatus(mav.Message):
    """The camera only shows it on its web page."""

    satellites_visible: mav.UInt8
    satellite_prn: mav.UInt8x20
    satellite_used: mav.UInt8x20
    satellite_elevation: mav.UInt8x20
    satellite_azimuth: mav.UInt8x20
    satellite_snr: mav.UInt8x20


@mav.define(155, 'DIGICAM_CONTROL')
@dataclass(slots=True)
class DigicamControl(mav.Message):
    """The camera takes ``shot``, a :class:`Shot`, and ignores the rest."""

    target_system: mav.UInt8
    target_component: mav.UInt8
    session: mav.UInt8
    zoom_pos: mav.UInt8
    zoom_step: mav.Int8
    focus_lock: mav.UInt8
    shot: mav.UInt8
    command_id: mav.UInt8
    extra_param: mav.UInt8
    extra_value: mav.Float


@mav.define(158, 'MOUNT_STATUS')
@dataclass(slots=True)
class MountStatus(mav.Message):
    """Pitch (a), roll (b) and yaw (c) of the camera in the vehicle, 0.01 degrees."""

    target_system: mav.UInt8
    target_component: mav.UInt8
    pointing_a: mav.Int32
    pointing_b: mav.Int32
    pointing_c: mav.Int32


@mav.define(179, 'CAMERA_STATUS')
@dataclass(slots=True)
class CameraStatus(mav.Message):
    """``event_id`` is a :class:`CameraStatusType`; ``img_idx`` as in CAMERA_FEEDBACK."""

    time_usec: mav.UInt64
    target_system: mav.UInt8
    cam_idx: mav.UInt8
    img_idx: mav.UInt16
    event_id: mav.UInt8
    p1: mav.Float
    p2: mav.Float
    p3: mav.Float
    p4: mav.Float


@mav.define(180, 'CAMERA_FEEDBACK', extensions=1)
@dataclass(slots=True)
class CameraFeedback(mav.Message):
    """
    An image that was requested by DIGICAM_CONTROL; ``img_idx`` counts such images since power on.

    Position in 1e-7 degrees and m above mean sea level. Roll, pitch and yaw (ZYX, degrees, yaw
    0..360) turn north, east, down into top of the image, right of the image, line of sight: all
    are zero for a camera that looks straight down with the top of its images to the north. The
    manufacturer does not name the axes; these are the axes of image metadata.
    ``completed_captures`` is an extension field, which MAVLink 1 does not have.
    """

    time_usec: mav.UInt64
    target_system: mav.UInt8
    cam_idx: mav.UInt8
    img_idx: mav.UInt16
    lat: mav.Int32
    lng: mav.Int32
    alt_msl: mav.Float
    alt_rel: mav.Float
    roll: mav.Float
    pitch: mav.Float
    yaw: mav.Float
    foc_len: mav.Float
    flags: mav.UInt8
    completed_captures: mav.UInt16 = 0


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
        if message.param_id.rstrip(b'\0') != VERSION_PARAMETER:
            return None
        return cls(*struct.pack('<f', message.param_value)[:3])

    def value(self) -> ParamValue:
        """Return the message that reports this version."""
        (bits,) = struct.unpack('<f', bytes((*self, 0)))
        return ParamValue(VERSION_PARAMETER, bits, MAV_PARAM_TYPE_UINT32, 1, 0)


VERSION_PARAMETER = b'~swVersion'
MAV_PARAM_TYPE_UINT32 = 5
# The firmware that brought captures; its use of system and component ids; and parameters.
CAPTURES, IDS, PARAMETERS = Firmware(1, 5, 5), Firmware(3, 3, 0), Firmware(7, 1, 0)
