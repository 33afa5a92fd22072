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

class SerialException(OSError): ...

class Serial:
    def __init__(
        self, port: str | None = None, baudrate: int = 9600, *, timeout: float | None = None,
        write_timeout: float | None = None, exclusive: bool | None = None, rtscts: bool = False,
    ) -> None: ...
    baudrate: int
    rtscts: bool
    exclusive: bool | None
    in_waiting: int
    out_waiting: int
    def fileno(self) -> int: ...
    def set_low_latency_mode(self, low_latency_settings: bool) -> None: ...
    def read(self, size: int = 1) -> bytes: ...
    def write(self, data: bytes) -> int | None: ...
    def reset_input_buffer(self) -> None: ...
    def close(self) -> None: ...
