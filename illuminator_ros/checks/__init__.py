# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""
Conformance checks of any payload: a session with one device, requirements, a run, a report.

No I/O and no ROS: an executable runs the session over a link.
"""
