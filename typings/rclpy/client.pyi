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

from typing import Generic, TypeVar

from rclpy.task import Future

Request = TypeVar('Request')
Response = TypeVar('Response')

class Client(Generic[Request, Response]):
    srv_name: str
    @property
    def service_name(self) -> str: ...
    def call(self, request: Request, timeout_sec: float | None = None) -> Response | None: ...
    def call_async(self, request: Request) -> Future[Response]: ...
    def remove_pending_request(self, future: Future[Response]) -> None: ...
    def service_is_ready(self) -> bool: ...
    def wait_for_service(self, timeout_sec: float | None = None) -> bool: ...
    def destroy(self) -> None: ...
