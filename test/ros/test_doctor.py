# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""``doctor`` with running nodes and parameter files."""

from __future__ import annotations

from pathlib import Path

from illuminator_ros.cli.doctor import in_files
import pytest
from support.processes import ended, python
from support.ros import Ros, start_bridge


def test_running_nodes_and_their_problems_are_in_the_report(own_ros: Ros, port: int) -> None:
    with ended(start_bridge(own_ros.domain, port)) as bridge:
        bridge.wait_for('link open')
        doctor = python(
            'support.quiet_doctor', '--seconds', '1', env={'ROS_DOMAIN_ID': str(own_ros.domain)})

        doctor.wait_for('pass  pymavlink ')
        doctor.wait_for('nodes with a device: /illuminator')
        doctor.wait_for('FAIL  /illuminator: illuminator: link: no light connected for ')
        assert doctor.wait() == 1


@pytest.mark.parametrize(('name', 'section', 'problem'), [
    ('bow.yaml', 'bow', ''), ('light.yaml', 'illuminator', ''), ('light.yaml', 'running', ''),
    ('light.yaml', '"/**"', ''),
    ('light.yaml', 'iluminator', ': max_brightness has no effect, since iluminator matches no '
     'node: give it the name of the node, or /**')])
def test_a_limit_in_a_file_for_a_node_that_does_not_exist_fails(
    tmp_path: Path, name: str, section: str, problem: str,
) -> None:
    path = tmp_path / name
    path.write_text(f'{section}: {{ros__parameters: {{max_brightness: 40.0, brightness: 10.0}}}}')

    assert [*in_files([path], ['/running'])] == [(not problem, f'{path}{problem}')]


def test_a_file_that_cannot_be_read_fails(tmp_path: Path) -> None:
    [(passed, text)] = in_files([tmp_path / 'none.yaml'], [])

    assert (passed, 'No such file' in text) == (False, True)
