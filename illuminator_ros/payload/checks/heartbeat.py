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

"""Requirements of the heartbeat protocol."""

from __future__ import annotations

from .requirement import Failed, HEARTBEAT, Requirement, requirement, ROUTING, Skipped, Tester
from ...mavlink import messages
from ...mavlink.messages import MAV_AUTOPILOT_INVALID, MavType

TIMEOUT = 5.0


@requirement('heartbeat', 'sends HEARTBEAT', HEARTBEAT, 'HEARTBEAT Broadcast Frequency',
             presence=True)
async def heartbeat(tester: Tester) -> str:
    """Wait for one."""
    session = tester.session
    received = session.received(messages.Heartbeat)
    if not await session.runner.until(lambda: received, TIMEOUT):
        raise Failed(f'no HEARTBEAT in {TIMEOUT:g} s')
    return f'from {session.device}'


def _last(tester: Tester, field: str) -> int:
    received = tester.session.received(messages.Heartbeat)
    if not received:
        raise Skipped('no HEARTBEAT was received')
    return int(getattr(received.last[1], field))


def heartbeat_type(mav_type: MavType, device: str) -> Requirement[Tester]:
    """Return the requirement on HEARTBEAT.type of a device."""
    @requirement('heartbeat-type', f'identifies itself as MAV_TYPE_{mav_type.name} ({mav_type:d})',
                 HEARTBEAT, 'Component Identity')
    async def check(tester: Tester) -> None:
        if (value := _last(tester, 'type')) != mav_type:
            raise Failed(f'MAV_TYPE {value}: clients will not recognise it as {device}')
    return check


@requirement('heartbeat-autopilot', 'sets autopilot to MAV_AUTOPILOT_INVALID (8)', HEARTBEAT,
             'Component Identity')
async def heartbeat_autopilot(tester: Tester) -> None:
    """Read the latest HEARTBEAT."""
    if (value := _last(tester, 'autopilot')) != MAV_AUTOPILOT_INVALID:
        raise Failed(f'MAV_AUTOPILOT {value}: clients will take it for a flight controller')


@requirement('address', 'has a system ID and a component ID other than 0', ROUTING,
             'ID allocation')
async def address(tester: Tester) -> str:
    """Read the address of the device; 0 is the broadcast address."""
    device = tester.session.device
    if 0 in device:
        raise Failed(f'it sends from {device}: 0 means broadcast, so routers cannot find it')
    return f'{device}'
