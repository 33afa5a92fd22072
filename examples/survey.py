# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""A survey: an image each 10 m of flight, and a list of the places where they were taken."""

import contextlib
import csv
import math
import time
from typing import TextIO

import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data
from rclpy.task import Future
from sensor_msgs.msg import NavSatFix, NavSatStatus
from std_srvs.srv import Trigger

# Change these: the camera's node, the vehicle's position, m between images, s to wait for an
# answer, which the node gives within 5 s, and the list.
CAMERA, FIX = 'rededge', 'gps/fix'
DISTANCE = 10.0
TIMEOUT = 8.0
LIST = 'images.csv'

# m
EARTH_RADIUS = 6_371_000.0


def distance(one: NavSatFix, other: NavSatFix) -> float:
    north = math.radians(other.latitude - one.latitude)
    east = math.radians(other.longitude - one.longitude) * math.cos(math.radians(one.latitude))
    return math.hypot(north, east) * EARTH_RADIUS


class Survey(Node):

    def __init__(self, file: TextIO) -> None:
        super().__init__('survey')
        self.last: NavSatFix | None = None
        # The capture under way, and when it was requested, s.
        self.waiting: tuple[Future, float] | None = None
        self.said: dict[str, str] = {}
        self.file, self.rows = file, csv.writer(file)
        self.rows.writerow(['time_s', 'latitude_deg', 'longitude_deg', 'altitude_m'])
        self.capture = self.create_client(Trigger, f'{CAMERA}/capture')
        self.create_subscription(NavSatFix, f'{CAMERA}/image/fix', self.take_image, 10)
        self.create_subscription(NavSatFix, FIX, self.take_fix, qos_profile_sensor_data)
        self.create_timer(4.0, self.name_missing)

    def say(self, subject: str, text: str) -> None:
        """Log what is wrong once, until it changes; '' if nothing is."""
        if text and text != self.said.get(subject):
            self.get_logger().warning(text)
        self.said[subject] = text

    def name_missing(self) -> None:
        nodes = sorted(self.get_fully_qualified_node_names())
        self.say('service', '' if self.capture.service_is_ready() else (
            f'{self.capture.service_name}: no such service; nodes in the ROS domain '
            f'{self.context.get_domain_id()}: {", ".join(nodes)}'))
        self.say('fix', '' if self.count_publishers(FIX) else (
            f'{self.resolve_topic_name(FIX)}: no publisher'))
        if self.waiting is not None and time.monotonic() > self.waiting[1] + TIMEOUT:
            self.capture.remove_pending_request(self.waiting[0])
            self.fail(f'no answer for {TIMEOUT:g} s')

    def take_fix(self, fix: NavSatFix) -> None:
        near = self.last is not None and distance(self.last, fix) < DISTANCE
        has_fix = fix.status.status >= NavSatStatus.STATUS_FIX
        if has_fix and not near and not self.waiting and self.capture.service_is_ready():
            self.last = fix
            answer = self.capture.call_async(Trigger.Request())
            self.waiting = answer, time.monotonic()
            answer.add_done_callback(self.take_answer)

    def take_answer(self, answer: Future) -> None:
        if answer.result().success:
            self.waiting = None
            self.say('image', '')
        else:
            self.fail(answer.result().message)

    def fail(self, reason: str) -> None:
        self.say('image', f'no image: {reason}')
        # The next fix triggers the camera again.
        self.last = self.waiting = None

    def take_image(self, fix: NavSatFix) -> None:
        stamp = fix.header.stamp
        self.rows.writerow([f'{stamp.sec}.{stamp.nanosec // 1_000_000:03}', f'{fix.latitude:.7f}',
                            f'{fix.longitude:.7f}', f'{fix.altitude:.1f}'])
        self.file.flush()


def main() -> None:
    rclpy.init()
    with (contextlib.suppress(KeyboardInterrupt, ExternalShutdownException),
          open(LIST, 'w', newline='') as file):
        rclpy.spin(Survey(file))


if __name__ == '__main__':
    main()
