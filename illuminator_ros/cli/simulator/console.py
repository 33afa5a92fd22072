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

from collections.abc import Callable, Iterable, Sequence
from functools import partial
from typing import Any

from .view import ComponentSnapshot
from ...payload.simulated import ConsoleCommand, Effect, SimulatedComponent, SimulatedDevice

Component = SimulatedComponent[SimulatedDevice]
# Executes a command with its arguments at a time, and returns the answer.
Execute = Callable[[list[str], float], str | None]


def _fault(component: Component, words: list[str], now: float) -> None:
    # Without an interval, the fault "reboot" is a single restart.
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
COMMANDS: Sequence[ConsoleCommand[Component, str | None]] = (
    ConsoleCommand('reboot', 'restart, as after a power cycle',
                   lambda component, words, now: component.restart(now)),
    ConsoleCommand('fault NAME[=VALUE]', 'start a fault', _fault, (1,)),
    ConsoleCommand('clear [NAME]', 'end one fault, or all', _clear, (0, 1)),
    ConsoleCommand('faults', 'show the present faults', _faults),
    ConsoleCommand('status', 'show the state of each component',
                   lambda component, words, now: str(ComponentSnapshot.of(component, now))),
)
OTHERS = (('help', 'show this'), ('quit', 'end'))


def describe_commands(devices: Iterable[type[SimulatedDevice]]) -> str:
    """Return the commands of the console for some devices, a line each."""
    own = [command for device in devices for command in device.commands]
    rows = dict([*((one.usage, one.help) for one in [*own, *COMMANDS]), *OTHERS])
    return '\n'.join(f'  {usage:20} {text}' for usage, text in rows.items())


def _bound(component: Component) -> dict[str, tuple[ConsoleCommand[Any, Any], Execute]]:
    """Return the commands of a component by name, each with the function that executes it."""
    def apply(command: ConsoleCommand[object, Effect], words: list[str], now: float) -> None:
        component.apply(command.do(component.device, words, now), now)

    return {
        **{one.name: (one, partial(apply, one)) for one in component.device.commands},
        **{one.name: (one, partial(one.do, component)) for one in COMMANDS}}


def execute(line: str, components: Sequence[Component], now: float) -> str:
    """
    Execute a line, and return the answer.

    :param line: a command, or the id or name of a component and a command.
    """
    words = line.split()
    if not words:
        return ''
    devices = dict.fromkeys(type(one.device) for one in components)
    bound = [_bound(one) for one in components]
    known = {name for commands in bound for name in commands}
    selected = [commands for one, commands in zip(components, bound, strict=True)
                if words[0] in (str(one.address), one.name)]
    if words[0] in ('all', '*') or (selected and words[0] not in known):
        words = words[1:] or ['status']
    else:
        selected = []
    name, *rest = words
    if name == 'help':
        faults = '\n'.join(device.faults.describe() for device in devices)
        return f'{describe_commands(devices)}\nfaults:\n{faults}'
    # The option --fault has another syntax for a component than the console.
    component, colon, fault = words[-1].rpartition(':')
    if colon and words[:-1] in ([], ['fault'], ['--fault']):
        return f'for one component: {component} fault {fault}'
    # A fault in the syntax of --help is a command, too.
    if name not in known and any(name.partition('=')[0] in one.faults for one in devices):
        name, rest = 'fault', [name, *rest]
    targets = [commands[name] for commands in selected or bound if name in commands]
    if not targets:
        return f'no command or component {name!r}; help lists the commands'
    if len(rest) not in targets[0][0].counts:
        return f'usage: {targets[0][0].usage}'
    try:
        answers = [do(rest, now) for _, do in targets]
    except ValueError as error:
        return str(error)
    return '\n'.join(filter(None, answers)) or 'done'
