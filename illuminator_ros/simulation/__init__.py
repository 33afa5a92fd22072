# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Simulated components: settings, faults, acknowledgements and streams. No ROS, no I/O."""
