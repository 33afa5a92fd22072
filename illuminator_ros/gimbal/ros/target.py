# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Where a gimbal is asked to point, and whether it shows that: topics, and the line of sight."""

from __future__ import annotations

import math
from typing import Any

from geometry_msgs.msg import Vector3
from rclpy.node import Node
from sensor_msgs.msg import NavSatFix, NavSatStatus
from std_msgs.msg import Bool, ColorRGBA, Header

from .diagnostics import attitude_limit
from ..client import GimbalClient
from ..commands import Move
from ..gimbal import Gimbal
from ..pointing import NOTHING, off_target, Seen
from ...payload.messages import GeoPoint
from ...ros.conversions import GEOID_SEPARATION
from ...ros.node import Entity, NodeEntities
from ...ros.parameters import given_parameters, ParameterSpec
from ...ros.payload import BridgeContext
from ...ros.qos import STATE_QOS

TARGET_TOLERANCE = ParameterSpec(
    'target_tolerance', 2.0, 'angle within which ~/on_target is true', 'degrees', 0.1, 180.0)
ON_TARGET = Entity(
    'on_target', Bool, 'the newest attitude [shows](#point-at-a-place) what this node has asked '
    'for')
ROI = Entity(
    'roi', NavSatFix, 'the place that this node has asked for; STATUS_NO_FIX and NaN for none')
# m; the length of the line of sight, and its thickness.
LENGTH, WIDTH = 100.0, 0.1
GREEN, YELLOW = ColorRGBA(g=1.0, a=1.0), ColorRGBA(r=1.0, g=0.8, a=1.0)


class TargetPublisher:
    """
    Publishes the target of the gimbal of a node; for the link's thread.

    :param frame: of the gimbal, '' where none is published.
    :ivar geoid_is_known: whether ``geoid_separation`` is set.
    :ivar off_target: why the gimbal is not on target, for people; '' if it is.
    """

    def __init__(
        self, node: Node, entities: NodeEntities, client: GimbalClient, context: BridgeContext,
        frame: str,
    ) -> None:
        self.off_target = NOTHING
        self.geoid_is_known = GEOID_SEPARATION.name in given_parameters(context.node)
        self._clock = node.get_clock()
        self._entities = entities
        self._client = client
        self._tolerance = math.radians(context.values[TARGET_TOLERANCE.name])
        self._separation: float = context.values[GEOID_SEPARATION.name]
        self._move: Move = None
        self._asked_at = 0.0
        self._marker: Any = None
        if frame:
            # Imported only where frames are published.
            from visualization_msgs.msg import Marker

            self._lines = node.create_publisher(Marker, '~/line_of_sight', STATE_QOS)
            self._marker = Marker(
                header=Header(frame_id=frame), ns=frame, type=Marker.ARROW, frame_locked=True,
                scale=Vector3(x=LENGTH, y=WIDTH, z=WIDTH))
        self._publish()

    def update(self, gimbal: Gimbal | None, now: float) -> None:
        """Publish what has changed."""
        before = bool(self.off_target), self._place
        move = gimbal.wanted_move if gimbal else None
        if move != self._move:
            self._move, self._asked_at = move, now
        self.off_target = self._reason(gimbal, now) if gimbal else NOTHING
        if (bool(self.off_target), self._place) != before:
            self._publish()

    @property
    def _place(self) -> GeoPoint | None:
        return self._move if isinstance(self._move, GeoPoint) else None

    def _reason(self, gimbal: Gimbal, now: float) -> str:
        if reason := gimbal.reports.lack_of_control(now):
            return reason
        device, vehicle = gimbal.reports.device, self._client.vehicle(gimbal.key)
        # The position on the link is above mean sea level, one of ROS above the ellipsoid.
        if self._place and not self.geoid_is_known and not vehicle.position.is_of_ros(now):
            return 'geoid_separation is not set'
        is_known = self._client.is_measured(now) and now - device.attitude_at <= attitude_limit(
            self._client.settings.attitude_interval)
        return off_target(self._move, Seen(
            device.attitude if is_known else None, device.flags,
            gimbal.setpoints.rate_stop.turns, vehicle.position.get(now), vehicle.heading(now),
            now - self._asked_at), self._tolerance)

    def _publish(self) -> None:
        place = self._place
        latitude, longitude, altitude = place or (math.nan,) * 3
        # First, so that a subscriber that sees a new place does not see the old value.
        self._entities.publish(ON_TARGET.name, not self.off_target)
        self._entities.publish(ROI.name, NavSatFix(
            header=Header(stamp=self._clock.now().to_msg()),
            status=NavSatStatus(status=NavSatStatus.STATUS_FIX if place else
                                NavSatStatus.STATUS_NO_FIX),
            latitude=latitude, longitude=longitude, altitude=altitude + self._separation))
        if self._marker is not None:
            self._marker.color = YELLOW if self.off_target else GREEN
            self._lines.publish(self._marker)
