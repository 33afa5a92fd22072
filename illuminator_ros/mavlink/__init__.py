# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""
MAVLink for any payload: framing, commands, transports. No ROS, and nothing about lights.

Throughout, ``now`` and deadlines are s on a monotonic clock, and ``unix_time`` is s since 1970.

The names of ``__all__`` are public; all else is internal and may change with each version.
"""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from .command_sender import CommandSender
    from .component import Component, Payload
    from .device_kind import DeviceKind
    from .dialect import mavlink, register
    from .errors import (
        ChannelError,
        ChannelLost,
        InvalidValue,
        KeyFileError,
        LinkThreadError,
        MavlinkError,
        UrlError,
    )
    from .link import Link
    from .link_state import LinkEvent
    from .messages import Address, AnyCommand, Heartbeat, Message
    from .signing import SigningMode
    from .signing_files import load_signing
    from .transport import Channel, open_channel
    from .url import parse_url
else:
    from .. import lazy_exports
    __getattr__ = lazy_exports(__name__, {
        'command_sender': ['CommandSender'],
        'component': ['Component', 'Payload'],
        'device_kind': ['DeviceKind'],
        'dialect': ['mavlink', 'register'],
        'errors': [
            'ChannelError', 'ChannelLost', 'InvalidValue', 'KeyFileError', 'LinkThreadError',
            'MavlinkError', 'UrlError'],
        'link': ['Link'],
        'link_state': ['LinkEvent'],
        'messages': ['Address', 'AnyCommand', 'Heartbeat', 'Message'],
        'signing': ['SigningMode'],
        'signing_files': ['load_signing'],
        'transport': ['Channel', 'open_channel'],
        'url': ['parse_url'],
    })

__all__ = [
    'Address', 'AnyCommand', 'Channel', 'ChannelError', 'ChannelLost', 'CommandSender',
    'Component', 'DeviceKind', 'Heartbeat', 'InvalidValue', 'KeyFileError', 'Link', 'LinkEvent',
    'LinkThreadError', 'load_signing', 'mavlink', 'MavlinkError', 'Message', 'open_channel',
    'parse_url', 'Payload', 'register', 'SigningMode', 'UrlError']
