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

"""The bytes of MAVLink that the bridge adds to a link with one idle light, UDP headers apart."""

from __future__ import annotations

from collections.abc import Iterator
import contextlib
import selectors
import socket
import threading
import time

from ..rig import Bench, bridge, free_port, simulator
from ..rows import at_most, one, Row

# s; what is asked of a light that was just found is not counted.
SETTLING, COUNTED = 6.0, 10.0
LIMIT = 60.0


class Meter:
    """Passes datagrams on between a light and a bridge, and counts their bytes."""

    def __init__(self, bridge_port: int) -> None:
        self._light = socket.socket(type=socket.SOCK_DGRAM)
        self._light.bind(('127.0.0.1', 0))
        self._bridge = socket.socket(type=socket.SOCK_DGRAM)
        self._bridge.connect(('127.0.0.1', bridge_port))
        self.port: int = self._light.getsockname()[1]
        self.from_light = self.from_bridge = 0
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def close(self) -> None:
        """End it."""
        self._ended.set()
        self._thread.join(5.0)
        self._light.close()
        self._bridge.close()

    def _run(self) -> None:
        light = None
        with selectors.DefaultSelector() as selector:
            for one_side in (self._light, self._bridge):
                selector.register(one_side, selectors.EVENT_READ)
            while not self._ended.is_set():
                for key, _ in selector.select(0.1):
                    with contextlib.suppress(ConnectionError):
                        if key.fileobj is self._light:
                            data, light = self._light.recvfrom(65536)
                            self.from_light += len(data)
                            self._bridge.send(data)
                        else:
                            data = self._bridge.recv(65536)
                            self.from_bridge += len(data)
                            if light:
                                self._light.sendto(data, light)


def measure(bench: Bench) -> Iterator[Row]:
    """Count for a light with a status a second, and for a light that sends status on request."""
    kinds = {'a light with a status a second': '1', 'a light that has to be asked': '0'}
    with contextlib.ExitStack() as stack:
        meters = []
        for interval in kinds.values():
            port = free_port()
            stack.enter_context(bridge(f'udpin://127.0.0.1:{port}'))
            meter = stack.enter_context(contextlib.closing(Meter(port)))
            stack.enter_context(simulator(f'udpout://127.0.0.1:{meter.port}',
                                          '--status-interval', interval))
            meters.append(meter)
        time.sleep(bench.amount(SETTLING, 0.2))
        before = [(meter.from_bridge, meter.from_light) for meter in meters]
        seconds = bench.amount(COUNTED, 0.2)
        time.sleep(seconds)
        for kind, meter, (added, sent) in zip(kinds, meters, before, strict=True):
            ours = (meter.from_bridge - added) / seconds
            yield Row(f'bytes added to the link, {kind}', 'B/s', one(ours),
                      {'the light itself': one((meter.from_light - sent) / seconds)},
                      [at_most(ours, LIMIT, 'B/s')], 'without UDP and IP headers')
