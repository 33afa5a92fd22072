# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Hostile input through a whole link: no exception, bounded state, and service as before."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Iterator
import itertools
from typing import Any

from illuminator_ros.mavlink import messages as mav
from illuminator_ros.mavlink.signing import SigningMode
import pytest
from support.attacked_link import ATTACKED, AttackedBridge, GENUINE
from support.fake_light import status_message
from support.frames import frame_of, heartbeat_frame, raw_v2
from support.simulated_link import SimulatedLink


@pytest.mark.parametrize(('kind', 'mode'), list(itertools.product(sorted(ATTACKED), SigningMode)))
def test_an_attack_breaks_nothing(kind: str, mode: SigningMode) -> None:
    attacked = ATTACKED[kind](('test', kind, mode.value), mode)
    while attacked.inputs < 600:
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


def forged(count: int) -> list[mav.Address]:
    """Return addresses of components that do not exist."""
    return [mav.Address(2 + number // 250, 1 + number % 250) for number in range(count)]


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


# Values
