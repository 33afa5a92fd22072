# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""MAVSDK's Gimbal plugin as player of our manager, and beside our client at a simulated one."""

from __future__ import annotations

from collections.abc import Callable, Iterator
import contextlib
import math
from typing import Any, TypeVar

from illuminator_ros.geometry.mount_attitude import to_mavlink, YawFrame
from illuminator_ros.geometry.rotation import Quaternion, Vector
from illuminator_ros.gimbal.client import GimbalClient
from illuminator_ros.gimbal.commands import Attitude, Rates
from illuminator_ros.gimbal.events import ControlChanged
from illuminator_ros.gimbal.gimbal import Gimbal, GimbalSettings
from illuminator_ros.gimbal.manager_control import ControlSettings, Role
from illuminator_ros.gimbal.messages import DEVICE_ID_PARAM
from illuminator_ros.gimbal.simulated_device import SimulatedGimbal
from illuminator_ros.gimbal.simulated_manager import ManagerProperties, SimulatedManager
from illuminator_ros.mavlink.command_sender import CommandSender
from illuminator_ros.mavlink.component import Component, Endpoint
from illuminator_ros.mavlink.dialect import mavlink
from illuminator_ros.mavlink.messages import Address
from illuminator_ros.payload.requests import Result
from illuminator_ros.simulation.simulated import SimulatedComponents
import pytest
from support.gimbal_vehicle import Autopilot, HERE, managed_vehicle, Vehicle
from support.gimbals import setpoint
from support.live_link import EndpointLink
from support.mavsdk_peer import DENIED, player, plugin, result
from support.ports import free_port
from support.waiting import eventually

OURS, FIRST, SECOND, DEVICE = (
    Address(1, 193), Address(1, 195), Address(1, 196), Address(1, 154))
GIMBAL = 1
# s; MAVSDK uses the clock of the machine, which may pause between two heartbeats.
LEASE = 60.0
T = TypeVar('T')


@contextlib.contextmanager
def served(endpoint: Endpoint) -> Iterator[int]:
    """Serve an endpoint to UDP peers, and yield the port."""
    port = free_port()
    with EndpointLink(f'udpin://127.0.0.1:{port}', endpoint):
        yield port


def points_to(device: SimulatedGimbal, pitch: float, yaw: float) -> Callable[[], bool]:
    """Return a condition: the gimbal has these angles relative to the vehicle, deg."""
    return lambda: all(
        abs(math.degrees(angle) - asked) < 0.5
        for angle, asked in zip(device.motion.angles[1:], (pitch, yaw), strict=True))


def turns(device: SimulatedGimbal) -> Callable[[], bool]:
    """Return a condition: the gimbal has turned up by a degree since this call."""
    before = device.motion.angles[1]
    return lambda: device.motion.angles[1] > before + math.radians(1)


@pytest.mark.timeout(180)
def test_mavsdk_lists_controls_and_releases_and_a_second_one_is_denied() -> None:
    manager, device, vehicle = managed_vehicle(ControlSettings(lease=LEASE), 0.0)
    with served(vehicle) as port, player(FIRST, port) as gimbal, player(SECOND, port) as second:
        [item] = gimbal.gimbal_list().gimbals
        assert (item.gimbal_device_id, item.gimbal_manager_component_id) == (154, 193)
        assert item.model_name == 'simulator'
        follow, lock = plugin.GimbalMode.YAW_FOLLOW, plugin.GimbalMode.YAW_LOCK
        once, stream = plugin.SendMode.ONCE, plugin.SendMode.STREAM
        primary = plugin.ControlMode.PRIMARY
        assert result(gimbal.set_angles, GIMBAL, 0.0, -20.0, 0.0, follow, once) == DENIED
        assert result(gimbal.take_control, GIMBAL, primary) == 'SUCCESS'

        assert result(gimbal.set_angles, GIMBAL, 0.0, -20.0, 10.0, follow, once) == 'SUCCESS'
        eventually(points_to(device, -20.0, 10.0))
        assert result(gimbal.set_angles, GIMBAL, 0.0, -30.0, -15.0, follow, stream) == 'SUCCESS'
        eventually(points_to(device, -30.0, -15.0))
        # The vehicle heads east.
        assert result(gimbal.set_angles, GIMBAL, 0.0, -30.0, 80.0, lock, stream) == 'SUCCESS'
        eventually(points_to(device, -30.0, -10.0))
        for mode in (once, stream):
            assert result(gimbal.set_angular_rates, GIMBAL, 0.0, 10.0, 0.0, follow,
                          mode) == 'SUCCESS'
            eventually(turns(device))
        latitude, longitude, altitude = HERE
        assert result(gimbal.set_roi_location, GIMBAL, latitude, longitude + 0.01,
                      altitude) == 'SUCCESS'
        eventually(points_to(device, 0.0, 0.0))

        eventually(lambda: gimbal.get_control_status(GIMBAL).compid_primary_control
                   == FIRST.component)
        eventually(lambda: abs(gimbal.get_attitude(GIMBAL).euler_angle_north.yaw_deg - 90) < 1)
        assert result(second.take_control, GIMBAL, primary) == DENIED
        assert result(second.set_angles, GIMBAL, 0.0, -20.0, 0.0, follow, once) == DENIED
        answers = [ack.result for ack in vehicle.acks if ack.command in set(DEVICE_ID_PARAM)
                   and (ack.target_system, ack.target_component) == SECOND]
        assert answers[-2:] == [mavlink.MAV_RESULT_DENIED] * 2
        assert manager.control.holder(Role.PRIMARY) == FIRST

        assert result(gimbal.release_control, GIMBAL) == 'SUCCESS'
        eventually(lambda: gimbal.get_control_status(GIMBAL).compid_primary_control == 0)
        assert result(second.take_control, GIMBAL, primary) == 'SUCCESS'


class Client(EndpointLink[Component]):
    """Our client on a link of its own, which has found a gimbal."""

    def __init__(self, port: int) -> None:
        commands = CommandSender(OURS)
        self._client = GimbalClient(commands, GimbalSettings())
        self.changes: list[ControlChanged] = []
        self._client.events.subscribe(lambda event: self.changes.append(event) if isinstance(
            event, ControlChanged) else None)
        super().__init__(f'udpout://127.0.0.1:{port}', Component(commands, [self._client]))
        eventually(lambda: self._client.gimbals and not self.call(
            lambda gimbal, now: gimbal.snapshot(now).unreachable))

    def call(self, function: Callable[[Gimbal, float], T]) -> T:
        """Return what a function of the gimbal and the time returns in the link's thread."""
        return self.ask(lambda now: function(next(iter(self._client.gimbals.values())), now))

    def request(self, ask: Callable[..., None]) -> Result:
        """Return the outcome of a request."""
        results: list[Result] = []
        self.call(lambda gimbal, now: ask(
            gimbal, now, lambda result, now: results.append(result)))
        return eventually(lambda: results)[0]

    def rotation(self, frame: YawFrame) -> Quaternion:
        """Return the attitude with a yaw relative to a frame."""
        attitude = self.call(lambda gimbal, now: gimbal.snapshot(now).attitude)
        assert attitude is not None
        rotation = attitude.seen_from(frame)
        assert rotation is not None
        return rotation

    def angles(self, frame: YawFrame) -> list[float]:
        """Return the attitude as roll, pitch and yaw in MAVLink, deg."""
        q = Quaternion(*to_mavlink(self.rotation(frame), frame))
        return [math.degrees(angle) for angle in q.euler()]


@pytest.fixture
def both() -> Iterator[tuple[Client, Any]]:
    """Return our client and MAVSDK's plugin, which have both found the gimbal."""
    device = SimulatedManager(ManagerProperties())
    vehicle = Vehicle(SimulatedComponents([device], 0.0), Autopilot())
    with (served(vehicle) as port, Client(port) as ours, player(FIRST, port) as theirs):
        yield ours, theirs


def read(angles: Any) -> list[float]:
    return [angles.roll_deg, angles.pitch_deg, angles.yaw_deg]


@pytest.mark.timeout(180)
def test_gm_4_mavsdk_reads_the_angles_that_we_read_in_both_frames(
        both: tuple[Client, Any]) -> None:
    ours, theirs = both
    assert ours.request(Gimbal.take_control).success
    # In ROS, rad: ahead; 45 down and 30 left; up and to the right; tilted; north-west.
    poses: list[tuple[Vector, YawFrame]] = [
        ((0.0, 0.0, 0.0), YawFrame.VEHICLE),
        ((0.0, math.radians(45), math.radians(30)), YawFrame.VEHICLE),
        ((0.0, math.radians(-20), math.radians(-60)), YawFrame.VEHICLE),
        ((math.radians(15), math.radians(30), math.radians(40)), YawFrame.VEHICLE),
        ((0.0, math.radians(25), math.radians(90)), YawFrame.EARTH)]
    for angles, frame in poses:
        target = Quaternion.from_euler(*angles)

        assert ours.call(lambda gimbal, now, target=target, frame=frame:  # type: ignore[misc]
                         setpoint(gimbal, Attitude(target, frame), now)) == ''
        eventually(lambda target=target, frame=frame:  # type: ignore[misc]
                   ours.rotation(frame).angle_to(target) < math.radians(0.02))
        # MAVSDK computes the other frame from the ATTITUDE of the autopilot, we from delta_yaw.
        for kind, name in ((YawFrame.VEHICLE, 'euler_angle_forward'),
                           (YawFrame.EARTH, 'euler_angle_north')):
            wanted = ours.angles(kind)
            eventually(lambda name=name, wanted=wanted: read(  # type: ignore[misc]
                getattr(theirs.get_attitude(GIMBAL), name)) == pytest.approx(wanted, abs=0.1))


@pytest.mark.timeout(180)
def test_gm_17_control_passes_between_mavsdk_and_us_and_the_loser_stops(
        both: tuple[Client, Any]) -> None:
    ours, theirs = both
    primary, stream = plugin.ControlMode.PRIMARY, plugin.SendMode.STREAM
    follow = plugin.GimbalMode.YAW_FOLLOW
    assert result(theirs.take_control, GIMBAL, primary) == 'SUCCESS'
    # MAVSDK takes secondary control, too.
    eventually(lambda: ours.call(lambda gimbal, now: setpoint(gimbal, Rates((0.0, 0.1, 0.0)), now))
               == 'no control of gimbal 1 of 1/154: primary 1/195, secondary 1/195')

    taken = ours.request(Gimbal.take_control)

    assert taken.success, taken.message
    eventually(lambda: theirs.get_control_status(GIMBAL).compid_primary_control == OURS.component)
    # Secondary control is left as it is.
    assert theirs.get_control_status(GIMBAL).compid_secondary_control == FIRST.component
    assert ours.call(lambda gimbal, now: setpoint(gimbal, Rates((0.0, 0.1, 0.0)), now)) == ''
    assert result(theirs.take_control, GIMBAL, primary) == 'SUCCESS'
    eventually(lambda: any(change.was_lost for change in ours.changes))
    before = ours.call(lambda gimbal, now: gimbal.snapshot(now).setpoints_sent)
    assert result(theirs.set_angles, GIMBAL, 0.0, -20.0, 10.0, follow, stream) == 'SUCCESS'
    eventually(lambda: ours.angles(YawFrame.VEHICLE) == pytest.approx([0, -20, 10], abs=0.1))
    assert ours.call(lambda gimbal, now: gimbal.snapshot(now).setpoints_sent) == before
    assert result(theirs.release_control, GIMBAL) == 'SUCCESS'
    eventually(lambda: ours.changes[-1].after is not None
               and ours.changes[-1].after.primary is None)
