# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""A component that carries the client of lights only."""

from typing import Any

from illuminator_ros.illuminator.client import IlluminatorClient
from illuminator_ros.illuminator.settings import LightSettings
from illuminator_ros.mavlink.command_sender import CommandSender
from illuminator_ros.mavlink.component import Component
from illuminator_ros.mavlink.messages import Address


class Client(Component):
    """
    The bridge's side of a link to lights.

    :param options: as for :class:`IlluminatorClient`.
    """

    def __init__(
        self, address: Address, settings: LightSettings, *, command_timeout: float = 0.25,
        command_retries: int = 3, **options: Any,
    ) -> None:
        commands = CommandSender(address, command_timeout, command_retries)
        self.client = IlluminatorClient(commands, settings, **options)
        super().__init__(commands, [self.client])

    @property
    def sender(self) -> CommandSender:
        return self.commands

    def __getattr__(self, name: str) -> Any:
        return getattr(self.client, name)
