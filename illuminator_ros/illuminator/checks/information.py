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

"""Requirements on COMPONENT_INFORMATION_BASIC."""

from __future__ import annotations

from typing import Any

from .specification import ILLUMINATOR
from ...mavlink.messages import ComponentInformationBasic, MavCmd
from ...payload.checks.requirement import Failed, MESSAGES, requirement, Skipped, Tester
from ...payload.checks.session import Session
from ...payload.identity import Identity

STRINGS = ('vendor_name', 'model_name', 'software_version', 'hardware_version', 'serial_number')


@requirement('information-request', 'sends COMPONENT_INFORMATION_BASIC on request', ILLUMINATOR,
             'COMPONENT_INFORMATION_BASIC')
async def on_request(tester: Tester) -> str:
    """Request it with MAV_CMD_REQUEST_MESSAGE."""
    session = tester.session
    received = session.received(ComponentInformationBasic)
    one = await session.command(MavCmd.REQUEST_MESSAGE, ComponentInformationBasic.id)
    if not one.accepted:
        raise Failed(one.answer)
    if not await session.runner.until(lambda: received, 3.0):
        await session.request(ComponentInformationBasic)
    if not received:
        raise Failed('MAV_RESULT_ACCEPTED, but no COMPONENT_INFORMATION_BASIC')
    identity = Identity.from_message(received.last[1])
    return ', '.join(filter(None, (identity.vendor, identity.model))) or 'no names'


def describe_identity(session: Session) -> str:
    """Return the names that the light has sent, '' if there are none."""
    received = session.received(ComponentInformationBasic)
    one = Identity.from_message(received.last[1]) if received else Identity()
    return ', '.join(filter(None, (one.vendor, one.model, one.serial_number)))


async def _information(tester: Tester) -> Any:
    received = tester.session.received(ComponentInformationBasic)
    if not received and await tester.session.request(ComponentInformationBasic) is None:
        raise Skipped('no COMPONENT_INFORMATION_BASIC was received')
    return received.last[1]


@requirement('information-terminated', 'terminates every identity string with NUL', MESSAGES,
             'COMPONENT_INFORMATION_BASIC')
async def terminated(tester: Tester) -> None:
    """Look for the terminator that the description of each field requires."""
    message = await _information(tester)
    wrong = [name for name in STRINGS if b'\0' not in getattr(message, name)]
    if wrong:
        raise Failed(f'no terminator in {", ".join(wrong)}')


@requirement('information-text', 'sends printable text in every identity string', MESSAGES,
             'COMPONENT_INFORMATION_BASIC')
async def text(tester: Tester) -> None:
    """Look for bytes that are not printable UTF-8."""
    message = await _information(tester)
    wrong = []
    for name in STRINGS:
        raw = getattr(message, name).partition(b'\0')[0]
        # The length limit may have cut the last character.
        shown = raw.decode('utf-8', errors='ignore')
        if not shown.isprintable() or len(raw) - len(shown.encode()) > 3:
            wrong.append(f'{name} {raw!r}')
    if wrong:
        raise Failed(', '.join(wrong))
