# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The tests of the monitor, which need textual and ROS."""

from importlib.util import find_spec

collect_ignore_glob = [] if find_spec('textual') and find_spec('rclpy') else ['test_*.py']
