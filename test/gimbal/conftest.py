# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Fixtures of the tests of nodes, where ROS is installed."""

import contextlib

with contextlib.suppress(ModuleNotFoundError):
    from support.fixtures import domain, own_ros, private_home, ros  # noqa: F401
