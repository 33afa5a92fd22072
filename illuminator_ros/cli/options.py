# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Options that the executables without ROS share."""

from __future__ import annotations

import argparse
from collections.abc import Mapping
import time

from ..mavlink.errors import KeyFileError
from ..mavlink.messages import Address
from ..mavlink.signing import Signing, SigningMode
from ..mavlink.signing_files import load_signing, TimestampStore
from ..ros.ros_home import state_folder


def address(text: str) -> Address:
    """
    Read ``SYSTEM/COMPONENT``.

    :raises ValueError: if the text is not an address.
    """
    system, slash, component = text.partition('/')
    if not (slash and system.isdecimal() and component.isdecimal()
            and 1 <= int(system) <= 255 and int(component) <= 255):
        raise ValueError(f'{text!r} is not an address such as 1/243')
    return Address(int(system), int(component))


def add_mavlink_version(parser: argparse.ArgumentParser) -> None:
    """Add the option that selects the version of the frames that are sent."""
    parser.add_argument('--mavlink-version', type=int, choices=(1, 2),
                        help='MAVLink version of sent frames; both are received (default: what '
                             'the devices need)')


def mavlink_version(chosen: int | None, needed: Mapping[str, int | None]) -> int:
    """
    Return the version of the frames that are sent.

    :param chosen: the value of the option, None without it.
    :param needed: the version that each kind of device needs, None if it takes both.
    :raises ValueError: if these versions differ.
    """
    needs = {kind: version for kind, version in needed.items() if version}
    versions = {*needs.values(), *([chosen] if chosen else [])}
    if len(versions) < 2:
        return max(versions, default=2)
    text = ', '.join(f'a {kind} needs MAVLink {version}' for kind, version in needs.items())
    raise ValueError(f'--mavlink-version {chosen}: {text}' if chosen else
                     f'{text}: a link sends one version, so start a program for each')


def add_signing(parser: argparse.ArgumentParser) -> None:
    """Add the options of message signing."""
    parser.add_argument('--signing-mode', choices=[mode.value for mode in SigningMode],
                        default='off', help='MAVLink 2 message signing (default: off)')
    parser.add_argument('--signing-key-file', default='', metavar='PATH',
                        help='signing key: 32 bytes, 64 hex digits or a passphrase')


def signing(options: argparse.Namespace, name: str) -> tuple[Signing, TimestampStore | None]:
    """
    Return the signing that the options select.

    :param name: the name under which time stamps are kept.
    :raises KeyFileError: if the key cannot be used, or is given although signing is off.
    """
    try:
        return load_signing(
            SigningMode(options.signing_mode), options.signing_key_file, name, time.time(),
            state_folder)
    except KeyFileError as error:
        raise KeyFileError(f'--signing-key-file: {error}') from None
