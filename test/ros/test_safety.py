# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Sources of commands in the node, also while its executor is blocked."""

import threading

from diagnostic_msgs.msg import DiagnosticArray
from std_msgs.msg import Bool, String
from std_srvs.srv import SetBool, Trigger
from support.embedded import embedded_bridge
from support.light import eventually, free_port, ON_OFF, ServedLight
from support.ros import Parameters, Ros, running_bridge, STREAM
from support.slow import pass_time_until
from support.waiting import PATIENCE


def ask(ros: Ros, source: str, on: bool) -> SetBool.Response:
    """Switch the light as a source."""
    answer: SetBool.Response = ros.call(
        SetBool, f'/illuminator/{source}/enable', SetBool.Request(data=on), node='/illuminator')
    return answer


def test_sources_hold_the_light_by_rank_and_release_it(own_ros: Ros) -> None:
    parameters, port = Parameters(own_ros), free_port()
    names = "['safety', 'operator', 'default', 'autonomy']"

    def release(source: str) -> str:
        answer = own_ros.call(
            Trigger, f'/illuminator/{source}/release', Trigger.Request(), node='/illuminator')
        assert answer.success
        return str(answer.message)

    with (running_bridge(own_ros.domain, port, sources=names, diagnostics_period=0.1) as bridge,
          ServedLight(port) as light):
        parameters.wait(mode='internal_control')
        holder = own_ros.subscribe(String, '/illuminator/source')
        holder.wait(lambda message: message.data == '')
        diagnostics = own_ros.subscribe(DiagnosticArray, '/diagnostics', STREAM)
        assert ask(own_ros, 'safety', False).success

        own_ros.publish(Bool, '/illuminator/autonomy/cmd/enable', True, node='/illuminator')
        own_ros.synchronize()
        [parameter] = parameters.set(brightness=30.0)

        assert {ask(own_ros, 'operator', True).message, own_ros.enable(True).message,
                parameter.reason} == {'held by safety'}
        diagnostics.wait(lambda array: any(
            (value.key, value.value) == ('holder', 'safety')
            for status in array.status for value in status.values))
        assert [command.param1 for command in light.commands(ON_OFF)] == [0.0]

        assert release('safety') == 'held by autonomy'
        eventually(lambda: light.fake.fields['enable'] == 1)
        assert release('autonomy') == 'held by no source'

        holder.wait(lambda message: message.data == '', count=2)
        assert holder.values == ['', 'safety', 'autonomy', '']
        bridge.wait_for('light 1/243 is held by autonomy: safety has released it')
        bridge.wait_for('light 1/243 is held by no source: autonomy has released it')


def test_silent_source_loses_the_light_while_the_executor_is_blocked(own_ros: Ros) -> None:
    port, released, blocked = free_port(), threading.Event(), threading.Event()

    def block() -> None:
        blocked.set()
        released.wait()

    with (embedded_bridge(own_ros.domain, port, sources=['safety'], source_timeout=5.0,
                          on_release='off') as process, ServedLight(port) as light):
        Parameters(own_ros).wait(mode='internal_control')
        assert ask(own_ros, 'safety', True).success
        assert process.node.executor is not None
        process.node.executor.create_task(block)
        assert blocked.wait(PATIENCE)

        pass_time_until(lambda: light.fake.fields['enable'] == 0)

        released.set()
