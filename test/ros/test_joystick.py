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

"""The joystick's file, as joy_teleop reads it, publishes what the bridge subscribes to."""

from pathlib import Path
from typing import Any

import pytest
from support.graph import interface
from support.processes import Program
from support.ros import Ros
import yaml

FILE = Path(__file__).parents[2] / 'config' / 'joystick.yaml'
COMMANDS: dict[str, Any] = yaml.safe_load(FILE.read_text())['/**']['ros__parameters']


@pytest.mark.parametrize('command', COMMANDS.values(), ids=COMMANDS)
def test_a_command_is_a_topic_of_the_bridge_with_its_type(
    ros: Ros, shared_bridge: tuple[Program, Any], command: dict[str, Any],
) -> None:
    taken = interface(ros).subscriptions
    assert command['type'] == 'topic'
    assert taken['/' + command['topic_name']] == command['interface_type']


def test_the_axis_goes_from_0_to_100_percent() -> None:
    """joy_teleop publishes axis * scale + offset."""
    mapping = COMMANDS['dim']['axis_mappings']['data']
    assert [axis * mapping['scale'] + mapping['offset'] for axis in (-1, 0, 1)] == [0, 50, 100]
    # Numbers of another type would not fit into a Float32, and be refused at each push.
    assert isinstance(mapping['scale'], float)
    assert isinstance(mapping['offset'], float)


def test_on_needs_two_buttons_and_off_one() -> None:
    values = {name: command['message_value']['data']['value']
              for name, command in COMMANDS.items() if 'message_value' in command}
    assert values == {'switch_on': True, 'switch_off': False}
    assert len(COMMANDS['switch_on']['deadman_buttons']) == 2
    assert len(COMMANDS['switch_off']['deadman_buttons']) == 1


def test_switching_on_does_not_publish_a_brightness() -> None:
    pressed = set(COMMANDS['switch_on']['deadman_buttons'])
    assert not pressed & set(COMMANDS['dim']['deadman_buttons'])
