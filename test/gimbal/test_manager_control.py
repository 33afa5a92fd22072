# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Control of a gimbal: every pair of holder and event under each policy."""

from __future__ import annotations

from pathlib import Path

from illuminator_ros.gimbal.manager_control import (
    ControlArbiter,
    ControlSettings,
    Role,
    RoleHolderChanged,
)
from illuminator_ros.mavlink.messages import Address, heartbeat
from illuminator_ros.payload.arbitration import Cause, Policy
import pytest
from support.tables import table

PAGE = Path(__file__).parents[2] / 'doc' / 'gimbal_manager.md'
PLAYER, LOWER, HIGHER, OVERRULING = (Address(255, id_) for id_ in (10, 20, 30, 40))
THIRD = Address(7, 7)
LEASE = 3.0
HOLDERS = {'none': None, 'the player': PLAYER, 'a lower player': LOWER,
           'a higher player': HIGHER, 'an overruling player': OVERRULING}
# The events of the page: params of DO_GIMBAL_MANAGER_CONFIGURE.
EVENTS = {
    'takes control': (*PLAYER, -1, -1),
    'gives control to another': (*THIRD, -1, -1),
    'sets "no one"': (0, 0, -1, -1),
    'releases its control': (-3, -3, -3, -3),
    'changes nothing': (-1, -1, -1, -1),
}
NAMES = {player: name for name, player in HOLDERS.items()} | {THIRD: 'the other'}


def control(policy: Policy = Policy.HOLD, *, overrules: bool = False) -> ControlArbiter:
    return ControlArbiter(ControlSettings(
        policy, (HIGHER, PLAYER, LOWER), frozenset({OVERRULING, *([PLAYER] * overrules)}), LEASE))


def held(policy: Policy, holder: Address | None, *, overrules: bool = False) -> ControlArbiter:
    one = control(policy, overrules=overrules)
    if holder is not None:
        one.configure(holder, (*holder, -1, -1), 0.0)
    return one


def after(policy: Policy, holder: Address | None, event: str, *, overrules: bool = False) -> str:
    """Return who has primary control after an event of the player, or that it was denied."""
    one = held(policy, holder, overrules=overrules)
    try:
        changes = one.configure(PLAYER, EVENTS[event], 1.0)
    except ValueError:
        assert one.holder(Role.PRIMARY) == holder
        return 'DENIED'
    assert len(changes) == (one.holder(Role.PRIMARY) != holder)
    return NAMES[one.holder(Role.PRIMARY)]


def test_a_player_takes_control_from_each_holder_as_the_page_says() -> None:
    assert table(PAGE.read_text(), 'a player takes control from') == [
        [name, *(after(policy, holder, 'takes control') for policy in Policy),
         after(Policy.HOLD, holder, 'takes control', overrules=True)]
        for name, holder in HOLDERS.items()]


@pytest.mark.parametrize(('policy', 'overrules'), [
    *((policy, False) for policy in Policy), (Policy.HOLD, True)])
@pytest.mark.parametrize('holder', HOLDERS.values(), ids=HOLDERS)
def test_control_is_given_away_as_it_is_taken_and_only_its_holder_releases_it(
        holder: Address | None, policy: Policy, overrules: bool) -> None:
    takes, gives, clears, releases, nothing = (
        after(policy, holder, event, overrules=overrules) for event in EVENTS)

    assert (gives, clears) == (
        ('DENIED', 'DENIED') if takes == 'DENIED' else ('the other', 'none'))
    assert (releases, nothing) == (
        'none' if holder == PLAYER else NAMES[holder], NAMES[holder])


@pytest.mark.parametrize('policy', Policy)
@pytest.mark.parametrize('role', Role)
def test_control_ends_after_the_lease_without_a_heartbeat_of_its_player(
        policy: Policy, role: Role) -> None:
    one = control(policy)
    one.configure(PLAYER, (*PLAYER, -1, -1) if role is Role.PRIMARY else (-1, -1, *PLAYER), 0.0)
    one.heard(PLAYER, heartbeat(2), 1.0)
    one.heard(LOWER, heartbeat(2), 3.9)

    assert one.due == 1.0 + LEASE
    assert one.poll(3.9) == []
    assert one.poll(4.0) == [RoleHolderChanged(role, PLAYER, None, Cause.SILENCE)]
    assert one.holder(role) is None


@pytest.mark.parametrize('params', [
    (255, -1), (-2, 190), (-3, 0), (256, 1), (1, 0), (0, 1), (1.5, 1), (float('nan'),) * 2,
    (float('inf'), 1), (-4, -4)])
@pytest.mark.parametrize('place', [0, 2])
def test_params_that_name_no_player_change_nothing(
        params: tuple[float, float], place: int) -> None:
    one = control()
    whole = (*params, *PLAYER) if place == 0 else (*PLAYER, *params)

    with pytest.raises(ValueError, match='does not name a player'):
        one.configure(PLAYER, whole, 0.0)

    assert [one.holder(role) for role in Role] == [None, None]


TAKEN = RoleHolderChanged(Role.PRIMARY, None, PLAYER, Cause.CLAIM, PLAYER)
SECONDARY = (LOWER, (-1, -1, *LOWER))


@pytest.mark.parametrize(('before', 'params', 'changes', 'holders'), [
    # -2 is the id of the sender.
    (SECONDARY, (-2, -2, -1, -1), [TAKEN], [PLAYER, LOWER]),
    # Both roles change or neither; a player that claims both gets only the primary role
    # while another player has the secondary one.
    (SECONDARY, (*PLAYER, *THIRD), None, [None, LOWER]),
    (SECONDARY, (*PLAYER, *PLAYER), [TAKEN], [PLAYER, LOWER]),
    ((PLAYER, (*PLAYER, *PLAYER)), (-3, -3, -3, -3), [
        RoleHolderChanged(role, PLAYER, None, Cause.RELEASE, PLAYER) for role in Role],
     [None, None])])
def test_both_roles_change_together(
        before: tuple[Address, tuple[float, ...]], params: tuple[float, ...],
        changes: list[RoleHolderChanged] | None, holders: list[Address | None]) -> None:
    one = control()
    one.configure(*before, 0.0)

    if changes is None:
        with pytest.raises(ValueError, match=(
                '255/10 may not change who is in control: 255/20 has secondary control, and the '
                'policy is hold')):
            one.configure(PLAYER, params, 1.0)
    else:
        assert one.configure(PLAYER, params, 1.0) == changes
    assert [one.holder(role) for role in Role] == holders
