# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""
MAVLink for any payload: framing, commands, transports. No ROS, and nothing about lights.

Throughout, ``now`` and deadlines are s on a monotonic clock, and ``unix_time`` is s since 1970.
"""
