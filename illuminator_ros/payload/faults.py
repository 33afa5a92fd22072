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

"""
The faults of a simulated component, and the behaviour that each changes.

Each payload has one table: ``--fault``, the YAML file and the console take its names, ``--help``
and doc/simulator.md show its descriptions.
"""

from __future__ import annotations

from collections.abc import Callable
import copy
from dataclasses import dataclass, replace
import math
import random
from typing import TypeVar

from .simulated_settings import integer, number, Values
from ..mavlink import messages
from ..mavlink.dialect import mavlink, short_names


@dataclass(frozen=True)
class Behaviour:
    """
    The behaviour of a simulated component; the defaults follow the protocol.

    :param heartbeat_type: MAV_TYPE.
    :param heartbeat_autopilot: MAV_AUTOPILOT.
    :param heartbeat_base_mode: base_mode.
    :param heartbeat_custom_mode: custom_mode.
    :param heartbeat_state: MAV_STATE.
    :param heartbeat_interval: s, 0 for no heartbeat.
    :param fixed_rate: whether MAV_CMD_SET_MESSAGE_INTERVAL only starts and stops a stream.
    :param endless_stream: whether a stream cannot be stopped.
    :param resumes: whether a stream can be started again.
    :param on_request: whether a streamed message can be requested.
    :param status_on_change: whether each change is followed by the streamed messages.
    :param filters_target: whether messages to other addresses are ignored.
    :param adopts_system_id: whether it takes over the system id of every message that it
        receives, and ignores target_system.
    :param answers_commands: whether it answers COMMAND_LONG and COMMAND_INT.
    :param answers_command_int: whether it answers COMMAND_INT.
    :param answers_broadcast: whether it answers messages to all components.
    :param acks_target: whether COMMAND_ACK has a target.
    :param acks_wrong_target: whether the target of COMMAND_ACK is another component.
    :param apply_after: s from the acknowledgement to the change.
    :param applies_rejected: whether rejected commands are applied.
    :param accepts_unknown: whether unknown commands, and requests for unknown messages, are
        accepted.
    :param ignores_changes: whether accepted changes are not applied.
    :param silence: s for which it neither receives nor sends.
    :param reboot_interval: s, 0 for never.
    :param refuse: result of each change, None to execute it.
    :param rejections: how many changes get MAV_RESULT_TEMPORARILY_REJECTED.
    :param progress: s of MAV_RESULT_IN_PROGRESS before a change is applied.
    :param slow: s from a command to its acknowledgement.
    :param drop: share (0..1) of messages that are not sent.
    :param duplicate: share (0..1) of messages that are sent twice.
    :param delay: maximum delay of a message, s.
    :param corrupt: share (0..1) of messages with a wrong checksum.
    """

    heartbeat_type: int = 0
    heartbeat_autopilot: int = mavlink.MAV_AUTOPILOT_INVALID
    heartbeat_base_mode: int = 0
    heartbeat_custom_mode: int = 0
    heartbeat_state: int = mavlink.MAV_STATE_ACTIVE
    heartbeat_interval: float = 1.0
    fixed_rate: bool = False
    endless_stream: bool = False
    resumes: bool = True
    on_request: bool = True
    status_on_change: bool = True
    filters_target: bool = True
    adopts_system_id: bool = False
    answers_commands: bool = True
    answers_command_int: bool = True
    answers_broadcast: bool = True
    acks_target: bool = True
    acks_wrong_target: bool = False
    apply_after: float = 0.0
    applies_rejected: bool = False
    accepts_unknown: bool = False
    ignores_changes: bool = False
    silence: float = 0.0
    reboot_interval: float = 0.0
    refuse: int | None = None
    rejections: int = 0
    progress: float = 0.0
    slow: float = 0.0
    drop: float = 0.0
    duplicate: float = 0.0
    delay: float = 0.0
    corrupt: float = 0.0


B = TypeVar('B', bound=Behaviour)


class FaultError(ValueError):
    """A fault that does not exist, or a value that it cannot have; the message says which."""


def _result(text: str) -> int:
    by_name = {name: value for value, name in short_names('MAV_RESULT').items()}
    name = text.upper().removeprefix('MAV_RESULT_')
    if name not in by_name:
        raise ValueError(f'{text!r} is not a MAV_RESULT')
    return by_name[name]


@dataclass(frozen=True)
class Fault:
    """
    One fault.

    :param field: the field of the behaviour that it sets.
    :param description: its effect, for people.
    :param metavar: its unit or type, '' if it has no value.
    :param read: makes a value from text; None if it has no value.
    :param default: the value if none is given; for a fault without values, the value it sets.
    """

    field: str
    description: str
    metavar: str = ''
    read: Callable[[str], object] | None = None
    default: object = True

    @property
    def default_text(self) -> str:
        """Return the default value for people, '' if the fault has no value."""
        return (self.text(self.default) or 'for ever') if self.read else ''

    def text(self, value: object) -> str:
        """Return a value as it is typed, '' if there is none to type."""
        if self.read is None or value == math.inf:
            return ''
        if isinstance(value, str):
            return value
        if self.read is _result and isinstance(value, int):
            return short_names('MAV_RESULT')[value].lower()
        return f'{value:.10g}'


class FaultTable(dict[str, Fault]):
    """The faults of one payload, by name."""

    def find(self, name: str) -> Fault:
        """Return a fault; FaultError if there is none of this name."""
        if name not in self:
            raise FaultError(f'no fault {name!r}; there are {", ".join(self)}')
        return self[name]

    def parse(self, text: str) -> Values:
        """
        Return the field of the behaviour that a fault sets, with its value.

        :param text: ``NAME`` or ``NAME=VALUE``.
        :raises FaultError: if there is no such fault, or it cannot have that value.
        """
        name, equals, typed = text.strip().partition('=')
        fault = self.find(name)
        value = fault.default
        if equals:
            if fault.read is None:
                raise FaultError(f'fault {text!r}: {name} takes no value')
            try:
                value = fault.read(typed.strip())
            except ValueError as error:
                raise FaultError(f'fault {text!r}: {error}') from error
        return {fault.field: value}

    def add(self, behaviour: B, text: str) -> B:
        """Return a behaviour with one more fault, see :meth:`parse`."""
        return replace(behaviour, **self.parse(text))

    def remove(self, behaviour: B, normal: B, name: str) -> B:
        """
        Return a behaviour without one fault; FaultError if there is none of this name.

        :param normal: the behaviour without faults.
        """
        field = self.find(name).field
        return replace(behaviour, **{field: getattr(normal, field)})

    def active(self, behaviour: B, normal: B) -> list[str]:
        """Return the names of the faults of a behaviour."""
        # Two faults without values may set one field.
        return [name for name, fault in self.items()
                if (value := getattr(behaviour, fault.field)) != getattr(normal, fault.field)
                and (fault.read or value == fault.default)]

    def as_typed(self, behaviour: B, normal: B) -> list[str]:
        """Return the faults of a behaviour as :meth:`add` takes them, with values."""
        values = [(name, self[name].text(getattr(behaviour, self[name].field)))
                  for name in self.active(behaviour, normal)]
        return [f'{name}={value}' if value else name for name, value in values]

    def describe(self) -> str:
        """Return the table for people, a line for each fault."""
        lines = []
        for name, fault in self.items():
            shown = f'{name}[={fault.metavar}]' if fault.metavar else name
            default = f' (default: {fault.default_text})' if fault.metavar else ''
            lines.append(f'  {shown:20} {fault.description}{default}')
        return '\n'.join(lines)


_seconds, _share, _uint8 = number(0.001, 3600), number(0.001, 1), integer(0, 255)

FAULTS = FaultTable({
    'silence': Fault('silence', 'neither receives nor sends for S seconds', 'S', _seconds,
                     math.inf),
    'reboot': Fault('reboot_interval', 'restarts every S seconds; on the console, '
                    'without S, once', 'S', _seconds, 10.0),
    'refuse': Fault('refuse', 'answers changes with RESULT, such as failed',
                    'RESULT', _result, mavlink.MAV_RESULT_DENIED),
    'progress': Fault('progress', 'reports IN_PROGRESS for S seconds before each change',
                      'S', _seconds, 2.5),
    'busy': Fault('rejections', 'rejects N changes temporarily', 'N', integer(1, 1_000_000), 3),
    'slow': Fault('slow', 'answers S seconds late', 'S', _seconds, 1.5),
    'drop': Fault('drop', 'loses a share of its messages', 'SHARE', _share, 0.3),
    'duplicate': Fault('duplicate', 'sends a share of its messages twice',
                       'SHARE', _share, 0.3),
    'delay': Fault('delay', 'delays and reorders its messages by up to S seconds',
                   'S', _seconds, 2.0),
    'corrupt': Fault('corrupt', 'sends a share of its messages with a wrong checksum',
                     'SHARE', _share, 0.3),
    'lie': Fault('ignores_changes', 'accepts changes and does not apply them'),
    'heartbeat': Fault('heartbeat_interval', 'sends a heartbeat every S seconds',
                       'S', _seconds, 4.0),
    'type': Fault('heartbeat_type', 'sends a heartbeat of MAV_TYPE N',
                  'N', _uint8, mavlink.MAV_TYPE_ONBOARD_CONTROLLER),
    'autopilot': Fault('heartbeat_autopilot', 'sends a heartbeat with MAV_AUTOPILOT N',
                       'N', _uint8, 3),
    'no-int': Fault('answers_command_int', 'does not answer COMMAND_INT', default=False),
    'no-broadcast': Fault('answers_broadcast', 'does not answer messages to all components',
                          default=False),
    'any-target': Fault('filters_target', 'obeys commands to other addresses', default=False),
    'no-stop': Fault('endless_stream', 'does not stop its status stream'),
    'fixed-rate': Fault('fixed_rate', 'ignores the interval that it is given'),
    'disobey': Fault('applies_rejected', 'applies the commands that it rejects'),
    'unknown': Fault('accepts_unknown', 'accepts unknown commands, and requests for unknown '
                     'messages'),
    'no-request': Fault('on_request', 'does not send its status on request', default=False),
    'no-resume': Fault('resumes', 'does not start its status stream again', default=False),
    'misaddress': Fault('acks_wrong_target', 'sends acknowledgements to another component'),
})


class FaultInjector:
    """
    Drops, corrupts, duplicates and delays the messages of one component.

    :param seed: the same seed gives the same faults again.
    """

    def __init__(self, seed: str) -> None:
        self._random = random.Random(seed)

    def inject(
        self, message: messages.Message, behaviour: Behaviour,
    ) -> list[tuple[float, messages.Message]]:
        """Return the messages to send in place of one, each with its delay, s."""
        if not (behaviour.drop or behaviour.corrupt or behaviour.duplicate or behaviour.delay):
            return [(0.0, message)]
        if self._occurs(behaviour.drop):
            return []
        if self._occurs(behaviour.corrupt):
            message = copy.copy(message)
            # A receiver cannot tell which byte of a frame with a wrong checksum was changed.
            setattr(message, 'crc_extra', message.crc_extra ^ 0xFF)  # noqa: B010 - a ClassVar
        count = 2 if self._occurs(behaviour.duplicate) else 1
        return [(self._random.uniform(0.0, behaviour.delay) if behaviour.delay else 0.0, message)
                for _ in range(count)]

    def _occurs(self, share: float) -> bool:
        return share > 0 and self._random.random() < share
