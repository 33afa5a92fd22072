# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""
Simulated components: settings, faults, acknowledgements and streams. No ROS, no I/O.

The names of ``__all__`` are public; all else is internal and may change with each version.
"""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from .faults import Behaviour, FaultError
    from .simulated import (
        CommandReply,
        Properties,
        Reply,
        Report,
        SimulatedDevice,
        SimulatedType,
        Snapshot,
    )
else:
    from .. import lazy_exports
    __getattr__ = lazy_exports(__name__, {
        'faults': ['Behaviour', 'FaultError'],
        'simulated': [
            'CommandReply', 'Properties', 'Reply', 'Report', 'SimulatedDevice', 'SimulatedType',
            'Snapshot'],
    })

__all__ = [
    'Behaviour', 'CommandReply', 'FaultError', 'Properties', 'Reply', 'Report', 'SimulatedDevice',
    'SimulatedType', 'Snapshot']
