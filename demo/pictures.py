# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""
Draw the pictures of the documentation: the monitor, a beam, the track of a flight, and wirings.

The monitor and the beam show simulated devices with their real nodes, the track is the one of
``demo/flight.py``.
"""

from __future__ import annotations

import argparse
import asyncio
from collections.abc import Callable, Iterator
import contextlib
import csv
import functools
import math
import os
from pathlib import Path
import random
import re
import subprocess
import sys
import tempfile
import time
from typing import Any

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))
# Before rclpy is imported: a ROS graph of its own, on this machine only.
os.environ.setdefault('ROS_DOMAIN_ID', str(random.randrange(1, 101)))
os.environ.setdefault('ROS_AUTOMATIC_DISCOVERY_RANGE', 'LOCALHOST')

from flight_model import Flight, METRES_PER_DEGREE  # noqa: E402
from illuminator_ros.cli.monitor.app import MonitorApp  # noqa: E402
from illuminator_ros.cli.monitor.ros_graph import Graph  # noqa: E402
from illuminator_ros.cli.payloads import PAYLOADS  # noqa: E402
from illuminator_ros.payload.rotation import Quaternion  # noqa: E402
from illuminator_ros.ros.monitor_view import Device  # noqa: E402
from illuminator_ros.ros.qos import STATE_QOS  # noqa: E402
import matplotlib  # noqa: E402
from matplotlib import pyplot  # noqa: E402
from mpl_toolkits.mplot3d.art3d import Poly3DCollection  # noqa: E402
from programs import free_port, running  # noqa: E402
import rclpy  # noqa: E402
from visualization_msgs.msg import Marker  # noqa: E402

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
FLIGHT_SECONDS, FLIGHT_SPEED = 36.0, 10.0
# Degrees that these keys turn the gimbal down.
DOWN = 30.0
# Boxes of the wirings.
COMPUTER, AUTOPILOT, STATION, LIGHT, GIMBAL, CAMERA = (
    'companion computer\nwith ROS, 1/193', 'autopilot\n1/1', 'ground station\n255/190',
    'light\n1/243', 'gimbal\n1/154', 'MicaSense camera\n1/100')
# By file name: the places of the boxes, and the wires between them.
WIRINGS: dict[str, tuple[dict[str, tuple[float, float]], list[tuple[str, str, str]]]] = {
    'wiring-companion': (
        {STATION: (0, 2), AUTOPILOT: (0, 0), COMPUTER: (3, 1), LIGHT: (6, 2), GIMBAL: (6, 1),
         CAMERA: (6, 0)},
        [(STATION, COMPUTER, 'radio, UDP 14550'), (AUTOPILOT, COMPUTER, '/dev/ttyACM0'),
         (LIGHT, COMPUTER, '/dev/ttyUSB0'), (GIMBAL, COMPUTER, '/dev/ttyUSB1'),
         (CAMERA, COMPUTER, '/dev/ttyUSB2')]),
    'wiring-autopilot': (
        {STATION: (0, 1), COMPUTER: (0, 0), AUTOPILOT: (3, 0.5), GIMBAL: (6, 1), LIGHT: (6, 0)},
        [(STATION, AUTOPILOT, 'radio, TELEM1'), (COMPUTER, AUTOPILOT, '/dev/ttyACM0, TELEM2'),
         (GIMBAL, AUTOPILOT, 'a serial port'), (LIGHT, AUTOPILOT, 'a serial port')])}


@contextlib.contextmanager
def devices(logs: Path) -> Iterator[None]:
    """Run simulated lights, a gimbal and a camera with their nodes."""
    first, second = (f'127.0.0.1:{free_port()}' for _ in range(2))
    with contextlib.ExitStack() as stack:
        for number, command in enumerate((
            f'simulator udpout://{first} --payload illuminator,gimbal_manager '
            '--light 1/243 --light 1/244',
            f'bridge udpin://{first} --ros-args -p payloads:=[illuminator,gimbal] '
            '-p mounted_on:=1 -p beam_range:=10.0 -p beam_angle:=0.4',
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


async def draw_beam(node: rclpy.node.Node, folder: Path) -> None:
    """Draw the beam of the light on the gimbal."""
    markers: list[Marker] = []
    node.create_subscription(Marker, '/illuminator/beam', markers.append, STATE_QOS)

    def has_turned() -> bool:
        rclpy.spin_once(node, timeout_sec=0.0)
        return bool(markers) and math.degrees(_rotation(markers[-1]).euler()[1]) > DOWN - 5

    await until(has_turned)
    rotation = _rotation(markers[-1])
    points = [rotation.rotate((one.x, one.y, one.z)) for one in markers[-1].points]
    figure = pyplot.figure(figsize=(6, 4.5))
    axes = figure.add_subplot(projection='3d')
    axes.add_collection3d(Poly3DCollection(
        [points[at:at + 3] for at in range(0, len(points), 3)], facecolor='#ffd97a', alpha=0.35))
    for end, name in (((3, 0, 0), 'ahead'), ((0, 3, 0), 'left'), ((0, 0, 3), 'up')):
        axes.plot(*zip((0, 0, 0), end, strict=True), color='#555555')
        axes.text(*end, name)
    axes.set(xlim=(0, 10), ylim=(-3, 7), zlim=(-8, 2), xlabel='x (m)', ylabel='y (m)',
             zlabel='z (m)', title='a light on a gimbal, 30 degrees down, 20 to the left')
    axes.set_aspect('equal')
    _save(figure, folder / 'beam.svg')


def _rotation(marker: Marker) -> Quaternion:
    q = marker.pose.orientation
    return Quaternion(q.w, q.x, q.y, q.z)


def draw_flight(folder: Path, directory: Path) -> None:
    """Fly, and draw where the images were taken."""
    images = directory / 'images.csv'
    # A busy computer may miss the limits of the comparison; the picture shows the images as such.
    subprocess.run([sys.executable, ROOT / 'demo' / 'flight.py', '--seconds', str(FLIGHT_SECONDS),
                    '--speed', str(FLIGHT_SPEED), '--images', images], check=False,
                   stdout=subprocess.DEVNULL)
    flight = Flight(FLIGHT_SECONDS, FLIGHT_SPEED)
    origin = flight.truth(0.0)
    scale = METRES_PER_DEGREE * math.cos(math.radians(origin.latitude))

    def place(latitude: float, longitude: float) -> tuple[float, float]:
        return (longitude - origin.longitude) * scale, (
            latitude - origin.latitude) * METRES_PER_DEGREE

    figure, axes = pyplot.subplots(figsize=(6, 4.5))
    track = [flight.truth(FLIGHT_SECONDS * step / 1000) for step in range(1001)]
    axes.plot(*zip(*(place(one.latitude, one.longitude) for one in track), strict=True),
              color='#999999', label='truth')
    rows = [*csv.DictReader(images.open(newline=''))]
    for fed, style, label in ((True, 'o', 'image, position from ROS'),
                              (False, 'x', "image, camera's own GPS: no fix, or link pulled")):
        places = [place(float(row['latitude_deg']), float(row['longitude_deg']))
                  for row in rows if bool(row['position_age_s']) is fed]
        axes.plot(*zip(*places, strict=True) if places else ([], []), style, label=label)
    axes.set(xlabel='east (m)', ylabel='north (m)', title='demo/flight.py', aspect='equal')
    axes.legend(fontsize='small', loc='upper left', bbox_to_anchor=(1.02, 1))
    _save(figure, folder / 'flight.svg')


def draw_wiring(folder: Path) -> None:
    """Draw which device has which line to which computer."""
    for name, (boxes, wires) in WIRINGS.items():
        figure, axes = pyplot.subplots(figsize=(9, 3))
        for begin, end, label in wires:
            (x, y), (to_x, to_y) = boxes[begin], boxes[end]
            axes.plot([x, to_x], [y, to_y], color='#555555', zorder=1)
            axes.text(0.58 * x + 0.42 * to_x, 0.58 * y + 0.42 * to_y, label, ha='center',
                      va='center', zorder=2, fontsize='small',
                      bbox={'facecolor': 'white', 'edgecolor': 'none'})
        for text, place in boxes.items():
            axes.text(*place, text, ha='center', va='center', zorder=3, bbox={
                'boxstyle': 'round', 'facecolor': '#ffe9b3', 'edgecolor': '#555555'})
        rows = [y for _, y in boxes.values()]
        axes.set(xlim=(-0.9, 6.9), ylim=(min(rows) - 0.4, max(rows) + 0.4))
        axes.set_axis_off()
        _save(figure, folder / f'{name}.svg')


def _save(figure: Any, path: Path) -> None:
    # The same picture has the same file.
    figure.savefig(path, metadata={'Date': None}, bbox_inches='tight')
    pyplot.close(figure)


async def draw_devices(folder: Path) -> None:
    """Draw everything that needs devices."""
    nodes = [rclpy.create_node(f'pictures_{number}') for number in range(2)]
    views = [one.load('view') for one in PAYLOADS.values() if one.view]
    await draw_monitor(Graph(nodes[0], views), folder)
    await draw_beam(nodes[1], folder)


def main() -> None:
    """Draw all pictures."""
    parser = argparse.ArgumentParser(description='Draw the pictures of the documentation.')
    parser.add_argument('--output', type=Path, default=ROOT / 'doc' / 'pictures', metavar='FOLDER')
    folder = parser.parse_args().output
    folder.mkdir(parents=True, exist_ok=True)
    matplotlib.use('svg')
    matplotlib.rcParams['svg.hashsalt'] = 'illuminator_ros'
    with tempfile.TemporaryDirectory() as name:
        draw_wiring(folder)
        rclpy.init()
        with devices(Path(name)):
            asyncio.run(draw_devices(folder))
        rclpy.shutdown()
        draw_flight(folder, Path(name))


if __name__ == '__main__':
    main()
