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

"""A UDP router on loopback between lights and a bridge that loses and corrupts frames."""

from __future__ import annotations

import contextlib
import select
import socket
import threading
import time
from typing import Any

from support.faulty_wire import Faults, FaultyWire
from support.open_channel import bound_socket

# Lights are distinguished by their source address; the oldest is dropped.
MAX_LANES = 8
NO_FAULTS = Faults(latency=0.0)


class _Lane:
    """The path of one light: its address, a socket of its own towards the bridge, two wires."""

    def __init__(self, light: Any, faults: Faults, seed: int) -> None:
        self.light = light
        self.socket = bound_socket()
        self.to_bridge, self.to_light = FaultyWire(faults, seed), FaultyWire(faults, seed + 1)


class FaultProxy:
    """
    Forwards datagrams, in a thread of its own, with faults that can be changed at any time.

    :param bridge_port: the port on which the bridge listens.
    :ivar port: the port to which lights send.
    """

    def __init__(self, bridge_port: int, seed: int = 0) -> None:
        self._bridge = ('127.0.0.1', bridge_port)
        self._socket = bound_socket()
        self.port: int = self._socket.getsockname()[1]
        self._faults = NO_FAULTS
        self._seed = seed
        self._lanes: dict[Any, _Lane] = {}
        self._lock = threading.Lock()
        self._ended = False
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def set(self, faults: Faults) -> None:  # noqa: A003
        """Set the faults."""
        with self._lock:
            self._faults = faults
            for lane in self._lanes.values():
                lane.to_bridge.faults = lane.to_light.faults = faults

    def restart(self) -> None:
        """Forget all lights, as a restarted router does; they then get other ports."""
        with self._lock:
            for lane in self._lanes.values():
                lane.socket.close()
            self._lanes.clear()

    def close(self) -> None:
        """Stop the proxy."""
        self._ended = True
        self._thread.join(5.0)
        self.restart()
        self._socket.close()

    def _run(self) -> None:
        while not self._ended:
            with self._lock:
                lanes = list(self._lanes.values())
                due = min((wire.next_arrival() for lane in lanes
                           for wire in (lane.to_bridge, lane.to_light)), default=1e9)
            wait = min(max(due - time.monotonic(), 0.0), 0.1)
            # A lane may have been closed meanwhile.
            with contextlib.suppress(OSError, ValueError):
                ready, _, _ = select.select(
                    [self._socket, *(lane.socket for lane in lanes)], [], [], wait)
                with self._lock:
                    self._turn(ready, lanes)

    def _turn(self, ready: list[socket.socket], lanes: list[_Lane]) -> None:
        now = time.monotonic()
        if self._socket in ready:
            data, light = self._socket.recvfrom(65536)
            self._lane(light).to_bridge.send(data, now)
        for lane in lanes:
            if lane.socket in ready and lane.light in self._lanes:
                lane.to_light.send(lane.socket.recv(65536), now)
        for lane in self._lanes.values():
            for data in lane.to_bridge.receive(now):
                lane.socket.sendto(data, self._bridge)
            for data in lane.to_light.receive(now):
                self._socket.sendto(data, lane.light)

    def _lane(self, light: Any) -> _Lane:
        if light not in self._lanes:
            if len(self._lanes) >= MAX_LANES:
                self._lanes.pop(next(iter(self._lanes))).socket.close()
            self._seed += 2
            self._lanes[light] = _Lane(light, self._faults, self._seed)
        return self._lanes[light]
