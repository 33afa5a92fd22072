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

"""The monitor in a ROS graph: the lights that it finds, their values, and its requests."""

from collections.abc import Callable, Iterator
import contextlib
from typing import Any

from illuminator_ros.cli.monitor import key_bindings
from illuminator_ros.cli.monitor.model import Light, Outcome, State
from illuminator_ros.cli.monitor.ros_graph import lights_among, TOPICS
from illuminator_ros.cli.monitor.run import Monitor
from illuminator_ros.illuminator.ros.event_publisher import PUBLICATIONS
from illuminator_ros.ros.graph import type_name
import pytest
from rclpy.node import Node
from std_msgs.msg import Bool, Float32, UInt32
from support.light import ServedLight
from support.ros import Ros, STATE
from support.slow import CLOCK
from support.waiting import eventually, PATIENCE

VALUES = {'temperature': 61.5, 'mode': 'external_sync', 'connected': True, 'enabled': True,
          'brightness': 30.0, 'strobe_period': 0.5, 'strobe_duty_cycle': 20.0}
SIGNATURE = {f'/bow/{topic}': type_name(TOPICS[topic])
             for topic in ('connected', 'enabled', 'brightness', 'error_flags')}


class Watching:
    """A monitor in the domain of a ROS client, by the slow clock."""

    def __init__(self, ros: Ros) -> None:
        self._node = Node('monitor', context=ros.context, enable_rosout=False,
                          start_parameter_services=False)
        self._monitor = Monitor(self._node, CLOCK)

    def close(self) -> None:
        """End the monitor."""
        self._monitor.end()
        self._node.destroy_node()

    @property
    def names(self) -> list[str]:
        """Return the names of the lights."""
        return [light.name for light in self._monitor.lights()]

    def light(self, name: str = '/illuminator') -> Light:
        """Return the known state of a light."""
        [light] = [light for light in self._monitor.lights() if light.name == name]
        return light

    def wait(self, condition: Callable[[Light], Any], name: str = '/illuminator',
             timeout: float = PATIENCE) -> Light:
        """Wait until a light is known and the condition holds; return it."""
        eventually(lambda: name in self.names, within=timeout)
        eventually(lambda: condition(self.light(name)), within=timeout)
        return self.light(name)

    def wait_names(self, *names: str) -> None:
        """Wait until the monitor has exactly these lights."""
        eventually(lambda: self.names == sorted(names))

    def ask(self, ask: key_bindings.Ask, name: str = '/illuminator') -> None:
        """Send a request to a light."""
        self._monitor.graph.submit(name, ask)

    def outcome(self, text: str, outcome: Outcome, name: str = '/illuminator') -> str:
        """Wait until a request has this outcome, and return the answer."""
        light = self.wait(lambda light: light.action and light.action.text == text
                          and light.action.outcome is outcome, name)
        assert light.action is not None
        return light.action.answer

    def clear_gone(self) -> None:
        """Forget the lights that are gone."""
        self._monitor.graph.clear_gone()


@pytest.fixture(scope='module')
def monitor(ros: Ros, shared_bridge: object) -> Iterator[Watching]:
    """Watch the module's domain."""
    with contextlib.closing(Watching(ros)) as made:
        yield made


def test_monitor_shows_a_light_with_the_link_and_identity_and_sends_its_requests(
    light: ServedLight, monitor: Watching,
) -> None:
    monitor.wait(lambda light: light.state(light.heard_at) is State.OFF)
    assert monitor.names == ['/illuminator']

    light.report(brightness=30.0, temp_c=61.5, error_status=1, strobe_period=0.5,
                 strobe_duty_cycle=20.0, mode=2)
    monitor.ask(key_bindings.switch)

    assert 'confirmed by ILLUMINATOR_STATUS' in monitor.outcome('on', Outcome.DONE)
    shown = monitor.wait(
        lambda light: light.flags == ['thermal throttling'] and light.link and light.lamp
        and all(light.value(name) == value for name, value in VALUES.items())
        and light.link.number('round_trip_p50_ms') is not None)
    assert shown.link is not None and shown.link.number('loss_percent') == 0.0
    assert shown.lamp is not None and shown.lamp.values['vendor'] == 'maker'
    assert light.fake.fields['enable'] == 1
    for ask, text in ((key_bindings.refresh, 'refresh'), (key_bindings.strobe, 'no strobe')):
        monitor.ask(ask)
        monitor.outcome(text, Outcome.DONE)
    assert light.fake.fields['strobe_period'] == 0.0
    light.report(mode=1, error_status=0, brightness=45.0)
    monitor.wait(lambda light: light.setpoint == 45.0)


def test_topics_of_the_monitor_are_those_of_a_light() -> None:
    # The monitor has a table of its own, since the import of the bridge's takes 0.15 s.
    assert {one.name: one.type for one in PUBLICATIONS} == TOPICS


class FakeBridge:
    """The topics of a light that is on at 10 %, without services."""

    def __init__(self, ros: Ros, name: str) -> None:
        self._node = ros.node
        self._publishers = []
        for topic, message in (('connected', Bool(data=True)), ('enabled', Bool(data=True)),
                               ('brightness', Float32(data=10.0)), ('error_flags', UInt32())):
            self._publishers.append(
                self._node.create_publisher(TOPICS[topic], f'{name}/{topic}', STATE))
            self._publishers[-1].publish(message)

    def destroy(self) -> None:
        """Leave the graph."""
        for publisher in self._publishers:
            self._node.destroy_publisher(publisher)


def test_light_that_leaves_is_marked_can_be_cleared_and_can_return(own_ros: Ros) -> None:
    with contextlib.closing(Watching(own_ros)) as monitor:
        first = FakeBridge(own_ros, '/one')
        FakeBridge(own_ros, '/two')
        monitor.wait_names('/one', '/two')

        first.destroy()
        monitor.wait(lambda light: light.gone_at is not None, '/one')
        monitor.clear_gone()
        monitor.wait_names('/two')

        FakeBridge(own_ros, '/one')
        monitor.wait(lambda light: light.value('brightness') == 10.0, '/one')


@pytest.mark.parametrize(('topics', 'publishers', 'found'), [
    (SIGNATURE, {*SIGNATURE}, ['/bow']),
    ({name.replace('/bow', '/a/b'): type_ for name, type_ in SIGNATURE.items()},
     {name.replace('/bow', '/a/b') for name in SIGNATURE}, ['/a/b']),
    *(({name: type_ for name, type_ in SIGNATURE.items() if name != missing}, {*SIGNATURE}, [])
      for missing in SIGNATURE),
    (dict.fromkeys(SIGNATURE, 'std_msgs/msg/String'), {*SIGNATURE}, []),
    (SIGNATURE, {*SIGNATURE} - {'/bow/enabled'}, []),
])
def test_light_is_a_node_that_publishes_all_its_signature_topics_with_their_types(
    topics: dict[str, str], publishers: set[str], found: list[str],
) -> None:
    listed = [(name, [type_]) for name, type_ in topics.items()]

    assert lights_among(listed, lambda topic: int(topic in publishers)) == found
