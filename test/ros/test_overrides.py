# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Parameters given at the start: the precedence of files, and their way to the light."""

import json
from pathlib import Path
from typing import Any

import pytest
from support.light import CONFIGURE, params, ServedLight
from support.ports import free_port
from support.processes import ended, python
from support.ros import Parameters, Ros, running_bridge

# The light's own configuration.
OWN: dict[str, Any] = {
    'mode': 2, 'brightness': 90.0, 'strobe_period': 2.0, 'strobe_duty_cycle': 10.0}
ALL, FULL, SHORT = '/**', '/illuminator', 'illuminator'


def write(path: Path, *sections: tuple[str, dict[str, Any]]) -> str:
    """Write a parameter file with these sections, in this order; return its path."""
    path.write_text(''.join(f'{section}: {json.dumps({"ros__parameters": values})}\n'
                            for section, values in sections))
    return str(path)


@pytest.mark.parametrize(('given', 'sent'), [
    ({'brightness': 60.5}, (2.0, 60.5, 2.0, 10.0)),
    ({'mode': 'internal_control', 'brightness': 1, 'strobe_period': 3.5,
      'strobe_duty_cycle': 50}, (1.0, 1.0, 3.5, 50.0))])
def test_overrides_are_sent_with_the_first_connection_in_one_command(
    own_ros: Ros, port: int, given: dict[str, Any], sent: tuple[float, ...],
) -> None:
    with (running_bridge(own_ros.domain, port, **given) as bridge,
          ServedLight(port, **OWN) as light):
        bridge.wait_for('light 1/243 configured: ')

        assert [params(command) for command in light.commands(CONFIGURE)] == [sent]
        Parameters(own_ros).wait(brightness=sent[1], strobe_period=sent[2])


@pytest.mark.parametrize('sections', [
    (ALL,), (FULL,), (SHORT,), (ALL, FULL), (FULL, ALL)], ids=' '.join)
def test_last_section_of_a_file_wins_and_the_file_of_a_launch_argument_over_any(
    own_ros: Ros, tmp_path: Path, sections: tuple[str, ...],
) -> None:
    """With the arguments in the order in which launch gives them to the bridge."""
    def file(name: str, *given: tuple[str, int]) -> str:
        return write(tmp_path / name, *(
            (section, {'connection_url': f'udpin://127.0.0.1:{port}'})
            for section, port in given))

    ports = [free_port() for _ in sections]
    wanted = free_port()
    given = file('given.yaml', *zip(sections, ports, strict=True))
    runs = [(ports[-1], ('--params-file', given)), (wanted, (
        '--params-file', given, '-p', f'connection_url:=udpin://127.0.0.1:{wanted}',
        '--ros-args', '-r', '__node:=illuminator', '-r', '__ns:=/',
        '--params-file', file('launch.yaml', (FULL, wanted))))]
    for port, arguments in runs[0 if sections[1:] else 1:]:
        with ended(python('illuminator_ros.bridge', '--ros-args', *arguments,
                          env={'ROS_DOMAIN_ID': str(own_ros.domain)})) as bridge:
            bridge.wait_for(f'link open: udp 127.0.0.1:{port}')
