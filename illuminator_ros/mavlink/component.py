# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""A MAVLink component: one address, one heartbeat, one command sender, any number of payloads."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Callable, Collection, Sequence
import math

from .command_receiver import CommandReceiver
from .command_sender import Command, CommandSender, CommandStatus
from .conflating_queue import StreamGroup
from .dialect import enum_name, mavlink
from .frame import Frame
from .messages import (
    Address,
    AnyCommand,
    CommandAck,
    CommandInt,
    CommandLong,
    Heartbeat,
    heartbeat,
    Message,
)
from .schedule import Schedule
from .statistics import MAX_SOURCES

# s between heartbeats (heartbeat protocol).
HEARTBEAT_INTERVAL = 1.0
# s for which a message from our own address counts as an address conflict.
CONFLICT_MEMORY = 10.0


class MessageHandler(ABC):
    """
    One side of a protocol, without I/O; times are s on the link's clock.

    :ivar messages: the classes of the messages that it receives; the link decodes no others.
    :ivar sends: the classes of messages that it sends; those that it also receives, and those of
        the command protocol, may be left out.
    :ivar streams: groups of classes of messages that newer ones replace, the most urgent first. A
        group is sent as one when the line has room, and dropped where it has none for
        :data:`~.conflating_queue.MAX_AGE`. All other messages are sent at once, after those of
        streams for the same target.
    """

    messages: Sequence[type[Message]]
    sends: Sequence[type[Message]] = ()
    streams: Sequence[StreamGroup] = ()

    def link_opened(self, now: float) -> None:  # noqa: B027 - optional
        """
        Note that messages can be sent, or that a new peer may receive them.

        The link repeats the call while it hears no peer.
        """

    def link_closed(self, now: float, reason: str) -> None:  # noqa: B027 - optional
        """Note that nothing can be sent any more, and why."""

    def stalled(self, seconds: float, now: float) -> None:  # noqa: B027 - optional
        """Note that the process was stopped: requests that come now may be as old, s."""

    def components_lost(  # noqa: B027 - optional
        self, lost: Collection[Address], now: float, reason: str,
    ) -> None:
        """Note that some components cannot be reached any more, and why; others still can."""

    @abstractmethod
    def receive(self, source: Address, message: Message, now: float) -> None:
        """Receive a message of one of the classes of ``messages``."""

    def sent(self, message: Message, now: float) -> None:  # noqa: B027 - optional
        """Note that a message of ``streams`` is sent; others have replaced those between."""


class Endpoint(MessageHandler):
    """
    The handler of all messages of a link.

    A :class:`~.link.Link` calls it only in its thread, sends the messages in ``outgoing``, and
    runs the ``schedule``.

    :ivar inspect: called with the frame and the class of a message before that is received.
    :ivar outgoing: messages to send, each with the address that sends it.
    :ivar schedule: the functions of its parts that want to be called.
    :ivar address: of a component that has one only.
    """

    address = Address(1, mavlink.MAV_COMP_ID_ONBOARD_COMPUTER)
    inspect: Callable[[Frame, type[Message]], None] | None = None

    def __init__(self) -> None:
        self.outgoing: deque[tuple[Address, Message]] = deque()
        self.schedule = Schedule()


class Payload(MessageHandler):
    """
    A part of a component: the client of a light, a winch, a camera ...

    It names HEARTBEAT among its ``messages`` if it needs heartbeats, and COMMAND_LONG and
    COMMAND_INT if it executes commands. It receives no messages from the component's own address,
    and no acknowledgements for other components.
    All its commands have ended when :meth:`link_closed` is called. Its parts are called again by
    the schedule of the command sender.
    """

    def receive_conflicting(self, message: Message, now: float) -> None:  # noqa: B027 - optional
        """Receive a message of one of these classes from another sender with our address."""

    def close(self, now: float) -> None:  # noqa: B027 - optional
        """
        Answer all requests, since the process ends: the command sender has been closed.

        See :meth:`~.command_sender.CommandSender.close`; it can no longer be opened.
        """

    def may_send_at_end(self, sent: Command | Message) -> bool:
        """Return whether a command or a message may still be sent while the process ends."""
        return False

    def execute(self, source: Address, command: AnyCommand, now: float) -> int | None:
        """
        Execute a command to this component, or to all components, and return its result.

        :return: None if the payload does not support it; another payload may.
        """
        return None


class HeartbeatTimer:
    """
    The heartbeat of one component on an open link (heartbeat protocol).

    It must be sent before anything else: routers forward nothing to a component that they have
    not heard.

    :param outgoing: takes the heartbeats, each with the address.
    """

    def __init__(
        self, address: Address, mav_type: int, outgoing: deque[tuple[Address, Message]],
        schedule: Schedule,
    ) -> None:
        self._address = address
        self._mav_type = mav_type
        self._outgoing = outgoing
        self._schedule = schedule

    def send(self, now: float) -> None:
        """Send a heartbeat now; the next is due an interval later."""
        self._outgoing.append((self._address, heartbeat(self._mav_type)))
        self._schedule.at(self.send, now + HEARTBEAT_INTERVAL)

    def stop(self) -> None:
        """Send none until the next :meth:`send`: the link is closed."""
        self._schedule.at(self.send, math.inf)


class Component(Endpoint):
    """
    The endpoint of one address.

    :param commands: sends for all payloads, so that an acknowledgement has one receiver.
    :param payloads: receive each message from another address, and the link's state.
    :param mav_type: MAV_TYPE of the heartbeat.
    :ivar heartbeats: the last one of each other component.
    """

    def __init__(
        self, commands: CommandSender, payloads: Sequence[Payload], *,
        mav_type: int = mavlink.MAV_TYPE_ONBOARD_CONTROLLER,
    ) -> None:
        self.outgoing = commands.outgoing
        self.schedule = commands.schedule
        self.commands = commands
        self.address = commands.address
        self.heartbeats: dict[Address, Heartbeat] = {}
        self._payloads = tuple(payloads)
        # HEARTBEAT and COMMAND_ACK show an address conflict even where no payload needs them. Each
        # command to this component is acknowledged, so that its sender need not wait for a
        # time-out (command protocol).
        self.messages = tuple(dict.fromkeys(
            (Heartbeat, CommandAck, CommandLong, CommandInt,
             *(cls for one in payloads for cls in one.messages))))
        self.sends = tuple(dict.fromkeys(cls for one in payloads for cls in one.sends))
        self.streams = tuple(group for one in payloads for group in one.streams)
        self._receivers = {cls: tuple(one for one in payloads if cls in one.messages)
                           for cls in self.messages}
        self._received = CommandReceiver(self.address)
        self._heartbeat = HeartbeatTimer(self.address, mav_type, self.outgoing, self.schedule)
        self._conflict_at = -math.inf
        # The last heartbeat from another sender with our address.
        self._conflicting: Heartbeat | None = None

    def address_conflict(self, now: float) -> str:
        """Return what another sender is that has lately used our address; '' without one."""
        if now - self._conflict_at >= CONFLICT_MEMORY:
            return ''
        if self._conflicting is None:
            return 'a component without a HEARTBEAT'
        return (f'{enum_name("MAV_TYPE", self._conflicting.type)}, '
                f'{enum_name("MAV_AUTOPILOT", self._conflicting.autopilot)} by its HEARTBEAT')

    def close(self, now: float, reason: str) -> None:
        """
        Change no device any more, except as the payloads do at the end of the process.

        :param reason: why, for people.
        """
        self.commands.close(now, lambda sent: any(
            payload.may_send_at_end(sent) for payload in self._payloads), reason)
        for payload in self._payloads:
            payload.close(now)

    def link_opened(self, now: float) -> None:
        """See :meth:`Endpoint.link_opened`."""
        self._heartbeat.send(now)
        for payload in self._payloads:
            payload.link_opened(now)

    def link_closed(self, now: float, reason: str) -> None:
        """See :meth:`Endpoint.link_closed`."""
        self._heartbeat.stop()
        self.commands.end_all(now, CommandStatus.LINK_LOST)
        for payload in self._payloads:
            payload.link_closed(now, reason)

    def stalled(self, seconds: float, now: float) -> None:
        """See :meth:`Endpoint.stalled`."""
        self.commands.stalled(seconds, now)
        for payload in self._payloads:
            payload.stalled(seconds, now)

    def components_lost(self, lost: Collection[Address], now: float, reason: str) -> None:
        """See :meth:`Endpoint.components_lost`."""
        for address in lost:
            self.commands.end_all(now, CommandStatus.LINK_LOST, address)
        for payload in self._payloads:
            payload.components_lost(lost, now, reason)

    def receive(self, source: Address, message: Message, now: float) -> None:
        """See :meth:`Endpoint.receive`."""
        if not source.system:
            # A component with system id 0 cannot be addressed: 0 is the broadcast address.
            return
        if source == self.address:
            # The link has already dropped our own frames that returned.
            if isinstance(message, Heartbeat):
                self._conflicting = message
            elif now - self._conflict_at >= CONFLICT_MEMORY:
                self._conflicting = None
            self._conflict_at = now
            for payload in self._receivers.get(type(message), ()):
                payload.receive_conflicting(message, now)
            return
        if isinstance(message, CommandAck) and not self.commands.acknowledge(source, message, now):
            return
        if isinstance(message, AnyCommand):
            self._receive_command(source, message, now)
            return
        if isinstance(message, Heartbeat) and (
                source in self.heartbeats or len(self.heartbeats) < MAX_SOURCES):
            self.heartbeats[source] = message
        for payload in self._receivers.get(type(message), ()):
            payload.receive(source, message, now)

    def sent(self, message: Message, now: float) -> None:
        """See :meth:`Endpoint.sent`."""
        for payload in self._payloads:
            payload.sent(message, now)

    def _receive_command(self, source: Address, command: AnyCommand, now: float) -> None:
        before = len(self.outgoing)
        ack = self._received.receive(source, command, now, self._execute)
        if ack is not None:
            # Ahead of the messages that the command has caused.
            self.outgoing.insert(before, (self.address, ack))

    def _execute(self, source: Address, command: AnyCommand, now: float) -> int | None:
        return next((result for payload in self._receivers[type(command)]
                     if (result := payload.execute(source, command, now)) is not None), None)
