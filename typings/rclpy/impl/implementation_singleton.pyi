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

# The extension module, of which an executor of our own uses a part.
from types import TracebackType

class Handle:
    pointer: int
    def __enter__(self) -> None: ...
    def __exit__(
        self, exc_type: type[BaseException] | None, exc_val: BaseException | None,
        exc_tb: TracebackType | None,
    ) -> None: ...

class RequestId:
    sequence_number: int

class rclpy_implementation:  # noqa: N801
    class RCLError(RuntimeError): ...

    class rmw_service_info_t:  # noqa: N801
        request_id: RequestId

    class Service(Handle):
        def service_take_request(
            self, type_: type,
        ) -> tuple[object, rclpy_implementation.rmw_service_info_t | None]: ...

    class Subscription(Handle):
        def take_message(self, type_: type, raw: bool) -> tuple[object, object] | None: ...

    class WaitSet:
        def __init__(
            self, subscriptions: int, guard_conditions: int, timers: int, clients: int,
            services: int, events: int, context: Handle) -> None: ...
        def clear_entities(self) -> None: ...
        def add_service(self, service: Handle) -> int: ...
        def add_subscription(self, subscription: Handle) -> int: ...
        def add_guard_condition(self, guard: Handle) -> int: ...
        def wait(self, nanoseconds: int) -> None: ...
        def get_ready_entities(self, kind: str) -> list[int]: ...
