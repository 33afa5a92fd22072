# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Rotations, and the attitudes of mounts in ROS and in MAVLink. No ROS, no I/O."""
