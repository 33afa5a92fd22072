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

"""One light as the drone's side sees it: liveness, status and requests."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
import math
from typing import Any

from .agreement import Agreement
from .enable import Enable
from .error_flags import ErrorFlag
from .events import (
    AnyLightEvent,
    LightConnected,
    LightIdentified,
    LightLost,
    LightRestarted,
    LightSnapshot,
    StatusReceived,
)
from .identification import Identification
from .identity import Identity
from .model import Limits, Status
from .operation import Done, Result
from .operation_queue import OperationQueue
from .refresh import Refresh
from .sharing import Sharing
from .uptime import compare_uptime, SendingTimes, Uptime
from ..mavlink.command import Command, CommandResult, CommandSender, CommandStatus, format_seconds
from ..mavlink.messages import Address, MavCmd, STATUS_ID

# s without a status after which the light is asked for one, and between the askings.
STATUS_TIMEOUT = 2.5


@dataclass(frozen=True)
class Settings:
    """
    How lights are treated.

    :param heartbeat_timeout: s, > 0, without a heartbeat or status, after which a light is lost.
    :param status_interval: s, >= 0, between statuses to ask the light for; 0 leaves its own.
    :param restore_configuration: whether a light that has restarted gets the agreed
        configuration again.
    """

    heartbeat_timeout: float = 3.0
    status_interval: float = 0.0
    restore_configuration: bool = True


class Light:
    """
    One component that is an illuminator. No I/O; time is passed in.

    :param emit: takes the events.
    :param changed: called when a request may have changed :meth:`next_deadline`.
    :ivar connected: whether it is heard.
    :ivar status: the newest status, None before the first.
    :ivar restarts: how often it has restarted since it was found.
    :ivar instance: which light of the component it is; 0 is all of them, which is all that the
        commands can say until mavlink pull request 2490 is settled.
    :ivar sharing: whether it is several lights in truth.
    :ivar measures_temperature: whether it has ever sent a temperature other than 0.
    """

    def __init__(
        self, address: Address, sender: CommandSender, settings: Settings,
        emit: Callable[[AnyLightEvent], None], changed: Callable[[], None], *,
        instance: int = 0,
    ) -> None:
        self.address = address
        self.emit = emit
        self.changed = changed
        self.instance = instance
        self.sender = sender
        self.settings = settings
        self.connected = False
        self.heard_at = -math.inf
        self.status: Status | None = None
        self.status_at = -math.inf
        self.restarts = 0
        self.measures_temperature = False
        self._link_failure = ''
        self.identification = Identification(self)
        self.agreement = Agreement(self)
        self.sharing = Sharing()
        self._switching = OperationQueue()
        self._status_due = math.inf
        self._asked_at = -math.inf
        # Whether it was lost since the newest status.
        self._was_away = False
        self._sending_times = SendingTimes()
        self._refreshes: list[Refresh] = []

    # What comes in

    def heard(self, now: float) -> None:
        """Take a heartbeat, or anything else that shows that the light is alive."""
        self.heard_at = now
        if not self.connected:
            self.connected = True
            self._set_up(now)
            self.emit(LightConnected(self.address))

    def take_status(self, status: Status, now: float) -> None:
        """Take an ILLUMINATOR_STATUS, unless it is older than the one before."""
        self.heard(now)
        was_away, self._was_away = self._was_away, False
        self.sharing.take(
            status, now, commanded=bool(self._switching.current or self.agreement.changing))
        meaning = Uptime.RUNNING
        # The uptimes of several lights say nothing about one another.
        if self.status is not None and not self.sharing.recognised:
            meaning = compare_uptime(
                self.status.uptime_ms, status.uptime_ms, now - self.status_at, away=was_away)
        if meaning is Uptime.LATE:
            return
        was_on = self.status.enabled if self.status else None
        self.status = status
        self.status_at = now
        self._status_due = now + max(STATUS_TIMEOUT, 2.5 * self.settings.status_interval)
        # Lights that do not measure send 0 (ArduSub), and a sensor rarely says exactly 0.
        self.measures_temperature |= bool(status.temperature)
        if meaning is Uptime.RESTARTED or (meaning is Uptime.NO_CLOCK and was_away):
            self._restarted(was_on, now)
        sent_by = (now if self.sharing.recognised
                   else self._sending_times.sent_by(status.uptime_ms, now))
        if self._switching.current:
            self._switching.current.status(status, sent_by, now)
        self.agreement.take_status(status, sent_by, now)
        self._tell_refreshes(lambda refresh: refresh.status(now))
        # Last, since it takes longest: whoever waits for the status has been answered by then.
        self.emit(StatusReceived(
            self.address, status, now, self.temperature, self.sharing.recognised))

    def take_information(self, identity: Identity, now: float) -> None:
        """Take a COMPONENT_INFORMATION_BASIC."""
        self.heard(now)
        self.identification.received(identity, now)
        self.emit(LightIdentified(self.address, identity))

    def lose(self, reason: str) -> None:
        """Note that the light is not heard any more."""
        if self.connected:
            self.connected = False
            self._was_away = True
            self._status_due = math.inf
            self.sharing.clear()
            self.emit(LightLost(self.address, reason))
            self.agreement.lost(reason)

    def link_opened(self, now: float) -> None:
        """Note that the light can be reached."""
        self._link_failure = ''

    def link_closed(self, reason: str) -> None:
        """Note that the light cannot be reached."""
        self._link_failure = f'the link is not open: {reason}'
        self.lose('the link was lost')

    def _restarted(self, was_on: bool | None, now: float) -> None:
        self.restarts += 1
        self._sending_times = SendingTimes()
        self.emit(LightRestarted(
            self.address, was_on, self.status.enabled if self.status else None))
        self._set_up(now)
        self.agreement.restarted(now)

    def _set_up(self, now: float) -> None:
        """Ask for what the light does not send by itself, when it is found or has restarted."""
        interval = self.settings.status_interval
        if interval > 0:
            self.sender.start(Command(
                self.address, MavCmd.SET_MESSAGE_INTERVAL, (float(STATUS_ID), interval * 1e6)),
                now, lambda outcome, now: None)
        self._status_due = now + STATUS_TIMEOUT
        self.request_status(now)
        self.identification.ask(now)

    # What is known

    @property
    def sends_status(self) -> bool:
        """Whether the light has ever sent a status."""
        return self.status is not None

    @property
    def limits(self) -> Limits:
        """Return the strobe periods that the light reports to be possible."""
        return self.status.limits if self.status else Limits()

    @property
    def temperature(self) -> float | None:
        """Return the temperature, degC; None where it is not measured, or the sensor fails."""
        status = self.status
        if (status is None or not self.measures_temperature
                or status.error_flags & ErrorFlag.THERMISTOR_FAILURE):
            return None
        return status.temperature

    def unreachable(self, now: float) -> str:
        """Return why requests cannot reach the light, for people; '' if they can."""
        if self.connected:
            return ''
        # Without a link nothing can be heard: that is the reason, and silence its consequence.
        reason = (self._link_failure
                  or f'no heartbeat for {format_seconds(now - self.heard_at)}')
        return f'light {self.address} is lost: {reason}'

    def snapshot(self, now: float) -> LightSnapshot:
        """Return what is known, for any thread."""
        return LightSnapshot(
            self.address, self.connected, self.heard_at, self.status, self.status_at,
            self.settings.status_interval, self.restarts, self.temperature,
            self.agreement.agreed, self.agreement.discrepancy, self.identification.identity,
            self.identification.settled(now), self.sharing.recognised, self.unreachable(now))

    # Requests

    def configure(self, changes: Mapping[str, Any], now: float, done: Done) -> None:
        """
        Change some fields with one command; ``done`` is called once with the result.

        :param changes: values by name, see :data:`~.model.FIELDS`; if one is wrong none is sent.
        """
        self.agreement.configure(changes, now, done)

    def set_brightness(self, brightness: float, now: float) -> None:
        """
        Take a setpoint of a stream: the newest wins, and one command is under way at a time.

        :param brightness: %, checked.
        """
        self.agreement.set_brightness(brightness, now)

    def set_desired(self, values: Mapping[str, Any], now: float) -> None:
        """
        Have values sent as soon as the light has reported its configuration.

        :param values: by name, checked but for the limits that the light reports.
        """
        self.agreement.want(values, now)

    def enable(self, on: bool, now: float, done: Done, *, detail: str = '') -> None:
        """
        Switch the light on or off; ``done`` is called once with the result.

        :param detail: how it was asked for, which :class:`LightSwitched` repeats.
        """
        if unreachable := self.unreachable(now):
            done(Result(False, unreachable), now)
        else:
            self._switching.submit(Enable(self, on, done, now=now), now)
            self.changed()

    def cancel(self, now: float) -> None:
        """End all requests, so that the next one is sent at once: a node's last to its light."""
        self._switching.cancel(now)
        self.agreement.cancel(now)
        self.sender.end_all(now, CommandStatus.CANCELLED, self.address)
        self.changed()

    def refresh(self, now: float, done: Done) -> None:
        """Ask for identity and status again; ``done`` is called once with the result."""
        if unreachable := self.unreachable(now):
            done(Result(False, unreachable), now)
            return
        self._refreshes.append(Refresh(self, now, done))
        self.changed()

    def request_status(
        self, now: float, done: Callable[[CommandResult, float], None] | None = None,
    ) -> None:
        """Ask for a status; without ``done`` only where no question is under way already."""
        if done is None and self.sender.pending(self.address, MavCmd.REQUEST_MESSAGE):
            return
        self.sender.start(
            Command(self.address, MavCmd.REQUEST_MESSAGE, (float(STATUS_ID),)), now,
            done or (lambda outcome, now: None))

    # Time

    def poll(self, now: float) -> None:
        """Do what is due."""
        # The sum and not the difference, which is what next_deadline() returns: floats differ.
        if self.connected and now >= self.heard_at + self.settings.heartbeat_timeout:
            self.lose(f'no heartbeat for {format_seconds(now - self.heard_at)}')
        if now >= self._question_due:
            self._asked_at, self._status_due = now, now + STATUS_TIMEOUT
            self.request_status(now)
        self.identification.poll(now)
        self._switching.poll(now)
        self.agreement.poll(now)
        self._tell_refreshes(lambda refresh: refresh.poll(now))

    @property
    def _question_due(self) -> float:
        """
        When the light is to be asked for a status.

        It may have no heartbeat, and have been asked to send its status less often than that.
        """
        silent_since = max(self.heard_at, self._asked_at) if self.connected else math.inf
        # Its answer takes time, too.
        patience = min(STATUS_TIMEOUT, self.settings.heartbeat_timeout / 1.2)
        return min(self._status_due, silent_since + patience)

    def next_deadline(self) -> float:
        """Return when :meth:`poll` has something to do."""
        lost = (self.heard_at + self.settings.heartbeat_timeout if self.connected
                else math.inf)
        refresh = min((refresh.until for refresh in self._refreshes), default=math.inf)
        return min(lost, self._question_due, refresh, self.identification.next_deadline(),
                   self._switching.next_deadline(), self.agreement.next_deadline())

    def _tell_refreshes(self, tell: Callable[[Refresh], None]) -> None:
        for refresh in list(self._refreshes):
            tell(refresh)
            if refresh.finished:
                self._refreshes.remove(refresh)
