# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The parts that payloads share: registration, events, discovery, requests. No ROS, no I/O."""
