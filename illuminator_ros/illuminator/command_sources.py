# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The sources of the commands to one light: its holder, and the values that each requests."""

from __future__ import annotations

from typing import NamedTuple

from ..payload.arbitration import HolderChanged
from ..payload.command_sources import Sources, SourceSettings


class DesiredState(NamedTuple):
    """
    The last values that a source has requested, None for values that it has not requested.

    :param brightness: %.
    """

    enabled: bool | None = None
    brightness: float | None = None


class LightSources(Sources):
    """Decides which source holds a light, and keeps the values that each has requested. No I/O."""

    def __init__(self, settings: SourceSettings | None) -> None:
        super().__init__(settings)
        self._desired: dict[str, DesiredState] = {}

    @property
    def desired(self) -> DesiredState:
        """Return the values that the holder has requested."""
        return self._desired.get(self.holder or '', DesiredState())

    def claim(self, source: str, now: float) -> HolderChanged[str] | None:
        """Take a request of a source; it then holds the light, unless a higher one does."""
        if not self.is_claimed_by(source):
            self._desired.pop(source, None)
        return super().claim(source, now)

    def remember(self, source: str, newer: DesiredState) -> None:
        """Keep values that a source has requested, as long as it claims the light."""
        if self.is_claimed_by(source):
            older = self._desired.get(source, DesiredState())
            self._desired[source] = DesiredState(
                older.enabled if newer.enabled is None else newer.enabled,
                older.brightness if newer.brightness is None else newer.brightness)

    def forget_switch(self, source: str) -> None:
        """Forget the ON or OFF of a source."""
        if source in self._desired:
            self._desired[source] = self._desired[source]._replace(enabled=None)

    def forget_on(self, *, brightness_is_switch: bool) -> None:
        """Forget each ON, and each brightness if that would be an ON; an OFF is kept."""
        self._desired = {
            source: DesiredState(False if desired.enabled is False else None,
                                 None if brightness_is_switch else desired.brightness)
            for source, desired in self._desired.items()}
