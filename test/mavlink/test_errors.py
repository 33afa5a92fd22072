# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The exceptions that a user of the core may catch, by their causes."""

from __future__ import annotations

from collections.abc import Callable
import socket

from illuminator_ros.illuminator.client import IlluminatorClient
from illuminator_ros.illuminator.model import SafetyLimits
from illuminator_ros.illuminator.settings import LightSettings
from illuminator_ros.mavlink.command_sender import CommandSender
from illuminator_ros.mavlink.component import Component
from illuminator_ros.mavlink.errors import (
    ChannelError,
    ChannelLost,
    InvalidValue,
    KeyFileError,
    LinkThreadError,
    MavlinkError,
    UrlError,
)
from illuminator_ros.mavlink.link import Link
from illuminator_ros.mavlink.messages import Address
from illuminator_ros.mavlink.signing import Signing, SigningMode
from illuminator_ros.mavlink.signing_files import load_key
from illuminator_ros.mavlink.transport import open_channel
from illuminator_ros.mavlink.url import parse_url
from illuminator_ros.payload.command_sources import source_name
from illuminator_ros.simulation.faults import FaultError, FAULTS
import pytest

BRIDGE = Address(1, 193)


def open_(url: str) -> None:
    open_channel(parse_url(url)).close()


def busy_udp_port() -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as occupant:
        occupant.bind(('127.0.0.1', 0))
        open_(f'udpin://127.0.0.1:{occupant.getsockname()[1]}')


def busy_tcp_port() -> None:
    with socket.create_server(('127.0.0.1', 0)) as occupant:
        open_(f'tcpin://127.0.0.1:{occupant.getsockname()[1]}')


def lost_server() -> None:
    with socket.create_server(('127.0.0.1', 0)) as server:
        channel = open_channel(parse_url(f'tcpout://127.0.0.1:{server.getsockname()[1]}'))
        server.accept()[0].close()
        try:
            [*channel.receive(None)]
        finally:
            channel.close()


def link(mavlink_version: int = 2) -> Link:
    commands = CommandSender(BRIDGE)
    return Link(parse_url('memory://errors'), Component(commands, [
        IlluminatorClient(commands, LightSettings())]), label='test',
        mavlink_version=mavlink_version)


@pytest.mark.parametrize(('cause', 'error', 'builtin'), [
    (lambda: parse_url('udp:/x'), UrlError, ValueError),
    (lambda: parse_url('serial://auto', can_search=False), UrlError, ValueError),
    (busy_udp_port, ChannelError, OSError),
    (busy_tcp_port, ChannelError, OSError),
    (lambda: open_('serial:///dev/no_such_port:57600'), ChannelError, OSError),
    (lambda: open_('udpout://a..b:14550'), ChannelError, OSError),
    (lost_server, ChannelLost, OSError),
    (lambda: open_('serial://auto'), InvalidValue, ValueError),
    (lambda: load_key('/no/such/key'), KeyFileError, ValueError),
    (lambda: CommandSender(BRIDGE, timeout=0.0), InvalidValue, ValueError),
    (lambda: CommandSender(BRIDGE, retries=-1), InvalidValue, ValueError),
    (lambda: Signing(SigningMode.SIGN, b'short'), InvalidValue, ValueError),
    (lambda: link(mavlink_version=1), InvalidValue, ValueError),
    (lambda: link(mavlink_version=3), InvalidValue, ValueError),
    (lambda: source_name('no topic'), InvalidValue, ValueError),
    (lambda: SafetyLimits(50.0).check('brightness', 80.0), InvalidValue, ValueError),
    (lambda: FAULTS.find('no such fault'), FaultError, ValueError),
])
def test_each_cause_raises_its_own_class_which_is_also_the_builtin_one(
    cause: Callable[[], object], error: type[MavlinkError], builtin: type[Exception],
) -> None:
    with pytest.raises(MavlinkError) as caught:
        cause()

    assert type(caught.value) is error
    assert isinstance(caught.value, builtin)
    assert str(caught.value)


def test_a_thread_that_the_system_refuses_is_an_error_of_the_link(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def refuse(thread: object) -> None:
        raise RuntimeError("can't start new thread")

    monkeypatch.setattr('threading.Thread.start', refuse)
    with pytest.raises(MavlinkError, match="^test: can't start new thread") as caught:
        link().start()
    assert type(caught.value) is LinkThreadError


def test_the_parameters_of_a_node_have_an_error_of_their_own() -> None:
    pytest.importorskip('rclpy')
    from illuminator_ros.ros.parameters import ParameterError
    assert issubclass(ParameterError, MavlinkError)
    assert issubclass(ParameterError, ValueError)
