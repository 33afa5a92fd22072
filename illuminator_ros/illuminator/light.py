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

"""One light, as its messages describe it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
import math

from . import events
from .command_sources import DesiredState, LightSources
from .light_configuration import IMPLIED_TIME, LightConfiguration, requested
from .light_queries import LightQueries, STATUS
from .messages import STATUS_ID
from .model import Changes, SafetyLimits, Status, StrobeRange
from .status_order import ChangingStates, Order, StatusOrder
from .switch import OFF, ON, Silence, Switch
from ..mavlink.command_sender import Command, CommandSender
from ..mavlink.dialect import mavlink
from ..mavlink.messages import Address
from ..payload.arbitration import Cause, HolderChanged
from ..payload.command_sources import DEFAULT, SourceSettings
from ..payload.confirmed_command import Done, Result, Target
from ..payload.device_events import DeviceConnected, DeviceDisconnected, DeviceHeld
from ..payload.device_property import answer, Caller, Outcome
from ..payload.identity import Identity
from ..payload.liveness import Liveness


@dataclass(frozen=True)
class LightSettings:
    """
    The settings of each light.

    :param heartbeat_timeout: s, > 0, without a heartbeat or status, after which a light is lost.
    :param status_interval: s, >= 0, between statuses that the light is asked for; 0 leaves its
        own.
    :param restore_configuration: whether a light that has restarted gets its agreed configuration
        again.
    :param limits: apply to everything that is sent.
    :param off_after_silence: s without a request after which a light that is on is switched off;
        0 for never.
    :param sources: the sources of commands, None if commands have no sources.
    :param off_on_release: whether a light is switched off when no source holds it any more.
    """

    heartbeat_timeout: float = 3.0
    status_interval: float = 0.0
    restore_configuration: bool = True
    limits: SafetyLimits = SafetyLimits()
    off_after_silence: float = 0.0
    sources: SourceSettings | None = None
    off_on_release: bool = False


class Light:
    """
    One component that is an illuminator: liveness, identity, sources, switch and configuration.

    No I/O; times are s. Each method that may send ends with :meth:`_update`, which sends what is
    desired now and answers the callers whose requests have ended.

    :param emit: takes the events.
    :ivar was_commanded: whether a user has ever sent it a command.
    """

    def __init__(
        self, address: Address, commands: CommandSender, settings: LightSettings,
        emit: Callable[[events.LightEvent], None],
    ) -> None:
        self.address = address
        self.liveness = Liveness(settings.heartbeat_timeout)
        self.was_commanded = False
        self._commands = commands
        self._settings = settings
        self._emit = emit
        target = Target(address, commands, 'light', STATUS_ID, STATUS)
        self._queries = LightQueries(target, settings.status_interval, settings.heartbeat_timeout)
        self._switch = Switch(target, emit, settings.off_after_silence)
        self._configuration = LightConfiguration(
            target, emit, limits=settings.limits, restores=settings.restore_configuration)
        self._sources = LightSources(settings.sources)
        self._order = StatusOrder()
        self._changing = ChangingStates()
        self._measures_temperature = False
        # The deadline, and the version of the commands that it is from.
        self._due: tuple[int, float] | None = None

    # Reception

    def heard(self, now: float) -> None:
        """Take a heartbeat, or anything else that shows that the light is alive."""
        if self.liveness.hear(now):
            self._configuration.found(now)
            self._queries.begin(now)
            self._emit(DeviceConnected(self.address))
            self._update(now)

    def announce(self, now: float) -> None:
        """Note that it has proved to be a light."""
        self._due = None
        self._queries.announce(now, is_heard=self.liveness.connected)

    def take_status(self, status: Status, now: float) -> None:
        """Take an ILLUMINATOR_STATUS, unless it is older than the one before."""
        self.heard(now)
        order = self._order.take(status, now, self._expects)
        if order is Order.LATE:
            return
        # Lights that do not measure send 0 (ArduSub), and a sensor rarely reads exactly 0.
        self._measures_temperature |= bool(status.temperature)
        self._forget_silenced(now)
        if order is Order.RESTARTED:
            self._restarted(status, now)
        else:
            self._take_state(status, now)
        self._queries.take_status(now)
        self._update(now)
        # Last, so that a caller has its answer before topics show the change.
        self._emit(events.StatusReceived(self.address, status, now, self._temperature))

    def _expects(self, status: Status) -> bool:
        return (self._switch.changes.expects(status)
                or self._configuration.changes.expects(status))

    def _take_state(self, status: Status, now: float) -> None:
        switch, configuration, states = self._switch, self._configuration, self._changing
        switched_at, was_changing = switch.changes.sent_at, states.are_changing
        states.take(status, now, is_commanded=(
            switch.changes.command is not None or configuration.changes.command is not None
            or now <= max(switched_at, configuration.changes.sent_at) + IMPLIED_TIME))
        if states.are_changing and not was_changing:
            self._emit(events.StatesChanging(self.address, True))
        is_followed = not states.are_changing
        switch.reported(status, now, may_be_ours=configuration.may_switch(now),
                        is_told=is_followed)
        configuration.reported(status, now, can_follow=is_followed, switched_at=switched_at)

    def _restarted(self, status: Status, now: float) -> None:
        self._emit(events.LightRestarted(self.address, self._switch.enabled, status.enabled))
        self._queries.begin(now)
        self._switch.restarted(status, now)
        self._configuration.restarted(status, now)

    def take_identity(self, identity: Identity, now: float) -> None:
        """Take a COMPONENT_INFORMATION_BASIC."""
        self.heard(now)
        self._queries.take_identity(identity, now)
        self._emit(events.LightIdentified(self.address, identity))

    def lose(self, reason: str, now: float) -> None:
        """Note that the light is not heard any more."""
        if self.liveness.lose(now):
            self._order.lost()
            self._changing = ChangingStates()
            self._queries.end()
            self._emit(DeviceDisconnected(self.address, reason))
            message = self.unreachable(now)
            self._switch.cancel(message, now)
            self._configuration.cancel(message, now, superseded=False)
            self._update(now)

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
    def status(self) -> Status | None:
        """Return the newest status, None before the first."""
        return self._order.newest

    @property
    def restarts(self) -> int:
        """Return how often it has restarted since it was found."""
        return self._order.restarts

    @property
    def strobe_range(self) -> StrobeRange:
        """Return the strobe periods that the light reports to be possible."""
        return self._configuration.strobe_range

    @property
    def _temperature(self) -> float | None:
        """Return the temperature, degC; None where it is not measured, or the sensor fails."""
        status = self._order.newest
        if (status is None or not self._measures_temperature
                or status.error_flags & mavlink.ILLUMINATOR_ERROR_FLAGS_THERMISTOR_FAILURE):
            return None
        return status.temperature

    def unreachable(self, now: float) -> str:
        """Return why requests cannot reach the light, for people; '' if they can."""
        return '' if self.liveness.connected else self.liveness.loss(f'light {self.address}', now)

    def snapshot(self, now: float) -> events.LightSnapshot:
        """Return the state, for any thread."""
        configuration, queries = self._configuration, self._queries
        return events.LightSnapshot(
            self.address, self.connected, self.liveness.heard_at, self.status,
            self._order.newest_at, self._settings.status_interval, self.restarts,
            self._temperature, configuration.agreed, configuration.discrepancy,
            configuration.exceeded, queries.identity, queries.identity_is_settled(now),
            self._changing.are_changing, self.unreachable(now), self._sources.shown_holder,
            self._sources.since, self._switch.off_at)

    def change_settings(self, settings: LightSettings, now: float) -> None:
        """
        Take other settings.

        Only ``limits``, ``off_after_silence`` and the time-out of ``sources`` may differ. The
        silence begins again if ``off_after_silence`` differs.
        """
        before, self._settings, self._due = self._settings, settings, None
        if settings.limits != before.limits:
            self._configuration.change_limits(settings.limits, now)
        if settings.off_after_silence != before.off_after_silence:
            self._forget_silenced(now)
            self._switch.silence = Silence(settings.off_after_silence, now)
        if settings.sources:
            self._sources.set_lease(settings.sources.timeout)
        # The next poll sends what they demand: an atomic set that fails takes them back before.

    # Requests

    def enable(
        self, on: bool, now: float, done: Done, *, detail: str = '', source: str = DEFAULT,
        is_stream: bool = False,
    ) -> None:
        """
        Switch the light on or off; ``done`` is called once with the result.

        While a higher source holds the light, a request is not sent. One of a stream is then
        remembered, and any other is refused and leaves nothing behind.

        :param detail: how it was requested, for :class:`LightSwitched`.
        :param is_stream: whether it is one of a stream, which its publisher repeats: a newer one
            replaces it.
        """
        caller = Caller(done, now, source, is_stream, detail)
        if self._take_request(caller, DesiredState(enabled=on), now):
            if not on:
                self._prepare_off(now)
            self._switch.ask(on, now, caller)
        self._update(now)

    def _prepare_off(self, now: float) -> None:
        """End what an OFF must not be followed by, where the brightness is the switch."""
        if self._configuration.brightness_is_switch:
            self._configuration.cancel('superseded by off', now)
            self._switch.changes.fence_until(self._configuration.changes.fence)

    def configure(self, changes: Changes, now: float, done: Done) -> None:
        """
        Change some fields with one command; ``done`` is called once with the result.

        The request is one of the source :data:`~..payload.command_sources.DEFAULT`.

        :param changes: values by name, see :data:`~.model.FIELDS`; if one is wrong none is sent.
        """
        caller = Caller(done, now, DEFAULT)
        if self._take_request(caller, DesiredState(), now):
            self._configuration.configure(changes, now, caller)
        self._update(now)

    def set_brightness(
        self, brightness: float, now: float, *, source: str = DEFAULT,
    ) -> None:
        """
        Take a setpoint of a stream: the newest wins, and one command is under way at a time.

        :param brightness: %, checked.
        """
        def failed(result: Result, now: float) -> None:
            # While another source holds the light, a setpoint is remembered.
            if not (result.superseded or self.is_held_by_other(source)):
                self._emit(events.SetpointFailed(self.address, result.message))

        caller = Caller(failed, now, source, is_stream=True)
        if self._take_request(caller, DesiredState(brightness=brightness), now):
            self._configuration.set_brightness(brightness)
        self._update(now)

    def set_desired(self, values: Changes, now: float) -> None:
        """
        Send values as soon as the light has reported its configuration.

        :param values: by name, checked, except against the limits that the light reports.
        """
        if not self._commands.refusal:
            self._configuration.require(values, now)
            self._update(now)

    def refresh(self, now: float, done: Done) -> None:
        """Ask for identity and status again; ``done`` is called once with the result."""
        self._due = None
        closed = self._commands.refusal
        if refusal := closed or self.unreachable(now):
            done(Result(False, refusal, superseded=bool(closed)), now)
        else:
            self._queries.refresh(now, done)

    def request_status(self, now: float) -> None:
        """Ask for a status, unless such a request is under way."""
        self._due = None
        self._queries.request_status(now)

    def _take_request(self, caller: Caller, desired: DesiredState, now: float) -> bool:
        """
        Take a request: it counts for its source, and ends what lower sources have requested.

        :return: whether it may be sent now; if not, it is answered with the reason.
        """
        sources, source, is_off = self._sources, caller.source, desired.enabled is False
        if closed := self._commands.refusal:
            caller.done(Result(False, closed, superseded=True), now)
            return False
        self._take_holder(sources.poll(now), now)
        self.was_commanded = True
        late, held = '' if is_off else self._commands.lateness(now), sources.refusal(source)
        if caller.is_stream and not late:
            self._take_stream(source, desired, now)
        elif is_off and not held:
            # An OFF ends the ON that is remembered, though it may fail.
            sources.forget_switch(source)
        sent = is_off and not held and self._send_unheard_off()
        if sent:
            self._switch.changes.note_sent(OFF, now)
        if refusal := late or held or self.unreachable(now):
            refusal += '; an OFF was sent once' if sent else ''
            caller.done(Result(False, refusal), now)
            return False
        if not caller.is_stream:
            self._begin_call(source, now)
        return True

    def _send_unheard_off(self) -> bool:
        """
        Send an OFF once to a light that is lost: it may hear though it is not heard.

        :return: whether it was sent.
        """
        is_sent = not (self.connected or self.liveness.link_failure)
        if is_sent:
            self._commands.send_once(Command(self.address, OFF.command, OFF.params))
        return is_sent

    def _begin_call(self, source: str, now: float) -> None:
        self._take_over(source, now)
        # Calls that overlap, of which none succeeds, must not hold off the silence for ever.
        if not self._sources.are_calling:
            self._switch.silence.called_at = now
        self._sources.begin_call(source)

    def _take_stream(self, source: str, desired: DesiredState, now: float) -> None:
        """Take a request of a stream, which counts at once."""
        self._forget_silenced(now)
        self._switch.silence.requested_at = now
        self._take_over(source, now)
        self._take_holder(self._sources.claim(source, now), now)
        # A request to a lost light has no effect later, but an OFF ends a remembered ON.
        if self.connected or desired.enabled is False:
            self._sources.remember(source, desired)

    def _take_over(self, source: str, now: float) -> None:
        """End the requests of another source, unless it is a higher one."""
        if self._sources.takes_over(source):
            self._end_requests(f'held by {source}', now)

    def _end_requests(self, message: str, now: float) -> None:
        self._switch.cancel(message, now, superseded=True)
        self._configuration.cancel(message, now)

    def is_held_by_other(self, source: str) -> bool:
        """Return whether another source holds the light, so that a request is not sent."""
        return bool(self._sources.refusal(source))

    def release(self, source: str, now: float) -> str:
        """
        Release the light: the next lower source that has claimed it then holds it.

        :return: the source that holds it now, '' if none does.
        """
        self._take_holder(self._sources.poll(now), now)
        self._take_holder(self._sources.release(source, now), now)
        self._update(now)
        return self._sources.holder or ''

    def _forget_silenced(self, now: float) -> None:
        """Forget what would switch the light on, if it was requested before a silence."""
        if self._sources.are_ranked and now >= self._switch.silence.ends_at:
            self._sources.forget_on(
                brightness_is_switch=bool(self._configuration.brightness_is_switch))

    def _take_holder(self, change: HolderChanged[str] | None, now: float) -> None:
        """Take a change of the source that holds the light."""
        if change is None:
            return
        self._emit(DeviceHeld(self.address, change))
        if change.after is None:
            if self._settings.off_on_release and not self._is_known_off(now):
                self._switch.require_off(f'on_release: {change.before} no longer holds it')
        elif change.cause is not Cause.CLAIM:
            self._end_requests(f'held by {change.after}', now)
            self._send_remembered(change.after, now)

    def _is_known_off(self, now: float) -> bool:
        return self.connected and self._switch.enabled is False and not self.may_be_on(now)

    def may_be_on(self, now: float) -> bool:
        """Return whether the light is on, or may go on by a command of ours that was sent."""
        return self._switch.may_be_on(now) or self._configuration.may_switch(now)

    def _send_remembered(self, source: str, now: float) -> None:
        """Send the values that the new holder of the light has requested before."""
        self._forget_silenced(now)
        desired = self._sources.desired

        if not self.connected or self._commands.refusal:
            return
        caller = Caller(_reported_failure(self._emit, self.address, source), now, source, True,
                        f'{source}, which holds the light now')
        if desired.enabled is False:
            self._prepare_off(now)
            self._switch.ask(False, now, caller)
        if desired.brightness is not None:
            self._configuration.set_brightness(desired.brightness)
            self._configuration.update(now, is_off_pending=self._switch.is_pending(OFF))
        if desired.enabled:
            self._switch.ask(True, now, caller)

    # Answers

    def _update(self, now: float) -> None:
        """Send what is desired now, and answer the callers whose requests have ended."""
        switch, configuration = self._switch, self._configuration
        self._due = None
        while True:
            while switch.changes.outcomes:
                outcome = switch.changes.outcomes.popleft()
                switch.take(outcome, now)
                self._finish(outcome, now)
            while configuration.changes.outcomes:
                outcome = configuration.changes.outcomes.popleft()
                configuration.take(outcome, now)
                self._finish(outcome, now)
            if not self.liveness.connected:
                return
            # First the configuration, so that an ON finds it.
            configuration.update(now, is_off_pending=switch.is_pending(OFF))
            if configuration.brightness_is_switch and switch.is_off_due(now):
                self._prepare_off(now)
            switch.update(now)
            if not (switch.changes.outcomes or configuration.changes.outcomes):
                return

    def _finish(self, outcome: Outcome[Status], now: float) -> None:
        """Take the end of a value: a call that has succeeded counts from now on."""
        result, status = outcome.result, outcome.status
        if outcome.desired.change == ON and status and (
                excess := self._configuration.excess(status)):
            result = result._replace(
                message=f'{result.message}; {", ".join(excess)}, and is brought back')
        for caller in outcome.callers:
            if caller.is_stream:
                continue
            change = self._sources.end_call(caller.source, now, success=result.success)
            self._take_holder(change, now)
            if result.success:
                self._forget_silenced(now)
                self._switch.silence.requested_at = now
                self._sources.remember(caller.source, _wish(outcome))
        if not self._sources.are_calling:
            self._switch.silence.called_at = -math.inf
        answer(outcome.callers, result, now)

    # The end of the process

    def close(self, now: float) -> None:
        """Answer all requests, and make no change any more but :meth:`switch_off_finally`."""
        refusal = self._commands.refusal
        self._sources = LightSources(None)
        self._switch.close(refusal, now)
        self._configuration.cancel(refusal, now)
        self._queries.close(refusal, now)
        self._update(now)

    def switch_off_finally(self, now: float, report: Done) -> None:
        """
        Switch the light off, and again whenever it may be on, after :meth:`close`.

        :param report: called with a failure that is not permanent when the first OFF is sent and
            when one has failed, and with a success when the light shows it. The failure of a light
            without an open link is permanent.
        """
        self._switch.switch_off_finally(now, report)
        if not self.connected:
            self._send_unheard_off()
            report(Result(False, self.unreachable(now),
                          permanent=bool(self.liveness.link_failure)), now)
        self._update(now)

    # Time

    def poll(self, now: float) -> None:
        """Do what is due."""
        if now >= self.liveness.silent_at:
            self.lose(self.liveness.silence(now), now)
        if now >= self._changing.until:
            self._changing = ChangingStates()
            self._emit(events.StatesChanging(self.address, False))
        self._queries.poll(now, self.liveness.heard_at if self.liveness.connected else math.inf)
        self._take_holder(self._sources.poll(now), now)
        self._switch.changes.poll(now)
        self._configuration.changes.poll(now)
        self._update(now)

    def next_deadline(self) -> float:
        """Return when :meth:`poll` has something to do, or earlier."""
        version = self._commands.version
        # Kept, since each turn of the link asks all lights.
        if self._due is None or self._due[0] != version:
            self._due = version, self._next_deadline()
        return self._due[1]

    def _next_deadline(self) -> float:
        due = self._queries.next_deadline(
            self.liveness.heard_at if self.liveness.connected else math.inf)
        if self._sources.are_ranked:
            due = min(due, self._sources.next_deadline())
        if self.liveness.connected:
            due = min(due, self._switch.next_deadline(), self._configuration.next_deadline(),
                      self._changing.until, self.liveness.silent_at)
        return due


def _wish(outcome: Outcome[Status]) -> DesiredState:
    """Return the values that a request has set."""
    change = outcome.desired.change
    return DesiredState(change == ON if change in (ON, OFF) else None, requested(outcome))


def _reported_failure(
    emit: Callable[[events.LightEvent], None], address: Address, source: str,
) -> Done:
    """Return a function that reports that the light does not have what a source requested."""
    def done(result: Result, now: float) -> None:
        if not (result.success or result.superseded):
            emit(events.DesiredStateFailed(address, source, result.message))

    return done
