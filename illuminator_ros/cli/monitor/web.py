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

"""
The monitor in a browser: textual-serve, behind checks of who asks.

Each tab is a process with this command line.
"""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
import functools
import hmac
import ipaddress
from pathlib import Path
import secrets
import shlex
import sys

from aiohttp import web
from textual_serve.server import Server

from ..entry_point import print_output, Refusal
from ..termination import Termination

# Each tab is a process.
MAX_TABS = 16
# textual-serve's own page loads a font from another host, which a vehicle's network lacks.
PAGE = Path(__file__).with_name('page.html')
Complain = Callable[[str], object]
Handler = Callable[[web.Request], Awaitable[web.StreamResponse]]


def is_loopback(host: str) -> bool:
    """Return whether a host is this machine only."""
    try:
        return ipaddress.ip_address(host.strip('[]')).is_loopback
    except ValueError:
        return host == 'localhost'


class Gate:
    """
    Admits browsers.

    A token is valid once: it becomes a cookie of the browser that brings it, and the next token is
    announced. Other sites cannot use a browser that was admitted: a WebSocket must come from a
    page of the same host, and a server on loopback answers to names of loopback only.

    :param announce: takes the query of the URL with the next token.
    """

    def __init__(self, needs_token: bool, is_local: bool, announce: Complain) -> None:
        self._needs_token = needs_token
        self._is_local = is_local
        self._announce = announce
        self._token, self._cookie = '', secrets.token_urlsafe(32)
        self._tabs = 0

    def renew(self) -> None:
        """Announce a URL, with a new token if one is needed."""
        self._token = secrets.token_urlsafe(32)
        self._announce(f'?token={self._token}' if self._needs_token else '')

    @web.middleware
    async def check(self, request: web.Request, handler: Handler) -> web.StreamResponse:
        """Refuse whom it does not admit."""
        is_socket = request.path == '/ws'
        origin = request.headers.get('Origin', '' if is_socket else f'//{request.host}')
        if origin.partition('//')[2] != request.host or self._is_local and not is_loopback(
                request.url.host or ''):
            raise web.HTTPForbidden(text='not from this site')
        # A host has one set of cookies for all of its ports.
        name = f'illuminator_monitor_{request.url.port}'
        if self._needs_token and not _same(request.cookies.get(name, ''), self._cookie):
            if not _same(request.query.get('token', ''), self._token):
                raise web.HTTPForbidden(text='The token is wrong or was used. The monitor has '
                                             'printed the present one.')
            self.renew()
            response = web.HTTPFound('/')
            response.set_cookie(name, self._cookie, httponly=True, samesite='Strict')
            raise response
        if is_socket and self._tabs >= MAX_TABS:
            raise web.HTTPServiceUnavailable(text='too many tabs')
        self._tabs += is_socket
        try:
            return await handler(request)
        finally:
            self._tabs -= is_socket


def _same(one: str, other: str) -> bool:
    return hmac.compare_digest(one.encode(), other.encode())


async def _page(request: web.Request) -> web.StreamResponse:
    return web.FileResponse(PAGE)


async def _serve(host: str, port: int, gate: Gate, termination: Termination) -> None:
    ended = asyncio.Event()
    termination.calls(functools.partial(
        asyncio.get_running_loop().call_soon_threadsafe, ended.set))
    # A tab ends with the server, even if that is killed; setpriv is of util-linux.
    server = Server(f'exec setpriv --pdeathsig TERM {shlex.join(sys.orig_argv)}')
    app = web.Application(middlewares=[gate.check])
    app.add_routes([web.get('/', _page), web.get('/ws', server.handle_websocket),
                    web.static('/static', server.statics_path)])
    runner = web.AppRunner(app, access_log=None)
    await runner.setup()
    await web.TCPSite(runner, host, port).start()
    gate.renew()
    await ended.wait()
    await runner.cleanup()


def serve(
    address: tuple[str, int], needs_token: bool, termination: Termination, complain: Complain,
) -> int:
    """
    Serve browsers until a signal; return the exit status.

    :raises Refusal: if others could reach it without a token.
    """
    host, port = address
    if not (needs_token or is_loopback(host)):
        raise Refusal(f'{host} can be reached from other machines: add --token')
    url = f'http://{f"[{host}]" if ":" in host else host}:{port}/'
    gate = Gate(needs_token, is_loopback(host), lambda query: print_output(complain, url + query))
    try:
        asyncio.run(_serve(host, port, gate, termination))
    except OSError as error:
        complain(f'cannot serve {host}:{port}: {error.strerror or error}')
        return 1
    return 0
