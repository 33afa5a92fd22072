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
from .light_configuration import LightConfiguration
from .light_queries import LightQueries, STATUS
from .light_switch import LightSwitch, RULES, SwitchRule
from .messages import STATUS_ID
from .model import Changes, SafetyLimits, Status, StrobeRange
from .status_tracker import NewestStatus, StatusTracker
from ..mavlink.command_sender import CommandResult, CommandSender, format_seconds
from ..mavlink.messages import Address
from ..payload.arbitration import Cause, HolderChanged
from ..payload.attempt import Done, Result, Target
from ..payload.command_sources import DEFAULT, SourceSettings
from ..payload.identity import Identity


@dataclass(frozen=True)
class Settings:
    """
    The settings of each light.

    :param heartbeat_timeout: s, > 0, without a heartbeat or status, after which a light is lost.
    :param status_interval: s, >= 0, between statuses that the light is asked for; 0 leaves its
        own.
    :param restore_configuration: whether a light that has restarted gets its confirmed
        configuration again.
    :param limits: apply to everything that is sent.
    :param off_after_silence: s without a request after which a light that is on is switched off;
        0 for never.
    :param reassert: whether changes by other senders are undone.
    :param sources: the sources of commands, None if commands have no sources.
    :param off_on_release: whether a light is switched off when no source holds it any more.
    :param switch_rules: the rules that decide whether it is on, the highest first.
    """

    heartbeat_timeout: float = 3.0
    status_interval: float = 0.0
    restore_configuration: bool = True
    limits: SafetyLimits = SafetyLimits()
    off_after_silence: float = 0.0
    reassert: bool = False
    sources: SourceSettings | None = None
    off_on_release: bool = False
    switch_rules: tuple[SwitchRule, ...] = RULES


class Light:
    """
    One component that is an illuminator: liveness, identity, switch and configuration. No I/O.

    Its fields are its parts, and six values that other classes read.

    :param emit: takes the events.
    :param changed: called with the light and the time when :meth:`next_deadline` or
        ``has_answered`` may have changed.
    :ivar connected: whether it is heard.
    :ivar heard_at: the time of its last message, s; -inf before the first.
    :ivar lost_at: when it was lost, s; infinity while it is heard.
    :ivar restarts: how often it has restarted since it was found.
    :ivar was_commanded: whether a user has ever sent it a command.
    :ivar has_answered: whether it has ever answered a command.
    """

    def __init__(
        self, address: Address, commands: CommandSender, settings: Settings,
        emit: Callable[[events.LightEvent], None], changed: Callable[[Light, float], None],
    ) -> None:
        self.address = address
        self.connected = False
        self.heard_at = -math.inf
        self.lost_at = math.inf
        self.restarts = 0
        self.was_commanded = False
        self.has_answered = False
        self._settings = settings
        self._emit = emit
        self._changed = changed
        self._target = Target(
            address, commands, self._command_ended, kind='light', status_id=STATUS_ID,
            status_name=STATUS)
        self._queries = LightQueries(
            self._target, settings.status_interval, settings.heartbeat_timeout)
        self._newest = NewestStatus()
        self._configuration = LightConfiguration(
            self._target, emit, self._newest, limits=settings.limits,
            restore=settings.restore_configuration, reassert=settings.reassert,
            must_wait=lambda: (
                bool(commands.refusal) or self._switch.may_brightness_undo_off()))
        self._switch = LightSwitch(
            self._target, emit, self._configuration, self._newest,
            off_after_silence=settings.off_after_silence, reassert=settings.reassert,
            earliest_on=self._earliest_on, rules=settings.switch_rules)
        self._tracker = StatusTracker()
        self._link_failure = ''
        self._sources = LightSources(settings.sources)

    def _command_ended(self, result: CommandResult, now: float) -> None:
        self.has_answered |= result.result is not None
        self._changed(self, now)

    # Reception

    def heard(self, now: float) -> None:
        """Take a heartbeat, or anything else that shows that the light is alive."""
        self.heard_at = now
        if not self.connected:
            self.connected = True
            self.lost_at = math.inf
            self._tracker.found(now)
            self._configuration.retry_required(now)
            # A status request that was sent to the silent light may be resent only half a second
            # later.
            self._target.cancel_status_request(now)
            self._queries.begin(now)
            self._emit(events.LightConnected(self.address))

    def take_status(self, status: Status, now: float, sender: int = 0) -> None:
        """
        Take an ILLUMINATOR_STATUS, unless it is older than the one before.

        :param sender: of the message.
        """
        self.heard(now)
        report, restarted = self._tracker.take(
            status, now, sender=sender,
            commanded=self._switch.is_changing or self._configuration.is_changing)
        if report is None:
            if self._tracker.proof_due < math.inf:
                self._queries.need_status(self._tracker.proof_due)
            return
        was_shared = self._newest.is_shared
        self._newest.take(report, now)
        if restarted:
            self._restarted(now)
        if report.shared_address is not was_shared:
            self._emit(events.AddressShared(self.address, report.shared_address))
        self._forget_silenced(now)
        self._switch.reported(report, now, restarted=restarted)
        self._configuration.reported(
            report, now, can_follow=self._tracker.conflict.can_follow,
            switched_at=self._switch.switched_at)
        self._tracker.checked()
        self._queries.take_status(now)
        # Last, so that a caller has its answer before topics show the change.
        self._emit(events.StatusReceived(self.address, status, now, self._newest.temperature))

    def take_identity(self, identity: Identity, now: float) -> None:
        """Take a COMPONENT_INFORMATION_BASIC."""
        self.heard(now)
        self._queries.take_identity(identity, now)
        self._emit(events.LightIdentified(self.address, identity))

    def lose(self, reason: str, now: float) -> None:
        """Note that the light is not heard any more."""
        if self.connected:
            self.connected = False
            self.lost_at = now
            self._tracker.lost()
            self._queries.end()
            self._emit(events.LightLost(self.address, reason))
            message = self.unreachable(now)
            # An OFF may reach the light at any time.
            self._switch.lost(message, now)
            self._configuration.lost(message, now)

    def link_opened(self, now: float) -> None:
        """Note that the light can be reached."""
        self._link_failure = ''

    def link_closed(self, now: float, reason: str) -> None:
        """Note that the light cannot be reached."""
        self._link_failure = f'the link is not open: {reason}'
        self.lose('the link was lost', now)

    def _restarted(self, now: float) -> None:
        self.restarts += 1
        self._switch.keep_off()
        is_on = self.status.enabled if self.status else None
        self._emit(events.LightRestarted(self.address, self._switch.state.enabled, is_on))
        self._queries.begin(now)
        self._configuration.restarted(now)

    # Values

    @property
    def status(self) -> Status | None:
        """Return the newest status, None before the first."""
        return self._newest.status

    @property
    def strobe_range(self) -> StrobeRange:
        """Return the strobe periods that the light reports to be possible."""
        return self._newest.strobe_range

    def unreachable(self, now: float) -> str:
        """Return why requests cannot reach the light, for people; '' if they can."""
        if self.connected:
            return ''
        # Without a link no heartbeat can be heard, so the failure of the link is the reason.
        reason = self._link_failure or f'no heartbeat for {format_seconds(now - self.heard_at)}'
        return f'light {self.address} is lost: {reason}'

    def snapshot(self, now: float) -> events.LightSnapshot:
        """Return the state, for any thread."""
        configuration, queries = self._configuration, self._queries
        return events.LightSnapshot(
            self.address, self.connected, self.heard_at, self.status, self._newest.at,
            self._settings.status_interval, self.restarts, self._newest.temperature,
            configuration.agreed.confirmed, configuration.discrepancy,
            configuration.guard.exceeded, queries.identity, queries.identity_is_settled(now),
            self._tracker.conflict.detected, self.unreachable(now), self._sources.shown_holder,
            self._sources.since, self._switch.off_at)

    def change_settings(self, settings: Settings, now: float) -> None:
        """
        Take other settings.

        Only ``limits``, ``off_after_silence``, ``reassert`` and the time-out of ``sources`` may
        differ. The silence begins again if ``off_after_silence`` differs.
        """
        before, self._settings = self._settings, settings
        if settings.limits != before.limits:
            self._configuration.change_limits(settings.limits, now)
        if settings.off_after_silence != before.off_after_silence:
            self._forget_silenced(now)
            self._switch.change_silence(settings.off_after_silence, now)
        if settings.reassert != before.reassert:
            self._configuration.change_reassert(settings.reassert)
            self._switch.change_reassert(settings.reassert, now)
        if settings.sources:
            self._sources.set_lease(settings.sources.timeout)
        self._changed(self, now)

    # Requests

    def _can_reach(self, now: float, done: Done, refusal: str = '') -> bool:
        """Return whether the light takes requests; if not, fail a request with the reason."""
        closed = self._target.commands.refusal
        refusal = closed or refusal or self.unreachable(now)
        if refusal:
            done(Result(False, refusal, superseded=bool(closed)), now)
        return not refusal

    def enable(
        self, on: bool, now: float, done: Done, *, detail: str = '', source: str = DEFAULT,
        is_stream: bool = False,
    ) -> None:
        """
        Switch the light on or off; ``done`` is called once with the result.

        While a higher source holds the light, a request is not sent. One of a stream is then
        remembered, and any other is refused and leaves nothing behind.

        An OFF overtakes: requests for ON that are not confirmed are superseded.

        :param detail: how it was requested, for :class:`LightSwitched`.
        :param is_stream: whether it is one of a stream, which its publisher repeats: a newer one
            replaces it.
        """
        def finished(result: Result, now: float) -> None:
            if result.success:
                self._sources.remember(source, desired)
            done(result, now)

        desired = DesiredState(enabled=on)
        refusal = self._claim(source, now, desired, is_stream=is_stream)
        if self._can_reach(now, done, refusal):
            self._switch.ask(on, now, finished, detail, is_stream=is_stream)
            self._changed(self, now)

    def is_held_by_other(self, source: str) -> bool:
        """Return whether another source holds the light, so that a request is not sent."""
        return bool(self._sources.holder and self._sources.refusal(source))

    def release(self, source: str, now: float) -> str:
        """
        Release the light: the next lower source that has claimed it then holds it.

        :return: the source that holds it now, '' if none does.
        """
        self._change_holder(self._sources.poll(now), now)
        self._change_holder(self._sources.release(source, now), now)
        self._changed(self, now)
        return self._sources.holder or ''

    def _claim(
        self, source: str, now: float, desired: DesiredState, *, is_stream: bool,
    ) -> str:
        """Take a request; return why a source may not command the light, '' if it may."""
        if refusal := self._target.commands.refusal:
            return refusal
        self._change_holder(self._sources.poll(now), now)
        if not is_stream and (refusal := self._sources.refusal_of_claim(source)):
            return refusal
        self.was_commanded = True
        self._forget_silenced(now)
        self._switch.note_request(now)
        self._changed(self, now)
        self._change_holder(self._sources.claim(source, now), now)
        # A request to a lost light has no effect later, but an OFF ends a remembered ON.
        if is_stream and (self.connected or desired.enabled is False):
            self._sources.remember(source, desired)
        elif desired.enabled is False:
            self._sources.forget_switch(source)
        return self._sources.refusal(source)

    def _forget_silenced(self, now: float) -> None:
        """Forget what would switch the light on, if it was requested before a silence."""
        if self._switch.state.is_silent(now):
            self._switch.keep_off()
            self._sources.forget_on(brightness_is_switch=self._configuration.brightness.is_switch)

    def _change_holder(self, change: HolderChanged[str] | None, now: float) -> None:
        if change is None:
            return
        if change.after is not None:
            # The requests of a source that no longer holds the light end, and their resends.
            self._switch.cancel(f'held by {change.after}', now)
            self._configuration.end_requests(f'held by {change.after}', now)
        self._emit(events.LightHeld(self.address, change))
        if change.after is None:
            self._switch.stop_on(f'{change.before} no longer holds it', now)
            if self._settings.off_on_release and not (
                    self.connected and self._switch.is_known_off(now)):
                self._switch.require_off(
                    f'on_release: {change.before} no longer holds it', now)
        elif change.cause is not Cause.CLAIM:
            self._send_desired(now)

    def _send_desired(self, now: float) -> None:
        """Send the values that the new holder of the light has requested before."""
        self._forget_silenced(now)
        holder, desired = self._sources.holder, self._sources.desired

        def done(result: Result, now: float) -> None:
            if not (result.success or result.superseded):
                self._emit(events.DesiredStateFailed(self.address, holder or '', result.message))

        if not self._can_reach(now, done):
            return
        way = f'{holder}, which holds the light now'
        if desired.enabled is False:
            self._switch.ask(False, now, done, way)
        if desired.brightness is not None and not (
                desired.enabled is False and self._configuration.brightness.is_switch):
            self._configuration.set_brightness(desired.brightness, now)
        if desired.enabled:
            self._switch.ask(True, now, done, way)

    def _earliest_on(self) -> float:
        """
        Return the earliest time for an ON, s; infinity until a configuration was sent.

        A light that has restarted has the brightness of its firmware until it is configured.
        """
        if self._configuration.must_send_before_on:
            return math.inf
        if self._configuration.may_send_after_restart:
            return self._tracker.check_until
        return -math.inf

    def configure(self, changes: Changes, now: float, done: Done) -> None:
        """
        Change some fields with one command; ``done`` is called once with the result.

        The request is one of the source :data:`~..payload.command_sources.DEFAULT`.

        :param changes: values by name, see :data:`~.model.FIELDS`; if one is wrong none is sent.
        """
        def finished(result: Result, now: float) -> None:
            if result.success:
                self._sources.remember(
                    DEFAULT, DesiredState(brightness=changes.get('brightness')))
            done(result, now)

        refusal = self._claim(DEFAULT, now, DesiredState(), is_stream=False)
        if self._can_reach(now, done, refusal):
            self._configuration.configure(changes, now, finished)

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

        refusal = self._claim(
            source, now, DesiredState(brightness=brightness), is_stream=True)
        if self._can_reach(now, failed, refusal):
            self._configuration.set_brightness(brightness, now)

    def set_desired(self, values: Changes, now: float) -> None:
        """
        Send values as soon as the light has reported its configuration.

        :param values: by name, checked, except against the limits that the light reports.
        """
        self._configuration.set_desired(values, now)
        self._changed(self, now)

    def close(self, now: float) -> None:
        """Answer all requests, and make no change any more but :meth:`switch_off_finally`."""
        refusal = self._target.commands.refusal
        self._sources = LightSources(None)
        self._switch.close(refusal, now)
        self._configuration.replace(refusal, now)
        self._queries.close(refusal, now)
        self._changed(self, now)

    def switch_off_finally(self, now: float, report: Done) -> None:
        """
        Switch the light off, and again whenever it may be on, after :meth:`close`.

        :param report: see :class:`~..payload.attempt.LastChange`. The failure of a light that
            is not heard is permanent until it is heard.
        """
        self._switch.switch_off_finally(now, report, connected=self.connected)
        if not self.connected:
            report(Result(False, self.unreachable(now), permanent=True), now)
        self._changed(self, now)

    def may_stay_on(self, now: float) -> bool:
        """Return whether the light is on, or may go on by an ON of ours that was sent."""
        return self._switch.may_be_on or self._switch.is_own(True, now)

    def refresh(self, now: float, done: Done) -> None:
        """Ask for identity and status again; ``done`` is called once with the result."""
        if self._can_reach(now, done):
            self._queries.refresh(now, done)
            self._changed(self, now)

    def request_status(self, now: float) -> None:
        """Ask for a status, unless such a request is under way."""
        self._target.request_status(now)

    # Time

    @property
    def _silent_since(self) -> float:
        return self.heard_at if self.connected else math.inf

    def poll(self, now: float) -> None:
        """Do what is due."""
        # Compute the same sum as next_deadline(); the difference is rounded differently.
        if self.connected and now >= self.heard_at + self._settings.heartbeat_timeout:
            self.lose(f'no heartbeat for {format_seconds(now - self.heard_at)}', now)
        self._queries.poll(now, self._silent_since)
        self._change_holder(self._sources.poll(now), now)
        self._switch.poll(now, connected=self.connected)
        self._configuration.poll(now, connected=self.connected)

    def next_deadline(self) -> float:
        """Return when :meth:`poll` has something to do."""
        connected = self.connected
        return min(
            self._queries.next_deadline(self._silent_since),
            self._switch.next_deadline(connected=connected),
            self._configuration.next_deadline(connected=connected),
            self.heard_at + self._settings.heartbeat_timeout if connected else math.inf,
            self._sources.next_deadline())
