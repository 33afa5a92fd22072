# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The settings of each light."""

from __future__ import annotations

from dataclasses import dataclass

from .model import SafetyLimits
from ..payload.command_sources import SourceSettings


@dataclass(frozen=True)
class LightSettings:
    """
    The settings of each light.

    :param heartbeat_timeout: s, > 0, without a heartbeat or status, after which a light is lost.
    :param status_interval: s, >= 0, between statuses that the light is asked for; 0 leaves its
        own.
    :param restore_configuration: whether a light that has restarted gets its agreed configuration
        again.
    :param limits: apply to everything that is sent.
    :param off_after_silence: s without a request after which a light that is on is switched off;
        0 for never.
    :param sources: the sources of commands, None if commands have no sources.
    :param off_on_release: whether a light is switched off when no source holds it any more.
    """

    heartbeat_timeout: float = 3.0
    status_interval: float = 0.0
    restore_configuration: bool = True
    limits: SafetyLimits = SafetyLimits()
    off_after_silence: float = 0.0
    sources: SourceSettings | None = None
    off_on_release: bool = False
