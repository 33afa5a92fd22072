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

"""A command sender with a clock that jumps and a target that a test controls."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
import heapq
import math
from typing import Any

from illuminator_ros.mavlink import command_sender
from illuminator_ros.mavlink.dialect import mavlink
from illuminator_ros.mavlink.messages import Address, CommandAck, CommandInt

OURS = Address(1, 193)
LIGHT = Address(1, 243)
# s from a frame to its acknowledgement.
DELAY = 0.02
# s after which every command has ended.
LONG = 60.0


@dataclass
class Run:
    """
    A command that was started: its frames, and its outcomes, of which there should be one.

    The number of the run in param7 identifies its frames.
    """

    command: command_sender.Command
    frames: list[tuple[float, Any]] = field(default_factory=list)
    outcomes: list[command_sender.CommandResult] = field(default_factory=list)
    ended_at: float = math.nan

    def __call__(self, outcome: command_sender.CommandResult, now: float) -> None:
        self.outcomes.append(outcome)
        self.ended_at = now

    @property
    def outcome(self) -> command_sender.CommandResult:
        """Return the outcome; an error unless there is exactly one."""
        (outcome,) = self.outcomes
        return outcome

    @property
    def status(self) -> command_sender.CommandStatus:
        """How it ended."""
        return self.outcome.status

    @property
    def result(self) -> int | None:
        """Return the MAV_RESULT that it ended with."""
        return self.outcome.result


class Rig:
    """
    A sender, and what it sends.

    :ivar now: s.
    :ivar frames: everything sent, with the time.
    :ivar answers: called with a message and how many went before it to the same target with the
        same command; returns the results to acknowledge it with, one after the other.
    """

    def __init__(self, *answers: Sequence[int], timeout: float = 0.5, retries: int = 3) -> None:
        self.now = 1000.0
        self.frames: list[tuple[float, Any]] = []
        self.sender = command_sender.CommandSender(OURS, timeout, retries)
        self.answers: Callable[[Any, int], Sequence[int]] = (
            lambda message, number: answers[number] if number < len(answers) else ())
        self.runs: list[Run] = []
        self._acks: list[tuple[float, int, Address, Any]] = []

    # Actions of the sender's owner

    def start(self, command: int = 405, target: Address = LIGHT, *,
              params: tuple[float, ...] | None = None, limit: float = math.inf,
              overtake: bool = False) -> Run:
        """Start a command; the limit is s from now. With params its frames are not identified."""
        number = len(self.runs) + 1.0
        run = Run(command_sender.Command(
            target, command, (0.0,) * 6 + (number,) if params is None else params))
        self.runs.append(run)
        self.sender.start(
            run.command, self.now, run, deadline=self.now + limit, overtake=overtake)
        self.flush()
        return run

    def ended(self, command: int = 405, **arguments: Any) -> Run:
        """Start a command and wait until it must have ended."""
        run = self.start(command, **arguments)
        self.run(LONG)
        return run

    def run(self, seconds: float) -> None:
        """Let time pass; acknowledge and poll when that is due."""
        end = self.now + seconds
        while (due := min(self.sender.next_deadline(), self._next_ack())) <= end:
            self.now = max(self.now, due)
            if self._next_ack() <= self.now:
                _, _, source, ack = heapq.heappop(self._acks)
                self.sender.acknowledge(source, ack, self.now)
            else:
                self.sender.poll(self.now)
            self.flush()
        self.now = end

    def poll(self) -> None:
        """Poll once, now."""
        self.sender.poll(self.now)
        self.flush()

    # Actions of the target

    def ack(self, result: int, command: int = 405, *, source: Address = LIGHT, progress: int = 0,
            target: Address = OURS, result_param2: int = 0) -> None:
        """Acknowledge a command at once."""
        self.sender.acknowledge(
            source, CommandAck(command, result, progress, 0, *target), self.now)
        self.flush()

    def flush(self) -> None:
        """Take the sent messages."""
        while self.sender.outgoing:
            self._send(self.sender.outgoing.popleft()[1])

    def _send(self, message: Any) -> None:
        key = Address(message.target_system, message.target_component), message.command
        number = sum(1 for _, sent in self.frames if key == (
            Address(sent.target_system, sent.target_component), sent.command))
        self.frames.append((self.now, message))
        number_of_run = int(message.z if isinstance(message, CommandInt) else message.param7)
        if 0 < number_of_run <= len(self.runs):
            self.runs[number_of_run - 1].frames.append((self.now, message))
        for place, result in enumerate(self.answers(message, number)):
            heapq.heappush(self._acks, (
                self.now + DELAY * (place + 1), len(self.frames) * 256 + place, key[0],
                CommandAck(message.command, result, 0, 0, *OURS)))

    def _next_ack(self) -> float:
        return self._acks[0][0] if self._acks else math.inf

    # Results

    @property
    def times(self) -> list[float]:
        """When frames were sent, s since the first."""
        return [round(time - self.frames[0][0], 6) for time, _ in self.frames]

    @property
    def messages(self) -> list[Any]:
        """Return the sent messages."""
        return [message for _, message in self.frames]

    @property
    def idle(self) -> bool:
        """Whether no command is in progress or waiting."""
        return self.sender.next_deadline() == math.inf


ACCEPTED = mavlink.MAV_RESULT_ACCEPTED
REJECTED = mavlink.MAV_RESULT_TEMPORARILY_REJECTED
DENIED = mavlink.MAV_RESULT_DENIED
FAILED = mavlink.MAV_RESULT_FAILED
IN_PROGRESS = mavlink.MAV_RESULT_IN_PROGRESS
