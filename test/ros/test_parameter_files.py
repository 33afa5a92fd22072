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

"""Which section of which parameter file wins, as doc/ros.md tells it."""

from pathlib import Path

import pytest
from support.light import free_port
from support.processes import ended, python
from support.ros import Ros
import yaml

ALL, FULL, SHORT = '/**', '/illuminator', 'illuminator'


def url(port: int) -> str:
    return f'udpin://127.0.0.1:{port}'


def write(path: Path, *sections: tuple[str, int]) -> str:
    """Write a parameter file that gives a port in each section; return its path."""
    path.write_text(''.join(
        yaml.dump({section: {'ros__parameters': {'connection_url': url(port)}}})
        for section, port in sections))
    return str(path)


def opens(ros: Ros, port: int, *arguments: str) -> None:
    """Run a bridge until it has opened this port."""
    with ended(python('illuminator_ros.bridge', '--ros-args', *arguments,
                      env={'ROS_DOMAIN_ID': str(ros.domain)})) as bridge:
        bridge.wait_for(f'link open: udp 127.0.0.1:{port}', 30.0)


@pytest.mark.parametrize('sections', [(ALL,), (FULL,), (SHORT,), (ALL, FULL), (FULL, ALL)],
                         ids=' '.join)
def test_the_url_of_a_launch_argument_wins_over_any_section(
    own_ros: Ros, tmp_path: Path, sections: tuple[str, ...],
) -> None:
    """With the arguments in the order in which launch gives them to the bridge."""
    wanted = free_port()
    given = write(tmp_path / 'given.yaml', *((section, free_port()) for section in sections))
    by_launch = write(tmp_path / 'launch.yaml', (FULL, wanted))

    opens(own_ros, wanted, '--params-file', given, '-p', f'connection_url:={url(wanted)}',
          '--ros-args', '-r', '__node:=illuminator', '-r', '__ns:=/', '--params-file', by_launch)


@pytest.mark.parametrize('sections', [(ALL, FULL), (FULL, ALL)], ids=' '.join)
def test_the_section_that_is_named_last_wins(
    own_ros: Ros, tmp_path: Path, sections: tuple[str, str],
) -> None:
    wanted = free_port()
    given = write(tmp_path / 'given.yaml', (sections[0], free_port()), (sections[1], wanted))

    opens(own_ros, wanted, '--params-file', given)
