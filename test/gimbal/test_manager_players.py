# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""
The manager obeys one player at a time, whatever the players do and the lines lose.

Up to 20 players obey, lie, stop, flood and forge the addresses of others. Their messages may be
lost, or come twice.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
import math
import random
from typing import Any

from hypothesis import given, settings
from hypothesis import strategies as st
from illuminator_ros.geometry.rotation import Quaternion
from illuminator_ros.gimbal import messages as gimbal
from illuminator_ros.gimbal.manager_control import ControlSettings, Role, RoleHolderChanged
from illuminator_ros.mavlink import messages as mav
from illuminator_ros.mavlink.dialect import mavlink
from illuminator_ros.payload.arbitration import Cause, Policy
from support.gimbal_manager import (
    configure,
    EVERYWHERE,
    information,
    ManagerRig,
    of,
    pitch_yaw,
    pitch_yaw_command,
    region,
)

LEASE = 2.0
SECONDS, STEP = 12.0, 0.02
KINDS = ('obeys', 'lies', 'dies', 'floods', 'forges')


def address_of(number: int) -> mav.Address:
    return mav.Address(255 - number // 10, 100 + number)


@dataclass
class Player:
    """A sender of messages; ``yaw`` marks the setpoints that bear an address."""

    number: int
    kind: str
    players: int
    random: random.Random
    heartbeat_due: float = 0.0
    dies_at: float = math.inf

    def sends(self, now: float) -> Iterator[tuple[mav.Address, mav.Message]]:
        """Return the messages that are due, each with its source."""
        if now >= self.dies_at:
            return
        if now >= self.heartbeat_due:
            self.heartbeat_due = now + 1.0
            yield address_of(self.number), mav.heartbeat(mavlink.MAV_TYPE_GCS)
        rate = 0.5 if self.kind == 'floods' else 0.03
        if self.random.random() < rate:
            number = self.number
            if self.kind == 'forges':
                number = self.random.randrange(self.players)
            yield address_of(number), self._message(number)

    def _message(self, number: int) -> mav.Message:
        own, yaw = address_of(number), mark(number)
        sane: list[mav.Message] = [
            configure(*own, *own), configure(*own), pitch_yaw(0.0, yaw), pitch_yaw(0.0, yaw),
            pitch_yaw_command(0.0, math.degrees(yaw)), configure(-3, -3, -3, -3)]
        if self.kind != 'lies':
            return self.random.choice(sane)
        other = address_of(self.random.randrange(self.players))
        return self.random.choice([
            *sane, configure(*other), configure(0, 0, 0, 0), configure(-1, -1, *own),
            configure(-1, -7), configure(*other, *own, confirmation=1), region(47.0, 8.0, 0.0),
            configure(-2, -2), pitch_yaw(0.0, yaw, device_id=33)])


def mark(number: int) -> float:
    """Return the yaw that marks the setpoints of one address, rad."""
    return (number - 10) * 0.25


class Arena:
    """A manager and its players, with checks that it obeys one player at a time."""

    def __init__(self, kinds: list[str], losses: float, overruling: set[int], seed: int) -> None:
        self.overruling = {address_of(number) for number in overruling}
        self.rig = ManagerRig(
            ControlSettings(Policy.HOLD, overruling=frozenset(self.overruling), lease=LEASE),
            device=information(**EVERYWHERE), nudge_limit=0.02)
        self.losses, self.chance = losses, random.Random(seed)
        self.players = [
            Player(number, kind, len(kinds), random.Random(self.chance.random()),
                   dies_at=self.rig.now + self.chance.uniform(1, 8) if kind == 'dies'
                   else math.inf)
            for number, kind in enumerate(kinds)]
        self.heard: dict[mav.Address, float] = {}
        # The address whose setpoint the device has.
        self.obeyed: mav.Address | None = None
        self.changes = 0

    def run(self) -> None:
        """Run the manager and all players."""
        end = self.rig.now + SECONDS
        while self.rig.now < end:
            for player in self.players:
                for source, message in player.sends(self.rig.now):
                    # One in ten of those that come at all comes twice.
                    for _ in range(self.chance.choice((1,) * 9 + (2,))):
                        if self.chance.random() >= self.losses:
                            self._give(source, message)
            before = len(self.rig.sent), len(self.rig.events)
            self.rig.run(STEP)
            self._check_sent([message for _, message in self.rig.sent[before[0]:]], None)
            self._check_changes(before[1], None)

    def _give(self, source: mav.Address, message: mav.Message) -> None:
        events, holder = len(self.rig.events), self.rig.manager.control.holder(Role.PRIMARY)
        if isinstance(message, mav.Heartbeat):
            self.heard[source] = self.rig.now
        sent = self.rig.give(source, message)
        answers = [(ack.command, ack.target_system, ack.target_component)
                   for ack in of(mav.CommandAck, sent)]
        commanded = isinstance(message, mav.CommandLong | mav.CommandInt)
        assert answers == (
            [(message.command, *source)]
            if isinstance(message, mav.CommandLong | mav.CommandInt) else [])
        self._check_changes(events, source)
        is_setpoint = isinstance(message, gimbal.GimbalManagerSetPitchyaw) or (
            isinstance(message, mav.CommandLong) and message.command == 1000)
        if is_setpoint and source == holder and of(gimbal.GimbalDeviceSetAttitude, sent):
            self.obeyed = source
        elif is_setpoint and commanded and source not in (
                holder, self.rig.manager.control.holder(Role.SECONDARY)):
            assert of(mav.CommandAck, sent)[0].result == mavlink.MAV_RESULT_DENIED
        self._check_sent(sent, source)

    def _check_sent(self, sent: list[Any], source: mav.Address | None) -> None:
        """Check that the device keeps a setpoint of the player that was obeyed last."""
        for message in of(gimbal.GimbalDeviceSetAttitude, sent):
            _, pitch, yaw = Quaternion(*message.q).euler()
            assert abs(pitch) <= 0.02 + 1e-6
            [number] = [player.number for player in self.players
                        if abs(mark(player.number) - yaw) <= 0.02 + 1e-4]
            assert address_of(number) == self.obeyed, (number, source)
        for status in of(gimbal.GimbalManagerStatus, sent):
            shown = mav.Address(status.primary_control_sysid, status.primary_control_compid)
            assert shown == (self.rig.manager.control.holder(Role.PRIMARY) or mav.Address(0, 0))

    def _check_changes(self, before: int, source: mav.Address | None) -> None:
        """Check that control moves by release, lease or an overruling player only."""
        for change in of(RoleHolderChanged, self.rig.events[before:]):
            self.changes += 1
            assert change.by == source
            if change.cause is Cause.RELEASE:
                assert change.before == source
            elif change.cause is Cause.CLAIM:
                assert change.before is None or source in self.overruling
            else:
                assert change.before is not None
                assert self.rig.now >= self.heard.get(change.before, 0.0) + LEASE


@settings(max_examples=12)
@given(st.lists(st.sampled_from(KINDS), min_size=2, max_size=20), st.floats(0, 0.4),
       st.sets(st.integers(0, 19), max_size=2), st.integers(0, 1 << 30))
def test_gm_12_exactly_one_player_is_obeyed_and_every_command_answered(
        kinds: list[str], losses: float, overruling: set[int], seed: int) -> None:
    Arena(kinds, losses, overruling, seed).run()


def test_gm_13_control_moves_and_setpoints_reach_the_device_in_that_test() -> None:
    arena = Arena([*KINDS * 4], 0.1, {3}, 7)

    arena.run()

    assert arena.changes > 20
    assert len(arena.rig.messages(gimbal.GimbalDeviceSetAttitude)) > 50


def test_gm_16_of_1000_players_that_take_control_at_once_one_has_it() -> None:
    rig = ManagerRig()
    players = [mav.Address(2 + number // 250, 1 + number % 250) for number in range(1000)]

    results = [rig.take(player) for player in players]

    assert results == [mavlink.MAV_RESULT_ACCEPTED, *[mavlink.MAV_RESULT_DENIED] * 999]
    assert rig.manager.control.holder(Role.PRIMARY) == players[0]
    assert [player for player in players if rig.points(player)] == players[:1]
