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

"""The README's tables of topics and services, and what the node has."""

from collections.abc import Iterator
from pathlib import Path
import re
from typing import Any

from illuminator_ros.ros.node import IlluminatorNode
import pytest
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from support.embedded import resting_bridge
from support.tables import table

ROOT = Path(__file__).resolve().parents[2]
README = (ROOT / 'README.md').read_text()
QUALITIES = {
    'state': QoSProfile(depth=1, reliability=ReliabilityPolicy.RELIABLE,
                        durability=DurabilityPolicy.TRANSIENT_LOCAL),
    'stream': QoSProfile(depth=10, reliability=ReliabilityPolicy.RELIABLE,
                         durability=DurabilityPolicy.VOLATILE),
}
# Those that any node has.
GENERAL = re.compile('parameter|logger|type_description|rosout|clock')


@pytest.fixture(scope='module')
def node(domain: int) -> Iterator[IlluminatorNode]:
    """Return the node with all that it can have."""
    with resting_bridge(domain, lambda: 0.0, beam_range=5.0) as process:
        yield process.node


def name_of(full: str) -> str:
    """Return a name as the README writes it."""
    return full.replace('/illuminator/', '~/')


def type_of(class_: Any) -> str:
    """Return the name of a type without the part between package and name."""
    return f'{class_.__module__.partition(".")[0]}/{class_.__name__}'


def test_published_topics(node: IlluminatorNode) -> None:
    told = {(name.strip('`'), type_.strip('`')): quality
            for name, type_, quality, _ in table(README, 'published')}
    has = {(name_of(each.topic_name), type_of(each.msg_type)): each.qos_profile
           for each in node.publishers if not GENERAL.search(each.topic_name)}

    assert told.keys() == has.keys()
    for row, profile in has.items():
        expected = QUALITIES[told[row]]
        assert (profile.reliability, profile.durability, profile.depth) == (
            expected.reliability, expected.durability, expected.depth), row


def test_accepted_topics_and_services(node: IlluminatorNode) -> None:
    told = {(name.strip('`'), type_.strip('`')) for name, type_, _ in table(README, 'accepted')}
    has = {(name_of(each.topic_name), type_of(each.msg_type)) for each in node.subscriptions}
    has |= {(name_of(each.srv_name), type_of(each.srv_type)) for each in node.services}

    assert told == {row for row in has if not GENERAL.search(row[0])}


def test_the_words_state_and_stream_say_what_they_are() -> None:
    assert '*state* is reliable, transient local, depth 1' in README
    assert '*stream* is reliable, volatile, depth 10' in README


def test_each_executable_is_there() -> None:
    installed = re.findall(r"'(\w+) = illuminator_ros", (ROOT / 'setup.py').read_text())

    assert sorted(row[0].strip('`') for row in table(README, 'executable')) == sorted(installed)
