# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The components that the command line and a file describe."""

from pathlib import Path
import sys
from typing import Any, cast

from illuminator_ros.cli.simulator import components
from illuminator_ros.cli.simulator.options import parser
from illuminator_ros.gimbal.simulated_manager import SIMULATED as MANAGERS
from illuminator_ros.illuminator.model import Mode
from illuminator_ros.illuminator.simulated import SIMULATED, SimulatedIlluminator
from illuminator_ros.illuminator.simulated_properties import IlluminatorProperties
from illuminator_ros.illuminator.thermal import ThermalProperties
from illuminator_ros.mavlink.messages import Address
from illuminator_ros.simulation.simulated import SimulatedDevice, SimulatedType
import pytest

TYPES = [SIMULATED]
FILE = {
    'url': 'udpin://127.0.0.1:1', 'ambient': 60, 'faults': ['lie'],
    'lights': [
        {'id': '1/243', 'name': 'bow', 'profile': 'extended', 'serial_number': 815,
         'thermal': {'rise': 70, 'time_constant': 60}},
        {'id': '1/250', 'modes': ['internal_control'], 'status_interval': 0.2,
         'faults': {'drop': 0.2, 'thermistor': True}}]}


def described(*arguments: str, file: object = None) -> list[SimulatedIlluminator]:
    return cast('list[SimulatedIlluminator]', components.components(
        parser().parse_args(list(arguments)),
        components.scenario(file, 'f.yaml', TYPES) if file else components.Scenario(), TYPES))


def properties(*arguments: str, file: object = None) -> list[IlluminatorProperties]:
    return [one.properties for one in described(*arguments, file=file)]


def faults(device: SimulatedDevice) -> list[str]:
    return device.faults.active(device.behaviour, device.normal)


@pytest.mark.parametrize(('arguments', 'addresses'), [
    ([], ['1/243']),
    (['--count', '3', '--system-id', '7', '--component-id', '50'], ['7/50', '7/51', '7/52']),
    (['--light', '1/243=bow', '--light', '2/10'], ['1/243 bow', '2/10']),
    (['--profile', 'reference'], ['255/0']),
    (['--profile', 'ardusub', '--count', '2'], ['1/1', '1/2']),
    (['--profile', 'reference', '--system-id', '9'], ['9/0'])])
def test_lights_are_counted_or_listed_or_have_the_address_of_their_profile(
        arguments: list[str], addresses: list[str]) -> None:
    assert [f'{one.address} {one.name}'.rstrip()
            for one in properties(*arguments)] == addresses


def test_without_arguments_a_light_follows_the_protocol() -> None:
    (light,), (one,) = described(), properties()
    assert one == IlluminatorProperties()
    assert faults(light) == []


def test_each_option_sets_its_property() -> None:
    (light,) = properties(
        '--vendor', 'ACME', '--model', 'Sun', '--software-version', '2.0', '--hardware-version',
        'B', '--serial-number', '0815', '--min-strobe-period', '0.2', '--max-strobe-period',
        '5', '--modes', 'internal_control', '--status-interval', '0.5', '--ambient', '40',
        '--thermal', 'rise=80,time_constant=30', '--time-scale', '10')
    assert light == IlluminatorProperties(
        vendor='ACME', model='Sun', software_version='2.0', hardware_version='B',
        serial_number='0815', min_strobe_period=0.2, max_strobe_period=5.0,
        modes=(Mode.INTERNAL_CONTROL,), status_interval=0.5, ambient=40.0,
        thermal=ThermalProperties(rise=80.0, time_constant=30.0), time_scale=10.0)
    assert [one.mode_bitmask for one in properties('--mode-bitmask', '0x6')] == [6]
    assert [one.seed for one in properties('--seed', '3')] == [3]


def test_several_lights_have_different_serial_numbers() -> None:
    assert [one.serial_number for one in properties(
        '--count', '2', '--serial-number', 'X')] == ['X-243', 'X-244']


def test_a_fault_is_for_all_lights_or_for_the_one_that_it_names() -> None:
    first, second = described(
        '--light', '1/243', '--light', '1/244=stern', '--fault', 'lie', '--fault',
        '1/243:drop=0.1,nan', '--fault', 'stern:slow')
    assert (faults(first), faults(second)) == (['drop', 'lie', 'nan'], ['slow', 'lie'])
    assert first.behaviour.drop == 0.1


def test_a_setting_is_for_every_kind_that_accepts_it() -> None:
    types: list[SimulatedType[Any]] = [SIMULATED, MANAGERS]
    file = components.scenario({'managers': [{'id': '1/9', 'heading': 40}]}, 'f.yaml', types)
    light, manager = cast('list[Any]', components.components(parser(types).parse_args([
        '--profile', 'px4', '--fault', 'lie,frozen-axis', '--vendor', 'ACME']), file, types))
    assert light.properties.vendor == 'ACME'
    assert manager.properties.vendor == 'ACME'
    assert [faults(one) for one in (light, manager)] == [['lie'], ['lie', 'frozen-axis']]
    assert not manager.behaviour.takes_pitchyaw
    with pytest.raises(components.SettingError, match="'ardusup' is not one of default"):
        components.components(
            parser(types).parse_args(['--profile', 'ardusup']), components.Scenario(), types)


def test_a_file_has_settings_for_all_lights_and_for_each() -> None:
    bow, other = described(file=FILE)
    first, second = properties(file=FILE)
    assert (str(first.address), first.name, first.serial_number) == ('1/243', 'bow', '815')
    assert first.extension
    assert (first.ambient, first.thermal.rise, first.thermal.time_constant) == (60, 70, 60)
    assert (second.modes, second.status_interval) == ((Mode.INTERNAL_CONTROL,), 0.2)
    assert (faults(bow), faults(other)) == (['lie'], ['drop', 'lie', 'thermistor'])


def test_the_command_line_takes_precedence_over_the_file() -> None:
    lights = described('--ambient', '10', '--fault', 'bow:nan', file=FILE)
    assert [one.properties.ambient for one in lights] == [10, 10]
    assert faults(lights[0]) == ['lie', 'nan']


def test_a_file_without_lights_leaves_their_number_to_the_command_line() -> None:
    assert len(described('--count', '2', file={'profile': 'ardusub'})) == 2


@pytest.mark.parametrize(('content', 'reason'), [
    ('text', 'has no keys'),
    ({'lights': 3}, 'lights is not a list of lights'),
    ({'lights': [3]}, 'lights is not a list of lights'),
    ({'lights': [{}]}, "light 1: id: '' is "),
    ({'lights': [{'id': '1/2', 'colour': 'red'}]}, "light 1: no setting 'colour'"),
    ({'lights': [{'id': '1/2', 'ambient': 'hot'}]}, "light 1: ambient: 'hot' is not a number"),
    ({'lights': [{'id': '1/2', 'faults': ['nope']}]}, "light 1: faults: no fault 'nope'"),
    ({'lights': [{'id': '1/2'}, {'id': '1/2'}]}, 'two lights have the address 1/2'),
    ({'lights': [{'id': f'1/{n}'} for n in range(1, 203)]}, '202 lights are more than 200'),
    ({'profile': 'x'}, "profile: 'x' is not one of default, reference"),
    ({'profiel': 'x'}, "no setting 'profiel'")])
def test_an_error_in_a_file_names_its_place_and_the_reason(content: object, reason: str) -> None:
    with pytest.raises(components.SettingError) as caught:
        described(file=content)
    assert reason in str(caught.value)


@pytest.mark.parametrize(('arguments', 'reason'), [
    (['--count', '20', '--component-id', '250'], 'reaches 269; component ids end at 255'),
    (['--light', '1'], "--light 1: '1' is "), (['--light', '0/1'], "--light 0/1: '0/1' is "),
    (['--light', '1/2', '--light', '1/2'], 'two lights have the address 1/2'),
    *(([option, '3', '--light', '1/2'], f'{option} is for lights that neither')
      for option in ('--count', '--system-id', '--component-id')),
    (['--fault', '1/9:drop'], "there is no light '1/9'"),
    (['--fault', '1/243:drop,1/244:lie'],
     'commas separate the faults of one light: repeat --fault for another one'),
    (['--fault', 'nope'], "no fault 'nope'"),
    (['--thermal', 'throttle_until=90'], 'throttling thresholds are not in order'),
    (['--modes', 'a'], "--modes: 'a' is not one of internal_control, external_sync"),
    (['--thermal', 'rise'], "--thermal: 'rise' is not one of rise=VALUE"),
    (['--profile', 'x'], "--profile: 'x' is not one of default"),
    (['--ambient', 'x'], "--ambient: 'x' is not a number")])
def test_options_that_contradict_each_other_are_refused_with_the_reason(
        arguments: list[str], reason: str) -> None:
    with pytest.raises(components.SettingError) as caught:
        described(*arguments)
    assert reason in str(caught.value)


@pytest.mark.parametrize(('arguments', 'reason'), [
    (['--count', '0'], '0 is outside 1 to 200'),
    (['--nope'], 'unrecognized arguments')])
def test_a_wrong_option_is_one_line_with_exit_status_2(
        arguments: list[str], reason: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as caught:
        described(*arguments)
    printed = capsys.readouterr().err
    assert (caught.value.code, reason in printed, printed.count('\n')) == (2, True, 1)


def test_the_help_has_an_option_for_each_setting() -> None:
    text = parser().format_help()
    assert [name for name in SIMULATED.all_settings
            if f'--{name.replace("_", "-")}' not in text] == []


def test_a_yaml_file_is_read_or_refused_with_the_reason(
        tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / 'lights.yaml'
    path.write_text('url: udpin://127.0.0.1:1\nlights:\n  - {id: 1/9, ambient: 3}\n')
    found = components.load(str(path), TYPES)
    assert (found.url, found.listed) == ('udpin://127.0.0.1:1', [
        components.Listed(SIMULATED, Address(1, 9), '', {'ambient': 3.0})])
    with pytest.raises(components.SettingError, match='No such file'):
        components.load(str(tmp_path / 'nowhere'), TYPES)
    monkeypatch.setitem(sys.modules, 'yaml', None)
    with pytest.raises(components.SettingError, match='need PyYAML: pip install pyyaml'):
        components.load(str(path), TYPES)


@pytest.mark.parametrize(('content', 'reason'), [
    ('a: [', 'not YAML: '),
    ('vendor: 2026-02-30', 'not YAML: day is out of range'),
    ('seed: !!int few', 'not YAML: invalid literal'),
    (f'seed: {"9" * 5000}', 'not YAML: Exceeds the limit'),
    ('vendor: caf\xe9', "not YAML: 'utf-8' codec"),
    (f'ambient: {"[" * 2000}', 'not YAML: maximum recursion depth'),
    ('ambient: &own [*own]', 'not YAML: maximum recursion depth')])
def test_a_file_that_cannot_be_parsed_is_named_with_the_reason(
        tmp_path: Path, content: str, reason: str) -> None:
    path = tmp_path / 'lights.yaml'
    path.write_text(content, encoding='latin-1')

    with pytest.raises(components.SettingError) as error:
        components.load(str(path), TYPES)

    assert str(error.value).startswith(f'{path}: {reason}')
