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

"""Which lights the command line and a file describe."""

from illuminator_ros.cli.simulator.lights import lights, load, Scenario, scenario
from illuminator_ros.cli.simulator.options import parser
from illuminator_ros.cli.simulator.settings import SettingError, SETTINGS
from illuminator_ros.illuminator.faults import FAULTS
from illuminator_ros.illuminator.model import Limits, Mode
from illuminator_ros.mavlink.messages import Address
import pytest


def described(*arguments, file=None):
    return lights(parser().parse_args(list(arguments)),
                  scenario(file, 'f.yaml') if file else Scenario())


def sources(found):
    return [str(one.address) for one in found]


def faults(light):
    return FAULTS.active(light.behaviour, light.normal)


def test_without_arguments_there_is_one_ordinary_light():
    (light,) = described()
    assert light.address == Address(1, 243)
    assert light.limits == Limits(0.05, 10.0)
    assert light.identity.serial_number == 'SIM-1-243'
    assert light.mode_bitmask == 3
    assert faults(light) == []


def test_lights_are_counted_up():
    found = described('--count', '3', '--system-id', '7', '--component-id', '50')
    assert sources(found) == ['7/50', '7/51', '7/52']
    assert len({one.identity.serial_number for one in found}) == 3


def test_lights_can_be_listed_with_names():
    found = described('--light', '1/243=bow', '--light', '2/10')
    assert [(str(one.address), one.name) for one in found] == [('1/243', 'bow'), ('2/10', '')]


@pytest.mark.parametrize('option', ['--count', '--system-id', '--component-id'])
@pytest.mark.parametrize('listing', [('--light', '1/2'), None], ids=['by option', 'by file'])
def test_lights_that_are_listed_are_not_counted_too(option, listing):
    with pytest.raises(SettingError, match=f'{option} is for lights that neither'):
        described(option, '3', *(listing or ()), file=None if listing else FILE)


def test_a_profile_brings_its_address():
    assert sources(described('--profile', 'reference')) == ['255/0']
    assert sources(described('--profile', 'ardusub', '--count', '2')) == ['1/1', '1/2']
    assert sources(described('--profile', 'reference', '--system-id', '9')) == ['9/0']


def test_options_say_what_the_light_is():
    (light,) = described(
        '--vendor', 'ACME', '--model', 'Sun', '--software-version', '2.0', '--hardware-version',
        'B', '--serial-number', '0815', '--min-strobe-period', '0.2', '--max-strobe-period',
        '5', '--modes', 'internal_control', '--status-interval', '0.5', '--ambient', '40',
        '--thermal', 'rise=80,time_constant=30', '--time-scale', '10', '--seed', '3')
    identity = light.identity
    assert (identity.vendor, identity.model, identity.serial_number) == ('ACME', 'Sun', '0815')
    assert (identity.software_version, identity.hardware_version) == ('2.0', 'B')
    assert light.limits == Limits(0.2, 5.0)
    assert (light.modes, light.mode_bitmask) == ((Mode.INTERNAL_CONTROL,), 1)
    assert (light.status_interval, light.time_scale, light.seed) == (0.5, 10.0, 3)
    assert (light.thermal.ambient, light.thermal.rise, light.thermal.time_constant) == (40, 80, 30)


def test_several_lights_do_not_share_a_serial_number():
    found = described('--count', '2', '--serial-number', 'X')
    assert [one.identity.serial_number for one in found] == ['X-243', 'X-244']


def test_a_bitmask_of_its_own_wins():
    (light,) = described('--mode-bitmask', '0x6')
    assert (light.mode_bitmask, len(light.modes)) == (6, 2)


def test_faults_are_for_all_lights_or_for_one_by_id_or_name():
    first, second = described(
        '--light', '1/243', '--light', '1/244=stern', '--fault', 'lie', '--fault',
        '1/243:drop=0.1,nan', '--fault', 'stern:slow')
    assert faults(first) == ['drop', 'lie', 'nan']
    assert faults(second) == ['slow', 'lie']
    assert first.behaviour.drop == 0.1


FILE = {
    'url': 'udpin://127.0.0.1:1', 'ambient': 60, 'faults': ['lie'],
    'lights': [
        {'id': '1/243', 'name': 'bow', 'profile': 'extended', 'serial_number': 815,
         'thermal': {'rise': 70, 'time_constant': 60}},
        {'id': '1/250', 'modes': ['internal_control'], 'status_interval': 0.2,
         'faults': {'drop': 0.2, 'thermistor': True}}]}


def test_a_file_says_the_same_for_each_light():
    bow, other = described(file=FILE)
    assert (str(bow.address), bow.name, bow.identity.serial_number) == ('1/243', 'bow', '815')
    assert bow.behaviour.extension is not None
    assert (bow.thermal.ambient, bow.thermal.rise, bow.thermal.time_constant) == (60, 70, 60)
    assert faults(bow) == ['lie']
    assert (other.modes, other.status_interval) == ((Mode.INTERNAL_CONTROL,), 0.2)
    assert faults(other) == ['drop', 'lie', 'thermistor']


def test_the_command_line_counts_more_than_the_file():
    bow, other = described('--ambient', '10', '--fault', 'bow:nan', file=FILE)
    assert (bow.thermal.ambient, other.thermal.ambient) == (10, 10)
    assert faults(bow) == ['lie', 'nan']


def test_a_file_without_lights_leaves_their_number_to_the_command_line():
    assert sources(described('--count', '2', file={'profile': 'ardusub'})) == ['1/1', '1/2']


@pytest.mark.parametrize(('content', 'said'), [
    ('text', 'has no keys'),
    ({'lights': 3}, 'lights is no list of lights'),
    ({'lights': [3]}, 'lights is no list of lights'),
    ({'lights': [{}]}, "light 1: id: '' is no address"),
    ({'lights': [{'id': '1/2', 'colour': 'red'}]}, "light 1: no setting 'colour'"),
    ({'lights': [{'id': '1/2', 'ambient': 'hot'}]}, "light 1: ambient: 'hot' is not a number"),
    ({'lights': [{'id': '1/2', 'faults': ['nope']}]}, "light 1: faults: no fault 'nope'"),
    ({'lights': [{'id': '1/2'}, {'id': '1/2'}]}, 'two lights 1/2'),
    ({'lights': [{'id': f'1/{n}'} for n in range(1, 203)]}, '202 lights are more than 200'),
    ({'profile': 'x'}, "profile: 'x' is none of default, reference"),
    ({'profiel': 'x'}, "no setting 'profiel'"),
])
def test_what_is_wrong_in_a_file_is_said_with_its_place(content, said):
    with pytest.raises(SettingError) as caught:
        described(file=content)
    assert said in str(caught.value)


@pytest.mark.parametrize(('arguments', 'said'), [
    (['--count', '20', '--component-id', '250'], 'reaches 269; component ids end at 255'),
    (['--light', '1'], "'1' is no address such as 1/243"),
    (['--light', '0/1'], 'is no address'),
    (['--light', '1/2', '--light', '1/2'], 'two lights 1/2'),
    (['--fault', '1/9:drop'], "there is no light '1/9'"),
    (['--fault', 'nope'], "no fault 'nope'"),
    (['--min-strobe-period', '5', '--max-strobe-period', '1'],
     'min_strobe_period is above max_strobe_period'),
    (['--thermal', 'throttle_until=90'], 'throttling thresholds are not in order'),
])
def test_what_does_not_go_together_is_said(arguments, said):
    with pytest.raises(SettingError) as caught:
        described(*arguments)
    assert said in str(caught.value)


@pytest.mark.parametrize(('arguments', 'said'), [
    (['--modes', 'a'], "argument --modes: 'a' is none of internal_control, external_sync"),
    (['--thermal', 'rise'], "argument --thermal: 'rise' is none of ambient=VALUE"),
    (['--profile', 'x'], "argument --profile: 'x' is none of default"),
    (['--ambient', 'x'], "argument --ambient: 'x' is not a number"),
    (['--count', '0'], '0 is outside 1 to 200'),
    (['--nope'], 'unrecognized arguments'),
])
def test_a_wrong_option_is_said_in_one_line_with_exit_status_2(arguments, said, capsys):
    with pytest.raises(SystemExit) as caught:
        described(*arguments)
    printed = capsys.readouterr().err
    assert caught.value.code == 2
    assert said in printed
    assert printed.count('\n') == 1


def test_every_setting_is_an_option_and_in_the_help():
    text = parser().format_help()
    for name in SETTINGS:
        assert f'--{name.replace("_", "-")}' in text


def test_the_help_says_what_is_at_the_other_end_of_the_link():
    text = ' '.join(parser().format_help().split())
    assert 'url the link to a bridge, router or autopilot: UDP, TCP or serial (default:' in text


def test_a_yaml_file_is_read(tmp_path):
    path = tmp_path / 'lights.yaml'
    path.write_text('url: udpin://127.0.0.1:1\nlights:\n  - {id: 1/9, ambient: 3}\n')
    found = load(str(path))
    assert (found.url, found.lights) == (
        'udpin://127.0.0.1:1', [(Address(1, 9), '', {'ambient': 3.0})])


def test_what_is_no_yaml_is_said(tmp_path):
    path = tmp_path / 'lights.yaml'
    path.write_text('a: [')
    with pytest.raises(SettingError, match='no YAML'):
        load(str(path))
    with pytest.raises(SettingError, match='No such file'):
        load(str(tmp_path / 'nowhere'))


def test_without_pyyaml_it_is_said_what_to_install(monkeypatch):
    monkeypatch.setitem(__import__('sys').modules, 'yaml', None)
    with pytest.raises(SettingError, match='need PyYAML: pip install pyyaml'):
        load('lights.yaml')
