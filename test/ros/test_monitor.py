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

"""The monitor in a ROS graph: which lights it finds, what it shows and asks of them."""

from collections.abc import Iterator
from typing import Any

from illuminator_ros.cli.monitor.graph import lights_among, TOPICS, type_name
from illuminator_ros.cli.monitor.key_bindings import (
    dim,
    refresh,
    Request,
    strobe,
    switch,
)
from illuminator_ros.cli.monitor.model import Light, Outcome, State
import pytest
from std_msgs.msg import Bool, Float32, UInt32
from support.light import Address, CONFIGURE, ServedLight
from support.monitors import Watching, watching
from support.ports import free_port
from support.ros import Ros, running_bridge, STATE
from support.slow import pass_time_until

VALUES = {'temperature': 61.5, 'mode': 'external_sync', 'connected': True, 'enabled': True,
          'brightness': 30.0, 'strobe_period': 0.5, 'strobe_duty_cycle': 20.0}
SIGNATURE = {f'/bow/{topic}': type_name(TOPICS[topic])
             for topic in ('connected', 'enabled', 'brightness', 'error_flags')}


@pytest.fixture(scope='module')
def watched(ros: Ros, shared_bridge: object) -> Iterator[Watching]:
    """Watch the module's domain."""
    with watching(ros) as made:
        yield made


@pytest.fixture
def monitor(watched: Watching, light: ServedLight) -> Watching:
    """Return the monitor, which knows a light that is off, at 50 % and steady."""
    light.behave()
    light.report(enable=0, mode=1, brightness=50.0, strobe_period=0.0, strobe_duty_cycle=0.0,
                 error_status=0, temp_c=25.0)
    watched.wait(lambda light: light.value('brightness') == 50.0 and light.setpoint == 50.0
                 and light.value('enabled') is False and light.value('strobe_period') == 0.0
                 and light.value('error_flags') == 0 and not light.wanted)
    return watched


def darker(light: Light) -> Request | None:
    return dim(light, -10.0)


def test_monitor_shows_values_flags_link_quality_and_identity_of_the_light(
    light: ServedLight, monitor: Watching,
) -> None:
    assert monitor.names == ['/illuminator']
    monitor.wait(lambda light: light.state(light.heard_at) is State.OFF)

    light.report(enable=1, brightness=30.0, temp_c=61.5, error_status=1, strobe_period=0.5,
                 strobe_duty_cycle=20.0, mode=2)

    shown = monitor.wait(
        lambda light: light.flags == ['thermal throttling'] and light.link and light.lamp
        and all(light.value(name) == value for name, value in VALUES.items())
        and light.link.number('round_trip_p50_ms') is not None)
    assert shown.link is not None and shown.link.number('loss_percent') == 0.0
    assert shown.lamp is not None and shown.lamp.values['vendor'] == 'maker'


def test_throttled_light_keeps_its_setpoint(light: ServedLight, monitor: Watching) -> None:
    light.report(brightness=20.0, error_status=1)

    assert monitor.wait(lambda light: light.value('brightness') == 20.0).setpoint == 50.0


def test_lost_light_is_marked_until_it_returns(light: ServedLight, monitor: Watching) -> None:
    light.fake.silent = True
    pass_time_until(lambda: monitor.light().value('connected') is False)
    assert monitor.light().state(monitor.light().heard_at) is State.LOST

    light.behave()
    monitor.wait(lambda light: light.value('connected') is True)


def test_switch_and_refresh_are_answered_by_the_bridge(
    light: ServedLight, monitor: Watching,
) -> None:
    monitor.ask(switch)
    assert 'confirmed by ILLUMINATOR_STATUS' in monitor.outcome('on', Outcome.DONE)
    assert light.fake.fields['enable'] == 1
    monitor.wait(lambda light: light.value('enabled') is True)

    monitor.ask(refresh)
    assert monitor.outcome('refresh', Outcome.DONE)


def test_steps_add_up_and_a_strobe_is_one_command(light: ServedLight, monitor: Watching) -> None:
    for _ in range(4):
        monitor.ask(darker)
    monitor.outcome('brightness 10 %', Outcome.DONE)
    assert light.fake.fields['brightness'] == 10.0
    assert len(light.commands(CONFIGURE)) <= 4
    light.forget()

    monitor.ask(strobe)
    monitor.outcome('strobe 1 s, 50 %', Outcome.DONE)
    assert len(light.commands(CONFIGURE)) == 1
    assert (light.fake.fields['strobe_period'], light.fake.fields['strobe_duty_cycle']) == (
        1.0, 50.0)


def test_two_monitors_show_the_same(ros: Ros, monitor: Watching) -> None:
    with watching(ros) as other:
        other.wait(lambda light: light.setpoint == 50.0)

        other.ask(darker)

        other.outcome('brightness 40 %', Outcome.DONE)
        monitor.wait(lambda light: light.setpoint == 40.0)


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
    with watching(own_ros) as monitor:
        first = FakeBridge(own_ros, '/one')
        FakeBridge(own_ros, '/two')
        monitor.wait_names('/one', '/two')

        first.destroy()
        monitor.wait(lambda light: light.gone_at is not None, '/one')
        monitor.clear_gone()
        monitor.wait_names('/two')

        FakeBridge(own_ros, '/one')
        monitor.wait(lambda light: light.value('brightness') == 10.0, '/one')


def test_bridges_of_one_node_name_in_two_namespaces_are_distinct(own_ros: Ros) -> None:
    ports = [free_port(), free_port()]
    often: Any = {'diagnostics_period': 0.1}
    with (running_bridge(own_ros.domain, ports[0], '-r', '__ns:=/uav1', **often),
          running_bridge(own_ros.domain, ports[1], '-r', '__ns:=/uav2', **often),
          ServedLight(ports[0], brightness=10.0),
          ServedLight(ports[1], Address(9, 9), brightness=20.0),
          watching(own_ros) as monitor):
        monitor.wait_names('/uav1/illuminator', '/uav2/illuminator')
        for name, address, brightness in (('/uav1/illuminator', '1/243', 10.0),
                                          ('/uav2/illuminator', '9/9', 20.0)):
            shown = monitor.wait(lambda light: light.lamp and light.setpoint is not None, name)
            assert shown.lamp is not None
            assert (shown.lamp.values['address'], shown.setpoint) == (address, brightness)


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
