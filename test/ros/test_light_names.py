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

"""Which light is whose: names, parameter files, remapping, targets (DESIGN.md, 3.6)."""

from collections.abc import Callable, Iterator
import contextlib
from pathlib import Path

from illuminator_ros.ros.light_names import PATIENCE
import pytest
from std_msgs.msg import Float32
from std_srvs.srv import SetBool
from support.light import Address, CONFIGURE, eventually, ServedLight
from support.ports import free_port
from support.processes import Program, run
from support.ros import Parameters, Ros, running_bridge
from support.slow import CLOCK

FIRST, SECOND, OTHER = Address(1, 243), Address(1, 244), Address(7, 243)
Start = Callable[..., tuple[Program, list[ServedLight]]]


@pytest.fixture
def start(own_ros: Ros) -> Iterator[Start]:
    """Return a function that runs a bridge and lets lights appear one after the other."""
    with contextlib.ExitStack() as stack:
        def run_all(
            *arguments: str, sources: tuple[Address, ...] = (FIRST, SECOND),
            unserved: tuple[Address, ...] = (), **parameters: object,
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
    assert ros.call(SetBool, f'{node}/enable', SetBool.Request(data=True)).success
    (light,) = [light for light in lights if light.fake.fields['enable']]
    light.report(enable=0)
    return light.fake.source


def test_the_first_one_heard_is_illuminator_where_no_target_is_given(
    own_ros: Ros, start: Start,
) -> None:
    _, lights = start(sources=(SECOND, FIRST))
    assert light_of(own_ros, '/illuminator', lights) == SECOND
    assert light_of(own_ros, '/illuminator_1_243', lights) == FIRST


@pytest.mark.parametrize(('target', 'chosen'), [
    ({'target_component': 244}, SECOND),
    ({'target_system': 7}, OTHER),
    ({'target_system': 1, 'target_component': 244}, SECOND),
], ids=['component', 'system', 'both'])
def test_the_target_chooses_who_is_illuminator(
    own_ros: Ros, start: Start, target: dict[str, int], chosen: Address,
) -> None:
    _, lights = start(sources=(FIRST, SECOND, OTHER), **target)
    assert light_of(own_ros, '/illuminator', lights) == chosen


def test_only_the_target_is_served_where_that_is_asked_for(own_ros: Ros, start: Start) -> None:
    _, lights = start(sources=(OTHER, FIRST, SECOND), unserved=(OTHER,),
                      target_system=1, only_target=True)
    assert light_of(own_ros, '/illuminator', lights) == FIRST
    assert light_of(own_ros, '/illuminator_1_244', lights) == SECOND
    assert nodes(own_ros) == {'/illuminator', '/illuminator_1_244'}
    assert lights[0].fake.received == []


@pytest.mark.parametrize('remap', [('-r', '__node:=spot'), ('--remap', '__node:=spot'),
                                   ('-r', '__name:=spot')])
def test_a_remapped_node_name_is_that_of_the_first_one_only(
    own_ros: Ros, start: Start, remap: tuple[str, str],
) -> None:
    start(*remap, names='["7/243=belly"]', sources=(FIRST, SECOND, OTHER))
    eventually(lambda: nodes(own_ros) == {'/spot', '/spot_1_244', '/belly'})


def test_a_namespace_is_that_of_all(own_ros: Ros, start: Start) -> None:
    _, lights = start('-r', '__ns:=/uav1')
    eventually(lambda: nodes(own_ros) == {'/uav1/illuminator', '/uav1/illuminator_1_244'})
    assert light_of(own_ros, '/uav1/illuminator_1_244', lights) == SECOND


def test_a_topic_of_one_node_can_be_remapped(own_ros: Ros, start: Start) -> None:
    start('-r', 'illuminator_1_244:~/brightness:=/stern')
    own_ros.subscribe(Float32, '/stern').wait_value(100.0)
    own_ros.subscribe(Float32, '/illuminator/brightness').wait_value(100.0)


def test_each_node_has_its_own_section_in_a_parameter_file(
    own_ros: Ros, start: Start, tmp_path: Path,
) -> None:
    file = tmp_path / 'lights.yaml'
    file.write_text(
        '/illuminator: {ros__parameters: {brightness: 30.0}}\n'
        '/illuminator_1_244: {ros__parameters: {brightness: 40, mode: external_sync}}\n')
    _, lights = start('--params-file', str(file))
    for light, brightness in zip(lights, (30.0, 40.0), strict=True):
        assert light.wait_for(CONFIGURE)[0].param2 == brightness
    Parameters(own_ros, '/illuminator').wait(brightness=30.0, mode='internal_control')
    Parameters(own_ros, '/illuminator_1_244').wait(brightness=40.0, mode='external_sync')


def test_a_parameter_of_the_link_in_the_section_of_a_further_light_is_warned_about(
    own_ros: Ros, start: Start, tmp_path: Path,
) -> None:
    file = tmp_path / 'lights.yaml'
    file.write_text(
        '/**: {ros__parameters: {heartbeat_timeout: 4, names: ["7/9=nose"], frame_id: hull}}\n'
        '/illuminator_1_244: {ros__parameters: {status_interval: 0.5, frame_id: stern}}\n')
    bridge, _ = start('--params-file', str(file))
    bridge.wait_for("[illuminator_1_244]: parameter 'status_interval' is of the link, and ignored "
                    'here: that of /illuminator holds')
    assert bridge.count('ignored here') == 1


def test_a_wrong_parameter_of_a_further_light_is_named_and_the_others_go_on(
    own_ros: Ros, start: Start, tmp_path: Path,
) -> None:
    file = tmp_path / 'lights.yaml'
    file.write_text('/illuminator_1_244: {ros__parameters: {brightness: 400.0}}\n')
    bridge, lights = start('--params-file', str(file), unserved=(SECOND,))
    bridge.wait_for('light 1/244 gets no node: brightness 400 % is out of range')
    assert light_of(own_ros, '/illuminator', lights) == FIRST


def test_a_name_for_the_light_of_the_first_node_is_said_to_be_of_no_use(start: Start) -> None:
    bridge, _ = start('-r', '__node:=spot', names='["1/243=bow", "1/244=stern"]')
    bridge.wait_for('names: 1/243=bow is not used, since light 1/243 is served by the first node, '
                    'spot: -r __node:=bow names that')
    bridge.wait_for('light 1/244 is served by /stern')


def test_names_of_lights_that_are_not_there_are_said_to_be_of_no_use(start: Start) -> None:
    bridge, _ = start(names='["1/244=stern", "1/250=mast", "7/243=nose"]', target_system=1,
                      only_target=True)
    assert not bridge.count('names: ')
    CLOCK.forward(PATIENCE)
    bridge.wait_for('names: 1/250=mast is not used yet, since no light 1/250 has been heard')
    bridge.wait_for('names: 7/243=nose is not used, since only_target leaves light 7/243 alone')
    assert bridge.count('names: ') == 2


def test_a_light_that_comes_late_has_its_name_all_the_same(start: Start) -> None:
    bridge, lights = start(names='["1/244=stern"]', sources=(FIRST,))
    CLOCK.forward(PATIENCE)
    bridge.wait_for('names: 1/244=stern is not used yet')
    with ServedLight(lights[0].port, SECOND):
        bridge.wait_for('light 1/244 is served by /stern')


def test_no_light_can_have_the_name_of_the_first_node(own_ros: Ros) -> None:
    done = run('illuminator_ros.bridge', '--ros-args', '-r', '__node:=spot',
               '-p', 'names:=["1/244=spot"]', env={'ROS_DOMAIN_ID': str(own_ros.domain)})
    assert done.returncode == 2
    assert "parameter names: '1/244=spot' is the name of the first node" in done.stderr
