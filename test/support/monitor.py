# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Devices of the monitor, and a graph without ROS that records the requests to them."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
import math
from typing import Any, cast

from illuminator_ros.cli.monitor.app import MonitorApp
from illuminator_ros.cli.monitor.ros_graph import Graph
from illuminator_ros.gimbal.ros.monitor_view import VIEW as GIMBAL
from illuminator_ros.illuminator.ros.monitor_view import VIEW as LIGHT
from illuminator_ros.rededge.ros.monitor_view import VIEW as CAMERA
from illuminator_ros.ros.monitor_view import Device, Diagnosis, Request, View
from textual.pilot import Pilot

NOW = 1000.0
PRESENT: dict[str, dict[str, Any]] = {
    'light': {'connected': True, 'enabled': False, 'brightness': 40.0, 'mode': 'internal_control',
              'strobe_period': 0.0, 'strobe_duty_cycle': 0.0, 'error_flags': 0, 'uptime': 300.0,
              'temperature': 41.5},
    'gimbal': {'connected': True, 'in_control': True, 'controller': 'primary 1/193',
               'yaw_lock': False, 'angles': ('base_link_stabilized', 0.0, 0.5, -0.25)},
    'camera': {'connected': True, 'image/index': 7}}


class FakeDevice(Device):
    """A device that records the requests to it."""

    sent: list[tuple[str, Request]]

    def submit(self, request: Request) -> None:
        """Record a request."""
        self.sent.append((self.name, request))

    # An OFF that is repeated is one request.
    require_off = submit


def device(view: View, name: str, **values: Any) -> FakeDevice:
    """Return a device that has just published all its values, changed by those given."""
    made = FakeDevice(name, view, NOW, heard_at=NOW)
    made.values = PRESENT.get(view.kind, {}) | values
    made.trend.extend([30.0, 35.0, None, 41.5] if view.trend else [])
    made.diagnoses['link'] = Diagnosis(0, 'open', {
        'loss_percent': '12.3', 'round_trip_ms': '3.2'})
    return made


def light(name: str = '/bow', **values: Any) -> FakeDevice:
    """Return a light that is off and steady, at 40 %."""
    made = device(LIGHT, name, **values)
    made.diagnoses['lamp'] = Diagnosis(1, 'dimmed because it is hot', {
        'agreed': 'mode internal_control, brightness 90 %', 'vendor': 'maker', 'model': 'torch',
        'serial_number': 'T-1', 'holder': 'safety', 'held_s': '61'})
    return made


def gimbal(name: str = '/gimbal', **values: Any) -> FakeDevice:
    """Return a gimbal that the operator controls."""
    return device(GIMBAL, name, **values)


def camera(name: str = '/camera', fix: Any = (0, 47.3, 8.5, 480.0)) -> FakeDevice:
    """Return a camera, with the position of its last image, which lacks an attitude."""
    made = device(CAMERA, name, **{'image/fix': fix})
    made.diagnoses['camera'] = Diagnosis(1, 'nothing received on ~/imu', {
        'fix': 'ok', 'fix_s_ago': '0.2', 'imu': 'stale', 'imu_s_ago': '9', 'mount': 'missing',
        'round_trip_ms': '12'})
    return made


def diagnosed(one: FakeDevice, **levels: int) -> FakeDevice:
    """Return a device with these diagnoses only."""
    one.diagnoses = {kind: Diagnosis(level, f'{kind} {level}', {})
                     for kind, level in levels.items()}
    return one


class FakeGraph:
    """A graph with given devices, whose time the test sets."""

    def __init__(self, *devices: FakeDevice, may_request: bool = True) -> None:
        self.now = NOW
        self.devices = list(devices)
        self.requests: list[tuple[str, Request]] = []
        self.views = [LIGHT, CAMERA, GIMBAL]
        self.cleared = 0
        self.answers_polled = 0
        self.may_request = may_request
        self._off_at = -math.inf

    def clock(self) -> float:
        """Return the time, s."""
        return self.now

    # Those of the monitor itself.
    all_off = Graph.all_off
    off_answers = Graph.off_answers

    def clear_gone(self) -> None:
        """Count the calls."""
        self.cleared += 1

    def poll(self) -> None:
        """Take the time."""
        for one in self.devices:
            one.now = self.now
            one.sent = self.requests

    def poll_answers(self) -> None:
        """Count the calls."""
        self.answers_polled += 1

    @property
    def asked(self) -> list[tuple[str, str]]:
        """Return names and texts of the requests."""
        return [(name, request.text) for name, request in self.requests]


class Screen:
    """The monitor on a terminal of the test's."""

    def __init__(self, app: MonitorApp, pilot: Pilot[None], graph: FakeGraph) -> None:
        self.app = app
        self.pilot = pilot
        self.graph = graph

    @property
    def lines(self) -> list[str]:
        """Return the lines that are shown."""
        width, height = self.app.size
        lines = [' ' * width] * height
        for one in self.app.screen.query('*'):
            left, top, *_ = one.content_region
            for y in range(top, min(top + one.size.height, height) if not one.children else 0):
                # Another part may be above it.
                if left < width and self.app.screen.get_widget_at(left, y)[0] is one:
                    text = one.render_line(y - top).text
                    line = f'{lines[y][:left]}{text}{lines[y][left + len(text):]}'
                    lines[y] = line[:width]
        return [line.rstrip() for line in lines]

    @property
    def text(self) -> str:
        """Return the complete screen, with single spaces."""
        return ' '.join(' '.join(self.lines).split())

    async def press(self, *keys: str) -> None:
        """Press keys, and let the monitor act on them."""
        await self.pilot.press(*keys)
        await self.settle()

    async def settle(self) -> None:
        """Wait until the events so far have gone from the application to its parts and back."""
        for one in (self.app, self.app.screen, *self.app.screen.query('Button, FooterKey'),
                    self.app):
            handled = asyncio.Event()
            if one.call_later(handled.set):
                await handled.wait()
        await self.pilot.pause()

    async def wait(self, seconds: float = 0.0) -> None:
        """Let time pass for the monitor, and let it draw."""
        self.graph.now += seconds
        self.app.poll()
        await self.settle()

    async def click(self, label: str) -> None:
        """Click a text."""
        [(x, y)] = [(line.index(label), y) for y, line in enumerate(self.lines) if label in line]
        await self.pilot.click(offset=(x + 1, y))
        await self.settle()


def show(
    test: Callable[[Screen], Awaitable[None]], *devices: FakeDevice,
    size: tuple[int, int] = (132, 40), may_request: bool = True, **how: Any,
) -> FakeGraph:
    """Show devices while a test runs; return the graph."""
    graph = FakeGraph(*devices, may_request=may_request)
    app = MonitorApp(cast(Graph, graph), **how)

    async def run() -> None:
        async with app.run_test(size=size) as pilot:
            screen = Screen(app, pilot, graph)
            await screen.wait()
            await test(screen)

    asyncio.run(run())
    return graph
