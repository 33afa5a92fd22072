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

"""Writing to stdout and stderr through a queue: a reader that stops reading blocks no thread."""

from __future__ import annotations

import contextlib
import fcntl
import os
import select
import threading
import time

# Bytes of the queue, and of the pipe, which holds output until the threads run.
QUEUE_SIZE = 1 << 20
# Bytes of a write.
WRITE_SIZE = 4096


class OutputQueue:
    """
    A queue between descriptors of this process and their readers.

    Each descriptor leads to a pipe that never blocks, also for C code that holds the
    interpreter's lock. One thread takes the output from the pipe, and another writes it as fast as
    the reader takes it. Lines that do not fit into the queue are dropped; their number is written
    once there is room.

    :param descriptors: such as 1 and 2; closed ones are ignored.
    """

    def __init__(self, *descriptors: int) -> None:
        self._streams = []
        for descriptor in descriptors:
            # Without a thread the descriptor stays as it was.
            with contextlib.suppress(OSError, RuntimeError):
                self._streams.append(_Stream(descriptor))

    def finish(self, timeout: float) -> None:
        """Write what is queued, for at most ``timeout`` s; later output is dropped."""
        until = time.monotonic() + timeout
        for stream in self._streams:
            with contextlib.suppress(OSError):
                stream.cut_off()
        for stream in self._streams:
            stream.writer.join(max(until - time.monotonic(), 0.0))


class _Stream:
    """
    One descriptor.

    :ivar writer: the thread that writes to the reader.
    """

    def __init__(self, descriptor: int) -> None:
        self._descriptor = descriptor
        # Above 2: one of the first three may have been closed.
        self._target = fcntl.fcntl(descriptor, fcntl.F_DUPFD_CLOEXEC, 3)
        self._source, into = os.pipe()
        # The largest size for an unprivileged process.
        with contextlib.suppress(OSError):
            fcntl.fcntl(into, fcntl.F_SETPIPE_SZ, QUEUE_SIZE)
        os.set_blocking(into, False)
        self._changed = threading.Condition()
        self._queue = bytearray()
        self._at_end = False
        self._lost = 0
        self._dropping = False
        self.writer = threading.Thread(target=self._write, name='output', daemon=True)
        self.writer.start()
        threading.Thread(target=self._read, name='output', daemon=True).start()
        os.dup2(into, descriptor)
        os.close(into)

    def cut_off(self) -> None:
        """Redirect the descriptor to /dev/null, so that the source ends."""
        with open(os.devnull, 'wb') as nowhere:
            os.dup2(nowhere.fileno(), self._descriptor)

    def _read(self) -> None:
        while data := os.read(self._source, 1 << 16):
            with self._changed:
                for line in data.splitlines(keepends=True):
                    self._add(line)
                self._changed.notify()
        with self._changed:
            self._at_end = True
            self._changed.notify()

    def _add(self, line: bytes) -> None:
        if self._dropping and len(self._queue) < QUEUE_SIZE // 2:
            self._dropping = False
            note = f'[{self._lost} lines were dropped while nothing read them]\n'.encode()
            self._queue += note if self._queue.endswith(b'\n') else b'\n' + note
            self._lost = 0
        self._dropping |= len(self._queue) + len(line) > QUEUE_SIZE
        if not self._dropping:
            self._queue += line
        elif line.endswith(b'\n'):
            self._lost += 1

    def _write(self) -> None:
        while data := self._next():
            try:
                while data:
                    data = data[self._send(data):]
            except OSError:
                # The reader is gone: writing to the descriptor fails from now on, as without a
                # queue.
                os.dup2(self._target, self._descriptor)
                return

    def _next(self) -> bytes:
        """Wait for output, and return it; nothing at the end."""
        with self._changed:
            self._changed.wait_for(lambda: self._queue or self._at_end)
            data = bytes(self._queue[:WRITE_SIZE])
            del self._queue[:WRITE_SIZE]
            return data

    def _send(self, data: bytes) -> int:
        """Write some of the output, and return how much."""
        try:
            return os.write(self._target, data)
        except BlockingIOError:
            # Another process has made the file non-blocking.
            select.select([], [self._target], [])
            return 0
