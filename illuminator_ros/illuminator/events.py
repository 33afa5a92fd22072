# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The events of lights, and snapshots of lights for other threads."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
import math
from typing import NamedTuple, TypeAlias

from .model import Configuration, FIELDS, Status
from ..mavlink.messages import Address
from ..payload.arbitration import Cause, HolderChanged
from ..payload.device_events import DeviceConnected, DeviceEvent, DeviceHeld
from ..payload.identity import Identity


class ChangeCause(Enum):
    """The reason why the confirmed configuration has changed."""

    FIRST_STATUS = 'first status'
    REQUEST = 'request'
    LATE_EFFECT = 'late effect'
    LIGHT = 'light'
    ROUNDING = 'rounding'


# The origins of a switch that no request names.
A_REQUEST, OTHER_SENDER = 'a request', 'another sender'
# The origin of a change by a command that ended unconfirmed.
LATE_EFFECT = 'a late effect of our request'


LightEvent: TypeAlias = DeviceEvent[Address]


@dataclass(frozen=True)
class LightRestarted(LightEvent):
    """
    A light has restarted.

    :param was_on: whether it was on before, None if not known.
    :param is_on: whether it is on now, None if not known.
    """

    was_on: bool | None
    is_on: bool | None


@dataclass(frozen=True)
class LightIdentified(LightEvent):
    """A light has sent COMPONENT_INFORMATION_BASIC."""

    identity: Identity


@dataclass(frozen=True)
class StatusReceived(LightEvent):
    """
    A light has sent ILLUMINATOR_STATUS.

    :param received_at: s on the link's clock.
    :param temperature: degC; None where the light does not measure it, or its sensor fails.
    """

    status: Status
    received_at: float
    temperature: float | None = None


@dataclass(frozen=True)
class StatesChanging(LightEvent):
    """
    The state of a light has begun, or ceased, to go back and forth without a command of ours.

    Several lights with one address cause that, or another controller.
    """

    is_changing: bool


@dataclass(frozen=True)
class ConfigurationChanged(LightEvent):
    """
    The confirmed configuration of a light has changed.

    :param names: the fields that differ from before.
    """

    configuration: Configuration
    names: list[str]
    cause: ChangeCause


@dataclass(frozen=True)
class ConfigurationRestored(LightEvent):
    """
    The result of sending a configuration without a request, such as after a restart.

    :param is_final: whether it will not be sent again.
    """

    success: bool
    message: str
    is_final: bool = True


@dataclass(frozen=True)
class SetpointFailed(LightEvent):
    """A setpoint of a stream did not reach the light."""

    message: str


@dataclass(frozen=True)
class SetpointClipped(LightEvent):
    """A setpoint of a stream was beyond a limit; the limit is sent instead."""

    message: str


@dataclass(frozen=True)
class LimitExceeded(LightEvent):
    """
    A light reports values beyond the limits that the operator has set.

    :param excess: each value that exceeds a limit, for people; empty if none does.
    :param impossible: why the light cannot strobe within the limits, '' if it can.
    :param is_again: whether it was brought back within the limits shortly before.
    """

    excess: tuple[str, ...]
    impossible: str
    is_again: bool = False


@dataclass(frozen=True)
class DesiredStateFailed(LightEvent):
    """The light has not accepted the values that its new holder had requested before."""

    source: str
    message: str


@dataclass(frozen=True)
class AutomaticSwitch(LightEvent):
    """
    A light is switched without a request.

    :param reason: for people.
    :param failure: why it is not confirmed, '' before the first command.
    """

    on: bool
    reason: str
    failure: str = ''


@dataclass(frozen=True)
class LightSwitched(LightEvent):
    """
    A light was switched on or off, and was not in that state before.

    :param origin: such as ``service``, :data:`A_REQUEST`, :data:`LATE_EFFECT` or
        :data:`OTHER_SENDER`, for people.
    """

    on: bool
    origin: str


class LightSnapshot(NamedTuple):
    """
    A light at one moment, for any thread. Times are s on the link's clock.

    :param heard_at: of its last message, -inf if none has come; likewise ``status_at``.
    :param status_interval: s between statuses that the light was asked for, 0 for its own rate.
    :param restarts: since the light was found.
    :param temperature: degC; None where the light does not measure it, or its sensor fails.
    :param configuration: as confirmed, None before the first status.
    :param discrepancy: why the light does not have a configuration that it should have, '' if it
        has.
    :param limit_exceeded: how it exceeds the limits that the operator has set.
    :param identity_is_settled: whether the identity is known, or will not be known soon.
    :param holder: the source of commands that holds it, '' if none does; None without sources.
    :param held_since: when the holder changed last.
    :param unreachable: why requests cannot reach the light, '' if they can.
    :param off_at: when ``off_after_silence`` switches it off, infinity for never.
    :param shared_serials: the serial numbers of several lights with this address, else empty.
    """

    address: Address
    connected: bool
    heard_at: float
    status: Status | None
    status_at: float
    status_interval: float
    restarts: int
    temperature: float | None
    configuration: Configuration | None
    discrepancy: str
    limit_exceeded: LimitExceeded
    identity: Identity | None
    identity_is_settled: bool
    states_are_changing: bool
    unreachable: str
    holder: str | None = None
    held_since: float = 0.0
    off_at: float = math.inf
    shared_serials: tuple[str, ...] = ()

    def events(self) -> list[LightEvent]:
        """Return the events that lead to this state, for a listener that subscribes late."""
        events: list[LightEvent] = [DeviceConnected(self.address)] if self.connected else []
        if self.identity:
            events.append(LightIdentified(self.address, self.identity))
        if self.status:
            events.append(StatusReceived(
                self.address, self.status, self.status_at, self.temperature))
        if self.states_are_changing:
            events.append(StatesChanging(self.address, True))
        if self.configuration:
            events.append(ConfigurationChanged(
                self.address, self.configuration, list(FIELDS), ChangeCause.FIRST_STATUS))
        if self.holder:
            events.append(DeviceHeld(
                self.address, HolderChanged(None, self.holder, Cause.CLAIM)))
        return events
