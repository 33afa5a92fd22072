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

"""Nodes of further devices: a failure is tried again, and a node goes with its device."""

from collections.abc import Iterator

from illuminator_ros.ros.node_manager import NodeManager
from illuminator_ros.ros.payload_node import PayloadNode
from illuminator_ros.ros.throttled_log import NodeLog
import pytest
from rclpy.node import Node
from support.ros import Ros
from support.waiting import eventually


@pytest.fixture
def pool(own_ros: Ros) -> Iterator[NodeManager]:
    first = PayloadNode('first', context=own_ros.context)
    pool = NodeManager(first, [], NodeLog(first.get_logger()), lambda: None)
    yield pool
    pool.end()
    for node in (first, *pool.nodes):
        node.destroy_node()


def names(ros: Ros) -> list[str]:
    return ros.node.get_node_names()


def test_node_that_cannot_be_made_is_tried_again_and_logged(
    own_ros: Ros, pool: NodeManager, capfd: pytest.CaptureFixture[str],
) -> None:
    failures = [OSError('too many threads')]

    def serve(node: Node) -> None:
        if failures:
            raise failures.pop()

    pool.make('1/244', 'light 1/244', 'further', serve)

    pool.work()
    assert 'light 1/244 gets no node yet: too many threads' in ''.join(capfd.readouterr())
    eventually(lambda: pool.work() or 'further' in names(own_ros))


def test_node_is_removed_with_its_device(own_ros: Ros, pool: NodeManager) -> None:
    pool.make('1/244', 'light 1/244', 'further', lambda node: None)
    pool.work()
    eventually(lambda: 'further' in names(own_ros))

    pool.remove('1/244')
    pool.work()

    eventually(lambda: 'further' not in names(own_ros))
    assert pool.nodes == []


def test_device_that_goes_before_its_node_is_made_gets_none(
    own_ros: Ros, pool: NodeManager,
) -> None:
    pool.make('1/244', 'light 1/244', 'further', lambda node: None)
    pool.remove('1/244')

    assert not pool.work()
    assert pool.nodes == []
