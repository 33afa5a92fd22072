# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""MAVLink 1 links, checked by a parser that accepts nothing else."""

from __future__ import annotations

from typing import Any

from illuminator_ros.illuminator.messages import IlluminatorStatus
from illuminator_ros.mavlink import messages as mav
from illuminator_ros.mavlink.command_sender import CommandSender
from illuminator_ros.mavlink.component import Component, Payload
from illuminator_ros.mavlink.link import Link
from illuminator_ros.mavlink.signing import Signing, SigningMode
from illuminator_ros.mavlink.url import parse_url
import pytest
from support.frames import heartbeat_frame
from support.live_link import BRIDGE, Talker
from support.simulated_link import SimulatedLink
from support.strict_mavlink_1 import parse_strictly

PEER = ('127.0.0.1', 14550)


class Talker1(Talker):
    """Handles the messages given, and acknowledges each."""

    def __init__(self, *messages: type[mav.Message]) -> None:
        super().__init__()
        self.messages = messages

    def receive(self, source: mav.Address, message: mav.Message, now: float) -> None:
        self.outgoing.append((BRIDGE, mav.CommandAck(405, 0, 50, -1, *source)))


def test_link_of_version_1_sends_whole_payloads_without_extensions_in_version_1_frames() -> None:
    sent: list[bytes] = []
    endpoint = Talker1(mav.Heartbeat, mav.CommandAck)
    link = SimulatedLink(endpoint, lambda data, peer: sent.append(data), mavlink_version=1)

    # The link sends MAVLink 1 even after it has received this MAVLink 2 frame.
    link.receive((heartbeat_frame(mav.Address(1, 1)), PEER))
    link.ask(lambda now: endpoint.outgoing.extend([
        (BRIDGE, mav.CommandLong(1, 2, 512, 0, 0, 0, 0, 0, 0, 0, 0)),
        (BRIDGE, mav.CommandInt(1, 2, 0, 195, 0, 0, 0, 0, 0, 0, 0, 0, 0))]))

    assert parse_strictly(b''.join(sent)) == [
        (0, bytes((0, 0, 0, 0, 18, 8, 0, 4, 3))), (77, bytes((149, 1, 0))),
        (76, bytes(28) + bytes((0, 2, 1, 2, 0))), (75, bytes(28) + bytes((195, 0, 1, 2, 0, 0, 0)))]


def test_link_of_version_1_refuses_messages_that_only_a_payload_of_its_component_sends() -> None:
    class Sender(Payload):
        messages = (mav.Heartbeat,)
        sends = (IlluminatorStatus,)

        def receive(self, source: mav.Address, message: mav.Message, now: float) -> None:
            raise AssertionError('the link is not made')

    with pytest.raises(ValueError, match='cannot carry ILLUMINATOR_STATUS:'):
        Link(parse_url('memory://one'), Component(CommandSender(BRIDGE), [Sender()]),
             label='one', mavlink_version=1)


@pytest.mark.parametrize(('messages', 'options', 'reason'), [
    ((mav.Heartbeat, IlluminatorStatus), {}, 'MAVLink 1 cannot carry ILLUMINATOR_STATUS:'),
    ((), {'signing': Signing(SigningMode.SIGN, bytes(32))}, 'cannot be signed'),
    ((), {'mavlink_version': 3}, 'version 3 is neither')])
def test_link_that_mavlink_1_cannot_serve_is_refused_with_the_reason(
        messages: tuple[type[mav.Message], ...], options: dict[str, Any], reason: str) -> None:
    with pytest.raises(ValueError, match=reason):
        Link(parse_url('memory://one'), Talker1(*messages), label='one',
             **{'mavlink_version': 1, **options})
