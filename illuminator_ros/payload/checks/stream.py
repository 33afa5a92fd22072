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

"""Requirements on the stream of a payload's status message and on its interval."""

from __future__ import annotations

import math

from .requirement import (
    Failed,
    median,
    MESSAGES,
    periods,
    Requirement,
    requirement,
    Skipped,
    Specification,
    Tester,
)
from .session import Session
from .transaction import Transaction
from ...mavlink.messages import MavCmd, Message

# s
REQUEST_TIMEOUT = 3.0
INTERVAL = 0.25
WATCH_TIME = 2.5
DEFAULT_TIMEOUT = 5.0
MESSAGE_INTERVAL = 'MAV_CMD_SET_MESSAGE_INTERVAL'


def stream_requirements(
    status: type[Message], specification: Specification, stream: str, request: str,
) -> tuple[Requirement[Tester], Requirement[Tester]]:
    """
    Return the requirements ``status-stream`` and ``status-request``.

    :param stream: section of the specification that requires the stream.
    :param request: section that requires the answer to a request.
    """
    @requirement('status-stream', f'sends {status.msgname} at a regular rate', specification,
                 stream)
    async def regular(tester: Tester) -> str:
        times = periods([at for at, _ in tester.session.idle(status)])
        if not times:
            raise Failed('it sends at most one without a request')
        if max(times) > 2 * median(times) + 0.1:
            raise Failed(f'irregular: intervals of {min(times):.2f} to {max(times):.2f} s')
        return f'every {median(times):.2f} s'

    @requirement('status-request', f'sends {status.msgname} on request', specification, request)
    async def on_request(tester: Tester) -> None:
        session = tester.session
        before = session.received(status).count
        one = await session.command(MavCmd.REQUEST_MESSAGE, status.id)
        if not one.accepted:
            raise Failed(one.answer)
        if not await session.runner.until(
                lambda: session.received(status).count > before, REQUEST_TIMEOUT):
            raise Failed(f'MAV_RESULT_ACCEPTED, but no {status.msgname}')

    return regular, on_request


def interval_requirements(status: type[Message]) -> tuple[Requirement[Tester], ...]:
    """Return the requirements ``interval``, ``interval-stop`` and ``interval-default``."""
    @requirement('interval', f'sends {status.msgname} at the requested interval', MESSAGES,
                 MESSAGE_INTERVAL, changes=True)
    async def honoured(tester: Tester) -> str:
        await _accepted(tester.session, status, INTERVAL * 1e6)
        # No device has this default.
        times = periods([at for at, _ in await tester.session.receive_more(
            status, WATCH_TIME, round(10 * WATCH_TIME / INTERVAL))])
        if not times:
            raise Failed(f'{INTERVAL:g} s was accepted, but at most one message was received '
                         f'in {WATCH_TIME:g} s')
        if not 0.6 * INTERVAL < median(times) < 1.6 * INTERVAL:
            raise Failed(f'{INTERVAL:g} s was accepted, but the interval is '
                         f'{median(times):.2f} s')
        return f'requested {INTERVAL:g} s, received every {median(times):.2f} s'

    @requirement('interval-stop', 'stops the stream on interval -1', MESSAGES, MESSAGE_INTERVAL,
                 changes=True)
    async def stopped(tester: Tester) -> None:
        await _accepted(tester.session, status, -1)
        # A message may be under way.
        await tester.session.runner.sleep(0.3)
        before = tester.session.received(status).count
        await tester.session.runner.sleep(WATCH_TIME)
        if count := tester.session.received(status).count - before:
            raise Failed(f'-1 was accepted, but messages were received in {WATCH_TIME:g} s: '
                         f'{count}')

    @requirement('interval-default', 'returns to its default rate on interval 0', MESSAGES,
                 MESSAGE_INTERVAL, changes=True)
    async def default(tester: Tester) -> None:
        await _accepted(tester.session, status, 0)
        if len(await tester.session.receive_more(status, DEFAULT_TIMEOUT, 2)) >= 2:
            return
        if not tester.session.idle(status):
            raise Skipped('no message was received, and none before the first command')
        raise Failed(f'0 was accepted, but at most one message was received in '
                     f'{DEFAULT_TIMEOUT:g} s')

    return honoured, stopped, default


async def _accepted(session: Session, status: type[Message], interval: float) -> None:
    one = await _set_interval(session, status, interval)
    if not one.accepted:
        raise Failed(f'{one.text}: {one.answer}')


async def _set_interval(session: Session, status: type[Message], interval: float) -> Transaction:
    return await session.command(MavCmd.SET_MESSAGE_INTERVAL, status.id, interval)


async def restore_stream(session: Session, status: type[Message]) -> None:
    """Restore the interval that the status had before the first command."""
    before = periods([at for at, _ in session.idle(status)])
    if not before:
        await _set_interval(session, status, -1)
        return
    period = median(before)
    await _set_interval(session, status, 0)
    times = periods(
        [at for at, _ in await session.receive_more(status, 3.5 * period + 0.5, 3)])
    if not times or not math.isclose(median(times), period, rel_tol=0.25, abs_tol=0.02):
        await _set_interval(session, status, round(period, 3) * 1e6)
