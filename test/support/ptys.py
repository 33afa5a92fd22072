# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""A serial line without hardware: a pseudo-terminal behind a path that stays the same."""

from __future__ import annotations

import os
from pathlib import Path
import select

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
        """Make a new device appear."""
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
        """Return the bytes sent to the device; b'' if none arrive in time."""
        if not select.select([self._far], [], [], patience)[0]:
            return b''
        try:
            return os.read(self._far, 65536)
        except (BlockingIOError, OSError):
            return b''
