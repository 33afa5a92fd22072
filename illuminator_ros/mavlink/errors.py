# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""
The exceptions that users of the package may catch; all derive from :class:`MavlinkError`.

Each also has the builtin class of its kind, such as :class:`ValueError`. The message is for
people: it names what is wrong, and says why.
"""

from __future__ import annotations


class MavlinkError(Exception):
    """The base of all exceptions of this package that users may catch."""


class UrlError(MavlinkError, ValueError):
    """A wrong connection URL; the message quotes the URL and its wrong part."""


class InvalidValue(MavlinkError, ValueError):
    """A value, such as a setting, that is out of its range or contradicts another one."""


class KeyFileError(MavlinkError, ValueError):
    """A key file that cannot be used; the message names the file and says why, never the key."""


class ChannelError(MavlinkError, OSError):
    """A channel that cannot be opened, such as a port in use; ``errno`` may be None."""


class ChannelLost(ChannelError):
    """The other side or the device has gone; the channel must be closed."""


class LinkThreadError(MavlinkError, RuntimeError):
    """The thread of a link cannot be started; the message names the link and says why."""
