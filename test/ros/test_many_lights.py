# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Several lights on one link: a node for each, independent, and requests to all of them."""

from collections.abc import Iterator
import contextlib

from illuminator_ros.mavlink.dialect import mavlink
import pytest
from rclpy.node import NodeNameNonExistentError
from std_msgs.msg import Bool, Float32
from std_srvs.srv import SetBool
from support.light import Address, eventually, ON_OFF, ServedLight
from support.ports import free_port
from support.processes import Program
from support.ros import Parameters, Ros, running_bridge
from support.slow import pass_time_until

# s; the default.
HEARTBEAT_TIMEOUT = 3.0
# The first node serves the light that the target selects, in whatever order lights are heard.
NODES = {'/illuminator': Address(1, 244), '/illuminator_1_243': Address(1, 243),
         '/belly': Address(7, 243)}
FOR_ALL_LIGHTS = {'/enable_all', '/cmd/enable_all'}

Group = dict[str, ServedLight]


@pytest.fixture(scope='module')
def group(domain: int) -> Iterator[tuple[Program, Group]]:
    """Run a bridge and three lights."""
    port = free_port()
    with contextlib.ExitStack() as stack:
        bridge = stack.enter_context(running_bridge(
            domain, port, target_component=244, names='["7/243=belly"]'))
        lights = {node: stack.enter_context(ServedLight(port, source))
                  for node, source in sorted(NODES.items(), key=lambda item: item[1])}
        bridge.wait_for('connected', count=3)
        yield bridge, lights


# Topics and services of the first node for the whole process.
OF_PROCESS = {'/diagnostics', '/get_logger_levels', '/set_logger_levels',
              '/get_type_description', '/parameter_events'}


@pytest.fixture
def lights(group: tuple[Program, Group]) -> Iterator[Group]:
    """Return the lights by their nodes, all off and obedient, which a test may change."""
    for light in group[1].values():
        light.report(enable=0, brightness=100.0)
        light.forget()
    yield group[1]
    for light in group[1].values():
        light.behave()


def interface(ros: Ros, node: str) -> set[tuple[str, str]]:
    """Return names and types of a node's topics and services, without the node's name."""
    graph, name = ros.node, node.lstrip('/')
    try:
        found = [*graph.get_publisher_names_and_types_by_node(name, '/'),
                 *graph.get_subscriber_names_and_types_by_node(name, '/'),
                 *graph.get_service_names_and_types_by_node(name, '/')]
    except NodeNameNonExistentError:
        return set()
    return {(topic.removeprefix(node), types[0]) for topic, types in found}


@pytest.mark.parametrize('node', [node for node in NODES if node != '/illuminator'])
def test_further_light_has_the_interface_of_the_first_one_but_for_all_lights_and_the_process(
    ros: Ros, lights: Group, node: str,
) -> None:
    def missing() -> set[str]:
        return {name for name, _ in interface(ros, '/illuminator') ^ interface(ros, node)}

    eventually(
        lambda: len(interface(ros, '/illuminator')) > 20
        and missing() == FOR_ALL_LIGHTS | OF_PROCESS)


def test_nodes_show_set_and_switch_their_own_lights(ros: Ros, lights: Group) -> None:
    for number, light in enumerate(lights.values()):
        light.report(brightness=10.0 * (number + 1))
    for number, node in enumerate(lights):
        ros.subscribe(Float32, f'{node}/brightness').wait_value(10.0 * (number + 1))
        Parameters(ros, node).wait(brightness=10.0 * (number + 1))
    for number, node in enumerate(lights):
        assert Parameters(ros, node).set(brightness=20.0 + number)[0].successful
    assert [light.fake.fields['brightness'] for light in lights.values()] == [20.0, 21.0, 22.0]
    assert ros.enable(node='/belly').success
    assert [name for name, light in lights.items() if light.commands(ON_OFF)] == ['/belly']


@pytest.mark.parametrize('node', ['/illuminator', '/belly'])
def test_lost_light_keeps_its_node_and_is_served_again_when_it_returns(
    ros: Ros, group: tuple[Program, Group], lights: Group, node: str,
) -> None:
    connected = ros.subscribe(Bool, f'{node}/connected')
    connected.wait_value(True)
    connected.clear()
    served = group[0].count('is served by')

    lights[node].vanish()
    ros.outlast(HEARTBEAT_TIMEOUT + 0.5, [other for other in NODES if other != node])
    connected.wait_value(False)
    assert f'light {NODES[node]} is lost' in ros.enable(node=node).message

    lights[node].serve()
    connected.wait_value(True)
    assert ros.enable(node=node).success
    assert group[0].count('is served by') == served


def enable_all(ros: Ros, on: bool = True) -> SetBool.Response:
    answer: SetBool.Response = ros.call(
        SetBool, '/illuminator/enable_all', SetBool.Request(data=on))
    return answer


def are_on(lights: Group) -> dict[str, bool]:
    return {node: bool(light.fake.fields['enable']) for node, light in lights.items()}


def test_one_request_switches_all_lights_and_names_each(ros: Ros, lights: Group) -> None:
    response = enable_all(ros)

    assert (response.success, set(are_on(lights).values())) == (True, {True})
    summary, *outcomes = response.message.split('; ')
    assert summary == '3 of 3 on'
    assert {outcome.partition(': ')[0] for outcome in outcomes} == {
        f'{node[1:]} ({address})' for node, address in NODES.items()}
    assert enable_all(ros, on=False).success
    assert set(are_on(lights).values()) == {False}


def test_topic_switches_all_lights_and_a_failure_is_logged(
    ros: Ros, group: tuple[Program, Group], lights: Group,
) -> None:
    lights['/belly'].fake.results[ON_OFF] = mavlink.MAV_RESULT_DENIED

    ros.publish(Bool, '/illuminator/cmd/enable_all', True)

    eventually(lambda: are_on(lights) == {node: node != '/belly' for node in NODES})
    pass_time_until(lambda: group[0].count('~/cmd/enable_all: 2 of 3 on; '), step=0.1)


def test_request_to_all_fails_while_no_light_is_connected(own_ros: Ros, port: int) -> None:
    with running_bridge(own_ros.domain, port):
        response = enable_all(own_ros)

    assert not response.success
    assert response.message.startswith('no light connected: ')
