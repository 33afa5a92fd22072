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

"""What those are told who use a light: its observer, and whoever asks for something."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
import math
from typing import Any

from illuminator_ros.illuminator.identity import Identity
from illuminator_ros.illuminator.light import Light
from illuminator_ros.illuminator.model import Configuration, Status
from illuminator_ros.illuminator.observer import Cause, LightObserver
from illuminator_ros.illuminator.operation import Result


@dataclass
class Recorder(LightObserver):
    """
    Keeps what a light's observer is told.

    :ivar changed_at: when each of the changes was told, s; ``failed_at`` of the setpoints.
    """

    clock: Callable[[], float]
    events: list[str] = field(default_factory=list)
    statuses: list[Status] = field(default_factory=list)
    identities: list[Identity] = field(default_factory=list)
    changes: list[tuple[Cause, dict[str, Any]]] = field(default_factory=list)
    restorations: list[tuple[bool, str]] = field(default_factory=list)
    changed_at: list[float] = field(default_factory=list)
    failed_setpoints: list[str] = field(default_factory=list)
    failed_at: list[float] = field(default_factory=list)

    def connected(self, light: Light) -> None:
        self.events.append('connected')

    def lost(self, light: Light, reason: str) -> None:
        self.events.append(f'lost: {reason}')

    def restarted(self, light: Light) -> None:
        self.events.append('restarted')

    def identified(self, light: Light, identity: Identity) -> None:
        self.identities.append(identity)

    def status(self, light: Light, status: Status) -> None:
        self.statuses.append(status)

    def configured(
        self, light: Light, configuration: Configuration, names: list[str], cause: Cause,
    ) -> None:
        self.changed_at.append(self.clock())
        self.changes.append((cause, {name: getattr(configuration, name) for name in names}))

    def restored(self, light: Light, success: bool, message: str) -> None:
        self.restorations.append((success, message))

    def setpoint_failed(self, light: Light, message: str) -> None:
        self.failed_at.append(self.clock())
        self.failed_setpoints.append(message)


@dataclass
class Answer:
    """What a request gets: all its results, of which there should be one."""

    asked_at: float
    results: list[Result] = field(default_factory=list)
    ended_at: float = math.inf

    def __call__(self, result: Result, now: float) -> None:
        self.results.append(result)
        self.ended_at = now

    @property
    def result(self) -> Result:
        """Return the result; an error unless there is exactly one."""
        (result,) = self.results
        return result

    @property
    def seconds(self) -> float:
        """How long it took."""
        return self.ended_at - self.asked_at
