# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Messages of ROS as the feeder takes them, and jumps of ROS time."""

from __future__ import annotations

from collections.abc import Callable
import math
from typing import Any

from builtin_interfaces.msg import Time
from geometry_msgs.msg import Quaternion, Vector3
from illuminator_ros.mavlink.messages import Address
from illuminator_ros.mavlink.schedule import Schedule
from illuminator_ros.rededge.conversions import Position
from illuminator_ros.rededge.feeder import Feeder
from illuminator_ros.rededge.input_states import CameraSettings, Stamp
from illuminator_ros.rededge.ros import inputs
from illuminator_ros.rededge.ros.diagnostics import input_findings
from illuminator_ros.rededge.ros.inputs import StampReader
import pytest
from rclpy.time import Time as RosTime
from sensor_msgs.msg import Imu, NavSatFix, NavSatStatus
from std_msgs.msg import Header

EPOCH = 1_700_000_000_000_000_000


class Clock:
    """The clock of a node, and the node."""

    def __init__(self) -> None:
        self.seconds = 1_700_000_000.0
        self.ros_time_is_active = False
        self.jump: Callable[[Any], None] = lambda jump: None

    def now(self) -> RosTime:
        return RosTime(nanoseconds=round(self.seconds * 1e9))

    def get_clock(self) -> Clock:
        return self

    def create_jump_callback(self, threshold: object, *, post_callback: Any) -> object:
        self.jump = post_callback
        return object()


class Rig:

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.clock, self.steady, self.jumps = Clock(), 50.0, 0
        monkeypatch.setattr('illuminator_ros.rededge.ros.inputs.time.monotonic',
                            lambda: self.steady)
        monkeypatch.setattr('illuminator_ros.rededge.ros.inputs.time.time_ns',
                            lambda: round(self.clock.seconds * 1e9)
                            if not self.clock.ros_time_is_active else 0)
        # Any: a clock in place of a node.
        node: Any = self.clock
        self.reader = StampReader(node, self.jumped)

    def jumped(self) -> None:
        self.jumps += 1

    def run(self, seconds: float, step: float = 0.0) -> Stamp:
        """Let time pass, and step the clock; return the stamp of a message made 0.25 s ago."""
        self.steady += seconds
        self.clock.seconds += seconds + step
        made, rest = divmod(self.clock.seconds - 0.25, 1)
        return self.reader.read(Header(stamp=Time(sec=int(made), nanosec=round(rest * 1e9))))


def test_stamp_has_its_age_by_the_ros_clock(monkeypatch: pytest.MonkeyPatch) -> None:
    rig = Rig(monkeypatch)
    stamp = rig.run(1.0)
    assert (stamp.time, stamp.simulated) == (1_700_000_000_750_000_000, False)
    assert stamp.age == pytest.approx(0.25)


@pytest.mark.parametrize(('step', 'jumps'), [(0.1, 0), (-0.1, 0), (2.0, 1), (-3600.0, 1)])
def test_a_step_of_the_system_clock_is_one_jump(
        step: float, jumps: int, monkeypatch: pytest.MonkeyPatch) -> None:
    rig = Rig(monkeypatch)
    for one in (0.0, step, 0.0, 0.0):
        rig.run(1.0, one)
    assert rig.jumps == jumps


def test_simulated_time_may_run_fast_and_rclpy_tells_of_its_jumps(
        monkeypatch: pytest.MonkeyPatch) -> None:
    rig = Rig(monkeypatch)
    rig.clock.ros_time_is_active = True
    stamp = rig.run(1.0, 9.0)
    assert stamp.simulated
    assert stamp.age == pytest.approx(0.25)
    rig.run(1.0, 9.0)
    assert rig.jumps == 0
    rig.clock.jump(None)
    assert rig.jumps == 1


def test_messages_tell_what_they_do_not_know() -> None:
    unknown = NavSatFix(status=NavSatStatus(status=1), latitude=1.0, longitude=2.0, altitude=3.0)
    known = NavSatFix(position_covariance=[4.0, 0, 0, 0, 9.0, 0, 0, 0, 16.0],
                      position_covariance_type=NavSatFix.COVARIANCE_TYPE_DIAGONAL_KNOWN)
    position = inputs.position(unknown)
    assert math.isnan(position.horizontal)
    assert (position.status, position.latitude, position.longitude, position.altitude) == (
        1, 1.0, 2.0, 3.0)
    assert isinstance(position, Position)
    assert inputs.position(known).horizontal == 3.0

    absent = [-1.0, *[0.0] * 8]
    turned = Imu(orientation=Quaternion(w=0.0, x=1.0, y=0.0, z=0.0),
                 angular_velocity=Vector3(x=1.0, y=2.0, z=3.0))
    orientation, rates = inputs.orientation_and_rates(turned)
    assert orientation is not None
    assert (orientation.x, rates) == (1.0, (1.0, 2.0, 3.0))
    turned.orientation_covariance = turned.angular_velocity_covariance = absent
    orientation, rates = inputs.orientation_and_rates(turned)
    assert orientation is None
    assert math.isnan(rates[0])


def test_an_input_most_of_whose_messages_are_refused_is_a_warning_with_the_reason() -> None:
    feeder = Feeder(CameraSettings(), lambda message: None, lambda: Address(1, 100),
                    Schedule())
    here = Position(0, 47.0, 8.0, 500.0)
    for refused in range(9):
        feeder.receive_fix(here, Stamp(EPOCH, 0.0), 0.0)
        found = [text for _, text in input_findings(feeder.snapshot(0.0), {}) if '~/fix' in text]
        assert found == ([] if refused < 6 else [
            f'~/fix: {refused} of the last 10 messages were refused: its stamp is not newer than '
            'the last, since its stamps are whole seconds'])
