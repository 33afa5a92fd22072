# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The subscribed topics: conversion of their messages for the feeder, and jumps of ROS time."""

from __future__ import annotations

from collections.abc import Callable, Iterable
import functools
import math
import time
from typing import Any

from geometry_msgs.msg import QuaternionStamped, TwistStamped, TwistWithCovarianceStamped
from nav_msgs.msg import Odometry
from rclpy.clock import JumpThreshold
from rclpy.duration import Duration
from rclpy.node import Node
from sensor_msgs.msg import Imu, NavSatFix, TimeReference
from std_msgs.msg import Header, UInt32

from ..conversions import Position, standard_deviations
from ..feeder import Feeder
from ..input_states import Input, Stamp, UNKNOWN
from ...geometry.rotation import Quaternion, Vector
from ...mavlink.link import Link
from ...ros.conversions import NO_VALUE, read_orientation, read_quaternion, read_vector
from ...ros.node import AnyCommandTopic, CommandTopic, Entity

# s; a greater change relative to a steady clock is a jump. Simulated time may run fast and in
# steps, so its limit is higher.
JUMP = 0.5
SIMULATED_JUMP = 5.0


TOPICS = {
    name: Entity(name.value, type_, meaning) for name, type_, meaning in (
        (Input.FIX, NavSatFix,
         'required: position; its altitude is above the WGS84 ellipsoid'),
        (Input.VELOCITY, TwistStamped,
         'velocity of the vehicle, ENU; one is required with `position_source: fused` only'),
        (Input.VELOCITY_WITH_COVARIANCE, TwistWithCovarianceStamped,
         'the same, used while no `~/velocity` comes'),
        (Input.ODOMETRY, Odometry, 'its velocity, used while neither of these comes; its pose is '
         'in ENU, its twist in the axes of the body. Its position is not used'),
        (Input.SATELLITES, UInt32, 'number of satellites'),
        (Input.IMU, Imu, 'required, or `~/attitude`: orientation of `base_link` (FLU) in ENU, and '
         'its rates'),
        (Input.ATTITUDE, QuaternionStamped,
         'the same orientation, used while no `~/imu` comes'),
        (Input.MOUNT, QuaternionStamped, 'for a camera on a gimbal: its orientation in the frame '
         'of `frame_id`'),
        (Input.TIME_REFERENCE, TimeReference, 'UTC, where ROS time is not UTC'))}


class StampReader:
    """
    Reads stamps with their age by the node's clock.

    :param jumped: called when ROS time has jumped, in any thread.
    """

    def __init__(self, node: Node, jumped: Callable[[], None]) -> None:
        # Untyped: rclpy types it as a Clock, which lacks ``ros_time_is_active``.
        self._clock: Any = node.get_clock()
        self._jumped = jumped
        # The system time minus the time of a steady clock, s.
        self._offset: float | None = None
        # rclpy reports jumps of simulated time only. The handle keeps the callback.
        self._handle = self._clock.create_jump_callback(
            JumpThreshold(min_forward=Duration(seconds=SIMULATED_JUMP),
                          min_backward=Duration(nanoseconds=-1), on_clock_change=True),
            post_callback=lambda jump: jumped())

    def read(self, header: Header) -> Stamp:
        """Return the stamp of a message that was received just now."""
        simulated = self._clock.ros_time_is_active
        now = self._clock.now().nanoseconds
        if not simulated:
            offset = now / 1e9 - time.monotonic()
            if self._offset is not None and abs(offset - self._offset) > JUMP:
                self._jumped()
            self._offset = offset
        stamp = header.stamp.sec * 1_000_000_000 + header.stamp.nanosec
        return Stamp(stamp, (now - stamp) / 1e9, simulated)


def position(message: NavSatFix) -> Position:
    """Return the position, with NaN for deviations that are not known."""
    horizontal = vertical = math.nan
    if message.position_covariance_type != NavSatFix.COVARIANCE_TYPE_UNKNOWN:
        horizontal, vertical = standard_deviations(message.position_covariance)
    return Position(message.status.status, message.latitude, message.longitude, message.altitude,
                    horizontal, vertical)


def orientation_and_rates(message: Imu) -> tuple[Quaternion | None, Vector]:
    """Return orientation and body rates: None and NaN where the message has none."""
    return read_orientation(message), (
        UNKNOWN if message.angular_velocity_covariance[0] == NO_VALUE
        else read_vector(message.angular_velocity))


def subscriptions(node: Node, link: Link, feeder: Feeder) -> Iterable[AnyCommandTopic]:
    """Return the subscribed topics, which the feeder takes in the link's thread."""
    reader = StampReader(node, lambda: link.call(lambda now: feeder.clock_jumped()))

    def topic(
        name: Input, values: Callable[[Any], tuple[object, ...]], receive: Callable[..., None],
    ) -> AnyCommandTopic:
        def read(message: Any) -> tuple[object, ...]:
            return *values(message), reader.read(message.header)

        return CommandTopic(TOPICS[name], lambda received, now: receive(*received, now), read)

    return (
        topic(Input.FIX, lambda one: (position(one),), feeder.receive_fix),
        topic(Input.VELOCITY, lambda one: (read_vector(one.twist.linear),),
              functools.partial(feeder.receive_velocity, Input.VELOCITY)),
        topic(Input.VELOCITY_WITH_COVARIANCE, lambda one: (read_vector(one.twist.twist.linear),),
              functools.partial(feeder.receive_velocity, Input.VELOCITY_WITH_COVARIANCE)),
        topic(Input.ODOMETRY, lambda one: (
                  read_vector(one.twist.twist.linear), read_quaternion(one.pose.pose.orientation)),
              lambda velocity, body, stamp, now: feeder.receive_velocity(
                  Input.ODOMETRY, velocity, stamp, now, body)),
        CommandTopic(TOPICS[Input.SATELLITES], feeder.receive_satellites),
        topic(Input.IMU, orientation_and_rates,
              functools.partial(feeder.orientation.receive_attitude, Input.IMU)),
        topic(Input.ATTITUDE, lambda one: (read_quaternion(one.quaternion), UNKNOWN),
              functools.partial(feeder.orientation.receive_attitude, Input.ATTITUDE)),
        topic(Input.MOUNT,
              lambda one: (read_quaternion(one.quaternion), one.header.frame_id),
              feeder.orientation.receive_mount),
        topic(Input.TIME_REFERENCE,
              lambda one: (one.time_ref.sec * 1_000_000_000 + one.time_ref.nanosec,),
              feeder.receive_time_reference),
    )
