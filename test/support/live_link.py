# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Links in threads of their own, over real sockets, and a peer."""

from __future__ import annotations

from collections.abc import Callable
import os
import threading
import time
from typing import Any, Generic, TypeVar

from illuminator_ros.illuminator.events import LightEvent
from illuminator_ros.illuminator.light import Light
from illuminator_ros.illuminator.settings import LightSettings
from illuminator_ros.illuminator.simulated import SimulatedIlluminator
from illuminator_ros.illuminator.simulated_properties import IlluminatorProperties
from illuminator_ros.mavlink.component import Endpoint, HeartbeatTimer
from illuminator_ros.mavlink.link import Link
from illuminator_ros.mavlink.link_state import LinkEvent, LinkSnapshot
from illuminator_ros.mavlink.messages import Address, Message
from illuminator_ros.mavlink.schedule import Schedule
from illuminator_ros.mavlink.url import parse_url, Url
from illuminator_ros.payload.device_events import DeviceConnected, DeviceDisconnected
from illuminator_ros.payload.requests import Result
from illuminator_ros.simulation.simulated import SimulatedComponents
from support.client import Client
from support.messages import HANDLED
from support.waiting import eventually, Log, PATIENCE

BRIDGE = Address(1, 193)
CONNECTOR = 'mavlink-open'
E = TypeVar('E', bound=Endpoint)
L = TypeVar('L', bound='EndpointLink[Any]')
T = TypeVar('T')


class _Turns(Schedule):
    """A schedule that counts how often the link asks it."""

    count = 0

    @property
    def due(self) -> float:
        self.count += 1
        return super().due


class _Beats(HeartbeatTimer):
    """Heartbeats that are counted."""

    count = 0

    def send(self, now: float) -> None:
        self.count += 1
        super().send(now)


class Talker(Endpoint):
    """
    A peer that sends heartbeats and keeps received messages.

    :ivar heard: source and message, in order.
    :ivar announcements: when the link was opened or a new peer was heard, s.
    :ivar turns: counts the waits of the link's thread, each twice.
    """

    messages = tuple(HANDLED.values())

    def __init__(self) -> None:
        super().__init__()
        self.schedule = self.turns = _Turns()
        self.heartbeat = _Beats(BRIDGE, 18, self.outgoing, self.schedule)
        self.heard: Log[tuple[Address, Any]] = Log()
        self.announcements: Log[float] = Log()

    def link_opened(self, now: float) -> None:
        self.heartbeat.send(now)
        self.announcements.append(now)

    def link_closed(self, now: float, reason: str) -> None:
        self.heartbeat.stop()

    def receive(self, source: Address, message: Message, now: float) -> None:
        self.heard.append((source, message))

    def wait_heard(self, count: int = 1) -> Address:
        """Wait for the count-th message, and return its source."""
        return self.heard.wait_for(lambda entry: True, count=count)[0]


class EndpointLink(Generic[E]):
    """
    A link and its events; as a context manager it stops the link at the end.

    :param on_event: called with each event, after it was noted.
    :param kind: the class of the link, such as one with another clock.
    :ivar events: the events that the link has reported.
    """

    def __init__(
        self, url: str | Url, endpoint: E, *,
        on_event: Callable[[LinkEvent], object] = lambda event: None, kind: type[Link] = Link,
        **options: Any,
    ) -> None:
        self.endpoint = endpoint
        self.events: Log[LinkEvent] = Log()

        def note(event: LinkEvent) -> None:
            self.events.append(event)
            on_event(event)

        self.link = kind(parse_url(url) if isinstance(url, str) else url, endpoint,
                         label=str(url), on_event=note, **options)
        self.link.start()

    def wait_open(self, count: int = 1) -> LinkEvent:
        """Wait until the link was opened for the count-th time."""
        return self.events.wait_for(lambda event: event.is_open, count=count)

    def wait_lost(self, count: int = 1) -> LinkEvent:
        """Wait until the link was lost, or could not be opened, for the count-th time."""
        return self.events.wait_for(lambda event: not event.is_open, count=count)

    def history(self) -> list[bool]:
        """Return for each event whether it was an opening."""
        return [event.is_open for event in self.events]

    def ask(self, function: Callable[[float], T]) -> T:
        """Return the result of a function that the link's thread calls."""
        answers: Log[T] = Log()
        self.link.call(lambda now: answers.append(function(now)))
        return answers.wait_for(lambda answer: True)

    def state(self) -> LinkSnapshot:
        """Return the link at this moment."""
        return self.ask(self.link.snapshot)

    def stop(self) -> None:
        """Stop the link, and wait for its threads."""
        self.link.stop(PATIENCE)

    def __enter__(self: L) -> L:
        return self

    def __exit__(self, *error: object) -> None:
        self.stop()


class LiveLink(EndpointLink[Talker]):
    """A link with a :class:`Talker`, if no other endpoint is given."""

    def __init__(self, url: str | Url, endpoint: Talker | None = None, **options: Any) -> None:
        super().__init__(url, endpoint or Talker(), **options)

    def send(self, *messages: Message) -> None:
        """Send messages, in one call of the thread."""
        self.ask(lambda now: self.endpoint.outgoing.extend((BRIDGE, one) for one in messages))


class Lights(EndpointLink[Any]):
    """A simulated light on a link, which has just been switched on."""

    def __init__(self, url: str, *, clock: Callable[[], float] = time.monotonic) -> None:
        super().__init__(url, SimulatedComponents(
            [SimulatedIlluminator(IlluminatorProperties())], clock()), clock=clock)


class Bridge(EndpointLink[Client]):
    """
    The bridge's side of a link, without ROS.

    :param settings: those of the client, such as the heartbeat timeout.
    :ivar lights: ``connected`` or ``lost``, and the light, in order.
    """

    def __init__(
        self, url: str | Url, settings: LightSettings | None = None, **options: Any,
    ) -> None:
        self.lights: Log[tuple[str, Light]] = Log()
        client = Client(
            BRIDGE, settings or LightSettings(), command_timeout=PATIENCE / 10, command_retries=9)
        client.events.subscribe(self._take)
        super().__init__(url, client, **options)

    def _take(self, event: LightEvent) -> None:
        if isinstance(event, DeviceConnected | DeviceDisconnected):
            kind = 'connected' if isinstance(event, DeviceConnected) else 'lost'
            self.lights.append((kind, self.endpoint.lights[event.key]))

    def wait_connected(self, count: int = 1) -> Light:
        """Wait for the count-th connection of a light, and return the light."""
        return self.lights.wait_for(lambda entry: entry[0] == 'connected', count=count)[1]

    def enable(self, on: bool, light: Light | None = None) -> Result:
        """Switch a light on or off, and return the result."""
        results: Log[Result] = Log()
        one = light or self.wait_connected()
        self.link.call(lambda now: one.enable(
            on, now, lambda result, now: results.append(result)))
        return results.wait_for(lambda result: True)


class Run:
    """Keeps the links of a test, to be stopped when it ends."""

    def __init__(self) -> None:
        self._links: list[EndpointLink[Any]] = []

    def __call__(self, link: L) -> L:
        self._links.append(link)
        return link

    def stop(self) -> None:
        """Stop them."""
        for link in self._links:
            link.stop()


def resources() -> tuple[int, int]:
    """Return the numbers of threads and of open descriptors, once no link tries to open."""
    for thread in threading.enumerate():
        if thread.name == CONNECTOR:
            thread.join(PATIENCE)
    return threading.active_count(), len(os.listdir('/proc/self/fd'))


def wait_for_resources(threads: int, descriptors: int) -> None:
    """Wait until there are no more threads and descriptors than that; an error if they stay."""
    def few() -> bool:
        now = resources()
        return now[0] <= threads and now[1] <= descriptors

    eventually(few, f'{resources()} threads and descriptors, not {(threads, descriptors)}')


class Jump:
    """A clock that can be set forward."""

    def __init__(self) -> None:
        self.ahead = 0.0

    def __call__(self) -> float:
        return time.monotonic() + self.ahead
