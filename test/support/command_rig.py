# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""A command sender with a clock that jumps, and a target whose answers a test sets."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
import functools
import math
from typing import Any

from illuminator_ros.mavlink import command_sender
from illuminator_ros.mavlink.messages import Address, CommandAck, CommandInt
from support.bench import Bench

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


class Rig(Bench):
    """
    A sender, and a target.

    :param answers: the results that acknowledge each frame, one after the other.
    """

    def __init__(self, *answers: Sequence[int], timeout: float = 0.25, retries: int = 3,
                 clock_fault: Callable[[], str] = str) -> None:
        self.sender = command_sender.CommandSender(OURS, timeout, retries, clock_fault)
        super().__init__(self.sender, 1000.0)
        self.runs: list[Run] = []
        self._answers = iter(answers)

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

    def answer(self, source: Address, message: Any) -> None:
        """See :class:`Bench`."""
        for place, result in enumerate(next(self._answers, ())):
            self.later(DELAY * (place + 1), functools.partial(self.ack, result, message.command))
        number = int(message.z if isinstance(message, CommandInt) else message.param7)
        if 0 < number <= len(self.runs):
            self.runs[number - 1].frames.append((self.now, message))

    @property
    def times(self) -> list[float]:
        """When frames were sent, s since the first."""
        return [round(time - self.sent[0][0], 6) for time, _ in self.sent]
