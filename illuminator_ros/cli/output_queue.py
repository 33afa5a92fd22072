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

from collections.abc import Callable
import contextlib
import fcntl
import functools
import os
import select
import stat
import threading

# Bytes of the queue, and of the pipe, which holds output until the thread runs.
QUEUE_SIZE = 1 << 20
# Bytes of a write; a blocking pipe that polls as writable takes as many (POSIX, PIPE_BUF).
WRITE_SIZE = 4096


class OutputQueue:
    """
    A queue between descriptors of this process and their readers.

    Each descriptor leads to a pipe that never blocks, also for C code that holds the
    interpreter's lock. A thread forwards the output of the pipe as fast as the reader takes it.
    Lines that do not fit into the queue are dropped; their number is written once there is room.

    :param descriptors: such as 1 and 2; closed ones are ignored.
    """

    def __init__(self, *descriptors: int) -> None:
        self._streams = []
        for descriptor in descriptors:
            with contextlib.suppress(OSError):
                self._streams.append(_Stream(descriptor))
        self._thread = threading.Thread(target=self._run, name='output', daemon=True)
        try:
            self._thread.start()
        except RuntimeError:
            # Without a thread the descriptors stay as they were.
            return
        for stream in self._streams:
            stream.redirect()

    def finish(self, timeout: float) -> None:
        """Write what is queued, for at most ``timeout`` s; later output is dropped."""
        for stream in self._streams:
            with contextlib.suppress(OSError):
                stream.cut_off()
        if self._thread.ident is not None:
            self._thread.join(timeout)

    def _run(self) -> None:
        streams = list(self._streams)
        while streams:
            poller = select.poll()
            for stream in streams:
                if not stream.at_end:
                    poller.register(stream.source, select.POLLIN)
                if stream.queue:
                    poller.register(stream.target, select.POLLOUT)
            poller.poll()
            for stream in streams:
                stream.transfer()
            streams = [stream for stream in streams if stream.queue or not stream.at_end]


class _Stream:
    """
    One descriptor.

    :ivar source: the end of the pipe from which the output to the descriptor is read.
    :ivar target: leads to the reader.
    """

    def __init__(self, descriptor: int) -> None:
        self.descriptor = descriptor
        self.target = _open_again(descriptor)
        self.source, self._input = os.pipe()
        # The largest size for an unprivileged process.
        with contextlib.suppress(OSError):
            fcntl.fcntl(self._input, fcntl.F_SETPIPE_SZ, QUEUE_SIZE)
        os.set_blocking(self.source, False)
        os.set_blocking(self._input, False)
        self._send: Callable[[bytes], int] = functools.partial(os.write, self.target)
        if stat.S_ISSOCK(os.fstat(self.target).st_mode):
            # Slow to import, and signals must be handled before.
            import socket
            connection = socket.socket(fileno=self.target)
            self._send = lambda data: connection.send(data, socket.MSG_DONTWAIT)
        self.queue = bytearray()
        self.at_end = False
        self._lost = 0
        self._dropping = False

    def redirect(self) -> None:
        """Redirect the descriptor to this queue."""
        os.dup2(self._input, self.descriptor)
        os.close(self._input)

    def cut_off(self) -> None:
        """Redirect the descriptor to /dev/null, so that the source ends."""
        with open(os.devnull, 'wb') as nowhere:
            os.dup2(nowhere.fileno(), self.descriptor)

    def transfer(self) -> None:
        """Read and write as much as is possible without waiting."""
        try:
            data = b'' if self.at_end else os.read(self.source, 1 << 16)
            self.at_end = not data
        except BlockingIOError:
            data = b''
        for line in data.splitlines(keepends=True):
            self._add(line)
        try:
            if self.queue and _is_writable(self.target):
                del self.queue[:self._send(bytes(self.queue[:WRITE_SIZE]))]
        except BlockingIOError:
            pass
        except OSError:
            # The reader is gone: writing to the descriptor fails from now on, as without a queue.
            self.queue.clear()
            if not self.at_end:
                os.close(self.source)
            self.at_end = True

    def _add(self, line: bytes) -> None:
        if self._dropping and len(self.queue) < QUEUE_SIZE // 2:
            self._dropping = False
            note = f'[{self._lost} lines were dropped while nothing read them]\n'.encode()
            self.queue += note if self.queue.endswith(b'\n') else b'\n' + note
            self._lost = 0
        self._dropping |= len(self.queue) + len(line) > QUEUE_SIZE
        if not self._dropping:
            self.queue += line
        elif line.endswith(b'\n'):
            self._lost += 1


def _open_again(descriptor: int) -> int:
    """
    Return a descriptor for the same file that does not block, if that is possible.

    The flag of a duplicate would be shared with other processes, such as the shell.
    """
    mode = os.fstat(descriptor).st_mode
    with contextlib.ExitStack() as opened:
        if stat.S_ISFIFO(mode) or stat.S_ISCHR(mode):
            with contextlib.suppress(OSError):
                descriptor = os.open(f'/proc/self/fd/{descriptor}',
                                     os.O_WRONLY | os.O_NONBLOCK | os.O_NOCTTY)
                opened.callback(os.close, descriptor)
        # Above 2: one of the first three may have been closed.
        return fcntl.fcntl(descriptor, fcntl.F_DUPFD_CLOEXEC, 3)


def _is_writable(descriptor: int) -> bool:
    poller = select.poll()
    poller.register(descriptor, select.POLLOUT)
    return bool(poller.poll(0))
