# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""
A gimbal manager and a client in one process; through the client, ROS is one of the players.

The two exchange the messages of the gimbal protocol as over a link, and have the same address. So
ROS has the same interface as for a gimbal that another component manages, and the same rules apply
to ROS as to all other players.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Collection
import functools
import math
from typing import TypeVar

from .client import GimbalClient
from .gimbal import GimbalSettings
from .manager import GimbalManager, ManagerSettings
from ..mavlink import messages as mav
from ..mavlink.command_receiver import CommandReceiver
from ..mavlink.command_sender import Command, CommandSender
from ..mavlink.component import Component, Payload
from ..mavlink.messages import AnyCommand

_FOR_CLIENT = frozenset(GimbalClient.messages)

M = TypeVar('M')


class Mailbox(deque[M]):
    """
    The messages that one of both has for the other.

    :param wake: called after each of them.
    """

    def __init__(self, wake: Callable[[], None]) -> None:
        super().__init__()
        self._wake = wake

    def append(self, message: M) -> None:
        """Append a message."""
        super().append(message)
        self._wake()


class ManagerWithClient(Payload):
    """
    A manager, and the client that ROS uses.

    :ivar client: has the gimbal of the manager, and no other.
    """

    messages = (*GimbalManager.messages, mav.CommandAck)
    sends = (*GimbalManager.sends, *GimbalClient.sends)
    streams = (*GimbalManager.streams, *GimbalClient.streams)

    def __init__(
        self, commands: CommandSender, settings: ManagerSettings, client: GimbalSettings,
    ) -> None:
        # The reports of the manager, which the client has not received yet.
        wake = functools.partial(commands.schedule.by, self._exchange, -math.inf)
        self._reports: Mailbox[mav.Message] = Mailbox(wake)
        self.manager = GimbalManager(commands, settings, reported=self._reports.append)
        self._commands = commands
        own = CommandSender(
            commands.address, commands.timeout, commands.retries, commands.clock_fault,
            Mailbox(wake), schedule=commands.schedule)
        self.client = GimbalClient(
            own, client, self.manager.vehicle, self.manager.is_measured)
        # It is given no messages: it would drop those of its own address.
        self._component = Component(own, [self.client])
        self._received = CommandReceiver(commands.address)

    def link_opened(self, now: float) -> None:
        """See :meth:`Payload.link_opened`."""
        self._component.link_opened(now)
        self.manager.link_opened(now)

    def link_closed(self, now: float, reason: str) -> None:
        """See :meth:`Payload.link_closed`."""
        self.manager.link_closed(now, reason)
        self._component.link_closed(now, reason)

    def components_lost(
        self, lost: Collection[mav.Address], now: float, reason: str,
    ) -> None:
        """See :meth:`Payload.components_lost`."""
        self.manager.components_lost(lost, now, reason)
        self._component.components_lost(lost, now, reason)

    def stalled(self, seconds: float, now: float) -> None:
        """See :meth:`Payload.stalled`."""
        self._component.stalled(seconds, now)

    def may_send_at_end(self, sent: Command | mav.Message) -> bool:
        """See :meth:`Payload.may_send_at_end`."""
        return self.manager.may_send_at_end(sent) or self.client.may_send_at_end(sent)

    def close(self, now: float) -> None:
        """See :meth:`Payload.close`."""
        self.manager.close(now)
        self._component.close(now, self._commands.refusal)

    def receive(self, source: mav.Address, message: mav.Message, now: float) -> None:
        """See :meth:`Payload.receive`."""
        if isinstance(message, mav.CommandAck):
            self._component.commands.acknowledge(source, message, now)
        else:
            self.manager.receive(source, message, now)
            if source == self.manager.tracker.device and type(message) in _FOR_CLIENT:
                self.client.receive(source, message, now)

    def receive_conflicting(self, message: mav.Message, now: float) -> None:
        """See :meth:`Payload.receive_conflicting`."""
        self.manager.receive_conflicting(message, now)

    def execute(
        self, source: mav.Address, command: AnyCommand, now: float,
    ) -> int | None:
        """See :meth:`Payload.execute`."""
        return self.manager.execute(source, command, now)

    def _exchange(self, now: float) -> None:
        """Pass the messages of manager and client to each other until neither has one."""
        outgoing = self._component.outgoing
        while self._reports or outgoing:
            if self._reports:
                self.client.receive(self._commands.address, self._reports.popleft(), now)
            else:
                self._deliver(*outgoing.popleft(), now)

    def _deliver(self, source: mav.Address, message: mav.Message, now: float) -> None:
        """Give a message of the client to the manager, or send it to another component."""
        if isinstance(message, mav.Heartbeat):
            self._reports.append(message)
            self.manager.receive(source, message, now)
        elif mav.target_of(message) != self._commands.address:
            self._commands.send(message)
        elif isinstance(message, AnyCommand):
            ack = self._received.receive(source, message, now, self.manager.execute)
            if ack is not None:
                self._component.commands.acknowledge(source, ack, now)
        else:
            self.manager.receive(source, message, now)
