# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Open channels for connection URLs: UDP, TCP, serial, pseudo-terminal and in-memory."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from .base import Channel, ChannelLost, Peer
from .memory import open_memory
from .serial import open_pty, open_serial
from .tcp import open_tcp
from .udp import UdpChannel
from ..url import MemoryUrl, PtyUrl, SerialUrl, TcpUrl, UdpUrl, Url

__all__ = ['Channel', 'ChannelLost', 'open_channel', 'Peer']

_OPEN: Mapping[type, Callable[[Any], Channel]] = {
    UdpUrl: UdpChannel, TcpUrl: open_tcp, SerialUrl: open_serial, PtyUrl: open_pty,
    MemoryUrl: open_memory}


def open_channel(url: Url) -> Channel:
    """
    Open a connection URL. May block for about a second, for name lookup and connecting.

    :raises OSError: if it cannot be opened; the text says why.
    """
    return _OPEN[type(url)](url)
