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

"""The console of the simulator: commands to simulated components while they run. No I/O."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from .view import look
from ...payload.simulated import ConsoleCommand, SimulatedComponent

Component = SimulatedComponent[Any]


def _fault(component: Component, words: list[str], now: float) -> None:
    # Without an interval, a restart is an event.
    if words == ['reboot']:
        component.restart(now)
    else:
        component.behave(component.device.faults.add(component.behaviour, words[0]), now)


def _clear(component: Component, words: list[str], now: float) -> None:
    device = component.device
    component.behave(
        device.faults.remove(device.behaviour, device.normal, words[0]) if words
        else device.normal, now)


def _faults(component: Component, words: list[str], now: float) -> str:
    device = component.device
    texts = device.faults.as_typed(device.behaviour, device.normal)
    return f'{component.address}: {", ".join(texts) or "no fault"}'


# The commands of every component.
COMMANDS: Mapping[str, ConsoleCommand[Component, str | None]] = {
    'reboot': ConsoleCommand('reboot', 'restart, as after a power cycle',
                       lambda component, words, now: component.restart(now)),
    'fault': ConsoleCommand('fault NAME[=VALUE]', 'start a fault', _fault, (1,)),
    'clear': ConsoleCommand('clear [NAME]', 'end one fault, or all', _clear, (0, 1)),
    'faults': ConsoleCommand('faults', 'show the present faults', _faults),
    'status': ConsoleCommand('status', 'show the state of each component',
                       lambda component, words, now: str(look(component, now))),
}
OTHERS = {'help': 'show this', 'quit': 'end'}


def describe_commands(tables: Iterable[Mapping[str, ConsoleCommand[Any, Any]]]) -> str:
    """Return the commands of the console, a line each; those of every component come last."""
    common, *own = tables
    rows = {one.usage: one.help for table in (*own, common) for one in table.values()}
    return '\n'.join(f'  {usage:20} {text}' for usage, text in {**rows, **OTHERS}.items())


def execute(line: str, components: Sequence[Component], now: float) -> str:
    """
    Execute a line, and return the answer.

    :param line: a command, or the id or name of a component and a command.
    """
    words = line.split()
    if not words:
        return ''
    devices = {type(one.device): one.device for one in components}.values()
    own = {name: command for device in devices for name, command in device.commands.items()}
    selected = [one for one in components if words[0] in (str(one.address), one.name)]
    if words[0] in ('all', '*') or (selected and words[0] not in {**own, **COMMANDS}):
        words = words[1:] or ['status']
    else:
        selected = []
    name, *rest = words
    if name == 'help':
        commands = describe_commands([COMMANDS, *(device.commands for device in devices)])
        faults = '\n'.join(device.faults.describe() for device in devices)
        return f'{commands}\nfaults:\n{faults}'
    # The option --fault names a component in another way than the console.
    component, colon, fault = words[-1].rpartition(':')
    if colon and words[:-1] in ([], ['fault'], ['--fault']):
        return f'for one component: {component} fault {fault}'
    # A fault works as --help shows it, too.
    if name not in own and any(name.partition('=')[0] in device.faults for device in devices
                               ) and name not in COMMANDS:
        name, rest = 'fault', [name, *rest]
    command = COMMANDS.get(name) or own.get(name)
    targets = [one for one in selected or components
               if name in COMMANDS or name in one.device.commands]
    if command is None or not targets:
        return f'no command or component {name!r}; help lists the commands'
    if len(rest) not in command.counts:
        return f'usage: {command.usage}'
    try:
        answers = [_execute(name, one, rest, now) for one in targets]
    except ValueError as error:
        return str(error)
    return '\n'.join(filter(None, answers)) or 'done'


def _execute(name: str, component: Component, words: list[str], now: float) -> str | None:
    if name in COMMANDS:
        return COMMANDS[name].do(component, words, now)
    component.apply(component.device.commands[name].do(component.device, words, now), now)
    return None
