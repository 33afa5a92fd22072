# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Publishing /diagnostics for all nodes of a process."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Sequence
from dataclasses import dataclass
import functools
import threading

from diagnostic_msgs.msg import DiagnosticArray
from rclpy.node import Node

from .diagnostics import line_reports, link_diagnostics, LinkDiagnostics, loops, Report
from .executor_calls import ExecutorCalls
from .qos import STREAM_QOS
from ..mavlink.component import Component
from ..mavlink.device_kind import DeviceKind
from ..mavlink.link import Link

# Makes reports of a snapshot that was taken in the link's thread; a pure function.
MakeReports = Callable[[LinkDiagnostics], Sequence[Report]]


@dataclass(frozen=True, eq=False)
class DiagnosticsSource:
    """
    The reports of one node.

    :param node: its name with its namespace.
    :param take_snapshot: takes a snapshot, in the link's thread, given the time (s).
    """

    node: str
    take_snapshot: Callable[[float], MakeReports]


class DiagnosticsPublisher:
    """
    Publishes the reports of each node when they are due, or at once when a level has changed.

    :param urls: the URL of each line, which is its hardware id.
    :param known: the devices of payloads.
    :param period: s between publications of a node.
    """

    def __init__(
        self, node: Node, link: Link, component: Component, *, urls: Sequence[str],
        known: Collection[DeviceKind], period: float,
    ) -> None:
        self._clock = node.get_clock()
        self._publisher = node.create_publisher(DiagnosticArray, '/diagnostics', STREAM_QOS)
        self._link = link
        self._component = component
        self._urls = urls
        self._known = known
        self._period = period
        self._lock = threading.Lock()
        # When each source is due, and the levels that were published last.
        self._sources: dict[DiagnosticsSource, tuple[float, list[bytes]]] = {}
        self._call = ExecutorCalls(node).call

    def add(self, source: DiagnosticsSource) -> None:
        """Publish for a node from now on; callable from any thread."""
        with self._lock:
            self._sources[source] = -1.0, []

    def remove(self, source: DiagnosticsSource) -> None:
        """Publish nothing more for a node; callable from any thread."""
        with self._lock:
            self._sources.pop(source, None)

    def snapshot(self, now: float) -> LinkDiagnostics:
        """Return a snapshot of the link; call it in the link's thread."""
        return link_diagnostics(self._link, self._component, self._urls, self._known, now)

    def loops(self, now: float) -> Iterable[str]:
        """Return the loops between lines, for people; call it in the link's thread."""
        return loops(self._link.lines.copies(now), self._urls).values()

    def poll(self, tolerance: float) -> None:
        """
        Have everything published that is due or has changed; callable from any thread.

        :param tolerance: how early a publication may be, s.
        """
        with self._lock:
            sources = tuple(self._sources)

        def take(now: float) -> None:
            self._call(functools.partial(
                self._publish_due, self.snapshot(now),
                [(source, source.take_snapshot(now)) for source in sources], tolerance))

        self._link.call(take)

    # In the executor's thread

    def _publish_due(
        self, link: LinkDiagnostics, sources: Sequence[tuple[DiagnosticsSource, MakeReports]],
        tolerance: float,
    ) -> None:
        for source, make_reports in sources:
            reports = [*make_reports(link)]
            # The first node alone reports the further lines.
            if source is sources[0][0]:
                reports += line_reports(link)
            levels = [report.level for report in reports]
            due, published = self._sources.get(source, (0.0, levels))
            if link.taken_at >= due - tolerance:
                due = link.taken_at + self._period
            elif levels == published:
                continue
            with self._lock:
                if source in self._sources:
                    self._sources[source] = due, levels
            self._publish(source, reports)

    def _publish(self, source: DiagnosticsSource, reports: Sequence[Report]) -> None:
        array = DiagnosticArray()
        array.header.stamp = self._clock.now().to_msg()
        array.status = [report.message(source.node) for report in reports]
        self._publisher.publish(array)
