# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The messages that are requested of one light: its status and its identity."""

from __future__ import annotations

from collections.abc import Callable
import functools
import math

from .messages import IlluminatorStatus, STATUS_ID
from .serial_numbers import SerialNumbers
from ..mavlink.command_sender import Command, CommandResult, CommandStatus, request_message
from ..mavlink.dialect import mavlink
from ..mavlink.durations import format_seconds
from ..mavlink.messages import ComponentInformationBasic
from ..mavlink.retries import Retries, RetryPolicy
from ..payload.attempt import Target
from ..payload.identity import Identity
from ..payload.liveness import Liveness
from ..payload.requests import Done, Result

MESSAGE = RetryPolicy('a message that a light acknowledges or refuses, and does not send',
                      0.5, 0.5, 3)
# s without a status after which the light is asked for one, and between the requests.
STATUS_TIMEOUT = 2.5
# s from the first request until the identity counts as unknown.
SETTLING_TIME = 2.0
STATUS_NAME, IDENTITY_NAME = IlluminatorStatus.msgname, ComponentInformationBasic.msgname


class MessageQuery:
    """
    Requests one message until it has come, or the light does not send it. Times are s.

    A COMMAND_ACK of MAV_CMD_REQUEST_MESSAGE does not name the message: it may answer a request for
    another one, such as each try of a change carries. So no refusal ends the requests; the last
    one explains why the message has not come.

    :ivar first_asked: the time of the first request, infinity before it.
    :ivar failure: why the light did not send the message, '' if it did or an answer is awaited.
    :ivar is_awaited: whether the message has been asked for and has not come yet.
    :ivar retries: of the requests; the next is due a while after an acknowledgement.
    """

    def __init__(self, target: Target, message_id: int) -> None:
        self.first_asked = math.inf
        self.failure = ''
        self.is_awaited = False
        self.retries = Retries(MESSAGE, math.inf)
        self._target = target
        # Why the last request was refused, '' if it was accepted.
        self._refusal = ''
        self._request = request_message(target.address, message_id)
        self._waiting: list[Callable[[str, float], None]] = []

    def ask(self, now: float, done: Callable[[str, float], None] | None = None) -> None:
        """Ask; ``done`` is called with '' once the message has come, else with the failure."""
        if done is not None:
            self._waiting.append(done)
        if not self.is_awaited:
            self.ask_again(now)

    def ask_again(self, now: float) -> None:
        """Ask at once, though an answer may still be awaited."""
        self.is_awaited, self.retries = True, Retries(MESSAGE)
        self.first_asked = min(self.first_asked, now)
        self._send(now)

    def _send(self, now: float) -> None:
        self.retries.stop()
        self._target.commands.start(self._request, now, self._answered)

    def _answered(self, result: CommandResult, now: float) -> None:
        # A newer request has replaced a cancelled one.
        if not self.is_awaited or result.status is CommandStatus.CANCELLED:
            return
        is_answered = result.status is CommandStatus.ANSWERED
        if is_answered and result.result != mavlink.MAV_RESULT_TEMPORARILY_REJECTED:
            self._refusal = '' if result.accepted else result.describe_failure()
            self.retries.note_try(now)
            self._target.wake(self.retries.due)
        else:
            # It was sent as often as a command may be.
            self.finish(result.describe_failure(), now)

    def finish(self, failure: str, now: float) -> None:
        """End the requests: the message has come, or will not come for the reason given."""
        self.is_awaited, self.failure = False, failure
        self.retries.stop()
        waiting, self._waiting = self._waiting, []
        for done in waiting:
            done(failure, now)

    def poll(self, now: float) -> None:
        """Ask again for a message that does not come, or give up."""
        if now < self.retries.due:
            return
        if self.retries.is_spent:
            self.finish(self._refusal or 'acknowledged, but not sent', now)
        else:
            self._send(now)


class LightQueries:
    """
    Requests what a light does not send by itself. No I/O; times are s.

    :param liveness: of the light.
    :param interval: s between the statuses that the light is asked for; 0 for its own.
    :param heartbeat_timeout: s of silence after which the light is lost.
    :ivar identity: None before the light has sent it.
    :ivar serials: those that its address has sent lately.
    """

    def __init__(
        self, target: Target, liveness: Liveness, interval: float, heartbeat_timeout: float,
    ) -> None:
        self.identity: Identity | None = None
        self.serials = SerialNumbers()
        self._target = target
        self._liveness = liveness
        self._interval = interval
        self._timeout = max(STATUS_TIMEOUT, 2.5 * interval)
        # s of silence after which the light is asked for a status, so that its answer arrives
        # within the heartbeat timeout.
        self._longest_silence = min(STATUS_TIMEOUT, heartbeat_timeout / 1.2)
        self._is_announced = False
        self._asked_at = -math.inf
        self._due = math.inf
        self._status = MessageQuery(target, STATUS_ID)
        self._identity = MessageQuery(target, ComponentInformationBasic.id)

    def begin(self, now: float) -> None:
        """
        Request the status: the light is heard, or has restarted.

        One that is announced is also asked for interval and identity: the address of a candidate
        may be forged, and costs few commands.
        """
        if self._is_announced:
            self._request_interval_and_identity(now)
        self._due = now + STATUS_TIMEOUT
        # A request that was sent to the silent light would be resent only later.
        self._status.ask_again(now)

    def announce(self, now: float, *, is_heard: bool) -> None:
        """Note that the light has proved that it is one."""
        self._is_announced = True
        if is_heard:
            self._request_interval_and_identity(now)

    def _request_interval_and_identity(self, now: float) -> None:
        if self._interval > 0:
            self._target.commands.start(Command(
                self._target.address, mavlink.MAV_CMD_SET_MESSAGE_INTERVAL,
                (float(STATUS_ID), self._interval * 1e6)), now)
        self._identity.ask(now)

    def request_status(self, now: float) -> None:
        """Request a status, unless such a request is under way."""
        self._status.ask(now)

    def end(self) -> None:
        """Request no status: the light is lost."""
        self._due = math.inf
        self.serials.clear()

    def close(self, reason: str, now: float) -> None:
        """Answer all who wait for a message."""
        self._status.finish(reason, now)
        self._identity.finish(reason, now)

    def receive_status(self, now: float) -> None:
        """Note that a status has come."""
        self._due = now + self._timeout
        if self._status.is_awaited:
            self._status.finish('', now)

    def receive_identity(self, identity: Identity, now: float) -> None:
        """Take the identity."""
        self.identity = identity
        self.serials.note(identity.serial_number, now)
        self._target.wake(self.serials.due)
        self._identity.finish('', now)

    def identity_is_settled(self, now: float) -> bool:
        """Return whether the identity is known, or will not be known soon."""
        query = self._identity
        return (self.identity is not None or bool(query.failure)
                or now >= query.first_asked + SETTLING_TIME)

    def refresh(self, now: float, done: Done) -> None:
        """
        Request status and identity; ``done`` is called once with the result.

        It is a success when a status has come: not every light has an identity.
        """
        queries = {STATUS_NAME: self._status, IDENTITY_NAME: self._identity}
        outcomes: dict[str, str] = {}

        def answered(name: str, failure: str, at: float) -> None:
            outcomes[name] = failure
            if len(outcomes) == len(queries):
                parts = [f'{one}: {outcomes[one] or "received"}' for one in queries]
                refusal = self._target.commands.refusal
                done(Result(not (refusal or outcomes[STATUS_NAME]), refusal or (
                    f'{", ".join(parts)} ({format_seconds(at - now)})')), at)

        for name, query in queries.items():
            query.ask(now, functools.partial(answered, name))

    def poll(self, now: float) -> None:
        """Request what is due."""
        if now >= self._status_due:
            self._asked_at, self._due = now, now + STATUS_TIMEOUT
            self._status.ask(now)
        if self.serials.is_due(now):
            self._identity.ask(now)
        self._status.poll(now)
        self._identity.poll(now)

    @property
    def _status_due(self) -> float:
        # The light may have no heartbeat, and a status interval above the heartbeat timeout.
        heard_at = self._liveness.heard_at if self._liveness.connected else math.inf
        return min(self._due, max(heard_at, self._asked_at) + self._longest_silence)

    @property
    def due(self) -> float:
        """Return when :meth:`poll` has something to do, s."""
        return min(self._status_due, self._status.retries.due, self._identity.retries.due,
                   self.serials.due)
