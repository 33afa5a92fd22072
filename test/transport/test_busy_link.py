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

"""A link on which most frames are for others."""

from __future__ import annotations

from illuminator_ros.mavlink.transport.udp import PEER_EXPIRY
import pytest
from support.frames import AUTOPILOT, foreign_frame
from support.heartbeats import heartbeat_frame
from support.live_link import BRIDGE, Talker
from support.simulated_link import SimulatedLink

PEER = ('127.0.0.1', 14550)
# s between frames.
GAP = 0.005


@pytest.fixture
def endpoint() -> Talker:
    """Return what is on our side of the link."""
    return Talker()


@pytest.fixture
def link(endpoint: Talker) -> SimulatedLink:
    """Return a link that has just heard some frames for others."""
    one = SimulatedLink(endpoint, lambda data, peer: None)
    for sequence in range(3):
        one.run(GAP)
        one.receive((foreign_frame(sequence), PEER))
    return one


def test_sender_of_foreign_frames_only_stays_a_peer(link: SimulatedLink) -> None:
    sequence = 3
    begun = link.now
    while link.now < begun + 2 * PEER_EXPIRY:
        link.run(0.1)
        link.receive((foreign_frame(sequence), PEER))
        sequence += 1
    assert link.state().peers == 1
    assert link.udp.peers(link.now) == (PEER,)


def test_foreign_frames_are_a_sign_of_life(link: SimulatedLink, endpoint: Talker) -> None:
    greetings = len(endpoint.greetings)
    for sequence in range(3, 100):
        link.run(0.1)
        link.receive((foreign_frame(sequence), PEER))
    assert len(endpoint.greetings) == greetings


def test_losses_among_foreign_frames_are_counted(link: SimulatedLink) -> None:
    for sequence in (3, 4, 7, 8, 8):
        link.receive((foreign_frame(sequence), PEER))
    counter = link.state().traffic.sources[AUTOPILOT]
    assert (counter.received, counter.lost, counter.duplicate) == (8, 2, 1)
    assert link.state().traffic.frames_received == 8


def test_every_frame_from_our_own_address_is_received(
    link: SimulatedLink, endpoint: Talker,
) -> None:
    link.receive((heartbeat_frame(BRIDGE, sequence=77), PEER))
    link.receive((foreign_frame(78, BRIDGE) + heartbeat_frame(BRIDGE, sequence=79), PEER))
    assert [source for source, _ in endpoint.heard] == [BRIDGE, BRIDGE]
