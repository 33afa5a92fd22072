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

"""What keys do: to the selection, and to the lights."""

from illuminator_ros.cli.monitor.actions import Ask
from illuminator_ros.cli.monitor.keys import HELP
from illuminator_ros.cli.monitor.model import Light
from illuminator_ros.cli.monitor.operator import Operator
import pytest


class Desk:
    """Three lights, an operator, and what was asked."""

    def __init__(self) -> None:
        self.lights = [Light(name, 0.0, values={'enabled': True, 'brightness': 50.0,
                                                'strobe_period': 0.0})
                       for name in ('/a', '/b', '/c')]
        self.asked: list[tuple[str, object]] = []
        self.cleared = 0
        self.operator = Operator(self)

    def submit(self, name: str, ask: Ask) -> None:
        [light] = [light for light in self.lights if light.name == name]
        request = ask(light)
        assert request is not None
        self.asked.append((name, request.value))

    def clear_gone(self) -> None:
        self.cleared += 1

    def press(self, *keys: str) -> None:
        for key in keys:
            self.operator.press(key, self.lights, 0.0)


@pytest.fixture
def desk() -> Desk:
    return Desk()


class TestSelection:
    @pytest.mark.parametrize(('keys', 'selected'), [
        ([], '/a'), (['down'], '/b'), (['j', 'j'], '/c'), (['end'], '/c'),
        (['down'] * 9, '/c'), (['up'], '/a'), (['end', 'k'], '/b'), (['end', 'home'], '/a'),
        (['page down'], '/c'), (['end', 'page up'], '/a')])
    def test_it_moves_and_stops_at_the_ends(
        self, desk: Desk, keys: list[str], selected: str,
    ) -> None:
        desk.operator.look(desk.lights)

        desk.press(*keys)

        assert desk.operator.selected == selected

    def test_it_stays_with_its_light_when_others_come(self, desk: Desk) -> None:
        desk.press('down')

        desk.lights.insert(0, Light('/0', 0.0))
        desk.operator.look(desk.lights)

        assert desk.operator.selected == '/b'

    def test_it_goes_to_the_neighbour_when_its_light_is_cleared(self, desk: Desk) -> None:
        desk.press('end')

        del desk.lights[2]
        desk.operator.look(desk.lights)

        assert desk.operator.selected == '/b'

    def test_without_lights_there_is_none_and_keys_do_nothing(self, desk: Desk) -> None:
        desk.lights.clear()

        desk.press('down', 'space', '+', 's', 'r', 'a')

        assert desk.operator.selected is None
        assert desk.asked == []


@pytest.mark.parametrize(('key', 'value'), [
    ('space', False), ('enter', False), ('+', {'brightness': 60.0}), ('=', {'brightness': 60.0}),
    ('right', {'brightness': 60.0}), ('-', {'brightness': 40.0}), ('left', {'brightness': 40.0}),
    ('.', {'brightness': 51.0}), (',', {'brightness': 49.0}),
    ('s', {'strobe_period': 1.0, 'strobe_duty_cycle': 50.0}), ('r', None)])
def test_a_key_is_for_the_selected_light(desk: Desk, key: str, value: object) -> None:
    desk.press('down', key)

    assert desk.asked == [('/b', value)]


def test_all_off_is_for_all_lights_that_are_there(desk: Desk) -> None:
    desk.lights[1].gone_at = 0.0

    desk.press('a')

    assert desk.asked == [('/a', False), ('/c', False)]


def test_clear_is_for_those_that_are_gone(desk: Desk) -> None:
    desk.press('c')

    assert desk.cleared == 1


@pytest.mark.parametrize('key', ['q', 'ctrl-c', 'ctrl-d'])
def test_quit_quits_also_from_the_help(desk: Desk, key: str) -> None:
    desk.press('?', key)

    assert desk.operator.quit


def test_any_key_leaves_the_help_and_does_nothing_else(desk: Desk) -> None:
    desk.press('h')
    assert desk.operator.show_help

    desk.press('space')

    assert not desk.operator.show_help
    assert desk.asked == []


def _anything(desk: Desk) -> object:
    one = desk.operator
    return one.selected, one.show_help, one.quit, one.stop, list(desk.asked), desk.cleared


@pytest.mark.parametrize('key', [spelling for keys, _ in HELP for spelling in keys])
def test_every_key_of_the_help_does_something(desk: Desk, key: str) -> None:
    desk.press('down')
    before = _anything(desk)

    desk.press(key)

    assert _anything(desk) != before


@pytest.mark.parametrize('key', ['x', 'escape', 'é', 'Q', '\ufffd'])
def test_no_other_key_does_anything(desk: Desk, key: str) -> None:

    desk.press('down')
    before = _anything(desk)

    desk.press(key)

    assert _anything(desk) == before
