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

"""The configuration agreed with a light: what it has accepted from us, or shows since."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

from . import events
from .model import Configuration, FIELDS, NOTHING, Status, unexpected_differences
from ..mavlink.messages import Address


@dataclass
class _Unapplied:
    """
    A configuration that the light has accepted but does not report.

    :param failure: why it, or values that are required no more, were not set; '' if they were.
    :param shown: the status that it reported instead, None if there was none.
    """

    failure: str = ''
    configuration: Configuration | None = None
    shown: Status | None = None


class AgreedConfiguration:
    """
    Follows the configuration of one light. No I/O.

    :param emit: takes the events.
    :ivar confirmed: the configuration that the light last accepted from us or, if another sender
        has changed it since, last reported; None before either.
    """

    def __init__(self, address: Address, emit: Callable[[events.LightEvent], None]) -> None:
        self.confirmed: Configuration | None = None
        self._address = address
        self._emit = emit
        self._unapplied = _Unapplied()
        # The last configuration that was requested or reported as changed: small steps away
        # from it add up to a change.
        self._reference: Configuration | None = None

    @property
    def discrepancy(self) -> str:
        """Why the light does not have the last configuration that was sent, '' if it has."""
        return self._unapplied.failure

    def failed(self, failure: str) -> None:
        """Note that values that had to be sent were given up."""
        self._unapplied.failure = failure

    def contradicted(
        self, configuration: Configuration, shown: Status | None, failure: str,
    ) -> None:
        """Note that the light has accepted a configuration, and shows another one."""
        self._unapplied = _Unapplied(failure, configuration, shown)

    def accept(self, goal: Configuration, status: Status | None) -> None:
        """
        Note that the light has accepted a configuration, with the status that shows it.

        Values that the light rounds to its own steps are confirmed as it shows them; values that
        differ for another reason (heat, external sync) as they were sent.
        """
        if status:
            reported = status.configuration(goal)
            far = goal.differences(reported)
            goal = replace(goal, **{
                name: getattr(reported, name)
                for name in goal.differences(reported, step=False) if name not in far})
        self._unapplied = _Unapplied()
        self.adopt(goal, events.ChangeCause.REQUEST)

    def adopt(self, configuration: Configuration, cause: events.ChangeCause) -> None:
        """Agree on a configuration, and report what is new in it."""
        old, self.confirmed = self.confirmed, configuration
        if cause is not events.ChangeCause.ROUNDING:
            self._reference = configuration
        names = [name for name in FIELDS
                 if old is None or getattr(old, name) != getattr(configuration, name)]
        if names:
            self._emit(events.ConfigurationChanged(self._address, configuration, names, cause))

    def end_discrepancy(self, reported: Configuration, flags: int) -> None:
        """Forget that a configuration was not applied once the light shows something else."""
        unapplied = self._unapplied
        if unapplied.configuration is None or unapplied.shown is None:
            return

        def differs(before: Configuration) -> bool:
            return bool(unexpected_differences(before, reported, flags, step=True))

        # It was applied late, or another sender has replaced it.
        if (not differs(unapplied.configuration)
                or differs(unapplied.shown.configuration(NOTHING))):
            self._unapplied = _Unapplied()

    def changed_fields(self, reported: Configuration, flags: int) -> list[str]:
        """Return the fields that have changed by more than the light's own rounding."""
        return unexpected_differences(self._reference or reported, reported, flags, step=True)

    def follow(
        self, reported: Configuration, names: list[str], cause: events.ChangeCause,
    ) -> None:
        """Agree on the values of some fields that a light shows for no known reason."""
        self.adopt(replace(self.confirmed or reported,
                           **{name: getattr(reported, name) for name in names}), cause)
