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

from illuminator_ros.ros.node import Endpoint, NodeInterface
from illuminator_ros.ros.qos import STREAM_QOS
import pytest
from std_msgs.msg import Bool


class Topic:
    """A node with one topic, and its publisher."""

    def __init__(self, subscriptions: int) -> None:
        self.subscriptions = subscriptions
        self.published: list[bool] = []

    def create_publisher(self, *arguments: Any) -> Topic:
        return self

    def get_subscription_count(self) -> int:
        return self.subscriptions

    def publish(self, message: Bool) -> None:
        self.published.append(message.data)


@pytest.mark.parametrize(('subscriptions', 'published'), [(0, []), (1, [True]), (2, [True])])
def test_value_for_subscribers_is_made_and_published_only_where_there_are_any(
        subscriptions: int, published: list[bool]) -> None:
    topic: Any = Topic(subscriptions)
    node = NodeInterface(topic, topic, topic, publications=[
        Endpoint('enabled', Bool, '', STREAM_QOS)])
    made: list[bool] = []

    def make() -> bool:
        made.append(True)
        return True

    node.publish_to_subscribers('enabled', make)
    assert topic.published == made == published
