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
What can go wrong with a simulated light.

One table: its names are what ``--fault``, the YAML file and the console take, its texts what
``--help`` and doc/simulator.md say.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
import math
from typing import Any

from .behaviour import Behaviour
from .error_flags import ErrorFlag
from ..mavlink.messages import MavResult, MavType


class FaultError(ValueError):
    """A fault that does not exist, or a value that it cannot have; the message says which."""


def _seconds(text: str) -> float:
    value = float(text)
    if not 0 < value <= 3600:
        raise ValueError('not within 0 to 3600 s')
    return value


def _share(text: str) -> float:
    value = float(text)
    if not 0 < value <= 1:
        raise ValueError('not within 0 to 1')
    return value


def _count(text: str) -> int:
    value = int(text)
    if not 1 <= value <= 1_000_000:
        raise ValueError('not a number of at least 1')
    return value


def _type(text: str) -> int:
    value = int(text)
    if not 0 <= value <= 255:
        raise ValueError('not within 0 to 255')
    return value


def _flags(text: str) -> int:
    value = int(text, 0)
    if not 0 < value < 1 << 32:
        raise ValueError('no error flags')
    return value


def _result(text: str) -> MavResult:
    name = text.upper().removeprefix('MAV_RESULT_')
    if name not in MavResult.__members__:
        raise ValueError('no MAV_RESULT')
    return MavResult[name]


@dataclass(frozen=True)
class Fault:
    """
    One thing that can go wrong.

    :param field: the field of :class:`Behaviour` that it sets, '' if it happens at once.
    :param description: what it does, for people.
    :param metavar: what the value is, '' if it has none.
    :param read: makes a value from text.
    :param default: the value where none is given; for one without values, what it sets.
    """

    field: str
    description: str
    metavar: str = ''
    read: Callable[[str], Any] | None = None
    default: Any = True

    @property
    def default_text(self) -> str:
        """Return the value where none is given, for people; '' where there is none."""
        if self.read is None:
            return ''
        if isinstance(self.default, MavResult):
            return self.default.name.lower()
        return 'for ever' if self.default == math.inf else f'{self.default:g}'

    def value_text(self, value: Any) -> str:
        """Return a value as it is typed; '' where none is."""
        if self.read is None or value == math.inf:
            return ''
        return value.name.lower() if isinstance(value, MavResult) else f'{value}'


FAULTS = {
    'silence': Fault('silence', 'neither hears nor says anything for S seconds',
                     'S', _seconds, math.inf),
    'reboot': Fault('reboot_interval', 'restarts every S seconds; on the console, '
                    'without S, once', 'S', _seconds, 10.0),
    'thermistor': Fault('thermistor_failed', 'its temperature sensor fails: THERMISTOR_FAILURE, '
                        'and temp_c stays at 0'),
    'refuse': Fault('refuse', 'answers changes with RESULT, such as failed',
                    'RESULT', _result, MavResult.DENIED),
    'progress': Fault('progress', 'reports changes to be in progress for S seconds, then makes '
                      'them', 'S', _seconds, 2.5),
    'busy': Fault('rejections', 'rejects N changes temporarily', 'N', _count, 3),
    'slow': Fault('slow', 'answers S seconds late', 'S', _seconds, 1.5),
    'drop': Fault('drop', 'a share of its messages is lost', 'SHARE', _share, 0.3),
    'duplicate': Fault('duplicate', 'a share of its messages comes twice',
                       'SHARE', _share, 0.3),
    'delay': Fault('delay', 'its messages are up to S seconds late, and overtake each other',
                   'S', _seconds, 2.0),
    'corrupt': Fault('corrupt', 'a share of its messages has a wrong checksum',
                     'SHARE', _share, 0.3),
    'lie': Fault('lies', 'accepts changes, and does not make them'),
    'heartbeat': Fault('heartbeat_interval', 'has a heartbeat every S seconds',
                       'S', _seconds, 4.0),
    'type': Fault('heartbeat_type', 'has a heartbeat of MAV_TYPE N',
                  'N', _type, int(MavType.ONBOARD_CONTROLLER)),
    'autopilot': Fault('heartbeat_autopilot', 'has a heartbeat with MAV_AUTOPILOT N',
                       'N', _type, 3),
    'no-clock': Fault('has_clock', 'has an uptime of 0', default=False),
    'no-int': Fault('takes_int', 'does not answer COMMAND_INT', default=False),
    'no-broadcast': Fault('takes_broadcast', 'does not answer what is for all components',
                          default=False),
    'any-target': Fault('filters_target', 'does what is addressed to others', default=False),
    'no-stop': Fault('endless_stream', 'does not stop its status stream'),
    'fixed-rate': Fault('fixed_rate', 'ignores the interval asked for'),
    'no-identity': Fault('identifies', 'sends no COMPONENT_INFORMATION_BASIC', default=False),
    'no-terminator': Fault('padding', 'fills its strings with blanks, to the last byte',
                           default=' '),
    'nan': Fault('lets_nan_in', 'accepts NaN'),
    'anything': Fault('lets_all_in', 'accepts values out of range'),
    'disobey': Fault('obeys_refused', 'refuses what is out of range, and does it'),
    'toggle': Fault('toggles', 'is switched off by switching it on again'),
    'unknown': Fault('accepts_unknown', 'accepts unknown commands, and requests for unknown '
                     'messages'),
    'no-request': Fault('on_request', 'does not send its status on request', default=False),
    'no-resume': Fault('resumes', 'does not start its status stream again', default=False),
    'misaddress': Fault('misaddresses', 'acknowledges to somebody else'),
    'flags': Fault('false_flags', 'reports error flags for no reason',
                   'FLAGS', _flags, int(ErrorFlag.OVER_TEMPERATURE_SHUTDOWN)),
    'cold-throttling': Fault('inverted_flags', 'reports THERMAL_THROTTLING while it is on and '
                             'cool, not while it is hot'),
}


def with_fault(behaviour: Behaviour, text: str) -> Behaviour:
    """
    Return a behaviour with one thing going wrong.

    :param text: ``NAME`` or ``NAME=VALUE``.
    :raises FaultError: if there is no such fault, or it cannot have that value.
    """
    name, equals, value = text.strip().partition('=')
    fault = find(name)
    if not equals:
        return replace(behaviour, **{fault.field: fault.default})
    if fault.read is None:
        raise FaultError(f'fault {text!r}: {name} takes no value')
    try:
        return replace(behaviour, **{fault.field: fault.read(value.strip())})
    except ValueError as error:
        reason = str(error)
        raise FaultError(f'fault {text!r}: {value!r} is no {fault.metavar}: {reason}') from error


def without_fault(behaviour: Behaviour, normal: Behaviour, name: str) -> Behaviour:
    """
    Return a behaviour in which one thing is as it normally is.

    :raises FaultError: if there is no such fault.
    """
    field = find(name).field
    return replace(behaviour, **{field: getattr(normal, field)})


def active(behaviour: Behaviour, normal: Behaviour) -> list[str]:
    """Return the names of what goes wrong, beside what is normal for a light."""
    return [name for name, fault in FAULTS.items()
            if getattr(behaviour, fault.field) != getattr(normal, fault.field)]


def as_typed(behaviour: Behaviour, normal: Behaviour) -> list[str]:
    """Return what goes wrong as :func:`with_fault` takes it, with values."""
    values = [(name, FAULTS[name].value_text(getattr(behaviour, FAULTS[name].field)))
              for name in active(behaviour, normal)]
    return [f'{name}={value}' if value else name for name, value in values]


def find(name: str) -> Fault:
    """
    Return a fault.

    :raises FaultError: if there is none of this name.
    """
    if name not in FAULTS:
        raise FaultError(f'no fault {name!r}; there are {", ".join(FAULTS)}')
    return FAULTS[name]


def describe() -> str:
    """Return the table for people, a line each."""
    lines = []
    for name, fault in FAULTS.items():
        shown = f'{name}[={fault.metavar}]' if fault.metavar else name
        default = f' (default: {fault.default_text})' if fault.metavar else ''
        lines.append(f'  {shown:20} {fault.description}{default}')
    return '\n'.join(lines)
