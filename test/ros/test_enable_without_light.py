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

"""``~/enable`` and ``~/refresh`` where no light is connected, or one that sends no status."""

import socket

from std_srvs.srv import SetBool, Trigger
from support.light import ON_OFF, ServedLight
from support.ros import Ros, running_bridge

AT_ONCE = 0.3


REQUESTS = [('enable', SetBool, SetBool.Request(data=True)),
            ('refresh', Trigger, Trigger.Request())]


def messages_at_once(ros: Ros) -> list[str]:
    """Call both services; return what they say about having failed at once."""
    calls = [ros.start(type_, f'/illuminator/{service}', request)
             for service, type_, request in REQUESTS]
    responses = [call.result() for call in calls]
    assert [response.success for response in responses] == [False, False]
    assert max(call.elapsed for call in calls) < AT_ONCE
    return [response.message for response in responses]


class TestNoLight:

    def test_both_fail_at_once_where_none_was_ever_heard(self, own_ros: Ros, port: int) -> None:
        with running_bridge(own_ros.domain, port):
            assert messages_at_once(own_ros) == 2 * [
                f'no light connected: none heard yet on udp 127.0.0.1:{port}: nothing comes in']

    def test_both_fail_at_once_where_it_is_lost(self, own_ros: Ros, port: int) -> None:
        with (running_bridge(own_ros.domain, port, heartbeat_timeout=1.1) as bridge,
              ServedLight(port) as light):
            bridge.wait_for('connected')
            light.fake.silent = True
            bridge.wait_for('lost')

            for message in messages_at_once(own_ros):
                assert message.startswith('light 1/243 is lost: no heartbeat for 1.')

    def test_both_say_why_where_the_link_is_not_open(self, own_ros: Ros, port: int) -> None:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as occupant:
            occupant.bind(('127.0.0.1', port))
            with running_bridge(own_ros.domain, port, until='link not open'):
                assert messages_at_once(own_ros) == 2 * [
                    f'no light connected: udpin://127.0.0.1:{port} is not open: '
                    f'cannot listen on 127.0.0.1:{port}: Address already in use']


def test_a_light_that_sends_no_status_at_all_is_believed(own_ros: Ros, port: int) -> None:
    light = ServedLight(port, stream=0.0)
    light.fake.pushes = False
    light.fake.answers.clear()
    with running_bridge(own_ros.domain, port) as bridge, light:
        bridge.wait_for('connected')

        response = own_ros.call(SetBool, '/illuminator/enable', SetBool.Request(data=True))

        assert response.success
        assert 'accepted, not confirmed' in response.message
        assert len(light.commands(ON_OFF)) == 1
