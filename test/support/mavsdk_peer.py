# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""MAVSDK as another program on a link; its tests are skipped where its wheel is not installed."""

from __future__ import annotations

from collections.abc import Callable, Iterator
import contextlib
from typing import Any

from illuminator_ros.mavlink.messages import Address
import pytest
from support.waiting import eventually

pytest.importorskip('mavsdk.mavsdk', reason='the wheel of mavsdk is not installed')

from mavsdk import mavsdk  # noqa: E402, I100
from mavsdk.plugins.gimbal import gimbal as plugin  # noqa: E402
from mavsdk.plugins.mavlink_direct import mavlink_direct  # noqa: E402

# The plugins are imported from here, after the check for the wheel.
__all__ = ('connected', 'DENIED', 'mavlink_direct', 'player', 'plugin', 'result')

# MAVSDK's name of MAV_RESULT_DENIED.
DENIED = 'ERROR'


@contextlib.contextmanager
def connected(address: Address, port: int, scheme: str = 'udpout') -> Iterator[Any]:
    """Yield a MAVSDK with an address that has found a system at a UDP port of this machine."""
    sdk = mavsdk.Mavsdk(mavsdk.Configuration.create_manual(*address, True))
    try:
        assert sdk.add_any_connection(f'{scheme}://127.0.0.1:{port}') == 0
        eventually(sdk.get_systems)
        yield sdk
    finally:
        sdk.destroy()


@contextlib.contextmanager
def player(address: Address, port: int, scheme: str = 'udpout') -> Iterator[Any]:
    """Yield the Gimbal plugin of a MAVSDK that has found the gimbal."""
    with connected(address, port, scheme) as sdk:
        gimbal = plugin.Gimbal(sdk.get_systems()[0])
        eventually(lambda: gimbal.gimbal_list().gimbals)
        yield gimbal


def result(call: Callable[..., Any], *arguments: Any) -> str:
    """Return the name of the result of a call."""
    try:
        return str(plugin.GimbalResult(call(*arguments)).name)
    except plugin.GimbalError as error:
        return str(error.result.name)
