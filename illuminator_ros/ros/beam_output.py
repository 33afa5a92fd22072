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

"""``~/beam``: the light as RViz and Foxglove show it."""

from __future__ import annotations

from collections.abc import Callable
import math
import threading
from typing import Any

from rclpy.clock import Clock, ClockType
from rclpy.duration import Duration
from rclpy.node import Node

from .beam import Beam, cone, Look
from .mounting import Mounting
from .outputs import STATE_QOS
from ..illuminator.events import AnyLightEvent, LightLost, StatusReceived

# Red, green, blue.
WARM_WHITE = (1.0, 0.95, 0.75)
RED = (1.0, 0.0, 0.0)
# s between publications of a beam that does not change, and for which viewers show it without
# one: the beam of a bridge that was killed does not stay.
REFRESH = 1.0
LIFETIME = 5
# ns; a timer rings as soon as it may.
AT_ONCE = 1
# For which a bridge that ends waits until its beam has gone.
FAREWELL = Duration(seconds=0.05)
# s by which the timer rings late, since too early would be in vain: its clock is another one.
MARGIN = 0.001


class BeamOutput:
    """
    Publishes the beam of one light, from the executor of its node.

    The link's thread only tells the timer that there is something to do. Time is real time, not
    that of ``/clock``: so is the light's.

    :param clock: returns the time, s.
    """

    def __init__(self, node: Node, mounting: Mounting, clock: Callable[[], float]) -> None:
        # Here, so that it costs nobody who does not want to see the beam.
        from visualization_msgs.msg import Marker

        self._clock = clock
        self._beam = Beam()
        self._drawn = Look()
        # Guards the beam, and the timer, which one thread sets and the other starts.
        self._lock = threading.Lock()
        self._marker = _marker(Marker, mounting, node.get_name())
        self._publisher = node.create_publisher(Marker, '~/beam', STATE_QOS)
        self._timer = node.create_timer(
            REFRESH, self._draw, clock=Clock(clock_type=ClockType.STEADY_TIME), autostart=False)

    def take(self, event: AnyLightEvent) -> None:
        """Draw what an event changes."""
        with self._lock:
            if isinstance(event, StatusReceived):
                if self._beam.take(event.status, self._clock()):
                    self._ring(AT_ONCE)
            elif isinstance(event, LightLost):
                self._beam.lose()
                self._ring(AT_ONCE)

    def end(self) -> None:
        """Take the beam away, after the node's executor has ended."""
        if self._drawn.alpha:
            self._publish(Look())
            # What a publisher that ceases to exist has still under way may be lost.
            self._publisher.wait_for_all_acked(FAREWELL)

    def _ring(self, nanoseconds: int) -> None:
        self._timer.timer_period_ns = nanoseconds
        self._timer.reset()

    def _draw(self) -> None:
        with self._lock:
            now = self._clock()
            look, change = self._beam.look(now), self._beam.changes_in(now)
            if look.alpha or change < math.inf:
                self._ring(round((min(change, REFRESH) + MARGIN) * 1e9))
            else:
                self._timer.cancel()
        self._publish(look)

    def _publish(self, look: Look) -> None:
        marker = self._marker
        if look.alpha:
            marker.action = marker.ADD
            marker.color.r, marker.color.g, marker.color.b = RED if look.error else WARM_WHITE
            marker.color.a = look.alpha
        elif self._drawn.alpha:
            marker.action = marker.DELETE
        else:
            return
        self._drawn = look
        self._publisher.publish(marker)


def _marker(type_: Any, mounting: Mounting, name: str) -> Any:
    """Return what of the marker never changes."""
    from geometry_msgs.msg import Point

    marker = type_(ns=name, type=type_.TRIANGLE_LIST, frame_locked=True)
    # Without a stamp, and locked to its frame, it is drawn where the light is now.
    marker.header.frame_id = mounting.frame_id
    marker.pose.orientation.w = 1.0
    marker.scale.x = marker.scale.y = marker.scale.z = 1.0
    marker.lifetime.sec = LIFETIME
    marker.points = [Point(x=x, y=y, z=z)
                     for x, y, z in cone(mounting.beam_range, mounting.beam_angle)]
    return marker
