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

"""The console of the simulator: commands to simulated lights while they run. No I/O."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from .view import look
from ...illuminator.faults import FAULTS
from ...illuminator.model import InvalidValue
from ...illuminator.simulated import SimulatedIlluminator
from ...payload.faults import FaultError
from ...payload.simulated import SimulatedComponent

Light = SimulatedComponent[SimulatedIlluminator]


class _Wrong(ValueError):
    """A line that cannot be executed; the message says why."""


@dataclass(frozen=True)
class _Command:
    usage: str
    help: str  # noqa: A003
    do: Callable[[Light, list[str], float], str]
    counts: tuple[int, ...]


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise _Wrong(f'{text!r} is not a number') from None


def _fault(light: Light, words: list[str], now: float) -> str:
    # Without an interval, a restart is an event.
    if words == ['reboot']:
        light.restart(now)
    else:
        light.behave(FAULTS.add(light.behaviour, words[0]), now)
    return ''


def _clear(light: Light, words: list[str], now: float) -> str:
    normal = light.device.normal
    behaviour = FAULTS.remove(light.behaviour, normal, words[0]) if words else normal
    light.behave(behaviour, now)
    return ''


def _reboot(light: Light, words: list[str], now: float) -> str:
    light.restart(now)
    return ''


def _celsius(text: str) -> float:
    value = _number(text)
    if not -273.15 <= value <= 1000:
        raise _Wrong(f'{text} degC is not possible')
    return value


def _ambient(light: Light, words: list[str], now: float) -> str:
    light.device.lamp.set_ambient(_celsius(words[0]), now)
    return ''


def _temperature(light: Light, words: list[str], now: float) -> str:
    light.device.lamp.heat_to(_celsius(words[0]), now)
    return ''


def _on(light: Light, words: list[str], now: float) -> str:
    light.apply(light.device.press(now, enabled=True), now)
    return ''


def _off(light: Light, words: list[str], now: float) -> str:
    light.apply(light.device.press(now, enabled=False), now)
    return ''


def _brightness(light: Light, words: list[str], now: float) -> str:
    light.apply(light.device.press(now, brightness=_number(words[0])), now)
    return ''


def _mode(light: Light, words: list[str], now: float) -> str:
    light.apply(light.device.press(now, mode=words[0]), now)
    return ''


def _strobe(light: Light, words: list[str], now: float) -> str:
    duty = (_number(words[1]) if len(words) > 1
            else light.device.lamp.configuration.strobe_duty_cycle)
    light.apply(light.device.press(
        now, strobe_period=_number(words[0]), strobe_duty_cycle=duty), now)
    return ''


def _status(light: Light, words: list[str], now: float) -> str:
    return str(look(light, now))


def _faults(light: Light, words: list[str], now: float) -> str:
    texts = FAULTS.as_typed(light.behaviour, light.device.normal)
    return f'{light.address}: {", ".join(texts) or "no fault"}'


COMMANDS = {
    'on': _Command('on', 'switch on, as by a button on the light', _on, (0,)),
    'off': _Command('off', 'switch off, likewise', _off, (0,)),
    'brightness': _Command('brightness PERCENT', 'set it, likewise', _brightness, (1,)),
    'mode': _Command('mode MODE', 'internal_control or external_sync, likewise', _mode, (1,)),
    'strobe': _Command('strobe S [PERCENT]', 'period and duty cycle, likewise; 0 ends it',
                       _strobe, (1, 2)),
    'ambient': _Command('ambient DEG_C', 'change the ambient temperature', _ambient, (1,)),
    'temperature': _Command('temperature DEG_C', "change the light's own temperature",
                            _temperature, (1,)),
    'reboot': _Command('reboot', 'restart, as after a power cycle', _reboot, (0,)),
    'fault': _Command('fault NAME[=VALUE]', 'have something go wrong', _fault, (1,)),
    'clear': _Command('clear [NAME]', 'end one fault, or all', _clear, (0, 1)),
    'faults': _Command('faults', 'show which faults there are now', _faults, (0,)),
    'status': _Command('status', 'show what each light does', _status, (0,)),
}
OTHERS = {'help': 'show this', 'quit': 'end'}


def describe_commands() -> str:
    """Return what can be typed, a line each."""
    rows = [(command.usage, command.help) for command in COMMANDS.values()]
    return '\n'.join(f'  {usage:20} {text}' for usage, text in [*rows, *OTHERS.items()])


def execute(line: str, lights: Sequence[Light], now: float) -> str:
    """
    Do what a line says, and return the answer.

    :param line: a command, or the id or name of a light and a command.
    """
    words = line.split()
    if not words:
        return ''
    selected = [one for one in lights if words[0] in (str(one.address), one.name)]
    if words[0] in ('all', '*') or (selected and words[0] not in COMMANDS):
        words = words[1:] or ['status']
    else:
        selected = []
    name, *rest = words
    if name == 'help':
        return f'{describe_commands()}\nfaults:\n{FAULTS.describe()}'
    # The option's way to name a light, which has a place of its own here.
    light, colon, fault = words[-1].rpartition(':')
    if colon and words[:-1] in ([], ['fault'], ['--fault']):
        return f'for one light: {light} fault {fault}'
    # So that a fault that was seen in --help works as it stands there.
    if name.partition('=')[0] in FAULTS and name not in COMMANDS:
        name, rest = 'fault', [name, *rest]
    command = COMMANDS.get(name)
    if command is None:
        return f'no command or light {name!r}; help lists the commands'
    if len(rest) not in command.counts:
        return f'usage: {command.usage}'
    try:
        answers = [command.do(one, rest, now) for one in selected or lights]
    except (_Wrong, FaultError, InvalidValue) as error:
        return str(error)
    return '\n'.join(filter(None, answers)) or 'done'
