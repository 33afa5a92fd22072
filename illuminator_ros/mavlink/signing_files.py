# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The two files of message signing: the key, and the last time stamp used."""

from __future__ import annotations

from collections.abc import Callable
import contextlib
import errno
import hashlib
import logging
import os
from pathlib import Path
import re
import stat

from .errors import KeyFileError
from .signing import KEY_SIZE, MAX_TICKS, Signing, SigningMode, ticks, TICKS_PER_SECOND

MIN_PASSPHRASE = 8
MAX_KEY_FILE = 4096
# The stored time stamp is ahead of the clock, and of the last one used, by this much, so that a
# crash before the next store repeats none. Time stamps that are ahead of the clock only count
# frames, so that repeated crashes do not add up. Peers accept a new stream 60 s behind.
CLOCK_MARGIN = 45 * TICKS_PER_SECOND
FRAMES_MARGIN = TICKS_PER_SECOND // 2

_log = logging.getLogger(__name__)


def load_key(path: str) -> bytes:
    """
    Return the 32-byte key that a file holds.

    The file has 32 raw bytes, or 64 hexadecimal digits, or a passphrase: one line of at least 8
    printable characters whose SHA-256 is the key, as in MAVProxy and Mission Planner. 32 bytes of
    printable text are a passphrase.

    :raises KeyFileError: if it cannot be read, is open to others, or holds none of these.
    """
    if not path:
        raise KeyFileError('no key file is given, and signing needs one')
    path = os.path.expanduser(path)
    try:
        content = _read(path)
        mode = os.stat(path).st_mode
    except OSError as error:
        raise KeyFileError(f'key file {path!r}: {error.strerror}') from None
    except ValueError as error:
        raise KeyFileError(f'key file {path!r}: {error}') from None
    if stat.S_IMODE(mode) & 0o077:
        raise KeyFileError(
            f'key file {path!r} can be read by others (mode {stat.S_IMODE(mode):04o}); '
            f'make it private: chmod 600 {path}')
    if len(content) > MAX_KEY_FILE:
        raise KeyFileError(f'key file {path!r} is longer than {MAX_KEY_FILE} bytes')
    text = content.rstrip(b'\r\n')
    if re.fullmatch(rb'[0-9A-Fa-f]{64}', content.strip()):
        return bytes.fromhex(content.decode())
    printable = _printable(text)
    if len(content) == KEY_SIZE and not printable:
        return content
    if len(text) < MIN_PASSPHRASE or not printable:
        raise KeyFileError(
            f'key file {path!r} holds {len(content)} bytes: neither 32 raw bytes, nor 64 '
            f'hexadecimal digits, nor a passphrase of at least {MIN_PASSPHRASE} printable '
            'characters')
    return hashlib.sha256(text).digest()


def _read(path: str) -> bytes:
    # Without waiting: a FIFO without a writer would hold up the start for ever.
    descriptor = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC)
    with open(descriptor, 'rb') as file:
        if not stat.S_ISREG(os.fstat(descriptor).st_mode):
            raise OSError(errno.EINVAL, 'not a regular file')
        return file.read(MAX_KEY_FILE + 1)


def _printable(text: bytes) -> bool:
    try:
        return text.decode().isprintable()
    except UnicodeDecodeError:
        return False


class TimestampStore:
    """
    The last time stamp used with a key, kept over restarts.

    :param folder: has one file for each key file and component.
    """

    def __init__(self, key_file: str, name: str, folder: Path) -> None:
        path = os.path.realpath(os.path.expanduser(key_file))
        tag = hashlib.sha256(f'{path}\0{name}'.encode()).hexdigest()[:16]
        self.path = folder / f'signing-{tag}'
        self._failed = False

    def begin(self, unix_time: float) -> int:
        """
        Return the time stamp to begin a run with: the stored one or, where it is ahead, the clock.

        So the first stored time stamp, from before any frame is signed, is valid after a crash.
        """
        return max(self.load(), ticks(unix_time))

    def load(self) -> int:
        """Return the time stamp that is stored, 0 where none is."""
        try:
            timestamp = int(_read(str(self.path)))
        except (OSError, ValueError):
            return 0
        return timestamp if 0 <= timestamp <= MAX_TICKS else 0

    def store(self, timestamp: int, unix_time: float, *, last: bool = False) -> None:
        """
        Replace the stored time stamp; a failure is logged once until it ends.

        :param unix_time: now, s.
        :param last: no other will be used in this run, so the next continues right behind it.
        """
        following = timestamp if last else max(
            timestamp + FRAMES_MARGIN, ticks(unix_time) + CLOCK_MARGIN)
        scratch = self.path.with_name(f'{self.path.name}.{os.getpid()}')
        try:
            self.path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
            scratch.write_text(f'{min(following, MAX_TICKS)}\n')
            os.replace(scratch, self.path)
        except OSError as error:
            with contextlib.suppress(OSError):
                scratch.unlink()
            if not self._failed:
                _log.error('cannot store the signing time stamp, trying again: a restart may '
                           'repeat some: %s', error)
            self._failed = True
        else:
            self._failed = False


def load_signing(
    mode: SigningMode, key_file: str, name: str, unix_time: float, folder: Callable[[], Path],
) -> tuple[Signing, TimestampStore | None]:
    """
    Return the signing with the key of a file, and the store of its time stamps.

    :param key_file: '' for none.
    :param name: of the component whose time stamps are stored.
    :param unix_time: now, s.
    :param folder: returns the folder of the time stamps.
    :raises KeyFileError: if the key cannot be used, or is given and not used, which would look
        like protection.
    """
    if mode is SigningMode.OFF:
        if key_file:
            raise KeyFileError('a key file is given, but the signing mode is off')
        return Signing(), None
    key = load_key(key_file)
    store = TimestampStore(key_file, name, folder())
    return Signing(mode, key, timestamp=store.begin(unix_time)), store
