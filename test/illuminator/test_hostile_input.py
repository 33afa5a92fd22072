# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Hostile input through a whole link: no exception, bounded state, and service as before."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Iterator
import itertools
from typing import Any

from illuminator_ros.mavlink import messages as mav
from illuminator_ros.mavlink.dialect import CRC_EXTRA
from illuminator_ros.mavlink.signing import MAX_STREAMS, SigningMode
from illuminator_ros.payload.discovery import MAX_DEVICES
from illuminator_ros.payload.requests import MAX_CALLS, Result
import pytest
from support.attacked_link import ATTACKED, AttackedBridge, AttackedLink, GENUINE
from support.fake_light import status_message
from support.frames import frame_of, heartbeat_frame, raw_v2
from support.simulated_link import SimulatedLink


@pytest.mark.parametrize(('kind', 'mode'), list(itertools.product(sorted(ATTACKED), SigningMode)))
def test_an_attack_breaks_nothing(kind: str, mode: SigningMode) -> None:
    attacked = ATTACKED[kind](('test', kind, mode.value), mode)
    while attacked.inputs < 2000:
        attacked.attack()
    attacked.check_bounds()
    attacked.check_service()
    attacked.close()


# Floods

@pytest.fixture
def bridge() -> Iterator[AttackedBridge]:
    """Return the bridge's side with its genuine light."""
    attacked = AttackedBridge('flood', SigningMode.OFF)
    yield attacked
    attacked.close()


def flood(
    attacked: AttackedLink, frames: Iterable[bytes], *, peers: int = 1, first: int = 0,
) -> None:
    """Send frames at one moment, from ``peers`` peers in turn."""
    for number, frame in enumerate(frames, first):
        attacked.link.receive((frame, ('127.0.0.2', 1 + number % peers)))


def forged(count: int) -> list[mav.Address]:
    """Return addresses of components that do not exist."""
    return [mav.Address(2 + number // 250, 1 + number % 250) for number in range(count)]


def unknown_ids() -> Iterator[int]:
    return (number for number in range(1 << 20, 1 << 24) if number not in CRC_EXTRA)


def assert_bounded(attacked: AttackedLink, frames: list[bytes], *, peers: int = 1) -> None:
    """Check that only the first half of a flood takes memory."""
    half, sizes = len(frames) // 2, [attacked.entries()]
    for part, first in ((frames[:half], 0), (frames[half:], half)):
        flood(attacked, part, peers=peers, first=first)
        sizes.append(attacked.entries())
    before, first, second = sizes
    assert second - first <= 0.1 * (first - before)


@pytest.mark.parametrize(('frames', 'peers'), [
    ([heartbeat_frame(address) for address in forged(6 * MAX_DEVICES)], 1),
    ([heartbeat_frame(address, mav_type=2) for address in forged(3000)], 1),
    ([heartbeat_frame(mav.Address(2, 1))] * 3000, 3000),
    ([heartbeat_frame(GENUINE)] * 3000, 3000),
    ([raw_v2(message_id, b'x', crc_extra=0, source=mav.Address(9, 9))
      for message_id in itertools.islice(unknown_ids(), 5000)], 1),
    ([frame_of(status_message(uptime_ms=number % 2 * 1_000_000), 0, GENUINE)
      for number in range(2000)], 1),
], ids=['lights', 'components', 'peers', 'peers that claim to be the light', 'unknown messages',
        'restarts'])
def test_a_flood_is_bounded_and_the_genuine_light_is_served(
    bridge: AttackedBridge, frames: list[bytes], peers: int,
) -> None:
    assert_bounded(bridge, frames, peers=peers)
    assert list(bridge.controller.lights) == [GENUINE]
    bridge.check_service()


class NeverEmpty(deque[Any]):
    """An inbox with a flood behind the genuine frames; time passes while a datagram is read."""

    def __init__(self, link: SimulatedLink, frames: Iterable[bytes]) -> None:
        super().__init__()
        self._link = link
        self._flood = itertools.cycle(frames)

    def __bool__(self) -> bool:
        return True

    def popleft(self) -> Any:
        self._link.now += 0.0002
        return super().popleft() if len(self) else (next(self._flood), ('127.0.0.2', 1))


@pytest.mark.parametrize('frames', [
    [frame_of(mav.heartbeat(2), number, mav.Address(9, 9)) for number in range(256)],
    [raw_v2(30, bytes(28), crc_extra=39, source=mav.Address(1, 1), sequence=number)
     for number in range(256)],
    [heartbeat_frame(address) for address in forged(300)],
    [frame_of(status_message(number), number % 256, mav.Address(1, 1)) for number in range(500)],
    [bytes(range(256)) * 5],
], ids=['heartbeats', 'unused messages', 'lights', 'statuses', 'noise'])
@pytest.mark.parametrize('fault', ['', 'silence'])
def test_a_set_ends_within_0_9_s_in_a_flood_that_never_ends(
    bridge: AttackedBridge, frames: list[bytes], fault: str,
) -> None:
    light, link = bridge.controller.lights[GENUINE], bridge.link
    ended: list[tuple[bool, float]] = []
    link.socket.inbox = NeverEmpty(link, frames)
    bridge.genuine(2.0)
    if fault:
        bridge.disturb(fault)
    begun = link.now
    link.call(lambda now: light.configure(
        {'brightness': 55.0}, now,
        lambda result, now: ended.append((result.success, now - begun))))
    bridge.genuine(1.2)
    [(success, seconds)] = ended
    assert success != bool(fault)
    assert seconds < 0.9


def test_a_flood_of_signed_streams_is_bounded() -> None:
    attacked = AttackedBridge('streams', SigningMode.REQUIRE)
    assert_bounded(attacked, [
        attacked.attacker.signed(mav.Heartbeat.id, bytes(9), 0, source, attacked.link.now)
        for source in forged(40 * MAX_STREAMS)])
    attacked.check_service()
    attacked.close()


def test_a_flood_of_requests_is_refused_beyond_a_limit_and_all_are_answered(
    bridge: AttackedBridge,
) -> None:
    light = bridge.controller.lights[GENUINE]
    answers: list[list[Result]] = [[] for _ in range(10 * MAX_CALLS)]

    def ask(now: float) -> None:
        for results in answers:
            light.enable(True, now, lambda result, now, to=results: to.append(result))

    bridge.link.ask(ask)
    bridge.check_bounds()
    bridge.check_service()
    assert [len(results) for results in answers] == [1] * len(answers)
    assert [results[0].success for results in answers].count(True) == MAX_CALLS


# Values

def send_status(bridge: AttackedBridge, later_ms: int = 10, **fields: Any) -> None:
    """Send a status in the name of the genuine light."""
    status = bridge.controller.lights[GENUINE].twin.status
    assert status is not None
    uptime_ms = status.uptime_ms + later_ms
    flood(bridge, [frame_of(status_message(uptime_ms, **{'enable': 1, **fields}), 0, GENUINE)])


def test_a_strobe_period_that_is_zero_but_for_rounding_is_zero(bridge: AttackedBridge) -> None:
    # The value compares equal to 0, but the light would always deny it.
    light = bridge.controller.lights[GENUINE]
    send_status(bridge, strobe_period=1e-45)
    assert light.snapshot(0.0).configuration.strobe_period == 0.0
    bridge.check_service()
