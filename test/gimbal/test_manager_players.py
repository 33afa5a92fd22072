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
The manager obeys one player at a time, whatever the players do and the lines lose.

Up to 20 players obey, lie, stop, flood and forge the addresses of others, over lines that lose,
repeat, reorder and corrupt frames.
"""

from __future__ import annotations

from dataclasses import dataclass, field
import math
import random
from typing import Any

from hypothesis import given, settings
from hypothesis import strategies as st
from illuminator_ros.gimbal import messages as gimbal
from illuminator_ros.gimbal.manager_control import ControlSettings, Role, RoleHolderChanged
from illuminator_ros.mavlink import messages as mav
from illuminator_ros.mavlink.dialect import decode, mavlink
from illuminator_ros.mavlink.frame import Decoder
from illuminator_ros.payload.arbitration import Cause, Policy
from illuminator_ros.payload.rotation import Quaternion
from support.faulty_wire import Faults, FaultyWire
from support.frames import Codec
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
    """A sender of frames; ``yaw`` marks the setpoints that bear an address."""

    number: int
    kind: str
    players: int
    random: random.Random
    wire: FaultyWire
    codec: Codec = field(default_factory=Codec)
    heartbeat_due: float = 0.0
    dies_at: float = math.inf

    def send(self, now: float) -> None:
        """Send the messages that are due."""
        if now >= self.dies_at:
            return
        if now >= self.heartbeat_due:
            self.heartbeat_due = now + 1.0
            self._transmit(self.number, mav.heartbeat(mavlink.MAV_TYPE_GCS), now)
        rate = 0.5 if self.kind == 'floods' else 0.03
        if self.random.random() < rate:
            number = self.number
            if self.kind == 'forges':
                number = self.random.randrange(self.players)
            self._transmit(number, self._message(number), now)

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

    def _transmit(self, number: int, message: mav.Message, now: float) -> None:
        self.wire.send(self.codec.frame(address_of(number), message), now)


def mark(number: int) -> float:
    """Return the yaw that marks the setpoints of one address, rad."""
    return (number - 10) * 0.25


class Arena:
    """A manager and its players, with checks that it obeys one player at a time."""

    def __init__(self, kinds: list[str], faults: Faults, overruling: set[int], seed: int) -> None:
        self.overruling = {address_of(number) for number in overruling}
        self.rig = ManagerRig(
            ControlSettings(Policy.HOLD, overruling=frozenset(self.overruling), lease=LEASE),
            device=information(**EVERYWHERE), nudge_limit=0.02)
        chance = random.Random(seed)
        self.players = [
            Player(number, kind, len(kinds), random.Random(chance.random()),
                   FaultyWire(faults, f'{seed} {number}'),
                   dies_at=self.rig.now + chance.uniform(1, 8) if kind == 'dies' else math.inf)
            for number, kind in enumerate(kinds)]
        self.decoders = [Decoder() for _ in kinds]
        self.heard: dict[mav.Address, float] = {}
        # The address whose setpoint the device has.
        self.obeyed: mav.Address | None = None
        self.changes = 0

    def run(self) -> None:
        """Run the manager and all players."""
        end = self.rig.now + SECONDS
        while self.rig.now < end:
            for player, decoder in zip(self.players, self.decoders, strict=True):
                player.send(self.rig.now)
                for data in player.wire.receive(self.rig.now):
                    for frame in decoder.feed(data):
                        self._give(frame.source, frame.message_id, frame.payload)
            before = len(self.rig.sent), len(self.rig.events)
            self.rig.run(STEP)
            self._check_sent([message for _, message in self.rig.sent[before[0]:]], None)
            self._check_changes(before[1], None)

    def _give(self, source: mav.Address, message_id: int, payload: bytes) -> None:
        [cls] = [cls for cls in self.rig.component.messages if cls.id == message_id]
        message = decode(cls, payload)
        events, holder = len(self.rig.events), self.rig.manager.control.holder(Role.PRIMARY)
        if cls.msgname == 'HEARTBEAT':
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


FAULTS = st.builds(
    Faults, drop=st.floats(0, 0.4), duplicate=st.floats(0, 0.3), reorder=st.floats(0, 0.5),
    delay=st.floats(0, 0.2), corrupt=st.floats(0, 0.2))


@settings(max_examples=25)
@given(st.lists(st.sampled_from(KINDS), min_size=2, max_size=20), FAULTS,
       st.sets(st.integers(0, 19), max_size=2), st.integers(0, 1 << 30))
def test_gm_12_exactly_one_player_is_obeyed_and_every_command_answered(
        kinds: list[str], faults: Faults, overruling: set[int], seed: int) -> None:
    Arena(kinds, faults, overruling, seed).run()


def test_gm_13_control_moves_and_setpoints_reach_the_device_in_that_test() -> None:
    arena = Arena([*KINDS * 4], Faults(drop=0.1, duplicate=0.1, reorder=0.2), {3}, 7)

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
