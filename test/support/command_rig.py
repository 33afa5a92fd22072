# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""A command sender with a clock that jumps, and a target whose answers a test sets."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
import heapq
import math
from typing import Any

from illuminator_ros.mavlink import command_sender
from illuminator_ros.mavlink.messages import Address, CommandAck, CommandInt

OURS = Address(1, 193)
LIGHT = Address(1, 243)
# s from a frame to its first answer, and between its answers.
DELAY = 0.02
# s after which every command has ended.
LONG = 60.0


@dataclass
class Run:
    """
    A command that was started: its frames, and its outcomes, of which there should be one.

    The number of the run in param7 identifies its frames.
    """

    sending: command_sender.Transmission = field(init=False)
    frames: list[tuple[float, Any]] = field(default_factory=list)
    outcomes: list[command_sender.CommandResult] = field(default_factory=list)

    @property
    def outcome(self) -> command_sender.CommandResult:
        """Return the outcome; an error unless there is exactly one."""
        (outcome,) = self.outcomes
        return outcome


class Rig:
    """
    A sender, and what it sends.

    :param answers: the results that acknowledge each frame, one after the other.
    :ivar now: s.
    :ivar frames: everything sent, with the time.
    """

    def __init__(self, *answers: Sequence[int], timeout: float = 0.25, retries: int = 3,
                 clock_fault: Callable[[], str] = str) -> None:
        self.now = 1000.0
        self.frames: list[tuple[float, Any]] = []
        self.sender = command_sender.CommandSender(OURS, timeout, retries, clock_fault)
        self.runs: list[Run] = []
        self._answers = iter(answers)
        self._acks: list[tuple[float, int, int]] = []

    def start(self, command: int = 405, target: Address = LIGHT, *, param1: float = 0.0,
              limit: float = math.inf, **options: Any) -> Run:
        """Start a command; the limit is s from now."""
        run = Run()
        self.runs.append(run)
        run.sending = self.sender.start(
            command_sender.Command(target, command, (param1, *(0.0,) * 5, float(len(self.runs)))),
            self.now, lambda result, now: run.outcomes.append(result),
            deadline=self.now + limit, **options)
        self.flush()
        return run

    def ack(self, result: int, command: int = 405, *, source: Address = LIGHT, progress: int = 0,
            target: Address = OURS) -> None:
        """Acknowledge a command at once."""
        self.sender.acknowledge(
            source, CommandAck(command, result, progress, 0, *target), self.now)
        self.flush()

    def run(self, seconds: float = LONG) -> None:
        """Let time pass; answer and poll when that is due."""
        end = self.now + seconds
        while (due := min(self.sender.next_deadline(), self._next_ack())) <= end:
            self.now = max(self.now, due)
            if self._next_ack() <= self.now:
                _, result, command = heapq.heappop(self._acks)
                self.ack(result, command)
            else:
                self.poll()
        self.now = end

    def poll(self) -> None:
        """Poll once, now."""
        self.sender.poll(self.now)
        self.flush()

    def flush(self) -> None:
        """Take the sent messages."""
        while self.sender.outgoing:
            message: Any = self.sender.outgoing.popleft()[1]
            for place, result in enumerate(next(self._answers, ())):
                heapq.heappush(self._acks, (
                    self.now + DELAY * (place + 1), result, message.command))
            self.frames.append((self.now, message))
            number = int(message.z if isinstance(message, CommandInt) else message.param7)
            if 0 < number <= len(self.runs):
                self.runs[number - 1].frames.append((self.now, message))

    def _next_ack(self) -> float:
        return self._acks[0][0] if self._acks else math.inf

    @property
    def times(self) -> list[float]:
        """When frames were sent, s since the first."""
        return [round(time - self.frames[0][0], 6) for time, _ in self.frames]
