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

from functools import partial
import math

from . import requirement as base
from .requirement import Failed, median, MESSAGES, periods, Requirement, requirement
from .session import Session
from ...mavlink.messages import MavCmd, Message

# s
REQUEST_TIMEOUT = 3.0
INTERVAL = 0.25
WATCH_TIME = 2.5
DEFAULT_TIMEOUT = 5.0
MESSAGE_INTERVAL = 'MAV_CMD_SET_MESSAGE_INTERVAL'


def stream_requirements(
    status: type[Message], specification: base.Specification, stream: str, request: str,
) -> tuple[Requirement[base.Tester], Requirement[base.Tester]]:
    """
    Return the requirements ``status-stream`` and ``status-request``.

    :param stream: section of the specification that requires the stream.
    :param request: section that requires the answer to a request.
    """
    @requirement('status-stream', f'sends {status.name} at a regular rate', specification,
                 stream)
    async def regular(tester: base.Tester) -> str:
        times = periods([at for at, _ in tester.session.idle(status)])
        if not times:
            raise Failed('it sends at most one without a request')
        if max(times) > 2 * median(times) + 0.1:
            raise Failed(f'irregular: intervals of {min(times):.2f} to {max(times):.2f} s')
        return f'every {median(times):.2f} s'

    @requirement('status-request', f'sends {status.name} on request', specification, request)
    async def on_request(tester: base.Tester) -> None:
        session = tester.session
        before = session.received(status).count
        one = await session.command(MavCmd.REQUEST_MESSAGE, status.id)
        if not one.accepted:
            raise Failed(one.answer)
        if not await session.runner.until(
                lambda: session.received(status).count > before, REQUEST_TIMEOUT):
            raise Failed(f'MAV_RESULT_ACCEPTED, but no {status.name}')

    return regular, on_request


def interval_requirements(status: type[Message]) -> tuple[Requirement[base.Tester], ...]:
    """Return the requirements ``interval``, ``interval-stop`` and ``interval-default``."""
    @requirement('interval', f'sends {status.name} at the requested interval', MESSAGES,
                 MESSAGE_INTERVAL, changes=True)
    async def honoured(tester: base.Tester) -> str:
        await _accepted(tester.session, status, INTERVAL * 1e6)
        # No device has this default.
        times = periods([at for at, _ in await tester.session.receive_more(
            status, WATCH_TIME, round(10 * WATCH_TIME / INTERVAL))])
        if not times:
            raise Failed(f'accepted, but at most one was received in {WATCH_TIME:g} s')
        text = f'requested {INTERVAL:g} s, received every {median(times):.2f} s'
        if not 0.6 * INTERVAL < median(times) < 1.6 * INTERVAL:
            raise Failed(text)
        return text

    @requirement('interval-stop', 'stops the stream on interval -1', MESSAGES, MESSAGE_INTERVAL,
                 changes=True)
    async def stopped(tester: base.Tester) -> None:
        await _accepted(tester.session, status, -1)
        # A message may be under way.
        await tester.session.runner.sleep(0.3)
        before = tester.session.received(status).count
        await tester.session.runner.sleep(WATCH_TIME)
        if count := tester.session.received(status).count - before:
            raise Failed(f'accepted, but still received in {WATCH_TIME:g} s: {count}')

    @requirement('interval-default', 'returns to its default rate on interval 0', MESSAGES,
                 MESSAGE_INTERVAL, changes=True)
    async def default(tester: base.Tester) -> None:
        await _accepted(tester.session, status, 0)
        if len(await tester.session.receive_more(status, DEFAULT_TIMEOUT, 2)) >= 2:
            return
        if not tester.session.idle(status):
            raise base.Skipped('none was received, before the first command either')
        raise Failed(f'accepted, but at most one was received in {DEFAULT_TIMEOUT:g} s')

    return honoured, stopped, default


async def _accepted(session: Session, status: type[Message], interval: float) -> None:
    one = await session.command(MavCmd.SET_MESSAGE_INTERVAL, status.id, interval)
    if not one.accepted:
        raise Failed(f'{one.text}: {one.answer}')


async def restore_stream(session: Session, status: type[Message]) -> None:
    """Restore the interval that the status had before the first command."""
    set_interval = partial(session.command, MavCmd.SET_MESSAGE_INTERVAL, status.id)
    before = periods([at for at, _ in session.idle(status)])
    if not before:
        await set_interval(-1)
        return
    period = median(before)
    await set_interval(0)
    times = periods([at for at, _ in await session.receive_more(status, 3.5 * period + 0.5, 3)])
    if not times or not math.isclose(median(times), period, rel_tol=0.25, abs_tol=0.02):
        await set_interval(round(period, 3) * 1e6)
