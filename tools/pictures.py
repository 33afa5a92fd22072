# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Draw the pictures of the documentation: the monitor with simulated devices and their nodes."""

from __future__ import annotations

import argparse
import asyncio
from collections.abc import Callable, Iterator
import contextlib
import functools
import os
from pathlib import Path
import random
import re
import tempfile
import time
from typing import Any

from illuminator_ros.cli.monitor.app import MonitorApp
from illuminator_ros.cli.monitor.ros_graph import Graph
from illuminator_ros.cli.payloads import PAYLOADS
from illuminator_ros.ros.monitor_view import Device
import rclpy

from .demo.programs import free_port, ROOT, running

# s for devices and answers.
TIMEOUT = 30.0
# Columns and lines of the monitor.
SIZE = (112, 28)
# A telephone has 390 by 844 pixels, and its browser takes some of them.
PHONE_SIZE = (55, 47)
# For each kind of device how to select it, and the keys that operate it; an answer follows each.
# The camera is first, since it lacks an input.
KEYS = {'light': (['home', 'down'], ['space enter', '-', '-']),
        'gimbal': (['end'], ['t', *['m down'] * 6, *['m left'] * 4]),
        'camera': (['home'], ['p', 'space'])}


@contextlib.contextmanager
def devices(logs: Path) -> Iterator[None]:
    """Run simulated lights, a gimbal and a camera with their nodes."""
    first, second = (f'127.0.0.1:{free_port()}' for _ in range(2))
    with contextlib.ExitStack() as stack:
        for number, command in enumerate((
            f'simulator udpout://{first} --payload illuminator,gimbal_manager '
            '--light 1/243 --light 1/244',
            f'bridge udpin://{first} --ros-args -p payloads:=[illuminator,gimbal]',
            f'simulator udpout://{second} --payload rededge', f'rededge udpin://{second}',
        )):
            module, *arguments = command.split()
            stack.enter_context(running(
                logs / f'{number}.log', '-m', f'illuminator_ros.{module}', *arguments))
        yield


async def until(condition: Callable[[], Any]) -> None:
    """
    Wait for a condition.

    :raises TimeoutError: if it does not hold in time.
    """
    deadline = time.monotonic() + TIMEOUT
    while not condition():
        if time.monotonic() > deadline:
            raise TimeoutError('a device has not answered')
        await asyncio.sleep(0.1)


async def draw_monitor(graph: Graph, folder: Path) -> None:
    """Operate a device of each kind, and draw the monitor after that."""
    app = MonitorApp(graph)
    async with app.run_test(size=SIZE) as pilot:
        await until(lambda: [(device.state, device.level) for device in graph.devices] == [
            ('off', 0), ('off', 0), ('ok', 1), ('ok', 0)])
        for kind, (selecting, presses) in KEYS.items():
            await pilot.press(*selecting)
            [device] = [one for one in graph.devices if one.view.kind == kind][:1]
            for keys in presses:
                device.action = None
                await pilot.press(*keys.split())
                await until(functools.partial(_is_answered, device))
                # The next key begins with the new state.
                await asyncio.sleep(0.4)
            await save_screen(app, folder / f'monitor-{kind}.svg')
    app = MonitorApp(graph, touch=True)
    async with app.run_test(size=PHONE_SIZE) as pilot:
        await pilot.press('home', 'down', 'v', 'v')
        await save_screen(app, folder / 'monitor-phone.svg')


async def save_screen(app: MonitorApp, path: Path) -> None:
    """Draw the screen, with the newest diagnostics."""
    # They are published once a second.
    await asyncio.sleep(1.2)
    picture = app.export_screenshot(title='ros2 run illuminator_ros monitor')
    # Its fonts would be loaded from another host.
    path.write_text(re.sub(r'@font-face \{.*?\}', '', picture, flags=re.DOTALL))


def _is_answered(device: Device) -> bool:
    return device.action is not None and device.action[1][0] != '...'


def main() -> None:
    """Draw all pictures."""
    parser = argparse.ArgumentParser(description='Draw the pictures of the documentation.')
    parser.add_argument('--output', type=Path, default=ROOT / 'doc' / 'pictures', metavar='FOLDER')
    folder = parser.parse_args().output
    folder.mkdir(parents=True, exist_ok=True)
    # A ROS graph of its own, on this machine only.
    os.environ.setdefault('ROS_DOMAIN_ID', str(random.randrange(1, 101)))
    os.environ.setdefault('ROS_AUTOMATIC_DISCOVERY_RANGE', 'LOCALHOST')
    views = [one.load('view') for one in PAYLOADS.values() if one.view]
    with tempfile.TemporaryDirectory() as name:
        rclpy.init()
        with devices(Path(name)):
            asyncio.run(draw_monitor(Graph(rclpy.create_node('pictures'), views), folder))
        rclpy.shutdown()


if __name__ == '__main__':
    main()
