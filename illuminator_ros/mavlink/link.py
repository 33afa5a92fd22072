# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The link: the one thread that owns some lines and the endpoint that uses them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
import functools
import selectors
import time

from .component import Endpoint
from .errors import LinkThreadError
from .lines import Lines
from .link_state import LinkEvent, LinkInput, LinkSnapshot
from .link_thread import FaultLog, LinkThread
from .signing import Signing
from .signing_files import TimestampStore
from .url import Url

# s between stores of the signing time stamp; the specification asks for once a minute.
STORE_INTERVAL = 30.0


class Link:
    """
    Runs an endpoint over connection URLs in a thread of its own, and reopens lost transports.

    Only this thread calls the endpoint. Other threads hand it functions by :meth:`call`, and get
    snapshots and events.

    :param further: more URLs, by label; frames are forwarded between all lines.
    :param on_event: called in that thread when a line is opened, lost, or cannot be opened at
        first.
    :param store: keeps the time stamps of signing for the next run; None keeps them nowhere.
    :param mavlink_version: 1 or 2, of the frames that are sent; both are received.
    :param clock: s, monotonic.
    :param wall_clock: s, Unix time, for the signing time stamps.
    :param selector: waits for the transport.
    :ivar lines: for use in the link's thread.
    :raises InvalidValue: if MAVLink 1 cannot carry a message of the endpoint, or must be signed.
    """

    def __init__(
        self, url: Url, endpoint: Endpoint, *, label: str, further: Mapping[str, Url] = {},
        on_event: Callable[[LinkEvent], None] = lambda event: None,
        signing: Signing | None = None,
        store: TimestampStore | None = None,
        mavlink_version: int = 2,
        clock: Callable[[], float] = time.monotonic,
        wall_clock: Callable[[], float] = time.time,
        selector: selectors.BaseSelector | None = None,
    ) -> None:
        self.endpoint = endpoint
        self.clock = clock
        self._label = label
        self._wall_clock = wall_clock
        self._on_event = on_event
        self._signing = signing or Signing()
        self._store = store
        self._faults = FaultLog(clock)
        self._thread = LinkThread(
            self._work, self._finish, self._faults, clock, selector,
            stalled=lambda seconds: endpoint.stalled(seconds, clock()))
        self.lines = Lines(
            [(label, url), *further.items()], endpoint, faults=self._faults,
            selector=self._thread.selector, call=self._thread.call,
            defer=self._thread.defer, signing=self._signing, mavlink_version=mavlink_version,
            clock=clock, wall_clock=wall_clock)
        if store:
            endpoint.schedule.at(self._store_regularly, 0.0)

    # From any thread

    def start(self) -> None:
        """
        Start the thread.

        :raises LinkThreadError: if that fails; it may be tried again.
        """
        try:
            self._thread.start()
        except RuntimeError as error:
            raise LinkThreadError(f'{self._label}: {error} for the link') from None

    def stop(self, timeout: float = 1.0) -> None:
        """
        Close the transport and end the thread; it cannot be started again.

        :param timeout: how long to wait for the thread, s.
        """
        # A channel that was just handed over is among the calls, which the thread still takes.
        for line in self.lines:
            line.stop()
        self._thread.stop(timeout)

    def is_running(self) -> bool:
        """Return whether the thread runs."""
        return self._thread.is_running()

    def call(self, function: Callable[[float], None]) -> None:
        """Have ``function(now)`` called in the link's thread, unless the thread has ended."""
        self._thread.call(function)

    def call_first(self, function: Callable[[float], None]) -> None:
        """Have ``function(now)`` called in the link's thread, before the calls that wait."""
        self._thread.call_first(function)

    # In the link's thread

    def snapshot(self, now: float) -> LinkSnapshot:
        """Return the first line at this moment."""
        return self.lines.snapshots(now)[0]

    def _work(self) -> float:
        now = self.clock()
        self.lines.flush(now)
        schedule = self.endpoint.schedule
        if (at := self.clock()) >= schedule.due:
            self._faults.call(schedule.run, at)
            self.lines.flush(self.clock())
        for line in self.lines:
            while line.status.events:
                self._faults.call(self._on_event, line.status.events.pop(0))
        if seconds := self.lines.pause(now):
            self._thread.pause(seconds)
        return schedule.due

    def _store_regularly(self, now: float) -> None:
        self.endpoint.schedule.at(self._store_regularly, now + STORE_INTERVAL)
        self._store_timestamp(last=False)

    def _finish(self) -> None:
        self._store_timestamp(last=True)
        for line in self.lines:
            line.close()
            line.status.transition(LinkInput.STOPPED, self.clock())

    def _store_timestamp(self, *, last: bool) -> None:
        if self._store:
            self._faults.call(functools.partial(self._store.store, last=last),
                              self._signing.timestamp, self._wall_clock())
