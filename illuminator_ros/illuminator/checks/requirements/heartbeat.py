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

"""What the heartbeat protocol asks of a light."""

from __future__ import annotations

from ..bench import Bench
from ..requirement import Failed, HEARTBEAT, requirement, ROUTING, Skipped
from ....mavlink.messages import MAV_AUTOPILOT_INVALID, MavType


@requirement('heartbeat', 'sends HEARTBEAT', HEARTBEAT, 'HEARTBEAT Broadcast Frequency')
async def heartbeat(bench: Bench) -> str:
    """Wait for one."""
    await bench.until(lambda: bench.heartbeats, 5.0)
    if not bench.heartbeats:
        raise Failed('no HEARTBEAT in 5 s')
    return f'from {bench.light}'


def _last(bench: Bench, name: str) -> int:
    if not bench.heartbeats:
        raise Skipped('there is no HEARTBEAT')
    return int(getattr(bench.heartbeats[-1][1], name))


@requirement('heartbeat-type', 'its type is MAV_TYPE_ILLUMINATOR (44)', HEARTBEAT,
             'Component Identity')
async def heartbeat_type(bench: Bench) -> None:
    """Look at what is known already."""
    if (value := _last(bench, 'type')) != MavType.ILLUMINATOR:
        raise Failed(f'MAV_TYPE {value}: nobody finds a light by it')


@requirement('heartbeat-autopilot', 'its autopilot is MAV_AUTOPILOT_INVALID (8)', HEARTBEAT,
             'Component Identity')
async def heartbeat_autopilot(bench: Bench) -> None:
    """Look at what is known already."""
    if (value := _last(bench, 'autopilot')) != MAV_AUTOPILOT_INVALID:
        raise Failed(f'MAV_AUTOPILOT {value}: it is taken for a flight controller')


@requirement('address', 'system and component id are not 0', ROUTING, 'ID allocation')
async def address(bench: Bench) -> str:
    """Look where it sends from; 0 is everybody's."""
    if 0 in bench.light:
        raise Failed(f'it sends from {bench.light}: 0 addresses everybody, and no router can '
                     'find it')
    return f'{bench.light}'
