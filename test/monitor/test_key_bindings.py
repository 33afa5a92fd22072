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

"""Keys: the bytes of a terminal, the requests that they make, and the selection."""

from typing import Any

from illuminator_ros.cli.monitor import key_bindings
from illuminator_ros.cli.monitor.model import Light
import pytest

KEYS = [key for keys, _, _ in key_bindings.BINDINGS for key in keys]


@pytest.mark.parametrize(('sent', 'keys'), [
    (b'q', ['q']), (b'+-', ['+', '-']), (b' ', ['space']), (b'\r', ['enter']),
    (b'\x1b[A', ['up']), (b'\x1bOB', ['down']), (b'\x1b[5~', ['page up']),
    (b'\x1b[A\x1b[Bx', ['up', 'down', 'x']), (b'\x03', ['ctrl-c']), ('é'.encode(), ['é']),
    (b'\x1b[1;5A', ['escape']), (b'\x1bx', ['escape', 'x']), (b'\xff', ['\ufffd']), (b'', []),
])
def test_bytes_are_decoded_whole_and_in_pieces(sent: bytes, keys: list[str]) -> None:
    assert key_bindings.KeyDecoder().feed(sent) == keys
    if sent.isascii():
        decoder = key_bindings.KeyDecoder()
        assert sum((decoder.feed(bytes([byte])) for byte in sent), []) == keys
        assert not decoder.waiting


def test_escape_is_a_key_if_no_byte_follows() -> None:
    decoder = key_bindings.KeyDecoder()

    assert (decoder.feed(b'\x1b'), decoder.waiting) == ([], True)
    assert (decoder.feed(b''), decoder.waiting) == (['escape'], False)


def light(setpoint: float | None = None, wanted: dict[str, Any] | None = None,
          **values: object) -> Light:
    """Return a light that has published these values."""
    return Light('/bow', 0.0, setpoint=setpoint, wanted=wanted or {}, values=values)


@pytest.mark.parametrize(('one', 'on'), [
    (light(enabled=True), False), (light(enabled=False), True), (light(), True),
    (light(enabled=False, wanted={'enabled': True}), False)])
def test_switch_reverses_the_newest_wanted_or_reported_state(one: Light, on: bool) -> None:
    assert key_bindings.switch(one) == key_bindings.Request(
        key_bindings.Service.ENABLE, 'on' if on else 'off', on)
    assert key_bindings.switch_off(one).value is False


@pytest.mark.parametrize(('one', 'step', 'target'), [
    (light(50.0), 10.0, 60.0), (light(50.0), -1.0, 49.0), (light(95.0), 10.0, 100.0),
    (light(5.0), -10.0, 0.0), (light(100.0), 10.0, 100.0), (light(0.0), -1.0, 0.0),
    (light(33.3), 1.0, 34.3),
    # The agreed brightness counts, even if a hot light shines less; a request takes precedence.
    (light(80.0, brightness=40.0), 10.0, 90.0),
    (light(80.0, {'brightness': 60.0}, brightness=80.0), -10.0, 50.0),
    (light(brightness=40.0), 10.0, 50.0)])
def test_dim_steps_from_the_newest_brightness_within_the_range(
    one: Light, step: float, target: float,
) -> None:
    request = key_bindings.dim(one, step)
    assert request is not None
    assert (request.service, request.value) == (key_bindings.Service.SET, {'brightness': target})


def test_dim_makes_no_request_without_a_known_brightness() -> None:
    assert key_bindings.dim(light(), 10.0) is None


@pytest.mark.parametrize(('one', 'value'), [
    (light(strobe_period=0.0, strobe_duty_cycle=0.0),
     {'strobe_period': 1.0, 'strobe_duty_cycle': 50.0}),
    (light(strobe_period=0.0, strobe_duty_cycle=20.0),
     {'strobe_period': 1.0, 'strobe_duty_cycle': 20.0}),
    (light(strobe_period=0.5), {'strobe_period': 0.0}),
    (light(strobe_period=0.0, wanted={'strobe_period': 1.0}), {'strobe_period': 0.0})])
def test_strobe_starts_with_the_last_duty_cycle_or_ends(one: Light, value: object) -> None:
    assert key_bindings.strobe(one).value == value


class Desk:
    """Three lights, the key bindings, and the requests that they made."""

    def __init__(self) -> None:
        self.lights = [Light(name, 0.0, values={'enabled': True, 'brightness': 50.0,
                                                'strobe_period': 0.0})
                       for name in ('/a', '/b', '/c')]
        self.asked: list[tuple[str, object]] = []
        self.cleared = 0
        self.bindings = key_bindings.KeyBindings(self.submit, self.clear_gone)
        self.bindings.update(self.lights)

    def submit(self, name: str, ask: key_bindings.Ask) -> None:
        [light] = [light for light in self.lights if light.name == name]
        request = ask(light)
        assert request is not None
        self.asked.append((name, request.value))

    def clear_gone(self) -> None:
        self.cleared += 1

    def press(self, *keys: str) -> None:
        for key in keys:
            self.bindings.press(key, self.lights, 0.0)

    def state(self) -> object:
        one = self.bindings
        return one.selected, one.show_help, one.quit, one.stop, list(self.asked), self.cleared


@pytest.fixture
def desk() -> Desk:
    return Desk()


@pytest.mark.parametrize(('keys', 'selected'), [
    ([], '/a'), (['down'], '/b'), (['j', 'j'], '/c'), (['end'], '/c'),
    (['down'] * 9, '/c'), (['up'], '/a'), (['end', 'k'], '/b'), (['end', 'home'], '/a'),
    (['page down'], '/c'), (['end', 'page up'], '/a')])
def test_selection_moves_and_stops_at_the_ends(
    desk: Desk, keys: list[str], selected: str,
) -> None:
    desk.press(*keys)

    assert desk.bindings.selected == selected


def test_selection_stays_with_its_light_and_moves_up_when_it_is_cleared(desk: Desk) -> None:
    desk.press('end')
    desk.lights.insert(0, Light('/0', 0.0))
    desk.bindings.update(desk.lights)
    assert desk.bindings.selected == '/c'

    del desk.lights[3]
    desk.bindings.update(desk.lights)

    assert desk.bindings.selected == '/b'


@pytest.mark.parametrize(('key', 'value'), [
    ('space', False), ('enter', False), ('+', {'brightness': 60.0}), ('=', {'brightness': 60.0}),
    ('right', {'brightness': 60.0}), ('-', {'brightness': 40.0}), ('left', {'brightness': 40.0}),
    ('.', {'brightness': 51.0}), (',', {'brightness': 49.0}),
    ('s', {'strobe_period': 1.0, 'strobe_duty_cycle': 50.0}), ('r', None)])
def test_key_makes_a_request_to_the_selected_light(desk: Desk, key: str, value: object) -> None:
    desk.press('down', key)

    assert desk.asked == [('/b', value)]


def test_all_off_goes_to_each_light_that_is_not_gone(desk: Desk) -> None:
    desk.lights[1].gone_at = 0.0

    desk.press('a')

    assert desk.asked == [('/a', False), ('/c', False)]


def test_all_off_acts_while_the_help_is_shown(desk: Desk) -> None:
    desk.press('?', 'a')

    assert desk.asked == [('/a', False), ('/b', False), ('/c', False)]
    assert not desk.bindings.show_help


def test_each_key_of_the_help_has_one_meaning_and_an_effect(desk: Desk) -> None:
    assert len(KEYS) == len(set(KEYS))
    for key in KEYS:
        desk = Desk()
        desk.press('down')
        before = desk.state()
        desk.press(key)
        assert desk.state() != before, key


def test_keys_do_nothing_without_lights(desk: Desk) -> None:
    desk.lights.clear()

    desk.press('down', 'space', '+', 's', 'r', 'a')

    assert (desk.bindings.selected, desk.asked) == (None, [])
