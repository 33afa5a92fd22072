# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""From the moment the end begins a gimbal is only stopped and released."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
import math
import random
from typing import Any

from illuminator_ros.geometry.mount_attitude import STILL, YawFrame
from illuminator_ros.geometry.rotation import Quaternion
from illuminator_ros.gimbal.commands import Attitude, Rates
from illuminator_ros.gimbal.gimbal import Gimbal, GimbalSettings
from illuminator_ros.gimbal.manager import GimbalManager, ManagerSettings, RequestRefused
from illuminator_ros.gimbal.manager_with_client import ManagerWithClient
from illuminator_ros.gimbal.messages import (
    GimbalDeviceSetAttitude,
    GimbalManagerSetAttitude,
    REMOVE_SENDER,
)
from illuminator_ros.gimbal.setpoint_mixer import HOLD_INTERVAL, SetpointSent
from illuminator_ros.mavlink import messages as mav
from illuminator_ros.mavlink.command_sender import CommandSender
from illuminator_ros.mavlink.component import Component
from illuminator_ros.mavlink.dialect import mavlink
from illuminator_ros.payload.command_sources import SourceSettings
from illuminator_ros.payload.requests import Done, Result
import pytest
from support.gimbal_manager import (
    AUTOPILOT,
    GUEST,
    ManagerRig,
    of,
    PILOT,
    pitch_yaw,
    pitch_yaw_command,
    position,
    region,
)
from support.gimbals import (
    clear_roi,
    FakeManager,
    OURS,
    PLACE,
    retract,
    Rig,
    set_neutral,
    set_yaw_lock,
    setpoint,
)
from support.records import Answer

ENDING = 'the bridge is ending'
SOURCES = ('safety', 'default')
# s that the bridge waits for the gimbals.
LIMIT = 0.6


@dataclass
class LossyManager(FakeManager):
    """A manager that loses some of the messages in each direction."""

    loss: float = 0.0
    draw: random.Random = field(default_factory=random.Random)

    def take(
        self, source: mav.Address, message: mav.Message,
    ) -> list[tuple[mav.Address, mav.Message]]:
        return [] if self.draw.random() < self.loss else [
            one for one in super().take(source, message) if self.draw.random() >= self.loss]


def rates(message: Any) -> tuple[float, ...]:
    return (message.angular_velocity_x, message.angular_velocity_y, message.angular_velocity_z)


def use(rig: Rig, draw: random.Random) -> list[Answer]:
    """Make a random request or setpoint, as a node does; return the answer that is due."""
    gimbal, now, answer = rig.gimbal, rig.now, Answer(rig.now)
    requests = (
        gimbal.take_control, gimbal.take_control, partial(set_neutral, gimbal),
        partial(retract, gimbal), partial(clear_roi, gimbal),
        lambda *rest: set_yaw_lock(gimbal, draw.random() < 0.5, *rest),
        lambda *rest: gimbal.request(PLACE, *rest))
    setpoints = (
        lambda: setpoint(gimbal, Rates((0.0, draw.random(), 0.2)), now),
        lambda: setpoint(gimbal, Attitude(
            Quaternion.from_euler(0.0, 0.2, 0.0), YawFrame.VEHICLE), now),
        lambda: gimbal.set_angles((0.0, math.nan, 0.3), YawFrame.VEHICLE, now, Answer(now),
                                  source=draw.choice(SOURCES)),
        lambda: gimbal.release(draw.choice(SOURCES), now))
    if draw.random() < 0.5:
        draw.choice(setpoints)()
        return []
    draw.choice(requests)(now, answer)
    return [answer]


@pytest.mark.parametrize('seed', range(12))
def test_a_client_only_stops_and_releases_the_gimbal_whatever_is_under_way_and_comes(
    seed: int,
) -> None:
    draw = random.Random(seed)
    manager = LossyManager(loss=draw.choice((0.0, 0.3)), draw=draw)
    rig = Rig(manager, auto_take_control=draw.random() < 0.5,
              sources=draw.choice((None, SourceSettings(SOURCES)))).run(4.0)
    answers = []
    for _ in range(6):
        answers += use(rig, draw)
        rig.run(draw.choice((0.0, 0.02, 0.1)))
    before = len(rig.sent) + len(rig.component.outgoing)
    rig.component.close(rig.now, ENDING)
    assert all(answer.results for answer in answers)
    releases: list[Result] = []
    must_release = rig.gimbal.has_any_control
    if must_release:
        rig.gimbal.release_control(rig.now, lambda result, now: releases.append(result))
    later = []
    ended_at = rig.now + LIMIT
    while rig.now < ended_at:
        later += use(rig, draw)
        rig.run(draw.choice((0.0, 0.02, 0.1)))

    for _, message in rig.sent[before:]:
        if isinstance(message, GimbalManagerSetAttitude):
            assert rates(message) == STILL
        elif isinstance(message, mav.CommandLong | mav.CommandInt):
            is_release = (message.command == mavlink.MAV_CMD_DO_GIMBAL_MANAGER_CONFIGURE
                          and message.param1 == REMOVE_SENDER)
            is_stop = (message.command == mavlink.MAV_CMD_DO_GIMBAL_MANAGER_PITCHYAW
                       and (message.param3, message.param4) == (0.0, 0.0))
            assert is_release or is_stop or (
                message.command == mavlink.MAV_CMD_REQUEST_MESSAGE), message
    assert {answer.result[:2] for answer in later} <= {(False, ENDING)}
    # Only a release without a success may leave control with this component.
    assert manager.primary != OURS or must_release and not any(one.success for one in releases)


@pytest.mark.parametrize('ask', [Gimbal.take_control, Gimbal.release_control])
def test_the_release_at_the_end_is_confirmed_though_a_request_for_control_was_under_way(
    ask: Callable[[Gimbal, float, Done], None],
) -> None:
    rig = Rig(FakeManager(primary=OURS)).run(4.0)
    rig.managers[0].answers = False
    ask(rig.gimbal, rig.now, Answer(rig.now))
    rig.run(0.1)
    rig.managers[0].answers = True

    rig.component.close(rig.now, ENDING)
    rig.gimbal.release_control(rig.now, rig.done)
    rig.run(LIMIT)

    assert [one.success for one in rig.results] == [True]
    assert rig.managers[0].primary != OURS


def follow(rig: ManagerRig, draw: random.Random) -> None:
    """Make a random request of a player, or change something else."""
    player = draw.choice((PILOT, GUEST))
    draw.choice((
        lambda: rig.take(player), lambda: rig.points(player, draw.uniform(-0.4, 0.4)),
        lambda: rig.give(player, pitch_yaw(pitch_rate=0.2, yaw_rate=0.1)),
        lambda: rig.result(player, pitch_yaw_command(10.0, 0.0)),
        lambda: rig.result(player, region(47.001, 8.0, 500.0)),
        lambda: rig.give(AUTOPILOT, position(47.0, 8.0, 500.0)),
        lambda: rig.report()))()


class Both(ManagerRig):
    """A manager that is used by ROS, too."""

    def make(
        self, commands: CommandSender, settings: ManagerSettings,
    ) -> tuple[GimbalManager, Component]:
        self.both = ManagerWithClient(commands, settings, GimbalSettings())
        return self.both.manager, Component(commands, [self.both])


@pytest.mark.parametrize('seed', range(6))
@pytest.mark.parametrize('kind', [ManagerRig, Both])
@pytest.mark.parametrize('device_id', [0, 1])
def test_a_manager_stops_its_device_and_follows_no_player_any_more(
    seed: int, kind: type[ManagerRig], device_id: int,
) -> None:
    draw = random.Random(seed)
    rig = kind(device_id=device_id)
    rig.take(PILOT)
    rig.points(PILOT)
    for _ in range(6):
        follow(rig, draw)
        rig.run(draw.choice((0.0, 0.02, 0.1)))
    before, known = len(rig.sent), len(rig.events)
    rig.component.close(rig.now, ENDING)
    ended_at = rig.now + LIMIT
    results = [rig.result(PILOT, pitch_yaw_command(20.0, 0.0, 5.0, 5.0)),
               rig.result(PILOT, region(47.001, 8.0, 500.0))]
    while rig.now < ended_at:
        follow(rig, draw)
        rig.run(draw.choice((0.0, 0.02, 0.1)))
    rig.run(HOLD_INTERVAL)

    # A device without MAVLink gets its setpoints through ROS.
    sent: list[tuple[Any, tuple[float, ...]]] = [
        (one.setpoint.attitude, one.setpoint.rates)
        for one in of(SetpointSent, rig.events[known:])]
    sent += [(one.q, rates(one)) for one in of(
        GimbalDeviceSetAttitude, (message for _, message in rig.sent[before:]))]
    assert not any(rate for _, turning in sent for rate in turning if not math.isnan(rate))
    # Only a zero is repeated, until an attitude shows that the device stands.
    assert len(sent) == 1 or {turning for _, turning in sent} == {STILL}
    assert set(results) == {mavlink.MAV_RESULT_TEMPORARILY_REJECTED}
    assert {one.reason for one in of(RequestRefused, rig.events[known:])} - {
        f'{GUEST} may not change who is in control: {PILOT} has primary control, and the policy '
        'is hold'} == {ENDING}


def test_ros_as_a_player_of_its_own_manager_turns_the_gimbal_no_more() -> None:
    rig = Both()
    [gimbal] = rig.both.client.gimbals.values()
    answers = [Answer(rig.now) for _ in range(3)]
    gimbal.take_control(rig.now, answers[0])
    rig.run(1.0)
    assert setpoint(gimbal, Rates((0.0, 0.0, 0.2)), rig.now) == ''
    rig.run(0.1)
    assert any(rates(of(GimbalDeviceSetAttitude, rig.messages(GimbalDeviceSetAttitude))[-1]))

    rig.component.close(rig.now, ENDING)
    gimbal.release_control(rig.now, answers[1])
    refusals = setpoint(gimbal, Rates((0.0, 0.0, 0.2)), rig.now)
    gimbal.take_control(rig.now, answers[2])
    rig.run(LIMIT)

    assert [answer.result.success for answer in answers] == [True, True, False]
    assert refusals == answers[2].result.message == ENDING
    assert not any(rates(rig.messages(GimbalDeviceSetAttitude)[-1]))
    assert not rig.manager.control.primary.holder
