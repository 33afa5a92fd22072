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

"""The documents say what the code says."""

from importlib import import_module
from pathlib import Path
import re
from typing import Any

from bench.subjects import SUBJECTS
from illuminator_ros.cli.bridge import usage
from illuminator_ros.cli.monitor import graph, keys, model, requests
from illuminator_ros.cli.monitor.options import parser
from illuminator_ros.illuminator.error_flags import ErrorFlag
from illuminator_ros.mavlink.messages import (
    CommandAck,
    ComponentInformationBasic,
    IlluminatorStatus,
    MavCmd,
)
from illuminator_ros.ros import beam, beam_output, mounting
from illuminator_ros.ros.diagnostics import FLAG_LEVELS
from illuminator_ros.ros.parameter_spec import ParameterSpec
from illuminator_ros.ros.parameters import DEVICE_PARAMETERS, LINK_PARAMETERS
import pytest
from support.tables import table
import yaml

ROOT = Path(__file__).resolve().parents[2]
README = (ROOT / 'README.md').read_text()
PERFORMANCE = (ROOT / 'doc' / 'performance.md').read_text()
DESIGN = (ROOT / 'doc' / 'design.md').read_text()
PROTOCOL = (ROOT / 'doc' / 'protocol.md').read_text()
MONITOR = (ROOT / 'doc' / 'monitor.md').read_text()
BEAM = (ROOT / 'doc' / 'beam.md').read_text()
LEVELS = {b'\0': 'OK', b'\1': 'WARN', b'\2': 'ERROR'}


def range_of(spec: ParameterSpec) -> str:
    """Return what tools show of the values that a parameter may have, as the README writes it."""
    descriptor = spec.descriptor(read_only=False)
    _, found, choices = descriptor.additional_constraints.partition('one of: ')
    if found:
        return ', '.join(f'`{choice}`' for choice in choices.split(', '))
    return ', '.join(f'{limits.from_value:g} to {limits.to_value:g}' for limits in (
        *descriptor.floating_point_range, *descriptor.integer_range))


def meaning_of(spec: ParameterSpec) -> str:
    """Return what tools show of the meaning of a parameter, without its choices and unit."""
    extra = spec.descriptor(read_only=False).additional_constraints
    return spec.description if not extra or spec.choices else f'{spec.description}; {extra}'


@pytest.mark.parametrize('spec', LINK_PARAMETERS, ids=lambda spec: spec.name)
def test_readme_has_each_parameter_of_the_link_as_tools_show_it(spec: ParameterSpec) -> None:
    rows = {cells[0]: cells[1:] for cells in table(README, 'parameter of the link')}
    default = spec.shown_default and f'`{spec.shown_default}`'

    *cells, meaning = rows[f'`{spec.name}`']

    assert cells == [default, range_of(spec), spec.unit]
    assert meaning.replace('`', '') == meaning_of(spec)


@pytest.mark.parametrize('spec', DEVICE_PARAMETERS, ids=lambda spec: spec.name)
def test_readme_has_each_parameter_of_the_light_as_tools_show_it(spec: ParameterSpec) -> None:
    rows = {cells[0]: cells[1:] for cells in table(README, 'parameter of the light')}
    kind = {float: 'double', str: 'string'}[type(spec.default)]

    assert rows[f'`{spec.name}`'] == [kind, range_of(spec), spec.unit, meaning_of(spec)]


@pytest.mark.parametrize(('heading', 'specs'), [
    ('parameter of the link', LINK_PARAMETERS), ('parameter of the light', DEVICE_PARAMETERS)])
def test_readme_has_no_other_parameters(heading: str, specs: tuple[ParameterSpec, ...]) -> None:
    assert [cells[0] for cells in table(README, heading)] == [f'`{spec.name}`' for spec in specs]


def test_yaml_has_each_link_parameter_with_its_default() -> None:
    content = yaml.safe_load((ROOT / 'config' / 'bridge.yaml').read_text())
    given = content['/**']['ros__parameters']
    assert given == {spec.name: spec.default for spec in LINK_PARAMETERS}
    assert all(type(given[spec.name]) is type(spec.default) for spec in LINK_PARAMETERS)


def test_yaml_mentions_each_parameter_of_the_light() -> None:
    text = (ROOT / 'config' / 'bridge.yaml').read_text()
    for spec in DEVICE_PARAMETERS:
        assert re.search(rf'^    # {spec.name}: ', text, re.MULTILINE)


@pytest.mark.parametrize('spec', [*LINK_PARAMETERS, *DEVICE_PARAMETERS], ids=lambda s: s.name)
def test_yaml_tells_the_unit(spec: ParameterSpec) -> None:
    text = (ROOT / 'config' / 'bridge.yaml').read_text()
    assert re.search(rf'^    (# )?{spec.name}: .+ # {re.escape(spec.unit)}(,|$)', text,
                     re.MULTILINE) or not spec.unit


@pytest.mark.parametrize('spec', [*LINK_PARAMETERS, *DEVICE_PARAMETERS], ids=lambda s: s.name)
def test_help_has_each_parameter(spec: Any) -> None:
    limits = f'{range_of(spec)} {spec.unit}'.replace('`', '').strip()
    shown = re.escape(spec.description + (f' ({limits})' if limits else ''))
    assert re.search(rf'^  {spec.name} +.*{shown}$', usage(), re.MULTILINE)


@pytest.mark.parametrize('message', [CommandAck, IlluminatorStatus, ComponentInformationBasic],
                         ids=lambda message: message.msgname)
def test_protocol_page_has_each_field_of_a_message(message: Any) -> None:
    fields: dict[str, set[str]] = {}
    name = ''
    for cells in table(PROTOCOL, 'message'):
        name = cells[0] or name
        fields.setdefault(name, set()).update(re.findall('`([^`]+)`', cells[1]))
    assert fields[message.msgname] == set(message.fieldnames)


def test_protocol_page_has_each_command_with_its_number() -> None:
    rows = {cells[0] for cells in table(PROTOCOL, 'command')}
    assert rows == {f'MAV_CMD_{command.name} ({command.value})' for command in MavCmd}


def test_protocol_page_has_each_flag_with_its_level_and_text() -> None:
    rows = {cells[0]: cells[1:] for cells in table(PROTOCOL, 'ILLUMINATOR_ERROR_FLAGS')}
    for flag in ErrorFlag:
        level, text = FLAG_LEVELS[flag]
        assert rows[f'{flag.name} ({flag.value})'] == [LEVELS[level], text]


def test_beam_page_has_each_parameter_with_its_unit() -> None:
    rows = {cells[0]: cells[1] for cells in table(BEAM, 'parameter')}
    assert rows == {f'`{spec.name}`': spec.unit for spec in LINK_PARAMETERS
                    if spec.name in mounting.NAMES}


@pytest.mark.parametrize('text', [
    f'under {beam.SHORTEST_PERIOD:g} s', f'at least {beam.SHORTEST_FLASH:g} s',
    f'drop it {beam_output.LIFETIME} s'])
def test_beam_page_has_the_limits_of_the_code(text: str) -> None:
    assert text in BEAM


def test_monitor_page_has_each_key_with_what_it_does() -> None:
    rows = [(tuple(re.findall('`([^`]+)`', cells[0])), cells[1])
            for cells in table(MONITOR, 'key')]
    assert rows == list(keys.HELP)


def test_monitor_page_has_each_state() -> None:
    rows = [cells[0] for cells in table(MONITOR, 'state')]
    assert rows == [f'`{state.value}`' for state in model.State]


@pytest.mark.parametrize('text', [
    f'for {model.SILENCE:g} s, not even', f'within {requests.ANSWER_LIMIT:g} s',
    f'`--wait` {parser().get_default("wait"):g} s',
    ', '.join(f'`{topic}`' for topic in graph.SIGNATURE).replace(
        ', `error_flags`', ' and `error_flags`')])
def test_monitor_page_has_the_limits_of_the_code(text: str) -> None:
    assert text in MONITOR


def test_design_page_has_each_module() -> None:
    _, tree, _ = DESIGN.split('```', 2)
    modules = {path.name for folder in ('', 'conformance', 'illuminator', 'mavlink', 'monitor',
                                        'ros', 'simulator')
               for path in (ROOT / 'illuminator_ros' / folder).glob('[!_]*.py')}
    assert set(re.findall(r'\w+\.py', tree)) == modules


def test_design_page_sends_nobody_to_what_is_not_there() -> None:
    modules = list((ROOT / 'illuminator_ros').rglob('*.py'))
    code = '\n'.join(path.read_text() for path in modules)
    files = {path.name for path in (*modules, *(ROOT / 'test').rglob('*.py'))}
    names = {name for cells in table(DESIGN, 'what | where') for cell in cells
             for name in re.findall('`([^`]+)`', cell)}

    def is_there(name: str) -> bool:
        if re.search(r'/|\.py$', name):
            return name in files or any(
                (ROOT / folder / name).exists() for folder in ('', 'illuminator_ros'))
        return re.search(rf'\b{name.rpartition(".")[2]}\b', code) is not None

    assert len(names) > 30
    assert [name for name in sorted(names) if not is_there(name)] == []


def test_design_page_has_the_bounds_of_the_code() -> None:
    constants = [constant for cells in table(DESIGN, 'store')
                 for constant in re.findall(r'`([\w.]+)`', cells[1])]
    assert constants, 'the table names no constants'
    for cells in table(DESIGN, 'store'):
        numbers = [int(number) for number in re.findall(r'\d+', cells[1].partition('(')[0])]
        names = re.findall(r'`([\w.]+)`', cells[1])
        module_name = ''
        values = []
        for name in names:
            *module, constant = name.split('.')
            module_name = '.'.join(module) or module_name
            values.append(getattr(_module(module_name), constant))
        in_bytes = 1024 if 'KiB' in cells[1] else 1
        assert [number * in_bytes for number in numbers[:len(values)]] == values, cells


def _module(name: str) -> Any:
    for package in ('illuminator', 'mavlink', 'mavlink.transport'):
        try:
            return import_module(f'illuminator_ros.{package}.{name}')
        except ModuleNotFoundError:
            continue
    raise AssertionError(f'no module {name}')


def test_performance_has_each_subject_of_the_benchmark() -> None:
    # The last one is there only where bench/promises.py is.
    rows = table(PERFORMANCE, 'subject')[:len(SUBJECTS)]
    assert [cells[0] for cells in rows] == [f'`{subject}`' for subject in SUBJECTS]
