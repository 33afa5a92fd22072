# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Fixtures of tests with ROS: the real node, over real UDP, in a domain of its own."""

from support.fixtures import *  # noqa: F401, F403
