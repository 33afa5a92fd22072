# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The screen: the list of devices, the details of one, and its keys as buttons."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
import functools
from operator import itemgetter
import os
from typing import Any, ClassVar, NamedTuple

from rich.text import Text
from textual import events
from textual.app import App, ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Vertical
from textual.coordinate import Coordinate
from textual.geometry import Size
from textual.layout import Layout
from textual.layouts.grid import GridLayout
from textual.theme import Theme
from textual.widgets import Button, DataTable, Footer, Input, Sparkline, Static

from . import table
from .ros_graph import Graph, GraphDevice
from ...ros.monitor_view import BY_SEVERITY, Cell, FAILED, FINE, Request

# s between updates of the screen, and between looks for answers to requests.
INTERVAL, ANSWER_INTERVAL = 0.1, 0.05
# s after which a question is dropped; characters that the operator may type.
QUESTION_LIFETIME, MAX_TYPED = 15.0, 100
NORMAL, STEERING = 'normal', 'steering'
NO_DEVICES = 'no devices in this ROS graph yet; is a bridge running, with this ROS_DOMAIN_ID?'
LOOKING = 'to look only; '
# The buttons: none, everywhere, only small ones, only those for fingers.
NONE, ALL, SMALL, LARGE = range(4)
Keys = tuple[tuple[tuple[str, ...], str, int, str], ...]
# Keys, text, button, and action. The first keys act while the operator types, too.
ALWAYS: Keys = (
    (('a',), 'ALL OFF', NONE, 'all_off'),
    (('ctrl+c', 'ctrl+d', 'ctrl+backslash'), 'quit', NONE, 'quit'),
    (('ctrl+z',), 'stop; fg continues', NONE, 'suspend_process'),
    (('escape',), 'back', ALL, 'answer(False)'), (('enter',), 'yes', ALL, 'answer(True)'))
COMMON_KEYS: Keys = (
    (('m',), 'move', ALL, 'steer'), (('c',), 'clear gone', ALL, 'clear'),
    (('k', 'up'), 'previous', LARGE, 'move(-1)'), (('j', 'down'), 'next', LARGE, 'move(1)'),
    (('pageup',), '10 devices up', NONE, 'move(-10)'),
    (('pagedown',), '10 devices down', NONE, 'move(10)'),
    (('home',), 'first device', NONE, f'move({-10**6})'),
    (('end',), 'last device', NONE, f'move({10**6})'),
    (('v',), 'colours', ALL, 'colours'), (('q',), 'quit', SMALL, 'quit'))
# Eyes that are used to the dark keep that under red light only.
RED, DARK_RED = '#e00000', '#400000'
THEMES = {
    'dark': Theme('dark', '#5fafff', foreground='#e0e0e0', background='#121212',
                  surface='#121212', panel='#303030', error='#ff5f5f'),
    'sunlight': Theme('sunlight', '#000000', foreground='#000000', background='#ffffff',
                      surface='#ffffff', panel='#d0d0d0', error='#a00000', dark=False),
    'night': Theme('night', RED, foreground=RED, background='#000000', surface='#000000',
                   panel=DARK_RED, error=RED, secondary=RED, warning=RED, success=RED, accent=RED)}
COLOURS = {
    'dark': {},
    'sunlight': {'green': '#005f00', 'yellow': '#704000', 'red': '#a00000'},
    'night': dict.fromkeys(('green', 'yellow', 'red'), RED)}
# Of the columns; the last is as wide as any terminal.
WIDTHS = {'STATE': 6, 'LEVEL': 6, 'REPORT': 500}


class Question(NamedTuple):
    """
    A question to the operator.

    :param label: of the key.
    :param answer: returns the request for the typed text, or why there is none, for people.
    :param deadline: when it is dropped, s.
    """

    text: str
    label: str
    answer: Callable[[str], Request | str]
    deadline: float


class Typed(Input):
    """The text that the operator types; ALL OFF acts all the same."""

    def check_consume_key(self, key: str, character: str | None) -> bool:
        """See :meth:`Input.check_consume_key`."""
        return key != 'a' and super().check_consume_key(key, character)

    def check_action(self, action: str, parameters: tuple[object, ...]) -> bool:
        """Leave "yes" to the application, whose button has a place of its own."""
        return action != 'submit'


class KeyButtons(Footer):
    """Buttons in rows, as many in each as there is space for their labels."""

    def pre_layout(self, layout: Layout) -> None:
        """See :meth:`Widget.pre_layout`."""
        assert isinstance(layout, GridLayout)
        layout.min_column_width = 24 if self.screen.has_class('-touch') else 18


class MonitorApp(App[None], inherit_bindings=False):
    """
    The monitor on a terminal or in a browser.

    :param touch: whether fingers press its buttons, which are large then.
    """

    CSS_PATH = 'monitor.tcss'
    ENABLE_COMMAND_PALETTE = ALLOW_SELECT = False
    # Keys are for the application.
    AUTO_FOCUS = None
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding(key, action, text, key_display=key, show=button == ALL, priority=True)
        for keys, text, button, action in ALWAYS for key in keys]

    def __init__(self, graph: Graph, *, ascii_only: bool = False, touch: bool = False) -> None:
        # Without colours textual draws shades of grey, unless colours are those of the terminal.
        super().__init__(ansi_color=True if 'NO_COLOR' in os.environ else None)
        for theme in THEMES.values():
            self.register_theme(theme)
        self.theme = 'dark'
        self._graph = graph
        self._ascii_only = ascii_only
        self._touch = touch
        self._selected: GraphDevice | None = None
        self._at = 0
        self._mode: str | Question = NORMAL
        self._devices: list[GraphDevice] = []
        self._shown: dict[str, object] = {}
        # The size of the table with which the selected row was visible.
        self._visible_with: Size | None = None
        self._table = DataTable[Text](id='devices', cursor_type='row')
        self._trend = Sparkline(id='trend')
        self._typed = Typed(id='typed', max_length=MAX_TYPED, compact=True)
        # Buttons are in the order in which keys are bound, whatever device binds a key first.
        own = [(number + 100 * is_steering, key, f'press({view.kind!r}, {is_steering}, {number})')
               for view in graph.views
               for is_steering, keys in ((False, view.keys), (True, view.steering))
               for number, key in enumerate(keys)]
        last = {name: place for place, key, _ in sorted(own, key=itemgetter(0))
                for name in key.keys}
        for _, key, action in sorted(own, key=lambda one: last[one[1].keys[0]]):
            self._bind(key.keys, key.text, ALL if key.has_button and not key.prompt else SMALL,
                       action)
        for common in COMMON_KEYS:
            self._bind(*common)

    def _bind(self, keys: Iterable[str], text: str, button: int, action: str) -> None:
        for key in keys:
            for one in Binding.make_bindings([(key, action)]):
                self.bind(one.key, action, description=text, key_display=key,
                          show=button in (ALL, LARGE if self._touch else SMALL))

    def restore(self) -> None:
        """Restore the terminal in a hurry; called in another thread if the end hangs."""

    def compose(self) -> ComposeResult:
        """See :meth:`App.compose`."""
        yield Static(id='head')
        yield self._table
        yield Vertical(Static(id='details'), self._trend, id='selected')
        yield Static(id='question')
        yield self._typed
        yield KeyButtons(id='keys', show_command_palette=False)
        yield Button('a ALL OFF', id='off', action='app.all_off', compact=not self._touch)

    def on_mount(self) -> None:
        """Begin to poll."""
        for one in self.query('*'):
            one.can_focus = one is self._typed
        # Until the first values come.
        self._table.display = self._trend.display = False
        off = self.query_one(Button)
        off.visible = self._graph.may_request
        # Textual ignores a press during the effect of the one before.
        off.active_effect_duration = 0.0
        self.screen.set_class(self._touch, '-touch')
        self.set_interval(INTERVAL, self.poll)
        self.set_interval(ANSWER_INTERVAL, self._graph.poll_answers)
        self.call_after_refresh(self.poll)

    def poll(self) -> None:
        """Take new values, and draw them."""
        if not self._table.is_attached:
            # The screen is being removed at the end.
            return
        self._graph.poll()
        if isinstance(self._mode, Question) and self._graph.clock() > self._mode.deadline:
            self._mode = NORMAL
        self.draw()

    def on_app_focus(self, event: events.AppFocus | events.AppBlur) -> None:
        """Keep the buttons: textual makes them again, and loses the first click on one."""
        event.prevent_default()

    on_app_blur = on_app_focus

    def on_mouse_down(self, event: events.MouseDown) -> None:
        """Select the device of a row."""
        row = event.style.meta.get('row', -1)
        if 0 <= row < len(self._devices):
            self._select(self._devices[row])
            self.draw()

    async def run_action(self, *arguments: Any, **options: Any) -> bool:
        """See :meth:`App.run_action`; draw what it has changed."""
        is_done = await super().run_action(*arguments, **options)
        self.draw()
        return is_done

    def check_action(self, action: str, parameters: tuple[object, ...]) -> bool:
        """Return whether an action is possible now: its key has a button then."""
        is_asking = isinstance(self._mode, Question)
        view = self._selected.view if self._selected and self._graph.may_request else None
        match action, parameters:
            case 'answer', (is_yes,):
                return is_asking if is_yes else self._mode != NORMAL
            case 'press', (kind, is_steering, _):
                return view is not None and view.kind == kind and not is_asking and (
                    is_steering is (self._mode == STEERING))
            case 'steer', _:
                return view is not None and bool(view.steering) and self._mode == NORMAL
            case 'clear', _:
                return not is_asking and any(one.is_gone for one in self._devices)
        return not (is_asking and action in ('move', 'colours'))

    def action_move(self, step: int) -> None:
        """Select another device."""
        self._mode = NORMAL
        if self._devices:
            self._select(self._devices[min(max(self._at + step, 0), len(self._devices) - 1)])

    def action_steer(self) -> None:
        """Let the arrow keys move the selected device."""
        self._mode = STEERING

    def action_colours(self) -> None:
        """Take the next colours."""
        names = list(THEMES)
        self.theme = names[(names.index(self.theme) + 1) % len(names)]
        self._shown.clear()

    def action_all_off(self) -> None:
        """Switch off every device that can be switched off."""
        self._mode = NORMAL
        self._graph.all_off()

    def action_clear(self) -> None:
        """Remove the devices that are gone."""
        self._graph.clear_gone()

    def action_press(self, kind: str, is_steering: bool, number: int) -> None:
        """Act on a key of the selected device."""
        assert self._selected is not None
        view, self._mode = self._selected.view, STEERING if is_steering else NORMAL
        key = (view.steering if is_steering else view.keys)[number]
        make = functools.partial(key.request, self._selected)
        if key.prompt:
            self._ask(key.prompt, key.text, make, is_typed=True)
        else:
            self._request(key.text, make(''))

    def action_answer(self, is_yes: bool) -> None:
        """Answer a question, or end to move a gimbal."""
        mode, self._mode = self._mode, NORMAL
        if is_yes and isinstance(mode, Question):
            self._request(mode.label, mode.answer(self._typed.value), is_confirmed=True)

    def _request(self, label: str, made: Request | str, is_confirmed: bool = False) -> None:
        assert self._selected is not None
        if isinstance(made, str):
            self._selected.note(label, FAILED, made)
        elif made.question and not is_confirmed:
            self._ask(made.question, label, lambda _: made)
        else:
            self._selected.submit(made)

    def _ask(
        self, text: str, label: str, answer: Callable[[str], Request | str],
        is_typed: bool = False,
    ) -> None:
        self._mode = Question(text, label, answer, self._graph.clock() + QUESTION_LIFETIME)
        if is_typed:
            self._typed.value = ''
            self._typed.display = True
            self._typed.focus()

    def _select(self, device: GraphDevice | None) -> None:
        if device is not self._selected:
            # A question belongs to the other device.
            self._selected, self._mode = device, NORMAL

    def draw(self) -> None:
        """Draw what has changed."""
        if not (self._table.is_mounted and self._table.is_attached):
            return
        # The order of attention, the worst first.
        devices = sorted(self._graph.devices, key=lambda device: (
            device.attention, -BY_SEVERITY.index(device.level or 0)))
        if self._selected not in devices:
            self._select(devices[min(self._at, len(devices) - 1)] if devices else None)
        device, mode = self._selected, self._mode
        self._at = 0 if device is None else devices.index(device)
        self._draw_table(devices)
        self._table.display = bool(devices)
        self._show('head', self._head())
        self._show('details', [] if device is None or self.size.height < 12 else [
            [(f'{label:8}', 'bold'), *cells] for label, cells in table.details(device)])
        # A tenth of a degree is not a peak.
        self._trend.data = [] if device is None else [
            round(one) for one in device.trend if one is not None]
        self._trend.display = len(self._trend.data) > 1 and self.size.height >= 16 and (
            not self._ascii_only)
        question = mode.text if isinstance(mode, Question) else ''
        self._show('question', [[(question, 'bold yellow')]] if question else [])
        if self._typed.display and not question:
            self._typed.display = False
            self.set_focus(None)
        keys = device and device.view, bool(question) or mode, self.check_action('clear', ())
        if self._shown.get('keys') != keys:
            self._shown['keys'] = keys
            self.refresh_bindings()

    def _text(self, cells: Iterable[Cell]) -> Text:
        """Return a line, in the colours of the theme."""
        text, colours = Text(end=''), COLOURS[self.theme]
        for shown, style in ((one, '') if isinstance(one, str) else one for one in cells):
            if self._ascii_only:
                shown = shown.encode('ascii', 'replace').decode()
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
        if (answers := self._graph.off_answers) is not None:
            yield table.off_report(answers)
        for device in self._devices[:self._table.scroll_offset.y]:
            if device.attention != FINE:
                yield [f'above: {device.name} ', *table.state(device), ' ', *table.level(device)]
        yield [(LOOKING * (not self._graph.may_request) + (
            table.counts(self._graph.devices) or NO_DEVICES), 'bold')]

    def _draw_table(self, devices: Sequence[GraphDevice]) -> None:
        width = max(min(max((len(one.name) for one in devices), default=0),
                        self.size.width // 4), 8)
        rows = [self._row(device, width) for device in devices]
        if self._shown.get('table') != (width, len(rows)):
            self._shown['table'] = width, len(rows)
            self._table.clear(columns=True)
            for title, columns in {'DEVICE': width, **WIDTHS}.items():
                self._table.add_column(title, width=columns)
            self._table.add_rows(rows)
        for y, row in enumerate(rows):
            for x, cell in enumerate(row):
                if self._table.get_cell_at(Coordinate(y, x)) != cell:
                    self._table.update_cell_at(Coordinate(y, x), cell)
        self._devices = list(devices)
        self._table.styles.max_height = len(rows) + 1
        # Where the list gets shorter the selected row stays visible, unless it was scrolled away.
        top, size = self._table.scroll_offset.y, self._table.size
        if self._table.cursor_row != self._at or self._visible_with not in (None, size):
            self._table.move_cursor(row=self._at)
        self._visible_with = size if top <= self._at < top + size.height - 1 else None

    def _row(self, device: GraphDevice, width: int) -> list[Text]:
        # Names differ at their ends.
        name = device.name if len(device.name) <= width else f'…{device.name[1 - width:]}'
        row = [self._text([name]), *(self._text(column(device)) for column in (
            table.state, table.level, table.report))]
        for cell in row:
            cell.no_wrap, cell.overflow = True, 'crop'
        if device.is_stale:
            row[-1].stylize('dim')
        return row
