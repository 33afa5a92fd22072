# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Requests of ROS callbacks to the link: each is answered once, and too many are refused."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any
from unittest.mock import Mock

from illuminator_ros.ros.deferred_service import DeferredService
from illuminator_ros.ros.link_call import LinkCalls, MAX_PENDING
from illuminator_ros.ros.node import (
    CommandTopic,
    Entity,
    NodeEntities,
    RequestService,
    SWITCH_QOS,
)
from rclpy.node import Node
from std_msgs.msg import Bool, Float32
from std_srvs.srv import SetBool
from support.ros import Ros


def test_requests_of_a_kind_beyond_the_limit_are_refused_and_each_is_answered_once() -> None:
    answers: list[Callable[[str], None]] = []
    answered: list[str] = []
    # Any: a link that calls functions at once.
    link: Any = Mock(call=lambda function: function(0.0))
    calls = LinkCalls(link, Mock(), 2)

    def ask() -> None:
        calls.ask(lambda now, answer: answers.append(answer), answered.append,
                  'refused: {}'.format)

    for _ in range(3):
        ask()
    calls.ask(lambda now, answer: answer('OFF'), answered.append, 'refused: {}'.format, kind=False)
    assert answered.pop() == 'OFF'
    assert answered == ['refused: busy: 2 requests wait for an answer already']
    answers[0]('done')
    ask()
    for _ in range(2):
        for answer in answers:
            answer('done')
    assert answered[1:] == ['done'] * 3


def test_request_after_the_end_of_the_link_is_refused() -> None:
    answered: list[str] = []
    # Any: a link whose thread has ended.
    link: Any = Mock(is_running=lambda: False)

    LinkCalls(link, Mock()).ask(
        lambda now, answer: answer('done'), answered.append, 'refused: {}'.format)

    assert answered == ['refused: the bridge is ending']


def test_off_is_asked_however_many_requests_of_an_on_wait(ros: Ros) -> None:
    asked: list[bool] = []
    node = Node('switched', context=ros.context)
    # Any: a link that calls functions at once.
    link: Any = Mock(call=lambda function: function(0.0))
    NodeEntities(node, link, Mock(), services=[RequestService(
        Entity('enable', SetBool, ''),
        lambda request, now, answer: asked.append(request.data))])
    [enable] = [one.callback for one in node.services if one.service_name == '/switched/enable']
    assert isinstance(enable, DeferredService)

    for on in [True] * (MAX_PENDING + 1) + [False]:
        enable.handle(SetBool.Request(data=on), Mock())
    node.destroy_node()

    assert asked == [True] * MAX_PENDING + [False]


def test_single_messages_and_requests_keep_their_order_and_a_stream_only_its_newest(
    ros: Ros,
) -> None:
    calls: list[Callable[[float], None]] = []
    taken: list[object] = []
    node = Node('busy', context=ros.context)
    # Any: a link whose thread is busy.
    link: Any = Mock(call=calls.append)

    def take(value: object, now: float) -> None:
        taken.append(value)

    NodeEntities(
        node, link, Mock(),
        services=[RequestService(Entity('enable', SetBool, ''),
                                 lambda request, now, answer: taken.append('service'))],
        commands=[CommandTopic(Entity('cmd/enable', Bool, '', SWITCH_QOS), take),
                  CommandTopic(Entity('cmd/brightness', Float32, ''), take)])
    callbacks: dict[str, Any] = {
        one.topic_name: one.callback for one in node.subscriptions}
    switch, stream = (callbacks[f'/busy/cmd/{name}'] for name in ('enable', 'brightness'))
    [service] = [one.callback for one in node.services if one.service_name == '/busy/enable']
    assert isinstance(service, DeferredService)

    stream(Float32(data=1.0))
    switch(Bool(data=False))
    service.handle(SetBool.Request(data=True), Mock())
    stream(Float32(data=2.0))
    switch(Bool(data=False))
    for call in calls:
        call(0.0)
    node.destroy_node()

    assert taken == [2.0, False, 'service', False]
