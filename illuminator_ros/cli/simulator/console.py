# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The console of the simulator: commands to simulated components while they run. No I/O."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

from ...simulation.simulated import ConsoleCommand, SimulatedComponent, SimulatedDevice

AnySimulated = SimulatedComponent[SimulatedDevice]


def _fault(component: AnySimulated, words: list[str], now: float) -> None:
    # Without an interval, the fault "reboot" is a single restart.
    if words == ['reboot']:
        component.restart(now)
    else:
        component.behave(component.device.faults.add(component.behaviour, words[0]), now)


def _clear(component: AnySimulated, words: list[str], now: float) -> None:
    device = component.device
    component.behave(
        device.faults.remove(device.behaviour, device.normal, words[0]) if words
        else device.normal, now)


def _faults(component: AnySimulated, words: list[str], now: float) -> str:
    device = component.device
    texts = device.faults.as_typed(device.behaviour, device.normal)
    return f'{component.address}: {", ".join(texts) or "no fault"}'


# The commands of every component.
COMMANDS: Sequence[ConsoleCommand[AnySimulated, str | None]] = (
    ConsoleCommand('reboot', 'restart, as after a power cycle',
                   lambda component, words, now: component.restart(now)),
    ConsoleCommand('fault NAME[=VALUE]', 'start a fault', _fault),
    ConsoleCommand('clear [NAME]', 'end one fault, or all', _clear),
    ConsoleCommand('faults', 'show the present faults', _faults),
    ConsoleCommand('status', 'show the state of each component',
                   lambda component, words, now: component.snapshot(now).text),
)
OTHERS = (('help', 'show this'), ('quit', 'end'))


def describe_commands(devices: Iterable[type[SimulatedDevice]]) -> str:
    """Return the commands of the console for some devices, a line each."""
    own = [command for device in devices for command in device.commands]
    rows = dict([*((one.usage, one.help) for one in [*own, *COMMANDS]), *OTHERS])
    return '\n'.join(f'  {usage:20} {text}' for usage, text in rows.items())


def _commands(component: AnySimulated) -> dict[str, ConsoleCommand[Any, Any]]:
    return {one.name: one for one in (*component.device.commands, *COMMANDS)}


def _execute(
    component: AnySimulated, command: ConsoleCommand[Any, Any], words: list[str], now: float,
) -> str | None:
    """Execute a command of a component, and return the answer."""
    if command in COMMANDS:
        answer: str | None = command.do(component, words, now)
        return answer
    component.apply(command.do(component.device, words, now), now)
    return None


def execute(line: str, components: Sequence[AnySimulated], now: float) -> str:
    """
    Execute a line, and return the answer.

    :param line: a command, or the id or name of a component and a command.
    """
    words = line.split()
    if not words:
        return ''
    known = {name for one in components for name in _commands(one)}
    selected = [one for one in components if words[0] in (str(one.address), one.name)]
    if selected and words[0] not in known:
        words = words[1:] or ['status']
    else:
        selected = list(components)
    name, *rest = words
    if name == 'help':
        devices = dict.fromkeys(type(one.device) for one in components)
        faults = '\n'.join(device.faults.describe() for device in devices)
        return f'{describe_commands(devices)}\nfaults:\n{faults}'
    targets = [(one, command) for one in selected if (command := _commands(one).get(name))]
    if not targets:
        return f'no command or component {name!r}; help lists the commands'
    _, command = targets[0]
    if not command.accepts(len(rest)):
        return f'usage: {command.usage}'
    try:
        answers = [_execute(*one, rest, now) for one in targets]
    except ValueError as error:
        return str(error)
    return '\n'.join(filter(None, answers)) or 'done'
