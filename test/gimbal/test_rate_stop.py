# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""A device does not go on turning when its manager gives it no more setpoints."""

from __future__ import annotations

from collections.abc import Callable
import math

from illuminator_ros.geometry.mount_attitude import STILL
from illuminator_ros.geometry.rotation import Quaternion
from illuminator_ros.gimbal.manager_state import ManagerState
from illuminator_ros.gimbal.messages import GimbalDeviceSetAttitude, GimbalManagerStatus, rates_of
from illuminator_ros.gimbal.rate_stop import ATTITUDE_SPACING, ZERO_RATE
from illuminator_ros.gimbal.setpoint_mixer import RateStopped
from illuminator_ros.mavlink.messages import Address
import pytest
from support.gimbal_manager import DEVICE, ManagerRig, NAN, of, PILOT, pitch_yaw

RATE = 0.2
OTHER = Address(1, 1)

# s for which the zero is repeated.
LIMIT = ZERO_RATE.tries * ZERO_RATE.first


class Turning(ManagerRig):
    """
    A manager whose device turns until a zero arrives.

    :ivar lost_zeros: how many zeros are lost.
    :ivar measures_rates: whether the device reports its rates; it always reports its attitude.
    """

    def __init__(self, *, lost_zeros: float, measures_rates: bool = True) -> None:
        super().__init__()
        self.lost_zeros, self.measures_rates = lost_zeros, measures_rates
        self.yaw = 0.0
        self.take(PILOT)
        self.give(PILOT, pitch_yaw(pitch_rate=0.0, yaw_rate=RATE))
        self.begun = self.now

    @property
    def zeros(self) -> list[GimbalDeviceSetAttitude]:
        """Return the zeros that were sent since the rate."""
        return [one for one in self.messages(GimbalDeviceSetAttitude, self.begun)
                if rates_of(one) == STILL]

    @property
    def turns(self) -> bool:
        """Whether the device turns."""
        return len(self.zeros) <= self.lost_zeros

    def pass_time(self, seconds: float) -> None:
        """Let time pass; the device reports its attitude ten times a second."""
        for step in range(round(seconds / 0.02)):
            self.yaw += RATE * 0.02 * self.turns
            if step % 5 == 4:
                self.turning = RATE * self.turns if self.measures_rates else NAN
                self.report(Quaternion.from_euler(0.0, 0.0, self.yaw))
            self.run(0.02)

    @property
    def results(self) -> list[bool]:
        """Return whether the device was shown to stand, for each stop."""
        return [one.stands for one in of(RateStopped, self.events)]


def end(rig: Turning) -> None:
    rig.component.close(rig.now, 'the process ends')


def become_inactive(rig: Turning) -> None:
    rig.give(OTHER, GimbalManagerStatus(0, 0, DEVICE.component, 0, 0, 0, 0))
    assert rig.manager.tracker.state is ManagerState.INACTIVE


def lose_the_device(rig: Turning) -> None:
    rig.component.components_lost([DEVICE], rig.now, 'cable pulled')
    assert rig.manager.tracker.state is ManagerState.NO_DEVICE
    # Nothing arrives until the device is heard again.
    before = len(rig.sent)
    rig.run(0.0)
    del rig.sent[before:]


INTERRUPTIONS = [end, become_inactive, lose_the_device]


@pytest.mark.parametrize('measures_rates', [True, False])
@pytest.mark.parametrize('lost_zeros', [0, 1, 3])
@pytest.mark.parametrize('interrupt', INTERRUPTIONS)
def test_a_zero_is_repeated_until_an_attitude_shows_that_the_device_stands(
        interrupt: Callable[[Turning], None], lost_zeros: int, measures_rates: bool) -> None:
    rig = Turning(lost_zeros=lost_zeros, measures_rates=measures_rates)
    rig.pass_time(0.5)

    interrupt(rig)
    rig.pass_time(0.9)

    assert not rig.turns
    assert rig.results == [True]
    assert not rig.manager.setpoints.rate_stop.is_running
    # One more for each attitude that is compared.
    assert lost_zeros < len(rig.zeros) <= lost_zeros + 5
    assert all(math.isnan(value) for one in rig.zeros for value in one.q)


@pytest.mark.parametrize('interrupt', INTERRUPTIONS)
def test_a_device_that_goes_on_turning_is_reported_once_the_time_is_over(
        interrupt: Callable[[Turning], None]) -> None:
    rig = Turning(lost_zeros=math.inf)

    interrupt(rig)
    rig.pass_time(LIMIT - 0.1)
    assert rig.manager.setpoints.rate_stop.is_running
    assert rig.results == []
    rig.pass_time(0.2)

    assert rig.results == [False]
    sent = len(rig.zeros)
    assert sent >= ZERO_RATE.tries - 1
    rig.pass_time(0.5)
    assert len(rig.zeros) == sent


def test_an_attitude_from_before_the_zero_does_not_show_that_the_device_stands() -> None:
    rig = Turning(lost_zeros=math.inf)
    end(rig)
    rig.turning = 0.0
    rig.run(ATTITUDE_SPACING / 2)
    rig.report()

    assert rig.results == []


def test_a_device_that_reports_no_attitude_is_not_shown_to_stand() -> None:
    rig = Turning(lost_zeros=0, measures_rates=False)
    rig.device_is_there = False
    end(rig)
    rig.turning = NAN
    for _ in range(20):
        rig.report((NAN,) * 4)
        rig.run(0.1)

    assert rig.results == [False]


def test_a_zero_is_not_repeated_against_a_new_rate_of_the_manager() -> None:
    rig = Turning(lost_zeros=math.inf)
    become_inactive(rig)
    while rig.manager.tracker.state is not ManagerState.ACTIVE:
        rig.run(0.1, each=rig.heartbeats(PILOT))
    rig.give(PILOT, pitch_yaw(pitch_rate=0.0, yaw_rate=RATE))
    rig.begun = rig.now + 0.01
    rig.run(3.0, each=rig.heartbeats(PILOT))

    assert rig.zeros == []


def test_a_rate_ends_at_once_when_the_line_of_its_player_is_lost() -> None:
    rig = Turning(lost_zeros=0)

    rig.component.components_lost([PILOT], rig.now, 'cable pulled')
    rig.give(DEVICE)

    assert len(rig.zeros) == 1
    assert rig.manager.control.primary.holder == PILOT
