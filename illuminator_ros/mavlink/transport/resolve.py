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

"""Socket addresses for host names, both IP versions."""

from __future__ import annotations

import socket
from typing import Any

from ..url import HostPort


def resolve(address: HostPort, kind: socket.SocketKind) -> list[tuple[int, Any]]:
    """
    Return families and socket addresses; IPv4 first, since most MAVLink programs know only that.

    :param address: an empty host means all IPv4 interfaces.
    :raises OSError: if the name cannot be resolved.
    """
    try:
        found = socket.getaddrinfo(address.host or '0.0.0.0', address.port, type=kind)
    except (socket.gaierror, UnicodeError) as error:
        reason = getattr(error, 'strerror', None) or 'not a host name'
        raise OSError(f'cannot resolve {address.host!r}: {reason}') from None
    found.sort(key=lambda entry: entry[0] != socket.AF_INET)
    return [(family, sockaddr) for family, _, _, _, sockaddr in found]
