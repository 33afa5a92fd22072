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

"""Several lights on one link: a node for each, and none waits for another (DESIGN.md, 3.6)."""

from collections.abc import Iterator
import contextlib

import pytest
from rclpy.node import NodeNameNonExistentError
from std_msgs.msg import Bool, Float32
from std_srvs.srv import SetBool, Trigger
from support.light import Address, eventually, MavResult, ON_OFF, ServedLight
from support.ports import free_port
from support.processes import Program
from support.ros import Parameters, Ros, running_bridge
from support.slow import pass_time_until

# s; the default.
HEARTBEAT_TIMEOUT = 3.0
# The first one is that which the target selects, whoever is heard first.
NODES = {'/illuminator': Address(1, 244), '/illuminator_1_243': Address(1, 243),
         '/belly': Address(7, 243)}
FURTHER = [node for node in NODES if node != '/illuminator']
FLEET_ONLY = {'/enable_all', '/cmd/enable_all'}

Fleet = dict[str, ServedLight]


@pytest.fixture(scope='module')
def fleet(domain: int) -> Iterator[tuple[Program, Fleet]]:
    """Run a bridge and three lights."""
    port = free_port()
    with contextlib.ExitStack() as stack:
        bridge = stack.enter_context(running_bridge(
            domain, port, target_component=244, names='["7/243=belly"]'))
        lights = {node: stack.enter_context(ServedLight(port, source))
                  for node, source in sorted(NODES.items(), key=lambda item: item[1])}
        bridge.wait_for('connected', count=3)
        yield bridge, lights


@pytest.fixture
def lights(fleet: tuple[Program, Fleet]) -> Iterator[Fleet]:
    """Return the lights by their nodes, all off and obedient, which a test may change."""
    for light in fleet[1].values():
        light.report(enable=0, brightness=100.0)
        light.forget()
    yield fleet[1]
    for light in fleet[1].values():
        light.behave()


def enable(node: str, ros: Ros) -> SetBool.Response:
    return ros.call(SetBool, f'{node}/enable', SetBool.Request(data=True))


def interface(ros: Ros, node: str) -> set[tuple[str, str]]:
    """Return names and types of what a node offers, without its own name; none before it is."""
    graph, name = ros.node, node.lstrip('/')
    try:
        found = [*graph.get_publisher_names_and_types_by_node(name, '/'),
                 *graph.get_subscriber_names_and_types_by_node(name, '/'),
                 *graph.get_service_names_and_types_by_node(name, '/')]
    except NodeNameNonExistentError:
        return set()
    return {(topic.removeprefix(node), types[0]) for topic, types in found}


def test_names_are_from_ids_or_from_the_parameter(ros: Ros, lights: Fleet) -> None:
    eventually(lambda: {*NODES} <= {f'/{name}' for name in ros.node.get_node_names()})


@pytest.mark.parametrize('node', FURTHER)
def test_a_further_light_has_all_that_the_first_one_has_but_what_is_for_all(
    ros: Ros, lights: Fleet, node: str,
) -> None:
    def missing() -> set[str]:
        return {name for name, _ in interface(ros, '/illuminator') ^ interface(ros, node)}

    eventually(lambda: len(interface(ros, '/illuminator')) > 20 and missing() == FLEET_ONLY)


@pytest.mark.parametrize('node', NODES)
def test_each_node_commands_its_own_light_only(ros: Ros, lights: Fleet, node: str) -> None:
    assert enable(node, ros).success
    assert [name for name, light in lights.items() if light.fake.fields['enable']] == [node]
    assert [name for name, light in lights.items() if light.commands(ON_OFF)] == [node]


def test_each_node_shows_its_own_light(ros: Ros, lights: Fleet) -> None:
    for number, light in enumerate(lights.values()):
        light.report(brightness=10.0 * (number + 1))
    for number, node in enumerate(lights):
        ros.subscribe(Float32, f'{node}/brightness').wait_value(10.0 * (number + 1))
        Parameters(ros, node).wait(brightness=10.0 * (number + 1))


def test_each_node_sets_its_own_light(ros: Ros, lights: Fleet) -> None:
    for number, node in enumerate(lights):
        assert Parameters(ros, node).set(brightness=20.0 + number)[0].successful
    assert [light.fake.fields['brightness'] for light in lights.values()] == [20.0, 21.0, 22.0]


@pytest.mark.parametrize('silent', NODES)
def test_while_one_light_is_silent_the_others_answer(
    ros: Ros, lights: Fleet, silent: str,
) -> None:
    lights[silent].fake.results[ON_OFF] = None
    waiting = ros.start(SetBool, f'{silent}/enable', SetBool.Request(data=True))
    lights[silent].wait_for(ON_OFF)

    for node in NODES:
        assert node == silent or enable(node, ros).success

    assert not waiting.answered
    lights[silent].acknowledge(ON_OFF, MavResult.FAILED, source=NODES[silent])
    assert 'MAV_RESULT_FAILED' in waiting.result().message


def test_while_one_light_is_silent_parameters_and_topics_of_another_go_on(
    ros: Ros, lights: Fleet,
) -> None:
    lights['/illuminator'].fake.results[ON_OFF] = None
    enabled = ros.subscribe(Bool, '/belly/enabled')
    waiting = ros.start(SetBool, '/illuminator/enable', SetBool.Request(data=True))
    lights['/illuminator'].wait_for(ON_OFF)
    enabled.clear()

    assert Parameters(ros, '/belly').set(brightness=33.0)[0].successful
    enabled.wait_value(False)

    assert not waiting.answered
    lights['/illuminator'].acknowledge(ON_OFF, MavResult.FAILED, source=NODES['/illuminator'])
    waiting.result()


@pytest.mark.parametrize('node', NODES)
def test_a_lost_light_keeps_its_node_and_is_served_again_when_it_returns(
    ros: Ros, fleet: tuple[Program, Fleet], lights: Fleet, node: str,
) -> None:
    connected = ros.subscribe(Bool, f'{node}/connected')
    connected.wait_value(True)
    connected.clear()
    served = fleet[0].count('is served by')

    lights[node].vanish()
    ros.outlast(HEARTBEAT_TIMEOUT, [other for other in NODES if other != node])
    connected.wait_value(False)
    assert f'light {NODES[node]} is lost' in enable(node, ros).message
    assert all(enable(other, ros).success for other in NODES if other != node)

    lights[node].serve()
    connected.wait_value(True)
    assert enable(node, ros).success
    refreshed = ros.start(Trigger, f'{node}/refresh', Trigger.Request())
    # A status that was asked for when it had gone already is first asked for once more.
    pass_time_until(lambda: refreshed.answered, step=0.1)
    assert refreshed.result().success
    assert fleet[0].count('is served by') == served
