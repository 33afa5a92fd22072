# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The console: commands to simulated lights while they run."""

from illuminator_ros.cli.simulator.console import COMMANDS, execute
from illuminator_ros.illuminator.messages import IlluminatorStatus
from illuminator_ros.illuminator.simulated import COMMANDS as LIGHT_COMMANDS
from illuminator_ros.illuminator.simulated import SimulatedIlluminator
from illuminator_ros.illuminator.simulated_properties import FAULTS, IlluminatorProperties
from illuminator_ros.mavlink.dialect import mavlink
from illuminator_ros.mavlink.messages import Address
from illuminator_ros.simulation.faults import Behaviour
from illuminator_ros.simulation.simulated import SimulatedComponents
import pytest


class Console:
    """Two lights, ``bow`` and 1/244, and the lines that a user types."""

    def __init__(self) -> None:
        self.lights = SimulatedComponents((
            SimulatedIlluminator(IlluminatorProperties(Address(1, number), name=name))
            for number, name in ((243, 'bow'), (244, ''))), 0.0)
        self.bow, self.other = (one.device for one in self.lights.components)
        self.lights.schedule.run(0.0)
        self.lights.outgoing.clear()

    def enter(self, line: str, now: float = 10.0) -> str:
        return execute(line, self.lights.components, now)

    @property
    def behaviour(self) -> Behaviour:
        return self.lights.components[0].device.behaviour

    def status(self, now: float) -> IlluminatorStatus:
        return self.lights.components[0].device.status(now)


@pytest.fixture
def console() -> Console:
    return Console()


@pytest.mark.parametrize(('line', 'expected'), [
    ('on', (True, True)), ('bow on', (True, False)),
    ('1/244 on', (False, True)), ('off', (False, False))])
def test_a_line_is_for_all_lights_or_for_the_one_that_it_names(
        console: Console, line: str, expected: tuple[bool, bool]) -> None:
    assert console.enter(line) == 'done'
    assert (console.bow.enabled, console.other.enabled) == expected


def test_each_line_changes_its_part_of_the_configuration_only(console: Console) -> None:
    for line, params in (
            ('strobe 0.5', (1.0, 100.0, 0.5, 50.0)), ('strobe 0.5 25', (1.0, 100.0, 0.5, 25.0)),
            ('brightness 30', (1.0, 30.0, 0.5, 25.0)),
            ('mode external_sync', (2.0, 30.0, 0.5, 25.0)),
            ('strobe 0', (2.0, 30.0, 0.0, 25.0))):
        console.enter(line)
        assert console.bow.configuration.params() == params


@pytest.mark.parametrize(('line', 'answer'), [
    ('brightness 101', 'out of range'), ('brightness x', "'x' is not a number"),
    ('brightness nan', 'nan is outside'), ('strobe 99', 'outside the range that'),
    ('mode disco', "'disco' is "), ('brightness', 'usage: brightness PERCENT'),
    ('on now', 'usage: on'), ('jump', "no command or component 'jump'"),
    ('stern on', "no command or component 'stern'"),
    ('fault nope', "no fault 'nope'"), ('fault drop=9', '9 is outside 0.001 to 1'),
    ('clear nope', "no fault 'nope'"), ('ambient nan', 'nan is outside -273.15 to 1000'),
    ('temperature 9999', '9999 is outside -273.15 to 1000'), ('  \n', '')])
def test_a_line_that_cannot_be_executed_is_answered_and_changes_nothing(
        console: Console, line: str, answer: str) -> None:
    lamp = console.bow
    before = lamp.configuration, lamp.enabled, lamp.thermal.temperature, console.behaviour
    assert answer in console.enter(line)
    assert before == (
        lamp.configuration, lamp.enabled, lamp.thermal.temperature, console.behaviour)


@pytest.mark.parametrize('name', [name for name in FAULTS if name != 'reboot'])
def test_each_fault_can_be_typed_shown_and_ended(console: Console, name: str) -> None:
    normal = console.behaviour
    assert console.enter(f'bow fault {name}') == 'done'
    shown, other = console.enter('faults').splitlines()
    _, _, typed = shown.partition(': ')
    assert (typed.partition('=')[0], other) == (name, '1/244: no fault')
    faulty = console.behaviour
    console.enter(f'clear {name}')
    assert console.behaviour == normal
    console.enter(f'bow fault {typed}')
    assert console.behaviour == faulty
    console.enter('clear')
    assert console.behaviour == normal


def test_ambient_and_own_temperature_can_be_set(console: Console) -> None:
    console.enter('ambient 90')
    assert console.status(2000.0).temp_c == pytest.approx(90.0, abs=0.1)
    assert console.status(
        2000.0).error_status == mavlink.ILLUMINATOR_ERROR_FLAGS_THERMAL_THROTTLING
    console.enter('temperature 100', 2000.0)
    assert console.status(2000.1).error_status == 3


def test_help_has_each_command_and_each_fault(console: Console) -> None:
    text = console.enter('help')
    words = [*(one.usage for one in COMMANDS), *(one.usage for one in LIGHT_COMMANDS), *FAULTS]
    assert [word for word in words if f'  {word}' not in text] == []


@pytest.mark.parametrize('line', ['reboot', 'fault reboot'])
def test_a_restart_without_an_interval_happens_once(console: Console, line: str) -> None:
    console.enter('on')
    console.enter(line)
    assert (console.bow.enabled, console.bow.uptime_ms(10.0)) == (False, 0)
    console.lights.schedule.run(60.0)
    assert console.bow.uptime_ms(60.0) == 50_000
