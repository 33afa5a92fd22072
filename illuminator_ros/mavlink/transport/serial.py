# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Serial ports, opened by pyserial, and pseudo-terminals; neither blocks."""

from __future__ import annotations

from collections.abc import Callable, Sequence
import contextlib
import errno
import fcntl
import functools
import math
import os
from pathlib import Path
import re
import struct
import termios
import tty
from typing import Any

from .base import Channel, Peer, StreamChannel
from .ports import IN_USE, OTHER_USER, users_of
from ..url import MAVROS_BAUD, PtyUrl, SerialUrl

# 8N1: a start bit, 8 data bits, a stop bit.
BITS_PER_BYTE = 10
# Why a port cannot be opened, where the system's own text is wrong or has no remedy.
REASONS = {
    errno.ENOENT: 'there is no such port: /dev/serial/by-id lists the present USB ports, and '
                  'serial://auto finds the port by itself',
    errno.ENOTTY: 'it is not a serial port',
    errno.EACCES: 'no permission; join its group, as in "sudo usermod -a -G dialout $USER", and '
                  'log in again',
}
OLDEST_PYSERIAL = 3, 5
# Bytes in a pseudo-terminal that no program has read; a serial line would have lost them.
MAX_UNREAD = 2048


def open_serial(url: SerialUrl) -> Channel:
    """
    Open a serial port, exclusively: a second reader would take some of the bytes.

    :raises OSError: if it is missing, in use, or not accessible.
    """
    try:
        import serial
    except ImportError:
        raise OSError('a serial port needs pyserial: apt install python3-serial, or '
                      'pip install pyserial') from None
    if tuple(map(int, re.findall(r'\d+', serial.__version__)[:2])) < OLDEST_PYSERIAL:
        raise OSError(f'pyserial {serial.__version__} is too old; 3.5 or newer is needed: '
                      "pip install 'pyserial>=3.5'")
    try:
        port = serial.Serial(
            url.device, url.baud, timeout=0, write_timeout=0, exclusive=True,
            rtscts=url.hardware_flow_control)
    except serial.SerialException as error:
        # The reason why a device cannot be configured is only in the context of its error.
        number = error.errno or (error.__context__ or error).args[0]
        reason = REASONS.get(number) or os.strerror(number) if number in errno.errorcode else error
        if number in (errno.EAGAIN, errno.EBUSY):
            reason = f'it is {IN_USE.format(users_of(url) or OTHER_USER)}'
        raise OSError(error.errno, f'cannot open {url.device}: {reason}') from None
    except (ValueError, OSError) as error:
        raise OSError(f'cannot open {url.device} at {url.baud} baud: {error}') from None
    # FTDI adapters delay bytes by 16 ms otherwise; not every driver supports this.
    with contextlib.suppress(OSError, ValueError, AttributeError):
        port.set_low_latency_mode(True)
    return _SerialChannel(url, port)


def open_pty(url: PtyUrl) -> Channel:
    """
    Make a pseudo-terminal; another program opens its device, or the link to it, as a serial port.

    :raises OSError: if the link cannot be made, or its path is in use for something else.
    """
    far, near = os.openpty()
    device = os.ttyname(near)
    with contextlib.ExitStack() as stack:
        stack.callback(os.close, far)
        stack.callback(os.close, near)
        # The terminal would otherwise return what it receives, and wait for whole lines.
        tty.setraw(near)
        os.set_blocking(far, False)
        if url.link:
            try:
                _make_link(Path(url.link), device)
            except OSError as error:
                raise OSError(error.errno, f'cannot link {url.link} to {device}: '
                              f'{error.strerror}') from None
            stack.callback(_remove_link, Path(url.link), device)
        return _LineChannel(
            far, f'pseudo-terminal, to be opened as serial://{url.link or device}:{MAVROS_BAUD}',
            stack.pop_all().close, functools.partial(_discard_unread, near))


def _make_link(link: Path, device: str) -> None:
    if link.exists() and not link.is_symlink():
        raise OSError(errno.EEXIST, 'it exists and is not a symbolic link')
    new = link.with_name(f'{link.name}.{os.getpid()}')
    new.symlink_to(device)
    new.replace(link)


def _remove_link(link: Path, device: str) -> None:
    # Another program may have replaced it.
    if link.is_symlink() and str(link.readlink()) == device:
        link.unlink()


def _discard_unread(near: int) -> None:
    """Discard bytes that no program has read: the next program would take them for new ones."""
    unread, = struct.unpack('i', fcntl.ioctl(near, termios.FIONREAD, bytes(4)))
    if unread > MAX_UNREAD:
        termios.tcflush(near, termios.TCIFLUSH)


class _LineChannel(StreamChannel):

    def __init__(
        self, fd: int, name: str, close: Callable[[], None],
        before_sending: Callable[[], None] = lambda: None, *, rate: float = math.inf,
    ) -> None:
        super().__init__(name, fd, 'the device has gone', rate)
        self._close = close
        self._before_sending = before_sending

    def send(self, frames: Sequence[bytes], peers: Sequence[Peer]) -> None:
        self._before_sending()
        super().send(frames, peers)

    def close(self) -> None:
        # Closing would otherwise wait up to 30 s for bytes that flow control holds back.
        with contextlib.suppress(OSError, termios.error):
            termios.tcflush(self._descriptor, termios.TCOFLUSH)
        with contextlib.suppress(OSError):
            self._close()


class _SerialChannel(_LineChannel):

    def __init__(self, url: SerialUrl, port: Any) -> None:
        # pyserial has no types.
        self.serial, self._device, self._port = url, url.device, port
        super().__init__(port.fileno(), f'serial {url.device} at {url.baud} baud', port.close,
                         rate=url.baud / BITS_PER_BYTE)

    def change_rate(self, baud: int) -> None:
        """See :meth:`Channel.change_rate`. DTR stays: some boards restart when it is raised."""
        try:
            self._port.baudrate = baud
            termios.tcflush(self._descriptor, termios.TCIFLUSH)
        except (ValueError, OSError, termios.error) as error:
            raise OSError(f'{self._device} has no {baud} baud: {error}') from None
        self.name = f'serial {self._device} at {baud} baud'
        self.rate = baud / BITS_PER_BYTE
