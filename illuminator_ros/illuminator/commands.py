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

"""The changes of a light: MAV_CMD_ILLUMINATOR_ON_OFF and MAV_CMD_DO_ILLUMINATOR_CONFIGURE."""

from __future__ import annotations

from typing import NamedTuple

from .model import Configuration, DIMMING_FLAGS, flag_names, Status, unexpected_differences
from ..mavlink.dialect import mavlink

CONFIRMED = 'confirmed by ILLUMINATOR_STATUS'


def _despite_heat(status: Status) -> str:
    dimming = status.error_flags & DIMMING_FLAGS
    return f'{CONFIRMED}, but {" and ".join(flag_names(dimming))}' if dimming else CONFIRMED


def _with_flags(shown: str, status: Status) -> str:
    return ', '.join(filter(None, (shown, *flag_names(status.error_flags))))


class OnOff(NamedTuple):
    """Switches all lights of a component on or off; the command cannot select one of them."""

    on: bool
    note: str = ''
    position: None = None
    command: int = mavlink.MAV_CMD_ILLUMINATOR_ON_OFF
    is_idempotent: bool = True

    @property
    def is_repeated(self) -> bool:
        """See :class:`~..payload.confirmed_command.Change`."""
        return not self.on

    @property
    def params(self) -> tuple[float, ...]:
        """See :class:`~..payload.confirmed_command.Change`."""
        return (float(self.on),)

    @property
    def goal(self) -> str:
        """See :class:`~..payload.confirmed_command.Change`."""
        return 'on' if self.on else 'off'

    def shown_by(self, status: Status) -> bool | None:
        """See :class:`~..payload.confirmed_command.Change`."""
        if not self.on and status.is_off_by_heat:
            return None
        return status.enabled is self.on

    def evidence(self, status: Status) -> str:
        """See :class:`~..payload.confirmed_command.Change`."""
        if self.on:
            return _despite_heat(status)
        if status.is_off_by_heat:
            return f'accepted (ILLUMINATOR_STATUS shows {self.actual(status)})'
        return CONFIRMED

    def actual(self, status: Status) -> str:
        """See :class:`~..payload.confirmed_command.Change`."""
        shown = {True: 'on', False: 'off', None: 'neither on nor off'}[status.enabled]
        return _with_flags(shown, status)


# Made once, since each request needs one before its command is sent.
SWITCHES = {on: OnOff(on) for on in (False, True)}


class Configure(NamedTuple):
    """
    Configures a light; the command carries all four fields.

    :param names: the fields that must change.
    """

    configuration: Configuration
    names: list[str]
    note: str = ''
    position: None = None
    command: int = mavlink.MAV_CMD_DO_ILLUMINATOR_CONFIGURE
    is_idempotent: bool = True
    is_repeated: bool = False

    @property
    def params(self) -> tuple[float, ...]:
        """See :class:`~..payload.confirmed_command.Change`."""
        return self.configuration.params()

    @property
    def goal(self) -> str:
        """See :class:`~..payload.confirmed_command.Change`."""
        return self.configuration.describe(self.names)

    def _missing(self, status: Status) -> list[str]:
        return unexpected_differences(
            self.configuration, status.configuration(self.configuration), status.error_flags,
            step=True)

    def _hidden(self, status: Status) -> list[str]:
        """Return those of the fields that must change whose value a status does not show."""
        different = self.configuration.differences(status.configuration(self.configuration))
        return [name for name in self.names
                if name in different or getattr(status, name) is None]

    def shown_by(self, status: Status) -> bool | None:
        """See :class:`~..payload.confirmed_command.Change`."""
        if self._missing(status):
            return False
        return None if self._hidden(status) else True

    def evidence(self, status: Status) -> str:
        """See :class:`~..payload.confirmed_command.Change`."""
        hidden = self._hidden(status)
        if not hidden:
            return CONFIRMED
        if status.error_flags & DIMMING_FLAGS:
            return _despite_heat(status)
        reported = status.configuration(self.configuration)
        shown = (f'no valid {name}' if getattr(status, name) is None
                 else reported.describe([name]) for name in hidden)
        return f'accepted (ILLUMINATOR_STATUS shows {", ".join(shown)})'

    def actual(self, status: Status) -> str:
        """See :class:`~..payload.confirmed_command.Change`."""
        reported = status.configuration(self.configuration)
        return _with_flags(reported.describe(self._missing(status)), status)
