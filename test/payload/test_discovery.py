# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Polls of the devices of a component."""

from __future__ import annotations

from collections.abc import Callable
import math

from illuminator_ros.mavlink.command_sender import Command, CommandSender
from illuminator_ros.mavlink.component import Component, Payload
from illuminator_ros.mavlink.link_thread import FaultLog
from illuminator_ros.mavlink.messages import Address, CommandLong, Message
from illuminator_ros.payload.discovery import Discovery
import pytest

Poll = Callable[[float], None]


class Device:
    """A device that is always due."""

    lost_at = math.inf
    was_commanded = True

    def __init__(self, poll: Poll) -> None:
        self.poll = poll

    def next_deadline(self) -> float:
        return -math.inf


class Devices(Payload):
    """Discovered devices."""

    messages = ()

    def __init__(self, *polls: Poll) -> None:
        self.discovery = Discovery[int, Device]()
        for key in range(len(polls)):
            self.discovery.hear(key, 0.0, lambda key: Device(polls[key]), proved=True)

    def receive(self, source: Address, message: Message, now: float) -> None:
        raise AssertionError

    def poll(self, now: float) -> None:
        self.discovery.poll(now)


def test_a_device_that_fails_keeps_no_other_and_no_resend_from_its_turn_and_is_logged(
    caplog: pytest.LogCaptureFixture,
) -> None:
    polled: list[str] = []

    def fail(now: float) -> None:
        polled.append('failed')
        raise RuntimeError('a device fails')

    commands = CommandSender(Address(1, 193))
    component = Component(commands, [
        Devices(fail, lambda now: polled.append('device')),
        Devices(lambda now: polled.append('device of another payload'))])
    commands.start(Command(Address(1, 243), 405), 0.0)
    commands.outgoing.clear()

    FaultLog(lambda: 1.0).call(component.poll, 1.0)

    assert polled == ['failed', 'device', 'device of another payload']
    assert [type(message) for _, message in commands.outgoing] == [CommandLong]
    assert [str(one.exc_info[1]) for one in caplog.records if one.exc_info] == ['a device fails']
