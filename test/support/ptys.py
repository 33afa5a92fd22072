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

"""A serial line without hardware: a pseudo-terminal behind a path that stays the same."""

from __future__ import annotations

from collections.abc import Callable
import contextlib
import itertools
import os
from pathlib import Path
import select
import threading

from illuminator_ros.illuminator.simulated import simulated_lights
from illuminator_ros.illuminator.simulated_properties import IlluminatorProperties
from illuminator_ros.mavlink.frame import Decoder
from support.frames import frame_of
from support.messages import decode_payload, HANDLED
from support.waiting import PATIENCE


class PtyDevice:
    """
    The far end of a serial line, whose near end is the device ``path``.

    :ivar path: a symbolic link, as udev makes them.
    """

    def __init__(self, directory: Path) -> None:
        self.path = directory / 'ttyLIGHT'
        self._far = -1
        self.plug_in()

    def plug_in(self) -> None:
        """Make the device appear, another one than before."""
        far, near = os.openpty()
        name = os.ttyname(near)
        os.close(near)
        scratch = self.path.with_name('scratch')
        scratch.symlink_to(name)
        os.replace(scratch, self.path)
        self._far = far
        os.set_blocking(far, False)

    def pull_out(self) -> None:
        """Make the device disappear."""
        self.path.unlink(missing_ok=True)
        if self._far >= 0:
            os.close(self._far)
            self._far = -1

    def write(self, data: bytes) -> None:
        """Send bytes to the program that has opened the device."""
        while data:
            select.select([], [self._far], [], PATIENCE)
            data = data[os.write(self._far, data):]

    def read(self, patience: float = PATIENCE) -> bytes:
        """Return what has been sent to the device; b'' if nothing comes."""
        if not select.select([self._far], [], [], patience)[0]:
            return b''
        try:
            return os.read(self._far, 65536)
        except (BlockingIOError, OSError):
            return b''

    def connect_light(self, clock: Callable[[], float]) -> _Light:
        """Let a simulated light use the far end, until it is stopped."""
        return _Light(self._far, clock)


class _Light:
    """A simulated light at the far end of a serial line."""

    def __init__(self, line: int, clock: Callable[[], float]) -> None:
        self._line = line
        self._clock = clock
        self._endpoint = simulated_lights([IlluminatorProperties()], clock())
        self._decoder = Decoder()
        self._stopping, self._stop = os.pipe()
        self._thread = threading.Thread(target=self._run)
        self._thread.start()

    def stop(self) -> None:
        """End it."""
        os.close(self._stop)
        self._thread.join(PATIENCE)
        os.close(self._stopping)

    def _run(self) -> None:
        sequence = itertools.count()
        while True:
            now = self._clock()
            self._endpoint.poll(now)
            while self._endpoint.outgoing:
                source, message = self._endpoint.outgoing.popleft()
                with contextlib.suppress(OSError):
                    os.write(self._line, frame_of(message, next(sequence) & 0xFF, source))
            wait = max(self._endpoint.next_deadline() - now, 0.0)
            ready, _, _ = select.select([self._line, self._stopping], [], [], wait)
            if self._stopping in ready:
                return
            if self._line in ready:
                self._take()

    def _take(self) -> None:
        try:
            data = os.read(self._line, 4096)
        except OSError:
            # No program has the device open; a closed pseudo-terminal is always readable.
            select.select([self._stopping], [], [], 0.01)
            return
        for frame in self._decoder.feed(data):
            if frame.message_id in HANDLED:
                self._endpoint.receive(
                    frame.source, decode_payload(frame.message_id, frame.payload),
                    self._clock())
