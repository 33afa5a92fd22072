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
A light and an autopilot behind a serial line that is as slow as a real one.

    serial_light.py PATH BAUD SHARE

Makes the device PATH. Its bytes take the time that they would at BAUD, 10 bits each, in both
directions, and the autopilot fills this share of the way to the computer. At its end, with
SIGINT, it says what it has sent.
"""

from __future__ import annotations

from collections import deque
import os
from pathlib import Path
import select
import sys
import time

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / 'test')]

from bench.traffic import frames  # noqa: E402
from illuminator_ros.illuminator.simulated import simulated_lights  # noqa: E402
from illuminator_ros.illuminator.simulated_properties import IlluminatorProperties  # noqa: E402
from illuminator_ros.mavlink.frame import Decoder  # noqa: E402
from illuminator_ros.mavlink.messages import decode_payload, HANDLED  # noqa: E402
from support.frames import frame_of  # noqa: E402

BITS = 10


class Wire:
    """One direction: bytes come out as long after one another as they take."""

    def __init__(self, baud: int) -> None:
        self._byte = BITS / baud
        self._free_at = 0.0
        self._queue: deque[tuple[float, bytes]] = deque()

    def put(self, data: bytes, now: float) -> None:
        """Send whole frames: each comes out when its last byte does."""
        self._free_at = max(self._free_at, now) + len(data) * self._byte
        self._queue.append((self._free_at, data))

    def ready(self, now: float) -> bytes:
        """Return what has come out."""
        done = []
        while self._queue and self._queue[0][0] <= now:
            done.append(self._queue.popleft()[1])
        return b''.join(done)

    def next(self) -> float:  # noqa: A003
        """Return when something comes out."""
        return self._queue[0][0] if self._queue else float('inf')


class Autopilot:
    """Fills a share of a line."""

    def __init__(self, baud: int, share: float) -> None:
        self._frames = frames()
        self._speed = share * baud / BITS
        self.due = time.monotonic() if share else float('inf')
        self.sent = 0

    def poll(self, wire: Wire, now: float) -> None:
        """Send what is due."""
        while self.due <= now:
            frame = self._frames[self.sent % len(self._frames)]
            wire.put(frame, now)
            self.due += len(frame) / self._speed
            self.sent += 1


def serve(far: int, baud: int, share: float) -> None:
    """Run light and autopilot."""
    there, back = Wire(baud), Wire(baud)
    light = simulated_lights([IlluminatorProperties()], time.monotonic())
    decoder, autopilot, sequence = Decoder(), Autopilot(baud, share), 0
    try:
        while True:
            now = time.monotonic()
            for frame in decoder.feed(there.ready(now)):
                if frame.message_id in HANDLED:
                    light.receive(frame.source, decode_payload(frame.message_id, frame.payload),
                                  now)
            light.poll(now)
            while light.outgoing:
                source, message = light.outgoing.popleft()
                back.put(frame_of(message, sequence & 0xFF, source), now)
                sequence += 1
            autopilot.poll(back, now)
            if data := back.ready(time.monotonic()):
                os.write(far, data)
            due = min(light.next_deadline(), autopilot.due, back.next(), there.next())
            wait = max(min(due - time.monotonic(), 1.0), 0.0)
            if select.select([far], [], [], wait)[0]:
                there.put(os.read(far, 4096), time.monotonic())
    except (KeyboardInterrupt, OSError):
        print(f'frames {autopilot.sent} {sequence}', flush=True)


def main() -> None:
    """Make the device and serve."""
    path, baud, share = sys.argv[1:]
    far, near = os.openpty()
    Path(path).symlink_to(os.ttyname(near))
    print('ready', flush=True)
    serve(far, int(baud), float(share))


if __name__ == '__main__':
    main()
