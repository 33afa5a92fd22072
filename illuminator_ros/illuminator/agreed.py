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

"""The configuration that is agreed with a light, and who changed it last."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, TYPE_CHECKING

from .comparison import unexplained
from .events import Cause, ConfigurationChanged
from .model import checked, Configuration, FIELDS, InvalidValue, Status

if TYPE_CHECKING:
    from .light import Light


class Agreed:
    """
    What a light is configured to be.

    :ivar agreed: the configuration that was last accepted from us or, where somebody else has
        changed it since, reported; None before the first status.
    :ivar discrepancy: in what the light differs from what it has accepted, '' if in nothing.
    """

    def __init__(self, light: Light) -> None:
        self._light = light
        self.agreed: Configuration | None = None
        self.discrepancy = ''
        # What the light has accepted and then not shown.
        self._unfulfilled: Configuration | None = None
        # What was last asked for or told: small steps away from it add up to a change.
        self._reference: Configuration | None = None

    def check(self, changes: Mapping[str, Any]) -> dict[str, Any]:
        """
        Return the changes, ready to be sent.

        :raises InvalidValue: if one must not be.
        """
        limits = self._light.limits
        return {name: checked(name, value, limits) for name, value in changes.items()}

    def with_changes(self, changes: Mapping[str, Any]) -> Configuration:
        """
        Return the agreed configuration with changes.

        :raises InvalidValue: if nothing is agreed yet and the changes are not complete.
        """
        if self.agreed is not None:
            return self._sendable(self.agreed, changes).with_changes(changes)
        missing = [name for name in FIELDS if name not in changes]
        if missing:
            raise InvalidValue(
                'the light has not reported its configuration yet, so '
                f'{", ".join(missing)} must be set in the same call')
        return Configuration(**changes)

    def _sendable(self, agreed: Configuration, changes: Mapping[str, Any]) -> Configuration:
        """
        Return what is agreed but for what the light's own limits rule out.

        A light that has once reported such a value would deny every change that carries it.
        """
        status, limits = self._light.status, self._light.limits
        if status is None:
            return agreed
        reported = status.configuration(agreed)
        ruled_out = {}
        for name in FIELDS:
            try:
                if name != 'mode' and name not in changes:
                    checked(name, getattr(agreed, name), limits)
            except InvalidValue:
                ruled_out[name] = getattr(reported, name)
        return agreed.with_changes(ruled_out)

    def agree(self, wanted: Configuration, status: Status | None) -> None:
        """
        Note that the light has accepted a configuration, with the status that shows it.

        What the status shows in other steps than asked for is what is agreed; what it shows
        otherwise for a good reason (heat, external sync) is not.
        """
        if status:
            reported = status.configuration(wanted)
            far = wanted.differences(reported)
            wanted = wanted.with_changes({
                name: getattr(reported, name)
                for name in wanted.differences(reported, step=False) if name not in far})
        self._fulfilled()
        self._adopt(wanted, Cause.REQUEST)

    def _fulfilled(self) -> None:
        self._unfulfilled = None
        self.discrepancy = ''

    def _adopt(self, configuration: Configuration, cause: Cause) -> None:
        old, self.agreed = self.agreed, configuration
        if cause is not Cause.ROUNDING:
            self._reference = configuration
        names = [name for name in FIELDS
                 if old is None or getattr(old, name) != getattr(configuration, name)]
        if names:
            self._light.emit(ConfigurationChanged(
                self._light.address, configuration, names, cause))

    def _follow(self, status: Status, agreed: Configuration, reported: Configuration) -> None:
        # Under external sync too: somebody else may have changed what cannot be told apart.
        names = unexplained(agreed, reported, status.error_flags, step=False, external=False)
        if names:
            far = unexplained(
                self._reference or agreed, reported, status.error_flags, step=True,
                external=False)
            self._adopt(
                agreed.with_changes({name: getattr(reported, name) for name in names}),
                Cause.LIGHT if far else Cause.ROUNDING)
