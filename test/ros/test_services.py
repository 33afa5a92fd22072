# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""``~/enable`` and ``~/refresh``: their answers, also while others wait or there is no light."""

from __future__ import annotations

import os
import re
import socket

from illuminator_ros.mavlink.dialect import mavlink
from illuminator_ros.mavlink.messages import Address, Heartbeat
import pytest
from std_msgs.msg import Float32, Float64
from std_srvs.srv import Trigger
from support.embedded import embedded_bridge
from support.frames import frame_of
from support.light import ON_OFF, ServedLight
from support.processes import Program
from support.ros import Parameters, Ros, running_bridge
from support.slow import pass_time_until
from support.waiting import eventually, Log

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
    off.fake.identity = type(off.fake.identity)('other', 'maker', '', '', 'T-1')

    answer = ros.refresh()

    assert answer.success
    assert re.fullmatch(r'ILLUMINATOR_STATUS: received, COMPONENT_INFORMATION_BASIC: received '
                        r'\(\d+ ms\)', answer.message)
    assert {command.param1 for command in off.commands(mavlink.MAV_CMD_REQUEST_MESSAGE)} == {
        STATUS, INFORMATION}
    brightness.wait_value(12.0)
    bridge.wait_for('light 1/243 is other maker, serial number T-1')


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
            'line; on a serial line, that TX and RX are not swapped'}
        assert Parameters(own_ros).get('brightness') == [None]


def test_reason_for_a_missing_light_names_the_devices_that_are_heard_instead(
    own_ros: Ros, port: int,
) -> None:
    camera = Heartbeat(mavlink.MAV_TYPE_GENERIC, mavlink.MAV_AUTOPILOT_RESERVED, 0, 0, 0, 3)
    with (running_bridge(own_ros.domain, port),
          socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender):
        sender.sendto(frame_of(camera, 0, Address(1, 100)), ('127.0.0.1', port))
        eventually(lambda: 'frames from 1/100 (MicaSense camera), none from a light' in str(
            no_light_messages(own_ros)))


def test_requests_fail_at_once_and_say_why_while_the_link_is_not_open(
    own_ros: Ros, port: int,
) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as occupant:
        occupant.bind(('127.0.0.1', port))
        with running_bridge(own_ros.domain, port, until='link not open'):
            [message] = no_light_messages(own_ros)
            assert message.startswith(
                f'no light connected: udpin://127.0.0.1:{port} is not open: '
                f'cannot listen on 127.0.0.1:{port}: Address already in use by "')
            # It is this process.
            assert message.endswith(
                f'(process {os.getpid()}) (doc/routers.md: several programs on one link)')


def test_requests_that_wait_at_the_end_of_the_process_are_answered(
    own_ros: Ros, port: int,
) -> None:
    with embedded_bridge(own_ros.domain, port) as bridge, ServedLight(port) as light:
        Parameters(own_ros).wait(brightness=100.0)
        light.fake.results[ON_OFF] = None
        asked = own_ros.start_enable()
        light.wait_for(ON_OFF)

        bridge.end()

        assert asked.result().message == 'the bridge is ending'


def test_payload_may_use_timers_clients_and_actions_on_the_executor_of_the_bridge(
    own_ros: Ros, port: int,
) -> None:
    with embedded_bridge(own_ros.domain, port) as bridge:
        own_ros.enable()
        answers: Log[Trigger.Response] = Log()
        client = bridge.node.create_client(Trigger, '/illuminator/refresh')

        def call() -> None:
            timer.cancel()
            client.call_async(Trigger.Request()).add_done_callback(
                lambda future: answers.append(future.result()))

        timer = bridge.node.create_timer(0.001, call)

        answers.wait_for(lambda answer: 'no light connected' in answer.message)
