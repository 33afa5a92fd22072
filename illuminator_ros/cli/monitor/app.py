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

"""The screen: the list of devices, the details of one, and its keys as labels to click."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
import functools
import os
import textwrap
from typing import ClassVar, NamedTuple

from textual import events
from textual.app import App, ComposeResult
from textual.binding import Binding, BindingType
from textual.content import Content
from textual.style import Style
from textual.widgets import Static

from .ros_graph import Graph, GraphDevice
from .table import by_kind, counts, last, level, off_report, report, state
from ...ros.monitor_view import age, Cell, Device, FAILED, Key, LEVELS, Line, Request

# s between updates of the screen, and between looks for answers to requests.
INTERVAL, ANSWER_INTERVAL = 0.25, 0.05
# s without a key after which a question is dropped; characters that the operator may type.
QUESTION_LIFETIME, MAX_TYPED = 15.0, 100
NORMAL, HELP, STEERING = 'normal', 'help', 'steering'
NO_DEVICES = 'no devices in this ROS graph yet; is a bridge running, with this ROS_DOMAIN_ID?'
MOVES = {'up': -1, 'k': -1, 'down': 1, 'j': 1, 'pageup': -10, 'pagedown': 10,
         'home': -10**6, 'end': 10**6}
# Keys, text, label in the bar or '', and action, in the order of the help.
COMMON_KEYS: tuple[tuple[tuple[str, ...], str, str, str], ...] = (
    (tuple(MOVES), 'select a device, as a click on it does', '', 'move'),
    (('m',), 'move a gimbal with the arrow keys; any other key ends that', '', 'steer'),
    (('enter',), 'yes, where a request asks first; escape is no', '', ''),
    (('a',), 'ALL lights off, and again where one does not confirm', '', 'all off'),
    (('c',), 'clear devices that are gone', '', 'clear'),
    (('?', 'h'), 'this help', 'help', 'help'),
    (('q', 'ctrl+c', 'ctrl+d', 'ctrl+backslash'), 'quit', 'quit', 'quit'),
    (('ctrl+z',), 'stop; fg continues', '', 'stop'))
ACTIONS = {key: action for keys, _, _, action in COMMON_KEYS for key in keys}
# For terminals that show ASCII only; other characters become question marks.
ASCII = str.maketrans('█░─┼…←→↑↓▁▂▃▄▅▆▇', '#--|~<>^v_.-=+*%')


class Question(NamedTuple):
    """
    A question to the operator.

    :param answer: returns the request for the typed text, or why there is none, for people.
    :param typed: the text, None where the operator types nothing.
    :param deadline: when it is dropped, s.
    """

    text: str
    answer: Callable[[str], Request | str]
    typed: str | None
    deadline: float

    def edited(self, key: str) -> str | None:
        """Return the typed text after a key."""
        if self.typed is None or key == 'backspace':
            return self.typed and self.typed[:-1]
        return self.typed + (' ' if key == 'space' else key * (len(key) == 1))


class MonitorApp(App[None], inherit_bindings=False):
    """The monitor on a terminal or in a browser."""

    CSS_PATH = 'monitor.tcss'
    ENABLE_COMMAND_PALETTE = ALLOW_SELECT = False
    # Textual has other uses for these.
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding(key, f'press("{key}")', priority=True) for key in ('ctrl+c', 'escape', 'tab')]

    def __init__(self, graph: Graph, *, ascii_only: bool = False) -> None:
        # Without colours textual draws shades of grey, unless colours are those of the terminal.
        super().__init__(ansi_color=True if 'NO_COLOR' in os.environ else None)
        self._graph = graph
        self._ascii_only = ascii_only
        self._selected: GraphDevice | None = None
        self._at = 0
        self._mode: str | Question = NORMAL
        self._lines: list[GraphDevice | Cell] = []
        # Held here, since a poll may come before they are on the screen.
        self._parts = {name: Static(id=name) for name in ('devices', 'details', 'bar')}
        self._shown: dict[str, Content] = {}

    def restore(self) -> None:
        """Restore the terminal in a hurry; called in another thread if the end hangs."""

    def compose(self) -> ComposeResult:
        """See :meth:`App.compose`."""
        yield from self._parts.values()

    def on_mount(self) -> None:
        """Begin to poll."""
        self.set_interval(INTERVAL, self.poll)
        self.set_interval(ANSWER_INTERVAL, self._graph.poll_answers)
        self.call_after_refresh(self.poll)

    def poll(self) -> None:
        """Take new values, and draw them."""
        self._graph.poll()
        if isinstance(self._mode, Question) and self._graph.clock() > self._mode.deadline:
            self._mode = NORMAL
        self.draw()

    def on_key(self, event: events.Key) -> None:
        """Act on a key."""
        shown = event.character or ''
        self.action_press(shown if shown.isprintable() and shown > ' ' else event.key)

    def on_paste(self, event: events.Paste) -> None:
        """Take text while the operator types."""
        if isinstance(self._mode, Question) and self._mode.typed is not None:
            self._ask(self._mode.text, self._mode.answer, self._mode.typed + event.text)
        self.draw()

    def on_click(self, event: events.Click) -> None:
        """Select the device of a line; the list begins at the top."""
        for line in self._lines[event.screen_y:event.screen_y + 1]:
            if isinstance(line, Device) and self._mode != HELP:
                self._select(line)
        self.draw()

    def action_press(self, key: str) -> None:
        """Act on a key, or on a click on its label."""
        device, action = self._selected, ACTIONS.get(key)
        mode, self._mode = self._mode, NORMAL
        if action == 'quit':
            self.exit()
        elif action == 'all off':
            # The help names this key, and it acts there and while the operator types, too.
            self._graph.all_off()
        elif isinstance(mode, Question) and device is not None:
            if key == 'enter':
                self._request(device, mode.text, mode.answer(mode.typed or ''), is_confirmed=True)
            elif key != 'escape':
                self._ask(mode.text, mode.answer, mode.edited(key))
        elif action == 'help' and mode != HELP:
            self._mode = HELP
        elif action == 'stop':
            self.action_suspend_process()
        elif mode != HELP and device is not None:
            self._press(device, key, action, device.view.steering if mode == STEERING else ())
        self.draw()

    def _press(
        self, device: GraphDevice, key: str, action: str | None, steering: Sequence[Key],
    ) -> None:
        chosen = next((one for one in (*steering, *device.view.keys) if key in one.keys), None)
        if chosen in steering or action == 'steer' and device.view.steering:
            self._mode = STEERING
        if chosen is not None:
            make = functools.partial(chosen.request, device)
            if chosen.prompt:
                self._ask(chosen.prompt, make, '')
            else:
                self._request(device, chosen.label, make(''))
        elif action == 'clear':
            self._graph.clear_gone()
        elif action == 'move':
            devices = self._devices
            at = min(max(devices.index(device) + MOVES[key], 0), len(devices) - 1)
            self._select(devices[at])

    def _request(
        self, device: GraphDevice, label: str, request: Request | str, is_confirmed: bool = False,
    ) -> None:
        if isinstance(request, str):
            device.note(label, FAILED, request)
        elif request.question and not is_confirmed:
            self._ask(request.question, lambda _: request)
        else:
            device.submit(request)

    def _ask(
        self, text: str, answer: Callable[[str], Request | str], typed: str | None = None,
    ) -> None:
        self._mode = Question(text, answer, typed and typed[:MAX_TYPED],
                              self._graph.clock() + QUESTION_LIFETIME)

    def _select(self, device: GraphDevice | None) -> None:
        if device is not self._selected:
            # A question belongs to the other device.
            self._selected, self._mode = device, HELP if self._mode == HELP else NORMAL

    @property
    def _devices(self) -> list[GraphDevice]:
        """Return the devices in the order of attention."""
        return sorted(self._graph.devices, key=lambda device: device.attention)

    def draw(self) -> None:
        """Draw what has changed."""
        devices, device = self._devices, self._selected
        if device not in devices:
            self._select(devices[min(self._at, len(devices) - 1)] if devices else None)
        self._at = 0 if self._selected is None else devices.index(self._selected)
        self._parts['details'].display = self.size.height >= 12
        self._show('devices', self._help() if self._mode == HELP else self._list())
        self._show('details', Content('\n').join(
            Content.assemble((f'{label:8}', 'bold'), *cells) for label, cells in (
                () if self._selected is None or self._mode == HELP else
                _details(self._selected))))
        self._show('bar', Content('  ').join(self._labels()))

    def _show(self, name: str, content: Content) -> None:
        if self._ascii_only:
            shown = content.plain.translate(ASCII).encode('ascii', 'replace').decode()
            content = Content(shown, [*content.spans])
        if name not in self._shown or not content.is_same(self._shown[name]):
            self._shown[name] = content
            self._parts[name].update(content, layout=name != 'devices')

    def _list(self) -> Content:
        width, height = self._parts['devices'].size
        devices = self._devices
        lines: list[GraphDevice | Cell] = []
        if answers := self._graph.off_answers:
            text = Content.assemble(*off_report(answers)).plain
            lines += [(one, 'bold') for one in textwrap.wrap(text, max(width, 20))[:4]]
        if devices:
            name_width = max(min(max(len(one.name) for one in devices), width // 4), 8)
            lines += [('; '.join(map(counts, by_kind(self._graph.devices))), 'bold'),
                      (f'{"DEVICE":{name_width}} STATE  LEVEL  REPORT', 'bold dim')]
        first = len(lines)
        shown = max(height - first, 1)
        top = max(0, min(self._at - shown // 2, len(devices) - shown))
        lines += devices[top:top + shown]
        self._lines = lines[max(len(lines) - height, 0):] or [NO_DEVICES]
        return Content('\n').join(
            self._row(one, name_width) if isinstance(one, Device) else Content.assemble(one)
            for one in self._lines)

    def _row(self, device: GraphDevice, name_width: int) -> Content:
        row = Content(' ').join([
            *(Content.assemble(cell).truncate(width, ellipsis=True, pad=True) for cell, width in (
                (device.name, name_width), (state(device), 6), (level(device), 6))),
            Content.assemble(*report(device))])
        styles = ['dim'] * device.is_stale + ['reverse'] * (device is self._selected)
        return row.stylize(' '.join(styles))

    def _labels(self) -> Iterable[Content]:
        view, mode = None if self._selected is None else self._selected.view, self._mode
        yield _label('a', 'ALL OFF')
        if isinstance(mode, Question):
            yield Content.styled(mode.text, 'bold yellow')
            yield Content.styled('' if mode.typed is None else f'{mode.typed}_', 'reverse')
            yield from (_label('enter', 'yes'), _label('escape', 'no'))
        elif mode == HELP:
            yield _label('escape', 'or any other key goes back')
        else:
            if view is not None:
                keys = view.steering if mode == STEERING else view.keys
                yield from (_label(one.keys[0], one.label) for one in keys if one.label)
                if view.steering:
                    yield _label('m', 'move') if mode == NORMAL else _label('escape', 'ends')
            yield from (_label(names[0], label) for names, _, label, _ in COMMON_KEYS if label)

    def _help(self) -> Content:
        views = {device.view.kind: device.view for device in self._graph.devices}
        lines = [*((keys, text) for keys, text, _, _ in COMMON_KEYS), *(
            (key.keys, f'{kind}: {key.text}') for kind, one in views.items()
            for key in (*one.keys, *one.steering))]
        return Content('\n').join(Content.assemble(
            (f'{"  ".join(keys):22}', 'bold'), f' {text}') for keys, text in lines)


def _details(device: GraphDevice) -> Iterable[Line]:
    yield device.name, []
    if device.action is not None:
        yield 'last', [*last(device), (f' ({age(device.now - device.action[3])} ago)', 'dim')]
    for kind, one in device.diagnoses.items():
        held = device.number(kind, 'held_s')
        yield kind, [LEVELS[device.level_of(one)], f': {one.message}', '' if held is None else (
            f'; held by {device.diagnosed(kind, "holder")} for {age(held)}')]
    if notice := device.view.notice(device):
        yield 'soon', [notice]
    yield from device.view.details(device)
    if device.now - device.heard_at > 2:
        yield 'silent', [f'nothing heard for {age(device.now - device.heard_at)}']


def _label(key: str, text: str) -> Content:
    return Content.styled(f'{key} {text}', Style.from_meta({'@click': f'app.press({key!r})'}))
