# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Primary and secondary control of a gimbal, as DO_GIMBAL_MANAGER_CONFIGURE sets it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum

from .messages import NO_PLAYER, REMOVE_SENDER, SENDER, UNCHANGED
from ..mavlink.messages import Address, Heartbeat
from ..payload.arbitration import Arbiter, Cause, Policy

# s within which two different heartbeats of one address show two senders.
IDENTITY_TIME = 3.0


class Role(Enum):
    """The two kinds of control of the gimbal protocol v2."""

    PRIMARY = 'primary'
    SECONDARY = 'secondary'


@dataclass(frozen=True)
class ControlSettings:
    """
    The rules by which control moves from player to player.

    :param priority: players, the highest first; all others rank equally, below these.
    :param overruling: players that take control under each policy.
    :param lease: s without a heartbeat of a player after which its control ends, > 0.
    """

    policy: Policy = Policy.HOLD
    priority: tuple[Address, ...] = ()
    overruling: frozenset[Address] = frozenset()
    lease: float = 3.0


@dataclass(frozen=True)
class RoleHolderChanged:
    """
    The player that has a role has changed.

    :param before: the player that had it, None if none had.
    :param after: the player that has it now, None if none has.
    :param by: the player that caused the change, None where the lease ended.
    """

    role: Role
    before: Address | None
    after: Address | None
    cause: Cause
    by: Address | None = None


class ControlArbiter:
    """
    Decides who is in primary and in secondary control. No I/O; times are s.

    Each role is held by at most one player. A player that may take a role may also give it to
    another player.

    :ivar primary: the arbiter of primary control; likewise ``secondary``. Only this class changes
        them.
    """

    def __init__(self, settings: ControlSettings) -> None:
        def rank(player: Address) -> int:
            ranks = settings.priority
            return ranks.index(player) if player in ranks else len(ranks)

        self.primary, self.secondary = (Arbiter(
            settings.policy, rank, lease=settings.lease, overruling=settings.overruling)
            for _ in Role)
        self._policy = settings.policy
        self._arbiters = {Role.PRIMARY: self.primary, Role.SECONDARY: self.secondary}
        # The last heartbeat of each player in control, and its time.
        self._identities: dict[Address, tuple[tuple[int, int], float]] = {}

    def holder(self, role: Role) -> Address | None:
        """Return the player that has a role, None if none has."""
        return self._arbiters[role].holder

    def configure(
        self, source: Address, params: Sequence[float], now: float,
    ) -> list[RoleHolderChanged]:
        """
        Execute MAV_CMD_DO_GIMBAL_MANAGER_CONFIGURE for both roles or for neither.

        Clients such as MAVSDK claim both roles although they need only the primary one. Another
        player that has the secondary role then keeps it.

        :param params: param1 to param4.
        :raises ValueError: if it is denied, or the params do not name players.
        """
        primary = self._wanted(Role.PRIMARY, source, *params[0:2])
        secondary = self._wanted(Role.SECONDARY, source, *params[2:4])
        if primary == secondary == source and not self._may_give(Role.SECONDARY, source, source):
            secondary = self.holder(Role.SECONDARY)
        wanted = {Role.PRIMARY: primary, Role.SECONDARY: secondary}
        for role, player in wanted.items():
            if not self._may_give(role, source, player):
                raise ValueError(
                    f'{source} may not change who is in control: {self.holder(role)} has '
                    f'{role.value} control, and the policy is {self._policy.value}')
        return [change for role, player in wanted.items()
                if (change := self._give(role, source, player, now))]

    def heard(self, player: Address, message: Heartbeat, now: float) -> bool:
        """Note a heartbeat of a player; return whether two senders use its address in control."""
        for arbiter in self._arbiters.values():
            arbiter.renew(player, now)
        holders = [self.holder(role) for role in Role]
        self._identities = {
            one: identity for one, identity in self._identities.items() if one in holders}
        if player not in holders:
            return False
        identity = message.type, message.autopilot
        before, at = self._identities.get(player, (identity, now))
        self._identities[player] = identity, now
        return before != identity and now < at + IDENTITY_TIME

    def poll(self, now: float) -> list[RoleHolderChanged]:
        """Take the roles from players whose lease has ended."""
        return [RoleHolderChanged(role, change.before, change.after, change.cause)
                for role, arbiter in self._arbiters.items() if (change := arbiter.poll(now))]

    @property
    def due(self) -> float:
        """Return when :meth:`poll` is due, infinity if never."""
        return min(self.primary.due, self.secondary.due)

    def _wanted(
        self, role: Role, source: Address, system: float, component: float,
    ) -> Address | None:
        """Return the player to which the params give a role."""
        holder = self.holder(role)
        special: dict[float, Address | None] = {
            NO_PLAYER: None, UNCHANGED: holder, SENDER: source,
            REMOVE_SENDER: None if holder == source else holder}
        if system == component and system in special:
            return special[system]
        # Also false for NaN.
        if all(1 <= id_ <= 255 and id_ % 1 == 0 for id_ in (system, component)):
            return Address(int(system), int(component))
        raise ValueError(f'{system:g}/{component:g} does not name a player')

    def _may_give(self, role: Role, source: Address, player: Address | None) -> bool:
        return player == self.holder(role) or self._arbiters[role].may_hold(source)

    def _give(
        self, role: Role, source: Address, player: Address | None, now: float,
    ) -> RoleHolderChanged | None:
        arbiter, before = self._arbiters[role], self.holder(role)
        if player == before:
            return None
        if before != source:
            arbiter.claim(source, now)
        if player != source:
            arbiter.release(source, now)
            if player is not None:
                arbiter.claim(player, now)
        cause = Cause.RELEASE if before == source else Cause.CLAIM
        return RoleHolderChanged(role, before, player, cause, source)
