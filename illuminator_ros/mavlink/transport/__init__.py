# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Open channels for connection URLs: UDP, TCP, serial, pseudo-terminal and in-memory."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from .base import Channel, Peer
from .memory import open_memory
from .serial import open_pty, open_serial
from .tcp import open_tcp
from .udp import UdpChannel
from ..errors import ChannelError, InvalidValue
from ..url import AutoUrl, MemoryUrl, PtyUrl, SerialUrl, TcpUrl, UdpUrl, Url

__all__ = ['Channel', 'open_channel', 'Peer']

_OPEN: Mapping[type, Callable[[Any], Channel]] = {
    UdpUrl: UdpChannel, TcpUrl: open_tcp, SerialUrl: open_serial, PtyUrl: open_pty,
    MemoryUrl: open_memory}


def open_channel(url: Url) -> Channel:
    """
    Open a connection URL. May block for about a second, for name lookup and connecting.

    :raises ChannelError: if it cannot be opened, such as a port in use; the text says why.
    :raises InvalidValue: for ``serial://auto``, since only a :class:`~..link.Link` searches.
    """
    if isinstance(url, AutoUrl):
        raise InvalidValue('serial://auto is not one channel: only a link searches for a device')
    try:
        return _OPEN[type(url)](url)
    except OSError as error:
        raise ChannelError(*error.args) from error
