# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

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
from ..checks import component_requirements as component
from ..checks.outcomes import Failed, Skipped
from ..checks.requirements import PayloadChecks, Requirement, requirement
from ..checks.session import Conditions, Session
from ..checks.specifications import Specification
from ..mavlink.dialect import mavlink
from ..mavlink.messages import Address, Heartbeat, Message, target_of
from ..payload.messages import Attitude, GlobalPositionInt, SystemTime

SERIAL_API = Specification(
    'RedEdge serial API', 'https://micasense.github.io/rededge-api/api/serial.html')
CAMERA_ID = mavlink.MAV_COMP_ID_CAMERA
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
# The images that are announced, and a few more because requests may be repeated.
ANNOUNCED_IMAGES, MAX_IMAGES = 15, 20
# Degrees; m. The place in the ocean that is farthest from any land: no camera is there.
LATITUDE, LONGITUDE, ALTITUDE = -48.8766667, -123.3933333, 1234.5
# The same in the fields of messages: 1e-7 degrees, and mm.
PLACE = round(LATITUDE * 1e7), round(LONGITUDE * 1e7), round(ALTITUDE * 1e3)
MAX_PLACE_ERROR, MAX_ALTITUDE_ERROR, MAX_ANGLE_ERROR = 2e-7, 0.1, 0.1

# Returns the messages that give the camera a state.
State: TypeAlias = Callable[[], Sequence[Message]]


class Capture(NamedTuple):
    """The messages that reported an image; None for a message that did not come."""

    status: rededge.CameraStatus | None = None
    feedback: rededge.CameraFeedback | None = None

    @property
    def taken(self) -> bool:
        """Whether an image was reported."""
        return self != (None, None)


class CameraSession(Session):
    """Pings the camera, injects state, which lapses by itself, and takes images."""

    messages = (*Session.messages, rededge.Ping, rededge.ParamValue, rededge.CameraStatus,
                rededge.CameraFeedback)
    component = CAMERA_ID

    def __init__(self, conditions: Conditions) -> None:
        super().__init__(conditions)
        self._sequence = 0
        self._first: Capture | None = None
        self._version: rededge.Firmware | None = None
        self._asked_version = False

    def images(self) -> int:
        """Return the number of images that the camera has reported."""
        statuses = self.received(rededge.CameraStatus)
        feedbacks = self.received(rededge.CameraFeedback)
        return max(len({(one.img_idx, one.time_usec) for _, one in statuses}),
                   len({(one.img_idx, one.time_usec) for _, one in feedbacks}))

    def danger_of(self, message: Message) -> str:
        """See :class:`Session`: the camera must not fill its card with images."""
        if not (self.consent and isinstance(
                message, rededge.CameraStatus | rededge.CameraFeedback)):
            return ''
        count = self.images()
        return f'it took {count} images instead of about {ANNOUNCED_IMAGES}' if (
            count > MAX_IMAGES) else ''

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
            begun = self.now
            self._sequence += 1
            number = self._sequence if sequence is None else sequence
            self.send(rededge.Ping(self._utc_us(), number, 0, 0), source)
            if answers := await self.receive_more(rededge.Ping, PING_TIMEOUT):
                return answers[-1][1]
            # A late answer must not be assigned to the next request.
            if await self.receive_more(rededge.Ping, LATE_TIMEOUT):
                raise Failed(f'answered after {self.now - begun:.1f} s')
        self.check_presence()
        raise Failed(f'no answer to {PING_ATTEMPTS} requests within {PING_TIMEOUT:g} s each')

    async def capture(
        self, shot: int = rededge.Shot.SURVEY, *, component: int = CAMERA_ID,
        system: int | None = None, timeout: float = FEEDBACK_TIMEOUT, state: State = tuple,
    ) -> Capture:
        """
        Command an image, and return the camera's reports of it.

        :param system: the target system, by default the camera's.
        :param timeout: s to wait for CAMERA_FEEDBACK.
        :param state: returns messages that are sent during the wait.
        """
        statuses = self.received(rededge.CameraStatus)
        feedbacks = self.received(rededge.CameraFeedback)
        earlier = {one.img_idx for _, one in statuses}
        before = statuses.total, feedbacks.total

        def reported() -> Capture:
            status = statuses[-1][1] if statuses.total > before[0] else None
            # Feedback of an earlier image may be late.
            return Capture(status, next((one for _, one in feedbacks.since(before[1]) if (
                one.img_idx == status.img_idx if status else one.img_idx not in earlier)), None))

        self.send(rededge.DigicamControl(
            self.device.system if system is None else system, component, 1, 1, 0, 0, shot, 0, 0,
            0.0))
        until = self.now + timeout
        while self.now < until and not reported().feedback:
            self._send_all(state)
            await self.until(lambda: reported().feedback,
                             min(INJECTION_INTERVAL, until - self.now))
        if reported().feedback:
            await self.until(lambda: reported().status, STATUS_TIMEOUT)
        self.check_presence()
        return reported()

    async def first_capture(self) -> Capture:
        """
        Return the first image that was commanded.

        :raises Skipped: if the camera has no captures, as before the firmware that brought them.
        :raises Failed: if it has none, and its firmware is newer.
        """
        attempts = 0 if self._first else CAPTURE_ATTEMPTS
        for _ in range(attempts):
            self._first = await self.capture(timeout=CAPTURE_TIMEOUT)
            if self._first.taken:
                break
        assert self._first is not None
        if not self._first.taken:
            if (version := await self.firmware()) and version >= rededge.CAPTURES:
                raise Failed(f'confirms no captures, with firmware {version}')
            raise Skipped(f'confirms no captures, as firmware before {rededge.CAPTURES}')
        return self._first

    async def excuse(self, failure: Failed, since: rededge.Firmware) -> None:
        """
        Raise a failure, or Skipped if the camera may have an older firmware.

        :param since: the firmware from which on it is a failure.
        """
        version = await self.firmware()
        if version and version >= since:
            raise failure
        raise Skipped(f'{failure}, as firmware before {since} may')

    async def firmware(self) -> rededge.Firmware | None:
        """Return the firmware that the camera reports or at least has, None if it is unknown."""
        for _ in range(0 if self._asked_version else VERSION_ATTEMPTS):
            self.send(rededge.ParamRequestRead(
                self.device.system, CAMERA_ID, rededge.VERSION_PARAMETER, -1))
            for _, value in await self.receive_more(rededge.ParamValue, VERSION_TIMEOUT):
                self._version = rededge.Firmware.from_value(value) or self._version
            if self._version:
                break
        self._asked_version = True
        has_captures = self._first is not None and self._first.taken
        return self._version or (rededge.CAPTURES if has_captures else None)

    async def image(
        self, shot: int = rededge.Shot.SURVEY, *, component: int = CAMERA_ID,
        system: int | None = None, state: State = tuple,
    ) -> rededge.CameraFeedback:
        """
        Command an image, and return its confirmation.

        :raises Failed: if there is none.
        """
        one = await self.capture(shot, component=component, system=system, state=state)
        if one.feedback is None:
            raise Failed(f'no CAMERA_FEEDBACK within {FEEDBACK_TIMEOUT:g} s'
                         + (' after CAMERA_STATUS' if one.status else ', nor CAMERA_STATUS'))
        return one.feedback

    async def inject(self, state: State) -> None:
        """Send state for some time, so that the camera uses it."""
        until = self.now + INJECTION_TIME
        while self.now < until:
            self._send_all(state)
            await self.sleep(INJECTION_INTERVAL)

    def _send_all(self, state: State) -> None:
        for message in state():
            self.send(message)

    def raw_position(self) -> Sequence[Message]:
        """Return a position with its time, as GPS_RAW_INT."""
        return (rededge.GpsRawInt(
            self._utc_us(), 3, *PLACE, *(conversions.UINT16_UNKNOWN,) * 4,
            conversions.UINT8_UNKNOWN),)

    def fused_position(self) -> Sequence[Message]:
        """Return the same position as SYSTEM_TIME and GLOBAL_POSITION_INT."""
        return (SystemTime(self._utc_us(), 0),
                GlobalPositionInt(0, *PLACE, 0, 0, 0, 0, conversions.UINT16_UNKNOWN))

    def attitude(self, yaw: float, mount_roll: float) -> Sequence[Message]:
        """Return a level attitude with a yaw, and a mount with a roll, degrees."""
        return (Attitude(0, 0.0, 0.0, math.radians(yaw), 0.0, 0.0, 0.0),
                rededge.MountStatus(
                    self.device.system, CAMERA_ID, 0, round(mount_roll * 100), 0))

    def _utc_us(self) -> int:
        return int(self.conditions.utc() * 1e6)


def is_at_injected_place(feedback: rededge.CameraFeedback) -> bool:
    """Return whether an image was taken at the place of :meth:`CameraSession.raw_position`."""
    return (abs(feedback.lat / 1e7 - LATITUDE) <= MAX_PLACE_ERROR
            and abs(feedback.lng / 1e7 - LONGITUDE) <= MAX_PLACE_ERROR
            and abs(feedback.alt_msl - ALTITUDE) <= MAX_ALTITUDE_ERROR)


def _place(feedback: rededge.CameraFeedback) -> str:
    return f'{feedback.lat / 1e7:.7f}, {feedback.lng / 1e7:.7f}, {feedback.alt_msl:.2f} m'


CameraCheck: TypeAlias = Callable[[CameraSession], Awaitable['str | None']]


def requires(
    name: str, title: str, section: str, *, since: rededge.Firmware | None = None,
    needs_consent: bool = False, whole_run: bool = False,
) -> Callable[[CameraCheck], Requirement[CameraSession]]:
    """
    Return a decorator that makes a requirement of a check.

    :param since: the firmware that brought what is required, None for the first.
    :param needs_consent: whether it takes images, which a camera without captures does not.
    """
    def complete(check: CameraCheck) -> Requirement[CameraSession]:
        @wraps(check)
        async def checked(camera: CameraSession) -> str | None:
            if needs_consent:
                await camera.first_capture()
            try:
                return await check(camera)
            except Failed as failure:
                if since is None:
                    raise
                await camera.excuse(failure, since)
                return None
        return requirement(name, title, SERIAL_API, section, needs_consent=needs_consent,
                           whole_run=whole_run)(checked)
    return complete


with_captures = partial(requires, needs_consent=True, since=rededge.CAPTURES)
with_ids = partial(requires, section='Communicating', since=rededge.IDS)


# Liveness

@requires('ping', 'answers PING', section='PING')
async def ping(camera: CameraSession) -> str:
    """Measure the round trip."""
    begun = camera.now
    await camera.ping()
    return f'in {(camera.now - begun) * 1e3:.0f} ms'


@requires('ping-sequence', 'answers PING with its sequence number', section='PING')
async def ping_sequence(camera: CameraSession) -> None:
    """Send PINGs with both ends of the range, too."""
    for sequence in (0, 1, 2 ** 32 - 1):
        if (answer := await camera.ping(sequence)).seq != sequence:
            raise Failed(f'answers sequence number {sequence} with {answer.seq}')


@requires('ping-once', 'answers PING once', section='PING')
async def ping_once(camera: CameraSession) -> None:
    """Count the answers."""
    answers = camera.received(rededge.Ping)
    before = answers.total
    await camera.ping()
    await camera.sleep(PING_TIMEOUT)
    if (count := answers.total - before) != 1:
        raise Failed(f'{count} answers')


@requires('ping-target', 'addresses the answer to PING to its sender', section='PING')
async def ping_target(camera: CameraSession) -> None:
    """Read the target of an answer."""
    target = target_of(await camera.ping())
    if target != camera.address:
        raise Failed(f'to {target} instead of {camera.address}')


@with_ids('system-id', 'adopts the system ID of the host')
async def system_id(camera: CameraSession) -> str:
    """Send PING from another system, then from our own."""
    own = camera.address
    for source in (Address(own.system % 254 + 1, own.component), own):
        await camera.ping(source=source)
        if camera.device.system != source.system:
            raise Failed(f'after a message from {source} it sends from {camera.device}')
    return f'now {camera.device}'


# Captures

@with_captures('capture-status', 'reports an image that was commanded with CAMERA_STATUS',
               section='CAMERA_STATUS')
async def capture_status(camera: CameraSession) -> None:
    """Read the status of the first image."""
    status = (await camera.first_capture()).status
    if status is None:
        raise Failed('no CAMERA_STATUS')
    if status.event_id != mavlink.CAMERA_STATUS_TYPE_TRIGGER:
        raise Failed(
            f'event_id {status.event_id} instead of {mavlink.CAMERA_STATUS_TYPE_TRIGGER:d}')


@with_captures('capture-feedback', 'confirms an image with CAMERA_FEEDBACK',
               section='CAMERA_FEEDBACK')
async def capture_feedback(camera: CameraSession) -> str:
    """Command an image, and measure the time."""
    begun = camera.now
    feedback = await camera.image()
    expected = mavlink.CAMERA_FEEDBACK_CLOSEDLOOP
    if feedback.flags != expected:
        raise Failed(f'flags {feedback.flags} instead of {expected:d}')
    return f'after {camera.now - begun:.1f} s'


@with_captures('capture-once', 'takes one image for one request', section='DIGICAM_CONTROL')
async def capture_once(camera: CameraSession) -> None:
    """Count the images that are reported."""
    before = camera.images()
    await camera.image()
    await camera.sleep(NO_IMAGE_TIME)
    if (count := camera.images() - before) != 1:
        raise Failed(f'{count} images')


@with_captures('capture-panel', 'takes an image of the panel', section='DIGICAM_CONTROL')
async def capture_panel(camera: CameraSession) -> None:
    """Command an image with shot 2."""
    await camera.image(rededge.Shot.PANEL)


@with_captures('shot-values', 'takes no image for other values of shot', section='DIGICAM_CONTROL')
async def shot_values(camera: CameraSession) -> None:
    """Send 0 and 3."""
    for shot in SHOTS_WITHOUT_IMAGE:
        if (await camera.capture(shot, timeout=NO_IMAGE_TIME)).taken:
            raise Failed(f'takes an image for shot {shot}')


@with_ids('other-component', 'ignores messages for other components', needs_consent=True)
async def other_component(camera: CameraSession) -> None:
    """Command an image of another component."""
    if (await camera.capture(component=OTHER_COMPONENT, timeout=NO_IMAGE_TIME)).taken:
        raise Failed(f'takes an image that component {OTHER_COMPONENT} was requested to take')


@with_ids('all-components', 'takes messages for all components', needs_consent=True)
async def all_components(camera: CameraSession) -> None:
    """Command an image of component 0."""
    await camera.image(component=0)


@with_ids('any-system', 'ignores the target system', needs_consent=True)
async def any_system(camera: CameraSession) -> None:
    """Command an image of another system."""
    await camera.image(system=camera.device.system % 254 + 1)


# Injected state

def _position(
    name: str, section: str, state: Callable[[CameraSession], Sequence[Message]],
) -> Requirement[CameraSession]:
    """Return the requirement that images have the position and time of some messages."""
    @with_captures(name, f'writes position and time of {section} into images', section=section)
    async def check(camera: CameraSession) -> str:
        await camera.inject(lambda: state(camera))
        feedback = await camera.image(state=lambda: state(camera))
        if not is_at_injected_place(feedback):
            raise Failed(f'{_place(feedback)} instead of {LATITUDE}, {LONGITUDE}, {ALTITUDE} m')
        error = feedback.time_usec / 1e6 - camera.conditions.utc()
        if not -FEEDBACK_TIMEOUT - MAX_CLOCK_ERROR < error < MAX_CLOCK_ERROR:
            raise Failed(f'the time of the image is wrong by {error:.1f} s')
        return _place(feedback)
    return check


@with_captures('attitude', 'combines ATTITUDE and MOUNT_STATUS', section='MOUNT_STATUS')
async def attitude(camera: CameraSession) -> str:
    """Turn the vehicle, then the camera about its line of sight; both turn the image."""
    for yaw, mount_roll in ((90.0, 0.0), (90.0, 30.0)):
        state = partial(camera.attitude, yaw, mount_roll)
        await camera.inject(state)
        feedback = await camera.image(state=state)
        error = (feedback.yaw - yaw - mount_roll + 180) % 360 - 180
        if not abs(error) <= MAX_ANGLE_ERROR:
            raise Failed(f'yaw {feedback.yaw:.2f} degrees with a vehicle at {yaw:g} and a mount '
                         f'at {mount_roll:g}')
    return f'yaw {feedback.yaw:.2f} degrees'


@with_captures('validity', 'uses an injected position for 5 s', section='GPS')
async def validity(camera: CameraSession) -> None:
    """Inject a position, and take an image before and after that time."""
    await camera.inject(camera.raw_position)
    ended = camera.now
    for wait, used in ((WITHIN_VALIDITY, True), (AFTER_VALIDITY, False)):
        await camera.sleep(max(ended + wait - camera.now, 0.0))
        if is_at_injected_place(await camera.image()) is not used:
            raise Failed(f'{"not used" if used else "still used"} {wait:g} s later')


# The messages of a whole run

@requires('heartbeat-contents', 'sends the documented values in HEARTBEAT', section='HEARTBEAT',
          since=rededge.CAPTURES, whole_run=True)
async def heartbeat_contents(camera: CameraSession) -> None:
    """Read the latest HEARTBEAT."""
    received = camera.received(Heartbeat)
    if received and received[-1][1] != HEARTBEAT_CONTENTS:
        raise Failed(f'{received[-1][1]} instead of {HEARTBEAT_CONTENTS}')


@requires('capture-index', 'counts the images that were commanded', section='CAMERA_FEEDBACK',
          whole_run=True)
async def capture_index(camera: CameraSession) -> str:
    """Compare the numbers of consecutive images."""
    indexes = [one.img_idx for _, one in camera.received(rededge.CameraFeedback)]
    if len(indexes) < 2:
        raise Skipped('fewer than two images were confirmed')
    for first, second in pairwise(indexes):
        if second != (first + 1) & 0xFFFF:
            raise Failed(f'img_idx {first}, then {second}')
    return f'{indexes[0]} to {indexes[-1]}'


@requires('mavlink-1', 'sends MAVLink 1 frames only', section='General Protocol Overview',
          whole_run=True)
async def mavlink_1(camera: CameraSession) -> str:
    """Count the frames."""
    versions = camera.record.versions
    if versions[2]:
        raise Failed(f'{versions[2]} of {versions.total()} frames are of MAVLink 2')
    return f'{versions[1]} frames'


@requires('lengths', 'sends every message with its MAVLink 1 length',
          section='General Protocol Overview', whole_run=True)
async def lengths(camera: CameraSession) -> None:
    """Compare the lengths of the frames."""
    if odd := camera.record.odd_lengths:
        raise Failed(', '.join(f'{name} with {size} bytes' for name, size in odd.items()))


def _documented(one: Requirement[Session], title: str = '') -> Requirement[Session]:
    """Return a requirement on any component, with the serial API as its specification."""
    return replace(one, specification=SERIAL_API, section='HEARTBEAT', title=title or one.title)


REQUIREMENTS: tuple[Requirement[CameraSession], ...] = (
    _documented(component.heartbeat,
                f'sends HEARTBEAT from component {CAMERA_ID} (MAV_COMP_ID_CAMERA)'),
    ping, ping_sequence, ping_once, ping_target, system_id,
    capture_status, capture_feedback, capture_once, capture_panel, shot_values,
    other_component, all_components, any_system,
    _position('raw-position', 'GPS_RAW_INT', CameraSession.raw_position),
    _position('fused-position', 'GLOBAL_POSITION_INT', CameraSession.fused_position),
    attitude, validity,
    _documented(component.heartbeat_rate), heartbeat_contents, capture_index,
    mavlink_1, lengths, component.checksums,
)
CHECKS: PayloadChecks[CameraSession] = PayloadChecks(
    payload='rededge', device='camera', session=CameraSession, requirements=REQUIREMENTS,
    evidence=f'HEARTBEAT from component {CAMERA_ID}', mavlink_version=1,
    risk='take images with a false position',
    question='Some checks make camera {device} take '
             f'about {ANNOUNCED_IMAGES} images, most with a false position ({LATITUDE:.1f}, '
             f'{LONGITUDE:.1f})\nand a false attitude. They stay on its card. '
             'All other checks run in any case.\nMay camera {device} take these images? [y/N] ',
    traces=', besides its new images')
