# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""
The faults of a simulated component, and the behaviour that each changes.

A field of the behaviour declares its fault. ``--fault``, the YAML file and the console take their
names, ``--help`` and doc/simulator.md show their descriptions.
"""

from __future__ import annotations

from collections.abc import Callable
import copy
from dataclasses import dataclass, field, fields, replace
import math
import random
from typing import Any, NamedTuple, TypeVar

from .settings import integer, number, SettingValues
from ..mavlink import messages
from ..mavlink.dialect import mavlink, short_names
from ..mavlink.errors import InvalidValue

T = TypeVar('T')


def _result(text: str) -> int:
    by_name = {name: value for value, name in short_names('MAV_RESULT').items()}
    name = text.upper().removeprefix('MAV_RESULT_')
    if name not in by_name:
        raise ValueError(f'{text!r} is not a MAV_RESULT')
    return by_name[name]


class FaultValue(NamedTuple):
    """
    The values that a fault can have.

    :param metavar: their unit or type.
    :param read: makes a value from text; raises ValueError, whose message gives the reason.
    :param text: makes the text from a value.
    """

    metavar: str
    read: Callable[[str], object]
    text: Callable[[Any], str] = '{:.10g}'.format


SECONDS = FaultValue('S', number(0.001, 3600))
SHARE = FaultValue('SHARE', number(0.001, 1))
UINT8 = FaultValue('N', integer(0, 255))
FLAGS = FaultValue('FLAGS', integer(1, 0xFFFFFFFF))
COUNT = FaultValue('N', integer(1, 1_000_000))
RESULT = FaultValue('RESULT', _result, lambda result: short_names('MAV_RESULT')[result].lower())


@dataclass(frozen=True)
class Fault:
    """
    One fault.

    :param name: as it is typed.
    :param description: its effect, for people.
    :param default: the value if none is given; for a fault without values, the value it sets.
    :param value: the values that it can have, None for none.
    :param field: the field of the behaviour that it sets.
    """

    name: str
    description: str
    default: object
    value: FaultValue | None = None
    field: str = ''

    @property
    def usage(self) -> str:
        """Return how it is typed."""
        return f'{self.name}={self.value.metavar}' if self.value else self.name

    def text(self, value: object) -> str:
        """Return a value as it is typed, '' if there is none to type."""
        return '' if self.value is None or value == math.inf else self.value.text(value)


def fault(
    normal: T, name: str, description: str, default: object = None,
    value: FaultValue | None = None,
) -> T:
    """
    Return a field of a behaviour, and the fault that sets it; see :class:`Fault`.

    :param normal: its value without the fault.
    :param default: None for the contrary of the normal value.
    """
    return field(default=normal, metadata={'fault': Fault(
        name, description, not normal if default is None else default, value)})


@dataclass(frozen=True)
class Behaviour:
    """
    The behaviour of a simulated component; the defaults follow the protocol.

    :param heartbeat_base_mode: base_mode.
    :param heartbeat_custom_mode: custom_mode.
    :param heartbeat_state: MAV_STATE.
    :param status_on_change: whether each change is followed by the streamed messages.
    :param adopts_system_id: whether it takes over the system id of every message that it
        receives, and ignores target_system.
    :param answers_commands: whether it answers COMMAND_LONG and COMMAND_INT.
    :param acks_target: whether COMMAND_ACK has a target.
    :param apply_after: s from the acknowledgement to the change.
    :param silence: s for which it neither receives nor sends.
    :param reboot_interval: s, 0 for never.
    :param refuse: result of each change, None to execute it.
    :param progress: s of MAV_RESULT_IN_PROGRESS before a change is applied.
    :param rejections: how many changes get MAV_RESULT_TEMPORARILY_REJECTED.
    :param slow: s from a command to its acknowledgement.
    :param drop: share (0..1) of messages that are not sent.
    :param duplicate: share (0..1) of messages that are sent twice.
    :param delay: maximum delay of a message, s.
    :param corrupt: share (0..1) of messages with a wrong checksum.
    :param ignores_changes: whether accepted changes are not applied.
    :param heartbeat_interval: s, 0 for no heartbeat.
    :param heartbeat_type: MAV_TYPE.
    :param heartbeat_autopilot: MAV_AUTOPILOT.
    :param answers_command_int: whether it answers COMMAND_INT.
    :param answers_broadcast: whether it answers messages to all components.
    :param filters_target: whether messages to other addresses are ignored.
    :param endless_stream: whether a stream cannot be stopped.
    :param fixed_rate: whether MAV_CMD_SET_MESSAGE_INTERVAL only starts and stops a stream.
    :param applies_rejected: whether rejected commands are applied.
    :param accepts_unknown: whether unknown commands, and requests for unknown messages, are
        accepted.
    :param on_request: whether a streamed message can be requested.
    :param resumes: whether a stream can be started again.
    :param acks_wrong_target: whether the target of COMMAND_ACK is another component.
    """

    heartbeat_base_mode: int = 0
    heartbeat_custom_mode: int = 0
    heartbeat_state: int = mavlink.MAV_STATE_ACTIVE
    status_on_change: bool = True
    adopts_system_id: bool = False
    answers_commands: bool = True
    acks_target: bool = True
    apply_after: float = 0.0
    silence: float = fault(
        0.0, 'silence', 'neither receives nor sends for S seconds', math.inf, SECONDS)
    reboot_interval: float = fault(
        0.0, 'reboot', 'restarts every S seconds; on the console, without S, once', 10.0, SECONDS)
    refuse: int | None = fault(
        None, 'refuse', 'answers changes with RESULT, such as failed', mavlink.MAV_RESULT_DENIED,
        RESULT)
    progress: float = fault(
        0.0, 'progress', 'reports IN_PROGRESS for S seconds before each change', 2.5, SECONDS)
    rejections: int = fault(0, 'busy', 'rejects N changes temporarily', 3, COUNT)
    slow: float = fault(0.0, 'slow', 'answers S seconds late', 1.5, SECONDS)
    drop: float = fault(0.0, 'drop', 'loses a share of its messages', 0.3, SHARE)
    duplicate: float = fault(0.0, 'duplicate', 'sends a share of its messages twice', 0.3, SHARE)
    delay: float = fault(
        0.0, 'delay', 'delays and reorders its messages by up to S seconds', 2.0, SECONDS)
    corrupt: float = fault(
        0.0, 'corrupt', 'sends a share of its messages with a wrong checksum', 0.3, SHARE)
    ignores_changes: bool = fault(False, 'lie', 'accepts changes and does not apply them')
    heartbeat_interval: float = fault(
        1.0, 'heartbeat', 'sends a heartbeat every S seconds', 4.0, SECONDS)
    heartbeat_type: int = fault(
        0, 'type', 'sends a heartbeat of MAV_TYPE N', mavlink.MAV_TYPE_ONBOARD_CONTROLLER, UINT8)
    heartbeat_autopilot: int = fault(
        mavlink.MAV_AUTOPILOT_INVALID, 'autopilot', 'sends a heartbeat with MAV_AUTOPILOT N', 3,
        UINT8)
    answers_command_int: bool = fault(True, 'no-int', 'does not answer COMMAND_INT')
    answers_broadcast: bool = fault(
        True, 'no-broadcast', 'does not answer messages to all components')
    filters_target: bool = fault(True, 'any-target', 'obeys commands to other addresses')
    endless_stream: bool = fault(False, 'no-stop', 'does not stop its status stream')
    fixed_rate: bool = fault(False, 'fixed-rate', 'ignores the interval that it is given')
    applies_rejected: bool = fault(False, 'disobey', 'applies the commands that it rejects')
    accepts_unknown: bool = fault(
        False, 'unknown', 'accepts unknown commands, and requests for unknown messages')
    on_request: bool = fault(True, 'no-request', 'does not send its status on request')
    resumes: bool = fault(True, 'no-resume', 'does not start its status stream again')
    acks_wrong_target: bool = fault(
        False, 'misaddress', 'sends acknowledgements to another component')


B = TypeVar('B', bound=Behaviour)


class FaultError(InvalidValue):
    """A fault that does not exist, or a value that it cannot have; the message says which."""


class FaultTable(dict[str, Fault]):
    """The faults of one payload, by name."""

    @classmethod
    def of(cls, behaviour: type[Behaviour], *lacks: str) -> FaultTable:
        """
        Return the faults that the fields of a behaviour declare.

        A field that a class declares again, with another default, keeps its fault.

        :param lacks: the names of faults that the payload does not have.
        """
        classes = [one for one in reversed(behaviour.__mro__) if issubclass(one, Behaviour)]
        return cls({fault.name: replace(fault, field=one.name) for base in classes
                    for one in fields(base) if (fault := one.metadata.get('fault'))
                    and fault.name not in lacks})

    def find(self, name: str) -> Fault:
        """Return a fault; FaultError if there is none of this name."""
        if name not in self:
            raise FaultError(f'no fault {name!r}; there are {", ".join(self)}')
        return self[name]

    def parse(self, text: str) -> SettingValues:
        """
        Return the field of the behaviour that a fault sets, with its value.

        :param text: ``NAME`` or ``NAME=VALUE``.
        :raises FaultError: if there is no such fault, or it cannot have that value.
        """
        name, equals, typed = text.strip().partition('=')
        fault = self.find(name)
        if not equals:
            return {fault.field: fault.default}
        if fault.value is None:
            raise FaultError(f'fault {text!r}: {name} takes no value')
        try:
            return {fault.field: fault.value.read(typed.strip())}
        except ValueError as error:
            raise FaultError(f'fault {text!r}: {error}') from error

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
        return [name for name, fault in self.items()
                if getattr(behaviour, fault.field) != getattr(normal, fault.field)]

    def as_typed(self, behaviour: B, normal: B) -> list[str]:
        """Return the faults of a behaviour as :meth:`add` takes them, with values."""
        values = [(name, self[name].text(getattr(behaviour, self[name].field)))
                  for name in self.active(behaviour, normal)]
        return [f'{name}={value}' if value else name for name, value in values]

    def describe(self) -> str:
        """Return the table for people, a line for each fault."""
        lines = []
        for name, fault in self.items():
            shown = f'{name}[={fault.value.metavar}]' if fault.value else name
            default = (f' (default: {fault.text(fault.default) or "for ever"})' if fault.value
                       else '')
            lines.append(f'  {shown:20} {fault.description}{default}')
        return '\n'.join(lines)


FAULTS = FaultTable.of(Behaviour)


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
