# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Chromium without a display, driven over WebDriver, with the screen of a terminal in a page."""

from __future__ import annotations

from collections.abc import Iterator
import contextlib
import functools
import json
import re
import shutil
import subprocess
from typing import Any
import urllib.error
import urllib.request

from support.ports import free_port
from support.waiting import eventually, PATIENCE

IS_INSTALLED = all(map(shutil.which, ('chromium', 'chromedriver')))
ARGUMENTS = ('--headless', '--no-sandbox', '--disable-gpu', '--disable-quic', '--no-first-run',
             '--disable-background-networking', '--disable-component-update', '--disable-sync',
             '--disable-dev-shm-usage')
# Records what the page receives over its WebSocket, since a canvas has no text.
# The key, as WebDriver names it.
ENTER = '\ue007'
RECORDER = """
window.received = window.sent = ''; let last = Promise.resolve();
window.WebSocket = class extends WebSocket {
  constructor(url) {
    super(url);
    const size = new URL(url).searchParams;
    window.size = {width: +size.get('width'), height: +size.get('height')};
    this.addEventListener('message', event => { last = last.then(async () => {
      if (typeof event.data !== 'string')
        window.received += new TextDecoder().decode(
          event.data instanceof Blob ? await event.data.arrayBuffer() : event.data);
    }); });
  }
  send(data) {
    if (data.startsWith('["resize"')) window.size = JSON.parse(data)[1];
    window.sent += data;
    super.send(data);
  }
};
"""
# Waits in the page until it has received more than so many characters.
GROWN = f"""
const [length, done] = arguments, end = Date.now() + {PATIENCE * 1e3 - 1e3};
const look = () => (window.received || '').length > length ? done(true)
  : Date.now() > end ? done(false) : setTimeout(look, 20);
look();
"""
_TOKEN = re.compile('\x1b\\[(\\d*);?(\\d*)H|\x1b][^\x1b\x07]*(?:\x1b\\\\|\x07)|'
                    '\x1b\\[[^@-~]*[@-~]|\x1b.|[^\x1b]', re.DOTALL)


@functools.lru_cache(maxsize=1)
def screen(output: str) -> list[str]:
    """Return the lines that a terminal shows after this output."""
    cells: dict[tuple[int, int], str] = {}
    row = column = 0
    for token in _TOKEN.finditer(output):
        if token[1] is not None:
            row, column = int(token[1] or 1) - 1, int(token[2] or 1) - 1
        elif token[0] == '\n':
            row += 1
        elif token[0] == '\r':
            column = 0
        elif len(token[0]) == 1:
            cells[row, column] = token[0]
            column += 1
    ends: dict[int, int] = {}
    for row, column in cells:
        ends[row] = max(ends.get(row, 0), column + 1)
    return [''.join(cells.get((row, column), ' ') for column in range(ends.get(row, 0)))
            for row in range(max(ends, default=-1) + 1)]


class Browser:
    """A session with one browser, in which cookies last."""

    def __init__(self, url: str) -> None:
        self._url = url
        session = self._call('POST', '/session', {'capabilities': {'alwaysMatch': {
            'goog:chromeOptions': {'args': list(ARGUMENTS)}}}})
        self._url += f'/session/{session["sessionId"]}'

    def _call(self, method: str, path: str, body: object = None) -> Any:
        request = urllib.request.Request(
            self._url + path, None if body is None else json.dumps(body).encode(),
            {'Content-Type': 'application/json'}, method=method)
        try:
            with urllib.request.urlopen(request, timeout=PATIENCE) as answer:
                return json.load(answer)['value']
        except urllib.error.HTTPError as error:
            raise AssertionError(error.read().decode()[:1000]) from error

    def cdp(self, command: str, **parameters: object) -> None:
        """Execute a command of the DevTools protocol."""
        self._call('POST', '/goog/cdp/execute', {'cmd': command, 'params': parameters})

    def run(self, script: str) -> Any:
        """Run a script in the page and return its value."""
        return self._call('POST', '/execute/sync', {'script': script, 'args': []})

    def open(self, url: str) -> None:  # noqa: A003
        """Open a page in this tab."""
        self.cdp('Page.addScriptToEvaluateOnNewDocument', source=RECORDER)
        self._call('POST', '/url', {'url': url})

    def press(self, *keys: str) -> None:
        """Press keys, which go to the part of the page that has the focus."""
        self._call('POST', '/actions', {'actions': [{
            'type': 'key', 'id': 'keyboard', 'actions': [
                {'type': kind, 'value': key} for key in keys for kind in ('keyDown', 'keyUp')]}]})

    @property
    def text(self) -> str:
        """Return what the terminal in the page shows, with single spaces."""
        return ' '.join(' '.join(self.lines).split())

    @property
    def lines(self) -> list[str]:
        """Return the lines of the terminal in the page."""
        return screen(self._received())

    def wait_for(self, text: str) -> None:
        """Wait until the terminal shows a text."""
        while text not in ' '.join(' '.join(screen(received := self._received())).split()):
            assert self._call('POST', '/execute/async', {
                'script': GROWN, 'args': [len(received.encode('utf-16-le')) // 2]}), (
                    f'{text!r} is not on the page: {self.text}')

    def _received(self) -> str:
        """Return all output that the page has received."""
        return str(self.run('return window.received || ""'))

    def _place(self, label: str) -> tuple[int, int]:
        """Return row and column of a text."""
        return next((y, line.index(label)) for y, line in enumerate(self.lines) if label in line)

    def click(self, label: str) -> None:
        """Click a text in the terminal, as a finger or a mouse does."""
        self.wait_for(label)
        places: list[tuple[int, int]] = []
        # A new label is drawn before its button has moved.
        while len(places) < 5 or len({*places[-5:]}) > 1:
            places.append(self._place(label))
        row, column = places[-1]
        left, top, width, height = self.run(
            'const box = document.querySelector(".xterm-screen").getBoundingClientRect();'
            'const {width, height} = window.size;'
            'return [box.left, box.top, box.width / width, box.height / height]')
        place = {'x': round(left + (column + 1.5) * width),
                 'y': round(top + (row + 0.5) * height)}
        self._call('POST', '/actions', {'actions': [{
            'type': 'pointer', 'id': 'mouse', 'actions': [
                {'type': 'pointerMove', 'duration': 0, **place},
                {'type': 'pointerDown', 'button': 0}, {'type': 'pointerUp', 'button': 0}]}]})

    def swipe(self, start: tuple[int, int], end: tuple[int, int]) -> None:
        """Move a finger over the page, between places in pixels."""
        (x, y), (end_x, end_y) = start, end
        self._call('POST', '/actions', {'actions': [{
            'type': 'pointer', 'id': 'finger', 'parameters': {'pointerType': 'touch'}, 'actions': [
                {'type': 'pointerMove', 'duration': 0, 'x': x, 'y': y},
                {'type': 'pointerDown', 'button': 0},
                {'type': 'pointerMove', 'duration': 200, 'x': end_x, 'y': end_y},
                {'type': 'pointerUp', 'button': 0}]}]})

    def close(self) -> None:
        """End the session."""
        self._call('DELETE', '')


@contextlib.contextmanager
def running_browser() -> Iterator[Browser]:
    """Run Chromium."""
    port = free_port()
    with subprocess.Popen(['chromedriver', f'--port={port}'], stdout=subprocess.DEVNULL,
                          stderr=subprocess.DEVNULL) as driver:
        try:
            url = f'http://127.0.0.1:{port}'

            def answers() -> bool:
                with contextlib.suppress(OSError):
                    urllib.request.urlopen(f'{url}/status', timeout=PATIENCE).close()
                    return True
                return False

            eventually(answers)
            with contextlib.closing(Browser(url)) as browser:
                yield browser
        finally:
            driver.terminate()
