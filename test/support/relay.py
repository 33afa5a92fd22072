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

"""A UDP router between two sides that both send to it, and that can be restarted."""

from __future__ import annotations

import contextlib
import select
import socket
import threading
from typing import Any

from support.open_channel import bound_socket
from support.ports import free_port
from support.waiting import PATIENCE


class Relay:
    """
    Passes on what comes from one side to the other, once it has heard both.

    :ivar near_port: and ``far_port``, where the two sides send to.
    """

    def __init__(self) -> None:
        self.near_port = free_port()
        self.far_port = free_port()
        self._thread: threading.Thread | None = None
        self._end: socket.socket | None = None

    def start(self) -> None:
        """Start to forward, with no known sender."""
        near = bound_socket(port=self.near_port)
        far = bound_socket(port=self.far_port)
        self._end, ended = socket.socketpair()
        self._thread = threading.Thread(target=self._run, args=(near, far, ended))
        self._thread.start()

    def stop(self) -> None:
        """End it."""
        if self._end is not None and self._thread is not None:
            self._end.close()
            self._thread.join(PATIENCE)
            self._end = None

    def _run(self, near: socket.socket, far: socket.socket, ended: socket.socket) -> None:
        others = {near: far, far: near}
        heard: dict[socket.socket, Any] = {}
        with near, far, ended:
            while True:
                ready, _, _ = select.select([near, far, ended], [], [])
                if ended in ready:
                    return
                for side in ready:
                    data, heard[side] = side.recvfrom(65536)
                    if others[side] in heard:
                        with contextlib.suppress(OSError):
                            others[side].sendto(data, heard[others[side]])
