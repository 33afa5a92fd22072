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

"""What can be done to simulated lights while they run. No I/O; time is passed in."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from .view import glance
from ...illuminator.device import Device
from ...illuminator.faults import as_typed, FaultError, FAULTS, with_fault, without_fault
from ...illuminator.faults import describe as describe_faults
from ...illuminator.model import InvalidValue


class _Wrong(ValueError):
    """A line that means nothing; the message says why."""


@dataclass(frozen=True)
class _Command:
    usage: str
    help: str  # noqa: A003
    do: Callable[[Device, list[str], float], str]
    counts: tuple[int, ...]


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise _Wrong(f'{text!r} is not a number') from None


def _fault(device: Device, words: list[str], now: float) -> str:
    # A restart is an event: once, unless it is told how often.
    if words == ['reboot']:
        device.restart(now)
    else:
        device.behave(with_fault(device.behaviour, words[0]), now)
    return ''


def _clear(device: Device, words: list[str], now: float) -> str:
    normal = device.properties.normal
    behaviour = without_fault(device.behaviour, normal, words[0]) if words else normal
    device.behave(behaviour, now)
    return ''


def _reboot(device: Device, words: list[str], now: float) -> str:
    device.restart(now)
    return ''


def _ambient(device: Device, words: list[str], now: float) -> str:
    value = _number(words[0])
    if not -273.15 <= value <= 1000:
        raise _Wrong(f'{words[0]} degC is not possible')
    device.thermal.ambient = value
    return ''


def _temperature(device: Device, words: list[str], now: float) -> str:
    value = _number(words[0])
    if not -273.15 <= value <= 1000:
        raise _Wrong(f'{words[0]} degC is not possible')
    device.heat_to(value, now)
    return ''


def _on(device: Device, words: list[str], now: float) -> str:
    device.press(now, enabled=True)
    return ''


def _off(device: Device, words: list[str], now: float) -> str:
    device.press(now, enabled=False)
    return ''


def _brightness(device: Device, words: list[str], now: float) -> str:
    device.press(now, brightness=_number(words[0]))
    return ''


def _mode(device: Device, words: list[str], now: float) -> str:
    device.press(now, mode=words[0])
    return ''


def _strobe(device: Device, words: list[str], now: float) -> str:
    duty = _number(words[1]) if len(words) > 1 else device.configuration.strobe_duty_cycle
    device.press(now, strobe_period=_number(words[0]), strobe_duty_cycle=duty)
    return ''


def _status(device: Device, words: list[str], now: float) -> str:
    return str(glance(device, now))


def _faults(device: Device, words: list[str], now: float) -> str:
    texts = as_typed(device.behaviour, device.properties.normal)
    return f'{device.source}: {", ".join(texts) or "no fault"}'


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


def execute(line: str, devices: Sequence[Device], now: float) -> str:
    """
    Do what a line says, and return the answer.

    :param line: a command, or the id or name of a light and a command.
    """
    words = line.split()
    if not words:
        return ''
    selected = [one for one in devices if words[0] in (str(one.source), one.properties.name)]
    if words[0] in ('all', '*') or (selected and words[0] not in COMMANDS):
        words = words[1:] or ['status']
    else:
        selected = []
    name, *rest = words
    if name == 'help':
        return f'{describe_commands()}\nfaults:\n{describe_faults()}'
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
        answers = [command.do(device, rest, now) for device in selected or devices]
    except (_Wrong, FaultError, InvalidValue) as error:
        return str(error)
    return '\n'.join(filter(None, answers)) or 'done'
