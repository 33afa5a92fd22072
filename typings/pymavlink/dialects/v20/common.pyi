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

from struct import Struct
from typing import Any, ClassVar

mavlink_map: dict[int, type[MAVLink_message]]
MAV_AUTOPILOT_INVALID: int
MAV_COMP_ID_ILLUMINATOR: int
MAV_STATE_ACTIVE: int
MAV_TYPE_ILLUMINATOR: int

class MAVLinkSigning:
    secret_key: bytes | None
    timestamp: int
    link_id: int
    sign_outgoing: bool

class MAVLink:
    def __init__(self, file: object, srcSystem: int = 0, srcComponent: int = 0) -> None: ...
    seq: int
    robust_parsing: bool
    signing: MAVLinkSigning
    # A frame that is refused is a message of the type BAD_DATA.
    def parse_buffer(self, s: bytes) -> list[MAVLink_message] | None: ...

class MAVLink_message:
    id: ClassVar[int]  # noqa: A003
    msgname: ClassVar[str]
    fieldnames: ClassVar[list[str]]
    ordered_fieldnames: ClassVar[list[str]]
    fieldtypes: ClassVar[list[str]]
    native_format: ClassVar[bytearray]
    orders: ClassVar[list[int]]
    lengths: ClassVar[list[int]]
    array_lengths: ClassVar[list[int]]
    crc_extra: ClassVar[int]
    unpacker: ClassVar[Struct]
    # A subclass takes its fields instead; Any because each class has other ones.
    def __init__(self, *values: Any, **fields: Any) -> None: ...
    def get_type(self) -> str: ...
    def get_msgId(self) -> int: ...
    def get_seq(self) -> int: ...
    def get_srcSystem(self) -> int: ...
    def get_srcComponent(self) -> int: ...
    def get_msgbuf(self) -> bytearray: ...
    def to_dict(self) -> dict[str, Any]: ...
    def pack(self, mav: MAVLink, force_mavlink1: bool = False) -> bytes: ...

class MAVLink_heartbeat_message(MAVLink_message):
    def __init__(
        self, type: int, autopilot: int, base_mode: int, custom_mode: int, system_status: int,
        mavlink_version: int,
    ) -> None: ...
    type: int  # noqa: A003
    autopilot: int
    base_mode: int
    custom_mode: int
    system_status: int
    mavlink_version: int

class MAVLink_command_long_message(MAVLink_message):
    def __init__(
        self, target_system: int, target_component: int, command: int, confirmation: int,
        param1: float, param2: float, param3: float, param4: float, param5: float, param6: float,
        param7: float,
    ) -> None: ...
    target_system: int
    target_component: int
    command: int
    confirmation: int
    param1: float
    param2: float
    param3: float
    param4: float
    param5: float
    param6: float
    param7: float

class MAVLink_command_int_message(MAVLink_message):
    def __init__(
        self, target_system: int, target_component: int, frame: int, command: int, current: int,
        autocontinue: int, param1: float, param2: float, param3: float, param4: float, x: int,
        y: int, z: float,
    ) -> None: ...
    target_system: int
    target_component: int
    frame: int
    command: int
    current: int
    autocontinue: int
    param1: float
    param2: float
    param3: float
    param4: float
    x: int
    y: int
    z: float

class MAVLink_command_ack_message(MAVLink_message):
    def __init__(
        self, command: int, result: int, progress: int = 0, result_param2: int = 0,
        target_system: int = 0, target_component: int = 0,
    ) -> None: ...
    command: int
    result: int
    progress: int
    result_param2: int
    target_system: int
    target_component: int

class MAVLink_winch_status_message(MAVLink_message):
    def __init__(
        self, time_usec: int, line_length: float, speed: float, tension: float, voltage: float,
        current: float, temperature: int, status: int,
    ) -> None: ...
    time_usec: int
    line_length: float
    speed: float
    tension: float
    voltage: float
    current: float
    temperature: int
    status: int

# These two are missing from the wheels of pymavlink; illuminator_ros.mavlink.messages adds them.

class MAVLink_illuminator_status_message(MAVLink_message):
    def __init__(
        self, uptime_ms: int, enable: int, mode_bitmask: int, error_status: int, mode: int,
        brightness: float, strobe_period: float, strobe_duty_cycle: float, temp_c: float,
        min_strobe_period: float, max_strobe_period: float,
    ) -> None: ...
    uptime_ms: int
    enable: int
    mode_bitmask: int
    error_status: int
    mode: int
    brightness: float
    strobe_period: float
    strobe_duty_cycle: float
    temp_c: float
    min_strobe_period: float
    max_strobe_period: float

class MAVLink_component_information_basic_message(MAVLink_message):
    def __init__(
        self, time_boot_ms: int, capabilities: int, time_manufacture_s: int, vendor_name: bytes,
        model_name: bytes, software_version: bytes, hardware_version: bytes, serial_number: bytes,
    ) -> None: ...
    time_boot_ms: int
    capabilities: int
    time_manufacture_s: int
    vendor_name: str
    model_name: str
    software_version: str
    hardware_version: str
    serial_number: str
