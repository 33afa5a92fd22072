# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Devices that do what their protocol demands, and no more, and devices that deviate from it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
import math
from typing import Any, TypeAlias

from illuminator_ros.checks.requirements import CheckVerdict, PayloadChecks
from illuminator_ros.gimbal.checks import device
from illuminator_ros.gimbal.messages import GimbalDeviceSetAttitude
from illuminator_ros.illuminator.checks import requirements as illuminator
from illuminator_ros.illuminator.messages import IlluminatorStatus
from illuminator_ros.mavlink.dialect import replaced
from illuminator_ros.mavlink.messages import Address, Message
from illuminator_ros.rededge import checks as rededge
from illuminator_ros.rededge.messages import DigicamControl
import pytest
from support.checks_run import ChecksRun
from support.minimal_devices import (
    MinimalCamera,
    MinimalCapturingCamera,
    MinimalDevice,
    MinimalGimbal,
    MinimalLight,
)
from support.wire import START

LIGHT, GIMBAL, CAMERA = illuminator.CHECKS, device.CHECKS, rededge.CHECKS
Q: TypeAlias = tuple[float, float, float, float]


def run(checks: PayloadChecks[Any], one: MinimalDevice) -> ChecksRun:
    return ChecksRun(checks, one).finish()


class PitchGimbal(MinimalGimbal):
    """A gimbal that turns only up and down."""

    capabilities = 32 | 128
    ranges = (MinimalGimbal.ranges[0], (0.0, 0.0))


class EndlessGimbal(MinimalGimbal):
    """A gimbal with slip rings: its yaw has no limits."""

    capabilities = MinimalGimbal.capabilities | 2048
    ranges = (MinimalGimbal.ranges[0], (-math.inf, math.inf))


class WindingGimbal(MinimalGimbal):
    """A gimbal whose cable permits three turns to each side."""

    ranges = (MinimalGimbal.ranges[0], (-3 * math.tau, 3 * math.tau))


class UnlimitedGimbal(MinimalGimbal):
    """A gimbal that does not report its limits."""

    def reported_limits(self) -> tuple[float, float, float, float]:
        return (math.nan,) * 4


class HighGimbal(MinimalGimbal):
    """A gimbal that cannot turn far down."""

    ranges = (-0.1, 0.7), MinimalGimbal.ranges[1]


class MissingCamera(MinimalCapturingCamera):
    """A camera that misses the first two requests for an image."""

    missed = 0

    def capture(self, source: Address, message: DigicamControl) -> None:
        self.missed += 1
        if self.missed > 2:
            super().capture(source, message)


RIGHT: dict[str, tuple[PayloadChecks[Any], Callable[[], MinimalDevice]]] = {
    'light': (LIGHT, MinimalLight),
    'light with steps of 10 %': (LIGHT, lambda: MinimalLight(step=10.0)),
    'light that fades for 2 s': (LIGHT, lambda: MinimalLight(fade=2.0)),
    'light with a strobe': (LIGHT, lambda: MinimalLight(strobes=True)),
    'gimbal': (GIMBAL, MinimalGimbal),
    'gimbal without yaw axis': (GIMBAL, PitchGimbal),
    'gimbal without yaw limits': (GIMBAL, EndlessGimbal),
    'gimbal with three turns of yaw': (GIMBAL, WindingGimbal),
    'gimbal without limits': (GIMBAL, UnlimitedGimbal),
    'gimbal that cannot turn far down': (GIMBAL, HighGimbal),
    'camera': (CAMERA, MinimalCamera),
    'camera with captures': (CAMERA, MinimalCapturingCamera),
    'camera that misses two requests': (CAMERA, MissingCamera),
}


@pytest.mark.parametrize('name', RIGHT)
def test_a_device_that_does_what_its_protocol_demands_passes(name: str) -> None:
    checks, make = RIGHT[name]
    done = run(checks, make())
    assert [one for one in done.runner.results if one.verdict is CheckVerdict.FAIL] == []
    assert done.runner.passed


def test_a_camera_has_captures_if_one_of_three_requests_is_confirmed() -> None:
    assert run(CAMERA, MissingCamera()).result('capture-status').verdict is CheckVerdict.PASS


def test_checks_of_a_camera_without_captures_end_within_20_s() -> None:
    done = run(CAMERA, MinimalCamera())
    assert done.link.now - START < 20.0


# Deviations

class FractionLight(MinimalLight):
    """Reports its brightness as a share of 1."""

    def message(self, message_id: int) -> Message:
        status = super().message(message_id)
        return replaced(status, brightness=status.brightness / 100) if isinstance(
            status, IlluminatorStatus) else status


class DimLight(MinimalLight):
    """Is dimmer by 8 % than commanded."""

    def configure(self, brightness: float, period: float, duty: float) -> None:
        super().configure(max(0.0, brightness - 8.0), period, duty)


class DegreeRateGimbal(MinimalGimbal):

    def obey(self, message: GimbalDeviceSetAttitude) -> None:
        super().obey(replaced(
            message, angular_velocity_y=math.radians(message.angular_velocity_y),
            angular_velocity_z=math.radians(message.angular_velocity_z)))


class ConjugatedCommandGimbal(MinimalGimbal):

    def commanded(self, q: Sequence[float]) -> tuple[float, float]:
        w, x, y, z = q
        return super().commanded((w, -x, -y, -z))


class ConjugatedReportGimbal(MinimalGimbal):

    def reported(self) -> Q:
        w, x, y, z = super().reported()
        return w, -x, -y, -z


class ScalarLastGimbal(MinimalGimbal):

    def reported(self) -> Q:
        w, x, y, z = super().reported()
        return x, y, z, w


class DegreeLimitsGimbal(MinimalGimbal):

    def reported_limits(self) -> Q:
        low, high, left, right = map(math.degrees, super().reported_limits())
        return low, high, left, right


class DegreeYawGimbal(DegreeLimitsGimbal):
    """Does not know the range of its pitch."""

    def reported_limits(self) -> Q:
        return math.nan, math.nan, *super().reported_limits()[2:]


class DegreePitchGimbal(MinimalGimbal):
    """A gimbal whose pitch turns little: its limits could be rad, were it not for its motion."""

    ranges = (-0.1, 0.09), MinimalGimbal.ranges[1]

    def reported_limits(self) -> Q:
        low, high, left, right = super().reported_limits()
        return math.degrees(low), math.degrees(high), left, right


WRONG: dict[type[MinimalDevice], tuple[PayloadChecks[Any], set[str]]] = {
    FractionLight: (LIGHT, {'brightness', 'status-agrees'}),
    DimLight: (LIGHT, {'brightness', 'status-agrees'}),
    DegreeRateGimbal: (GIMBAL, {'rate'}),
    ConjugatedCommandGimbal: (GIMBAL, {'setpoint'}),
    ConjugatedReportGimbal: (GIMBAL, {'setpoint'}),
    ScalarLastGimbal: (GIMBAL, {'setpoint'}),
    DegreeLimitsGimbal: (GIMBAL, {'limits', 'range'}),
    DegreeYawGimbal: (GIMBAL, {'limits'}),
    DegreePitchGimbal: (GIMBAL, {'range'}),
}


@pytest.mark.parametrize('device', WRONG)
def test_a_device_that_deviates_fails_the_requirement_that_it_breaks(
        device: type[MinimalDevice]) -> None:
    checks, names = WRONG[device]
    assert run(checks, device()).failed >= names  # type: ignore[call-arg]
