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

"""
The checks of a camera: the requirements of the RedEdge serial API.

Checks that take images, or give the camera a false position and attitude, need consent. The camera
may leave out anything that a later firmware than its own brought.
"""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Sequence
from dataclasses import replace
from functools import partial, wraps
from itertools import pairwise
import math
from typing import NamedTuple, TypeAlias

from . import conversions
from . import messages as rededge
from ..mavlink.dialect import mavlink
from ..mavlink.messages import Address, Heartbeat, Message, target_of
from ..payload.checks import component_requirements as component
from ..payload.checks.outcomes import Failed, Skipped
from ..payload.checks.requirement import (
    Conditions,
    PayloadChecks,
    Requirement,
    requirement,
    Specification,
    Tester,
)
from ..payload.checks.session import Session
from ..payload.messages import Attitude, GlobalPositionInt, SystemTime

SERIAL_API = Specification(
    'RedEdge serial API', 'https://micasense.github.io/rededge-api/api/serial.html')
HEARTBEAT_CONTENTS = Heartbeat(0, 1, 2, 3, 4, 3)
# s
PING_TIMEOUT = 1.0
LATE_TIMEOUT = 2.0
STATUS_TIMEOUT = 2.0
FEEDBACK_TIMEOUT = 10.0
# s; the time for which the report of an image that must not be taken is awaited.
NO_IMAGE_TIME = 3.0
# s; attempts to find out whether the camera has captures, and whether it reports its version.
CAPTURE_TIMEOUT, VERSION_TIMEOUT = 2.5, 1.0
CAPTURE_ATTEMPTS, VERSION_ATTEMPTS = 3, 2
INJECTION_TIME = 1.0
INJECTION_INTERVAL = 0.2
# s after the last injected state: the camera still uses it, and no longer uses it.
WITHIN_VALIDITY, AFTER_VALIDITY = 3.0, 7.0
MAX_CLOCK_ERROR = 2.0

PING_ATTEMPTS = 3
# A component that is not a camera.
OTHER_COMPONENT = 1
SHOTS_WITHOUT_IMAGE = (0, 3)
# Degrees; m. The place in the ocean that is farthest from any land: no camera is there.
LATITUDE, LONGITUDE, ALTITUDE = -48.8766667, -123.3933333, 1234.5
MAX_PLACE_ERROR, MAX_ALTITUDE_ERROR, MAX_ANGLE_ERROR = 2e-7, 0.1, 0.1


class Capture(NamedTuple):
    """The messages that reported an image; None for a message that did not come."""

    status: rededge.CameraStatus | None
    feedback: rededge.CameraFeedback | None

    @property
    def taken(self) -> bool:
        """Whether an image was reported."""
        return self.status is not None or self.feedback is not None


class CameraTester:
    """Pings the camera, injects state, and takes images: see :class:`Tester`."""

    def __init__(self, session: Session, conditions: Conditions) -> None:
        self.session = session
        self.conditions = conditions
        self._sequence = 0
        self._first: Capture | None = None
        self._version: rededge.Firmware | None = None
        self._asked_version = False

    @property
    def saved(self) -> str:
        """See :class:`Tester`."""
        return ''

    async def save(self) -> bool:
        """See :class:`Tester`; the injected state of the camera lapses by itself."""
        return True

    async def restore(self) -> list[str]:
        """See :class:`Tester`."""
        return []

    async def ping(
        self, sequence: int | None = None, source: Address | None = None,
    ) -> rededge.Ping:
        """
        Return the answer to a PING request.

        :param sequence: its sequence number, by default a new one.
        :param source: its address, by default the session's.
        :raises Failed: if none of several requests is answered, or one is answered late.
        """
        for _ in range(PING_ATTEMPTS):
            begun = self.session.now
            self._sequence += 1
            number = self._sequence if sequence is None else sequence
            self.session.send(rededge.Ping(self._utc_us(), number, 0, 0), source)
            if answers := await self.session.receive_more(rededge.Ping, PING_TIMEOUT):
                return answers[-1][1]
            # A late answer must not be assigned to the next request.
            if await self.session.receive_more(rededge.Ping, LATE_TIMEOUT):
                raise Failed(f'answered after {self.session.now - begun:.1f} s')
        self.session.check_presence()
        raise Failed(f'no answer to {PING_ATTEMPTS} requests within {PING_TIMEOUT:g} s each')

    async def capture(
        self, shot: int = rededge.Shot.SURVEY, *, component: int = mavlink.MAV_COMP_ID_CAMERA,
        system: int | None = None, timeout: float = FEEDBACK_TIMEOUT,
        state: Callable[[], Sequence[Message]] = tuple,
    ) -> Capture:
        """
        Command an image, and return the camera's reports of it.

        :param system: the target system, by default the camera's.
        :param timeout: s to wait for CAMERA_FEEDBACK.
        :param state: returns messages that are sent during the wait.
        """
        session = self.session
        statuses = session.received(rededge.CameraStatus)
        feedbacks = session.received(rededge.CameraFeedback)
        earlier = {one.img_idx for _, one in statuses}
        before = statuses.total, feedbacks.total

        def reported() -> Capture:
            status = statuses[-1][1] if statuses.total > before[0] else None
            # Feedback of an earlier image may be late.
            return Capture(status, next((one for _, one in feedbacks.since(before[1]) if (
                one.img_idx == status.img_idx if status else one.img_idx not in earlier)), None))

        session.send(rededge.DigicamControl(
            session.device.system if system is None else system, component, 1, 1, 0, 0, shot, 0,
            0, 0.0))
        until = session.now + timeout
        while session.now < until and not reported().feedback:
            for message in state():
                session.send(message)
            await session.runner.until(
                lambda: reported().feedback, min(INJECTION_INTERVAL, until - session.now))
        await session.runner.until(
            lambda: reported().status, STATUS_TIMEOUT if reported().feedback else 0.0)
        session.check_presence()
        return reported()

    async def first_capture(self) -> Capture:
        """
        Return the first image that was commanded.

        :raises Skipped: if the camera has no captures, as before the firmware that brought them.
        :raises Failed: if it has none, and its firmware is newer.
        """
        if self._first is None:
            for _ in range(CAPTURE_ATTEMPTS):
                self._first = await self.capture(timeout=CAPTURE_TIMEOUT)
                if self._first.taken:
                    break
        assert self._first is not None
        if not self._first.taken:
            if (version := await self._reported_version()) and version >= rededge.CAPTURES:
                raise Failed(f'confirms no captures, with firmware {version}')
            raise Skipped(f'confirms no captures, as firmware before {rededge.CAPTURES}')
        return self._first

    async def excuse(self, failure: Failed, since: rededge.Firmware) -> None:
        """
        Raise a failure, or Skipped if the camera may have an older firmware.

        :param since: the firmware from which on it is a failure.
        """
        is_newer = since <= rededge.CAPTURES and self._first is not None and self._first.taken
        version = None if is_newer else await self._reported_version()
        if is_newer or version and version >= since:
            raise failure
        raise Skipped(f'{failure}, as firmware before {since} may')

    async def _reported_version(self) -> rededge.Firmware | None:
        """Return the version of the firmware, None if the camera does not report it."""
        for _ in range(0 if self._asked_version else VERSION_ATTEMPTS):
            self.session.send(rededge.ParamRequestRead(
                self.session.device.system, mavlink.MAV_COMP_ID_CAMERA, rededge.VERSION_PARAMETER,
                -1))
            for _, value in await self.session.receive_more(rededge.ParamValue, VERSION_TIMEOUT):
                self._version = rededge.Firmware.from_value(value) or self._version
            if self._version:
                break
        self._asked_version = True
        return self._version

    async def image(
        self, shot: int = rededge.Shot.SURVEY, *, component: int = mavlink.MAV_COMP_ID_CAMERA,
        system: int | None = None, state: Callable[[], Sequence[Message]] = tuple,
    ) -> rededge.CameraFeedback:
        """
        Command an image, and return its CAMERA_FEEDBACK; see :meth:`capture`.

        :raises Failed: if there is none.
        """
        one = await self.capture(shot, component=component, system=system, state=state)
        if one.feedback is None:
            raise Failed(f'no CAMERA_FEEDBACK within {FEEDBACK_TIMEOUT:g} s'
                         + (' after CAMERA_STATUS' if one.status else ', nor CAMERA_STATUS'))
        return one.feedback

    async def inject(self, state: Callable[[], Sequence[Message]]) -> None:
        """Send state for some time, so that the camera uses it."""
        until = self.session.now + INJECTION_TIME
        while self.session.now < until:
            for message in state():
                self.session.send(message)
            await self.session.runner.sleep(INJECTION_INTERVAL)

    def raw_position(self) -> Sequence[Message]:
        """Return a position with its time, as GPS_RAW_INT."""
        return (rededge.GpsRawInt(
            self._utc_us(), 3, round(LATITUDE * 1e7), round(LONGITUDE * 1e7),
            round(ALTITUDE * 1e3), *(conversions.UINT16_UNKNOWN,) * 4,
            conversions.UINT8_UNKNOWN),)

    def fused_position(self) -> Sequence[Message]:
        """Return the same position as SYSTEM_TIME and GLOBAL_POSITION_INT."""
        return (SystemTime(self._utc_us(), 0), GlobalPositionInt(
            0, round(LATITUDE * 1e7), round(LONGITUDE * 1e7), round(ALTITUDE * 1e3), 0, 0, 0, 0,
            conversions.UINT16_UNKNOWN))

    def attitude(self, yaw: float, mount_roll: float) -> Sequence[Message]:
        """Return a level attitude with a yaw, and a mount with a roll, degrees."""
        return (Attitude(0, 0.0, 0.0, math.radians(yaw), 0.0, 0.0, 0.0),
                rededge.MountStatus(self.session.device.system, mavlink.MAV_COMP_ID_CAMERA, 0,
                                    round(mount_roll * 100), 0))

    def clock_error(self, feedback: rededge.CameraFeedback) -> float:
        """Return the error of the time of an image that was taken now, s."""
        return feedback.time_usec / 1e6 - self.conditions.utc()

    def _utc_us(self) -> int:
        return int(self.conditions.utc() * 1e6)


def is_at_injected_place(feedback: rededge.CameraFeedback) -> bool:
    """Return whether an image was taken at the place of :meth:`CameraTester.raw_position`."""
    return (abs(feedback.lat / 1e7 - LATITUDE) <= MAX_PLACE_ERROR
            and abs(feedback.lng / 1e7 - LONGITUDE) <= MAX_PLACE_ERROR
            and abs(feedback.alt_msl - ALTITUDE) <= MAX_ALTITUDE_ERROR)


def _place(feedback: rededge.CameraFeedback) -> str:
    return f'{feedback.lat / 1e7:.7f}, {feedback.lng / 1e7:.7f}, {feedback.alt_msl:.2f} m'


Check: TypeAlias = Callable[[CameraTester], Awaitable['str | None']]


def requires(
    name: str, title: str, section: str, *, since: rededge.Firmware | None = None,
    needs_consent: bool = False, whole_run: bool = False,
) -> Callable[[Check], Requirement[CameraTester]]:
    """
    Return a decorator that makes a requirement of a check.

    :param since: the firmware that brought what is required, None for the first.
    :param needs_consent: whether it takes images, which a camera without captures does not.
    """
    def complete(check: Check) -> Requirement[CameraTester]:
        @wraps(check)
        async def checked(tester: CameraTester) -> str | None:
            if needs_consent:
                await tester.first_capture()
            try:
                return await check(tester)
            except Failed as failure:
                if since is None:
                    raise
                await tester.excuse(failure, since)
                return None
        return requirement(name, title, SERIAL_API, section, needs_consent=needs_consent,
                           whole_run=whole_run)(checked)
    return complete


with_captures = partial(requires, needs_consent=True, since=rededge.CAPTURES)
with_ids = partial(requires, section='Communicating', since=rededge.IDS)


# Liveness

@requires('ping', 'answers PING', section='PING')
async def ping(tester: CameraTester) -> str:
    """Measure the round trip."""
    begun = tester.session.now
    await tester.ping()
    return f'in {(tester.session.now - begun) * 1e3:.0f} ms'


@requires('ping-sequence', 'answers PING with its sequence number', section='PING')
async def ping_sequence(tester: CameraTester) -> None:
    """Send PINGs with both ends of the range, too."""
    for sequence in (0, 1, 2 ** 32 - 1):
        if (answer := await tester.ping(sequence)).seq != sequence:
            raise Failed(f'answers sequence number {sequence} with {answer.seq}')


@requires('ping-once', 'answers PING once', section='PING')
async def ping_once(tester: CameraTester) -> None:
    """Count the answers."""
    answers = tester.session.received(rededge.Ping)
    before = answers.total
    await tester.ping()
    await tester.session.runner.sleep(PING_TIMEOUT)
    if (count := answers.total - before) != 1:
        raise Failed(f'{count} answers')


@requires('ping-target', 'addresses the answer to PING to its sender', section='PING')
async def ping_target(tester: CameraTester) -> None:
    """Read the target of an answer."""
    target = target_of(await tester.ping())
    if target != tester.session.address:
        raise Failed(f'to {target} instead of {tester.session.address}')


@with_ids('system-id', 'adopts the system ID of the host')
async def system_id(tester: CameraTester) -> str:
    """Send PING from another system, then from our own."""
    own = tester.session.address
    for source in (Address(own.system % 254 + 1, own.component), own):
        await tester.ping(source=source)
        if tester.session.device.system != source.system:
            raise Failed(f'after a message from {source} it sends from {tester.session.device}')
    return f'now {tester.session.device}'


# Captures

@with_captures('capture-status', 'reports an image that was commanded with CAMERA_STATUS',
               section='CAMERA_STATUS')
async def capture_status(tester: CameraTester) -> None:
    """Read the status of the first image."""
    status = (await tester.first_capture()).status
    if status is None:
        raise Failed('no CAMERA_STATUS')
    if status.event_id != mavlink.CAMERA_STATUS_TYPE_TRIGGER:
        raise Failed(
            f'event_id {status.event_id} instead of {mavlink.CAMERA_STATUS_TYPE_TRIGGER:d}')


@with_captures('capture-feedback', 'confirms an image with CAMERA_FEEDBACK',
               section='CAMERA_FEEDBACK')
async def capture_feedback(tester: CameraTester) -> str:
    """Command an image, and measure the time."""
    begun = tester.session.now
    feedback = await tester.image()
    expected = mavlink.CAMERA_FEEDBACK_CLOSEDLOOP
    if feedback.flags != expected:
        raise Failed(f'flags {feedback.flags} instead of {expected:d}')
    return f'after {tester.session.now - begun:.1f} s'


@with_captures('capture-panel', 'takes an image of the panel', section='DIGICAM_CONTROL')
async def capture_panel(tester: CameraTester) -> None:
    """Command an image with shot 2."""
    await tester.image(rededge.Shot.PANEL)


@with_captures('shot-values', 'takes no image for other values of shot', section='DIGICAM_CONTROL')
async def shot_values(tester: CameraTester) -> None:
    """Send 0 and 3."""
    for shot in SHOTS_WITHOUT_IMAGE:
        if (await tester.capture(shot, timeout=NO_IMAGE_TIME)).taken:
            raise Failed(f'takes an image for shot {shot}')


@with_ids('other-component', 'ignores messages for other components', needs_consent=True)
async def other_component(tester: CameraTester) -> None:
    """Command an image of another component."""
    if (await tester.capture(component=OTHER_COMPONENT, timeout=NO_IMAGE_TIME)).taken:
        raise Failed(f'takes an image that component {OTHER_COMPONENT} was requested to take')


@with_ids('all-components', 'takes messages for all components', needs_consent=True)
async def all_components(tester: CameraTester) -> None:
    """Command an image of component 0."""
    await tester.image(component=0)


@with_ids('any-system', 'ignores the target system', needs_consent=True)
async def any_system(tester: CameraTester) -> None:
    """Command an image of another system."""
    await tester.image(system=tester.session.device.system % 254 + 1)


# Injected state

def _position(
    name: str, section: str, state: Callable[[CameraTester], Sequence[Message]],
) -> Requirement[CameraTester]:
    """Return the requirement that images have the position and time of some messages."""
    @with_captures(name, f'writes position and time of {section} into images', section=section)
    async def check(tester: CameraTester) -> str:
        await tester.inject(lambda: state(tester))
        feedback = await tester.image(state=lambda: state(tester))
        if not is_at_injected_place(feedback):
            raise Failed(f'{_place(feedback)} instead of {LATITUDE}, {LONGITUDE}, {ALTITUDE} m')
        error = tester.clock_error(feedback)
        if not -FEEDBACK_TIMEOUT - MAX_CLOCK_ERROR < error < MAX_CLOCK_ERROR:
            raise Failed(f'the time of the image is wrong by {error:.1f} s')
        return _place(feedback)
    return check


@with_captures('attitude', 'combines ATTITUDE and MOUNT_STATUS', section='MOUNT_STATUS')
async def attitude(tester: CameraTester) -> str:
    """Turn the vehicle, then the camera about its line of sight; both turn the image."""
    for yaw, mount_roll in ((90.0, 0.0), (90.0, 30.0)):
        state = partial(tester.attitude, yaw, mount_roll)
        await tester.inject(state)
        feedback = await tester.image(state=state)
        error = (feedback.yaw - yaw - mount_roll + 180) % 360 - 180
        if not abs(error) <= MAX_ANGLE_ERROR:
            raise Failed(f'yaw {feedback.yaw:.2f} degrees with a vehicle at {yaw:g} and a mount '
                         f'at {mount_roll:g}')
    return f'yaw {feedback.yaw:.2f} degrees'


@with_captures('validity', 'uses an injected position for 5 s', section='GPS')
async def validity(tester: CameraTester) -> None:
    """Inject a position, and take an image before and after that time."""
    await tester.inject(tester.raw_position)
    ended = tester.session.now
    for wait, used in ((WITHIN_VALIDITY, True), (AFTER_VALIDITY, False)):
        await tester.session.runner.sleep(max(ended + wait - tester.session.now, 0.0))
        if is_at_injected_place(await tester.image()) is not used:
            raise Failed(f'{"not used" if used else "still used"} {wait:g} s later')


# The messages of a whole run

@requires('heartbeat-contents', 'sends the documented values in HEARTBEAT', section='HEARTBEAT',
          since=rededge.CAPTURES, whole_run=True)
async def heartbeat_contents(tester: CameraTester) -> None:
    """Read the latest HEARTBEAT."""
    received = tester.session.received(Heartbeat)
    if received and received[-1][1] != HEARTBEAT_CONTENTS:
        raise Failed(f'{received[-1][1]} instead of {HEARTBEAT_CONTENTS}')


@requires('capture-index', 'counts the images that were commanded', section='CAMERA_FEEDBACK',
          whole_run=True)
async def capture_index(tester: CameraTester) -> str:
    """Compare the numbers of consecutive images."""
    indexes = [one.img_idx for _, one in tester.session.received(rededge.CameraFeedback)]
    if len(indexes) < 2:
        raise Skipped('fewer than two images were confirmed')
    for first, second in pairwise(indexes):
        if second != (first + 1) & 0xFFFF:
            raise Failed(f'img_idx {first}, then {second}')
    return f'{indexes[0]} to {indexes[-1]}'


@requires('mavlink-1', 'sends MAVLink 1 frames only', section='General Protocol Overview',
          whole_run=True)
async def mavlink_1(tester: CameraTester) -> str:
    """Count the frames."""
    versions = tester.session.record.versions
    if versions[2]:
        raise Failed(f'{versions[2]} of {versions.total()} frames are of MAVLink 2')
    return f'{versions[1]} frames'


@requires('lengths', 'sends every message with its MAVLink 1 length',
          section='General Protocol Overview', whole_run=True)
async def lengths(tester: CameraTester) -> None:
    """Compare the lengths of the frames."""
    if odd := tester.session.record.odd_lengths:
        raise Failed(', '.join(f'{name} with {size} bytes' for name, size in odd.items()))


def _documented(one: Requirement[Tester], title: str = '') -> Requirement[Tester]:
    """Return a requirement on any component, with the serial API as its specification."""
    return replace(one, specification=SERIAL_API, section='HEARTBEAT', title=title or one.title)


REQUIREMENTS: tuple[Requirement[CameraTester], ...] = (
    _documented(component.heartbeat,
                f'sends HEARTBEAT from component {mavlink.MAV_COMP_ID_CAMERA} '
                '(MAV_COMP_ID_CAMERA)'),
    ping, ping_sequence, ping_once, ping_target, system_id,
    capture_status, capture_feedback, capture_panel, shot_values,
    other_component, all_components, any_system,
    _position('raw-position', 'GPS_RAW_INT', CameraTester.raw_position),
    _position('fused-position', 'GLOBAL_POSITION_INT', CameraTester.fused_position),
    attitude, validity,
    _documented(component.heartbeat_rate), heartbeat_contents, capture_index,
    mavlink_1, lengths, component.checksums,
)


def describe(message: Message) -> str:
    """Return the text of a message of the camera, '' for another message."""
    if isinstance(message, rededge.Ping):
        target = target_of(message)
        return f'PING {message.seq} to {target}' if any(target) else f'PING {message.seq}'
    if isinstance(message, rededge.DigicamControl):
        return f'DIGICAM_CONTROL to {target_of(message)}: shot {message.shot}'
    if isinstance(message, rededge.ParamRequestRead | rededge.ParamValue):
        return f'{message.get_type()} {message.param_id}'
    if isinstance(message, rededge.CameraStatus):
        return f'CAMERA_STATUS image {message.img_idx}, event {message.event_id}'
    if isinstance(message, rededge.CameraFeedback):
        return (f'CAMERA_FEEDBACK image {message.img_idx} at {_place(message)}, '
                f'yaw {message.yaw:.2f}')
    return ''


CHECKS: PayloadChecks[CameraTester] = PayloadChecks(
    payload='rededge', device='camera',
    messages=(rededge.Ping, rededge.ParamValue, rededge.CameraStatus, rededge.CameraFeedback),
    is_device=lambda message: isinstance(message, Heartbeat), component=mavlink.MAV_COMP_ID_CAMERA,
    evidence=f'HEARTBEAT from component {mavlink.MAV_COMP_ID_CAMERA}', describe=describe,
    tester=CameraTester, requirements=REQUIREMENTS, mavlink_version=1,
    risk='take images with a false position',
    question='Some checks make camera {device} take about 15 images, most with a false position '
             f'({LATITUDE:.1f}, {LONGITUDE:.1f})\nand a false attitude. They stay on its card. '
             'All other checks run in any case.\nMay camera {device} take these images? [y/N] ',
    traces='its new images')
