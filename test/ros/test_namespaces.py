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

"""Names are private, so namespaces and remapping work (DESIGN.md, 2)."""

from diagnostic_msgs.msg import DiagnosticArray
import pytest
from std_msgs.msg import Bool
from std_srvs.srv import SetBool
from support.light import ON_OFF, ServedLight
from support.ports import free_port
from support.ros import Parameters, Ros, running_bridge, STREAM

NAMESPACE = ('-r', '__ns:=/uav1')
NODE = ('-r', '__node:=spot')


def enable(ros: Ros, node: str) -> bool:
    return bool(ros.call(SetBool, f'{node}/enable', SetBool.Request(data=True)).success)


@pytest.mark.parametrize(('arguments', 'node'), [
    ((), '/illuminator'),
    (NAMESPACE, '/uav1/illuminator'),
    (NODE, '/spot'),
    (NAMESPACE + NODE, '/uav1/spot'),
])
def test_everything_follows_namespace_and_node_name(
    own_ros: Ros, port: int, arguments: tuple[str, ...], node: str,
) -> None:
    with running_bridge(own_ros.domain, port, *arguments) as bridge, ServedLight(port) as light:
        bridge.wait_for('connected')

        assert enable(own_ros, node)
        own_ros.subscribe(Bool, f'{node}/enabled').wait_value(True)
        assert Parameters(own_ros, node).set(brightness=20)[0].successful
        own_ros.publish(Bool, f'{node}/cmd/enable', False)
        light.wait_for(ON_OFF, 2)
        foreign = [name for name, _ in [*own_ros.node.get_topic_names_and_types(),
                                        *own_ros.node.get_service_names_and_types()]
                   if not name.startswith((f'{node}/', '/tester/'))]
        assert sorted(foreign) == ['/diagnostics', '/parameter_events', '/rosout']


def test_the_diagnostics_bear_the_node_s_name(own_ros: Ros, port: int) -> None:
    with running_bridge(own_ros.domain, port, *NODE), ServedLight(port):
        recorder = own_ros.subscribe(DiagnosticArray, '/diagnostics', STREAM)

        array = recorder.wait(lambda array: len(array.status) == 2)

        assert [status.name for status in array.status] == ['spot: link', 'spot: lamp']


def test_topics_can_be_remapped_one_by_one(own_ros: Ros, port: int) -> None:
    remapping = ('-r', '~/connected:=/lamp/alive', '-r', '/diagnostics:=/uav1/diagnostics')
    with running_bridge(own_ros.domain, port, *remapping):
        own_ros.subscribe(Bool, '/lamp/alive').wait_value(False)
        own_ros.subscribe(DiagnosticArray, '/uav1/diagnostics', STREAM).wait()


def test_two_bridges_in_two_namespaces_do_not_meet(own_ros: Ros) -> None:
    here, there = free_port(), free_port()
    with (running_bridge(own_ros.domain, here, *NAMESPACE) as first,
          running_bridge(own_ros.domain, there, '-r', '__ns:=/uav2') as second,
          ServedLight(here) as near, ServedLight(there) as far):
        first.wait_for('connected')
        second.wait_for('connected')

        assert enable(own_ros, '/uav2/illuminator')
        assert Parameters(own_ros, '/uav1/illuminator').set(brightness=20)[0].successful

        assert near.commands(ON_OFF) == []
        assert (near.fake.fields['brightness'], far.fake.fields['brightness']) == (20.0, 100.0)
        assert Parameters(own_ros, '/uav2/illuminator').get('brightness') == [100.0]
