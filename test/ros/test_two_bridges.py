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

"""Two bridges on one link, and what happens where they have the same address (DESIGN.md, 3.6)."""

from collections.abc import Callable, Iterator
import contextlib

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
import pytest
from std_srvs.srv import SetBool
from support.ports import free_port
from support.processes import Program
from support.relay import Relay
from support.ros import Parameters, Recorder, Ros, running_bridge, running_simulator, STREAM
from support.slow import CLOCK, pass_time_until

ADDRESS = 'another sender uses our address 1/194'


@pytest.fixture
def two(own_ros: Ros) -> Iterator[Program]:
    """Run a simulator that listens and two bridges of different addresses that send to it."""
    port = free_port()
    url = f'udpin://127.0.0.1:{port}'
    with contextlib.ExitStack() as stack:
        stack.enter_context(running_simulator(url, '--count', '2'))
        for name, component in (('first', 194), ('second', 195)):
            bridge = stack.enter_context(running_bridge(
                own_ros.domain, port, '-r', f'__node:={name}', component_id=component,
                connection_url=url.replace('udpin', 'udpout'), target_component=243))
            bridge.wait_for('connected', count=2)
        yield bridge


def faults(ros: Ros) -> Recorder:
    return ros.subscribe(DiagnosticArray, '/diagnostics', STREAM)


def says(text: str, name: str, level: bytes) -> Callable[[DiagnosticArray], bool]:
    """Return what tells an array in which this status has this level and says this."""
    return lambda array: any(
        status.name == name and status.level == level and text in status.message
        for status in array.status)


def test_each_bridge_follows_what_the_other_changes(own_ros: Ros, two: Program) -> None:
    first, second = (Parameters(own_ros, f'/{name}') for name in ('first', 'second'))
    first.wait(brightness=100.0)

    assert first.set(brightness=40.0)[0].successful
    second.wait(brightness=40.0)
    assert second.set(brightness=70.0)[0].successful
    first.wait(brightness=70.0)


def test_the_lights_do_not_mix_up_two_bridges(own_ros: Ros, two: Program) -> None:
    calls = [own_ros.start(SetBool, f'/{node}/enable', SetBool.Request(data=True))
             for node in ('first', 'second', 'first_1_244', 'second_1_244')]
    assert all(call.result().success for call in calls)


def test_two_bridges_of_different_addresses_do_not_clash(own_ros: Ros, two: Program) -> None:
    arrays = faults(own_ros)
    for count in (1, 2, 3):
        CLOCK.forward(1.0)
        for name in ('first', 'second'):
            arrays.wait(lambda array, name=name: array.status[0].name == f'{name}: link',
                        count=count)
    assert not any(ADDRESS in array.status[0].message for array in arrays.messages)


def test_two_bridges_of_one_address_both_say_so(own_ros: Ros) -> None:
    relay = Relay()
    relay.start()
    with contextlib.ExitStack() as stack:
        stack.callback(relay.stop)
        for name, port in (('first', relay.near_port), ('second', relay.far_port)):
            stack.enter_context(running_bridge(
                own_ros.domain, port, '-r', f'__node:={name}',
                connection_url=f'udpout://127.0.0.1:{port}'))
        arrays = faults(own_ros)
        for name in ('first', 'second'):
            clash = says(ADDRESS, f'{name}: link', DiagnosticStatus.ERROR)
            pass_time_until(lambda clash=clash: any(map(clash, list(arrays.messages))))
