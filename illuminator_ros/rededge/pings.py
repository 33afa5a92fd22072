# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The round trip through the camera: PING and its replies."""

from __future__ import annotations

from collections.abc import Callable
import math
from typing import NamedTuple

from . import messages as rededge
from ..mavlink.command_sender import CommandSender
from ..mavlink.messages import target_of
from ..mavlink.retries import RetryPolicy

PING = RetryPolicy('a PING that a service call asks for', 1.0, 1.0, 2)
# s between PINGs.
PING_INTERVAL = 2.0

# Takes success and a message for people, once.
PingDone = Callable[[bool, str], None]


class _Request(NamedTuple):
    since: float
    done: PingDone

    @property
    def until(self) -> float:
        return self.since + PING.tries * PING.first


class Pings:
    """
    Sends a PING at an interval, and on request, from the first :meth:`poll` until :meth:`stop`.

    :param commands: of this component.
    :param sequence: the sequence number before the first PING.
    :ivar round_trip: of the last answered PING, s; None if no PING was answered.
    :ivar unanswered: PINGs without a reply since the last reply.
    """

    def __init__(
        self, commands: CommandSender, sequence: int,
    ) -> None:
        self.round_trip: float | None = None
        self.unanswered = 0
        self._commands = commands
        self._sequence = sequence
        # When each unanswered PING was sent, by sequence number, s.
        self._sent: dict[int, float] = {}
        self._due = -math.inf
        self._requests: list[_Request] = []

    def stop(self, reason: str) -> None:
        """End all requests, since the link is closed; the next :meth:`poll` sends a PING."""
        self._due = -math.inf
        self._sent.clear()
        self.end(reason)
        self._commands.schedule.at(self.poll, math.inf)

    def end(self, reason: str) -> None:
        """End all requests."""
        requests, self._requests = self._requests, []
        for request in requests:
            request.done(False, reason)

    def request(self, now: float, done: PingDone) -> None:
        """Measure the round trip."""
        self._requests.append(_Request(now, done))
        self._ping(now)
        self._set_due()

    def _ping(self, now: float) -> None:
        self._due = now + (PING.first if self._requests else PING_INTERVAL)
        self._sequence = (self._sequence + 1) & 0xFFFFFFFF
        self._sent[self._sequence] = now
        self._commands.send(rededge.Ping(int(now * 1e6), self._sequence, 0, 0))

    def receive(self, message: rededge.Ping, now: float) -> None:
        """Take a PING of the camera, which is a reply if its target is our address."""
        if target_of(message) != self._commands.address:
            return
        sent_at = self._sent.pop(message.seq, None)
        if sent_at is None:
            return
        self.round_trip = now - sent_at
        self.unanswered = 0
        answered = [one for one in self._requests if one.since <= sent_at]
        self._requests = [one for one in self._requests if one.since > sent_at]
        for request in answered:
            request.done(True, f'{self.round_trip * 1000:.1f} ms round trip')

    def poll(self, now: float) -> None:
        """Send what is due, and end what is over."""
        for sequence, sent_at in list(self._sent.items()):
            if now >= sent_at + PING.first:
                del self._sent[sequence]
                self.unanswered += 1
        for request in [one for one in self._requests if now >= one.until]:
            self._requests.remove(request)
            request.done(False, f'no reply to {PING.tries} PINGs')
        if now >= self._due:
            self._ping(now)
        self._set_due()

    def _set_due(self) -> None:
        self._commands.schedule.at(self.poll, min(
            self._due, min(self._sent.values(), default=math.inf) + PING.first,
            min((one.until for one in self._requests), default=math.inf)))
