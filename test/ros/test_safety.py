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

"""Limits, sources, the dead man's switch and changes by other senders, in the node."""

import threading

from diagnostic_msgs.msg import DiagnosticArray
from illuminator_ros.ros.executor import NodeExecutor
import pytest
from std_msgs.msg import Bool, Float32, String
from std_srvs.srv import SetBool, Trigger
from support.embedded import embedded_bridge
from support.light import CONFIGURE, eventually, free_port, ON_OFF, ServedLight
from support.ros import Parameters, Ros, running_bridge, STREAM
from support.slow import pass_time_until
from support.waiting import PATIENCE


def test_limits_are_shown_by_descriptors_refuse_parameters_and_clip_streams(own_ros: Ros) -> None:
    parameters, port = Parameters(own_ros), free_port()
    with (running_bridge(own_ros.domain, port, max_brightness=60.0, min_strobe_period=0.34)
          as bridge, ServedLight(port, brightness=80.0) as light):
        parameters.wait(brightness=60.0)
        parameters.wait_range('brightness', 60.0)
        brightness, period = parameters.describe('brightness', 'strobe_period')
        assert 'at most 60 %' in brightness.additional_constraints
        assert 'at least 0.34 s' in period.additional_constraints

        [refused] = parameters.set(strobe_period=0.1)
        assert refused.reason == 'strobe_period 0.1 s is below min_strobe_period 0.34 s'
        parameters.set(brightness=50.0)
        own_ros.publish(Float32, '/illuminator/cmd/brightness', 90.0)

        bridge.wait_for('brightness 90 % is above max_brightness 60 %: the limit is sent')
        parameters.wait(brightness=60.0)
        assert max(command.param2 for command in light.commands(CONFIGURE)) == 60.0


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

        own_ros.publish(
            Float32, '/illuminator/operator/cmd/brightness', 40.0, node='/illuminator')
        own_ros.publish(Bool, '/illuminator/autonomy/cmd/enable', True, node='/illuminator')
        own_ros.synchronize()
        refused, plain = ask(own_ros, 'operator', True), own_ros.enable(True)
        [parameter] = parameters.set(brightness=30.0)

        assert (refused.success, refused.message) == (False, 'held by safety')
        assert plain.message == parameter.reason == 'held by safety'
        diagnostics.wait(lambda array: any(
            (value.key, value.value) == ('holder', 'safety')
            for status in array.status for value in status.values))
        assert [command.param1 for command in light.commands(ON_OFF)] == [0.0]
        assert light.commands(CONFIGURE) == []

        # The messages on topics follow, first of operator and then of autonomy. The refused calls
        # of the plain interface, which ranks between them, have left nothing behind.
        assert release('safety') == 'held by operator'
        parameters.wait(brightness=40.0)
        assert release('operator') == 'held by autonomy'
        eventually(lambda: light.fake.fields['enable'] == 1)
        own_ros.publish(Bool, '/illuminator/autonomy/cmd/enable', False, node='/illuminator')
        eventually(lambda: light.fake.fields['enable'] == 0)
        assert release('autonomy') == 'held by no source'

        holder.wait(lambda message: message.data == '', count=2)
        assert holder.values == ['', 'safety', 'operator', 'autonomy', '']
        bridge.wait_for('light 1/243 is held by autonomy: operator has released it')
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
        executor = process.node.executor
        assert isinstance(executor, NodeExecutor)
        executor.call(block)
        assert blocked.wait(PATIENCE)

        pass_time_until(lambda: light.fake.fields['enable'] == 0)

        released.set()


@pytest.mark.parametrize('change', ['follow', 'reassert'])
def test_on_and_off_by_another_sender_are_logged_in_both_settings(
    own_ros: Ros, change: str,
) -> None:
    port = free_port()
    with (running_bridge(own_ros.domain, port, external_changes=change) as bridge,
          ServedLight(port) as light):
        Parameters(own_ros).wait(mode='internal_control')
        light.report(enable=1)

        bridge.wait_for('light 1/243 was switched on by another sender')
        if change == 'reassert':
            bridge.wait_for('is switched off by external_changes: another sender switched it on')
            eventually(lambda: light.fake.fields['enable'] == 0)
