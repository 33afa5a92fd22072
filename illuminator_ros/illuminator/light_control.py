# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The requests to one light: its sources, its switch and its configuration."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
import math

from . import events
from .command_sources import DesiredState, LightSources
from .light_configuration import IMPLIED_TIME, LightConfiguration, requested
from .model import Changes, SafetyLimits, Status
from .switch import OFF, ON, Silence, Switch
from ..mavlink.command_sender import Command
from ..mavlink.messages import Address
from ..payload.arbitration import Cause, HolderChanged
from ..payload.command_sources import DEFAULT, SourceSettings
from ..payload.confirmed_command import Done, Result, Target
from ..payload.device_events import DeviceHeld
from ..payload.device_property import answer, Caller, Outcome
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


class LightControl:
    """
    Switches and configures one light for its sources. No I/O; times are s.

    Each method that may send ends with :meth:`update`, which sends what is desired now and answers
    the callers whose requests have ended.

    :param liveness: of the light.
    :param emit: takes the events.
    :ivar switch: the switch of the light, ``configuration`` its configuration, and ``sources`` the
        sources of commands to it.
    :ivar was_commanded: whether a user has ever sent it a command.
    :ivar version: counts the updates, for those who keep a deadline of this.
    """

    def __init__(
        self, target: Target, liveness: Liveness, settings: LightSettings,
        emit: Callable[[events.LightEvent], None],
    ) -> None:
        self.switch = Switch(target, emit, settings.off_after_silence)
        self.configuration = LightConfiguration(
            target, emit, limits=settings.limits, restores=settings.restore_configuration)
        self.sources = LightSources(settings.sources)
        self.was_commanded = False
        self.version = 0
        # The holder, if the calls under way have refused an OFF of it, else ''.
        self._refused_off = ''
        self._address = target.address
        self._commands = target.commands
        self._liveness = liveness
        self._settings = settings
        self._emit = emit

    def change_settings(self, settings: LightSettings, now: float) -> None:
        """
        Take other settings.

        Only ``limits``, ``off_after_silence`` and the time-out of ``sources`` may differ. The
        silence begins again if ``off_after_silence`` differs.
        """
        before, self._settings = self._settings, settings
        if settings.limits != before.limits:
            self.configuration.change_limits(settings.limits, now)
        if settings.off_after_silence != before.off_after_silence:
            self._forget_silenced(now)
            self.switch.silence = Silence(settings.off_after_silence, now)
        if settings.sources:
            self.sources.set_lease(settings.sources.timeout)
        # The next poll sends what they demand: an atomic set that fails takes them back before.
        self.version += 1

    def unreachable(self, now: float) -> str:
        """Return why requests cannot reach the light, for people; '' if they can."""
        return '' if self._liveness.connected else self._liveness.loss(
            f'light {self._address}', now)

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
            self.switch.ask(on, now, caller)
        self.update(now)

    def _prepare_off(self, now: float) -> None:
        """End what an OFF must not be followed by, where the brightness may be the switch."""
        if self.configuration.brightness_is_switch is not False:
            self.configuration.cancel('superseded by off', now, superseded=True)
            self.switch.property.fence_until(self.configuration.property.fence)

    def configure(self, changes: Changes, now: float, done: Done) -> None:
        """
        Change some fields with one command; ``done`` is called once with the result.

        The request is one of the source :data:`~..payload.command_sources.DEFAULT`.

        :param changes: values by name, see :data:`~.model.FIELDS`; if one is wrong none is sent.
        """
        caller = Caller(done, now, DEFAULT)
        if self._take_request(caller, DesiredState(), now):
            self.configuration.configure(changes, now, caller)
        self.update(now)

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
                self._emit(events.SetpointFailed(self._address, result.message))

        caller = Caller(failed, now, source, is_stream=True)
        if self._take_request(caller, DesiredState(brightness=brightness), now):
            self.configuration.set_brightness(brightness)
        self.update(now)

    def require(self, values: Changes, now: float) -> None:
        """
        Send values, and what is required already, once the light has reported its configuration.

        :param values: by name, checked, except against the limits that the light reports; none if
            the light is heard again.
        """
        self.configuration.require(values, now)
        self.update(now)

    def _take_request(self, caller: Caller, desired: DesiredState, now: float) -> bool:
        """
        Take a request: it counts for its source, and ends what lower sources have requested.

        :return: whether it may be sent now; if not, it is answered with the reason.
        """
        sources, source, is_off = self.sources, caller.source, desired.enabled is False
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
        if is_off and held and source == sources.holder:
            # A call under way refuses it, and may fail.
            self._refused_off = source
        sent = is_off and not held and self._send_unheard_off()
        if sent:
            self.switch.property.note_sent(OFF, now)
        if refusal := late or held or self.unreachable(now):
            refusal += '; an OFF was sent once' if sent else ''
            caller.done(Result(False, refusal), now)
            return False
        if not caller.is_stream:
            self._take_over(source, now)
            # Calls that overlap, of which none succeeds, must not hold off the silence for ever.
            if not sources.are_calling:
                self.switch.silence.called_at = now
            sources.begin_call(source)
        return True

    def _send_unheard_off(self) -> bool:
        """
        Send an OFF once to a light that is lost: it may hear though it is not heard.

        :return: whether it was sent.
        """
        is_sent = not (self._liveness.connected or self._liveness.link_failure)
        if is_sent:
            self._commands.send_once(Command(self._address, OFF.command, OFF.params))
        return is_sent

    def _take_stream(self, source: str, desired: DesiredState, now: float) -> None:
        """Take a request of a stream, which counts at once."""
        self._forget_silenced(now)
        self.switch.silence.requested_at = now
        self._take_over(source, now)
        self._take_holder(self.sources.claim(source, now), now)
        # A request to a lost light has no effect later, but an OFF ends a remembered ON.
        if self._liveness.connected or desired.enabled is False:
            self.sources.remember(source, desired)

    def _take_over(self, source: str, now: float) -> None:
        """End the requests of another source, unless it is a higher one."""
        if self.sources.takes_over(source):
            self._end_requests(f'held by {source}', now)

    def _end_requests(self, message: str, now: float) -> None:
        self.switch.cancel(message, now, superseded=True)
        self.configuration.cancel(message, now, superseded=True)

    def is_held_by_other(self, source: str) -> bool:
        """Return whether another source holds the light, so that a request is not sent."""
        return bool(self.sources.refusal(source))

    def release(self, source: str, now: float) -> str:
        """
        Release the light: the next lower source that has claimed it then holds it.

        :return: the source that holds it now, '' if none does.
        """
        self._take_holder(self.sources.poll(now), now)
        self._take_holder(self.sources.release(source, now), now)
        self.update(now)
        return self.sources.holder or ''

    def _forget_silenced(self, now: float) -> None:
        """Forget what would switch the light on, if it was requested before a silence."""
        if self.sources.are_ranked and now >= self.switch.silence.ends_at:
            self.sources.forget_on(
                brightness_is_switch=bool(self.configuration.brightness_is_switch))

    def _take_holder(self, change: HolderChanged[str] | None, now: float) -> None:
        """Take a change of the source that holds the light."""
        if change is None:
            return
        self._emit(DeviceHeld(self._address, change))
        if change.after is None:
            is_known_off = (self._liveness.connected and self.switch.enabled is False
                            and not self.may_be_on(now))
            if self._settings.off_on_release and not is_known_off:
                reason = f'on_release: {change.before} no longer holds it'
                self.switch.require_off(reason)
                if self.switch.is_pending(ON) and not self.sources.are_calling:
                    self.switch.cancel(reason, now, superseded=True)
        elif change.cause is not Cause.CLAIM:
            self._end_requests(f'held by {change.after}', now)
            self._send_remembered(change.after, now)

    def may_be_on(self, now: float) -> bool:
        """Return whether the light is on, or may go on by a command of ours that was sent."""
        return self.switch.may_be_on(now) or self.configuration.may_switch(now)

    def _send_remembered(self, source: str, now: float) -> None:
        """Send the values that the new holder of the light has requested before."""
        self._forget_silenced(now)
        desired = self.sources.desired
        reason = f'{source}, which holds the light now'
        if self._commands.refusal or not self._liveness.connected:
            if desired.enabled is False:
                # It is sent when the light is heard again.
                self.switch.require_off(reason)
            return
        caller = Caller(
            _reported_failure(self._emit, self._address, source), now, source, True, reason)
        if desired.enabled is False:
            self._prepare_off(now)
            self.switch.ask(False, now, caller)
        if desired.brightness is not None:
            self.configuration.set_brightness(desired.brightness)
            self.configuration.update(now, is_off_pending=self.switch.is_pending(OFF))
        if desired.enabled:
            self.switch.ask(True, now, caller)

    # Answers

    def update(self, now: float) -> None:
        """Send what is desired now, and answer the callers whose requests have ended."""
        switch, configuration = self.switch, self.configuration
        parts: tuple[Switch | LightConfiguration, ...] = switch, configuration
        self.version += 1
        has_outcomes = True
        while has_outcomes:
            for part in parts:
                while part.property.outcomes:
                    outcome = part.property.outcomes.popleft()
                    part.take(outcome, now)
                    self._finish(outcome, now)
            if self._liveness.connected:
                # First the configuration, so that an ON finds it.
                configuration.update(now, is_off_pending=switch.is_pending(OFF))
                if configuration.brightness_is_switch is not False and switch.is_off_due(now):
                    self._prepare_off(now)
                switch.update(now)
            has_outcomes = bool(switch.property.outcomes or configuration.property.outcomes)

    def _finish(self, outcome: Outcome[Status], now: float) -> None:
        """Take the end of a value: a call that has succeeded counts from now on."""
        result, status = outcome.result, outcome.status
        if outcome.desired.change == ON and status and (
                excess := self.configuration.excess(status)):
            result = result._replace(
                message=f'{result.message}; {", ".join(excess)}, and is brought back')
        for caller in outcome.callers:
            if caller.is_stream:
                continue
            change = self.sources.end_call(caller.source, now, success=result.success)
            self._take_holder(change, now)
            if result.success:
                self._forget_silenced(now)
                self.switch.silence.requested_at = now
                self.sources.remember(caller.source, _wish(outcome))
        if not self.sources.are_calling:
            self.switch.silence.called_at = -math.inf
            refused, self._refused_off = self._refused_off, ''
            if refused and refused == self.sources.holder:
                self._send_remembered(refused, now)
        answer(outcome.callers, result, now)

    # The end of the process

    def close(self, now: float) -> None:
        """Answer all requests, and make no change any more but :meth:`switch_off_finally`."""
        self.sources = LightSources(None)
        self.switch.close(self._commands.refusal, now)
        self.configuration.cancel(self._commands.refusal, now, superseded=True)
        self.update(now)

    def switch_off_finally(self, now: float, report: Done) -> None:
        """
        Switch the light off, and again whenever it may be on, after :meth:`close`.

        :param report: called with a failure that is not permanent when the first OFF is sent and
            when one has failed, and with a success when the light shows it. The failure of a light
            without an open link is permanent.
        """
        self.switch.switch_off_finally(now, report)
        if unreachable := self.unreachable(now):
            self._send_unheard_off()
            report(Result(False, unreachable, permanent=bool(self._liveness.link_failure)), now)
        self.update(now)

    # Reports

    def expects(self, status: Status) -> bool:
        """Return whether a status shows what a command under way changes."""
        return self.switch.property.expects(status) or self.configuration.property.expects(status)

    def may_cause(self, now: float) -> bool:
        """Return whether a command of ours may have caused what a status shows."""
        switch, configuration = self.switch.property, self.configuration.property
        return switch.command is not None or configuration.command is not None or (
            now <= max(switch.sent_at, configuration.sent_at) + IMPLIED_TIME)

    def reported(self, status: Status, now: float, *, is_followed: bool) -> None:
        """
        Take a status that is not older than those before.

        :param is_followed: whether changes of others are followed and reported.
        """
        self._forget_silenced(now)
        switched_at = self.switch.property.sent_at
        self.switch.reported(status, now, may_be_ours=self.configuration.may_switch(now),
                             is_told=is_followed)
        self.configuration.reported(
            status, now, can_follow=is_followed, switched_at=switched_at)

    def restarted(self, status: Status, now: float) -> None:
        """Take the first status after a restart."""
        self._forget_silenced(now)
        self.switch.restarted(status, now)
        self.configuration.restarted(status, now)

    def lost(self, now: float) -> None:
        """Note that the light is not heard any more."""
        message = self.unreachable(now)
        self.switch.cancel(message, now)
        self.configuration.cancel(message, now, superseded=False)
        self.update(now)

    # Time

    def poll(self, now: float) -> None:
        """Do what is due."""
        self._take_holder(self.sources.poll(now), now)
        self.switch.property.poll(now)
        self.configuration.property.poll(now)
        self.update(now)

    def next_deadline(self) -> float:
        """Return when :meth:`poll` has something to do."""
        due = self.sources.next_deadline() if self.sources.are_ranked else math.inf
        if self._liveness.connected:
            due = min(due, self.switch.next_deadline(), self.configuration.next_deadline())
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
