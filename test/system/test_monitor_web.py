# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""``monitor --web`` as a process, in a real browser."""

from __future__ import annotations

import asyncio
from collections.abc import Iterator
import contextlib
import os
from pathlib import Path
import re
import socket
import subprocess
import sys
import urllib.error
import urllib.request

import pytest

pytest.importorskip('textual_serve')

import aiohttp  # noqa: E402,I100
from support.browser import ENTER, IS_INSTALLED, running_browser  # noqa: E402
from support.ports import free_port  # noqa: E402
from support.processes import (  # noqa: E402
    ended,
    environment,
    is_running,
    Program,
    python,
    ROOT,
    run,
)
from support.ros import own_domain  # noqa: E402
from support.waiting import eventually, PATIENCE  # noqa: E402

MONITOR = 'illuminator_ros.monitor'
TABS = 2


@contextlib.contextmanager
def served(*options: str) -> Iterator[tuple[Program, str]]:
    """Serve browsers, beside a light; yield the server and its first URL."""
    port, web = free_port(), free_port()
    with own_domain() as domain, contextlib.ExitStack() as stack:
        env = {'ROS_DOMAIN_ID': str(domain)}
        for module, url in (('simulator', f'udpout://127.0.0.1:{port}'),
                            ('bridge', f'udpin://127.0.0.1:{port}')):
            stack.enter_context(ended(python(f'illuminator_ros.{module}', url, env=env)))
        # Not of the fork server: the monitor starts its command line again.
        server = stack.enter_context(ended(Program(
            sys.executable, '-m', MONITOR, '--web', f'127.0.0.1:{web}', *options, env=env)))
        yield server, urls(server, 1)[0]


def urls(server: Program, count: int) -> list[str]:
    """Wait until the server has printed so many URLs, and return them."""
    eventually(lambda: len(re.findall('http://', server.log)) >= count)
    return re.findall(r'http://\S+', server.log)


def status(url: str, **headers: str) -> int:
    """Return the status of the answer to a browser that has no cookies yet."""
    opener = urllib.request.build_opener(urllib.request.HTTPCookieProcessor())
    try:
        with opener.open(urllib.request.Request(url, headers=headers), timeout=PATIENCE) as answer:
            return int(answer.status)
    except urllib.error.HTTPError as error:
        return error.code


@pytest.mark.skipif(not IS_INSTALLED, reason='chromium and chromium-driver are not installed')
def test_page_operates_a_light_and_so_it_does_on_a_phone_for_the_bearer_of_the_token() -> None:
    with served('--token') as (server, url), running_browser() as browser:
        site = url.partition('?')[0]
        assert status(f'{site}?token=wrong') == 403
        browser.open(url)
        assert browser.run('return location.href') == site
        browser.wait_for('/illuminator')
        # Keys work without a click first.
        browser.press(' ')
        browser.wait_for('It can dazzle')
        browser.press(ENTER)
        browser.wait_for('1 light: 1 ON')
        assert browser.run(
            'return performance.getEntriesByType("resource").map(one => new URL(one.name).origin)'
            '.filter(origin => origin != location.origin)') == []

        # The token was used; the next one is for another browser.
        assert status(url) == 403
        _, look, following = urls(server, 3)
        assert status(following) == 200

        browser.click('0 off')
        browser.wait_for('1 light: 1 off')

        browser.cdp('Emulation.setDeviceMetricsOverride', width=390, height=844,
                    deviceScaleFactor=1, mobile=True)
        browser.cdp('Emulation.setTouchEmulationEnabled', enabled=True)
        browser.open(site)
        browser.wait_for('/illuminator')
        # No keyboard covers the buttons.
        assert browser.run('return document.querySelector("textarea").inputMode') == 'none'
        browser.click('on/off')
        browser.click('enter yes')
        browser.wait_for('1 light: 1 ON')
        browser.click('ALL OFF')
        browser.wait_for('ALL OFF: 1 of 1 confirmed')
        browser.wait_for('1 light: 1 off')
        assert browser.run('return document.documentElement.scrollWidth') <= 390
        # A finger that moves down scrolls up, as a wheel does.
        browser.swipe((100, 60), (100, 260))
        eventually(lambda: '[<64;' in browser.run('return window.sent'))
        columns = browser.run('return window.size.width')
        assert max(map(len, browser.lines)) <= columns

        browser.open(look)
        browser.wait_for('/illuminator')
        assert 'ALL OFF' not in browser.text
        browser.wait_for('to look only; 1 light')
        assert 'on/off' not in browser.text


def test_all_browsers_show_what_one_of_them_switches_and_each_has_a_process_that_ends() -> None:
    async def switch(server: Program, url: str) -> list[str]:
        async with aiohttp.ClientSession() as session:
            headers = {'Origin': url.rstrip('/')}
            tabs = [await session.ws_connect(f'{url}ws', headers=headers) for _ in range(TABS)]

            async def all_show(text: str) -> None:
                for tab in tabs:
                    while text not in (await tab.receive(PATIENCE)).data.decode():
                        pass

            await all_show('1 light: 1 off')
            await tabs[0].send_json(['stdin', ' '])
            while 'It can dazzle' not in (await tabs[0].receive(PATIENCE)).data.decode():
                pass
            await tabs[0].send_json(['stdin', '\r'])
            await all_show(': 1 ON')
            await tabs[0].send_json(['stdin', '0'])
            await all_show(': 1 off')
            await tabs.pop().close()
            while len(left := children(server)) == TABS:
                await asyncio.sleep(0)
            # It ends with the server, even if that is killed.
            server.kill()
            return left

    with served() as (server, url):
        left = asyncio.run(switch(server, url))
        assert len(left) == TABS - 1
        eventually(lambda: not any(map(is_running, left)))


def children(server: Program) -> list[str]:
    """Return the process ids of the tabs."""
    return Path(f'/proc/{server.pid}/task/{server.pid}/children').read_text().split()


def test_pages_are_served_while_nothing_reads_the_output_of_the_server() -> None:
    port = free_port()
    reading, writing = os.pipe()
    os.set_blocking(writing, False)
    with contextlib.suppress(BlockingIOError):
        while os.write(writing, b' ' * 4096):
            pass
    os.set_blocking(writing, True)
    with subprocess.Popen([sys.executable, '-m', MONITOR, '--web', f'127.0.0.1:{port}'],
                          stdout=writing, stderr=writing, env=environment(), cwd=ROOT) as server:
        try:
            eventually(lambda: answers(port))
            url = f'http://127.0.0.1:{port}/'
            assert status(url, Host='a[') == 400
            assert status(url) == 200
            server.terminate()
            assert server.wait(PATIENCE) == 0
        finally:
            server.kill()
            os.close(reading)
            os.close(writing)


def answers(port: int) -> bool:
    with contextlib.suppress(OSError):
        socket.create_connection(('127.0.0.1', port)).close()
        return True
    return False


def test_other_sites_and_names_are_refused() -> None:
    with served() as (_, url):
        assert status(url) == 200
        assert status(f'{url}static/css/xterm.css') == 200
        # A page of another site, a foreign name for this address, no page at all.
        assert status(url, Origin='http://evil.example') == 403
        assert status(url, Host='evil.example') == 403
        assert status(f'{url}ws') == 403


@pytest.mark.parametrize(('arguments', 'error', 'code'), [
    (('0.0.0.0:0',), '0.0.0.0 can be reached from other machines: add --token', 2),
    (('192.0.2.1:8000', '--token'),
     'cannot serve 192.0.2.1:8000: ', 1),
    (('8000',), 'argument --web: is not HOST:PORT; see monitor --help', 2)])
def test_address_that_cannot_be_served_is_refused_in_one_line(
    arguments: tuple[str, ...], error: str, code: int,
) -> None:
    outcome = run(MONITOR, '--web', *arguments)

    assert (outcome.returncode, outcome.stdout) == (code, '')
    assert outcome.stderr.splitlines()[-1].startswith(f'monitor: {error}')
