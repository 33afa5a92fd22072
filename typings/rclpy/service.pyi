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

from collections.abc import Callable
from typing import Protocol

from rclpy.impl.implementation_singleton import rclpy_implementation

class AnyServiceType(Protocol):
    Request: type
    Response: type

class Service:
    srv_name: str
    srv_type: AnyServiceType
    handle: rclpy_implementation.Service
    callback: Callable[[object, object], object]
    @property
    def service_name(self) -> str: ...
    # The header is what an executor has taken the request with.
    def send_response(self, response: object, header: object) -> None: ...
    def destroy(self) -> None: ...
