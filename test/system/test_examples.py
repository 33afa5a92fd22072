# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The programs of examples/ operate simulated devices through their nodes."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
import contextlib
import csv
import math
from pathlib import Path
import re
import signal
from typing import Any

from illuminator_ros.gimbal.simulated_manager import ManagerProperties, SimulatedManager
from illuminator_ros.illuminator.simulated import SimulatedIlluminator
from illuminator_ros.illuminator.simulated_properties import IlluminatorProperties
from illuminator_ros.mavlink.messages import Address, Message
from illuminator_ros.rededge.messages import GpsRawInt
from illuminator_ros.rededge.simulated import RedEdgeProperties, SimulatedRedEdge
from illuminator_ros.simulation.simulated import SimulatedComponents, SimulatedDevice
import pytest
from sensor_msgs.msg import NavSatFix, NavSatStatus
from std_msgs.msg import Bool, Header
from std_srvs.srv import SetBool, Trigger
from support.live_link import EndpointLink
from support.ports import free_port
from support.processes import ended, Program, python, ROOT
from support.ros import bridge_arguments, repeated, Ros
from support.waiting import eventually, Log

# s; the clocks of programs and devices are those of the machine, which may pause.
LOST_AFTER = 60.0
EARTH_RADIUS = 6_371_000.0
BOTH = '[illuminator, gimbal]'


def light_and_gimbal() -> tuple[SimulatedIlluminator, SimulatedManager]:
    return (SimulatedIlluminator(IlluminatorProperties()), SimulatedManager(ManagerProperties()))


@contextlib.contextmanager
def served(port: int, *devices: SimulatedDevice, **options: Any) -> Any:
    """Serve simulated devices over UDP; yield their link."""
    link = EndpointLink(
        f'udpout://127.0.0.1:{port}', SimulatedComponents(devices, 0.0), **options)
    try:
        yield link
    finally:
        link.stop()


def node(ros: Ros, name: str, port: int, *arguments: str, **parameters: Any) -> Any:
    """Run a node of this package."""
    return ended(python(
        f'illuminator_ros.{name}', *bridge_arguments(
            port, *arguments, heartbeat_timeout=LOST_AFTER, **parameters),
        env={'ROS_DOMAIN_ID': str(ros.domain)}))


@contextlib.contextmanager
def bridge(ros: Ros, *arguments_and_devices: str | SimulatedDevice, **parameters: Any) -> Any:
    """Run a bridge that has found simulated devices; yield their link."""
    port = free_port()
    arguments = [one for one in arguments_and_devices if isinstance(one, str)]
    devices = [one for one in arguments_and_devices if not isinstance(one, str)]
    with (node(ros, 'bridge', port, *arguments, **parameters) as program,
          served(port, *devices) as link):
        program.wait_for(' connected', count=len(devices))
        yield link


def example(
    ros: Ros, name: str, folder: Path, *arguments: str, **changes: str,
) -> Any:
    """Run an example with other values in the lines that a reader changes."""
    text = (ROOT / 'examples' / f'{name}.py').read_text()
    head, marked, rest = re.split(r'(?s)(\n# Change these: .*?\n\n)', text)
    for variable, value in changes.items():
        marked, count = re.subn(rf'(?m)^{variable} = .*', f'{variable} = {value}', marked)
        assert count == 1
    (folder / f'{name}.py').write_text(head + marked + rest)
    return Program(name, *arguments, cwd=folder, env={'ROS_DOMAIN_ID': str(ros.domain)},
                   forked=True)


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM, signal.SIGKILL])
def test_the_searchlight_dims_while_it_is_hot_and_goes_off_however_the_program_ends(
        own_ros: Ros, tmp_path: Path, number: int) -> None:
    light = SimulatedIlluminator(IlluminatorProperties())
    with (bridge(own_ros, light, off_after_silence=2.0) as link,
          ended(example(own_ros, 'searchlight', tmp_path)) as program):
        def shines(brightness: float) -> Callable[[], bool]:
            return lambda: light.enabled and light.configuration.brightness == brightness

        eventually(shines(40.0))
        for temperature, brightness in ((85.0, 10.0), (25.0, 40.0)):
            link.ask(lambda now, to=temperature: light.heat_to(to, now))
            eventually(shines(brightness))

        status = program.end(number)
        if number == signal.SIGKILL:
            eventually(lambda: not light.enabled)
        else:
            assert (status, light.enabled) == (0, False), program.log


def test_the_searchlight_uses_the_light_of_its_namespace_and_its_diagnostics(
        own_ros: Ros, tmp_path: Path) -> None:
    light = SimulatedIlluminator(IlluminatorProperties())
    namespace = ['--ros-args', '-r', '__ns:=/uav1']
    with (bridge(own_ros, light, '-r', '__ns:=/uav1') as link,
          ended(example(own_ros, 'searchlight', tmp_path, *namespace))):
        eventually(lambda: light.enabled)
        link.ask(lambda now: light.heat_to(85.0, now))

        eventually(lambda: light.configuration.brightness == 10.0)


@pytest.mark.parametrize(('fault', 'lines'), [
    ('refuse', ['no brightness of 40 % within 1 s: the light reports 100 %.*']),
    ('silent', ['no brightness of 40 % within 1 s: the light reports none.*',
                'off failed: no light connected.*'])])
def test_the_searchlight_says_why_it_cannot_be_used_each_failure_once(
        own_ros: Ros, tmp_path: Path, fault: str, lines: list[str]) -> None:
    light = SimulatedIlluminator(IlluminatorProperties())
    with (bridge(own_ros, *([light] if fault == 'refuse' else [])) as link,
          contextlib.ExitStack() as stack):
        if fault == 'refuse':
            link.ask(lambda now: light.behave(light.faults.add(light.behaviour, 'refuse'), now))
        program = stack.enter_context(ended(
            example(own_ros, 'searchlight', tmp_path, TIMEOUT='1.0')))

        assert program.wait() == 1
        found = program.log.splitlines()
        assert len(found) == len(lines)
        assert all(map(re.match, lines, found)), found


def test_the_search_looks_in_each_direction_with_the_light_on_and_releases_the_gimbal(
        own_ros: Ros, tmp_path: Path) -> None:
    light, gimbal = light_and_gimbal()
    pattern = [(20, 30), (40, -10)]
    with (bridge(own_ros, light, gimbal, payloads=BOTH, off_after_silence=1.5),
          ended(example(own_ros, 'search_pattern', tmp_path, PATTERN=f'{pattern}',
                        DWELL='0.5')) as program):
        for down, left in pattern:
            eventually(lambda down=down, left=left: light.enabled and points_to(  # type: ignore
                gimbal, down, left))

        assert (program.wait(), program.log, light.enabled) == (0, '', False)
        own_ros.subscribe(Bool, '/gimbal/in_control').wait_value(False)


HERE, SPOT = (47.397742, 8.545594, 535.5), ('47.3987', '8.5466', '500.0')


@contextlib.contextmanager
def pointing(
    ros: Ros, folder: Path, *devices: SimulatedDevice, **changes: str,
) -> Iterator[Program]:
    """Run point_at.py for SPOT in a namespace, with a bridge that serves devices."""
    namespace = ['-r', '__ns:=/uav1']
    with (bridge(ros, *devices, *namespace, payloads=BOTH, geoid_separation=47.5),
          ended(example(ros, 'point_at', folder, *SPOT, '--ros-args', *namespace,
                        **changes)) as program):
        yield program


def test_place_is_lit_once_the_gimbal_is_on_target_until_the_program_ends(
        own_ros: Ros, tmp_path: Path) -> None:
    light, gimbal = light_and_gimbal()
    fixes = own_ros.node.create_publisher(NavSatFix, '/uav1/gimbal/fix', 10)
    latitude, longitude, altitude = HERE
    with (repeated(fixes, NavSatFix(
            status=NavSatStatus(status=NavSatStatus.STATUS_FIX), latitude=latitude,
            longitude=longitude, altitude=altitude), 0.05),
          pointing(own_ros, tmp_path, light, gimbal, TIMEOUT='60.0') as program):
        own_ros.subscribe(Bool, '/uav1/gimbal/on_target').wait_value(True)
        eventually(lambda: light.enabled)
        assert points_to(gimbal, 15.2, -35.3)

        assert (program.end(signal.SIGINT), program.log, light.enabled) == (0, '', False)
        own_ros.subscribe(Bool, '/uav1/gimbal/in_control').wait_value(False)


def test_place_is_not_lit_where_the_position_of_the_vehicle_is_unknown(
        own_ros: Ros, tmp_path: Path) -> None:
    light, gimbal = light_and_gimbal()
    with pointing(own_ros, tmp_path, light, gimbal, TIMEOUT='3.0') as program:
        assert program.wait() == 1
        assert program.log == (
            'not on target within 3 s: the position of the vehicle is unknown\n')
        assert not light.enabled


def points_to(gimbal: SimulatedManager, down: float, left: float) -> bool:
    _, pitch, yaw = map(math.degrees, gimbal.motion.angles)
    return abs(pitch + down) < 2.5 and abs(yaw + left) < 2.5


@pytest.mark.parametrize(('number', 'outcome'), [
    (0, (1, 'control of the gimbal is lost: primary none, secondary none\n')),
    (signal.SIGINT, (0, '')),
    (signal.SIGTERM, (0, ''))], ids=['the gimbal is taken', 'SIGINT', 'SIGTERM'])
def test_the_search_ends_with_the_light_off_and_says_why(
        own_ros: Ros, tmp_path: Path, number: int, outcome: tuple[int, str]) -> None:
    light, gimbal = light_and_gimbal()
    with (bridge(own_ros, light, gimbal, payloads=BOTH),
          ended(example(own_ros, 'search_pattern', tmp_path, DWELL='60.0')) as program):
        eventually(lambda: light.enabled)

        if number:
            program.send(number)
        else:
            assert own_ros.call(Trigger, '/gimbal/release_control', Trigger.Request()).success

        assert (program.wait(), program.log) == outcome
        assert not light.enabled


def test_the_search_with_a_gimbal_that_is_lost_says_so_and_switches_the_light_off(
        own_ros: Ros, tmp_path: Path) -> None:
    port, (light, gimbal) = free_port(), light_and_gimbal()
    with (node(own_ros, 'bridge', port, payloads=BOTH),
          served(port, light), contextlib.ExitStack() as gimbal_link,
          ended(example(own_ros, 'search_pattern', tmp_path, DWELL='60.0')) as program):
        gimbal_link.enter_context(served(port, gimbal))
        eventually(lambda: light.enabled)
        gimbal_link.close()

        assert program.wait() == 1
        assert program.log.startswith('the gimbal is lost\n')
        assert 'taken' not in program.log
        assert not light.enabled


def test_the_search_releases_the_gimbal_of_a_light_that_refuses_to_go_off_and_says_why(
        own_ros: Ros, tmp_path: Path) -> None:
    light, gimbal = light_and_gimbal()
    with (bridge(own_ros, light, gimbal, payloads=BOTH) as link,
          ended(example(own_ros, 'search_pattern', tmp_path, DWELL='60.0')) as program):
        eventually(lambda: light.enabled)
        link.ask(lambda now: light.behave(light.faults.add(light.behaviour, 'refuse'), now))
        program.send(signal.SIGINT)

        assert program.wait() == 1
        assert program.log.startswith('/illuminator/enable failed: refused: MAV_RESULT_DENIED')
        own_ros.subscribe(Bool, '/gimbal/in_control').wait_value(False)


@pytest.mark.parametrize(('name', 'changes', 'text'), [
    ('searchlight', {'LIGHT': "'/lamp'"}, '/lamp/enable: no such service'),
    ('search_pattern', {'LIGHT, GIMBAL': "'/illuminator', 'mount'"},
     '/mount/take_control: no such service'),
    ('survey', {'CAMERA, FIX': "'/camera', '/gps/fix'"}, '/camera/capture: no such service'),
    ('survey', {'CAMERA, FIX': "'/camera', 'gps'"}, '/gps: no publisher')])
def test_an_example_names_the_service_or_topic_that_does_not_exist(
        own_ros: Ros, tmp_path: Path, name: str, changes: dict[str, str], text: str) -> None:
    enabled = own_ros.node.create_service(
        SetBool, '/illuminator/enable', lambda request, response: response)
    with ended(example(own_ros, name, tmp_path, **changes)) as program:
        program.wait_for(text)
        assert name == 'survey' or program.wait() == 1
        assert 'nodes in the ROS domain' in program.log or 'publisher' in text
    own_ros.node.destroy_service(enabled)


class Camera(SimulatedRedEdge):
    """
    A simulated camera.

    :ivar latitudes: of the received positions, degrees.
    """

    def __init__(self) -> None:
        super().__init__(RedEdgeProperties())
        self.latitudes: Log[float] = Log()

    def receive(self, source: Address, message: Message, now: float) -> Iterable[Message]:
        if isinstance(message, GpsRawInt):
            self.latitudes.append(message.lat / 1e7)
        return super().receive(source, message, now)


def test_the_survey_takes_an_image_each_10_m_and_lists_it_and_repeats_one_that_failed(
        own_ros: Ros, tmp_path: Path) -> None:
    port, camera = free_port(), Camera()
    fixes = own_ros.node.create_publisher(NavSatFix, '/gps/fix', 10)

    def fix(metres: float) -> NavSatFix:
        """Return a position so far north of the start."""
        return NavSatFix(
            header=Header(stamp=own_ros.node.get_clock().now().to_msg()),
            status=NavSatStatus(status=NavSatStatus.STATUS_FIX),
            latitude=47.0 + math.degrees(metres / EARTH_RADIUS), longitude=8.0, altitude=500.0)

    def rows() -> list[dict[str, str]]:
        return [*csv.DictReader((tmp_path / 'images.csv').read_text().splitlines())]

    with (node(own_ros, 'rededge', port, '-r', '~/fix:=/gps/fix'),
          ended(example(own_ros, 'survey', tmp_path)) as program,
          contextlib.ExitStack() as stack):
        eventually(lambda: fixes.get_subscription_count() == 2)
        with repeated(fixes, fix(0.0), 0.05):
            program.wait_for('no image: no camera connected')
            stack.enter_context(served(port, camera, mavlink_version=1))
            eventually(rows)
        for count, way in ((2, (5.0, 9.9, 10.5)), (3, (15.0, 20.4, 21.5))):
            for metres in way:
                message = fix(metres)
                fixes.publish(message)
                camera.latitudes.wait_for(lambda one: one == pytest.approx(
                    message.latitude, abs=1e-7))  # noqa: B023
            eventually(lambda: len(rows()) == count)  # noqa: B023
        places = [math.radians(float(row['latitude_deg']) - 47.0) * EARTH_RADIUS
                  for row in rows()]
        # The camera may not yet have the position that has caused an image, nor any for the first.
        assert places[1:] == pytest.approx([10.5, 21.5], abs=1.2)
