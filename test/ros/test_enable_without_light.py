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
from typing import Any

import pytest
from std_srvs.srv import SetBool, Trigger
from support.light import ON_OFF, ServedLight
from support.ros import Ros, running_bridge

AT_ONCE = 0.3


@pytest.mark.parametrize(('service', 'type_', 'request_'), [
    ('enable', SetBool, SetBool.Request(data=True)),
    ('refresh', Trigger, Trigger.Request()),
])
class TestNoLight:
    def test_fails_at_once_where_none_was_ever_heard(
        self, own_ros: Ros, port: int, service: str, type_: Any, request_: Any,
    ) -> None:
        with running_bridge(own_ros.domain, port):
            call = own_ros.start(type_, f'/illuminator/{service}', request_)

            assert not call.result().success
            assert call.result().message == (
                f'no light connected: none heard yet on udp 127.0.0.1:{port}: '
                'nothing comes in')
            assert call.elapsed < AT_ONCE

    def test_fails_at_once_where_it_is_lost(
        self, own_ros: Ros, port: int, service: str, type_: Any, request_: Any,
    ) -> None:
        with (running_bridge(own_ros.domain, port, heartbeat_timeout=1.1) as bridge,
              ServedLight(port) as light):
            bridge.wait_for('connected')
            light.fake.silent = True
            bridge.wait_for('lost')

            call = own_ros.start(type_, f'/illuminator/{service}', request_)

            assert not call.result().success
            assert call.result().message.startswith(
                'light 1/243 is lost: no heartbeat for 1.')
            assert call.elapsed < AT_ONCE

    def test_says_why_where_the_link_is_not_open(
        self, own_ros: Ros, port: int, service: str, type_: Any, request_: Any,
    ) -> None:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as occupant:
            occupant.bind(('127.0.0.1', port))
            with running_bridge(own_ros.domain, port, until='link not open'):
                response = own_ros.call(type_, f'/illuminator/{service}', request_)

        assert not response.success
        assert response.message == (
            f'no light connected: udpin://127.0.0.1:{port} is not open: '
            f'cannot listen on 127.0.0.1:{port}: Address already in use')


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
