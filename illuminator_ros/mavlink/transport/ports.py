# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The serial ports of this machine, from /sys, and the users of a port, from /proc."""

from __future__ import annotations

import contextlib
import os
from pathlib import Path
import termios

from ..search.rate_scan import RATES
from ..url import SerialUrl, UdpUrl, Url

# The longest command line of a program that is shown, characters.
MAX_COMMAND = 80
PTY_MAKERS = {'/dev/ptmx', '/dev/pts/ptmx'}
IN_USE = 'in use by {}: end it, or share its link (doc/routers.md)'
OTHER_USER = 'a program of another user, which root can see'


def _read(path: Path) -> str:
    with contextlib.suppress(OSError):
        return path.read_text(errors='replace').strip()
    return ''


def serial_ports(root: Path = Path('/')) -> dict[str, bool]:
    """Return the serial ports by their stable names, and whether each is the system's console."""
    consoles = _read(root / 'sys/class/tty/console/active').split()
    stable = {os.path.realpath(link): str(link)
              for link in sorted((root / 'dev/serial/by-id').glob('*'))}
    ports = {}
    for name in sorted(path.parent.name for path in (root / 'sys/class/tty').glob('*/device')):
        device = str(root / 'dev' / name)
        # Linux makes ttyS0 to ttyS3 without hardware, with the type PORT_UNKNOWN.
        if os.path.exists(device) and _read(root / 'sys/class/tty' / name / 'type') != '0':
            ports[stable.get(os.path.realpath(device), device)] = name in consoles
    return ports


def unusual_rate(url: Url) -> str:
    """Return a warning of a baud rate that few devices have, such as 56700; '' for others."""
    if not isinstance(url, SerialUrl) or hasattr(termios, f'B{url.baud}'):
        return ''
    nearest = min(RATES, key=lambda rate: abs(rate - url.baud))
    return f'{url.baud} baud is unusual: is the rate of {url.device} {nearest}?'


def users_of(url: Url) -> str:
    """Return the other programs that have the port of a URL open; not those of other users."""
    targets: set[str] = set()
    if isinstance(url, SerialUrl):
        targets = {os.path.realpath(url.device)}
    elif isinstance(url, UdpUrl):
        rows = [line.split() for table in ('udp', 'udp6')
                for line in _read(Path('/proc/net', table)).splitlines()[1:]]
        targets = {f'socket:[{row[9]}]' for row in rows
                   if int(row[1].rpartition(':')[2], 16) == url.bind.port}
    # The program that has made a pseudo-terminal is its other side.
    is_pty = any(target.startswith('/dev/pts/') for target in targets)
    found = []
    for process in filter(str.isdigit, os.listdir('/proc')):
        # A process may end meanwhile, or be of another user.
        with contextlib.suppress(OSError):
            folder = f'/proc/{process}/fd/'
            files = {os.readlink(folder + link) for link in os.listdir(folder)}
            if files & targets and process != str(os.getpid()) and not (
                    is_pty and files & PTY_MAKERS):
                command = _read(Path('/proc', process, 'cmdline')).replace('\0', ' ')
                found.append(f'"{command[:MAX_COMMAND].strip()}" (process {process})')
    return ' and '.join(found)
