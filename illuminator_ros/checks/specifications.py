# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The pages of the MAVLink guide that have requirements on any component."""

from __future__ import annotations

from typing import NamedTuple


class Specification(NamedTuple):
    """A page that contains requirements."""

    title: str
    url: str


_GUIDE = 'https://mavlink.io/en/'
HEARTBEAT = Specification('heartbeat protocol', _GUIDE + 'services/heartbeat.html')
COMMAND = Specification('command protocol', _GUIDE + 'services/command.html')
MESSAGES = Specification('common message set', _GUIDE + 'messages/common.html')
ROUTING = Specification('routing', _GUIDE + 'guide/routing.html')
SERIALIZATION = Specification('serialization', _GUIDE + 'guide/serialization.html')
