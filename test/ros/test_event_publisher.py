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

"""The order in which the values of a status are published."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from illuminator_ros.illuminator import events
from illuminator_ros.illuminator.messages import IlluminatorStatus
from illuminator_ros.illuminator.model import SafetyLimits, Status
from illuminator_ros.illuminator.ros import event_publisher
from illuminator_ros.illuminator.ros.event_publisher import EventPublisher
from illuminator_ros.mavlink.messages import Address
import pytest

YIELD = 'yield'


class Steps:
    """The interface of a node; it notes the topics on which it publishes."""

    def __init__(self) -> None:
        self.taken: list[str] = []

    def publish(self, name: str, value: object) -> None:
        self.taken.append(name)

    def publish_to_subscribers(self, name: str, make: Callable[[], object]) -> None:
        self.taken.append(name)

    def publisher(self, name: str) -> Callable[[object], None]:
        def publish(value: object) -> None:
            self.taken.append(name)

        return publish

    def get_clock(self) -> None:
        """Return None, since the test needs no stamp."""


def test_processor_is_yielded_after_the_first_and_the_last_topic_of_a_status(
        monkeypatch: pytest.MonkeyPatch) -> None:
    steps = Steps()
    monkeypatch.setattr(event_publisher, 'yield_processor', lambda: steps.taken.append(YIELD))
    anything: Any = steps
    publisher = EventPublisher(
        anything, anything, anything, anything, limits=SafetyLimits(), frame_id='light',
        check_diagnostics=lambda: None)
    steps.taken.clear()
    status = Status.from_message(IlluminatorStatus(
        1000, 1, 3, 0, 1, 50.0, 0.0, 0.0, 25.0, 0.0, 0.0))
    publisher.take(events.StatusReceived(Address(1, 243), status, 1.0, 25.0))
    assert steps.taken == [
        'enabled', YIELD, 'brightness', 'mode', 'strobe_period', 'strobe_duty_cycle',
        'error_flags', 'uptime', 'temperature', YIELD]
