# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The monitor in a ROS graph: the devices that it finds, their values, and its requests."""

from collections.abc import Callable, Iterator, Sequence
import contextlib
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from illuminator_ros.cli.monitor import ros_graph
from illuminator_ros.cli.payloads import PAYLOADS
from illuminator_ros.gimbal.ros.gimbal_node import PUBLICATIONS as GIMBAL_TOPICS
from illuminator_ros.illuminator.ros.event_publisher import PUBLICATIONS
from illuminator_ros.ros.graph import type_name
from illuminator_ros.ros.monitor_view import Device, View
from payloads.winch import WINCH
import pytest
from rclpy.node import Node
from std_msgs.msg import Bool, Float32, String, UInt32
from support.light import ServedLight
from support.processes import ended, python
from support.ros import Ros, running_bridge, STATE, STREAM
from support.slow import CLOCK
from support.waiting import eventually

VIEWS: list[View] = [one.load('view') for one in (*PAYLOADS.values(), WINCH) if one.view]
TYPES: dict[str, type[Any]] = {
    'connected': Bool, 'enabled': Bool, 'brightness': Float32, 'error_flags': UInt32}
SIGNATURE = {f'/bow/{topic}': type_name(type_) for topic, type_ in TYPES.items()}


class Watching:
    """A monitor in the domain of a ROS client, by the slow clock."""

    def __init__(self, ros: Ros) -> None:
        self.node = Node('monitor', context=ros.context, enable_rosout=False,
                         start_parameter_services=False)
        self.graph = ros_graph.Graph(self.node, VIEWS, clock=CLOCK)

    def close(self) -> None:
        """End the monitor."""
        self.node.destroy_node()

    @property
    def names(self) -> list[str]:
        """Return the names of the devices, after a poll."""
        self.graph.poll()
        self.graph.poll_answers()
        return [device.name for device in self.graph.devices]

    def wait(
        self, condition: Callable[[Device], Any], name: str = '/illuminator',
    ) -> ros_graph.GraphDevice:
        """Wait until a device is known and the condition holds; return it."""
        eventually(lambda: name in self.names)
        [found] = [device for device in self.graph.devices if device.name == name]
        eventually(lambda: self.names and condition(found))
        return found

    def press(self, key: str, name: str = '/illuminator') -> str:
        """Send the request of a key, wait for its outcome, and return outcome and answer."""
        device = self.wait(lambda _: True, name)
        [found] = [one for one in device.view.keys if key in one.keys]
        request = found.request(device, '')
        assert not isinstance(request, str), request
        device.submit(request)
        self.wait(lambda device: device.action and device.action[1][0] != '...', name)
        assert device.action is not None
        return f'{device.action[1][0]}: {device.action[2]}'


@pytest.fixture
def monitor(own_ros: Ros) -> Iterator[Watching]:
    """Watch a domain of the test's own."""
    with contextlib.closing(Watching(own_ros)) as made:
        yield made


def test_monitor_shows_a_light_with_link_and_identity_and_sends_its_requests(
    own_ros: Ros, port: int, monitor: Watching,
) -> None:
    with (running_bridge(own_ros.domain, port, diagnostics_period=0.1),
          ServedLight(port, error_status=1, brightness=30.0, temp_c=61.5) as light):
        monitor.wait(lambda device: device.state == 'off')
        assert monitor.press('space').startswith('done: on, confirmed by ILLUMINATOR_STATUS')
        monitor.wait(lambda device: device.state == 'ON')
        assert monitor.press('s').startswith('done')
        # The agreed brightness counts, not the reported one of a hot light.
        monitor.wait(lambda device: device.diagnosed('lamp', 'agreed'))
        assert monitor.press('+').startswith('done')
        assert monitor.press('r').startswith('done')

        shown = monitor.wait(lambda device: device.number('link', 'round_trip_ms'))
        assert shown.diagnosed('lamp', 'vendor') == 'maker'
        assert shown.values['temperature'] == 61.5
        assert (light.fake.fields['strobe_period'], light.fake.fields['brightness']) == (1.0, 40.0)


@pytest.mark.parametrize(('simulated', 'module', 'keys'), [
    ('gimbal_manager', 'gimbal', 'tl'), ('rededge', 'rededge', ('p', 'space'))])
def test_monitor_operates_a_gimbal_and_a_camera(
    own_ros: Ros, port: int, monitor: Watching, simulated: str, module: str, keys: Sequence[str],
) -> None:
    # By the clock of this machine: by the slow one, a capture takes long.
    url = f'127.0.0.1:{port}'
    with (ended(python('illuminator_ros.simulator', f'udpout://{url}', '--payload', simulated)),
          ended(python(f'illuminator_ros.{module}', f'udpin://{url}', env={
              'ROS_DOMAIN_ID': str(own_ros.domain)})) as node):
        node.wait_for('link open')
        monitor.wait(lambda device: device.state == 'ok', f'/{module}')
        for key in keys:
            # Again where the machine has paused for longer than a heartbeat may.
            while not monitor.press(key, f'/{module}').startswith('done'):
                pass
        # An attitude, or the image that was captured.
        topic = {'gimbal': 'angles', 'rededge': 'image/index'}[module]
        monitor.wait(lambda device: topic in device.values, f'/{module}')


def test_topics_of_the_views_are_those_of_the_nodes() -> None:
    # The views have tables of their own, since those of the nodes would import MAVLink.
    for view, publications in ((VIEWS[0], PUBLICATIONS), (VIEWS[2], GIMBAL_TOPICS)):
        published = {one.name: one.type for one in publications} | {'source': String}
        assert {name: topic.type for name, topic in view.topics.items()}.items() <= (
            published.items())


def test_off_by_silence_is_announced_can_be_delayed_and_is_reported(
    own_ros: Ros, port: int, monitor: Watching,
) -> None:
    def left(device: Device) -> float:
        return device.number('lamp', 'off_in_s') or 0.0

    with (running_bridge(own_ros.domain, port, diagnostics_period=0.1,
                         off_after_silence=1.5) as bridge, ServedLight(port)):
        monitor.wait(lambda device: device.state == 'off')
        monitor.press('space')
        monitor.wait(left)
        CLOCK.forward(0.8)
        shown = monitor.wait(lambda device: 0 < left(device) < 0.7)
        assert '(o: keep on)' in shown.view.notice(shown)

        assert monitor.press('o').startswith('done')
        monitor.wait(lambda device: left(device) > 0.7)

        CLOCK.forward(1.5)
        monitor.wait(lambda device: 'by off_after_silence' in device.news[0])
        monitor.wait(lambda device: device.state == 'off' and not device.view.notice(device))
        # Once, when the light has shown it.
        assert bridge.count('by off_after_silence (1.50 s)') == 1


class FakeBridge:
    """The topics of a light that is on at 10 %, without services."""

    def __init__(self, ros: Ros, name: str) -> None:
        self._node = ros.node
        self.publishers = {}
        for topic, value in (('connected', True), ('enabled', True), ('brightness', 10.0),
                             ('error_flags', 0)):
            self.publishers[topic] = self._node.create_publisher(
                TYPES[topic], f'{name}/{topic}', STATE)
            self.publishers[topic].publish(TYPES[topic](data=value))

    def destroy(self) -> None:
        """Leave the graph."""
        for publisher in self.publishers.values():
            self._node.destroy_publisher(publisher)


def test_device_that_leaves_is_gone_can_be_cleared_and_can_return(
    own_ros: Ros, monitor: Watching,
) -> None:
    FakeBridge(own_ros, '/two')
    eventually(lambda: monitor.names == ['/two'])
    first = FakeBridge(own_ros, '/one')
    eventually(lambda: monitor.names == ['/one', '/two'])

    first.destroy()
    monitor.wait(lambda device: device.state == 'gone', '/one')
    again = FakeBridge(own_ros, '/one')
    monitor.wait(lambda device: device.state == 'ON', '/one')
    again.destroy()
    monitor.wait(lambda device: device.state == 'gone', '/one')
    monitor.graph.clear_gone()
    assert monitor.names == ['/two']

    FakeBridge(own_ros, '/one')
    monitor.wait(lambda device: device.values.get('brightness') == 10.0, '/one')


def test_a_name_of_two_nodes_is_counted_twice(own_ros: Ros, monitor: Watching) -> None:
    bridges = [Node('one', context=own_ros.node.context) for _ in range(2)]
    FakeBridge(own_ros, '/one')
    monitor.wait(lambda device: device.conflict == '2 nodes with this name', '/one')

    bridges.pop().destroy_node()
    monitor.wait(lambda device: not device.conflict, '/one')
    bridges.pop().destroy_node()


def test_hostile_graph_neither_stops_nor_fills_the_monitor(
    own_ros: Ros, monitor: Watching, monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(ros_graph, 'MAX_DEVICES', 3)
    bridges = [FakeBridge(own_ros, f'/l{number}') for number in range(5)]
    mode = own_ros.node.create_publisher(String, '/l0/mode', STATE)
    mode.publish(String(data='\x1b[2J' + 'x' * 5000))
    diagnostics = own_ros.node.create_publisher(DiagnosticArray, '/diagnostics', STREAM)
    monitor.wait(lambda device: device.state == 'ON' and 'mode' in device.values, '/l0')
    eventually(lambda: len(monitor.names) == 3)

    def flood() -> bool:
        for kind in range(ros_graph.MAX_DIAGNOSES + 1):
            diagnostics.publish(DiagnosticArray(status=[DiagnosticStatus(
                level=bytes([255]), name=f'x: {kind}\x1b', message='\x07' * 9, values=[
                    KeyValue(key='node', value='/l0'), KeyValue(key='k', value='\r\n'),
                    *(KeyValue(key=f'k{number}', value='v') for number in range(999))])]))
        # Too large to be read, and broken.
        mode.publish(String(data='y' * 100_000))
        for one in (diagnostics, bridges[0].publishers['enabled']):
            one.publish(b'\0\1\0\0\xff\xff\xff\xff')
        return bool(monitor.names and monitor.graph.devices[0].diagnoses)

    eventually(flood)
    shown = monitor.wait(lambda device: len(device.diagnoses) == ros_graph.MAX_DIAGNOSES, '/l0')
    assert (shown.values['enabled'], shown.state) == (True, 'ON')
    assert shown.values['mode'] == ' [2J' + 'x' * (ros_graph.MAX_TEXT - 4)
    for one in shown.diagnoses.values():
        assert (one.level, one.message) == (3, ' ' * 9)
        assert len(one.values) == ros_graph.MAX_VALUES
    assert all(text.isprintable() for text in shown.diagnoses)


@pytest.mark.parametrize(('topics', 'publishers', 'found'), [
    (SIGNATURE, {*SIGNATURE}, ['/bow']),
    ({name.replace('/bow', '/a/b'): type_ for name, type_ in SIGNATURE.items()},
     {name.replace('/bow', '/a/b') for name in SIGNATURE}, ['/a/b']),
    *(({name: type_ for name, type_ in SIGNATURE.items() if name != missing}, {*SIGNATURE}, [])
      for missing in SIGNATURE),
    (dict.fromkeys(SIGNATURE, 'std_msgs/msg/String'), {*SIGNATURE}, []),
    (SIGNATURE, {*SIGNATURE} - {'/bow/enabled'}, []),
    # Names that leave no room for those of all topics and services, or that ROS does not have.
    *(({topic.replace('/bow', name): type_ for topic, type_ in SIGNATURE.items()},
       {topic.replace('/bow', name) for topic in SIGNATURE}, [])
      for name in ('/' + 'x' * 234, '/' + 'x' * 190, '/a-b', '')),
])
def test_light_is_a_node_that_publishes_all_its_signature_topics_with_their_types(
    topics: dict[str, str], publishers: set[str], found: list[str],
) -> None:
    listed = [(name, [type_]) for name, type_ in topics.items()]

    assert [*ros_graph.devices_among(listed, VIEWS, lambda topic: int(topic in publishers))
            ] == found
