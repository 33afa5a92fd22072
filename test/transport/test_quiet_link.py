# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""A link with little to do: how often it announces itself, what it counts, and that it rests."""

from __future__ import annotations

import errno
import socket
from typing import Any

from illuminator_ros.mavlink import component
from illuminator_ros.mavlink.connector import Connector
from illuminator_ros.mavlink.frame import Decoder, Frame
from illuminator_ros.mavlink.messages import Address, CommandLong
from illuminator_ros.mavlink.signing import stamp_of, ticks
import pytest
from support.frames import heartbeat_frame, raw_v2
from support.live_link import BRIDGE, LiveLink, Run, Talker
from support.ports import free_port
from support.ptys import PtyDevice
from support.signers import checker, SECOND, signed_frame, WRONG_KEY
from support.simulated_link import SimulatedLink
from support.waiting import eventually

PEER = ('127.0.0.1', 14550)
AUTOPILOT = Address(7, 1)
ATTITUDE = 30
BEAT, NOISE = heartbeat_frame(), b'noise' + heartbeat_frame()[:-1] + b'x'


def foreign_frame(sequence: int, source: Address = AUTOPILOT) -> bytes:
    """Return a frame with a message that the endpoint does not handle."""
    return raw_v2(ATTITUDE, bytes(range(1, 29)), sequence=sequence & 0xFF, source=source)


def simulated() -> tuple[SimulatedLink, Talker]:
    """Return a link that was opened at 0 s, and its endpoint."""
    endpoint = Talker()
    return SimulatedLink(endpoint, lambda data, peer: None, now=0.0), endpoint


# A router that has restarted forwards nothing to us until it has heard us.
@pytest.mark.parametrize(('steps', 'announcements'), [
    # Before the first frame, at the first frame, and not while frames come.
    ([0.6, BEAT, 1.0], [0.0, 0.25, 0.5, 0.6]), ([BEAT, 1.4, BEAT, 1.4, BEAT, 1.4], [0.0, 0.0]),
    ([BEAT, *[1.4, foreign_frame(0)] * 5], [0.0, 0.0]),
    # Again after 1.5 s without a valid frame.
    ([BEAT, 2.1], [0.0, 0.0, 1.5, 1.75, 2.0]), ([BEAT, 1.0, NOISE, 0.6], [0.0, 0.0, 1.5])])
def test_link_announces_itself_while_it_hears_no_valid_frame(
        steps: list[float | bytes], announcements: list[float]) -> None:
    link, endpoint = simulated()
    for step in steps:
        if isinstance(step, bytes):
            link.receive((step, PEER))
        else:
            link.run(step)
    assert list(endpoint.announcements) == announcements


def test_heartbeat_is_sent_once_a_second_while_a_peer_is_heard() -> None:
    times: list[float] = []
    link = SimulatedLink(Talker(), lambda data, peer: times.append(link.now), now=0.0)
    for _ in range(5):
        link.receive((BEAT, PEER))
        link.run(1.0)
    assert times == pytest.approx([0.0, 1.0, 2.0, 3.0, 4.0, 5.0])


def test_frames_that_came_while_the_process_was_stopped_precede_the_deadlines() -> None:
    link, endpoint = simulated()
    heard_at_poll: list[int] = []

    def stop() -> None:
        link.now = link.until = link.now + 10.0
        link.socket.inbox.append((BEAT, PEER))

    endpoint.schedule.at(lambda now: heard_at_poll.append(len(endpoint.heard)), link.now + 5.0)
    link.meanwhile.append(stop)
    link.run(0.01)
    assert heard_at_poll == [1]


def test_a_signer_whose_clock_is_behind_gets_heartbeats_and_nothing_else() -> None:
    endpoint, sent = Talker(), list[tuple[Any, Frame]]()
    link = SimulatedLink(endpoint, lambda data, peer: sent.extend(
        (peer, frame) for frame in Decoder().feed(data)), signing=checker())
    link.run(1.5)
    stamp = ticks(1.7e9 + link.now) - 70 * SECOND
    link.receive((signed_frame(stamp, key=WRONG_KEY), PEER))
    assert sent == []
    link.receive((signed_frame(stamp), PEER))
    ((to, answer),) = sent
    assert (to, answer.message_id, answer.source) == (PEER, 0, BRIDGE)
    assert stamp_of(answer.signature or b'') > stamp + 68 * SECOND
    # It is not a peer, and its frame is not valid.
    endpoint.outgoing.append((BRIDGE, CommandLong(1, 243, 405, 0, 1, 0, 0, 0, 0, 0, 0)))
    link.run(1.5)
    assert (len(sent), len(endpoint.heard), link.state().peers) == (1, 0, 0)
    assert link.state().traffic.sources == {}
    # The clock has followed.
    link.receive((signed_frame(stamp_of(answer.signature or b'') + 1), PEER))
    assert (len(endpoint.heard), link.state().peers) == (1, 1)


def rests(link: LiveLink) -> bool:
    """Return whether the thread makes few turns during the next heartbeats."""
    turns = []
    for _ in range(4):
        count = link.endpoint.heartbeat.count
        eventually(
            lambda count=count: link.endpoint.heartbeat.count != count)  # type: ignore[misc]
        turns.append(link.endpoint.turns.count)
    return turns[-1] - turns[0] < 120


@pytest.fixture
def _fast_heartbeat(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(component, 'HEARTBEAT_INTERVAL', 0.1)


@pytest.mark.parametrize('url', ['memory://quiet', 'udpin://127.0.0.1:{port}'])
def test_open_link_without_traffic_rests(run: Run, url: str, _fast_heartbeat: None) -> None:
    assert rests(run(LiveLink(url.format(port=free_port(socket.SOCK_STREAM)))))


def test_line_that_takes_nothing_makes_no_work_and_drops_are_counted(
        run: Run, device: PtyDevice, _fast_heartbeat: None) -> None:
    link = run(LiveLink(f'serial://{device.path}:57600'))
    link.wait_open()

    def fill(now: float) -> None:
        for _ in range(3000):
            link.endpoint.heartbeat.send(now)

    link.ask(fill)
    assert rests(link)
    assert link.state().traffic.frames_dropped > 0
    assert link.state().traffic.frames_sent >= 3000


def test_a_line_that_is_lost_by_an_answer_to_a_datagram_reads_no_other_and_stays_silent(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    link, endpoint = simulated()
    [line] = link.lines
    link.run(1.0)
    monkeypatch.setattr(Connector, 'start', lambda self: None)

    def fail(*arguments: object) -> None:
        raise OSError(errno.ENETUNREACH, 'Network is unreachable')

    monkeypatch.setattr(link.udp, 'send', fail)
    # Each new peer is sent a heartbeat.
    link.receive((BEAT, PEER), (BEAT, ('127.0.0.1', 2)))
    announced = len(endpoint.announcements)
    link.run(6.0)

    assert not line.is_open
    assert len(endpoint.announcements) == announced
