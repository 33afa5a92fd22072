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
A vendor's ILLUMINATOR_STATUS of 38 bytes.

Three bytes stand behind the 35 of the common message set, and the checksum's seed is the same:
whoever knows only the 35 reads them and ignores the rest, as with any extension.
"""

from __future__ import annotations

import struct
from typing import Any

from .behaviour import Extension
from ..mavlink.messages import IlluminatorStatus


class ExtendedIlluminatorStatus(IlluminatorStatus):  # type: ignore[misc, valid-type]
    """
    The message, to be sent; what is received is read as the 35 bytes.

    :ivar zoom_level: %.
    :ivar color_mode: 0 white, 1 red, 2 blue, 255 not applicable.
    :ivar gimbal_device_id: component id or gimbal number, 0 for none.
    """

    ordered_fieldnames = [*IlluminatorStatus.ordered_fieldnames, *Extension._fields]
    unpacker = struct.Struct(IlluminatorStatus.unpacker.format + '3B')

    def __init__(self, *values: Any, extension: Extension) -> None:
        super().__init__(*values)
        for name, value in extension._asdict().items():
            setattr(self, name, value)
