# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""
The MAVLink illuminator protocol, both sides. No ROS, no sockets, no clock.

Throughout, ``now`` and deadlines are s on a monotonic clock.
https://mavlink.io/en/services/illuminator.html
"""
