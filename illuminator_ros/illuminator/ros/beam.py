# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""``~/beam``: a cone as RViz and Foxglove show it, as opaque as the light is bright."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
import math
import time

from rclpy.node import Node

from .parameters import BeamGeometry
from ..events import LightEvent, StatusReceived
from ..model import Mode, Status
from ...geometry.rotation import Quaternion
from ...payload.device_events import DeviceDisconnected
from ...ros.node import Entity
from ...ros.qos import STATE_QOS
from ...ros.transforms import TransformPublisher

Point = tuple[float, float, float]

# Triangles of a cone, so that it looks round.
SIDES = 24
# Opacity at 100 % brightness: objects in the beam must stay visible.
MAX_ALPHA = 0.5
# Red, green, blue.
WARM_WHITE = (1.0, 0.95, 0.75)
RED = (1.0, 0.0, 0.0)
# s between publications of an unchanged beam, and until viewers remove a beam, so that the beam
# of a killed bridge disappears.
REFRESH = 1.0
LIFETIME = 5
# s between publications of a beam that a gimbal turns.
MOVE_INTERVAL = 0.1


def beam_topic() -> Entity:
    """Return the topic; its type is imported only where the beam is shown."""
    from visualization_msgs.msg import Marker

    return Entity(
        'beam', Marker, 'only with `beam_range`: [the beam](beam.md), for RViz and Foxglove')


def cone(length: float, angle: float) -> list[Point]:
    """
    Return the corners of the triangles, three for each, that a cone around +x consists of.

    Its apex is the origin. Seen from outside the corners run counter-clockwise. It has no base:
    the light does not end there.

    :param length: along x, m.
    :param angle: the full opening angle, rad, less than pi.
    """
    radius = length * math.tan(angle / 2)
    rim = [(length, radius * math.cos(turn), radius * math.sin(turn))
           for turn in (2 * math.pi * side / SIDES for side in range(SIDES))]
    corners: list[Point] = []
    for side in range(SIDES):
        corners += (0.0, 0.0, 0.0), rim[(side + 1) % SIDES], rim[side]
    return corners


@dataclass(frozen=True)
class Beam:
    """
    The appearance of a beam, from the last plausible value of each field of the statuses.

    :param brightness: %.
    :param duty_cycle: % of the time in which it is lit, 100 without a strobe.
    """

    on: bool = False
    brightness: float = 100.0
    duty_cycle: float = 100.0
    error: bool = False

    def updated(self, status: Status) -> Beam:
        """Return the beam after a status."""
        period, duty = status.strobe_period, status.strobe_duty_cycle
        if status.mode is Mode.EXTERNAL_SYNC or period == 0:
            # Under external sync another signal controls the strobe.
            duty = 100.0
        elif not (period and duty):
            duty = self.duty_cycle
        return Beam(self.on if status.enabled is None else status.enabled,
                    self.brightness if status.brightness is None else status.brightness,
                    duty, bool(status.error_flags))

    @property
    def alpha(self) -> float:
        """
        Return the opacity, 0 for no beam.

        A strobe is drawn steady, as bright as it is on average: viewers draw 30 to 60 pictures
        a second, and the moment of a flash is not known.
        """
        return MAX_ALPHA * self.brightness / 100 * self.duty_cycle / 100 if self.on else 0.0


class BeamFrame:
    """
    Publishes the frame of a beam, which has the beam along +x, in the link's thread.

    :param direction: as of :class:`BeamPublisher`.
    """

    def __init__(
        self, transforms: TransformPublisher, geometry: BeamGeometry, name: str,
        direction: Callable[[int], Quaternion | None],
    ) -> None:
        self._transforms = transforms
        self._parent = geometry.frame_id
        self._name = name
        self._mounted_on = geometry.mounted_on
        self._direction = direction
        # Whether the frame is static; None until a status shows that.
        self._is_fixed: bool | None = None
        self._device_id = 0

    def handle(self, event: LightEvent) -> None:
        """Take an event of the light."""
        if isinstance(event, StatusReceived) and self._is_fixed is None:
            self._device_id = self._mounted_on or event.status.gimbal_device_id
            self._is_fixed = not self._device_id
            if self._is_fixed:
                self._transforms.fix(self._parent, self._name, Quaternion())

    def mount_moved(self) -> None:
        """Publish the direction: a gimbal has sent its attitude."""
        if self._device_id and (rotation := self._direction(self._device_id)):
            self._transforms.move(self._parent, self._name, rotation)


class BeamPublisher:
    """
    Publishes the beam of one light, in the link's thread.

    :param direction: returns the rotation of a gimbal, given its gimbal device id, relative to
        the vehicle; None if it is not known.
    :ivar device_id: gimbal device id of the gimbal that turns it, 0 for none.
    """

    def __init__(
        self, node: Node, geometry: BeamGeometry,
        direction: Callable[[int], Quaternion | None] = lambda device_id: None,
    ) -> None:
        # Imported only where the beam is shown.
        from geometry_msgs.msg import Point as PointMessage

        topic = beam_topic()
        self._publisher = node.create_publisher(topic.type, f'~/{topic.name}', STATE_QOS)
        self._beam = Beam()
        self._due = math.inf
        self._mounted_on = self.device_id = geometry.mounted_on
        self._direction = direction
        # The rotation that was published last, and the time of that, s.
        self._rotation: Quaternion | None = Quaternion()
        self._published_at = -math.inf
        self._marker = marker = topic.type(
            ns=node.get_name(), type=topic.type.TRIANGLE_LIST, frame_locked=True)
        # Without a stamp, and locked to its frame, the beam is drawn where the light is now.
        marker.header.frame_id = geometry.frame_id
        marker.scale.x = marker.scale.y = marker.scale.z = 1.0
        marker.lifetime.sec = LIFETIME
        marker.points = [PointMessage(x=x, y=y, z=z)
                         for x, y, z in cone(geometry.beam_range, geometry.beam_angle)]

    def handle(self, event: LightEvent) -> None:
        """Take an event of the light."""
        if isinstance(event, StatusReceived):
            self.device_id = self._mounted_on or event.status.gimbal_device_id
            self._show(self._beam.updated(event.status))
        elif isinstance(event, DeviceDisconnected):
            self._show(replace(self._beam, on=False))

    def poll(self) -> None:
        """Publish the beam again if that is due, or if a gimbal has turned it."""
        if time.monotonic() >= self._due:
            self._publish()
        else:
            self.mount_moved()

    def mount_moved(self) -> None:
        """Publish the beam if it is visible and its direction has changed."""
        if (self._beam.alpha and time.monotonic() >= self._published_at + MOVE_INTERVAL
                and self._current_rotation() != self._rotation):
            self._publish()

    def _current_rotation(self) -> Quaternion | None:
        return self._direction(self.device_id) if self.device_id else Quaternion()

    def close(self) -> None:
        """Remove the beam, after the link's thread has ended."""
        self._show(replace(self._beam, on=False))

    def _show(self, beam: Beam) -> None:
        before, self._beam = self._beam, beam
        if beam != before and (beam.alpha or before.alpha):
            self._publish()

    def _publish(self) -> None:
        self._rotation = rotation = self._current_rotation()
        # A beam in a wrong direction is worse than none.
        marker, alpha = self._marker, self._beam.alpha if rotation else 0.0
        self._published_at = time.monotonic()
        # In real time, as viewers measure the lifetime.
        self._due = self._published_at + REFRESH if alpha else math.inf
        marker.action = marker.ADD if alpha else marker.DELETE
        marker.color.r, marker.color.g, marker.color.b = RED if self._beam.error else WARM_WHITE
        marker.color.a = alpha
        if rotation is not None:
            orientation = marker.pose.orientation
            orientation.x, orientation.y = rotation.x, rotation.y
            orientation.z, orientation.w = rotation.z, rotation.w
        self._publisher.publish(marker)
