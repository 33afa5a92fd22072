# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The executor of the bridge: rclpy's EventsExecutor, or the older one."""

import sys

import pytest
from support.embedded import embedded_bridge
from support.light import ServedLight
from support.ros import Parameters, Ros


def test_bridge_serves_with_the_older_executor_where_rclpy_has_no_events_executor(
    own_ros: Ros, port: int, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str],
) -> None:
    # An import of it fails then.
    monkeypatch.setitem(sys.modules, 'rclpy.experimental', None)

    with embedded_bridge(own_ros.domain, port), ServedLight(port):
        parameters = Parameters(own_ros)
        parameters.wait(mode='internal_control')

        assert own_ros.enable().success
        assert parameters.set(brightness=20.0)[0].successful

    assert 'has no EventsExecutor' in ''.join(capfd.readouterr())
