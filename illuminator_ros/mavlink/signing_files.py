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

"""The two files of message signing: the key, and the last time stamp used."""

from __future__ import annotations

import contextlib
import hashlib
import logging
import os
from pathlib import Path
import re
import stat

from .signing import KEY_SIZE, MAX_TICKS, Signing, SigningMode, ticks, TICKS_PER_SECOND

MIN_PASSPHRASE = 8
MAX_KEY_FILE = 4096
# The stored time stamp runs ahead of the last one used by this much, so that a crash between
# two stores repeats none. The specification asks for a store at least once a minute. It is not
# more than a new stream may be behind, so others with the right time are still believed.
STORE_MARGIN = 60 * TICKS_PER_SECOND

_log = logging.getLogger(__name__)


class KeyFileError(ValueError):
    """A key file that cannot be used; the message names the file and says why, never the key."""


def load_key(path: str) -> bytes:
    """
    Return the 32-byte key that a file holds.

    The file has 32 raw bytes, or 64 hexadecimal digits, or a passphrase: one line of at least 8
    printable characters whose SHA-256 is the key, as in MAVProxy and Mission Planner. 32 bytes of
    printable text are a passphrase.

    :raises KeyFileError: if it cannot be read, is open to others, or holds none of these.
    """
    if not path:
        raise KeyFileError('no key file is given')
    path = os.path.expanduser(path)
    try:
        # Without waiting: a FIFO without a writer would hold up the start for ever.
        descriptor = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC)
        with open(descriptor, 'rb') as file:
            mode = os.fstat(descriptor).st_mode
            content = file.read(MAX_KEY_FILE + 1) if stat.S_ISREG(mode) else b''
    except OSError as error:
        raise KeyFileError(f'key file {path!r}: {error.strerror}') from None
    except ValueError as error:
        raise KeyFileError(f'key file {path!r}: {error}') from None
    if not stat.S_ISREG(mode):
        raise KeyFileError(f'key file {path!r} is no regular file')
    if stat.S_IMODE(mode) & 0o077:
        raise KeyFileError(
            f'key file {path!r} can be read by others (mode {stat.S_IMODE(mode):04o}); '
            f'make it private: chmod 600 {path}')
    if len(content) > MAX_KEY_FILE:
        raise KeyFileError(f'key file {path!r} is longer than {MAX_KEY_FILE} bytes')
    text = content.rstrip(b'\r\n')
    if re.fullmatch(rb'[0-9A-Fa-f]{64}', text):
        return bytes.fromhex(text.decode())
    printable = _printable(text)
    if len(content) == KEY_SIZE and not printable:
        return content
    if len(text) < MIN_PASSPHRASE or not printable:
        raise KeyFileError(
            f'key file {path!r} holds {len(content)} bytes: neither 32 raw bytes, nor 64 '
            f'hexadecimal digits, nor a passphrase of at least {MIN_PASSPHRASE} printable '
            'characters')
    return hashlib.sha256(text).digest()


def _printable(text: bytes) -> bool:
    try:
        return text.decode().isprintable()
    except UnicodeDecodeError:
        return False


class TimestampStore:
    """
    The last time stamp used with a key, kept over restarts.

    Lies in ``$ROS_HOME/illuminator_ros`` (``~/.ros/illuminator_ros``), a file per key file and
    component.
    """

    def __init__(self, key_file: str, name: str, directory: Path | None = None) -> None:
        home = Path(os.environ.get('ROS_HOME') or Path.home() / '.ros')
        tag = hashlib.sha256(f'{os.path.realpath(key_file)}\0{name}'.encode()).hexdigest()[:16]
        self.path = (directory or home / 'illuminator_ros') / f'signing-{tag}'

    def begin(self, unix_time: float) -> int:
        """
        Return the time stamp to begin a run with: the stored one or, where it is ahead, the clock.

        So what is stored first, before anything is signed, already holds for a crash.
        """
        return max(self.load(), ticks(unix_time))

    def load(self) -> int:
        """Return the time stamp that is stored, 0 where none is."""
        try:
            timestamp = int(self.path.read_text())
        except (OSError, ValueError):
            return 0
        return timestamp if 0 <= timestamp <= MAX_TICKS else 0

    def store(self, timestamp: int, *, last: bool = False) -> None:
        """
        Replace the stored time stamp.

        :param last: no other will be used in this run, so the next goes on right behind it.
            Otherwise each restart would take the time stamps further ahead of the clock.
        :raises OSError: if the directory cannot be written.
        """
        following = timestamp if last else timestamp + STORE_MARGIN
        self.path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        scratch = self.path.with_name(f'{self.path.name}.{os.getpid()}')
        try:
            scratch.write_text(f'{min(following, MAX_TICKS)}\n')
            os.replace(scratch, self.path)
        finally:
            with contextlib.suppress(OSError):
                scratch.unlink()


def keyed(
    mode: SigningMode, key_file: str, name: str, unix_time: float,
) -> tuple[Signing, TimestampStore]:
    """
    Return what signs with the key of a file, and where its time stamps are kept.

    :param mode: any but ``off``.
    :param name: whose time stamps those are.
    :param unix_time: now, s.
    :raises KeyFileError: if the key cannot be used.
    """
    key = load_key(key_file)
    store = TimestampStore(key_file, name)
    return Signing(mode, key, timestamp=store.begin(unix_time)), store


class TimestampKeeper:
    """
    Stores the time stamp for the next run ("Timestamp Handling"), until that fails.

    :param store: None keeps it nowhere.
    """

    def __init__(self, signing: Signing, store: TimestampStore | None) -> None:
        self._signing = signing
        self._store = store

    def keep(self, last: bool = False) -> None:
        """Store it; see :meth:`TimestampStore.store`."""
        if self._store is not None:
            try:
                self._store.store(self._signing.timestamp, last=last)
            except OSError as error:
                self._store = None
                _log.error('cannot keep the signing time stamp, a restart may repeat some: %s',
                           error)
