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

"""The layouts for Foxglove and PlotJuggler show topics and fields that there are."""

from collections.abc import Iterator
from importlib import import_module
import json
from pathlib import Path
from typing import Any
import xml.etree.ElementTree as ET

from diagnostic_msgs.msg import DiagnosticArray
import pytest
from support.graph import Interface, interface
from support.processes import Program
from support.ros import Ros, STREAM

CONFIG = Path(__file__).parents[2] / 'config'
FOXGLOVE = json.loads((CONFIG / 'foxglove_layout.json').read_text())
PLOTJUGGLER = ET.parse(CONFIG / 'plotjuggler_layout.xml').getroot()
CURVES = [curve.attrib['name'] for curve in PLOTJUGGLER.iter('curve')]
NUMBERS = {'boolean', 'float', 'double', 'uint32'}
SHOWN = {'brightness', 'temperature', 'connected', 'enabled', 'error_flags'}


@pytest.fixture(scope='module')
def settings() -> dict[str, Any]:
    """With the beam shown."""
    return {'beam_range': 5.0}


@pytest.fixture(scope='module')
def topics(ros: Ros, shared_bridge: tuple[Program, Any]) -> dict[str, str]:
    """Return the topics of the bridge with their types."""
    offered: Interface = interface(ros)
    return offered.publishers


def field_type(message: str, path: list[str]) -> str:
    """Return the type of a field of a message."""
    package, _, name = message.split('/')
    fields = getattr(import_module(f'{package}.msg'), name).get_fields_and_field_types()
    kind: str = fields[path[0]]
    return field_type(kind.replace('/', '/msg/'), path[1:]) if path[1:] else kind


def foxglove_paths() -> Iterator[str]:
    """Return all message paths of plots and state transitions."""
    for panel in FOXGLOVE['configById'].values():
        yield from (series['value'] for series in panel.get('paths', []))


def panels(layout: Any) -> Iterator[str]:
    """Return the ids of the panels that are laid out."""
    if isinstance(layout, str):
        yield layout
        return
    assert layout.keys() == {'direction', 'first', 'second', 'splitPercentage'}
    assert layout['direction'] in ('row', 'column')
    yield from panels(layout['first'])
    yield from panels(layout['second'])


def test_foxglove_has_a_place_for_each_panel() -> None:
    assert sorted(panels(FOXGLOVE['layout'])) == sorted(FOXGLOVE['configById'])


@pytest.mark.parametrize('path', list(foxglove_paths()))
def test_foxglove_plots_what_is_published(topics: dict[str, str], path: str) -> None:
    topic, *fields = path.split('.')
    assert field_type(topics[topic], fields) in NUMBERS | {'string'}


def test_foxglove_shows_the_state_of_the_light() -> None:
    shown = {path.split('.')[0].removeprefix('/illuminator/') for path in foxglove_paths()}
    assert shown >= SHOWN | {'mode'}


def test_foxglove_shows_diagnostics_and_beam(topics: dict[str, str]) -> None:
    by_topic = {topic: name.partition('!')[0] for name, panel in FOXGLOVE['configById'].items()
                for topic in [*panel.get('topics', {}), panel.get('topicToRender')] if topic}
    assert by_topic == {'/illuminator/beam': '3D', '/diagnostics': 'DiagnosticStatusPanel'}
    assert topics['/illuminator/beam'] == 'visualization_msgs/msg/Marker'
    assert topics['/diagnostics'] == 'diagnostic_msgs/msg/DiagnosticArray'


def test_plotjuggler_subscribes_to_what_it_plots_and_to_nothing_else(
    topics: dict[str, str],
) -> None:
    [selected] = [str(element.attrib['value']).split(';')
                  for element in PLOTJUGGLER.iter('selected_topics')]
    assert set(selected) <= set(topics)
    assert set(selected) == {topic for curve in CURVES for topic in topics
                             if curve.startswith(f'{topic}/')}


@pytest.mark.parametrize('curve', [name for name in CURVES if '/illuminator/' in name[:13]])
def test_plotjuggler_plots_numbers_that_are_published(
    topics: dict[str, str], curve: str,
) -> None:
    [topic] = [topic for topic in topics if curve.startswith(f'{topic}/')]
    assert field_type(topics[topic], curve.removeprefix(f'{topic}/').split('/')) in NUMBERS


def test_plotjuggler_shows_the_state_of_the_light() -> None:
    assert {name.split('/')[2] for name in CURVES if name.startswith('/illuminator/')} >= SHOWN


def test_plotjuggler_s_splitters_count_what_they_hold() -> None:
    for splitter in PLOTJUGGLER.iter('DockSplitter'):
        sizes = [float(size) for size in splitter.attrib['sizes'].split(';')]
        assert len(sizes) == int(splitter.attrib['count']) == len(splitter)
        assert sum(sizes) == pytest.approx(1.0)
        assert splitter.attrib['orientation'] in '-|'


def test_plotjuggler_plots_diagnostics_that_the_demonstration_publishes(
    ros: Ros, shared_bridge: tuple[Program, Any],
) -> None:
    """It calls them TOPIC/HARDWARE_ID/NAME/KEY, the level as if it were a key."""
    url, serial = 'udpin://127.0.0.1:14590', 'SIM-1-243'
    curves = [name.removeprefix('/diagnostics/') for name in CURVES
              if name.startswith('/diagnostics/')]
    assert {curve.rpartition('/illuminator: ')[0] for curve in curves} == {url, serial}
    published = ros.subscribe(DiagnosticArray, '/diagnostics', STREAM).wait(
        lambda array: len(array.status) == 2, 30.0)
    known = {f'{status.name}/{key}' for status in published.status
             for key in ['level', *(value.key for value in status.values)]}
    assert {'illuminator: ' + curve.rpartition('/illuminator: ')[2] for curve in curves} <= known
