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

"""COMPONENT_INFORMATION_BASIC."""

from __future__ import annotations

from typing import Any

from ..bench import Bench
from ..requirement import Failed, ILLUMINATOR, MESSAGES, requirement, Skipped
from ...identity import Identity
from ....mavlink.messages import INFORMATION_ID, MavCmd, wire_value

STRINGS = ('vendor_name', 'model_name', 'software_version', 'hardware_version', 'serial_number')


@requirement('information-request', 'sends COMPONENT_INFORMATION_BASIC on request', ILLUMINATOR,
             'COMPONENT_INFORMATION_BASIC')
async def on_request(bench: Bench) -> str:
    """Ask with MAV_CMD_REQUEST_MESSAGE."""
    one = await bench.command(MavCmd.REQUEST_MESSAGE, INFORMATION_ID)
    if not one.accepted:
        raise Failed(one.answer)
    if not await bench.until(lambda: bench.informations, 3.0):
        await bench.information()
    if not bench.informations:
        raise Failed('MAV_RESULT_ACCEPTED, but it does not come')
    identity = Identity.from_message(bench.informations[-1])
    return ', '.join(filter(None, (identity.vendor, identity.model))) or 'no names'


async def _information(bench: Bench) -> Any:
    if not bench.informations and await bench.information() is None:
        raise Skipped('there is no COMPONENT_INFORMATION_BASIC')
    return bench.informations[-1]


@requirement('information-terminated', 'every string of it ends with a NUL', MESSAGES,
             'COMPONENT_INFORMATION_BASIC')
async def terminated(bench: Bench) -> None:
    """Look for the terminator that the fields' descriptions ask for."""
    message = await _information(bench)
    wrong = [name for name in STRINGS if b'\0' not in wire_value(message, name)]
    if wrong:
        raise Failed(f'no terminator in {", ".join(wrong)}')


@requirement('information-text', 'every string of it is text', MESSAGES,
             'COMPONENT_INFORMATION_BASIC')
async def text(bench: Bench) -> None:
    """Look for bytes that no screen can show."""
    message = await _information(bench)
    wrong = []
    for name in STRINGS:
        raw = wire_value(message, name).partition(b'\0')[0]
        # The end of a character may have been cut off with the end of the string.
        shown = raw.decode('utf-8', errors='ignore')
        if not shown.isprintable() or len(raw) - len(shown.encode()) > 3:
            wrong.append(f'{name} {raw!r}')
    if wrong:
        raise Failed(', '.join(wrong))
