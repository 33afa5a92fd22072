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

"""Messages that a node publishes or leaves out, by the number of subscriptions."""

from __future__ import annotations

from typing import Any

from illuminator_ros.ros.node import NodeInterface, Publication, STREAM_QOS
import pytest
from std_msgs.msg import Bool


class Topic:
    """A node with one topic, and its publisher."""

    def __init__(self) -> None:
        self.subscriptions = 0
        self.published: list[bool] = []

    def create_publisher(self, *arguments: Any) -> Topic:
        return self

    def get_subscription_count(self) -> int:
        return self.subscriptions

    def publish(self, message: bytes) -> None:
        self.published.append(bool(message[4]))


def interface(topic: Topic, *qos: Any) -> NodeInterface:
    node: Any = topic
    link: Any = None
    log: Any = None
    return NodeInterface(node, link, log, publications=[Publication('enabled', Bool, *qos)])


def test_unchanged_state_is_published_again_only_while_its_topic_has_a_subscriber() -> None:
    topic = Topic()
    publish = interface(topic).publisher('enabled')
    for topic.subscriptions, value, count in (
            (0, True, 1), (0, True, 1), (1, True, 2), (1, True, 3), (0, True, 3), (0, False, 4),
            (0, True, 5)):
        publish(value)
        assert len(topic.published) == count
    assert topic.published == [True, True, True, False, True]


def test_every_value_of_a_stream_is_published() -> None:
    topic = Topic()
    node = interface(topic, STREAM_QOS)
    for _ in range(3):
        node.publish('enabled', True)
    assert topic.published == [True] * 3


@pytest.mark.parametrize(('subscriptions', 'published'), [(0, []), (1, [True]), (2, [True])])
def test_value_for_subscribers_is_made_and_published_only_where_there_are_any(
        subscriptions: int, published: list[bool]) -> None:
    topic = Topic()
    node = interface(topic, STREAM_QOS)
    topic.subscriptions = subscriptions
    made: list[bool] = []

    def make() -> bool:
        made.append(True)
        return True

    node.publish_to_subscribers('enabled', make)
    assert topic.published == made == published
