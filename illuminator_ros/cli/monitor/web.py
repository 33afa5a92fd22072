# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""
The monitor in a browser: textual-serve, behind checks of who asks.

Each tab is a process with this command line.
"""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Awaitable, Callable, Mapping
import contextlib
import functools
import hmac
import ipaddress
import logging
import math
from pathlib import Path
import secrets
import shlex
import sys
import time
from weakref import WeakKeyDictionary

from aiohttp import web
from textual_serve.server import Server

from ..entry_point import print_output, Refusal
from ..termination import Termination

# Each tab is a process.
MAX_TABS = 16
# Connections without an admitted request; the oldest gives way to a new one.
MAX_STRANGERS = 64
# s without a complete request until a connection is closed, and between two log lines.
IDLE_LIMIT, LOG_INTERVAL = 10.0, 60.0
MAX_LINE = 300
# The rights of browsers, named as the tokens in URLs, with the options of their tabs.
RIGHTS: dict[str, list[str]] = {'token': [], 'look': ['--look']}
# textual-serve's own page loads a font from another host, which a vehicle's network lacks.
PAGE = Path(__file__).with_name('page.html')
log = logging.getLogger(__name__)
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
    announced. There is one to operate devices, and one to look only. Other sites cannot use a
    browser that was admitted: a WebSocket must come from a page of the same host, and a server on
    loopback answers to names of loopback only.

    :param announce: takes the query of a URL with a token.
    :ivar rights: of connections with an admitted request.
    """

    def __init__(self, needs_token: bool, is_local: bool, announce: Complain) -> None:
        self._needs_token = needs_token
        self._is_local = is_local
        self._announce = announce
        # By right.
        self._tokens: dict[str, str] = {}
        self._cookies = {right: secrets.token_urlsafe(32) for right in RIGHTS}
        self._tabs = 0
        # Of the last admitted request of each connection.
        self.rights: WeakKeyDictionary[asyncio.BaseTransport, str] = WeakKeyDictionary()

    def open(self) -> None:  # noqa: A003
        """Announce a URL, or one with a token for each right."""
        for right in RIGHTS if self._needs_token else ():
            self._renew(right)
        if not self._needs_token:
            self._announce('')

    def _renew(self, right: str) -> None:
        self._tokens[right] = secrets.token_urlsafe(32)
        self._announce(f'?{right}={self._tokens[right]}')

    @web.middleware
    async def check(self, request: web.Request, handler: Handler) -> web.StreamResponse:
        """Refuse whom it does not admit."""
        is_socket = request.path == '/ws'
        try:
            right = self._admit(request, is_socket)
        except ValueError:
            raise _refusal(request, web.HTTPBadRequest(
                text='not an address, a cookie or a token')) from None
        if request.transport is not None:
            self.rights[request.transport] = right
        if is_socket and self._tabs >= MAX_TABS:
            raise _refusal(request, web.HTTPServiceUnavailable(text='too many tabs'))
        self._tabs += is_socket
        try:
            return await handler(request)
        finally:
            self._tabs -= is_socket

    def _admit(self, request: web.Request, is_socket: bool) -> str:
        """Return the right of a request."""
        origin = request.headers.get('Origin', '' if is_socket else f'//{request.host}')
        if origin.partition('//')[2] != request.host or self._is_local and not is_loopback(
                request.url.host or ''):
            raise _refusal(request, web.HTTPForbidden(text='not from this site'))
        # A host has one set of cookies for all of its ports.
        name = f'illuminator_monitor_{request.url.port}'
        if not self._needs_token:
            return next(iter(RIGHTS))
        for right, token in self._tokens.items():
            if _same(request.query.get(right, ''), token):
                self._renew(right)
                response = web.HTTPFound('/')
                response.set_cookie(name, self._cookies[right], httponly=True, samesite='Strict')
                raise response
        for right, cookie in self._cookies.items():
            if _same(request.cookies.get(name, ''), cookie):
                return right
        raise _refusal(request, web.HTTPForbidden(
            text='The token is wrong or was used. The monitor has printed the present one.'))

    def connect(self, server: web.Server) -> asyncio.Protocol:
        """Return the protocol of a new connection; drop strangers if there are too many."""
        transports = [one.transport for one in server.connections if one.transport is not None]
        strangers = [one for one in transports if one not in self.rights]
        for one in strangers[:max(len(strangers) + 1 - MAX_STRANGERS, 0)]:
            log.warning('too many connections')
            one.abort()
        return server()


class LineLog(logging.Handler):
    """
    Writes one line at most in each :data:`LOG_INTERVAL`, however much is logged.

    :param write: takes a line.
    :param clock: returns the time, s.
    """

    def __init__(self, write: Complain, clock: Callable[[], float] = time.monotonic) -> None:
        super().__init__()
        self._write = write
        self._clock = clock
        self._due, self._left_out = -math.inf, 0

    def emit(self, record: logging.LogRecord) -> None:
        """See :meth:`logging.Handler.emit`."""
        if self._clock() < self._due:
            self._left_out += 1
            return
        error = record.exc_info and record.exc_info[1]
        text = record.getMessage() + (f': {error}' if error else '')
        # Others choose a part of the text.
        self._write(text[:MAX_LINE].encode('unicode_escape').decode() + (
            f' ({self._left_out} more before)' if self._left_out else ''))
        self._due, self._left_out = self._clock() + LOG_INTERVAL, 0


def _refusal(request: web.Request, answer: web.HTTPException) -> web.HTTPException:
    """Return the answer that refuses a request and closes its connection, after logging it."""
    log.warning('%s: refused: %s', request.remote, answer.text)
    answer.force_close()
    return answer


def _same(one: str, other: str) -> bool:
    return hmac.compare_digest(one.encode(), other.encode())


async def _page(request: web.Request) -> web.StreamResponse:
    return web.FileResponse(PAGE)


@contextlib.asynccontextmanager
async def listening(
    host: str, port: int, gate: Gate, complain: Complain, commands: Mapping[str, str],
) -> AsyncIterator[None]:
    """
    Serve browsers.

    :param commands: what a tab runs, by the right of its browser.
    :raises OSError: if it cannot listen.
    """
    # The logs of all parts: aiohttp logs tracebacks of requests, asyncio each failed accept().
    lines = LineLog(complain)
    tabs = {right: Server(command) for right, command in commands.items()}

    async def socket(request: web.Request) -> web.WebSocketResponse:
        assert request.transport is not None
        return await tabs[gate.rights[request.transport]].handle_websocket(request)

    app = web.Application(middlewares=[gate.check])
    app.add_routes([web.get('/', _page), web.get('/ws', socket),
                    web.static('/static', tabs['token'].statics_path)])
    runner = web.AppRunner(app, access_log=None, keepalive_timeout=IDLE_LIMIT,
                           lingering_time=0.0)
    await runner.setup()
    assert runner.server is not None
    logging.getLogger().addHandler(lines)
    try:
        listener = await asyncio.get_running_loop().create_server(
            functools.partial(gate.connect, runner.server), host, port)
        yield
        listener.close()
    finally:
        await runner.cleanup()
        logging.getLogger().removeHandler(lines)


async def _serve(
    host: str, port: int, gate: Gate, termination: Termination, complain: Complain,
) -> None:
    ended = asyncio.Event()
    termination.calls(functools.partial(
        asyncio.get_running_loop().call_soon_threadsafe, ended.set))
    # A tab ends with the server, even if that is killed; setpriv is of util-linux.
    at = len(sys.orig_argv) - len(sys.argv[1:])
    commands = {right: 'exec setpriv --pdeathsig TERM ' + shlex.join(
        [*sys.orig_argv[:at], *option, *sys.orig_argv[at:]]) for right, option in RIGHTS.items()}
    async with listening(host, port, gate, complain, commands):
        gate.open()
        await ended.wait()


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
    # A terminal that is stopped must not stop the tabs.
    termination.queue_output(1, 2)
    try:
        asyncio.run(_serve(host, port, gate, termination, complain))
    except OSError as error:
        complain(f'cannot serve {host}:{port}: {error.strerror or error}')
        return 1
    return 0
