# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""
A simulated survey flight: the truth about it, and the comparison of images with the truth.

Times are flight time, s since the take-off. A flight may be played faster than real time.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
import math
from typing import NamedTuple

from illuminator_ros.geometry.rotation import Quaternion, Vector

# m/s, degrees, m/s^2
SPEED, BANK, GRAVITY = 5.0, 40.0, 9.81
# s of a leg with the turn after it, of its straight part, and of a change of the bank.
LEG, STRAIGHT, BANKING = 9.0, 6.0, 0.6
# s between the points of the path.
STEP = 0.005
# Hz
FIX_RATE, ATTITUDE_RATE = 12.5, 20.0
# s between images; s for which the camera uses injected state; s without a fix, without a link,
# and after that.
IMAGE_INTERVAL, VALIDITY, OUTAGE, PULL, RETURN = 0.5, 5.0, 8.0, 3.0, 12.0
# The place of the take-off, degrees and m above mean sea level; and the height of mean sea level
# above the ellipsoid, m.
LATITUDE, LONGITUDE, ALTITUDE, GEOID = 47.397742, 8.545594, 488.0, 48.0
METRES_PER_DEGREE = 111_319.49
# m from the truth at the time of the image, for a fix that is not older than one interval; m from
# the truth at the time of the fix, for any; degrees from the truth at one and the same moment.
MAX_POSITION_ERROR, MAX_FIX_ERROR, MAX_ANGLE_ERROR = 0.5, 0.05, 0.05
# s between the delays that are tried.
DELAY_STEP = 0.05

# From the axes of the camera, FRD with x out of the lens, to those of the image.
LENS = Quaternion.from_euler(0.0, -math.pi / 2, 0.0)


class Point(NamedTuple):
    """
    The state of the vehicle on its path.

    :param north: and ``east``, m from the take-off.
    :param heading: and ``bank``, rad.
    """

    north: float
    east: float
    heading: float
    bank: float


class Truth(NamedTuple):
    """
    The state at a moment.

    :param vehicle: attitude of the FRD body in NED.
    :param camera: attitude of the image in NED: x to its top, y to its right, z out of the lens.
    :param velocity: ENU, m/s.
    """

    latitude: float
    longitude: float
    altitude: float
    vehicle: Quaternion
    camera: Quaternion
    velocity: Vector


class Pair(NamedTuple):
    """
    Attitude and mount of an image.

    :param time: and ``mount_time``, when the camera received them; the same if they came together.
        An image between the two messages has the new attitude, and the mount that came before.
    :param mount: attitude of the image in the vehicle.
    """

    time: float
    vehicle: Quaternion
    mount_time: float
    mount: Quaternion


class Window(NamedTuple):
    """A time within the flight."""

    begin: float
    end: float

    def __contains__(self, time: object) -> bool:
        return isinstance(time, float) and self.begin <= time < self.end


def _bank(time: float) -> float:
    """Return the bank in legs with turns to alternating sides, rad."""
    number, within = divmod(time, LEG)
    rise = min((within - STRAIGHT) / BANKING, (LEG - within) / BANKING, 1.0)
    # Smooth at both ends.
    share = rise * rise * (3 - 2 * rise) if rise > 0 else 0.0
    return math.copysign(math.radians(BANK) * share, -1 if number % 2 else 1)


class Flight:
    """
    Straight legs, with turns of 40 degrees of bank between them, below which a gimbal moves.

    :param seconds: its duration, flight time.
    :param speed: how much faster than real it is played.
    :ivar outage: when there is no fix.
    :ivar pull: when the link is pulled.
    """

    def __init__(self, seconds: float, speed: float) -> None:
        self.seconds = seconds
        self.speed = speed
        self.outage = Window(seconds / 6, seconds / 6 + OUTAGE)
        self.pull = Window(seconds - PULL - RETURN, seconds - RETURN)
        self._path = [Point(0.0, 0.0, math.radians(20), 0.0)]
        for number in range(math.ceil(seconds / STEP) + 1):
            north, east, heading, bank = self._path[-1]
            self._path.append(Point(
                north + SPEED * STEP * math.cos(heading), east + SPEED * STEP * math.sin(heading),
                heading + GRAVITY * math.tan(bank) / SPEED * STEP, _bank(number * STEP + STEP)))

    def _point(self, time: float) -> Point:
        position = min(max(time, 0.0), self.seconds) / STEP
        index = int(position)
        one, other = self._path[index], self._path[index + 1]
        return Point(*(a + (position - index) * (b - a) for a, b in zip(one, other, strict=True)))

    def truth(self, time: float) -> Truth:
        """Return the state at a time; before and after the flight the vehicle stands still."""
        time = min(max(time, 0.0), self.seconds)
        north, east, heading, bank = self._point(time)
        pitch = math.radians(4 + 2 * math.sin(0.9 * time))
        # A stabilised camera, which follows the heading late and looks to both sides.
        camera = Quaternion.from_euler(
            math.radians(15 * math.sin(0.6 * time)), math.radians(10 * math.sin(0.4 * time)),
            self._point(time - 0.5).heading)
        return Truth(
            LATITUDE + north / METRES_PER_DEGREE,
            LONGITUDE + east / METRES_PER_DEGREE / math.cos(math.radians(LATITUDE)),
            ALTITUDE + 60 + 5 * math.sin(0.2 * time),
            Quaternion.from_euler(bank, pitch, heading), camera,
            (SPEED * self.speed * math.sin(heading), SPEED * self.speed * math.cos(heading), 0.0))

    def distance(self, time: float, image: Image) -> float:
        """Return how far the position of an image is from the true one at a time, m."""
        truth = self.truth(time)
        return math.hypot(
            (image.latitude - truth.latitude) * METRES_PER_DEGREE,
            (image.longitude - truth.longitude) * METRES_PER_DEGREE
            * math.cos(math.radians(truth.latitude)), image.altitude - truth.altitude)

    def explain(self, pair: Pair, limit: float) -> Fit:
        """
        Return what explains the attitude, or a mount that fits worse.

        The two need not be of one pair: the camera may have read the next attitude already.

        :param limit: the longest delay, s.
        """
        def mount(time: float) -> Quaternion:
            truth = self.truth(time)
            return truth.vehicle.inverse() * truth.camera

        return max(
            explain(pair.vehicle, lambda time: self.truth(time).vehicle, pair.time, limit),
            explain(pair.mount, mount, pair.mount_time, limit), key=lambda fit: fit.error)


class Fit(NamedTuple):
    """
    An explanation of a rotation that the camera has received.

    :param error: the difference from the truth that it leaves, degrees.
    :param delay: how long before its reception the rotation was true, s. It is negative if the
        clock of the camera is late, which is set by fixes.
    """

    error: float
    delay: float


def explain(
    rotation: Quaternion, truth: Callable[[float], Quaternion], received: float, limit: float,
) -> Fit:
    """
    Return the shortest delay that explains a rotation, else the best explanation.

    :param truth: returns the rotation at a time.
    :param limit: the longest delay, s.
    """
    def error(delay: float) -> float:
        return math.degrees(rotation.angle_to(truth(received - delay)))

    step = min(limit, DELAY_STEP)
    count = math.ceil(limit / step)
    errors = {number: error(step * number) for number in range(-count, count + 1)}
    found = []
    for number in sorted(errors, key=abs):
        # Between two neighbours of a least value the error has one minimum.
        if errors[number] <= min(errors.get(number - 1, math.inf),
                                 errors.get(number + 1, math.inf)):
            found.append(_least(error, step * number, step))
            if found[-1].error <= MAX_ANGLE_ERROR:
                return found[-1]
    return min(found)


def _least(error: Callable[[float], float], delay: float, step: float) -> Fit:
    """Return the delay with the least error, at most one step from another one."""
    low, high = delay - step, delay + step
    for _ in range(40):
        third = (high - low) / 3
        if error(low + third) < error(high - third):
            high -= third
        else:
            low += third
    return Fit(error(low), low)


@dataclass(frozen=True)
class Image:
    """
    A line of the simulated camera's CSV, in flight time.

    :param time: by the camera's clock.
    :param position_age: s; None for a position of its own GPS.
    :param pair: None without an injected attitude.
    """

    time: float
    latitude: float
    longitude: float
    altitude: float
    position_age: float | None
    pair: Pair | None

    @classmethod
    def read(cls, row: Mapping[str, str], begin: float, speed: float) -> Image:
        """
        Return the image of a line.

        :param begin: UTC of the take-off, s.
        """
        def age(name: str) -> float | None:
            return float(row[f'{name}_age_s']) * speed if row[f'{name}_age_s'] else None

        def rotation(prefix: str) -> Quaternion:
            return Quaternion.from_euler(*(math.radians(float(row[f'{prefix}{name}_deg']))
                                           for name in ('roll', 'pitch', 'yaw')))

        time, pair = (float(row['time_utc_s']) - begin) * speed, None
        attitude_age, mount_age = age('attitude'), age('mount')
        if attitude_age is not None and mount_age is not None:
            vehicle = rotation('')
            together = abs(mount_age - attitude_age) < 0.5 / ATTITUDE_RATE
            pair = Pair(time - attitude_age, vehicle,
                        time - (attitude_age if together else mount_age),
                        vehicle.inverse() * rotation('camera_'))
        return cls(time, float(row['latitude_deg']), float(row['longitude_deg']),
                   float(row['altitude_m']), age('position'), pair)


@dataclass
class Comparison:
    """
    Images compared with the truth.

    :param images: how many.
    :param fresh: how many have a fix that is not older than one interval and the delay.
    :param position_error: of a fix that is not older than one interval, from the truth at the time
        of the image, at most, m.
    :param fix_error: of every injected position, from the truth at the time of the fix, m.
    :param angle_error: of every injected attitude and mount, from the truth, degrees.
    :param delay: the longest time from an attitude, a mount or a fix to its reception by the
        camera, s.
    :param oldest: age of the oldest injected position or attitude, s.
    :param own: images in the outage with the position of the camera's own GPS.
    :param returned: images with a fresh fix after the link was pulled.
    """

    images: int = 0
    fresh: int = 0
    position_error: float = 0.0
    fix_error: float = 0.0
    angle_error: float = 0.0
    delay: float = 0.0
    oldest: float = 0.0
    own: int = 0
    returned: int = 0
    failures: list[str] = field(default_factory=list)

    def check(self, met: bool, text: str) -> None:
        """Note a failure unless a condition is met."""
        if not met:
            self.failures.append(text)


def compare(
    images: Iterable[Image], flight: Flight, *, max_delay: float, least_fresh: float,
    max_angle_error: float = MAX_ANGLE_ERROR,
) -> Comparison:
    """
    Compare the images of a flight with the truth.

    :param max_delay: s that a message may take from its stamp to the camera, flight time.
    :param least_fresh: the share of images outside the disturbances whose fix must be fresh.
    :param max_angle_error: of an attitude, degrees.
    """
    result, calm = Comparison(), 0
    images = [one for one in images if 0.0 <= one.time < flight.seconds]
    for pair in (one.pair for one in images if one.pair):
        fit = flight.explain(pair, max_delay)
        result.angle_error = max(result.angle_error, fit.error)
        result.delay = max(result.delay, abs(fit.delay))
    for one in images:
        time = one.time
        result.images += 1
        # The first fix after the outage comes at its end, or later.
        disturbed = time >= flight.pull.begin or (
            flight.outage.begin <= time <= flight.outage.end + 2 / FIX_RATE)
        calm += not disturbed
        result.oldest = max(
            result.oldest, one.position_age or 0.0,
            time - min(one.pair.time, one.pair.mount_time) if one.pair else 0.0)
        if one.position_age is None:
            result.own += time in flight.outage
        else:
            result.fix_error = max(
                result.fix_error, flight.distance(time - one.position_age, one))
            if one.position_age <= 1 / FIX_RATE:
                result.position_error = max(result.position_error, flight.distance(time, one))
            # A machine that is late with attitudes is late with fixes, too.
            if one.position_age <= 1 / FIX_RATE + result.delay:
                result.fresh += not disturbed
                result.returned += time >= flight.pull.end
    expected = flight.seconds / IMAGE_INTERVAL
    check = result.check
    # The clock of the camera is set by fixes, which may be late.
    check(abs(result.images - expected) <= 2 + result.delay / IMAGE_INTERVAL,
          f'{result.images} images instead of {expected:g}')
    check(result.oldest <= VALIDITY + 0.01, f'an image has data that is {result.oldest:.2f} s old')
    check(result.position_error <= MAX_POSITION_ERROR,
          f'a position is wrong by {result.position_error:.2f} m')
    check(result.fix_error <= MAX_FIX_ERROR, f'a fix is wrong by {result.fix_error:.2f} m')
    check(result.angle_error <= max_angle_error,
          f'an attitude is wrong by {result.angle_error:.3f} degrees')
    check(result.fresh >= least_fresh * calm,
          f'only {result.fresh} of {calm} images have a fresh fix')
    # A fix that is so late leaves no time in which the camera could use its own GPS.
    check(result.own > 0 or result.delay > OUTAGE - VALIDITY - 2 * IMAGE_INTERVAL,
          'the camera did not fall back to its own GPS in the outage')
    check(result.returned > 0, 'no image has a fresh fix after the link was pulled')
    return result
