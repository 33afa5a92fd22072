# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""
The arbiter decides which source may command a device.

test/gimbal/test_manager_control.py has each pair of holder and event under each policy.
"""

from __future__ import annotations

from collections.abc import Callable
import math

from hypothesis import given, strategies
from illuminator_ros.payload.arbitration import Arbiter, Cause, HolderChanged, Policy
import pytest

LEASE = 3.0
RANKS = {'high': 0, 'middle': 1, 'low': 2}
HOLD, PRIORITY = Policy.HOLD, Policy.PRIORITY


def arbiter(policy: Policy, *, remembers: bool = False) -> Arbiter[str]:
    return Arbiter(policy, RANKS.__getitem__, lease=LEASE, remembers=remembers)


def test_priority_does_not_take_the_device_from_a_source_of_the_same_rank() -> None:
    one: Arbiter[str] = Arbiter(PRIORITY)
    one.claim('first', 0.0)

    assert one.claim('second', 1.0) is None
    assert one.holder == 'first'


# The ends of the claim of 'high', which holds the arbiter.
ENDS: dict[Cause, Callable[[Arbiter[str]], HolderChanged[str] | None]] = {
    Cause.RELEASE: lambda one: one.release('high', 2.5),
    Cause.SILENCE: lambda one: one.poll(LEASE),
}


@pytest.mark.parametrize(('cause', 'end'), ENDS.items())
@pytest.mark.parametrize(('remembers', 'after'), [(False, None), (True, 'middle')])
def test_the_highest_remembered_claim_follows_when_the_holders_claim_ends(
        cause: Cause, end: Callable[[Arbiter[str]], HolderChanged[str] | None],
        remembers: bool, after: str | None) -> None:
    one = arbiter(PRIORITY, remembers=remembers)
    one.claim('high', 0.0)
    one.claim('low', 1.0)
    one.claim('middle', 2.0)

    assert end(one) == HolderChanged('high', after, cause)
    assert (one.holder, one.since) == (after, 2.5 if cause is Cause.RELEASE else LEASE)


@pytest.mark.parametrize('renewed', [False, True])
def test_a_sign_of_life_of_the_holder_extends_its_lease(renewed: bool) -> None:
    one = arbiter(HOLD)
    one.claim('low', 0.0)
    if renewed:
        one.renew('low', 2.0)

    one.poll(LEASE)

    assert one.holder == ('low' if renewed else None)


@pytest.mark.parametrize('act', [
    lambda one: one.renew('high', 1.0), lambda one: one.release('high', 1.0),
    lambda one: one.poll(1.0)], ids=['renew', 'release', 'poll'])
def test_nothing_but_a_claim_gives_a_source_the_device(
        act: Callable[[Arbiter[str]], object]) -> None:
    one = arbiter(HOLD)
    one.claim('low', 0.5)

    act(one)

    assert one.holder == 'low'


@given(strategies.sampled_from(Policy), strategies.booleans(), strategies.lists(strategies.tuples(
    strategies.sampled_from(['claim', 'renew', 'release', 'poll']),
    strategies.sampled_from(list(RANKS)), strategies.floats(0, 4)), max_size=40))
def test_the_holder_has_claimed_and_neither_released_nor_been_silent(
        policy: Policy, remembers: bool, steps: list[tuple[str, str, float]]) -> None:
    one = arbiter(policy, remembers=remembers)
    heard: dict[str, float] = {}
    now = 0.0
    for kind, source, pause in steps:
        now += pause
        one.poll(now)
        heard = {name: at for name, at in heard.items() if now < at + LEASE}
        if kind == 'claim':
            one.claim(source, now)
            heard[source] = now
        elif kind == 'renew':
            one.renew(source, now)
            heard |= {source: now} if source in heard else {}
        elif kind == 'release':
            one.release(source, now)
            heard.pop(source, None)
        assert one.holder is None or one.holder in heard
        if policy is PRIORITY and remembers:
            assert one.holder == min(heard, key=RANKS.__getitem__, default=None)
        assert one.due > now or math.isinf(one.due)
