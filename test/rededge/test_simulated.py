# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The simulated camera: its answers, the metadata of its images, and its faults."""

from __future__ import annotations

from collections.abc import Callable
import math
from typing import Any

from illuminator_ros.geometry.rotation import Vector
from illuminator_ros.mavlink.dialect import mavlink
from illuminator_ros.mavlink.messages import Address, Heartbeat, heartbeat, Message
from illuminator_ros.payload.messages import Attitude, GeoPoint, GlobalPositionInt, SystemTime
from illuminator_ros.rededge.messages import (
    CameraFeedback,
    CameraStatus,
    DigicamControl,
    GpsRawInt,
    MountStatus,
)
from illuminator_ros.rededge.simulated import (
    COLUMNS,
    FAULTS,
    Image,
    RedEdgeProperties,
    SIMULATED,
    SimulatedRedEdge,
    Source,
)
import pytest
from support.bench import DeviceBench

HOST = Address(7, 191)
START = 1000.0
# UTC, s: of the camera's own GPS at START, and of the host.
OWN_UTC, HOST_UTC = 1.8e9, 1.7e9
OWN_PLACE = GeoPoint(47.0, 8.0, 400.0)
FIX = GpsRawInt(int(HOST_UTC * 1e6), 3, 481234567, -91234567, 500_250, 120, 65535, 1234, 35999,
                17)
LEVEL_NORTH = Attitude(0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


def attitude(roll: float, pitch: float, yaw: float) -> Attitude:
    return Attitude(
        0, math.radians(roll), math.radians(pitch), math.radians(yaw), 0.0, 0.0, 0.0)


def mount(roll: float, pitch: float, yaw: float) -> MountStatus:
    return MountStatus(1, 100, *(round(100 * angle) for angle in (pitch, roll, yaw)))


def control(shot: int, component: int = 100, system: int = 1) -> DigicamControl:
    return DigicamControl(system, component, 1, 1, 0, 0, shot, 0, 0, 0.0)


class Camera(DeviceBench):
    """A simulated camera."""

    def __init__(self, fault: str = '', **settings: Any) -> None:
        device = SimulatedRedEdge(RedEdgeProperties(**{'own_gps': OWN_PLACE, **settings}))
        if fault:
            device.behave(FAULTS.add(device.behaviour, fault), START)
        super().__init__(device, START)
        device.set_clock(OWN_UTC, START)

    def tell(self, *messages: Message, source: Address = HOST) -> list[Any]:
        """Give messages to the camera, and return the messages that it sends at once."""
        return self.give(source, *messages)

    def wait(self, seconds: float) -> list[Any]:
        """Let time pass, and return the camera's messages except heartbeats."""
        before = len(self.sent)
        self.run(seconds)
        return [one for _, one in self.sent[before:] if not isinstance(one, Heartbeat)]

    def image(self, *messages: Message, wait: float = 0.0) -> Image:
        """Return an image that is taken ``wait`` s after messages."""
        self.tell(*messages)
        self.wait(wait)
        self.tell(control(1))
        image: Image = self.device.images[-1]
        return image


def test_camera_has_the_system_id_of_the_host_that_it_heard_last_re_8() -> None:
    camera = Camera()
    camera.tell(heartbeat(18))
    assert camera.component.address == Address(7, 100)
    camera.tell(LEVEL_NORTH, source=Address(9, 1))
    assert camera.component.address == Address(9, 100)
    camera.component.restart(camera.now)
    assert camera.component.address == Address(255, 100)


def test_capture_is_followed_by_camera_status_and_later_by_camera_feedback() -> None:
    camera = Camera()
    camera.tell(FIX, attitude(10, -15, 40), mount(0, 15, 10))
    camera.wait(1.0)
    utc = int((HOST_UTC + 1.0) * 1e6)

    assert camera.tell(control(1)) == [CameraStatus(
        utc, 7, 0, 1, mavlink.CAMERA_STATUS_TYPE_TRIGGER, 0.0, 0.0, 0.0, 0.0)]
    assert camera.wait(0.1) == []
    [feedback] = camera.wait(0.2)
    assert isinstance(feedback, CameraFeedback)
    assert (feedback.time_usec, feedback.target_system, feedback.img_idx, feedback.flags) == (
        utc, 7, 1, mavlink.CAMERA_FEEDBACK_CLOSEDLOOP)
    assert (feedback.lat, feedback.lng, feedback.alt_msl) == (481234567, -91234567, 500.25)


def test_img_idx_counts_images_by_mavlink_only() -> None:
    camera = Camera(interval=1.0)
    camera.wait(2.5)
    indexes = [camera.tell(control(shot))[0].img_idx for shot in (1, 2)]

    assert indexes == [1, 2]
    assert [(one.image, one.img_idx, one.trigger, one.shot) for one in camera.device.images] == [
        (1, None, 'interval', 'survey'), (2, None, 'interval', 'survey'),
        (3, 1, 'mavlink', 'survey'), (4, 2, 'mavlink', 'panel')]


def test_image_has_the_injected_values_and_their_ages() -> None:
    row = dict(zip(COLUMNS, Camera().image(
        FIX, attitude(10, -15, 400), mount(-33.69, 25.66, 16.1), wait=0.25).row(), strict=True))

    assert row == {
        'camera': '100', 'image': '1', 'shot': 'survey', 'trigger': 'mavlink', 'img_idx': '1',
        'time_utc_s': '1700000000.250000', 'time_source': 'injected',
        'position_source': 'injected', 'position_age_s': '0.250', 'fix_type': '3',
        'latitude_deg': '48.1234567', 'longitude_deg': '-9.1234567', 'altitude_m': '500.250',
        'eph_m': '1.20', 'epv_m': '', 'speed_m_s': '12.34', 'course_deg': '359.99',
        'satellites': '17', 'attitude_source': 'injected', 'attitude_age_s': '0.250',
        'roll_deg': '10.000', 'pitch_deg': '-15.000', 'yaw_deg': '40.000',
        'mount_source': 'injected', 'mount_age_s': '0.250', 'mount_roll_deg': '-33.69',
        'mount_pitch_deg': '25.66', 'mount_yaw_deg': '16.10',
        'camera_roll_deg': row['camera_roll_deg'], 'camera_pitch_deg': row['camera_pitch_deg'],
        'camera_yaw_deg': row['camera_yaw_deg']}


@pytest.mark.parametrize(('vehicle', 'camera', 'earth'), [
    # Panning a camera that looks down is its roll, and turns the top of the image.
    ((0, 0, 40), (30, 0, 0), (0, 0, 70)),
    # A stabilised gimbal below a vehicle that pitches and rolls.
    ((10, -15, 40), (0, 15, 10), (0, 0, 40)),
    ((0, 0, 0), (0, 45, 0), (0, 45, 0))])
def test_camera_attitude_is_composed_of_those_of_vehicle_and_mount(
    vehicle: Vector, camera: Vector, earth: Vector,
) -> None:
    image = Camera().image(attitude(*vehicle), mount(*camera))

    assert (image.camera_roll_deg, image.camera_pitch_deg,
            image.camera_yaw_deg) == pytest.approx(earth, abs=1e-6)


@pytest.mark.parametrize('message', [
    FIX, SystemTime(int(HOST_UTC * 1e6), 0), attitude(1, 2, 3), mount(1, 2, 3),
    GlobalPositionInt(0, 481234567, 0, 0, 0, 0, 100, 0, 0)])
@pytest.mark.parametrize(('validity', 'wait', 'valid'), [
    (5.0, 5.0, True), (5.0, 5.001, False), (30.0, 29.0, True)])
def test_injected_state_counts_for_5_s_or_as_set_re_29(
        message: Message, validity: float, wait: float, valid: bool) -> None:
    image = Camera(validity=validity).image(message, wait=wait)
    sources = {image.position_source, image.time_source, image.attitude_source,
               image.mount_source}
    assert (Source.INJECTED in sources) is valid


def test_camera_falls_back_to_position_and_time_of_its_own_gps() -> None:
    image = Camera().image(FIX, wait=6.0)

    assert (image.position_source, image.latitude_deg, image.longitude_deg, image.altitude_m) == (
        Source.OWN, *OWN_PLACE)
    assert (image.time_source, image.time_utc_s) == (Source.OWN, OWN_UTC + 6.0)
    assert image.position_age_s is None


def test_camera_without_own_gps_has_no_position_and_its_clock_goes_on() -> None:
    camera = Camera(own_gps=None)
    assert camera.image().time_source is Source.NONE
    image = camera.image(FIX, wait=6.0)

    assert (image.position_source, image.latitude_deg) == (Source.NONE, None)
    assert (image.time_source, image.time_utc_s) == (Source.NONE, HOST_UTC + 6.0)


def test_injected_position_without_3d_fix_is_none_re_16() -> None:
    fix = GpsRawInt(int(HOST_UTC * 1e6), 2, 1, 2, 3, 65535, 65535, 65535, 65535, 255)
    image = Camera().image(fix)

    assert (image.position_source, image.fix_type, image.latitude_deg, image.satellites) == (
        Source.INJECTED, 2, None, None)


def test_global_position_implies_a_fix_and_has_speed_and_course_re_18() -> None:
    image = Camera().image(GlobalPositionInt(0, 0, 0, 0, 0, 300, -400, 0, 0))

    assert (image.fix_type, image.speed_m_s) == (3, 5.0)
    assert image.course_deg == pytest.approx(306.87, abs=0.01)


def test_images_at_an_interval_have_its_times_and_what_was_known_then() -> None:
    camera = Camera(interval=1.0)
    # The poll is late: a message that is newer than the image comes first.
    camera.now = START + 1.2
    camera.tell(FIX)

    [image] = camera.device.images
    assert (image.time_utc_s, image.position_source) == (OWN_UTC + 1.0, Source.OWN)


def console(device: SimulatedRedEdge, line: str) -> Callable[[], None]:
    """Return the change that a line of the console makes."""
    name, *words = line.split()
    [command] = [one for one in device.commands if one.name == name]
    return command.do(device, words, START)


@pytest.mark.parametrize(('line', 'effect'), [
    ('capture', lambda device: device.images[-1].shot == 'survey'),
    ('capture panel', lambda device: device.images[-1].trigger == 'console'),
    ('interval 2', lambda device: device.due == START + 2.0),
    ('own-gps none', lambda device: device.own_gps is None),
    ('own-gps -1,2.5,3', lambda device: device.own_gps == GeoPoint(-1.0, 2.5, 3.0)),
])
def test_command_of_the_console_has_its_effect(
        line: str, effect: Callable[[SimulatedRedEdge], bool]) -> None:
    device = Camera().device
    console(device, line)()
    assert effect(device)


@pytest.mark.parametrize(('line', 'reason'), [
    ('capture sky', "'sky' is not panel"), ('own-gps 91,0,0', '91 is outside -90 to 90'),
    ('own-gps 1,2', 'is not LAT,LON,ALT'), ('interval -1', 'outside'),
    ('interval 1e-12', '1e-12 is shorter than 0.05')])
def test_wrong_argument_of_the_console_is_named(line: str, reason: str) -> None:
    with pytest.raises(ValueError, match=reason):
        console(Camera().device, line)


@pytest.mark.parametrize('text', ['7.1', '7.1.x', '7.1.256', ''])
def test_text_that_is_not_a_firmware_version_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match='is not a version such as 1.5.5'):
        SIMULATED.all_settings['firmware'].read(text)
