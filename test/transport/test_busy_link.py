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

from collections.abc import Callable

from illuminator_ros.mavlink.crowd import COLLECTION
from illuminator_ros.mavlink.messages import CommandLong
from illuminator_ros.mavlink.transport.udp import BATCH, PEER_EXPIRY
import pytest
from support.frames import AUTOPILOT, foreign_frame, LIGHT
from support.heartbeats import heartbeat_frame
from support.live_link import BRIDGE, LiveLink, Talker
from support.simulated_link import SimulatedLink

PEER = ('127.0.0.1', 14550)
# s between frames.
GAP = 0.005
COMMAND = CommandLong(*LIGHT, 512, 0, 440, 0, 0, 0, 0, 0, 0)


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
    one.collected_at.clear()
    return one


def test_who_sends_nothing_but_frames_for_others_stays_a_peer(link: SimulatedLink) -> None:
    sequence = 3
    begun = link.now
    while link.now < begun + 2 * PEER_EXPIRY:
        link.run(0.1)
        link.receive((foreign_frame(sequence), PEER))
        sequence += 1
    assert link.state().peers == 1
    assert link.udp.peers(link.now) == (PEER,)


def test_it_is_a_sign_of_life(link: SimulatedLink, endpoint: Talker) -> None:
    greetings = len(endpoint.greetings)
    for sequence in range(3, 100):
        link.run(0.1)
        link.receive((foreign_frame(sequence), PEER))
    assert len(endpoint.greetings) == greetings


def test_its_losses_are_counted(link: SimulatedLink) -> None:
    for sequence in (3, 4, 7, 8, 8):
        link.receive((foreign_frame(sequence), PEER))
    counter = link.state().traffic.sources[AUTOPILOT]
    assert (counter.received, counter.lost, counter.duplicate) == (8, 2, 1)
    assert link.state().traffic.frames_received == 8


def test_frames_with_our_own_address_are_all_looked_at(
    link: SimulatedLink, endpoint: Talker,
) -> None:
    link.receive((heartbeat_frame(BRIDGE, sequence=77), PEER))
    link.receive((foreign_frame(78, BRIDGE) + heartbeat_frame(BRIDGE, sequence=79), PEER))
    assert [source for source, _ in endpoint.heard] == [BRIDGE, BRIDGE]


def test_frames_for_others_collect(link: SimulatedLink) -> None:
    begun = link.now
    link.run(0.5)
    assert link.collected_at == [begun]


def test_a_frame_for_us_is_taken_with_them(link: SimulatedLink, endpoint: Talker) -> None:
    link.receive((foreign_frame(3), PEER), (heartbeat_frame(LIGHT), PEER))
    assert [source for source, _ in endpoint.heard] == [LIGHT]


def test_nothing_collects_while_there_is_more_to_read(link: SimulatedLink) -> None:
    link.run(1.5 * COLLECTION)
    link.collected_at.clear()
    link.receive(*((foreign_frame(number & 0xFF), PEER) for number in range(3, 4 + BATCH)))
    assert link.collected_at == []


def test_nothing_collects_in_the_midst_of_a_burst(link: SimulatedLink) -> None:
    link.run(0.5)
    link.collected_at.clear()
    for sequence in range(3, 43):
        link.run(GAP / 100)
        link.receive((foreign_frame(sequence), PEER))
    assert link.collected_at == []


def test_frames_for_us_do_not_collect(link: SimulatedLink) -> None:
    link.run(0.5)
    link.collected_at.clear()
    for sequence in range(10):
        link.receive((heartbeat_frame(LIGHT, sequence=sequence), PEER))
        link.run(GAP)
    assert link.collected_at == []


def test_nothing_collects_once_something_was_asked(
    link: SimulatedLink, endpoint: Talker,
) -> None:
    link.ask(lambda now: endpoint.outgoing.append((BRIDGE, COMMAND)))
    link.collected_at.clear()
    for sequence in range(3, 10):
        link.run(GAP)
        link.receive((foreign_frame(sequence), PEER))
    assert link.collected_at == []


def test_nothing_collects_where_something_is_due_before(
    link: SimulatedLink, endpoint: Talker,
) -> None:
    endpoint.heartbeat.due = link.now + COLLECTION / 2
    link.ask(lambda now: None)
    for sequence in range(3, 6):
        link.receive((foreign_frame(sequence), PEER))
    link.collected_at.clear()
    link.receive((foreign_frame(6), PEER))
    assert link.collected_at == []


def test_a_call_does_not_wait_for_frames_to_collect(
    run: Callable[[LiveLink], LiveLink],
) -> None:
    # Where a call did not end the collection, this would take for ever, and not 10 ms.
    ours = run(LiveLink('memory://busy'))
    ours.wait_open()
    ours.link._crowd.collects = lambda now: True  # type: ignore[method-assign]
    polled: list[object] = []
    real = ours.link._calls_only

    class Unending:

        def poll(self, milliseconds: float) -> None:
            polled.append(real.poll())

    ours.link._calls_only = Unending()  # type: ignore[assignment]
    for _ in range(10):
        assert ours.ask(lambda now: 'answer') == 'answer'
    assert polled
