# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Writing to stdout and stderr through a pipe: a reader that stops reading blocks no thread."""

from __future__ import annotations

import contextlib
import fcntl
import os
import select
import struct
import termios
import threading
import time

# Bytes of the pipe, the most for an unprivileged process.
PIPE_SIZE = 1 << 20
# Bytes of a write.
WRITE_SIZE = 4096
# s between looks at the pipe while the reader does not read.
LOOK_INTERVAL = 0.1


class OutputQueue:
    """
    A queue between descriptors of this process and their readers.

    Each descriptor leads to a pipe that a thread empties, so that a write never blocks: C code of
    the middleware writes while it holds the interpreter's lock. While the reader does not read and
    half of the pipe is full, lines are dropped; their number is written afterwards.

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
            stream.thread.join(max(until - time.monotonic(), 0.0))


class _Stream:
    """
    One descriptor.

    :ivar thread: writes to the reader.
    """

    def __init__(self, descriptor: int) -> None:
        self._descriptor = descriptor
        # Above 2: one of the first three may have been closed.
        self._target = fcntl.fcntl(descriptor, fcntl.F_DUPFD_CLOEXEC, 3)
        self._source, into = os.pipe()
        with contextlib.suppress(OSError):
            fcntl.fcntl(into, fcntl.F_SETPIPE_SZ, PIPE_SIZE)
        self._limit = fcntl.fcntl(into, fcntl.F_GETPIPE_SZ) // 2
        os.set_blocking(into, False)
        self._room = select.poll()
        self._room.register(self._target, select.POLLOUT)
        self.thread = threading.Thread(target=self._copy, name='output', daemon=True)
        self.thread.start()
        os.dup2(into, descriptor)
        os.close(into)

    def cut_off(self) -> None:
        """Redirect the descriptor to /dev/null, so that the source ends."""
        with open(os.devnull, 'wb') as nowhere:
            os.dup2(nowhere.fileno(), self._descriptor)

    def _copy(self) -> None:
        lost = 0
        while data := os.read(self._source, WRITE_SIZE):
            while not self._room.poll(LOOK_INTERVAL * 1e3):
                if self._unread() > self._limit:
                    data += os.read(self._source, self._limit)
                    lost += data.count(b'\n', 0, -WRITE_SIZE)
                    data = data[-WRITE_SIZE:]
            if lost:
                # The beginning of the first line is lost.
                data = b'\n[%d lines were dropped while nothing read them]\n%s' % (
                    lost, data.partition(b'\n')[2])
                lost = 0
            try:
                while data:
                    data = data[self._write(data):]
            except OSError:
                # The reader is gone: writing to the descriptor fails from now on, as without a
                # queue.
                os.dup2(self._target, self._descriptor)
                return

    def _unread(self) -> int:
        """Return the bytes in the pipe."""
        (count,) = struct.unpack('i', fcntl.ioctl(self._source, termios.FIONREAD, bytes(4)))
        return int(count)

    def _write(self, data: bytes) -> int:
        """Write some of the output, and return how much."""
        try:
            return os.write(self._target, data)
        except BlockingIOError:
            # Another process has made the file non-blocking.
            self._room.poll()
            return 0
