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

"""MAVSDK's Gimbal plugin as a player."""

from __future__ import annotations

from collections.abc import Callable, Iterator
import contextlib
from typing import Any

from illuminator_ros.mavlink.messages import Address
from mavsdk import mavsdk
from mavsdk.plugins.gimbal import gimbal as plugin
from support.waiting import eventually

__all__ = ['player', 'plugin', 'result']


@contextlib.contextmanager
def player(address: Address, port: int) -> Iterator[Any]:
    """Return the Gimbal plugin of a MAVSDK that has found the gimbal."""
    sdk = mavsdk.Mavsdk(mavsdk.Configuration.create_manual(*address, 1))
    try:
        assert sdk.add_any_connection(f'udpout://127.0.0.1:{port}') == 0
        eventually(sdk.get_systems)
        gimbal = plugin.Gimbal(sdk.get_systems()[0])
        eventually(lambda: gimbal.gimbal_list().gimbals)
        yield gimbal
    finally:
        sdk.destroy()


def result(call: Callable[..., Any], *arguments: Any) -> str:
    """Return the name of the result of a call."""
    try:
        return str(plugin.GimbalResult(call(*arguments)).name)
    except plugin.GimbalError as error:
        return str(error.result.name)
