# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Fixtures of tests with ROS: whole programs, as they are installed and run."""

from support.fixtures import *  # noqa: F401, F403
