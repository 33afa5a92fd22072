# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0


"""A recorded run, read by a library that knows neither ROS nor this package."""

from collections.abc import Iterator
import json
import sys
from typing import Any
from xml.etree import ElementTree

import pytest
from support.processes import Program, ROOT
from support.waiting import PATIENCE
import yaml

LAYOUT = json.loads((ROOT / 'config' / 'foxglove_layout.json').read_text())
LATCHED: dict[str, dict[str, object]] = yaml.safe_load(
    (ROOT / 'config' / 'bag_qos.yaml').read_text())


def texts(value: object) -> Iterator[str]:
    """Return all texts in a layout."""
    if isinstance(value, dict):
        for key, part in value.items():
            yield key
            yield from texts(part)
    elif isinstance(value, list):
        for part in value:
            yield from texts(part)
    elif isinstance(value, str):
        yield value


def value_at(message: Any, fields: list[str]) -> object:
    for name in fields:
        message = getattr(message, name)
    return message


@pytest.fixture(scope='module')
def messages(tmp_path_factory: pytest.TempPathFactory) -> dict[str, list[Any]]:
    """Return the messages of a run, by topic."""
    reader = pytest.importorskip('mcap_ros2.reader')
    file = tmp_path_factory.mktemp('record') / 'run.mcap'
    program = Program(
        sys.executable, str(ROOT / 'demo' / 'record.py'), str(file), '--seconds', '2')
    try:
        assert program.wait(3 * PATIENCE) == 0, program.log
    finally:
        program.kill()
    found: dict[str, list[Any]] = {}
    for one in reader.read_ros2_messages(str(file)):
        found.setdefault(one.channel.topic, []).append(one.ros_msg)
    return found


def test_recording_has_each_field_that_the_foxglove_layout_shows(
        messages: dict[str, list[Any]]) -> None:
    paths = {text for text in texts(LAYOUT['configById']) if text.startswith('/')}
    assert len(paths) > 15
    for path in paths:
        topic, *fields = path.split('.')
        assert not fields or isinstance(
            value_at(messages[topic][0], fields), bool | float | int | str), path
        assert messages[topic], path


def test_recording_has_each_number_that_the_plotjuggler_layout_plots(
        messages: dict[str, list[Any]]) -> None:
    layout = ElementTree.parse(ROOT / 'config' / 'plotjuggler_layout.xml').getroot()
    diagnosed = {
        f'{status.name}/{key}' for array in messages['/diagnostics'] for status in array.status
        for key in ('level', *(pair.key for pair in status.values))}
    curves = [curve.attrib['name'] for curve in layout.iter('curve')]
    assert len(curves) > 8
    for curve in curves:
        if curve.startswith('/diagnostics/'):
            assert any(curve.endswith(f'/{name}') for name in diagnosed), curve
        else:
            topic, _, field = curve.rpartition('/')
            assert isinstance(getattr(messages[topic][0], field), bool | float | int), curve


def test_recording_shows_the_run_and_the_latched_topics_of_the_qos_file(
        messages: dict[str, list[Any]]) -> None:
    assert {one.data for one in messages['/illuminator/enabled']} == {False, True}
    brightness = [one.data for one in messages['/illuminator/brightness']]
    assert max(brightness) > 90 and min(brightness) < 60
    assert max(one.vector.y for one in messages['/gimbal/angles']) > 0.4
    assert [one.data for one in messages['/rededge/image/index']] != []
    absent = {topic for topic in {*LATCHED} - {*messages}
              if not topic.endswith('/source') and not topic.startswith('/gimbal_manager/')}
    assert absent == {'/tf_static'}
    assert {(profile['reliability'], profile['durability']) for profile in LATCHED.values()} == {
        ('reliable', 'transient_local')}
