# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

r"""
One light, and how a request to it becomes a frame and an answer.

Three parts hold the state, and one function lies between them::

    put, end, expire  ->  Requests \
                                    decide -> Goal -> Property.steer -> Attempt -> frames
    status            ->  Twin     /                       |
    acknowledgement, status, deadline ---------------------+-> Requests.end -> replies, events

**Wanted.** A service call, a message of a topic and a rule each become a :class:`Request` in
:class:`Requests`; nothing else in this package holds a value that is wanted. A request is open
until a status shows its values, the light refuses them, or another request ends it. Two tables
say which requests a new one ends and which are sent until a status shows them. A call leaves the
table with its answer. A message of a topic stays as the wish of its source: it is closed once a
status has shown it, so that a change by another sender is followed and not undone, and opened
again when the light is handed over to its source.

**Shown.** :class:`Twin` has the newest status and the configuration that was agreed. A status
that is late is dropped before it. It tells a change of ours from one of another sender by the
commands that were sent lately.

**Decided.** :func:`decide` ranks the open requests and returns at most two goals: the switch, and
one configuration that carries all four fields. It sends nothing and keeps nothing.
:meth:`LightControl.step` runs after each request, status and deadline: it puts the rules that are
due, decides, and steers both properties. A second run changes nothing.

**Sent and answered.** :class:`Property` has at most one :class:`Attempt` under way. A goal with
other values replaces it at once, but a setpoint or a rule waits for a configuration that is under
way. The attempt sends the command with a request for the status, and ends each request that it
serves as soon as a status that came after an acknowledgement, or after the last try, shows the
values of that request. After a restart it sends the command again and counts no status for 1.5 s.
A parameter set, which ends 0.85 s after it was made, is then confirmed by an acknowledgement and a
status that shows its values though the first one did not; if it fails, the configuration that was
agreed is restored. Without ``restore_configuration`` a new command carries the other fields as the
light has them. A request that was made after the attempt began waits for the next attempt: nothing
that was sent before proves it. An OFF that a rule insists on may never end, so an OFF call beside
it fails after 4 s. Replies are called when the step has ended, so a reply may make the next
request.

**Not solved well.** COMMAND_ACK does not name the try that it answers. After a command that ended
unconfirmed, and after a restart, older frames may still come for 1.5 s, the fence, in which
nothing proves a command. A set has no time for that: a status that it alone can have caused proves
it, and so does one after an acknowledgement if all frames under way set equal values. A line with
a round trip above 250 ms meets a further fence at each call within 1.5 s, since the
acknowledgements there do not show that no frame is under way. A copy of a frame that a network
delivers after more than 1.5 s can confirm a command that was lost. Within the fence two sets that
share a command succeed only together. For a light whose brightness is its switch, an OFF ends each
configuration under way, since no status shows which of both comes last.
"""

from __future__ import annotations

from collections.abc import Callable
import math

from . import events
from .decide import CONFIGURE_LIMIT, describe
from .light_control import LightControl
from .light_queries import LightQueries, STATUS_NAME
from .messages import STATUS_ID
from .model import Changes, Status
from .rules import Rules
from .settings import LightSettings
from .status_order import Order
from .twin import Twin
from .user_requests import UserRequests
from ..mavlink.command_sender import CommandSender
from ..mavlink.messages import Address
from ..payload.attempt import Target
from ..payload.command_sources import DEFAULT
from ..payload.device_events import DeviceConnected, DeviceDisconnected, DeviceHeld
from ..payload.identity import Identity
from ..payload.liveness import Liveness
from ..payload.requests import Done, Request, Requests, Result, Why


class Light:
    """
    One component that is an illuminator. No I/O; times are s.

    :param emit: takes the events.
    :ivar liveness: whether it is heard.
    :ivar twin: what it shows.
    :ivar users: what its users ask for.
    """

    def __init__(
        self, address: Address, commands: CommandSender, settings: LightSettings,
        emit: Callable[[events.LightEvent], None],
    ) -> None:
        self.address = address
        self.liveness = Liveness(settings.heartbeat_timeout)
        self._commands = commands
        self._emit = emit
        target = Target(address, commands, 'light', self.poll, STATUS_ID, STATUS_NAME)
        self.twin = twin = Twin(target, emit)
        self._requests = requests = Requests(
            f'light {address}', settings.sources, describe,
            lambda change, now: emit(DeviceHeld(address, change)))
        self._rules = rules = Rules(target, requests, twin, settings, emit)
        self._control = LightControl(target, requests, twin, rules, emit)
        self.users = UserRequests(
            target, self.liveness, requests, twin, rules, self._control.switch, emit)
        self._queries = LightQueries(
            target, self.liveness, settings.status_interval, settings.heartbeat_timeout)
        # Whether a status without news changes nothing.
        self._is_settled = False

    def change_settings(self, settings: LightSettings, now: float) -> None:
        """
        Take other settings.

        Only ``limits``, ``off_after_silence`` and the time-out of ``sources`` may differ. The
        silence begins again if ``off_after_silence`` differs. The next poll sends what they
        demand: an atomic set that fails takes them back before.
        """
        rules = self._rules
        if rules.change_settings(settings, now):
            self._control.cancel_configuration(now)
            rules.keep_limits(now, is_busy=self._control.configuration.is_busy)
        if settings.sources:
            self._requests.claims.set_lease(settings.sources.timeout)
        self._commands.schedule.by(self.poll, -math.inf)

    # Reception

    def heard(self, now: float) -> None:
        """Receive a heartbeat, or a status, which shows that the light is alive."""
        if self.liveness.hear(now):
            self._queries.begin(now)
            self._emit(DeviceConnected(self.address))
            self._rules.begin_again(now)
            self._step(now)

    def announce(self, now: float) -> None:
        """Note that it has proved to be a light."""
        self._queries.announce(now, is_heard=self.connected)

    def receive_status(self, status: Status, now: float) -> None:
        """Receive an ILLUMINATOR_STATUS; a late status is ignored."""
        self.heard(now)
        twin, control = self.twin, self._control
        has_news = not (self._is_settled and status.repeats(twin.status))
        order = twin.order.add(status, now, control.expects)
        if order is Order.LATE:
            return
        if order is Order.RESTARTED:
            # Lights that share an address seem to restart at each status.
            if not self._queries.serials.shared(now):
                self._emit(events.LightRestarted(self.address, twin.enabled, status.enabled))
            self._queries.begin(now)
            control.restarted(status, now)
        elif has_news:
            if twin.changing.add(status, now, is_commanded=control.may_cause(now)):
                self._emit(events.StatesChanging(self.address, True))
            control.reported(status, now)
        self._queries.receive_status(now)
        if has_news or order is Order.RESTARTED:
            self._step(now)
            self._is_settled = control.is_settled(now)
        # Last, so that a caller has its answer before topics show the change.
        self._emit(events.StatusReceived(self.address, status, now, twin.temperature))

    def receive_identity(self, identity: Identity, now: float) -> None:
        """Receive a COMPONENT_INFORMATION_BASIC."""
        self._queries.receive_identity(identity, now)
        if not self._queries.serials.shared(now):
            self._emit(events.LightIdentified(self.address, identity))

    def lose(self, reason: str, now: float) -> None:
        """Note that the light is not heard any more."""
        if self.liveness.lose(now):
            self.twin.order.lost()
            self.twin.changing.reset()
            self._queries.end()
            self._emit(DeviceDisconnected(self.address, reason))
            text = self.unreachable(now)
            self._requests.end_all(Result(False, text), now)
            self._control.cancel(text, now)
            self._step(now)

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
        return self.users.were_made

    def unreachable(self, now: float) -> str:
        """Return why requests cannot reach the light, for people; '' if they can."""
        return '' if self.connected else self.liveness.loss(f'light {self.address}', now)

    def is_held_by_other(self, source: str) -> bool:
        """Return whether another source holds the light, so that a request is not sent."""
        return bool(self._requests.refusal(source))

    def may_be_on(self, now: float) -> bool:
        """Return whether the light is on, or may go on by a command of ours that was sent."""
        return self._control.may_be_on(now)

    def snapshot(self, now: float) -> events.LightSnapshot:
        """Return the state, for any thread."""
        twin, queries, rules, order = self.twin, self._queries, self._rules, self.twin.order
        return events.LightSnapshot(
            self.address, self.connected, self.liveness.heard_at, order.newest, order.newest_at,
            rules.settings.status_interval, order.restarts, twin.temperature, twin.agreed,
            rules.failure or twin.failure.text, rules.limits.exceeded, queries.identity,
            queries.identity_is_settled(now), twin.changing.are_changing,
            self.unreachable(now), self._requests.shown_holder, self._requests.claims.since,
            self._control.silence_due(now), queries.serials.shared(now))

    # Requests

    def refresh(self, now: float, done: Done) -> None:
        """Ask for identity and status again; ``done`` is called once with the result."""
        closed = self._commands.refusal
        if refusal := closed or self.unreachable(now):
            done(Result(False, refusal, superseded=bool(closed)), now)
        else:
            self._queries.refresh(now, done)

    def request_status(self, now: float) -> None:
        """Ask for a status, unless such a request is under way."""
        self._queries.request_status(now)

    def enable(
        self, on: bool, now: float, done: Done, *, detail: str = '', source: str = DEFAULT,
        is_call: bool = True,
    ) -> None:
        """
        Switch the light on or off; ``done`` is called once with the result.

        While a higher source holds the light, a request is not sent. A message of a topic
        is then remembered, and a call is refused and leaves nothing behind.

        :param detail: how it was requested, for :class:`LightSwitched`.
        :param is_call: whether a caller waits for the result; else it is a message of a topic,
            which its publisher repeats: a newer one replaces it.
        """
        self._make(Request({'enabled': on}, Why.REQUEST, now, source, done,
                           is_call=is_call, detail=detail), now)

    def configure(self, changes: Changes, now: float, done: Done) -> None:
        """
        Change some fields with one command; ``done`` is called once with the result.

        The request is one of the source :data:`~..payload.command_sources.DEFAULT`.

        :param changes: values by name, see :data:`~.model.FIELDS`; if one is wrong none is sent.
        """
        self._make(Request({**changes}, Why.REQUEST, now, DEFAULT, done, is_call=True,
                           deadline=now + CONFIGURE_LIMIT), now)

    def set_brightness(
        self, brightness: float, now: float, *, source: str = DEFAULT,
    ) -> None:
        """
        Take a setpoint of a stream: the newest wins, and one command is under way at a time.

        :param brightness: %, checked.
        """
        def failed(result: Result, now: float) -> None:
            # While another source holds the light, a setpoint is remembered.
            if not (result.success or result.superseded or self.is_held_by_other(source)):
                self._emit(events.SetpointFailed(self.address, result.message))

        limits = self._rules.settings.limits
        if excess := limits.excess_of({'brightness': brightness}):
            brightness = limits.max_brightness
            self._emit(events.SetpointClipped(self.address, excess))
        self._make(Request({'brightness': brightness}, Why.REQUEST, now, source, failed), now)

    def _make(self, new: Request, now: float) -> None:
        if closed := self._commands.refusal:
            new.done(Result(False, closed, superseded=True), now)
            return
        self.users.make(new, now)
        self._step(now)

    def require(self, values: Changes, now: float) -> None:
        """
        Send values once the light has reported its configuration.

        :param values: by name, checked, except against the limits that the light reports.
        """
        if values:
            self._rules.require(values, now)
        self._step(now)

    def release(self, source: str, now: float) -> str:
        """
        Release the light: the next lower source that has claimed it then holds it.

        :return: the source that holds it now, '' if none does.
        """
        self.users.release(source, now)
        self._step(now)
        return self._requests.shown_holder or ''

    # The end of the process

    def close(self, now: float) -> None:
        """Answer all requests, and make no change any more but :meth:`switch_off_finally`."""
        refusal = self._commands.refusal
        self._queries.close(refusal, now)
        self._requests.close(Result(False, refusal, superseded=True), now)
        self._rules.finish()
        self._control.cancel(refusal, now)
        self._step(now)

    def switch_off_finally(self, now: float, report: Done) -> None:
        """
        Switch the light off, and again whenever it may be on, after :meth:`close`.

        :param report: called with a failure that is not permanent when the first OFF is sent and
            when one has failed, and with a success when the light shows it. The failure of a light
            without an open link is permanent.
        """
        self._control.switch_off_finally(now, report)
        if unreachable := self.unreachable(now):
            self.users.send_unheard_off()
            report(Result(False, unreachable, permanent=bool(self.liveness.link_failure)), now)
        self._step(now)

    # Time

    def _step(self, now: float) -> None:
        """Send what is wanted now, and answer those whose requests have ended."""
        self._is_settled = False
        self.users.expire(now)
        if self.connected:
            self._control.step(now)
        self._requests.send_replies(now)
        self._commands.schedule.at(self.poll, min(
            self._control.due(now) if self.connected else math.inf,
            self._requests.next_due(now), self._queries.due,
            self.twin.changing.until, self.liveness.silent_at))

    def poll(self, now: float) -> None:
        """Do what is due."""
        if now >= self.liveness.silent_at:
            self.lose(self.liveness.silence(now), now)
        if now >= self.twin.changing.until:
            self.twin.changing.reset()
            self._emit(events.StatesChanging(self.address, False))
        self._queries.poll(now)
        self._control.poll(now)
        self._step(now)
