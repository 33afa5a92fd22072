# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""
The rclpy shell around the protocol: nodes, parameters, diagnostics, conversions.

The names of ``__all__``, and those of ``monitor_view``, are public; all else is internal and may
change with each version.
"""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from .node import CommandTopic, Entity, NodeEntities, SWITCH_QOS
    from .parameters import ParameterError, ParameterSpec
    from .payload import BridgeContext, RosPayload, ServedPayload
else:
    from .. import lazy_exports
    __getattr__ = lazy_exports(__name__, {
        'node': ['CommandTopic', 'Entity', 'NodeEntities', 'SWITCH_QOS'],
        'parameters': ['ParameterError', 'ParameterSpec'],
        'payload': ['BridgeContext', 'RosPayload', 'ServedPayload'],
    })

__all__ = [
    'BridgeContext', 'CommandTopic', 'Entity', 'NodeEntities', 'ParameterError', 'ParameterSpec',
    'RosPayload', 'ServedPayload', 'SWITCH_QOS']
