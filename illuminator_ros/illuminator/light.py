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
from dataclasses import dataclass, field
import math

from . import configuration_manager, events
from .command_sources import LightSources
from .commands import SWITCHES
from .configuration_manager import ConfigurationManager
from .messages import STATUS_ID
from .model import Changes, DIMMING_FLAGS, ErrorFlags, Mode, SafetyLimits, Status, StrobeRange
from .status_tracker import RESTART_PROOF_TIME, StatusTracker, Uptime
from ..mavlink.command_sender import (
    Command,
    CommandResult,
    CommandSender,
    CommandStatus,
    format_seconds,
)
from ..mavlink.messages import Address, MavCmd
from ..payload.arbitration import Cause, HolderChanged
from ..payload.command_sources import DEFAULT, SourceSettings
from ..payload.identity import Identity, IdentityQuery
from ..payload.last_change import LastChange
from ..payload.repeat_limit import RepeatLimit
from ..payload.request import (
    at_any_time,
    Change,
    Done,
    Phase,
    Request,
    RequestQueue,
    Result,
    StatusReport,
    Target,
)

# s without a status after which the light is asked for one, and between the requests.
STATUS_TIMEOUT = 2.5
# s for which an ON waits for the statuses that show whether the light has restarted: long enough
# for two of a light that sends one each second and none on request.
RESTART_CHECK_TIME = 2.5
# s; a request ends after this time even if the light still reports progress.
PROGRESS_LIMIT = 30.0
# s; enough for two commands in sequence, each with its tries, and for their messages.
REFRESH_LIMIT = 5.0
# s after an ON in which an OFF may overtake it on the way to the light.
OVERTAKING_TIME = 0.2


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
    """

    heartbeat_timeout: float = 3.0
    status_interval: float = 0.0
    restore_configuration: bool = True
    limits: SafetyLimits = SafetyLimits()
    off_after_silence: float = 0.0
    reassert: bool = False
    sources: SourceSettings | None = None
    off_on_release: bool = False


@dataclass
class _AutomaticSwitch:
    """
    A switch without a request, which is repeated until the light shows it.

    :param due: when it is sent next, s.
    :param reason: for people.
    :param limit: of the repeats, None for no limit.
    """

    on: bool
    reason: str
    due: float
    limit: RepeatLimit | None = None


class Light:
    """
    One component that is an illuminator. No I/O; time is passed in.

    :param emit: takes the events.
    :param changed: called with the light and the time when :meth:`next_deadline` or
        ``has_answered`` may have changed.
    :ivar connected: whether it is heard.
    :ivar heard_at: the time of its last message, s; -inf before the first.
    :ivar status: the newest status, None before the first.
    :ivar lost_at: when it was lost, s; infinity while it is heard.
    :ivar restarts: how often it has restarted since it was found.
    :ivar was_commanded: whether a user has ever sent it a command.
    :ivar has_answered: whether it has ever answered a command.
    """

    def __init__(
        self, address: Address, commands: CommandSender, settings: Settings,
        emit: Callable[[events.AnyLightEvent], None], changed: Callable[[Light, float], None],
    ) -> None:
        self.address = address
        self._settings = settings
        self.connected = False
        self.heard_at = -math.inf
        self.lost_at = math.inf
        self.status: Status | None = None
        self._status_at = -math.inf
        self.restarts = 0
        self.was_commanded = False
        self.has_answered = False
        self._commands = commands
        self._emit = emit
        self._changed = changed
        self._target = Target(
            address, commands, self._command_ended, kind='light', status_id=STATUS_ID,
            status_name='ILLUMINATOR_STATUS')
        self._identity_query = IdentityQuery(self._target)
        self._switching: RequestQueue[Status] = RequestQueue(self._target)
        self._configuration = ConfigurationManager(
            self._target, emit, limits=settings.limits,
            restore=settings.restore_configuration, reassert=settings.reassert,
            must_wait=lambda: bool(commands.refusal) or self._may_brightness_undo_off())
        self._tracker = StatusTracker()
        self._is_shared = False
        self._measures_temperature = False
        self._link_failure = ''
        self._status_due = math.inf
        self._asked_at = -math.inf
        # s of silence after which the light is asked for a status, so that its answer arrives
        # within the heartbeat timeout.
        self._longest_silence = min(STATUS_TIMEOUT, settings.heartbeat_timeout / 1.2)
        self._was_lost = False
        # The time until which an ON waits, s, since the light may have restarted.
        self._restart_check_until = -math.inf
        self._enabled: bool | None = None
        # Whether a status has shown it on since the last OFF that was confirmed.
        self._was_on = False
        self._last_switch: tuple[bool, float] = False, -math.inf
        # The time until which a switch that was not confirmed may still take effect, s.
        self._late_until = -math.inf
        # The brightness that the light reports while it is off; 0 where a brightness of 0 is off.
        self._off_brightness: float | None = None
        # Whether the light was seen to report brightness 0 since it was switched off.
        self._brightness_is_switch = False
        # Whether heat has switched it off.
        self._is_hot = False
        # The time of the last request, or of the status that showed that another sender has
        # switched the light on, s.
        self._requested_at = -math.inf
        self._automatic: _AutomaticSwitch | None = None
        # Whether it is switched on again if another sender switches it off: a request has switched
        # it on, and it was neither lost nor restarted since.
        self._undoes_off = False
        self._undoing = RepeatLimit(
            configuration_manager.REPEATS, configuration_manager.REPEAT_INTERVAL)
        self._sources = LightSources(settings.sources)
        self._refreshes: list[_Refresh] = []
        self._last_off: LastChange[Status] | None = None

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
            self._restart_check_until = now + RESTART_CHECK_TIME
            self._configuration.retry_pending(now)
            # A status request that was sent to the silent light may be resent only half a second
            # later.
            self._target.cancel_status_request(now)
            self._set_up(now)
            self._emit(events.LightConnected(self.address))

    def take_status(self, status: Status, now: float, sender: int = 0) -> None:
        """
        Take an ILLUMINATOR_STATUS, unless it is older than the one before.

        :param sender: of the message.
        """
        # As heard() does, without a call for each status.
        self.heard_at = now
        if not self.connected:
            self.heard(now)
        was_lost, self._was_lost = self._was_lost, False
        uptime = self._tracker.take_uptime(status, now, was_lost=was_lost)
        # A request that waits for the status is answered before the status is published. Otherwise
        # the status is published first: the comparison with earlier ones would add a quarter to
        # its delay.
        is_confirming = self._switching.is_confirming or self._configuration.is_confirming
        is_awaited = is_confirming or bool(self._refreshes)
        is_first = uptime is Uptime.RUNNING and not is_awaited
        if is_first:
            self._note(status, now)
            self._publish(status, now)
        report, restarted = self._tracker.take(
            status, uptime, now, sender=sender,
            commanded=is_confirming or bool(
                self._switching.current or self._configuration.is_changing))
        if report is None:
            self._was_lost = was_lost
            if self._tracker.is_suspecting:
                self._status_due = min(self._status_due, now + RESTART_PROOF_TIME)
                if now > self._restart_check_until:
                    self._restart_check_until = now + RESTART_CHECK_TIME
            return
        if not is_first:
            self._note(status, now)
        self._status_due = now + max(STATUS_TIMEOUT, 2.5 * self._settings.status_interval)
        if restarted:
            self._restarted(now)
        if not is_first and not is_awaited:
            self._publish(status, now)
        if self._is_shared is not report.shared_address:
            self._is_shared = report.shared_address
            self._emit(events.AddressShared(self.address, self._is_shared))
        self._take_report(report, now, restarted=restarted)
        self._restart_check_until = -math.inf
        if is_awaited:
            self._publish(status, now)

    def _note(self, status: Status, now: float) -> None:
        self.status, self._status_at = status, now
        # Lights that do not measure send 0 (ArduSub), and a sensor rarely reads exactly 0.
        self._measures_temperature |= bool(status.temperature)

    def _publish(self, status: Status, now: float) -> None:
        self._emit(events.StatusReceived(self.address, status, now, self.temperature))

    def _take_report(
        self, report: StatusReport[Status], now: float, *, restarted: bool,
    ) -> None:
        before, self._enabled = self._enabled, report.status.enabled
        self._was_on |= bool(self._enabled)
        if self._enabled is False:
            self._off_brightness = report.status.brightness
            confirmed = self._configuration.confirmed
            self._brightness_is_switch = self._off_brightness == 0.0 and (
                self._brightness_is_switch
                or bool(before and confirmed and confirmed.brightness)
                and not self._configuration.is_changing)
        was_hot = self._is_hot
        self._is_hot = bool(report.status.error_flags & ErrorFlags.OVER_TEMPERATURE_SHUTDOWN)
        # Several lights at one address seem to be one light that switches repeatedly, and a light
        # that has cooled down switches itself on.
        is_by_other = before is False and not (
            report.shared_address or was_hot or self._switching or self._is_own(True, now))
        if self._enabled and (self._requested_at == -math.inf or is_by_other):
            self._note_request(now)
        if not self._switching:
            # The OFF of one of several lights does not show that the others are off.
            if (self._automatic and self._enabled is self._automatic.on
                    and (self._enabled or not report.shared_address)):
                self._automatic = None
            if not (restarted or self._commands.refusal):
                self._follow_switch(before, report, now)
        self._switching.take(report, now)
        if self._last_off is not None:
            self._last_off.take(report, now)
        self._configuration.take(
            report, now, can_follow=self._tracker.conflict.can_follow,
            switched_at=self._last_switch[1], brightness_is_switch=self._brightness_is_switch)
        if self._refreshes:
            for refresh in self._refreshes:
                refresh.outcomes['ILLUMINATOR_STATUS'] = ''
            self._check_refreshes(now)

    def _follow_switch(
        self, before: bool | None, report: StatusReport[Status], now: float,
    ) -> None:
        """Report that the light was switched without a request under way."""
        status = report.status
        if (before is None or status.enabled is None or before == status.enabled
                or report.shared_address or status.error_flags & DIMMING_FLAGS
                or status.mode is Mode.EXTERNAL_SYNC):
            return
        is_own = self._is_own(status.enabled, now)
        origin = events.Origin.REQUEST if is_own else events.Origin.OTHER_SENDER
        self._emit(events.LightSwitched(self.address, status.enabled, origin))
        if not self._settings.reassert or is_own or before and not self._undoes_off:
            return
        due, change = self._undoing.take(now), 'off' if before else 'on'
        if due is None:
            self._emit(events.ChangedByOther(self.address, change, undone=False))
        else:
            self._switch_automatically(_AutomaticSwitch(
                before, f'external_changes: another sender switched it {change}', due,
                self._undoing))

    def _may_brightness_undo_off(self) -> bool:
        """Return whether an OFF is under way that a brightness may undo."""
        # A brightness does not switch on a light that has shown one while it was off. Without this
        # exception a light that confirms slowly would not be configured while OFFs are repeated.
        return self._off_brightness in (None, 0.0) and self._switching.has(_is_off)

    def _is_own(self, on: bool, now: float) -> bool:
        """Return whether a switch may be the late or implied effect of a command of ours."""
        return (self._last_switch[0] is on and now <= self._late_until
                or self._off_brightness == 0.0
                and now <= self._configuration.sent_at + configuration_manager.IMPLIED_TIME)

    def _is_known_off(self, now: float) -> bool:
        """Return whether the light is off, and no command of ours may still switch it on."""
        return (self.connected and self._enabled is False and not self._is_shared
                and not self._switching.has(_is_on) and not self._is_own(True, now)
                and not (self._off_brightness == 0.0 and self._configuration.has_values_to_send))

    def _is_silent(self, now: float) -> bool:
        limit = self._settings.off_after_silence
        return bool(limit) and now >= self._requested_at + limit

    def _note_request(self, now: float) -> None:
        self._forget_silenced(now)
        self._requested_at = now

    def _forget_silenced(self, now: float) -> None:
        """Forget what would switch the light on, if it was requested before a silence."""
        if self._is_silent(now):
            self._keep_off()
            self._sources.forget_on(brightness_is_switch=self._brightness_is_switch)

    def _keep_off(self) -> None:
        """Undo no OFF by another sender until a request has switched the light on."""
        self._undoes_off = False
        if self._automatic and self._automatic.on:
            self._automatic = None

    def _switch_automatically(self, switch: _AutomaticSwitch) -> None:
        if not self._commands.refusal:
            self._automatic = switch
            self._emit(events.AutomaticSwitch(self.address, switch.on, switch.reason))

    def take_identity(self, identity: Identity, now: float) -> None:
        """Take a COMPONENT_INFORMATION_BASIC."""
        self.heard(now)
        self._identity_query.take(identity, now)
        self._emit(events.LightIdentified(self.address, identity))

    def lose(self, reason: str, now: float) -> None:
        """Note that the light is not heard any more."""
        if self.connected:
            self.connected = False
            self.lost_at = now
            self._was_lost = True
            self._status_due = math.inf
            self._tracker.lost()
            self._emit(events.LightLost(self.address, reason))
            message = self.unreachable(now)
            self._keep_off()
            # End ON and CONFIGURE: another try may reach the light after a restart. An OFF may
            # reach it at any time.
            self._commands.end_all(
                now, CommandStatus.NO_ANSWER, self.address, lambda command: (
                    command.command == MavCmd.DO_ILLUMINATOR_CONFIGURE
                    or _is_on_command(command)))
            self._switching.cancel(
                message, now, lambda request: request.phase is Phase.WAITING)
            self._configuration.lost(message, now)

    def link_opened(self, now: float) -> None:
        """Note that the light can be reached."""
        self._link_failure = ''

    def link_closed(self, now: float, reason: str) -> None:
        """Note that the light cannot be reached."""
        self._link_failure = f'the link is not open: {reason}'
        self.lose('the link was lost', now)

    def _restarted(self, now: float) -> None:
        was_on, is_on = self._enabled, self.status.enabled if self.status else None
        self.restarts += 1
        self._keep_off()
        self._emit(events.LightRestarted(self.address, was_on, is_on))
        self._set_up(now)
        self._configuration.restarted(now)

    def _set_up(self, now: float) -> None:
        """Request what a light does not send by itself, when it is heard or has restarted."""
        interval = self._settings.status_interval
        if interval > 0:
            self._target.send(
                MavCmd.SET_MESSAGE_INTERVAL, (float(STATUS_ID), interval * 1e6), now)
        self._status_due = now + STATUS_TIMEOUT
        self._target.request_status(now)
        self._identity_query.ask(now)

    # Values

    @property
    def strobe_range(self) -> StrobeRange:
        """Return the strobe periods that the light reports to be possible."""
        return self.status.strobe_range if self.status else StrobeRange()

    @property
    def temperature(self) -> float | None:
        """Return the temperature, degC; None where it is not measured, or the sensor fails."""
        status = self.status
        if (status is None or not self._measures_temperature
                or status.error_flags and status.error_flags & ErrorFlags.THERMISTOR_FAILURE):
            return None
        return status.temperature

    def unreachable(self, now: float) -> str:
        """Return why requests cannot reach the light, for people; '' if they can."""
        if self.connected:
            return ''
        # Without a link no heartbeat can be heard, so the failure of the link is the reason.
        reason = self._link_failure or f'no heartbeat for {format_seconds(now - self.heard_at)}'
        return f'light {self.address} is lost: {reason}'

    def snapshot(self, now: float) -> events.LightSnapshot:
        """Return the state, for any thread."""
        return events.LightSnapshot(
            self.address, self.connected, self.heard_at, self.status, self._status_at,
            self._settings.status_interval, self.restarts, self.temperature,
            self._configuration.confirmed, self._configuration.discrepancy,
            self._configuration.limit_exceeded,
            self._identity_query.identity, self._identity_query.is_settled(now),
            self._tracker.conflict.detected, self.unreachable(now),
            self._sources.shown_holder, self._sources.since)

    # Requests

    def _can_reach(self, now: float, done: Done, refusal: str = '') -> bool:
        """Return whether the light is heard; if not, fail a request with the reason."""
        closed = self._commands.refusal
        if self.connected and not (closed or refusal):
            return True
        done(Result(False, closed or refusal or self.unreachable(now), superseded=bool(closed)),
             now)
        return False

    def enable(
        self, on: bool, now: float, done: Done, *, detail: str = '', source: str = DEFAULT,
        is_stream: bool = False,
    ) -> None:
        """
        Switch the light on or off; ``done`` is called once with the result.

        While a higher source holds the light, the request is not sent but remembered.

        An OFF overtakes: requests for ON that are not confirmed are cancelled.

        :param detail: how it was requested, for :class:`LightSwitched`.
        :param is_stream: whether a later one of a stream replaces it while it waits.
        """
        if self._can_reach(now, done, self._claim(source, now, enabled=on)):
            self._automatic = None
            self._switch(on, now, done, detail, is_stream=is_stream)

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
        self, source: str, now: float, *, enabled: bool | None = None,
        brightness: float | None = None,
    ) -> str:
        """Take a request; return why a source may not command the light, '' if it may."""
        if refusal := self._commands.refusal:
            return refusal
        self.was_commanded = True
        self._note_request(now)
        self._changed(self, now)
        if not self._sources.are_ranked:
            return ''
        self._change_holder(self._sources.poll(now), now)
        self._change_holder(self._sources.claim(source, now), now)
        # A request to a lost light has no effect later, but an OFF replaces a remembered ON.
        if self.connected or enabled is False:
            self._sources.remember(source, enabled=enabled, brightness=brightness)
        return self._sources.refusal(source)

    def _change_holder(self, change: HolderChanged[str] | None, now: float) -> None:
        if change is None:
            return
        if change.after is not None:
            self._end_requests(f'held by {change.after}', now)
        self._emit(events.LightHeld(self.address, change))
        if change.after is None:
            self._switching.cancel(
                f'{change.before} no longer holds it', now,
                lambda request: request.phase is Phase.WAITING and _is_on(request))
            self._commands.stop_resending(now, self.address, _is_on_command)
            if self._settings.off_on_release and not self._is_known_off(now):
                self._switch_automatically(_AutomaticSwitch(
                    False, f'on_release: {change.before} no longer holds it', now))
        elif change.cause is not Cause.CLAIM:
            self._send_desired(now)

    def _end_requests(self, message: str, now: float) -> None:
        """End the requests of a source that no longer holds the light, and their resends."""
        if self._automatic and self._automatic.on:
            self._automatic = None
        self._switching.cancel(message, now)
        self._end_commands(MavCmd.ILLUMINATOR_ON_OFF, now)
        self._configuration.end_requests(message, now)
        self._end_commands(MavCmd.DO_ILLUMINATOR_CONFIGURE, now)

    def _end_commands(self, kind: MavCmd, now: float) -> None:
        self._commands.end_all(
            now, CommandStatus.CANCELLED, self.address, lambda command: command.command == kind)

    def _send_desired(self, now: float) -> None:
        """Send the values that the new holder of the light has requested before."""
        self._forget_silenced(now)
        holder, desired = self._sources.holder, self._sources.desired

        def done(result: Result, now: float) -> None:
            if not result.success:
                self._emit(events.DesiredStateFailed(self.address, holder or '', result.message))

        if not self._can_reach(now, done):
            return
        way = f'{holder}, which holds the light now'
        if desired.enabled is False:
            self._automatic = None
            self._switch(False, now, done, way)
        if desired.brightness is not None and not (
                desired.enabled is False and self._brightness_is_switch):
            self._configuration.set_brightness(desired.brightness, now)
        if desired.enabled:
            self._automatic = None
            self._switch(True, now, done, way)

    def _switch(
        self, on: bool, now: float, done: Done, detail: str | None, *, is_stream: bool = False,
    ) -> None:
        """Submit a request; ``detail`` is None where its caller reports the change itself."""
        if not on and self._brightness_is_switch:
            # A brightness that is sent later would be an ON.
            self._configuration.replace(now)
            self._end_commands(MavCmd.DO_ILLUMINATOR_CONFIGURE, now)
        change = SWITCHES[on]
        was_on: bool | None = None

        def prepare(now: float) -> Change[Status]:
            nonlocal was_on
            was_on = self._enabled
            self._last_switch = on, now
            self._undoes_off &= on
            self._late_until = now + configuration_manager.LATE_TIME
            return change

        def finished(
            result: Result, sent: Change[Status] | None, status: Status | None, now: float,
        ) -> None:
            if result.success:
                self._enabled = self._undoes_off = self._was_on = on
                if not on and self._brightness_is_switch:
                    self._configuration.drop_pending()
            if result.success or result.refused:
                self._late_until = -math.inf
            done(result, now)
            if result.success and was_on is not on and detail is not None:
                self._emit(events.LightSwitched(self.address, on, events.Origin.REQUEST, detail))

        self._switching.submit(Request(
            self._target, prepare, finished, now=now, deadline=now + PROGRESS_LIMIT,
            is_stream=is_stream, overtakes=not on,
            earliest_start=self._earliest_on if on else at_any_time), now)

    def _earliest_on(self) -> float:
        """
        Return the earliest time for an ON, s; infinity until a configuration was sent.

        A light that has restarted has the brightness of its firmware until it is configured.
        """
        if self._configuration.must_send_before_on:
            return math.inf
        if self._configuration.may_send_after_restart:
            return self._restart_check_until
        return -math.inf

    def configure(self, changes: Changes, now: float, done: Done) -> None:
        """
        Change some fields with one command; ``done`` is called once with the result.

        The request is one of the source :data:`~..payload.command_sources.DEFAULT`.

        :param changes: values by name, see :data:`~.model.FIELDS`; if one is wrong none is sent.
        """
        def finished(result: Result, now: float) -> None:
            if result.success:
                self._sources.remember(DEFAULT, brightness=changes.get('brightness'))
            done(result, now)

        if self._can_reach(now, done, self._claim(DEFAULT, now)):
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

        if self._can_reach(now, failed, self._claim(source, now, brightness=brightness)):
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
        refusal = self._commands.refusal
        self._automatic = None
        self._sources = LightSources(None)
        self._switching.replace(now, refusal)
        self._configuration.replace(now, refusal)
        refreshes, self._refreshes = self._refreshes, []
        for refresh in refreshes:
            refresh.done(Result(False, refusal), now)
        self._changed(self, now)

    def switch_off_finally(self, now: float, report: Done) -> None:
        """
        Switch the light off, and again whenever it may be on, after :meth:`close`.

        :param report: see :class:`~..payload.last_change.LastChange`. The failure of a light that
            is not heard is permanent until it is heard.
        """
        self._last_off = LastChange(self._target, SWITCHES[False], report,
                                    counts_from=self._on_sent_by(now) + OVERTAKING_TIME)
        self._last_switch = False, now
        if self.connected:
            self._last_off.poll(now)
        else:
            report(Result(False, self.unreachable(now), permanent=True), now)
        self._changed(self, now)

    def _on_sent_by(self, now: float) -> float:
        """Return the time after which no ON was sent, s, unless it has succeeded or failed."""
        on, switched_at = self._last_switch
        if on:
            switched_at = now if now < self._late_until else -math.inf
        if self._off_brightness == 0.0:
            switched_at = max(switched_at, self._configuration.sent_at)
        return switched_at

    def refresh(self, now: float, done: Done) -> None:
        """Ask for identity and status again; ``done`` is called once with the result."""
        if not self._can_reach(now, done):
            return
        refresh = _Refresh(done, now)
        self._refreshes.append(refresh)

        def identified(failure: str, now: float) -> None:
            refresh.outcomes['COMPONENT_INFORMATION_BASIC'] = failure
            self._check_refreshes(now)

        def answered(result: CommandResult, now: float) -> None:
            if not result.accepted:
                refresh.outcomes.setdefault('ILLUMINATOR_STATUS', result.describe_failure())
                self._check_refreshes(now)

        self._identity_query.ask(now, identified)
        self._target.request_status(now, answered)
        self._changed(self, now)

    def _check_refreshes(self, now: float) -> None:
        ended = [one for one in self._refreshes if one.has_ended(now)]
        self._refreshes = [one for one in self._refreshes if one not in ended]
        for refresh in ended:
            refresh.done(refresh.result(now), now)

    def request_status(self, now: float) -> None:
        """Ask for a status, unless such a request is under way."""
        self._target.request_status(now)

    # Time

    def poll(self, now: float) -> None:
        """Do what is due."""
        # Compute the same sum as next_deadline(); the difference is rounded differently.
        if self.connected and now >= self.heard_at + self._settings.heartbeat_timeout:
            self.lose(f'no heartbeat for {format_seconds(now - self.heard_at)}', now)
        if now >= self._question_due:
            self._asked_at, self._status_due = now, now + STATUS_TIMEOUT
            self._target.request_status(now)
        self._identity_query.poll(now)
        self._change_holder(self._sources.poll(now), now)
        if now >= self._silence_due:
            limit = self._settings.off_after_silence
            reason = f'off_after_silence: no request for {format_seconds(limit)}'
            self._switching.cancel(reason, now, _is_on)
            self._switch_automatically(_AutomaticSwitch(False, reason, now))
        if self._automatic and now >= self._automatic_due:
            self._send_automatic(self._automatic, now)
        if self._last_off is not None and self.connected:
            self._last_off.poll(now)
        self._switching.poll(now)
        self._configuration.poll(now, connected=self.connected)
        self._check_refreshes(now)

    @property
    def _question_due(self) -> float:
        """
        Return the time at which the light is asked for a status, s.

        The light may have no heartbeat, and a status interval above the heartbeat timeout.
        """
        silent_since = max(self.heard_at, self._asked_at) if self.connected else math.inf
        return min(self._status_due, silent_since + self._longest_silence)

    def may_stay_on(self, now: float) -> bool:
        """Return whether the light is on, or may go on by an ON of ours that was sent."""
        return self._may_be_on or self._is_own(True, now)

    @property
    def _may_be_on(self) -> bool:
        # A light that sends no status may be on if it was switched on, and so may one of several
        # lights at the address, whose statuses may come at once. A try of an ON that has not ended
        # may still take effect.
        return bool(
            self._enabled or self._switching.has(_is_on) or self._last_switch[0] and (
                self._enabled is None or self._is_shared) or self._was_on and self._is_shared)

    @property
    def _silence_due(self) -> float:
        """Return the time at which the light is switched off after silence, s."""
        if (not self._settings.off_after_silence or not self._may_be_on or not self.connected
                or self._automatic and not self._automatic.on or self._commands.refusal):
            return math.inf
        return self._requested_at + self._settings.off_after_silence

    @property
    def _automatic_due(self) -> float:
        if self._automatic is None or not self.connected:
            return math.inf
        # An OFF overtakes requests. An ON waits for them outside the queue, so that a restart of
        # the light can cancel it.
        if not self._automatic.on:
            return self._automatic.due
        return math.inf if self._switching else max(self._automatic.due, self._earliest_on())

    def _send_automatic(self, switch: _AutomaticSwitch, now: float) -> None:
        def done(result: Result, now: float) -> None:
            if self._automatic is not switch:
                return
            if result.success:
                self._automatic = None
                return
            self._emit(events.AutomaticSwitch(
                self.address, switch.on, switch.reason, result.message))
            wait = configuration_manager.REPEAT_INTERVAL
            due = switch.limit.take(now) if switch.limit else now + wait
            if due is None:
                self._automatic = None
                self._emit(events.ChangedByOther(
                    self.address, 'off' if switch.on else 'on', undone=False))
            else:
                switch.due = due

        self._forget_silenced(now)
        if self._automatic is not switch:
            return
        switch.due = math.inf
        self._switch(switch.on, now, done, switch.reason)

    def next_deadline(self) -> float:
        """Return when :meth:`poll` has something to do."""
        due = min(self._question_due, self._identity_query.next_deadline(),
                  self._switching.next_deadline(),
                  self._configuration.next_deadline(connected=self.connected))
        if self.connected:
            due = min(due, self.heard_at + self._settings.heartbeat_timeout)
        # Called after each message, so only the deadlines in use are computed.
        if self._settings.off_after_silence:
            due = min(due, self._silence_due)
        if self._automatic:
            due = min(due, self._automatic_due)
        if self._refreshes:
            due = min(due, min(one.started for one in self._refreshes) + REFRESH_LIMIT)
        if self._sources.are_ranked:
            due = min(due, self._sources.next_deadline())
        if self._last_off is not None and self.connected:
            due = min(due, self._last_off.next_deadline())
        return due


def _is_on(request: Request[Status]) -> bool:
    return not request.overtakes


def _is_on_command(command: Command) -> bool:
    return (command.command == MavCmd.ILLUMINATOR_ON_OFF
            and command.params == SWITCHES[True].params)


def _is_off(request: Request[Status]) -> bool:
    return request.overtakes


@dataclass(eq=False)
class _Refresh:
    """
    A request for COMPONENT_INFORMATION_BASIC and ILLUMINATOR_STATUS.

    It succeeds when a status has come: not every light has an identity.

    :param outcomes: '' for a message that has come, else why it has not.
    """

    done: Done
    started: float
    outcomes: dict[str, str] = field(default_factory=dict)

    def has_ended(self, now: float) -> bool:
        return len(self.outcomes) == 2 or now >= self.started + REFRESH_LIMIT

    def result(self, now: float) -> Result:
        failures = [(name, self.outcomes.get(name, 'nothing came'))
                    for name in ('ILLUMINATOR_STATUS', 'COMPONENT_INFORMATION_BASIC')]
        parts = [f'{name}: {failure or "received"}' for name, failure in failures]
        return Result(not failures[0][1],
                      f'{", ".join(parts)} ({format_seconds(now - self.started)})')
