# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""
The parts that payloads share: registration, events, discovery, requests. No ROS, no I/O.

The names of ``__all__`` are public; all else is internal and may change with each version.
"""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from .attempt import Change, Sending, Served, Target
    from .device_property import plan_of, Property
    from .discovery import Discovery
    from .listeners import Listeners
    from .liveness import Liveness
    from .payload_type import PayloadType
    from .requests import Done, Goal, Request, Requests, Result, Why
else:
    from .. import lazy_exports
    __getattr__ = lazy_exports(__name__, {
        'attempt': ['Change', 'Sending', 'Served', 'Target'],
        'device_property': ['plan_of', 'Property'],
        'discovery': ['Discovery'],
        'listeners': ['Listeners'],
        'liveness': ['Liveness'],
        'payload_type': ['PayloadType'],
        'requests': ['Done', 'Goal', 'Request', 'Requests', 'Result', 'Why'],
    })

__all__ = [
    'Change', 'Discovery', 'Done', 'Goal', 'Listeners', 'Liveness', 'PayloadType', 'plan_of',
    'Property', 'Request', 'Requests', 'Result', 'Sending', 'Served', 'Target', 'Why']
