# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Messages that the camera gets, and inputs that it must not get."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
import functools
import math
from typing import Any

from illuminator_ros.geometry.rotation import Quaternion, Vector
from illuminator_ros.mavlink.durations import format_seconds
from illuminator_ros.mavlink.messages import Address, Message
from illuminator_ros.mavlink.schedule import Schedule
from illuminator_ros.payload.messages import Attitude, GlobalPositionInt, SystemTime
from illuminator_ros.rededge.conversions import mount_angles, MountFrame, Position
from illuminator_ros.rededge.feeder import ENU, Feeder
from illuminator_ros.rededge.input_states import (
    CameraSettings,
    Input,
    InputState,
    PositionSource,
    Stamp,
    VELOCITIES,
)
from illuminator_ros.rededge.messages import GpsRawInt, GpsStatus, MountStatus
import pytest

CAMERA = Address(1, 100)
HERE = Position(0, 47.0, 8.0, 500.0)
EPOCH = 1_700_000_000
LEVEL = Quaternion()
RATES: Vector = (0.0, 0.0, 0.0)
# From the frame of base_link to a camera that looks straight down.
NADIR = Quaternion.from_euler(0, math.pi / 2, 0)
FUSED = {'position_source': PositionSource.FUSED}


class Rig:
    """A feeder, and a ROS clock that is UTC unless it is set."""

    def __init__(self, **settings: Any) -> None:
        self.now = 100.0
        self.clock = EPOCH - self.now
        self.simulated = False
        self.sent: list[Message] = []
        self.schedule = Schedule()
        self.feeder = Feeder(replace(CameraSettings(), **settings), self.sent.append,
                             lambda: CAMERA, self.schedule)

    def stamp(self, age: float = 0.0) -> Stamp:
        return Stamp(round((self.clock + self.now - age) * 1e9), age, self.simulated)

    def fix(self, position: Position = HERE, age: float = 0.0) -> list[Message]:
        self.feeder.receive_fix(position, self.stamp(age), self.now)
        return self.take()

    def fix_sent(self) -> GpsRawInt:
        """Take a fix; return the message with it."""
        [sent] = self.fix()
        assert isinstance(sent, GpsRawInt)
        return sent

    def velocity(self, *velocity: float, age: float = 0.0, name: Input = Input.VELOCITY,
                 body: Quaternion = ENU) -> None:
        self.feeder.receive_velocity(
            name, (velocity[0], velocity[1], velocity[2]), self.stamp(age), self.now, body)

    def imu(self, orientation: Quaternion | None = LEVEL, age: float = 0.0,
            name: Input = Input.IMU) -> list[Message]:
        self.feeder.orientation.receive_attitude(
            name, orientation, RATES, self.stamp(age), self.now)
        return self.take()

    def mount(self, orientation: Quaternion = NADIR, age: float = 0.0,
              frame_id: str = 'base_link') -> list[Message]:
        self.feeder.orientation.receive_mount(orientation, frame_id, self.stamp(age), self.now)
        return self.take()

    def reference(self, utc: float, age: float = 0.0) -> None:
        self.feeder.receive_time_reference(round(utc * 1e9), self.stamp(age), self.now)

    def image_time(self, utc: float) -> int:
        """Return the ROS time of an image, ns."""
        return self.feeder.ros_time(round(utc * 1e9), self.stamp())

    def take(self) -> list[Message]:
        sent, self.sent[:] = list(self.sent), []
        return sent

    def run(self, seconds: float) -> list[Message]:
        """Let time pass; return the messages that the feeder sends meanwhile."""
        end = self.now + seconds
        while (due := self.schedule.due) <= end:
            self.now = max(self.now, due)
            self.schedule.run(self.now)
        self.now = end
        return self.take()

    def state(self, name: Input) -> tuple[InputState, str]:
        snapshot = self.feeder.snapshot(self.now).inputs[name]
        return snapshot.state, snapshot.refusal


def classes(messages: list[Message]) -> list[type[Message]]:
    return [type(message) for message in messages]


# Position

def test_each_fix_is_sent_at_once_and_only_once_re_13_re_29() -> None:
    rig = Rig()
    assert [(type(one), one.time_usec) for one in rig.fix() if isinstance(one, GpsRawInt)] == [
        (GpsRawInt, EPOCH * 1_000_000)]
    assert GpsRawInt not in classes(rig.run(10.0))
    assert classes(rig.fix()) == [GpsRawInt]


@pytest.mark.parametrize(('take', 'names', 'timeout'), [
    (Rig.fix, [Input.FIX], 1.0), (Rig.imu, [Input.IMU], 0.5)])
def test_an_input_without_a_sent_message_within_its_timeout_is_lacking_re_29(
        take: Callable[[Rig], list[Message]], names: list[Input], timeout: float) -> None:
    rig = Rig(attitude_rate=100.0)
    rig.feeder.set_link(is_open=True)

    def states() -> list[InputState]:
        snapshot = rig.feeder.snapshot(rig.now)
        lacks = any(set(names) <= set(group) for group in snapshot.lacking)
        found = [snapshot.inputs[name].state for name in names]
        assert lacks is (found != [InputState.OK])
        return found

    for after, expected in ((0.0, InputState.OK), (timeout - 0.1, InputState.OK),
                            (0.2, InputState.UNSENT)):
        rig.run(after)
        newest = take(rig)
        assert states() == [expected]
    for message in newest:
        rig.feeder.sent(message)
    assert states() == [InputState.OK]

    # A pause of the input is not one of the line, and a closed link has its own report.
    take(rig)
    rig.run(2 * timeout)
    take(rig)
    assert states() == [InputState.OK]
    rig.feeder.set_link(is_open=False)
    for _ in range(5):
        rig.run(timeout / 2)
        take(rig)
    assert states() == [InputState.OK]


def test_fixes_stamped_in_whole_seconds_are_mostly_refused_with_the_reason() -> None:
    rig = Rig()

    def refused_lately() -> int:
        return rig.feeder.snapshot(rig.now).inputs[Input.FIX].refused_lately

    for _ in range(20):
        rig.run(0.2)
        rig.fix()
    assert refused_lately() == 0
    for _ in range(20):
        rig.run(0.2)
        rig.fix(age=(rig.clock + rig.now) % 1.0)
    assert refused_lately() == 8
    assert rig.state(Input.FIX)[1] == (
        'its stamp is not newer than the last, since its stamps are whole seconds')


def test_speed_and_satellites_are_sent_while_they_are_fresh_re_15_re_30() -> None:
    rig = Rig()
    rig.velocity(3.0, 4.0, 0.0)
    rig.feeder.receive_satellites(9, rig.now)
    for after, speed, satellites in ((0.9, 500, 9), (0.2, 65535, 255)):
        rig.run(after)
        sent = rig.fix_sent()
        assert (sent.vel, sent.satellites_visible) == (speed, satellites)


def test_a_velocity_in_the_axes_of_the_body_is_sent_in_those_of_the_earth_re_15() -> None:
    rig = Rig()
    # Ahead, while the nose points to the north, tilted.
    rig.velocity(5.0, 0.0, 0.0, name=Input.ODOMETRY, body=Quaternion.from_euler(
        0.3, 0.0, math.pi / 2))
    sent = rig.fix_sent()
    assert (sent.vel, sent.cog) == (500, 0)


def test_the_first_fresh_one_of_several_velocities_is_sent_re_15_re_30() -> None:
    rig = Rig()
    for east, name in enumerate(reversed(VELOCITIES), 1):
        rig.velocity(east, 0.0, 0.0, name=name)
        assert rig.fix_sent().vel == 100 * east
        rig.run(0.3)
    for speed in (300, 65535):
        rig.run(0.6)
        assert rig.fix_sent().vel == speed


def test_fused_position_comes_with_its_utc_and_never_with_gps_raw_int_re_17_re_19() -> None:
    rig = Rig(**FUSED)
    rig.velocity(1.0, 2.0, 3.0)
    first, second = rig.fix()
    assert isinstance(first, SystemTime)
    assert first.time_unix_usec == EPOCH * 1_000_000
    assert isinstance(second, GlobalPositionInt)
    assert (second.vx, second.vy, second.vz) == (200, 100, -300)


def test_fused_position_needs_a_velocity_since_none_can_be_left_unknown_re_18() -> None:
    rig = Rig(**FUSED)
    assert rig.fix() == []
    assert rig.state(Input.FIX) == (
        InputState.REFUSED, 'position_source fused needs a velocity, which is missing')
    assert [VELOCITIES in one.feeder.snapshot(one.now).needed
            for one in (rig, Rig())] == [True, False]


def take_velocity(name: Input, rig: Rig, age: float) -> None:
    rig.velocity(3.0, 4.0, 0.0, age=age, name=name)


# How each input with a stamp is taken, and the age at which it is stale, s.
TAKES: dict[Input, tuple[Callable[[Rig, float], Any], float]] = {
    Input.FIX: (lambda rig, age: rig.fix(age=age), 1.0),
    **{name: (functools.partial(take_velocity, name), 1.0) for name in VELOCITIES},
    Input.IMU: (lambda rig, age: rig.imu(age=age), 0.5),
    Input.ATTITUDE: (lambda rig, age: rig.imu(age=age, name=Input.ATTITUDE), 0.5),
    Input.MOUNT: (lambda rig, age: rig.mount(age=age), 0.5),
    Input.TIME_REFERENCE: (lambda rig, age: rig.reference(EPOCH, age), 60.0)}


@pytest.mark.parametrize('name', TAKES)
def test_an_old_or_early_message_is_refused_and_one_that_another_has_overtaken_re_29_re_30(
        name: Input) -> None:
    take, limit = TAKES[name]
    for age, relation in ((limit + 0.1, 'old by'), (-limit - 0.1, 'ahead of')):
        rig = Rig()
        take(rig, age)
        reason = f'its stamp is {format_seconds(abs(age))} {relation} the ROS clock'
        assert rig.state(name) == (InputState.REFUSED, reason)
        rig.run(limit)
        found = rig.feeder.snapshot(rig.now).inputs[name]
        assert (found.state, found.refused, found.age) == (InputState.STALE, 1, None)
        assert found.refused_age == pytest.approx(limit)

    rig = Rig()
    rig.clock += 0.5
    assert rig.state(name) == (InputState.MISSING, '')
    take(rig, 0.0)
    for age in (0.0, 0.1):
        take(rig, age)
        assert rig.state(name) == (InputState.OK, 'its stamp is not newer than the last')
    rig.run(0.2)
    rig.feeder.clock_jumped()
    rig.clock -= 3600.0
    assert rig.feeder.snapshot(rig.now).inputs[name].age == pytest.approx(0.2)
    take(rig, 0.0)
    assert rig.feeder.snapshot(rig.now).inputs[name].refused == 2


@pytest.mark.parametrize(('name', 'take', 'reason'), [
    (Input.VELOCITY, lambda rig: rig.velocity(math.inf, 4.0, 0.0),
     'a component is not a finite number'),
    (Input.ODOMETRY, lambda rig: rig.velocity(
        1.0, 0.0, 0.0, name=Input.ODOMETRY, body=Quaternion(0, 0, 0, 0)),
     '(0, 0, 0, 0) is not a rotation'),
    (Input.FIX, lambda rig: rig.fix(replace(HERE, status=-1), 1.1), 'no fix (status -1)'),
    (Input.FIX, lambda rig: rig.fix(replace(HERE, latitude=0.0, longitude=0.0)),
     'no fix: its position is 0, 0'),
    (Input.FIX, lambda rig: rig.fix(replace(HERE, latitude=math.nan)),
     'latitude of ~/fix: nan deg is outside -90 to 90 deg'),
    (Input.TIME_REFERENCE, lambda rig: rig.reference(1e9),
     '1000000000.0 s after 1970-01-01 cannot be UTC'),
    (Input.IMU, lambda rig: rig.imu(None), 'it has no orientation: its covariance begins with -1'),
    (Input.IMU, lambda rig: rig.imu(Quaternion(0, 0, 0, 0)), '(0, 0, 0, 0) is not a rotation'),
    (Input.IMU, lambda rig: rig.imu(Quaternion(1, math.nan, 0, 0)),
     '(nan, 0, 0, 1) is not a rotation'),
    *((Input.MOUNT, lambda rig, frame_id=frame_id: rig.mount(frame_id=frame_id),
       f"frame_id '{frame_id}' is not one of base_link, base_link_stabilized, map")
      for frame_id in ('camera_link', 'odom/', '/'))])
@pytest.mark.parametrize('settings', [{}, FUSED])
def test_an_input_that_cannot_be_trusted_is_refused_with_the_reason_re_16_re_18_re_30(
        settings: dict[str, Any], name: Input, take: Callable[[Rig], Any], reason: str) -> None:
    rig = Rig(**settings)
    if name is not Input.VELOCITY:
        rig.velocity(0.0, 0.0, 0.0)
    assert not take(rig)
    assert rig.state(name) == (InputState.REFUSED, reason)


def test_velocity_and_reference_are_stale_by_their_stamps_re_30() -> None:
    rig = Rig()
    rig.velocity(3.0, 4.0, 0.0, age=0.4)
    # This one is refused.
    rig.velocity(6.0, 8.0, 0.0, age=0.5)
    rig.reference(EPOCH, age=50.0)
    rig.run(0.5)
    assert rig.fix_sent().vel == 500
    rig.run(0.2)
    assert rig.fix_sent().vel == 65535
    assert rig.state(Input.TIME_REFERENCE)[0] is InputState.OK
    rig.run(10.0)
    assert (rig.fix(), rig.state(Input.TIME_REFERENCE)[0]) == ([], InputState.STALE)


def since_boot(rig: Rig) -> None:
    rig.clock = 23.4


def simulate(rig: Rig) -> None:
    rig.clock, rig.simulated = EPOCH - rig.now, True


@pytest.mark.parametrize(('set_clock', 'reason'), [
    (since_boot, 'its time, 123.4 s after 1970-01-01, cannot be UTC'),
    (simulate, 'ROS time is simulated (use_sim_time), which is not UTC')])
def test_time_that_is_not_utc_is_not_sent_unless_a_reference_tells_it_re_14(
        set_clock: Callable[[Rig], None], reason: str) -> None:
    rig = Rig()
    set_clock(rig)
    assert rig.fix() == []
    assert rig.state(Input.FIX)[1].startswith(reason)

    rig.reference(EPOCH + 5.5)
    # This one is refused.
    rig.reference(EPOCH, age=1.0)
    rig.run(2.0)
    assert rig.fix_sent().time_usec == (EPOCH + 7) * 1_000_000 + 500_000


@pytest.mark.parametrize('set_clock', [since_boot, simulate])
def test_an_image_has_its_own_ros_time_or_the_present_one_while_that_is_not_known_re_14(
        set_clock: Callable[[Rig], None]) -> None:
    rig = Rig()
    set_clock(rig)
    present = rig.stamp().time
    # The camera has UTC of its own GPS.
    assert rig.image_time(EPOCH) == present
    rig.reference(EPOCH + 5.5)
    assert rig.image_time(EPOCH) == present - 5_500_000_000
    rig.run(61.0)
    assert rig.image_time(EPOCH) == rig.stamp().time
    rig.reference(EPOCH + 66.5)
    rig.feeder.clock_jumped()
    assert rig.image_time(EPOCH) == rig.stamp().time


def test_an_image_without_a_time_that_a_stamp_can_have_has_the_present_one_re_14() -> None:
    rig = Rig()
    present = rig.stamp().time
    assert [rig.image_time(seconds) for seconds in (0, 2**31 - 1, 2**31, 4 * 10**9)] == [
        present, (2**31 - 1) * 10**9, present, present]
    # ROS time began with the boot, after this image.
    since_boot(rig)
    rig.reference(EPOCH)
    assert rig.image_time(EPOCH - 1000) == rig.stamp().time


def test_an_old_reference_or_a_jump_of_ros_time_ends_the_position_until_a_new_reference() -> None:
    rig = Rig()
    rig.reference(EPOCH)
    rig.run(61.0)
    assert rig.fix() == []
    assert rig.state(Input.FIX)[1] == '~/time_reference is 61.00 s old'
    rig.reference(EPOCH)
    rig.clock -= 30.0
    rig.feeder.clock_jumped()
    assert rig.fix() == []
    assert rig.state(Input.FIX)[1] == 'ROS time has jumped: waiting for ~/time_reference'
    assert (Input.TIME_REFERENCE,) in rig.feeder.snapshot(rig.now).needed
    rig.reference(EPOCH)
    assert classes(rig.fix()) == [GpsRawInt]


def test_after_a_step_back_of_the_clock_attitudes_are_sent_again() -> None:
    rig = Rig()
    rig.imu()
    rig.run(0.1)
    rig.clock -= 3600.0
    rig.feeder.clock_jumped()
    assert rig.mount() == []
    assert classes(rig.imu()) == [Attitude, MountStatus]


@pytest.mark.parametrize(('asked', 'expected'), [(True, 2), (False, 0)])
def test_satellites_are_sent_each_second_for_the_web_page_if_that_is_asked_for_re_28(
        asked: bool, expected: int) -> None:
    rig = Rig(send_gps_status=asked)
    sent = []
    for _ in range(12):
        rig.feeder.receive_satellites(9, rig.now)
        sent += rig.run(0.1)
    assert classes(sent).count(GpsStatus) == expected


# Attitude and mount

def test_attitude_and_mount_are_a_pair_back_to_back_re_21_re_26_re_27() -> None:
    rig = Rig()
    sent = rig.imu()
    assert classes(sent) == [Attitude, MountStatus]
    assert sent[1] == MountStatus(*CAMERA, 0, 0, 0)


@pytest.mark.parametrize(('rate', 'pairs'), [(20.0, 40), (50.0, 100), (5.0, 10)])
def test_pairs_have_the_given_rate_and_no_attitude_is_sent_twice_re_21_re_29(
        rate: float, pairs: int) -> None:
    rig = Rig(attitude_rate=rate)
    sent = []
    for _ in range(100):
        sent += rig.imu()
        sent += rig.run(0.02)
    assert abs(len(sent) / 2 - pairs) <= 1
    assert not any(isinstance(one, Attitude) for one in rig.run(5.0))


def test_pairs_have_a_rate_that_is_set_later_from_then_on() -> None:
    rig = Rig(attitude_rate=5.0)
    counts = []
    for rate in (5.0, 50.0):
        rig.feeder.orientation.change_rate(rate, rig.now)
        counts.append(sum(len(rig.imu() + rig.run(0.02)) for _ in range(100)) / 2)
    assert counts == pytest.approx([10, 100], abs=1)


def test_a_fixed_mount_is_sent_each_second_without_attitude_and_after_a_change_re_23_re_27() -> (
        None):
    rig = Rig()
    rig.run(0.1)
    assert rig.run(3.4) == [MountStatus(*CAMERA, 0, 0, 0)] * 3
    rig.feeder.orientation.set_fixed_mount((1.0, -2.0, 3.5), rig.now)
    assert rig.run(0.0) == [MountStatus(*CAMERA, -200, 100, 350)]


def test_a_fixed_mount_is_not_sent_before_its_time_nor_an_attitude_re_26_re_27() -> None:
    rig = Rig()
    rig.feeder.orientation.set_fixed_mount((1.0, -2.0, 3.5), rig.now + 2.0)
    assert rig.imu() + rig.run(1.9) + rig.imu() == []
    assert rig.run(0.1) == [MountStatus(*CAMERA, -200, 100, 350)]
    assert classes(rig.imu()) == [Attitude, MountStatus]
    # A gimbal is not waited for.
    rig.feeder.orientation.set_fixed_mount((0.0, 0.0, 0.0), rig.now + 2.0)
    rig.run(0.1)
    assert classes(rig.imu() + rig.mount()) == [Attitude, MountStatus]


def test_a_mount_that_moves_is_sent_with_the_attitude_of_the_same_instant_re_26() -> None:
    """Vehicle and gimbal turn; their messages have different rates and delays."""
    rig = Rig(mount_frame=MountFrame.CAMERA, attitude_rate=100.0)
    rig.mount()
    sent: list[Message] = []

    def turned(at: float) -> Quaternion:
        return Quaternion.from_euler(0, 0, (at - 100.0) * 0.8)

    for step in range(200):
        rig.run(0.005)
        if step % 4 == 0:
            sent += rig.imu(turned(rig.now - 0.004), 0.004)
        if step % 11 == 3:
            # The gimbal counter-rotates, so that the camera keeps its direction.
            sent += rig.mount(turned(rig.now - 0.03).inverse() * NADIR, 0.03)
    pairs = list(zip(sent[::2], sent[1::2], strict=True))
    assert len(pairs) > 15
    for one, other in pairs:
        assert isinstance(one, Attitude)
        assert isinstance(other, MountStatus)
        # Pan of a camera that looks down is its roll; yaw from north is 90 degrees less.
        assert math.degrees(one.yaw) - 90 + other.pointing_b / 100 == pytest.approx(0, abs=0.02)
        assert (other.pointing_a, other.pointing_c) == (0, 0)
    assert len({one.yaw for one, _ in pairs if isinstance(one, Attitude)}) == len(pairs)


@pytest.mark.parametrize('frame_id', ['', 'boat/base_link', 'base_link_stabilized', 'map'])
def test_a_mount_in_any_frame_of_a_gimbal_is_sent_relative_to_the_vehicle_re_24(
        frame_id: str) -> None:
    rig = Rig(mount_frame=MountFrame.CAMERA)
    vehicle = Quaternion.from_euler(0.2, -0.3, 2.0)
    mount = Quaternion.from_euler(0.1, 1.2, 0.5)
    seen = {'map': vehicle * mount, 'base_link_stabilized':
            Quaternion.from_euler(0, 0, -2.0) * vehicle * mount}.get(frame_id, mount)
    rig.mount(seen, frame_id=frame_id)
    _, sent = rig.imu(vehicle)
    assert isinstance(sent, MountStatus)
    assert (sent.pointing_b, sent.pointing_a, sent.pointing_c) == tuple(
        round(100 * angle) for angle in mount_angles(mount, MountFrame.CAMERA))


def test_mounts_in_different_frames_are_not_mixed() -> None:
    rig = Rig()
    rig.mount(age=0.1)
    rig.run(0.1)
    # The mount is unknown between two mounts in different frames.
    rig.mount(frame_id='map')
    assert rig.imu(age=0.05) == []


@pytest.mark.parametrize('expected', [
    Rig.mount, lambda rig: rig.feeder.orientation.expect_mount()])
def test_without_its_moving_mount_no_attitude_is_sent_and_no_fixed_mount_re_29_re_30(
        expected: Callable[[Rig], Any]) -> None:
    rig = Rig()
    expected(rig)
    rig.feeder.orientation.set_fixed_mount((0.0, 0.0, 0.0), rig.now)
    rig.take()
    rig.run(0.6)
    assert rig.imu() == []
    assert rig.run(3.0) == []
    assert (Input.MOUNT,) in rig.feeder.snapshot(rig.now).needed


def test_attitude_is_used_while_no_imu_comes() -> None:
    rig = Rig()
    yaw = Quaternion.from_euler(0, 0, 1.0)
    assert classes(rig.imu(yaw, name=Input.ATTITUDE)) == [Attitude, MountStatus]
    rig.run(0.1)
    rig.imu()
    rig.run(0.1)
    (attitude, _) = rig.imu() or rig.imu(yaw, name=Input.ATTITUDE)
    assert isinstance(attitude, Attitude)
    assert attitude.yaw == pytest.approx(math.pi / 2)
    rig.run(0.6)
    assert classes(rig.imu(yaw, name=Input.ATTITUDE)) == [Attitude, MountStatus]


def test_attitude_and_mount_that_are_received_and_not_sent_have_a_reason() -> None:
    rig = Rig()
    rig.feeder.orientation.set_fixed_mount((0.0, 0.0, 0.0), since=rig.now + 2.0)

    def reason() -> str:
        return rig.feeder.snapshot(rig.now).no_pair

    assert reason() == ''
    assert rig.imu() == []
    assert reason() == 'a publisher of ~/mount is still awaited'
    rig.run(2.0)
    rig.imu()
    assert reason() == ''

    rig = Rig()
    rig.feeder.orientation.expect_mount()
    rig.imu()
    # It is older than the only attitude.
    assert rig.mount(age=0.1) == []
    assert reason() == 'none are of one instant'
    assert rig.mount() != []
    assert reason() == ''
