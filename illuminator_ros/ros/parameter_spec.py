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

"""What a parameter of the node is: its type, range and description, and checking a value."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor
from rclpy.parameter import Parameter

_TYPE_NAMES = {float: 'number', int: 'integer', str: 'string', bool: 'boolean',
               list: "list of strings, as in -p names:=\"['1/244=belly']\""}


class ParameterError(ValueError):
    """A parameter that the node cannot start with; the message names it and says why."""


@dataclass(frozen=True)
class ParameterSpec:
    """
    One parameter.

    :param default: its type is that of the parameter; for one of the light only the type counts.
    :param unit: of the value and of its range, '' for none.
    :param low: and ``high``, the range of a number, both ends included.
    :param choices: the values of a string, where they are few.
    :param constraints: what else the value has to be, for people.
    """

    name: str
    default: Any
    description: str
    unit: str = ''
    low: float | None = None
    high: float | None = None
    choices: tuple[str, ...] = ()
    constraints: str = ''

    @property
    def shown_default(self) -> str:
        """Return the default as it is written in YAML, '' for none."""
        if self.default in ('', ['']):
            return ''
        return str(self.default).lower() if isinstance(self.default, bool) else str(self.default)

    @property
    def shown_range(self) -> str:
        """Return the range for people, ``1 to 255``, or the choices; '' if there is none."""
        if self.low is None or self.high is None:
            return ', '.join(self.choices)
        return f'{self.low:g} to {self.high:g}'

    def descriptor(self, *, read_only: bool, high: float | None = None) -> ParameterDescriptor:
        """
        Return the descriptor that tools show.

        :param high: the upper end of the range where it is another than that of the table.
        """
        unit = f' [{self.unit}]' if self.unit else ''
        constraints = self.constraints
        if self.choices:
            constraints = f'one of: {", ".join(self.choices)}'
        descriptor = ParameterDescriptor(
            description=self.description + unit, additional_constraints=constraints,
            read_only=read_only, type=Parameter.Type.from_parameter_value(self.default).value)
        if self.low is not None and self.high is not None:
            top = self.high if high is None else high
            if isinstance(self.default, float):
                descriptor.floating_point_range = [
                    FloatingPointRange(from_value=float(self.low), to_value=float(top))]
            else:
                descriptor.integer_range = [
                    IntegerRange(from_value=int(self.low), to_value=int(top))]
        return descriptor

    def check(self, value: Any) -> Any:
        """
        Return a value of this parameter's type; an integer is taken for a double.

        :raises ParameterError: if it is of another type or out of range.
        """
        wanted = type(self.default)
        if wanted is float and type(value) is int:
            value = float(value)
        if wanted is list and isinstance(value, list | tuple):
            value = list(value)
        if value is False and 'off' in self.choices:
            # For YAML, on the command line too, a bare off is a boolean.
            value = 'off'
        if type(value) is not wanted:
            raise ParameterError(f'{self.name}: {value!r} is no {_TYPE_NAMES[wanted]}')
        if self.choices and value not in self.choices:
            raise ParameterError(f'{self.name}: {value!r} is none of {", ".join(self.choices)}')
        if self.low is not None and self.high is not None and not self.low <= value <= self.high:
            unit = f' {self.unit}' if self.unit else ''
            raise ParameterError(
                f'{self.name}: {value}{unit} is out of range: {self.low:g} to '
                f'{self.high:g}{unit}')
        return value
