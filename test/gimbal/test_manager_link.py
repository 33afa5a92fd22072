# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""A gimbal manager on a link: message signing, and a forged address."""

from __future__ import annotations

from illuminator_ros.gimbal.manager import GimbalManager, ManagerSettings
from illuminator_ros.gimbal.manager_control import Role
from illuminator_ros.gimbal.manager_state import ManagerState
from illuminator_ros.mavlink.command_sender import CommandSender
from illuminator_ros.mavlink.component import Component
from illuminator_ros.mavlink.dialect import mavlink
from illuminator_ros.mavlink.messages import Address, heartbeat, Message
from illuminator_ros.mavlink.signing import Signing, SigningMode
from support.frames import Codec
from support.gimbal_manager import configure, DEVICE, GUEST, OURS, PILOT
from support.signers import KEY, WRONG_KEY
from support.simulated_link import SimulatedLink

GOOD, EVIL = ('127.0.0.1', 5001), ('127.0.0.1', 5002)


class Rig:
    """A manager on a link, and senders with keys."""

    def __init__(self, mode: SigningMode) -> None:
        commands = CommandSender(OURS)
        self.manager = GimbalManager(commands, ManagerSettings())
        self.link = SimulatedLink(
            Component(commands, [self.manager]), lambda data, peer: None,
            signing=Signing(mode, KEY))
        self.good = Codec(Signing(mode, KEY))
        for _ in range(8):
            self.send(self.good, DEVICE, heartbeat(mavlink.MAV_TYPE_GIMBAL))
            self.link.run(1.0)
        assert self.manager.tracker.state is ManagerState.ACTIVE

    def send(self, codec: Codec, source: Address, message: Message, peer: object = GOOD) -> bytes:
        data = codec.frame(source, message, self.link.now)
        self.link.receive((data, peer))
        return data

    @property
    def holder(self) -> Address | None:
        return self.manager.control.holder(Role.PRIMARY)


def test_where_signing_is_required_an_unsigned_or_forged_configure_changes_nothing() -> None:
    rig = Rig(SigningMode.REQUIRE)
    unsigned, forged = Codec(), Codec(Signing(SigningMode.REQUIRE, WRONG_KEY))
    taken = rig.send(rig.good, PILOT, configure(*PILOT))
    assert rig.holder == PILOT

    for codec in (unsigned, forged):
        rig.send(codec, PILOT, configure(-3, -3), EVIL)
        rig.send(codec, PILOT, configure(*GUEST), EVIL)
    assert rig.holder == PILOT

    rig.send(rig.good, PILOT, configure(-3, -3))
    rig.link.receive((taken, EVIL))
    assert rig.holder is None


def test_without_signing_a_forged_address_is_seen_as_a_second_way_to_the_player() -> None:
    rig = Rig(SigningMode.OFF)
    rig.send(rig.good, PILOT, configure(*PILOT))
    assert rig.link.lines.peer_count_of(PILOT, rig.link.now) == 1

    rig.send(Codec(), PILOT, heartbeat(6), EVIL)

    assert rig.link.lines.peer_count_of(PILOT, rig.link.now) == 2
    rig.link.run(11.0)
    assert rig.link.lines.peer_count_of(PILOT, rig.link.now) == 0
