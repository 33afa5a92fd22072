# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Records of the events and answers of a light."""

from __future__ import annotations

from dataclasses import dataclass, field
import math
from typing import Any

from illuminator_ros.illuminator import events as light_events
from illuminator_ros.illuminator.model import Status
from illuminator_ros.payload.device_events import DeviceConnected, DeviceDisconnected
from illuminator_ros.payload.identity import Identity
from illuminator_ros.payload.requests import Result


@dataclass
class Recorder:
    """Keeps the events of a light."""

    events: list[str] = field(default_factory=list)
    statuses: list[Status] = field(default_factory=list)
    identities: list[Identity] = field(default_factory=list)
    changes: list[tuple[light_events.ChangeCause, dict[str, Any]]] = field(default_factory=list)
    restorations: list[tuple[bool, str]] = field(default_factory=list)
    failed_setpoints: list[str] = field(default_factory=list)
    others: list[light_events.LightEvent] = field(default_factory=list)

    def __call__(self, event: light_events.LightEvent) -> None:
        match event:
            case DeviceConnected():
                self.events.append('connected')
            case DeviceDisconnected():
                self.events.append(f'lost: {event.reason}')
            case light_events.LightRestarted():
                self.events.append('restarted')
            case light_events.LightIdentified():
                self.identities.append(event.identity)
            case light_events.StatusReceived():
                self.statuses.append(event.status)
            case light_events.ConfigurationChanged():
                self.changes.append((event.cause, {
                    name: getattr(event.configuration, name) for name in event.names}))
            case light_events.ConfigurationRestored():
                self.restorations.append((event.success, event.message))
            case light_events.SetpointFailed():
                self.failed_setpoints.append(event.message)
            case _:
                self.others.append(event)


@dataclass
class Answer:
    """The results of a request, which should have exactly one."""

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
