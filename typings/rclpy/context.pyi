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

from collections.abc import Callable, Sequence
from typing import Any

class Context:
    # A capsule of rcl, with no type of its own.
    @property
    def handle(self) -> Any: ...
    def init(
        self, args: Sequence[str] | None = None, *, initialize_logging: bool = True,
        domain_id: int | None = None,
    ) -> None: ...
    def ok(self) -> bool: ...
    def shutdown(self) -> None: ...
    def try_shutdown(self) -> None: ...
    def on_shutdown(self, callback: Callable[[], object]) -> None: ...
    def get_domain_id(self) -> int: ...
