# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Ten browsers that show one light."""

from __future__ import annotations

import asyncio
from collections.abc import Iterator
import contextlib
from pathlib import Path
import time
from typing import Any

import aiohttp
from support.ports import free_port
from support.processes import start_interpreter

from ..rig import Bench, bridge, cpu, PATIENCE, ready, simulator, udp
from ..rows import at_most, quantiles, Row

TABS = 10
# ms from a key to the last of the browsers that shows its effect.
LIMIT = 200.0


async def shown(tab: Any, text: str) -> float:
    """Return when a tab gets a text."""
    while text not in (await tab.receive(PATIENCE)).data.decode():
        pass
    return time.monotonic()


async def switch(url: str, pid: int, rounds: int, idle: float) -> tuple[list[float], float]:
    """
    Switch the light by keys of the first browser.

    :param pid: of the server.
    :param idle: s without keys, in which the CPU time is measured.
    :return: the times until the last browser showed it, ms, and the CPU share of each, %.
    """
    took = []
    async with aiohttp.ClientSession() as session, contextlib.AsyncExitStack() as stack:
        tabs = [await stack.enter_async_context(session.ws_connect(
            f'{url}ws', headers={'Origin': url.rstrip('/')})) for _ in range(TABS)]

        async def all_show(text: str) -> float:
            return max(await asyncio.gather(*(shown(tab, text) for tab in tabs)))

        await all_show('1 light: 1 off')
        # The diagnostics are published once a second.
        await asyncio.sleep(2.0)
        for _ in range(rounds):
            for key, text in (('\r', ': 1 ON'), ('0', ': 1 off')):
                if key == '\r':
                    await tabs[0].send_json(['stdin', ' '])
                    await shown(tabs[0], 'It can dazzle')
                began = time.monotonic()
                await tabs[0].send_json(['stdin', key])
                took.append(1e3 * (await all_show(text) - began))
        children = Path(f'/proc/{pid}/task/{pid}/children').read_text().split()
        before = sum(cpu(int(child)) for child in children)
        await asyncio.sleep(idle)
        share = 100 * (sum(cpu(int(child)) for child in children) - before) / idle / TABS
    return took, share


def browsers(bench: Bench) -> Iterator[Row]:
    """Switch a light in one of ten browsers."""
    port, web = free_port(), free_port()
    with (simulator(port), bridge(udp(port)), ready(start_interpreter(
            'illuminator_ros.monitor', '--web', f'127.0.0.1:{web}'), 'http://') as server):
        took, share = asyncio.run(switch(f'http://127.0.0.1:{web}/', server.pid,
                                         bench.amount(50, 1), bench.amount(10.0, 0.2)))
    ours = quantiles(took)
    yield Row(f'a key in one of {TABS} browsers to the last of them that shows its effect', 'ms',
              ours, targets=[at_most(ours['p95'], LIMIT, 'ms p95')])
    yield Row('CPU for each of them, while nothing is asked', '%', {'': share})
