# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Sources of ROS share a gimbal: only the setpoints of the one that holds it are sent."""

from __future__ import annotations

from collections.abc import Callable
import random
from typing import Any

from illuminator_ros.geometry.mount_attitude import from_mavlink, YawFrame
from illuminator_ros.gimbal.commands import Rates
from illuminator_ros.gimbal.messages import GimbalManagerSetAttitude
from illuminator_ros.payload.arbitration import Cause, HolderChanged
from illuminator_ros.payload.command_sources import SourceSettings
from illuminator_ros.payload.device_events import DeviceHeld
import pytest
from support.gimbals import (
    FakeManager,
    in_control,
    OURS,
    Rig,
    setpoint,
)

NAMES = ('safety', 'operator', 'default', 'autonomy')
TIMEOUT = 2.0
VEHICLE = YawFrame.VEHICLE
# The yaw that each source requests, rad.
YAW = {name: 0.1 * (index + 1) for index, name in enumerate(NAMES)}


def shared(**fields: Any) -> Rig:
    return in_control(sources=SourceSettings(NAMES, TIMEOUT), **fields)


def point(rig: Rig, source: str) -> str:
    """Let a source request its yaw; return the refusal."""
    return rig.send_angles((0.0, 0.0, YAW[source]), VEHICLE, source)


def holder(rig: Rig) -> str | None:
    return rig.gimbal.snapshot(rig.now).holder


def asked(rig: Rig, since: float = 0.0) -> set[str]:
    """Return the sources whose yaw was sent."""
    return {name for at, one in rig.sent if isinstance(one, GimbalManagerSetAttitude)
            and at >= since for name, yaw in YAW.items()
            if abs(from_mavlink(one.q, VEHICLE).euler()[2] - yaw) < 0.01}


# The ends of the hold of ``safety``.
ENDS: dict[Cause, Callable[[Rig], object]] = {
    Cause.RELEASE: lambda rig: rig.gimbal.release('safety', rig.now),
    Cause.SILENCE: lambda rig: rig.run(TIMEOUT - 0.9),
}


@pytest.mark.parametrize(('cause', 'end'), ENDS.items())
def test_the_next_source_has_the_gimbal_afterwards_and_must_send_a_setpoint(
        cause: Cause, end: Callable[[Rig], object]) -> None:
    rig = shared()
    point(rig, 'safety')
    rig.run(1.0)
    point(rig, 'autonomy')
    end(rig)
    rig.run(0.5)

    assert holder(rig) == 'autonomy'
    assert rig.all_of(DeviceHeld)[-1].change == HolderChanged('safety', 'autonomy', cause)
    assert asked(rig) == {'safety'}
    assert point(rig, 'autonomy') == ''
    assert asked(rig.run(0.1)) == {'safety', 'autonomy'}


def test_a_takeover_leaves_the_commands_to_another_gimbal_of_the_manager() -> None:
    rig = Rig(*(FakeManager(device_id=number, primary=OURS) for number in (1, 2)),
              sources=SourceSettings(NAMES, TIMEOUT)).run(4.0)
    first, second = rig.client.gimbals.values()
    rig.managers[0].answers = rig.managers[1].answers = False
    for gimbal in (first, second):
        gimbal.request(None, rig.now, rig.done, source='autonomy')
    setpoint(first, Rates(), rig.now, 'safety')
    rig.run(0.1)

    assert len(rig.results) == 1
    rig.managers[1].answers = True
    rig.run(2.0)
    assert [one.success for one in rig.results] == [False, True]


def test_without_sources_all_are_alike() -> None:
    rig = in_control()

    assert [point(rig, source) for source in NAMES] == [''] * 4
    assert rig.gimbal.requests.refusal('autonomy') == ''
    assert rig.gimbal.release('autonomy', rig.now) == ''
    assert holder(rig) is None
    assert rig.all_of(DeviceHeld) == []


@pytest.mark.parametrize('seed', range(20))
def test_only_setpoints_of_the_highest_source_that_claims_the_gimbal_are_sent(seed: int) -> None:
    draw = random.Random(seed)
    rig = shared()
    # Equal setpoints of a gimbal that moves are sent, too.
    rig.managers[0].rates = (0.0, 0.0, 0.2)
    heard: dict[str, float] = {}
    for _ in range(60):
        source = draw.choice(NAMES)
        heard = {name: at for name, at in heard.items() if rig.now < at + TIMEOUT}
        if draw.random() < 0.3:
            rig.gimbal.release(source, rig.now)
            heard.pop(source, None)
        else:
            heard[source] = rig.now
            highest = min(heard, key=NAMES.index)
            assert point(rig, source) == ('' if source == highest else f'held by {highest}')
        highest = min(heard, key=NAMES.index, default='')
        assert holder(rig) == highest
        before = rig.now
        rig.run(draw.choice((0.02, 0.1, 1.0, 2.5)))
        if source == highest and source in heard and heard[source] == before:
            assert asked(rig, before) == {source}
