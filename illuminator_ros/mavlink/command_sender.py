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

"""
The sending side of the MAVLink command protocol; no I/O, and time is passed in.

https://mavlink.io/en/services/command.html: a command is resent, with ``confirmation`` counted
up, until it is acknowledged; MAV_RESULT_IN_PROGRESS lengthens the wait and ends the resending;
one command of a kind is under way to a component at a time, since an acknowledgement names
nothing but the command.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field
import math
from typing import Any

from .command import Command, CommandResult, CommandStatus, Done
from .messages import Address, CommandInt, CommandLong, MavResult
from .round_trip import RttEstimator

# Between two reports of progress. The specification leaves it open; MAVSDK also takes 3 s.
PROGRESS_TIMEOUT = 3.0
# Between tries of a command that was temporarily rejected: the first, doubling up to the last.
REJECTED_BACKOFF = (0.1, 0.8)
# Commands of one kind that may wait for one target. More are refused, so memory is bounded.
MAX_WAITING = 32


@dataclass(eq=False)
class _Entry:
    command: Command
    done: Done
    limit: float
    as_int: bool = False
    in_progress: bool = False
    tries: int = 0
    # Tries that were answered with a reason to try again: those are not lost frames.
    rejected: int = 0
    first_sent: float = 0.0
    last_sent: float = 0.0
    due: float = 0.0
    deadline: float = math.inf
    result: int | None = None
    progress: int | None = None


@dataclass
class CommandCounters:
    """Totals over all targets."""

    sent: int = 0
    resent: int = 0
    unanswered: int = 0
    unexpected_acks: int = 0


@dataclass
class CommandSender:
    """
    Sends commands to any number of components, in parallel across them.

    :param address: our own address, which acknowledgements are matched against.
    :param timeout: s, > 0: the longest wait for the acknowledgement of one try.
    :param retries: resends after the first try, >= 0.
    :ivar outgoing: messages to send, each with the address that sends it.
    :ivar unanswering: the targets whose last command went without any acknowledgement.
    :raises ValueError: if one of the two is out of its range.
    """

    address: Address
    timeout: float = 0.5
    retries: int = 3
    outgoing: deque[tuple[Address, Any]] = field(default_factory=deque)
    counters: CommandCounters = field(default_factory=CommandCounters)
    unanswering: set[Address] = field(default_factory=set)
    _active: dict[tuple[Address, int], _Entry] = field(default_factory=dict)
    _waiting: dict[tuple[Address, int], deque[_Entry]] = field(default_factory=dict)
    _round_trips: dict[Address, RttEstimator] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if not (math.isfinite(self.timeout) and self.timeout > 0):
            raise ValueError(f'timeout {self.timeout} s is not above 0')
        if self.retries < 0:
            raise ValueError(f'retries {self.retries} is below 0')

    def send(self, message: Any) -> None:
        """Send a message that is not a command from our address."""
        self.outgoing.append((self.address, message))

    def start(self, command: Command, now: float, done: Done, *, limit: float = math.inf) -> None:
        """
        Send a command, or put it behind the one of its kind that is under way.

        :param done: called once, with the outcome and the time.
        :param limit: the time by which it ends whatever happens, progress or not.
        """
        entry = _Entry(command, done, limit)
        if now >= limit:
            done(CommandResult(CommandStatus.OUT_OF_TIME), now)
        elif command.key in self._active:
            waiting = self._waiting.setdefault(command.key, deque())
            if len(waiting) >= MAX_WAITING:
                done(CommandResult(CommandStatus.REFUSED_LOCALLY), now)
            else:
                waiting.append(entry)
        else:
            self._begin(entry, now)

    def pending(self, target: Address, command: int) -> bool:
        """Return whether a command of this kind is under way."""
        return (target, command) in self._active

    def withdraw(self, command: Command, now: float) -> None:
        """End a command that is under way, if it is; one of its kind that waits goes out."""
        entry = self._active.get(command.key)
        if entry is not None and entry.command is command:
            self._end(entry, CommandStatus.CANCELLED, now)

    def round_trip(self, target: Address) -> RttEstimator:
        """Return the round-trip times of a target's acknowledgements."""
        return self._round_trips.setdefault(target, RttEstimator())

    def acknowledge(self, source: Address, ack: Any, now: float) -> None:
        """
        Take a COMMAND_ACK.

        It counts where source and command match what is under way and it is addressed to us or,
        as the extension fields may be missing, to nobody (target 0).
        """
        ours = self.address
        entry = self._active.get((source, ack.command))
        if (ack.target_system not in (0, ours.system)
                or ack.target_component not in (0, ours.component)):
            return
        self.unanswering.discard(source)
        if entry is None:
            self.counters.unexpected_acks += 1
            return
        if self._answers_another_try(entry, ack.result):
            return
        if entry.tries == 1 and entry.result is None:
            # An acknowledgement after a resend may be that of either try: no measure (RFC 6298).
            self.round_trip(source).add(now - entry.last_sent)
        entry.result = ack.result
        if ack.result == MavResult.IN_PROGRESS:
            entry.in_progress = True
            entry.progress = ack.progress if ack.progress <= 100 else None
            entry.due = now + PROGRESS_TIMEOUT
        elif ack.result == MavResult.TEMPORARILY_REJECTED:
            first, last = REJECTED_BACKOFF
            entry.due = now + min(first * 2 ** min(entry.rejected, 8), last)
            entry.rejected += 1
            if entry.due >= min(entry.deadline, entry.limit):
                # A try that was never answered may be what keeps the target busy.
                self._end(entry, CommandStatus.ANSWERED if entry.rejected == entry.tries
                          else CommandStatus.OUT_OF_TIME, now)
        elif (ack.result == MavResult.COMMAND_INT_ONLY and not entry.in_progress
                and now < entry.limit):
            entry.as_int = True
            entry.rejected += 1
            self._transmit(entry, now)
        else:
            self._end(entry, CommandStatus.ANSWERED, now, ack.result_param2)

    def _answers_another_try(self, entry: _Entry, result: int) -> bool:
        """
        Return whether an acknowledgement is for a try that does not matter any more.

        A try that meets an earlier one at work, or its own copy, is rejected for that. And a
        COMMAND_LONG may be refused once more after the COMMAND_INT has gone out.
        """
        if result == MavResult.COMMAND_INT_ONLY:
            return entry.as_int
        if result == MavResult.TEMPORARILY_REJECTED:
            return entry.in_progress or entry.rejected == entry.tries
        return False

    def poll(self, now: float) -> None:
        """Resend or end what is due."""
        for entry in list(self._active.values()):
            if self._active.get(entry.command.key) is not entry:
                continue
            if now >= entry.limit:
                self._end(entry, CommandStatus.OUT_OF_TIME if entry.in_progress or entry.rejected
                          else CommandStatus.NO_ANSWER, now)
            elif now >= entry.due:
                self._overdue(entry, now)
        for waiting in list(self._waiting.values()):
            for entry in [entry for entry in waiting if now >= entry.limit]:
                self._end(entry, CommandStatus.OUT_OF_TIME, now)

    def _overdue(self, entry: _Entry, now: float) -> None:
        if entry.in_progress:
            self._end(entry, CommandStatus.PROGRESS_STOPPED, now)
        elif entry.tries - entry.rejected > self.retries or now >= entry.deadline:
            self._end(entry, CommandStatus.NO_ANSWER, now)
        else:
            self._transmit(entry, now)

    def next_deadline(self) -> float:
        """Return when :meth:`poll` has something to do, infinity if never."""
        times = [min(entry.due, entry.limit) for entry in self._active.values()]
        times += [entry.limit for waiting in self._waiting.values() for entry in waiting]
        return min(times, default=math.inf)

    def end_all(self, now: float, ending: CommandStatus, target: Address | None = None) -> None:
        """End what is under way or waiting, to one target or to all."""
        for queue in [*self._waiting.values(), deque(self._active.values())]:
            for entry in list(queue):
                if target is None or entry.command.target == target:
                    self._end(entry, ending, now)

    def _begin(self, entry: _Entry, now: float) -> None:
        self._active[entry.command.key] = entry
        entry.first_sent = now
        entry.deadline = now + self.timeout * (self.retries + 1)
        self._transmit(entry, now)

    def _transmit(self, entry: _Entry, now: float) -> None:
        entry.tries += 1
        self.counters.sent += 1
        self.counters.resent += entry.tries > 1
        entry.last_sent = now
        lost = entry.tries - entry.rejected - 1
        timeout = self.round_trip(entry.command.target).timeout(self.timeout)
        entry.due = now + min(timeout * 2 ** min(max(lost, 0), 16), self.timeout)
        self.send(_message(entry))

    def _end(
        self, entry: _Entry, ending: CommandStatus, now: float, result_param2: int = 0,
    ) -> None:
        key = entry.command.key
        waiting = self._waiting.get(key)
        if self._active.get(key) is not entry:
            if waiting is None or entry not in waiting:
                return
            waiting.remove(entry)
            if not waiting:
                del self._waiting[key]
            entry.done(CommandResult(ending), now)
            return
        del self._active[key]
        late = []
        while waiting and key not in self._active:
            following = waiting.popleft()
            if now < following.limit:
                self._begin(following, now)
            else:
                late.append(following)
        if not waiting:
            self._waiting.pop(key, None)
        if ending is CommandStatus.NO_ANSWER:
            self.counters.unanswered += 1
            self.unanswering.add(entry.command.target)
        entry.done(CommandResult(
            ending, entry.result, entry.tries, now - entry.first_sent, entry.progress,
            result_param2), now)
        for other in late:
            other.done(CommandResult(CommandStatus.OUT_OF_TIME), now)


def _message(entry: _Entry) -> Any:
    """Return the next try as COMMAND_LONG or, where the target wants it, COMMAND_INT."""
    command = entry.command
    params = [*command.params, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0][:7]
    target = command.target
    if entry.as_int:
        # MAV_FRAME_GLOBAL (0): none of these commands has a position.
        return CommandInt(
            target.system, target.component, 0, command.command, 0, 0, params[0], params[1],
            params[2], params[3], int(params[4]), int(params[5]), params[6])
    return CommandLong(
        target.system, target.component, command.command, min(entry.tries - 1, 255), *params)
