# Copyright 2026 The illuminator_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.

"""Our client beside MAVSDK's Gimbal plugin at one simulated gimbal manager."""

from __future__ import annotations

from collections.abc import Callable, Iterator
import contextlib
import math
import threading
from typing import Any, TypeVar

from illuminator_ros.gimbal.client import GimbalClient
from illuminator_ros.gimbal.events import ControlChanged
from illuminator_ros.gimbal.gimbal import Gimbal, GimbalSettings
from illuminator_ros.gimbal.simulated_manager import ManagerProperties, SimulatedManager
from illuminator_ros.mavlink.command_sender import CommandSender
from illuminator_ros.mavlink.component import Component
from illuminator_ros.mavlink.link import Link
from illuminator_ros.mavlink.messages import Address
from illuminator_ros.mavlink.url import parse_url
from illuminator_ros.payload.mount_attitude import to_mavlink, YawFrame
from illuminator_ros.payload.request import Result
from illuminator_ros.payload.rotation import Quaternion, Vector
from illuminator_ros.payload.simulated import Description, SimulatedComponents
import pytest
from support.gimbal_vehicle import Autopilot, Vehicle
from support.ports import free_port
from support.waiting import eventually, PATIENCE

pytest.importorskip('mavsdk.mavsdk', reason='the wheel of mavsdk is not installed')

from support.mavsdk_player import player, plugin, result  # noqa: E402, I100

OURS, THEIRS, MANAGER = Address(1, 194), Address(1, 195), Address(1, 154)
# The number of the gimbal in MAVSDK's list.
GIMBAL = 1
T = TypeVar('T')


class Client:
    """Our client on a link of its own; it is called in the link's thread."""

    def __init__(self, link: Link, client: GimbalClient) -> None:
        self._link, self._client = link, client
        self.changes: list[ControlChanged] = []
        client.events.subscribe(lambda event: self.changes.append(event) if isinstance(
            event, ControlChanged) else None)

    def ask(self, call: Callable[[Gimbal, float], T]) -> T:
        """Return what a call in the link's thread returns."""
        answers: list[T] = []
        answered = threading.Event()

        def run(now: float) -> None:
            answers.append(call(next(iter(self._client.gimbals.values())), now))
            answered.set()

        self._link.call(run)
        assert answered.wait(PATIENCE)
        return answers[0]

    def request(self, ask: Callable[..., None], *arguments: Any) -> Result:
        """Return the outcome of a request."""
        results: list[Result] = []
        self.ask(lambda gimbal, now: ask(
            gimbal, *arguments, now, lambda result, now: results.append(result)))
        return eventually(lambda: results)[0]

    def rotation(self, frame: YawFrame) -> Quaternion:
        """Return the attitude with a yaw relative to a frame."""
        attitude = self.ask(lambda gimbal, now: gimbal.snapshot(now).attitude)
        assert attitude is not None
        rotation = attitude.seen_from(frame)
        assert rotation is not None
        return rotation

    def angles(self, frame: YawFrame) -> list[float]:
        """Return the attitude as roll, pitch and yaw in MAVLink, deg."""
        q = Quaternion(*to_mavlink(self.rotation(frame), frame))
        return [math.degrees(angle) for angle in q.euler()]


@contextlib.contextmanager
def linked(url: str, endpoint: Any) -> Iterator[Link]:
    link = Link(parse_url(url), endpoint, label=url)
    link.start()
    try:
        yield link
    finally:
        link.stop()


@pytest.fixture
def both() -> Iterator[tuple[Client, Any]]:
    """Return our client and MAVSDK's plugin, which have both found the gimbal."""
    port = free_port()
    device = SimulatedManager(ManagerProperties())
    commands = CommandSender(OURS)
    client = GimbalClient(commands, GimbalSettings())
    with (linked(f'udpin://127.0.0.1:{port}',
                 Vehicle(SimulatedComponents([Description(MANAGER, device)], 0.0), Autopilot())),
          linked(f'udpout://127.0.0.1:{port}', Component(commands, [client])) as link,
          player(THEIRS, port) as theirs):
        ours = Client(link, client)
        eventually(lambda: client.gimbals and not ours.ask(
            lambda gimbal, now: gimbal.snapshot(now).unreachable))
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

        assert ours.ask(lambda gimbal, now, target=target, frame=frame:  # type: ignore[misc]
                        gimbal.set_attitude(target, frame, now)) == ''
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
    eventually(lambda: ours.ask(lambda gimbal, now: gimbal.set_rates((0.0, 0.1, 0.0), now))
               == 'no control of gimbal 1 of 1/154: primary 1/195, secondary 1/195')

    taken = ours.request(Gimbal.take_control)

    assert taken.success, taken.message
    eventually(lambda: theirs.get_control_status(GIMBAL).compid_primary_control == OURS.component)
    # Secondary control is left as it is.
    assert theirs.get_control_status(GIMBAL).compid_secondary_control == THEIRS.component
    assert ours.ask(lambda gimbal, now: gimbal.set_rates((0.0, 0.1, 0.0), now)) == ''
    assert result(theirs.take_control, GIMBAL, primary) == 'SUCCESS'
    eventually(lambda: any(change.was_lost for change in ours.changes))
    before = ours.ask(lambda gimbal, now: gimbal.snapshot(now).setpoints_sent)
    assert result(theirs.set_angles, GIMBAL, 0.0, -20.0, 10.0, follow, stream) == 'SUCCESS'
    eventually(lambda: ours.angles(YawFrame.VEHICLE) == pytest.approx([0, -20, 10], abs=0.1))
    assert ours.ask(lambda gimbal, now: gimbal.snapshot(now).setpoints_sent) == before
    assert result(theirs.release_control, GIMBAL) == 'SUCCESS'
    eventually(lambda: ours.changes[-1].after is not None
               and ours.changes[-1].after.primary is None)
