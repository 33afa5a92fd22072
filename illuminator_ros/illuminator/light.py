# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""One light, as its messages describe it."""

from __future__ import annotations

from collections.abc import Callable
import math

from . import events
from .light_control import LightControl, LightSettings
from .light_queries import LightQueries, STATUS
from .messages import STATUS_ID
from .model import Status
from .status_order import ChangingStates, Order, StatusOrder
from ..mavlink.command_sender import CommandSender
from ..mavlink.dialect import mavlink
from ..mavlink.messages import Address
from ..payload.confirmed_command import Done, Result, Target
from ..payload.device_events import DeviceConnected, DeviceDisconnected
from ..payload.identity import Identity
from ..payload.liveness import Liveness


class Light:
    """
    One component that is an illuminator: its liveness, identity and statuses.

    No I/O; times are s.

    :param emit: takes the events.
    :ivar control: takes the requests to it.
    """

    def __init__(
        self, address: Address, commands: CommandSender, settings: LightSettings,
        emit: Callable[[events.LightEvent], None],
    ) -> None:
        self.address = address
        self.liveness = Liveness(settings.heartbeat_timeout)
        self._commands = commands
        self._status_interval = settings.status_interval
        self._emit = emit
        target = Target(address, commands, 'light', STATUS_ID, STATUS)
        self.control = LightControl(target, self.liveness, settings, emit)
        self._queries = LightQueries(
            target, self.liveness, settings.status_interval, settings.heartbeat_timeout)
        self._order = StatusOrder()
        self._changing = ChangingStates()
        self._measures_temperature = False
        # The deadline, and the version of the commands and requests that it is from.
        self._due = -1, math.inf

    # Reception

    def heard(self, now: float) -> None:
        """Take a heartbeat, or a status, which shows that the light is alive."""
        if self.liveness.hear(now):
            self._queries.begin(now)
            self._emit(DeviceConnected(self.address))
            self.control.require({}, now)

    def announce(self, now: float) -> None:
        """Note that it has proved to be a light."""
        self._queries.announce(now, is_heard=self.connected)

    def take_status(self, status: Status, now: float) -> None:
        """Take an ILLUMINATOR_STATUS, unless it is older than the one before."""
        self.heard(now)
        order = self._order.take(status, now, self.control.expects)
        if order is Order.LATE:
            return
        # Lights that do not measure send 0 (ArduSub), and a sensor rarely reads exactly 0.
        self._measures_temperature |= bool(status.temperature)
        if order is Order.RESTARTED:
            self._emit(events.LightRestarted(
                self.address, self.control.switch.enabled, status.enabled))
            self._queries.begin(now)
            self.control.restarted(status, now)
        else:
            states = self._changing
            if states.take(status, now, is_commanded=self.control.may_cause(now)):
                self._emit(events.StatesChanging(self.address, True))
            self.control.reported(status, now, is_followed=not states.are_changing)
        self._queries.take_status(now)
        self.control.update(now)
        # Last, so that a caller has its answer before topics show the change.
        self._emit(events.StatusReceived(self.address, status, now, self._temperature))

    def take_identity(self, identity: Identity, now: float) -> None:
        """Take a COMPONENT_INFORMATION_BASIC."""
        self._queries.take_identity(identity, now)
        self._emit(events.LightIdentified(self.address, identity))

    def lose(self, reason: str, now: float) -> None:
        """Note that the light is not heard any more."""
        if self.liveness.lose(now):
            self._order.lost()
            self._changing = ChangingStates()
            self._queries.end()
            self._emit(DeviceDisconnected(self.address, reason))
            self.control.lost(now)

    def link_opened(self, now: float) -> None:
        """Note that the light can be reached."""
        self.liveness.link_failure = ''

    def link_closed(self, now: float, reason: str) -> None:
        """Note that the light cannot be reached."""
        self.liveness.link_failure = f'the link is not open: {reason}'
        self.lose('the link was lost', now)

    # Values

    @property
    def connected(self) -> bool:
        """Whether it is heard."""
        return self.liveness.connected

    @property
    def lost_at(self) -> float:
        """When it was lost, s; infinity while it is heard."""
        return self.liveness.lost_at

    @property
    def was_commanded(self) -> bool:
        """Whether a user has ever sent it a command."""
        return self.control.was_commanded

    @property
    def status(self) -> Status | None:
        """Return the newest status, None before the first."""
        return self._order.newest

    @property
    def restarts(self) -> int:
        """Return how often it has restarted since it was found."""
        return self._order.restarts

    @property
    def _temperature(self) -> float | None:
        """Return the temperature, degC; None where it is not measured, or the sensor fails."""
        status = self._order.newest
        if (status is None or not self._measures_temperature
                or status.error_flags & mavlink.ILLUMINATOR_ERROR_FLAGS_THERMISTOR_FAILURE):
            return None
        return status.temperature

    def snapshot(self, now: float) -> events.LightSnapshot:
        """Return the state, for any thread."""
        control, queries, order = self.control, self._queries, self._order
        configuration, sources = control.configuration, control.sources
        return events.LightSnapshot(
            self.address, self.connected, self.liveness.heard_at, order.newest, order.newest_at,
            self._status_interval, self.restarts, self._temperature, configuration.agreed,
            configuration.discrepancy, configuration.exceeded, queries.identity,
            queries.identity_is_settled(now), self._changing.are_changing,
            control.unreachable(now), sources.shown_holder, sources.since,
            control.switch.off_at)

    # Requests

    def refresh(self, now: float, done: Done) -> None:
        """Ask for identity and status again; ``done`` is called once with the result."""
        closed = self._commands.refusal
        if refusal := closed or self.control.unreachable(now):
            done(Result(False, refusal, superseded=bool(closed)), now)
        else:
            self._queries.refresh(now, done)

    def request_status(self, now: float) -> None:
        """Ask for a status, unless such a request is under way."""
        self._queries.request_status(now)

    def close(self, now: float) -> None:
        """Answer all requests, since the process ends."""
        self._queries.close(self._commands.refusal, now)
        self.control.close(now)

    # Time

    def poll(self, now: float) -> None:
        """Do what is due."""
        if now >= self.liveness.silent_at:
            self.lose(self.liveness.silence(now), now)
        if now >= self._changing.until:
            self._changing = ChangingStates()
            self._emit(events.StatesChanging(self.address, False))
        self._queries.poll(now)
        self.control.poll(now)

    def next_deadline(self) -> float:
        """Return when :meth:`poll` has something to do, or earlier."""
        # Kept, since each turn of the link asks all lights.
        version = self._commands.version + self.control.version
        if self._due[0] != version:
            self._due = version, min(
                self.control.next_deadline(), self._queries.next_deadline(),
                self._changing.until, self.liveness.silent_at)
        return self._due[1]
