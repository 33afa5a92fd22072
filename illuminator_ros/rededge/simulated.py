# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""
The simulated camera: the device's side of the RedEdge serial API.

https://micasense.github.io/rededge-api/api/serial.html
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, fields
from enum import Enum
from functools import partial
import math
from typing import Any, NamedTuple

from . import messages as rededge
from ..geometry.rotation import Quaternion
from ..mavlink.dialect import mavlink, raw, replaced
from ..mavlink.messages import Address, Heartbeat, Message, target_of
from ..payload.messages import Attitude, GeoPoint, GlobalPositionInt, is_plausible, SystemTime
from ..simulation import simulated
from ..simulation.faults import Behaviour, COUNT, fault, FaultTable, SECONDS
from ..simulation.settings import geo_point, number, setting, SettingValues

# Until the camera hears a host.
DEFAULT_SYSTEM_ID = 255
# s between images.
SHORTEST_INTERVAL = 0.05
# s from an image to its CAMERA_FEEDBACK.
FEEDBACK_DELAY = 0.2
# Images that are kept, and images whose CAMERA_FEEDBACK is not sent yet.
MAX_IMAGES = 1000
# mm
FOCAL_LENGTH = 5.4
# fix_type of GPS_RAW_INT from which the camera takes a position.
FIX_3D = 3
# Over a field near Zurich.
DEFAULT_PLACE = '47.397742,8.545594,488'
UNKNOWN = 0xFFFF
UNKNOWN_SATELLITES = 0xFF
# The camera's axes in the vehicle's FRD axes at a mount of 0/0/0: x down, y right, z back.
_DOWN = Quaternion.from_euler(0.0, -math.pi / 2, 0.0)


class Source(Enum):
    """The source of a value of an image."""

    INJECTED = 'injected'
    OWN = 'own'
    NONE = 'none'


@dataclass(frozen=True)
class RedEdgeBehaviour(Behaviour):
    """
    The behaviour of a simulated camera; the defaults follow the serial API.

    :param expires: whether it uses injected state for some time only.
    :param injectable: whether it uses injected state at all.
    :param feedback: whether it sends CAMERA_FEEDBACK.
    :param feedback_delay: s from an image to its CAMERA_FEEDBACK.
    :param triggers: whether it sends CAMERA_STATUS.
    :param counts: whether it counts its images.
    :param captures: whether it takes images on DIGICAM_CONTROL.
    :param captures_panel: whether it takes images of the panel.
    :param images: how many images it takes for one DIGICAM_CONTROL.
    :param takes_any_shot: whether it takes images for values of ``shot`` that do not exist.
    :param ping_component: offset of the component id that answers PING.
    :param ping_sequence: offset of the sequence number in the answer.
    :param ping_target: whether the answer is addressed to the sender.
    :param extension: whether CAMERA_FEEDBACK has its extension field.
    """

    heartbeat_autopilot: int = 1
    heartbeat_base_mode: int = 2
    heartbeat_custom_mode: int = 3
    answers_commands: bool = False
    adopts_system_id: bool = fault(
        True, 'fixed-system', 'keeps its system ID, and takes messages for that only')
    ping_component: int = fault(0, 'other-ping', 'lets another component answer PING', 1)
    ping_sequence: int = fault(0, 'ping-sequence', 'answers PING with another sequence number', 1)
    ping_target: bool = fault(True, 'ping-target', 'answers PING without a target')
    triggers: bool = fault(True, 'no-status', 'sends no CAMERA_STATUS')
    feedback: bool = fault(True, 'no-feedback', 'sends no CAMERA_FEEDBACK')
    feedback_delay: float = fault(
        FEEDBACK_DELAY, 'late', 'sends CAMERA_FEEDBACK S seconds after the image', 15.0, SECONDS)
    counts: bool = fault(True, 'same-index', 'does not count its images')
    captures: bool = fault(True, 'no-captures', 'takes no image on DIGICAM_CONTROL')
    captures_panel: bool = fault(True, 'no-panel', 'takes no image of the panel')
    images: int = fault(1, 'burst', 'takes N images for one request', 3, COUNT)
    takes_any_shot: bool = fault(False, 'any-shot', 'takes an image for each value of shot')
    injectable: bool = fault(True, 'no-injection', 'ignores injected position, time and attitude')
    expires: bool = fault(True, 'stale', 'uses injected state for ever')
    extension: bool = fault(
        False, 'extension',
        'sends CAMERA_FEEDBACK with its extension field, which MAVLink 1 does not have')


# It has no commands, and no streams.
FAULTS = FaultTable.of(
    RedEdgeBehaviour, 'refuse', 'progress', 'busy', 'lie', 'no-int', 'no-broadcast', 'no-stop',
    'fixed-rate', 'disobey', 'unknown', 'no-request', 'no-resume', 'misaddress')


class ExtendedCameraFeedback(rededge.CameraFeedback):
    """CAMERA_FEEDBACK as some libraries send it with MAVLink 1: 47 bytes instead of 45."""

    mavlink_1_size = rededge.CameraFeedback.unpacker.size


class Injected(NamedTuple):
    """A message of the host, and when it was received, s."""

    message: Any
    at: float


# The states that a message of the host gives.
INJECTED: Mapping[type[Message], Sequence[str]] = {
    rededge.GpsRawInt: ('position', 'time'), GlobalPositionInt: ('position',),
    SystemTime: ('time',), Attitude: ('attitude',), rededge.MountStatus: ('mount',)}


# The type of dataclasses.field() cannot be named.
def _column(meaning: str, text: str = '') -> Any:
    return field(metadata={'meaning': meaning, 'format': text})


@dataclass(frozen=True)
class Image:
    """The metadata of an image, in the order of the columns; None is an empty field."""

    camera: int = _column('component id of the camera')
    image: int = _column('number of the image since power on')
    shot: str = _column('`survey` or `panel`')
    trigger: str = _column('`mavlink`, `interval` or `console`')
    img_idx: int | None = _column('number in CAMERA_FEEDBACK; counts images by MAVLink only')
    time_utc_s: float = _column("time of the image by the camera's clock, since 1970", '.6f')
    time_source: Source = _column('`injected`, `own` GPS or `none`: a clock that was never set')
    position_source: Source = _column('`injected`, `own` GPS or `none`')
    position_age_s: float | None = _column('time since the position was received', '.3f')
    fix_type: int | None = _column('as injected; 3 for GLOBAL_POSITION_INT and its own GPS')
    latitude_deg: float | None = _column('empty without a 3D fix', '.7f')
    longitude_deg: float | None = _column('likewise', '.7f')
    altitude_m: float | None = _column('above mean sea level; likewise', '.3f')
    eph_m: float | None = _column('horizontal accuracy as injected', '.2f')
    epv_m: float | None = _column('vertical accuracy as injected', '.2f')
    speed_m_s: float | None = _column('ground speed as injected', '.2f')
    course_deg: float | None = _column('course over ground as injected', '.2f')
    satellites: int | None = _column('as injected')
    attitude_source: Source = _column('`injected` or `none`')
    attitude_age_s: float | None = _column('time since the attitude was received', '.3f')
    roll_deg: float | None = _column("the vehicle's roll, FRD in NED", '.3f')
    pitch_deg: float | None = _column('its pitch', '.3f')
    yaw_deg: float | None = _column('its yaw, 0..360', '.3f')
    mount_source: Source = _column('`injected`, or `none`: 0/0/0')
    mount_age_s: float | None = _column('time since the mount angles were received', '.3f')
    mount_roll_deg: float = _column('roll of the camera in the vehicle, about its line of sight',
                                    '.2f')
    mount_pitch_deg: float = _column('its pitch', '.2f')
    mount_yaw_deg: float = _column('its yaw', '.2f')
    camera_roll_deg: float | None = _column(
        'roll of the camera in the earth frame, as CAMERA_FEEDBACK has it', '.3f')
    camera_pitch_deg: float | None = _column('its pitch', '.3f')
    camera_yaw_deg: float | None = _column('its yaw, 0..360', '.3f')

    def row(self) -> list[str]:
        """Return the fields as text."""
        return [_text(getattr(self, one.name), one.metadata['format']) for one in fields(self)]


COLUMNS: Mapping[str, str] = {one.name: one.metadata['meaning'] for one in fields(Image)}


def _text(value: object, spec: str) -> str:
    if value is None:
        return ''
    if isinstance(value, Source):
        return value.value
    return format(value, spec)


def _utc(message: rededge.GpsRawInt | SystemTime) -> float:
    """Return the time in a message, s since 1970."""
    return (message.time_usec if isinstance(message, rededge.GpsRawInt)
            else message.time_unix_usec) / 1e6


def _hundredths(value: int) -> float | None:
    return None if value == UNKNOWN else value / 100


def _position(message: rededge.GpsRawInt | GlobalPositionInt) -> SettingValues:
    """Return the columns of an injected position."""
    place = {'latitude_deg': message.lat / 1e7, 'longitude_deg': message.lon / 1e7,
             'altitude_m': message.alt / 1e3}
    if isinstance(message, GlobalPositionInt):
        north, east = message.vx / 100, message.vy / 100
        return {**place, 'fix_type': FIX_3D, 'speed_m_s': math.hypot(north, east),
                'course_deg': math.degrees(math.atan2(east, north)) % 360}
    satellites = message.satellites_visible
    return {**(place if message.fix_type >= FIX_3D else {}), 'fix_type': message.fix_type,
            'eph_m': _hundredths(message.eph), 'epv_m': _hundredths(message.epv),
            'speed_m_s': _hundredths(message.vel), 'course_deg': _hundredths(message.cog),
            'satellites': None if satellites == UNKNOWN_SATELLITES else satellites}


def _own_position(place: GeoPoint | None) -> SettingValues:
    """Return the columns of the position of its own GPS."""
    return {} if place is None else {
        'fix_type': FIX_3D, 'latitude_deg': place.latitude, 'longitude_deg': place.longitude,
        'altitude_m': place.altitude}


def _orientation(attitude: Attitude | None, mount: rededge.MountStatus | None) -> SettingValues:
    """Return the columns of the angles of vehicle, mount and camera."""
    pitch, roll, yaw = (angle / 100 for angle in (
        mount.pointing_a, mount.pointing_b, mount.pointing_c)) if mount else (0.0, 0.0, 0.0)
    columns = {'mount_roll_deg': roll, 'mount_pitch_deg': pitch, 'mount_yaw_deg': yaw}
    if attitude is None:
        return columns
    vehicle = Quaternion.from_euler(attitude.roll, attitude.pitch, attitude.yaw)
    camera = Quaternion.from_euler(*map(math.radians, (roll, pitch, yaw)))
    return {
        **columns,
        **dict(zip(('roll_deg', 'pitch_deg', 'yaw_deg'), _angles(vehicle), strict=True)),
        **dict(zip(('camera_roll_deg', 'camera_pitch_deg', 'camera_yaw_deg'),
                   _angles(vehicle * _DOWN * camera * _DOWN.inverse()), strict=True))}


def _angles(rotation: Quaternion) -> tuple[float, float, float]:
    roll, pitch, yaw = map(math.degrees, rotation.euler())
    return roll, pitch, yaw % 360


def read_place(text: str) -> GeoPoint | None:
    """
    Read ``LAT,LON,ALT`` or ``none``.

    :raises ValueError: if it is neither.
    """
    return None if text == 'none' else geo_point(text)


def _interval(text: str) -> float:
    value = number(0, 3600)(text)
    if 0 < value < SHORTEST_INTERVAL:
        raise ValueError(f'{text} is shorter than {SHORTEST_INTERVAL:g}')
    return value


@dataclass(frozen=True)
class RedEdgeProperties(simulated.Properties):
    """
    The properties of a simulated camera.

    :param address: until it hears a host.
    :param interval: s between images, 0 for none.
    :param validity: s for which injected state is used.
    :param firmware: it has no captures, and no parameters, before the firmware that brought them.
    :param own_gps: the position of its own GPS receiver, None without a fix.
    """

    address: Address = Address(DEFAULT_SYSTEM_ID, mavlink.MAV_COMP_ID_CAMERA)
    behaviour: RedEdgeBehaviour = RedEdgeBehaviour()
    interval: float = setting(
        0.0, 'S', 'take an image every S seconds, 0 for none', _interval)
    validity: float = setting(
        5.0, 'S', 'time for which injected state is used; firmware before 1.3.0 had 30',
        number(0.001, 3600))
    firmware: rededge.Firmware = setting(
        rededge.PARAMETERS, 'X.Y.Z', 'its software version (default: 7.1.0); it takes images on '
        'DIGICAM_CONTROL from 1.5.5 on, and reports the version from 7.1.0 on',
        rededge.Firmware.parse)
    own_gps: GeoPoint | None = setting(
        read_place(DEFAULT_PLACE), 'LAT,LON,ALT', "position of the camera's own GPS, above mean "
        f'sea level, or none (default: {DEFAULT_PLACE})', read_place)


def _capture(camera: SimulatedRedEdge, words: list[str], now: float) -> simulated.Effect:
    if words not in ([], ['panel']):
        raise ValueError(f'{words[0]!r} is not panel')

    def capture() -> None:
        camera.capture(rededge.Shot.PANEL if words else rededge.Shot.SURVEY, 'console', now)
    return capture


COMMANDS: tuple[simulated.ConsoleCommand[SimulatedRedEdge, simulated.Effect], ...] = (
    simulated.ConsoleCommand('capture [panel]', 'take an image, as by a button on the camera',
                             _capture),
    simulated.ConsoleCommand(
        'interval S', 'take an image every S seconds; 0 ends it', lambda camera, words, now:
        partial(camera.set_interval, _interval(words[0]), now)),
    simulated.ConsoleCommand(
        'own-gps PLACE', 'LAT,LON,ALT of its own GPS, or none', lambda camera, words, now:
        partial(camera.set_own_gps, read_place(words[0]))),
)


class SimulatedRedEdge(simulated.SimulatedDevice):
    """
    A simulated camera, without the link: see :class:`SimulatedDevice`.

    It takes images on DIGICAM_CONTROL, at an interval, and on a console command. It uses position,
    time, attitude and mount angles of the host for some time after it has received them, and then
    the position and time of its own GPS.

    :ivar images: the latest images.
    :ivar own_gps: the position of its own GPS receiver, None without a fix.
    """

    messages = (Heartbeat, rededge.Ping, rededge.GpsRawInt, rededge.GpsStatus, SystemTime,
                GlobalPositionInt, Attitude, rededge.MountStatus, rededge.DigicamControl,
                rededge.ParamRequestRead)
    sends = (Heartbeat, rededge.Ping, rededge.ParamValue, rededge.CameraStatus,
             rededge.CameraFeedback)
    faults = FAULTS
    commands = COMMANDS
    properties: RedEdgeProperties
    behaviour: RedEdgeBehaviour

    def __init__(self, properties: RedEdgeProperties) -> None:
        super().__init__(properties)
        self.own_gps = properties.own_gps
        self.images: deque[Image] = deque(maxlen=MAX_IMAGES)
        # Unix time at 0 on the link's clock.
        self._epoch = 0.0

    def restart(self, now: float) -> None:
        """See :meth:`SimulatedDevice.restart`; its own GPS has a fix at once."""
        self._count = self._index = 0
        # By state.
        self._injected: dict[str, Injected] = {}
        self._ground: float | None = None
        # The feedback of images, with its time.
        self._pending: deque[tuple[float, rededge.CameraFeedback]] = deque(maxlen=MAX_IMAGES)
        self.set_interval(self.properties.interval, now)

    def set_clock(self, unix_time: float, now: float) -> None:
        """See :meth:`SimulatedDevice.set_clock`: the time of its own GPS."""
        self._epoch = unix_time - now

    def set_interval(self, interval: float, now: float) -> None:
        """Take an image at each interval from now on, s, 0 for none."""
        self._interval = interval
        self._image_due = now + (interval or math.inf)

    def set_own_gps(self, place: GeoPoint | None) -> None:
        """Set the position of its own GPS receiver, None without a fix."""
        self.own_gps = place

    def source(self, message: Message, own: Address) -> Address:
        """See :meth:`SimulatedDevice.source`."""
        if isinstance(message, rededge.Ping):
            return Address(own.system, (own.component + self.behaviour.ping_component) & 0xFF)
        return own

    # Messages of the host

    def receive(self, source: Address, message: Message, now: float) -> Iterable[Message]:
        """See :meth:`SimulatedDevice.receive`."""
        # The images that are due were taken before the message came.
        self._capture_due_images(now)
        if isinstance(message, rededge.Ping):
            return self._answer(source, message)
        if isinstance(message, rededge.DigicamControl):
            return self._control(source, message, now)
        if isinstance(message, rededge.ParamRequestRead):
            firmware = self.properties.firmware
            is_known = (firmware >= rededge.PARAMETERS
                        and raw(message, 'param_id').rstrip(b'\0') == rededge.VERSION_PARAMETER)
            return (firmware.value(),) if is_known else ()
        if self.behaviour.injectable and (
                not isinstance(message, Attitude) or is_plausible(message)):
            self._injected |= {
                state: Injected(message, now) for state in INJECTED.get(type(message), ())}
        return ()

    def _answer(self, source: Address, ping: rededge.Ping) -> Iterable[Message]:
        if any(target_of(ping)):
            return
        target = source if self.behaviour.ping_target else Address(0, 0)
        yield replaced(ping, seq=(ping.seq + self.behaviour.ping_sequence) & 0xFFFFFFFF,
                       target_system=target.system, target_component=target.component)

    def _control(
        self, source: Address, control: rededge.DigicamControl, now: float,
    ) -> Iterable[Message]:
        behaviour = self.behaviour
        is_panel = control.shot == rededge.Shot.PANEL
        taken = (behaviour.captures_panel if is_panel else
                 control.shot == rededge.Shot.SURVEY or behaviour.takes_any_shot)
        if not (taken and behaviour.captures and self.properties.firmware >= rededge.CAPTURES):
            return
        for _ in range(behaviour.images):
            self._index = (self._index + behaviour.counts) & 0xFFFF
            image = self.capture(
                rededge.Shot.PANEL if is_panel else rededge.Shot.SURVEY, 'mavlink', now)
            if behaviour.feedback:
                self._pending.append((
                    now + behaviour.feedback_delay, self._feedback(image, source.system)))
            if behaviour.triggers:
                yield rededge.CameraStatus(
                    _microseconds(image.time_utc_s), source.system, 0, self._index,
                    mavlink.CAMERA_STATUS_TYPE_TRIGGER, 0.0, 0.0, 0.0, 0.0)

    # Images

    def capture(self, shot: rededge.Shot, trigger: str, now: float) -> Image:
        """
        Take an image now, and record its metadata.

        :param trigger: as in the column of that name.
        """
        self._count += 1
        time_utc, time_source = self._clock(now)
        fresh = {state: self._fresh(state, now) for state in ('position', 'attitude', 'mount')}
        position, attitude, mount = (one and one.message for one in fresh.values())
        image = Image(**{
            **dict.fromkeys(COLUMNS),
            **(_position(position) if position else _own_position(self.own_gps)),
            **_orientation(attitude, mount),
            'camera': self.properties.address.component, 'image': self._count,
            'shot': shot.name.lower(), 'trigger': trigger,
            'img_idx': self._index if trigger == 'mavlink' else None,
            'time_utc_s': time_utc, 'time_source': time_source,
            **{f'{state}_source': self._source(state, now) for state in fresh},
            **{f'{state}_age_s': one and now - one.at for state, one in fresh.items()}})
        if self._ground is None:
            self._ground = image.altitude_m
        self.images.append(image)
        self.records.emit(image.row())
        return image

    def _fresh(self, state: str, now: float) -> Injected | None:
        """Return the message with a state of the host, None if there is none, or it is old."""
        one = self._injected.get(state)
        expired = one and self.behaviour.expires and now - one.at > self.properties.validity
        return None if expired else one

    def _source(self, state: str, now: float) -> Source:
        if self._fresh(state, now):
            return Source.INJECTED
        has_own = self.own_gps and state in ('position', 'time')
        return Source.OWN if has_own else Source.NONE

    def _clock(self, now: float) -> tuple[float, Source]:
        """Return the time by the camera's clock, s since 1970, and its source."""
        source, injected = self._source('time', now), self._injected.get('time')
        if source is Source.OWN:
            return self._epoch + now, source
        # A clock that was set once keeps running.
        return (_utc(injected.message) + now - injected.at if injected else now), source

    def _feedback(self, image: Image, system: int) -> rededge.CameraFeedback:
        kind = ExtendedCameraFeedback if self.behaviour.extension else rededge.CameraFeedback
        altitude = image.altitude_m or 0.0
        return kind(
            _microseconds(image.time_utc_s), system, 0, self._index,
            round((image.latitude_deg or 0.0) * 1e7), round((image.longitude_deg or 0.0) * 1e7),
            altitude, altitude - (self._ground or 0.0), image.camera_roll_deg or 0.0,
            image.camera_pitch_deg or 0.0, image.camera_yaw_deg or 0.0, FOCAL_LENGTH,
            mavlink.CAMERA_FEEDBACK_CLOSEDLOOP)

    # Time

    def poll(self, now: float) -> Iterable[Message]:
        """See :meth:`SimulatedDevice.poll`."""
        self._capture_due_images(now)
        while self._pending and now >= self._pending[0][0]:
            yield self._pending.popleft()[1]

    def _capture_due_images(self, now: float) -> None:
        while now >= self._image_due:
            self.capture(rededge.Shot.SURVEY, 'interval', self._image_due)
            self._image_due += self._interval

    @property
    def due(self) -> float:
        """See :attr:`SimulatedDevice.due`."""
        return min(self._image_due, self._pending[0][0] if self._pending else math.inf)

    def snapshot(self, now: float) -> simulated.Snapshot:
        """See :meth:`SimulatedDevice.snapshot`."""
        count = f'{self._count:4} image{"s" if self._count != 1 else " "}'
        shown = (count, *(f'{state} {self._source(state, now).value}'
                          for state in ('time', 'position', 'attitude', 'mount')))
        return simulated.Snapshot('  '.join(shown), shown)


def _microseconds(seconds: float) -> int:
    return min(max(round(seconds * 1e6), 0), 2 ** 64 - 1)


SIMULATED = simulated.SimulatedType(
    'camera', 'cameras', SimulatedRedEdge, RedEdgeProperties(),
    examples=(
        '--payload rededge --interval 1 --images flight.csv',
        '--payload rededge pty:///tmp/ttyREDEDGE',
        '--payload rededge --firmware 1.3.2',
        '--payload rededge --fault no-feedback'),
    mavlink_version=1, url='udpout://127.0.0.1:14592',
    records=simulated.RecordType(
        'images', 'write the metadata of each image to FILE as CSV', tuple(COLUMNS)))
