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

"""The screen: the list of devices, the details of one, and its keys as buttons."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
import functools
import os
from typing import ClassVar, NamedTuple

from rich.text import Text
from textual import events
from textual.app import App, ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import ItemGrid
from textual.coordinate import Coordinate
from textual.theme import Theme
from textual.widgets import Button, DataTable, Sparkline, Static

from .ros_graph import Graph, GraphDevice
from .table import by_kind, counts, last, level, off_report, report, state
from ...ros.monitor_view import age, BY_SEVERITY, Cell, FAILED, Key, LEVELS, Line, Request

# s between updates of the screen, and between looks for answers to requests.
INTERVAL, ANSWER_INTERVAL = 0.1, 0.05
# s without a key after which a question is dropped; characters that the operator may type.
QUESTION_LIFETIME, MAX_TYPED = 15.0, 100
NORMAL, HELP, STEERING = 'normal', 'help', 'steering'
NO_DEVICES = 'no devices in this ROS graph yet; is a bridge running, with this ROS_DOMAIN_ID?'
MOVES = {'up': -1, 'k': -1, 'down': 1, 'j': 1, 'pageup': -10, 'pagedown': 10,
         'home': -10**6, 'end': 10**6}
# Keys, text, label of the button or '', and action, in the order of the help.
COMMON_KEYS: tuple[tuple[tuple[str, ...], str, str, str], ...] = (
    (tuple(MOVES), 'select a device, as a click on it does', '', 'move'),
    (('m',), 'move a gimbal with the arrow keys; any other key ends that', '', 'steer'),
    (('enter',), 'yes, where a request asks first; escape is no', '', ''),
    (('a',), 'ALL lights off, and again where one does not confirm', '', 'all off'),
    (('c',), 'clear devices that are gone', '', 'clear'),
    (('v',), 'colours: dark, for sunlight, for the night (red on black)', 'colours', 'colours'),
    (('?', 'h'), 'this help', 'help', 'help'),
    (('q', 'ctrl+c', 'ctrl+d', 'ctrl+backslash'), 'quit', 'quit', 'quit'),
    (('ctrl+z',), 'stop; fg continues', '', 'stop'))
ACTIONS = {key: action for keys, _, _, action in COMMON_KEYS for key in keys}
# For terminals that show ASCII only; other characters become question marks.
ASCII = str.maketrans('…←→↑↓', '~<>^v')
# Eyes that are used to the dark keep that under red light only.
RED, DARK_RED = '#e00000', '#400000'
THEMES = (
    Theme('dark', '#5fafff', foreground='#e0e0e0', background='#121212', surface='#121212',
          panel='#303030', error='#ff5f5f'),
    Theme('sunlight', '#000000', foreground='#000000', background='#ffffff', surface='#ffffff',
          panel='#d0d0d0', error='#a00000', dark=False),
    Theme('night', RED, foreground=RED, background='#000000', surface='#000000', panel=DARK_RED,
          error=RED, secondary=RED, warning=RED, success=RED, accent=RED))
COLOURS = {
    'dark': {},
    'sunlight': {'green': '#005f00', 'yellow': '#704000', 'red': '#a00000', 'cyan': '#004f6f'},
    'night': dict.fromkeys(('green', 'yellow', 'red', 'cyan'), RED)}
# Widths of the columns but the last, and the width of each beside its text.
STATE_WIDTH, LEVEL_WIDTH, PADDING = 6, 6, 2
# The buttons that any device needs at most.
BUTTONS = 16


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
    """
    The monitor on a terminal or in a browser.

    :param touch: whether fingers press its buttons, which are large then.
    """

    CSS_PATH = 'monitor.tcss'
    ENABLE_COMMAND_PALETTE = ALLOW_SELECT = False
    # Keys are for the application.
    AUTO_FOCUS = None
    # Textual has other uses for these.
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding(key, f'press("{key}")', priority=True) for key in ('ctrl+c', 'escape', 'tab')]

    def __init__(self, graph: Graph, *, ascii_only: bool = False, touch: bool = False) -> None:
        # Without colours textual draws shades of grey, unless colours are those of the terminal.
        super().__init__(ansi_color=True if 'NO_COLOR' in os.environ else None)
        for theme in THEMES:
            self.register_theme(theme)
        self.theme = THEMES[0].name
        self._graph = graph
        self._ascii_only = ascii_only
        self._touch = touch
        self._selected: GraphDevice | None = None
        self._at = 0
        self._mode: str | Question = NORMAL
        self._devices: list[GraphDevice] = []
        self._table = DataTable[Text](id='devices', cursor_type='row')
        self._off = Button('a ALL OFF', id='off', action='app.press("a")', compact=not touch)
        self._buttons = [Button(compact=not touch) for _ in range(BUTTONS)]
        self._trend = Sparkline(id='trend')
        self._off.visible = graph.may_request
        for one in (self._table, self._trend, *self._buttons):
            # Until the first values come.
            one.display = False
        for button in (self._off, *self._buttons):
            # Textual ignores a press during the effect of the one before.
            button.active_effect_duration = 0.0
        self._shown: dict[str, object] = {}

    def restore(self) -> None:
        """Restore the terminal in a hurry; called in another thread if the end hangs."""

    def compose(self) -> ComposeResult:
        """See :meth:`App.compose`."""
        yield Static(id='head')
        yield self._table
        yield Static(id='details')
        yield self._trend
        yield Static(id='question')
        yield self._off
        yield ItemGrid(*self._buttons, id='keys', min_column_width=24 if self._touch else 14)

    def on_mount(self) -> None:
        """Begin to poll."""
        for one in self.query('*'):
            one.can_focus = False
        self.screen.set_class(self._touch, '-touch')
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

    def on_mouse_down(self, event: events.MouseDown) -> None:
        """Select the device of a row."""
        row = event.style.meta.get('row', -1)
        if 0 <= row < len(self._devices):
            self._select(self._devices[row])
            self.draw()

    def action_press(self, key: str) -> None:
        """Act on a key, or on a click on its button."""
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
        elif action == 'colours':
            names = [theme.name for theme in THEMES]
            self.theme = names[(names.index(self.theme) + 1) % len(names)]
            self._shown.clear()
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

    def draw(self) -> None:
        """Draw what has changed."""
        if not (self._table.is_mounted and self._table.is_attached):
            return
        # The order of attention, the worst first.
        devices = sorted(self._graph.devices, key=lambda device: (
            device.attention, -BY_SEVERITY.index(device.level or 0)))
        if self._selected not in devices:
            self._select(devices[min(self._at, len(devices) - 1)] if devices else None)
        self._at = 0 if self._selected is None else devices.index(self._selected)
        device, mode = self._selected, self._mode
        self._table.display = bool(devices) and mode != HELP
        self.screen.set_class(mode == HELP, '-help')
        self._draw_table(devices)
        self._show('head', self._help() if mode == HELP else self._head())
        self._show('details', [] if device is None or mode == HELP or self.size.height < 12 else [
            [(f'{label:8}', 'bold'), *cells] for label, cells in _details(device)])
        values = [] if device is None else [one for one in device.trend if one is not None]
        self._trend.display = len(values) > 1 and self.size.height >= 16 and mode != HELP and (
            not self._ascii_only)
        # A tenth of a degree is not a peak.
        self._trend.data = [round(one) for one in values]
        self._show('question', [[(mode.text, 'bold yellow'), ' ', (
            '' if mode.typed is None else f'{mode.typed}_', 'reverse')]]
            if isinstance(mode, Question) else [])
        self._draw_buttons()

    def _text(self, cells: Iterable[Cell]) -> Text:
        """Return a line, in the colours of the theme."""
        text, colours = Text(end=''), COLOURS[self.theme]
        for shown, style in ((one, '') if isinstance(one, str) else one for one in cells):
            if self._ascii_only:
                shown = shown.translate(ASCII).encode('ascii', 'replace').decode()
            text.append(shown, ' '.join(colours.get(word, word) for word in style.split()))
        return text

    def _show(self, name: str, lines: Iterable[Iterable[Cell]]) -> None:
        text = Text('\n').join(map(self._text, lines))
        if self._shown.get(name) != text:
            self._shown[name] = text
            part = self.query_one(f'#{name}', Static)
            part.display = bool(text)
            part.update(text)

    def _head(self) -> Iterable[Iterable[Cell]]:
        if answers := self._graph.off_answers:
            yield off_report(answers)
        yield [('; '.join(map(counts, by_kind(self._graph.devices))) or NO_DEVICES, 'bold')]

    def _draw_table(self, devices: Sequence[GraphDevice]) -> None:
        width = self.size.width
        names = max(min(max((len(one.name) for one in devices), default=0), width // 4), 8)
        widths = {'DEVICE': names, 'STATE': STATE_WIDTH, 'LEVEL': LEVEL_WIDTH}
        widths['REPORT'] = max(width - sum(widths.values()) - PADDING * 4, 1)
        rows = [self._row(device, names) for device in devices]
        if self._shown.get('widths') != widths or len(devices) != len(self._devices):
            self._shown['widths'] = widths
            self._table.clear(columns=True)
            for title, size in widths.items():
                self._table.add_column(title, width=size)
            self._table.add_rows(rows)
        for y, row in enumerate(rows):
            for x, cell in enumerate(row):
                if self._table.get_cell_at(Coordinate(y, x)) != cell:
                    self._table.update_cell_at(Coordinate(y, x), cell)
        self._devices = list(devices)
        if self._table.cursor_row != self._at:
            self._table.move_cursor(row=self._at)

    def _row(self, device: GraphDevice, width: int) -> list[Text]:
        row = [self._text(cells) for cells in (
            [device.name], [state(device)], [level(device)], report(device))]
        row[0].truncate(width, overflow='crop' if self._ascii_only else 'ellipsis')
        for cell in row:
            cell.no_wrap, cell.overflow = True, 'crop'
            if device.is_stale:
                cell.stylize('dim')
        return row

    def _draw_buttons(self) -> None:
        labels = list(self._labels())
        if self._shown.get('buttons') == labels:
            return
        self._shown['buttons'] = labels
        for number, button in enumerate(self._buttons):
            button.display = number < len(labels)
            if button.display:
                key, label = labels[number]
                button.label = self._text([f'{key} {label}']).plain
                button.action = f'app.press({key!r})'

    def _labels(self) -> Iterable[tuple[str, str]]:
        """Return key and label of each button."""
        view, mode = None if self._selected is None else self._selected.view, self._mode
        if isinstance(mode, Question):
            # "no" is where a second tap on the button that asked may fall.
            yield from (('escape', 'no'), ('enter', 'yes'))
        elif mode == HELP:
            yield 'escape', 'back'
        else:
            if view is not None and self._graph.may_request:
                keys = view.steering if mode == STEERING else view.keys
                yield from ((one.keys[0], one.label) for one in keys if one.label)
                if view.steering:
                    yield ('m', 'move') if mode == NORMAL else ('escape', 'ends')
            yield from ((names[0], label) for names, _, label, _ in COMMON_KEYS if label)

    def _help(self) -> Iterable[Iterable[Cell]]:
        views = {device.view.kind: device.view for device in self._graph.devices}
        for keys, text in [*((keys, text) for keys, text, _, _ in COMMON_KEYS), *(
                (key.keys, f'{kind}: {key.text}') for kind, one in views.items()
                for key in (*one.keys, *one.steering))]:
            yield [(f'{"  ".join(keys):22}', 'bold'), f' {text}']


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
