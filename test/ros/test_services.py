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

"""``~/enable`` and ``~/refresh``: their answers, also while others wait or there is no light."""

from __future__ import annotations

from collections.abc import Callable, Iterator
import math
import re
import socket
import threading

from illuminator_ros.mavlink.dialect import entry_names, mavlink
from illuminator_ros.ros import answer_spacing
from illuminator_ros.ros import executor as executor_module
from illuminator_ros.ros.executor import DeferredService, ENDED, NodeExecutor, Respond
from illuminator_ros.ros.node import SERVICE_QOS
from illuminator_ros.ros.payload_node import PayloadNode
from illuminator_ros.ros.throttled_log import NodeLog
import pytest
from rclpy.client import Client
from rclpy.node import Node
from rclpy.qos import QoSProfile
from std_msgs.msg import Float32, Float64
from std_srvs.srv import Trigger
from support.light import eventually, ON_OFF, ServedLight
from support.processes import Program
from support.recording import Call
from support.ros import Parameters, Ros, running_bridge
from support.slow import pass_time_until
from support.waiting import Log

STATUS, INFORMATION = 440.0, 396.0


@pytest.fixture
def off(light: ServedLight) -> ServedLight:
    """Return the light, which is off."""
    light.report(enable=0, error_status=0)
    return light


@pytest.mark.parametrize(('result', 'answer'), [
    (mavlink.MAV_RESULT_ACCEPTED, 'on, confirmed by ILLUMINATOR_STATUS: MAV_RESULT_ACCEPTED'),
    (mavlink.MAV_RESULT_DENIED, 'refused: MAV_RESULT_DENIED')])
def test_enable_is_answered_with_the_result_of_one_command(
    ros: Ros, off: ServedLight, result: int, answer: str,
) -> None:
    off.fake.results[ON_OFF] = result
    response = ros.enable()
    assert response.success is (result == mavlink.MAV_RESULT_ACCEPTED)
    assert re.fullmatch(rf'{answer} \(1 try, \d+ ms\)', response.message)
    assert [command.param1 for command in off.commands(ON_OFF)] == [1.0]


def test_refresh_requests_both_messages_which_are_published_or_logged(
    ros: Ros, off: ServedLight, bridge: Program,
) -> None:
    brightness = ros.subscribe(Float32, '/illuminator/brightness')
    off.fake.stream = 0.0
    off.do(lambda now: off.fake.fields.update(brightness=12.0))
    off.fake.identity = type(off.fake.identity)('other', 'maker', '', '', 'T-2')

    answer = ros.refresh()

    assert answer.success
    assert re.fullmatch(r'ILLUMINATOR_STATUS: received, COMPONENT_INFORMATION_BASIC: received '
                        r'\(\d+ ms\)', answer.message)
    assert {command.param1 for command in off.commands(mavlink.MAV_CMD_REQUEST_MESSAGE)} == {
        STATUS, INFORMATION}
    brightness.wait_value(12.0)
    bridge.wait_for('light 1/243 is other maker, serial number T-2')


def test_other_services_and_topics_go_on_while_an_enable_waits(
    ros: Ros, off: ServedLight, parameters: Parameters,
) -> None:
    off.fake.results[ON_OFF] = None
    waiting = ros.start_enable()
    off.wait_for(ON_OFF)

    assert ros.refresh().success
    assert parameters.get('frame_id') and parameters.describe('brightness')
    assert not parameters.set(brightness=200.0)[0].successful
    assert parameters.set(brightness=61.0)[0].successful
    ros.subscribe(Float64, '/illuminator/uptime').wait(count=3)

    assert not waiting.answered
    off.acknowledge(ON_OFF, mavlink.MAV_RESULT_FAILED)
    pass_time_until(lambda: waiting.answered)


def no_light_messages(ros: Ros) -> set[str]:
    """Call both services and set a parameter; return the reasons why they fail."""
    calls = [ros.start_enable(), ros.start(Trigger, '/illuminator/refresh', Trigger.Request())]
    responses = [call.result() for call in calls]
    [result] = Parameters(ros).set(brightness=30.0)
    assert [*(response.success for response in responses), result.successful] == [False] * 3
    return {*(response.message for response in responses), result.reason}


def test_requests_fail_at_once_and_say_why_while_no_light_was_ever_heard(
    own_ros: Ros, port: int,
) -> None:
    with running_bridge(own_ros.domain, port):
        assert no_light_messages(own_ros) == {
            f'no light connected: none heard yet on udp 127.0.0.1:{port}: nothing is received: '
            'check that the device is on, and that it, or a router, sends to this address or '
            'line'}
        assert Parameters(own_ros).get('brightness') == [None]


def test_light_that_is_heard_and_answers_nothing_is_the_reason(own_ros: Ros, port: int) -> None:
    # The line to the light is broken, and the light sends no status unasked.
    with (running_bridge(own_ros.domain, port),
          ServedLight(port, stream=0.0, results=dict.fromkeys(
              entry_names('MAV_CMD')))):
        eventually(lambda: 'none heard yet' not in own_ros.enable().message)

        assert no_light_messages(own_ros) == {
            'no light connected: 1/243 heard, without an answer or an ILLUMINATOR_STATUS so far: '
            'check the line to it, and whether it requires signed messages'}


def test_requests_fail_at_once_and_say_why_while_the_light_is_lost(
    own_ros: Ros, port: int,
) -> None:
    with running_bridge(own_ros.domain, port) as bridge, ServedLight(port) as light:
        Parameters(own_ros).wait(brightness=100.0)
        light.fake.silent = True
        pass_time_until(lambda: bridge.count('lost'))

        for message in no_light_messages(own_ros):
            assert message.startswith('light 1/243 is lost: no heartbeat for ')
        assert Parameters(own_ros).get('brightness') == [100.0]


def test_requests_fail_at_once_and_say_why_while_the_link_is_not_open(
    own_ros: Ros, port: int,
) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as occupant:
        occupant.bind(('127.0.0.1', port))
        with running_bridge(own_ros.domain, port, until='link not open'):
            assert no_light_messages(own_ros) == {
                f'no light connected: udpin://127.0.0.1:{port} is not open: '
                f'cannot listen on 127.0.0.1:{port}: Address already in use '
                '(doc/routers.md: several programs on one link)'}


MakeClient = Callable[[str], Client]


@pytest.fixture
def node(ros: Ros, monkeypatch: pytest.MonkeyPatch) -> Iterator[Node]:
    """Yield a node of an executor that sends spaced answers hours apart."""
    monkeypatch.setattr(answer_spacing, 'PAUSE_PER_CLIENT', 3600.0)
    node = PayloadNode('served', context=ros.context)
    executor = NodeExecutor(ros.context, NodeLog(node.get_logger()))
    node.create_service(Trigger, '~/fast', lambda request, response: response)
    executor.add_node(node)
    thread = threading.Thread(target=executor.run)
    thread.start()
    yield node
    executor.end()
    thread.join()
    node.destroy_node()


@pytest.fixture
def clients(ros: Ros) -> Iterator[MakeClient]:
    """Yield a function that makes a client of a service of the node, which keeps all answers."""
    made = []

    def make(name: str) -> Client:
        made.append(ros.node.create_client(
            Trigger, f'/served/{name}', qos_profile=QoSProfile(depth=100)))
        eventually(made[-1].service_is_ready)
        return made[-1]

    yield make
    for client in made:
        ros.node.destroy_client(client)


def serve_later(node: Node) -> Log[Respond]:
    """Add the service ``~/slow``; return the functions that answer its requests."""
    waiting: Log[Respond] = Log()

    def take(request: Trigger.Request, respond: Respond) -> None:
        waiting.append(respond)

    def refuse_waiting(reason: str) -> None:
        for respond in waiting:
            respond(Trigger.Response(message=reason))

    DeferredService(
        node, Trigger, '~/slow', take, refuse_waiting, SERVICE_QOS, spread=math.inf)
    return waiting


def call(client: Client, waiting: Log[Respond], count: int) -> list[Call]:
    """Call a service until that many more requests wait for their answers."""
    before = len(waiting)
    calls = [Call(client.call_async(Trigger.Request())) for _ in range(count)]
    waiting.wait_for(lambda one: True, count=before + count)
    return calls


def test_spaced_answers_do_not_delay_other_services_and_are_bounded(
    node: Node, clients: MakeClient, monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(executor_module, 'MAX_WAITING', 3)
    waiting = serve_later(node)
    slow, fast = clients('slow'), clients('fast')
    [first] = call(slow, waiting, 1)
    waiting[0](Trigger.Response())
    first.result()
    calls = call(slow, waiting, 20)

    for respond in list(waiting)[1:]:
        respond(Trigger.Response())

    eventually(lambda: sum(one.answered for one in calls) == len(calls) - 3)
    Call(fast.call_async(Trigger.Request())).result()
    assert sum(one.answered for one in calls) == len(calls) - 3


def test_answers_are_spaced_where_a_service_has_more_clients_than_are_answered_at_once(
    node: Node, clients: MakeClient,
) -> None:
    waiting = serve_later(node)
    fast = clients('fast')
    callers = [clients('slow') for _ in range(answer_spacing.MAX_UNSPACED + 1)]
    eventually(lambda: node.count_clients('~/slow') == len(callers))
    calls = []
    # Call in turn: the node counts the clients after the first answer, so the third one waits.
    for caller in callers[:3]:
        calls += call(caller, waiting, 1)
        waiting[-1](Trigger.Response())

    for answered in calls[:2]:
        answered.result()
    Call(fast.call_async(Trigger.Request())).result()
    assert not calls[2].answered


def test_executor_that_ends_refuses_requests_that_wait_without_a_pause(
    node: Node, clients: MakeClient,
) -> None:
    waiting = serve_later(node)
    calls = call(clients('slow'), waiting, answer_spacing.MAX_UNSPACED + 2)
    executor = node.executor
    assert isinstance(executor, NodeExecutor)

    executor.end()

    assert {answered.result().message for answered in calls} == {ENDED}
