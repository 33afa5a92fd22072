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
    Forwards what comes from one side to the other, once it has heard both.

    :ivar near_port: and ``far_port``, where the two sides send to.
    """

    def __init__(self) -> None:
        self.near_port, self.far_port = free_port(), free_port()
        self._stack = contextlib.ExitStack()

    def start(self) -> None:
        """Start to forward, with no known sender."""
        end, ended = socket.socketpair()
        sides = [bound_socket(port=port) for port in (self.near_port, self.far_port)]
        thread = threading.Thread(target=_forward, args=(sides, ended))
        thread.start()
        self._stack.callback(thread.join, PATIENCE)
        self._stack.callback(end.close)

    def stop(self) -> None:
        """End it, if it runs."""
        self._stack.close()


def _forward(sides: list[socket.socket], ended: socket.socket) -> None:
    heard: dict[socket.socket, Any] = {}
    with sides[0], sides[1], ended:
        while True:
            ready, _, _ = select.select([*sides, ended], [], [])
            if ended in ready:
                return
            for side in ready:
                data, heard[side] = side.recvfrom(65536)
                other = sides[side is sides[0]]
                if other in heard:
                    with contextlib.suppress(OSError):
                        other.sendto(data, heard[other])
