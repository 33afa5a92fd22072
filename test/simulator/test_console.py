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

"""What can be done to simulated lights while they run."""

from illuminator_ros.cli.simulator.console import COMMANDS, describe_commands, execute
from illuminator_ros.illuminator.error_flags import ErrorFlag
from illuminator_ros.illuminator.faults import FAULTS
from illuminator_ros.illuminator.simulated import simulated_lights
from illuminator_ros.illuminator.simulated_properties import IlluminatorProperties
from illuminator_ros.mavlink.messages import Address, IlluminatorStatus
import pytest


class Bench:

    def __init__(self):
        self.lights = simulated_lights([
            IlluminatorProperties(address=Address(1, 243), name='bow'),
            IlluminatorProperties(address=Address(1, 244))], 0.0)
        self.bow, self.other = self.lights.components
        self.lights.poll(0.0)
        self.lights.outgoing.clear()

    def enter(self, line, now=10.0):
        return execute(line, self.lights.components, now)


@pytest.fixture
def bench():
    return Bench()


@pytest.mark.parametrize(('line', 'expected'), [
    ('on', (True, True)), ('all on', (True, True)), ('bow on', (True, False)),
    ('1/244 on', (False, True))])
def test_a_line_is_for_all_lights_or_for_one(bench, line, expected):
    assert bench.enter(line) == 'done'
    assert (bench.bow.device.lamp.enabled, bench.other.device.lamp.enabled) == expected


def test_a_button_is_seen_at_once_in_the_status(bench):
    bench.enter('bow brightness 30')
    ((source, status),) = bench.lights.outgoing
    assert isinstance(status, IlluminatorStatus)
    assert (source, status.brightness) == (Address(1, 243), 30.0)


def test_the_rest_of_a_configuration_stays(bench):
    bench.enter('strobe 0.5 25')
    bench.enter('brightness 30')
    bench.enter('mode external_sync')
    configuration = bench.bow.device.lamp.configuration
    assert configuration.params() == (2.0, 30.0, 0.5, 25.0)
    bench.enter('strobe 0')
    assert bench.bow.device.lamp.configuration.strobe_period == 0


def test_lights_are_switched_off(bench):
    bench.enter('on')
    bench.enter('off')
    assert not bench.bow.device.lamp.enabled


@pytest.mark.parametrize(('line', 'said'), [
    ('brightness 101', 'out of range'), ('brightness x', "'x' is not a number"),
    ('brightness nan', 'not a finite number'), ('strobe 99', 'outside what the light reports'),
    ('mode disco', "'disco' is none of"), ('brightness', 'usage: brightness PERCENT'),
    ('on now', 'usage: on'), ('jump', "no command or light 'jump'"),
    ('fault nope', "no fault 'nope'"), ('fault drop=9', 'not a SHARE'),
    ('ambient x', 'not a number'),
    ('ambient nan', 'not possible'), ('temperature 9999', 'not possible'),
    ('clear nope', "no fault 'nope'"), ('stern on', "no command or light 'stern'")])
def test_a_line_that_means_nothing_is_answered_and_does_nothing(bench, line, said):
    lamp = bench.bow.device.lamp
    before = lamp.configuration, lamp.enabled, bench.bow.behaviour
    assert said in bench.enter(line)
    assert (lamp.configuration, lamp.enabled, bench.bow.behaviour) == before


def test_an_empty_line_is_nothing(bench):
    assert bench.enter('  \n') == ''


@pytest.mark.parametrize('line', ['fault refuse=failed', 'refuse=failed'])
def test_a_fault_begins_and_ends(bench, line):
    bench.enter(f'bow {line}')
    assert bench.enter('faults') == '1/243: refuse=failed\n1/244: no fault'
    bench.enter('clear refuse')
    assert bench.enter('bow faults') == '1/243: no fault'


def test_all_faults_end_at_once(bench):
    for name in ('drop', 'lie', 'thermistor'):
        bench.enter(f'fault {name}')
    bench.enter('clear')
    assert bench.bow.behaviour == IlluminatorProperties().behaviour


@pytest.mark.parametrize('name', [name for name in FAULTS if name != 'reboot'])
def test_every_fault_can_be_typed(bench, name):
    assert bench.enter(f'fault {name}') == 'done'
    _, _, shown = bench.enter('bow faults').partition(': ')
    assert shown.partition('=')[0] == name
    typed = bench.bow.behaviour
    bench.enter('bow clear')
    bench.enter(f'bow fault {shown}')
    assert bench.bow.behaviour == typed


@pytest.mark.parametrize(('line', 'meant'), [
    ('fault bow:drop=0.2', 'bow fault drop=0.2'), ('--fault bow:drop', 'bow fault drop'),
    ('1/243:refuse=failed', '1/243 fault refuse=failed')])
def test_who_names_a_light_as_in_the_option_is_shown_how_to_do_it_here(bench, line, meant):
    assert bench.enter(line) == f'for one light: {meant}'
    assert bench.bow.behaviour == IlluminatorProperties().behaviour
    assert bench.enter(meant) == 'done'


@pytest.mark.parametrize('line', ['reboot', 'fault reboot'])
def test_a_restart_happens_once(bench, line):
    bench.enter('on')
    assert bench.bow.device.lamp.uptime_ms(10.0) == 10_000
    bench.enter(line)
    assert (bench.bow.device.lamp.enabled, bench.bow.device.lamp.uptime_ms(10.0)) == (False, 0)
    bench.lights.poll(60.0)
    assert bench.bow.device.lamp.uptime_ms(60.0) == 50_000


def test_the_surroundings_get_hot(bench):
    bench.enter('ambient 90')
    bench.lights.poll(2000.0)
    assert bench.bow.device.status(2000.0).temp_c == pytest.approx(90.0, abs=0.1)
    assert bench.bow.device.status(2000.0).error_status == ErrorFlag.THERMAL_THROTTLING


def test_a_light_can_be_heated_and_cools_down_again(bench):
    bench.enter('temperature 100')
    assert bench.bow.device.status(10.1).error_status == 3
    assert bench.bow.device.status(2000.0).error_status == 0


def test_what_each_light_does_can_be_seen(bench):
    bench.enter('bow on')
    first, second = bench.enter('status').splitlines()
    assert first.startswith('1/243 bow') and '  ON  ' in first
    assert second.startswith('1/244') and '  off  ' in second


def test_help_has_every_command_and_every_fault(bench):
    text = bench.enter('help')
    for command in COMMANDS.values():
        assert command.usage in text
    for name in FAULTS:
        assert f'  {name}' in text
    assert describe_commands() in text
