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
Keeps unused modules out of the process of the bridge.

rclpy and other modules import them; they take 19 MB and delay the start.
"""

from __future__ import annotations

from collections.abc import Iterator
import contextlib
import importlib
import sys
import threading
from types import ModuleType

# The type support of each service imports numpy (12 MB), for a field of the events that service
# introspection publishes. Only signed frames need the others, which load OpenSSL (4 MB).
POSTPONED = ('numpy', 'hashlib', 'hmac')
# The type support of messages tries to import their generator, which imports a parser (4 MB).
LEFT_OUT = ('rosidl_generator_py.generate_py_impl',)

_lock = threading.Lock()


class _Placeholder(ModuleType):
    """Replaces a module, and imports it when one of its attributes is used."""

    def __getattr__(self, name: str) -> object:
        _remove(self.__name__, self)
        value: object = getattr(importlib.import_module(self.__name__), name)
        setattr(self, name, value)
        return value


@contextlib.contextmanager
def postponed_imports() -> Iterator[None]:
    """
    Import modules of :data:`POSTPONED` when they are used, and none of :data:`LEFT_OUT`.

    This applies to the ``import`` statements that run in the context, not to later ones.
    """
    added: dict[str, ModuleType | None] = {
        **{name: _Placeholder(name) for name in POSTPONED}, **dict.fromkeys(LEFT_OUT)}
    for name in added.keys() & sys.modules:
        del added[name]
    # An entry of None makes an import fail.
    sys.modules.update(added)  # type: ignore[arg-type]
    try:
        yield
    finally:
        for name, module in added.items():
            _remove(name, module)


def _remove(name: str, module: ModuleType | None) -> None:
    # Another thread must not insert the imported module between the check and the removal.
    with _lock:
        if sys.modules.get(name) is module:
            sys.modules.pop(name, None)
