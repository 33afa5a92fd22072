# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""
The MAVLink illuminator protocol, both sides. No ROS, no sockets, no clock.

Throughout, ``now`` and deadlines are s on a monotonic clock.
https://mavlink.io/en/services/illuminator.html

The names of ``__all__`` are public; all else is internal and may change with each version.
"""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from .client import IlluminatorClient
    from .settings import LightSettings
else:
    from .. import lazy_exports
    __getattr__ = lazy_exports(__name__, {
        'client': ['IlluminatorClient'],
        'settings': ['LightSettings'],
    })

__all__ = [
    'IlluminatorClient', 'LightSettings']
