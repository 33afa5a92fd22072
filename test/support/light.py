# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""A fake light on loopback UDP, served by a thread of the test's process."""

from __future__ import annotations

from collections.abc import Callable
import random
from typing import Any, TypeVar

from illuminator_ros.illuminator.messages import STATUS_ID
from illuminator_ros.mavlink.dialect import mavlink
from illuminator_ros.mavlink.link import Link
from illuminator_ros.mavlink.messages import (
    Address,
    CommandAck,
    CommandInt,
    CommandLong,
)
from support.fake_light import FakeLight
from support.live_link import EndpointLink
from support.ports import free_port
from support.slow import CLOCK, SlowLink, SPEED
from support.waiting import eventually, Log

LIGHT = Address(1, 243)
# Real s between statuses.
STREAM = 0.1
ON_OFF, CONFIGURE = mavlink.MAV_CMD_ILLUMINATOR_ON_OFF, mavlink.MAV_CMD_DO_ILLUMINATOR_CONFIGURE
T = TypeVar('T')


class _Recorder(FakeLight):
    """
    A fake light that keeps received messages, can answer late, and can lose messages.

    :ivar held: commands that are not taken until they are released, by MAV_CMD.
    :ivar loss: the share (0..1) of messages that are lost in each direction.
    """

    def __init__(self, source: Address, **how: Any) -> None:
        super().__init__(source, **how)
        self.pushes = True
        self.received: Log[Any] = Log()
        self.held: dict[int, list[tuple[Address, Any]]] = {}
        self.loss = 0.0

    def send(self, message: Any) -> None:
        if not self._is_lost():
            super().send(message)

    def _is_lost(self) -> bool:
        return random.random() < self.loss

    def receive(self, source: Address, message: Any, now: float) -> None:
        if not isinstance(message, CommandLong | CommandInt):
            return
        self.received.append(message)
        if self._is_lost():
            return
        if message.command in self.held:
            self.held[message.command].append((source, message))
        else:
            super().receive(source, message, now)

    def release(self, command: int, now: float) -> None:
        for source, message in self.held.pop(command):
            super().receive(source, message, now)


class ServedLight:
    """
    A light that a test controls, over real UDP, by the slow clock of :mod:`support.slow`.

    The attributes of ``fake`` (see :class:`~.fake_light.FakeLight`) may be set at any time.

    :param link: the class of its link; a plain Link uses the clock of the machine.
    """

    def __init__(self, port: int, source: Address = LIGHT, *, link: type[Link] = SlowLink,
                 **how: Any) -> None:
        self.port = port
        self._kind = link
        self._stream = STREAM * SPEED if link is SlowLink else STREAM
        self.fake = _Recorder(source, **{'stream': self._stream, **how})
        self._link: EndpointLink[_Recorder] | None = None

    def __enter__(self) -> ServedLight:
        self.serve()
        return self

    def __exit__(self, *error: object) -> None:
        self.vanish()

    def serve(self) -> None:
        """Open the link."""
        if self._link is None:
            self._link = EndpointLink(
                f'udpout://127.0.0.1:{self.port}', self.fake, kind=self._kind)

    def vanish(self) -> None:
        """Close the link, as when a cable is pulled."""
        if self._link is not None:
            self._link.stop()
            self._link = None

    def behave(self) -> None:
        """Accept and apply all commands from now on."""
        self.fake.results.clear()
        self.fake.held.clear()
        self.fake.applies = True
        self.fake.apply_after = 0.0
        self.fake.silent = False
        self.fake.pushes = True
        self.fake.answers.add(STATUS_ID)
        self.fake.stream = self._stream

    def do(self, action: Callable[[float], T]) -> T:
        """Call ``action(now)`` in the light's thread, and return its result."""
        assert self._link is not None
        return self._link.ask(action)

    def report(self, **fields: Any) -> float:
        """
        Send one status with fields that have changed without a command.

        :return: its uptime, s, which differs from that of every earlier status.
        """
        def act(now: float) -> float:
            self.fake.fields |= fields
            self.fake.send(self.fake.status(now))
            return self.fake.uptime_ms(now) / 1000

        CLOCK.forward(0.002)
        return self.do(act)

    def send(self, message: Any, source: Address | None = None) -> None:
        """Send any message, optionally from another address."""
        self.do(lambda now: self.fake.outgoing.append((source or self.fake.source, message)))

    def acknowledge(
        self, command: int, result: int, *, progress: int = 0, source: Address = LIGHT,
    ) -> None:
        """Send an acknowledgement without a command."""
        self.send(CommandAck(command, result, progress, 0, 0, 0), source)

    def release(self, command: int) -> None:
        """Take the held commands of this kind, and hold back no further ones."""
        self.do(lambda now: self.fake.release(command, now))

    def forget(self) -> None:
        """Forget the commands received so far."""
        self.fake.received.clear()

    def commands(self, *kinds: int) -> list[Any]:
        """Return the received commands of some kinds."""
        return [message for message in list(self.fake.received) if message.command in kinds]

    def wait_for(self, command: int, count: int = 1) -> list[Any]:
        """Wait until a command has arrived ``count`` times, and return the received ones."""
        self.fake.received.wait_for(lambda message: message.command == command, count=count)
        return self.commands(command)


def params(message: Any) -> tuple[float, float, float, float]:
    """Return the four parameters of a command that the illuminator protocol uses."""
    return message.param1, message.param2, message.param3, message.param4


__all__ = ['Address', 'CONFIGURE', 'eventually', 'free_port', 'ON_OFF', 'params', 'ServedLight']
