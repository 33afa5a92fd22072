# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The server for browsers against clients without a credential."""

import asyncio
from collections.abc import Awaitable, Callable
import contextlib
import logging
import re

import pytest

pytest.importorskip('textual_serve')

from illuminator_ros.cli.monitor import web  # noqa: E402,I100
from support.ports import free_port  # noqa: E402

Connection = tuple[asyncio.StreamReader, asyncio.StreamWriter]


class Served:
    """A server that needs a token, with the lines that it logs."""

    def __init__(self, port: int) -> None:
        self.port = port
        self.lines: list[str] = []
        self.queries: list[str] = []
        self.opened: list[asyncio.StreamWriter] = []

    async def connect(self, data: bytes = b'') -> Connection:
        """Return a connection, after it has sent something."""
        reader, writer = await asyncio.open_connection('127.0.0.1', self.port)
        self.opened.append(writer)
        writer.write(data)
        return reader, writer

    def request(self, *headers: str, path: str = '/') -> bytes:
        """Return a request, for this server unless it names another host."""
        lines = [f'GET {path} HTTP/1.1', *headers, '', '']
        if not any(one.startswith('Host:') for one in headers):
            lines.insert(1, f'Host: 127.0.0.1:{self.port}')
        return '\r\n'.join(lines).encode('latin-1')

    async def answer(self, *headers: str, path: str = '/') -> int:
        """Return the status of the answer to a request."""
        reader, _ = await self.connect(self.request(*headers, path=path))
        return int((await reader.readline()).split()[1])


def serve(test: Callable[[Served], Awaitable[None]]) -> Served:
    """Serve while a test runs."""
    served = Served(free_port())

    async def run() -> None:
        gate = web.Gate(True, True, served.queries.append)
        gate.open()
        async with web.listening('127.0.0.1', served.port, gate, served.lines.append,
                                 dict.fromkeys(web.RIGHTS, 'false')):
            try:
                await test(served)
            finally:
                for writer in served.opened:
                    writer.close()

    asyncio.run(run())
    return served


@pytest.mark.parametrize('headers', [
    ['Host: a['], ['Host: 127.0.0.1:99999999'], ['Host: '],
    ['Cookie: illuminator_monitor_{port}=\xff\xfe'], ['Cookie: =;;\xe4=\x7f']])
def test_request_that_cannot_be_read_is_refused_in_one_line(headers: list[str]) -> None:
    async def test(served: Served) -> None:
        shown = [one.format(port=served.port) for one in headers]
        assert await served.answer(*shown) in (400, 403)
        assert await served.answer(*shown) in (400, 403)
        assert await served.answer(path=f'/{served.queries[-1]}') == 302

    [line] = serve(test).lines
    assert '\n' not in line


def test_token_is_valid_once_and_gives_its_right_only() -> None:
    async def test(served: Served) -> None:
        operate, look = served.queries
        assert (operate[:7], look[:6]) == ('?token=', '?look=')
        assert await served.answer(path=f'/?look={operate[7:]}') == 403
        assert await served.answer(path=f'/{look}') == 302
        assert await served.answer(path=f'/{look}') == 403
        assert await served.answer(path=f'/{operate}') == 302
        assert [one.partition('=')[0] for one in served.queries[2:]] == ['?look', '?token']

    serve(test)


def test_unreadable_bytes_of_many_clients_are_one_line() -> None:
    async def test(served: Served) -> None:
        for data in (b'\0\xff\r\n\r\n', b'GET / HTTP/1.1\r\nHost: a\r\n b\xff: \0\r\n\r\n',
                     b'G' * 100_000 + b'\r\n\r\n',
                     b'POST / HTTP/1.1\r\nContent-Length: x\r\n\r\n'):
            reader, _ = await served.connect(data)
            with contextlib.suppress(ConnectionError):
                await reader.read()

    [line] = serve(test).lines
    assert len(line) <= 2 * web.MAX_LINE


@pytest.mark.parametrize('data', [b'', b'GET / HTTP/1.1\r\nHost: a', b'POST / HTTP/1.1\r\n'
                                  b'Host: 127.0.0.1\r\nContent-Length: 9\r\n\r\n'])
def test_connection_without_a_complete_request_is_closed(
    data: bytes, monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(web, 'IDLE_LIMIT', 0.02)

    async def test(served: Served) -> None:
        reader, _ = await served.connect(data)
        await reader.read()

    serve(test)


def test_oldest_of_too_many_connections_without_a_credential_gives_way() -> None:
    async def test(served: Served) -> None:
        admission, _ = await served.connect(
            served.request('Connection: close', path=f'/{served.queries[-1]}'))
        [cookie] = re.findall('Set-Cookie: (.*?);', (await admission.read()).decode())
        page = served.request(f'Cookie: {cookie}')
        admitted, writer = await served.connect(page)
        assert b' 200 ' in await admitted.readline()

        others = [await served.connect() for _ in range(3 * web.MAX_STRANGERS)]
        assert await served.answer(path=f'/{served.queries[-1]}') == 302
        ended = [reader for reader, _ in others if reader.at_eof() or reader.exception()]
        assert len(ended) >= 2 * web.MAX_STRANGERS

        writer.write(page)
        await admitted.readuntil(b'</html>')
        assert b' 200 ' in await admitted.readuntil(b'</html>')

    assert serve(test).lines == ['too many connections']


def test_log_is_one_line_in_each_interval_with_the_number_of_those_left_out() -> None:
    lines: list[str] = []
    times = [0.0]
    handler = web.LineLog(lines.append, lambda: times[-1])

    for number in range(3):
        handler.emit(logging.makeLogRecord({'msg': f'refused {number}\r\n\x1b'}))
    for number in range(1, 3):
        times.append(number * web.LOG_INTERVAL)
        handler.emit(logging.makeLogRecord({'msg': 'refused again'}))

    assert lines == [
        'refused 0\\r\\n\\x1b', 'refused again (2 more before)', 'refused again']
