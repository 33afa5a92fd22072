# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Which node serves which light: targets, names, remapping, parameter files."""

from collections.abc import Callable, Iterator
import contextlib
from pathlib import Path
from typing import Any

import pytest
from std_msgs.msg import Float32
from support.light import Address, CONFIGURE, eventually, ServedLight
from support.ports import free_port
from support.processes import Program
from support.ros import Parameters, Ros, running_bridge
from support.slow import CLOCK

FIRST, SECOND, OTHER = Address(1, 243), Address(1, 244), Address(7, 243)
# s after which a name whose light has not been heard is logged.
NAME_GRACE = 10.0
Start = Callable[..., tuple[Program, list[ServedLight]]]


@pytest.fixture
def start(own_ros: Ros) -> Iterator[Start]:
    """Return a function that runs a bridge and lets lights appear one after the other."""
    with contextlib.ExitStack() as stack:
        def run_all(
            *arguments: str, sources: tuple[Address, ...] = (FIRST, SECOND),
            unserved: tuple[Address, ...] = (), **parameters: Any,
        ) -> tuple[Program, list[ServedLight]]:
            port = free_port()
            bridge = stack.enter_context(running_bridge(
                own_ros.domain, port, *arguments, **parameters))
            lights = []
            for source in sources:
                lights.append(stack.enter_context(ServedLight(port, source)))
                if source not in unserved:
                    bridge.wait_for(f'light {source} connected')
            return bridge, lights

        yield run_all


def nodes(ros: Ros) -> set[str]:
    """Return the full names of all nodes but our own."""
    return {namespace.rstrip('/') + '/' + name for name, namespace
            in ros.node.get_node_names_and_namespaces()} - {'/tester'}


def light_of(ros: Ros, node: str, lights: list[ServedLight]) -> Address:
    """Return the address of the light that a node switches on."""
    assert ros.enable(node=node).success
    (light,) = [light for light in lights if light.fake.fields['enable']]
    light.report(enable=0)
    return light.fake.source


@pytest.mark.parametrize(('target', 'sources', 'chosen'), [
    ({}, (SECOND, FIRST), SECOND),
    ({'target_component': 244}, (FIRST, SECOND, OTHER), SECOND),
    ({'target_system': 7}, (FIRST, SECOND, OTHER), OTHER),
], ids=['none', 'component', 'system'])
def test_first_node_serves_the_target_or_else_the_first_light_heard(
    own_ros: Ros, start: Start, target: dict[str, int], sources: tuple[Address, ...],
    chosen: Address,
) -> None:
    bridge, lights = start(sources=sources, **target)

    assert light_of(own_ros, '/illuminator', lights) == chosen
    for source in set(sources) - {chosen}:
        node = f'/illuminator_{source.system}_{source.component}'
        assert light_of(own_ros, node, lights) == source
    # Several lights that the target selects are a warning.
    ambiguous = sum(target.get('target_component', one.component) == one.component
                    and target.get('target_system', one.system) == one.system
                    for one in sources) > 1
    warnings = [line for line in bridge.lines
                if '[WARN]' in line and ', was found; /illuminator serves ' in line]
    assert len(warnings) == ambiguous


def test_only_target_leaves_other_lights_alone_and_unused_names_are_logged(
    own_ros: Ros, start: Start,
) -> None:
    bridge, lights = start(
        sources=(OTHER, FIRST, SECOND), unserved=(OTHER,), target_system=1, only_target=True,
        names='["1/244=stern", "1/250=mast", "7/243=nose"]')

    assert light_of(own_ros, '/illuminator', lights) == FIRST
    eventually(lambda: nodes(own_ros) == {'/illuminator', '/stern'})
    assert list(lights[0].fake.received) == []
    assert not bridge.count('names: ')
    CLOCK.forward(NAME_GRACE)
    bridge.wait_for('names: 1/250=mast is not used yet')
    bridge.wait_for('names: 7/243=nose is not used')
    assert bridge.count('names: ') == 2
    with ServedLight(lights[0].port, Address(1, 250)):
        bridge.wait_for('light 1/250 is served by /mast')


def test_remapping_that_gives_two_nodes_the_same_service_or_topic_is_logged(start: Start) -> None:
    bridge, _ = start(
        '-r', '~/enable:=/lamp', '-r', '~/cmd/enable:=/on', '-r', 'illuminator:~/refresh:=/again')

    bridge.wait_for('[illuminator_1_244]: /lamp, /on: /illuminator has the same')
    assert bridge.count('has the same') == 1


def test_remapped_node_name_is_that_of_the_first_node_only(own_ros: Ros, start: Start) -> None:
    bridge, _ = start('--remap', '__name:=spot', names='["7/243=illuminator", "1/243=bow"]',
                      sources=(FIRST, SECOND, OTHER))

    # The default name of the first node is free.
    eventually(lambda: nodes(own_ros) == {'/spot', '/spot_1_244', '/illuminator'})
    bridge.wait_for('names: 1/243=bow is not used, since light 1/243 is served by the first node, '
                    'spot: -r __node:=bow renames it')


def test_namespace_holds_for_all_nodes_and_remapping_for_the_named_one(
    own_ros: Ros, start: Start,
) -> None:
    _, lights = start('-r', '__ns:=/uav1', '-r', 'illuminator_1_244:~/brightness:=/stern')

    eventually(lambda: nodes(own_ros) == {'/uav1/illuminator', '/uav1/illuminator_1_244'})
    assert light_of(own_ros, '/uav1/illuminator_1_244', lights) == SECOND
    own_ros.subscribe(Float32, '/stern').wait_value(100.0)
    own_ros.subscribe(Float32, '/uav1/illuminator/brightness').wait_value(100.0)


def test_each_node_takes_its_own_section_of_a_parameter_file_but_for_link_parameters(
    own_ros: Ros, start: Start, tmp_path: Path,
) -> None:
    file = tmp_path / 'lights.yaml'
    file.write_text(
        '/**: {ros__parameters: {heartbeat_timeout: 4, names: ["7/9=nose"], frame_id: hull, '
        'sources: [], max_brightness: 100.0}}\n'
        '/illuminator: {ros__parameters: {brightness: 30.0}}\n'
        '/illuminator_1_244: {ros__parameters: {brightness: 40, mode: external_sync, '
        'status_interval: 0.5, frame_id: stern}}\n')

    bridge, lights = start('--params-file', str(file))

    for light, brightness in zip(lights, (30.0, 40.0), strict=True):
        assert light.wait_for(CONFIGURE)[0].param2 == brightness
    Parameters(own_ros, '/illuminator').wait(brightness=30.0, mode='internal_control')
    Parameters(own_ros, '/illuminator_1_244').wait(
        brightness=40.0, mode='external_sync', frame_id='stern')
    bridge.wait_for("parameter 'status_interval' is ignored: it is given for illuminator_1_244, "
                    'but is a parameter of /illuminator')
    assert bridge.count('ignored') == 1
