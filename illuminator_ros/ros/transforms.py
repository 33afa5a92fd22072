# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0


"""Frames on /tf and /tf_static, where ``tf2_msgs`` is installed."""

from __future__ import annotations

from builtin_interfaces.msg import Time
from geometry_msgs.msg import Quaternion as QuaternionMessage
from geometry_msgs.msg import Transform, TransformStamped
from rclpy.node import Node
from rclpy.qos import QoSProfile
from std_msgs.msg import Header

from .parameters import ParameterSpec, Values
from .qos import STATE_QOS
from .throttled_log import NodeLog
from ..geometry.rotation import Quaternion

PUBLISH_TF = ParameterSpec('publish_tf', False, 'publish frames on /tf and /tf_static')
# As tf2_ros has it.
TF_QOS = QoSProfile(depth=100)


class TransformPublisher:
    """
    Publishes the rotations of frames; their origins are those of their parents.

    :raises ImportError: if ``tf2_msgs`` is not installed.
    """

    def __init__(self, node: Node) -> None:
        from tf2_msgs.msg import TFMessage

        self._type = TFMessage
        self._clock = node.get_clock()
        self._moving = node.create_publisher(TFMessage, '/tf', TF_QOS)
        self._static = node.create_publisher(TFMessage, '/tf_static', STATE_QOS)
        self._fixed: dict[str, TransformStamped] = {}

    @classmethod
    def of(cls, node: Node, values: Values, log: NodeLog) -> TransformPublisher | None:
        """Return the publisher if parameters ask for it; None otherwise, or if it cannot work."""
        if not values[PUBLISH_TF.name]:
            return None
        try:
            return cls(node)
        except ImportError:
            log.warning('publish_tf: tf2_msgs is not installed, so no frame is published: '
                        'sudo apt install ros-jazzy-tf2-msgs')
            return None

    def move(self, parent: str, child: str, rotation: Quaternion, stamp: Time | None = None,
             ) -> None:
        """Publish the rotation of a frame now, or at another time."""
        self._moving.publish(self._type(
            transforms=[self._transform(parent, child, rotation, stamp)]))

    def fix(self, parent: str, child: str, rotation: Quaternion) -> None:
        """Publish the rotation of a frame that does not move."""
        self._fixed[child] = self._transform(parent, child, rotation, None)
        # A late subscriber gets the last message only.
        self._static.publish(self._type(transforms=[*self._fixed.values()]))

    def _transform(
        self, parent: str, child: str, rotation: Quaternion, stamp: Time | None,
    ) -> TransformStamped:
        return TransformStamped(
            header=Header(stamp=stamp or self._clock.now().to_msg(), frame_id=parent),
            child_frame_id=child, transform=Transform(rotation=QuaternionMessage(
                x=rotation.x, y=rotation.y, z=rotation.z, w=rotation.w)))
