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

"""The monitor without its terminal, in the test's process."""

from __future__ import annotations

from collections.abc import Callable, Iterator
import contextlib
from typing import Any

from illuminator_ros.cli.monitor.key_bindings import Ask
from illuminator_ros.cli.monitor.model import Light, Outcome
from illuminator_ros.cli.monitor.run import Monitor
from rclpy.node import Node
from support.light import eventually
from support.ros import Ros
from support.slow import CLOCK
from support.waiting import PATIENCE


class Watching:
    """A monitor in the domain of a ROS client, by the slow clock."""

    def __init__(self, ros: Ros) -> None:
        self._node = Node('monitor', context=ros.context, enable_rosout=False,
                          start_parameter_services=False)
        self._monitor = Monitor(self._node, CLOCK)

    def close(self) -> None:
        """End the monitor."""
        self._monitor.end()
        self._node.destroy_node()

    @property
    def names(self) -> list[str]:
        """Return the names of the lights."""
        return [light.name for light in self._monitor.lights()]

    def light(self, name: str = '/illuminator') -> Light:
        """Return the known state of a light."""
        [light] = [light for light in self._monitor.lights() if light.name == name]
        return light

    def wait(self, condition: Callable[[Light], Any], name: str = '/illuminator',
             timeout: float = PATIENCE) -> Light:
        """Wait until a light is known and the condition holds; return it."""
        eventually(lambda: name in self.names, within=timeout)
        eventually(lambda: condition(self.light(name)), within=timeout)
        return self.light(name)

    def wait_names(self, *names: str) -> None:
        """Wait until the monitor has exactly these lights."""
        eventually(lambda: self.names == sorted(names))

    def ask(self, ask: Ask, name: str = '/illuminator') -> None:
        """Send a request to a light."""
        self._monitor.graph.submit(name, ask)

    def outcome(self, text: str, outcome: Outcome, name: str = '/illuminator') -> str:
        """Wait until a request has this outcome, and return the answer."""
        light = self.wait(lambda light: light.action and light.action.text == text
                          and light.action.outcome is outcome, name)
        assert light.action is not None
        return light.action.answer

    def clear_gone(self) -> None:
        """Forget the lights that are gone."""
        self._monitor.graph.clear_gone()


@contextlib.contextmanager
def watching(ros: Ros) -> Iterator[Watching]:
    """Watch the lights in the domain of a ROS client."""
    made = Watching(ros)
    try:
        yield made
    finally:
        made.close()
