# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The screen of the monitor, on terminals of every size and kind, its keys and its labels."""


from illuminator_ros.cli.monitor.app import (
    ALWAYS,
    COMMON_KEYS,
    QUESTION_LIFETIME,
)
from illuminator_ros.ros.monitor_view import Diagnosis, DONE, FAILED, NEWS_LIFETIME
import pytest
from support.monitor import camera, diagnosed, gimbal, light, NOW, Screen, show
from textual.color import Color
from textual.events import AppBlur, AppFocus, Paste
from textual.widgets import DataTable


@pytest.mark.parametrize(('size', 'count'), [
    ((200, 50), 40), ((80, 24), 0), ((20, 6), 40), ((1, 1), 1)])
def test_screen_fits_every_terminal_and_shows_the_selected_device(
    size: tuple[int, int], count: int,
) -> None:
    width, height = size

    async def test(screen: Screen) -> None:
        for keys in (['end'], ['escape', '+'], ['space']):
            await screen.press(*keys)
            await screen.wait()
            assert sum(len(line) > width for line in screen.lines) == 0
            assert len(screen.lines) <= height
            if count and width > 20:
                assert f'/l{count - 1:02}' in screen.text

    show(test, *(light(f'/l{number:02}') for number in range(count)), size=size)


def test_screen_shows_each_kind_with_its_states_values_and_findings() -> None:
    async def test(screen: Screen) -> None:
        for text in ('2 lights: 1 ON, 1 off; 1 camera: 1 ok; 1 gimbal: 1 ours',
                     '/bow off WARN dimmed because it is hot; 40 % 41.5 C steady internal',
                     '/camera ok WARN nothing received on ~/imu; 7 12 ms fix 47.300000 8.500000',
                     '/gimbal ours OK primary 1/193 pitch 28.6 down yaw 14.3 right',
                     'lamp WARN: dimmed because it is hot', 'held by safety for 61 s'):
            assert text in screen.text

    show(test, light(), light('/stern', enabled=True), camera(), gimbal(), size=(200, 40))


def test_state_is_a_word_and_not_only_a_colour() -> None:
    gone = light('/gone')
    gone.is_gone = True

    async def test(screen: Screen) -> None:
        assert '3 lights: 1 off, 1 LOST, 1 gone' in screen.text
        await screen.wait(30.0)
        assert '3 lights: 2 silent, 1 gone' in screen.text
        assert 'nothing heard for 30 s' in screen.text

    show(test, light(), gone, light('/lost', connected=False))


def test_values_of_a_lost_light_are_dimmed_but_not_its_name_state_and_level() -> None:
    async def test(screen: Screen) -> None:
        name, state, level, report = screen.app.query_one(DataTable).get_row_at(0)
        assert [any('dim' in str(span.style) for span in cell.spans)
                for cell in (name, state, level, report)] == [False, False, False, True]

    show(test, light(enabled=True, connected=False))


def test_last_request_is_shown_with_its_answer_and_age() -> None:
    one = light()
    one.action = ('brightness 90 %', FAILED, 'refused: [red]MAV_RESULT_DENIED', NOW - 3)

    async def test(screen: Screen) -> None:
        assert ('last brightness 90 %: FAILED: refused: [red]MAV_RESULT_DENIED (3 s ago)'
                in screen.text)

    show(test, one)


def test_no_devices_are_a_sentence_and_keys_do_nothing() -> None:
    async def test(screen: Screen) -> None:
        await screen.press('down', 'space', 'm', 'a', '+')
        assert 'no devices in this ROS graph yet' in screen.text
        assert 'ALL OFF: 0 of 0 confirmed' in screen.text

    assert show(test).requests == []


def test_terminal_for_ascii_gets_ascii_only() -> None:
    async def test(screen: Screen) -> None:
        shown = ''
        for keys in ([], ['end'], ['m']):
            await screen.press(*keys)
            shown += screen.text
        assert shown.isascii()

    show(test, light(mode='\u00dcn\u00ef'), light('/' + 'x' * 200), gimbal(),
         ascii_only=True)


def test_colours_are_left_out_where_they_are_not_wanted(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv('NO_COLOR', '1')

    async def test(screen: Screen) -> None:
        segments = [segment for y in range(screen.app.size.height)
                    for segment in screen.app.query_one('#devices').render_line(y)]
        filtered = [segment.style for one in screen.app.get_line_filters()
                    for segment in one.apply(segments, Color(0, 0, 0))]
        assert all(style is None or style.color is None or style.color.is_default
                   for style in filtered)

    show(test, light())


def test_selection_moves_and_stops_at_the_ends() -> None:
    # Each begins where the one before has ended.
    steps = [([], '/a'), (['down'], '/b'), (['j'], '/c'), (['down'] * 2, '/c'), (['k'], '/b'),
             (['home'], '/a'), (['up'], '/a'), (['end'], '/c'), (['pageup'], '/a'),
             (['pagedown'], '/c')]

    async def test(screen: Screen) -> None:
        for keys, _ in steps:
            await screen.press(*keys, 'r')

    assert show(test, *map(light, ('/a', '/b', '/c'))).asked == [
        (selected, 'refresh') for _, selected in steps]


def test_selection_stays_with_its_device_and_moves_up_when_that_is_cleared() -> None:
    async def test(screen: Screen) -> None:
        await screen.press('end')
        screen.graph.devices.insert(0, light('/0'))
        await screen.wait()
        await screen.press('r')
        assert 'clear gone' not in screen.text
        screen.graph.devices[0].is_gone = True
        await screen.wait()
        await screen.click('clear gone')
        del screen.graph.devices[3]
        await screen.wait()
        await screen.press('r')

    graph = show(test, *map(light, ('/a', '/b', '/c')))
    assert graph.asked == [('/c', 'refresh'), ('/b', 'refresh')]
    assert graph.cleared == 1


def test_light_is_switched_on_only_after_a_second_key_within_the_time() -> None:
    async def test(screen: Screen) -> None:
        for other in ('space', 'escape', 'y', '+', 'down'):
            await screen.press('space', other, 'escape')
        await screen.press('space')
        await screen.wait(QUESTION_LIFETIME + 1)
        await screen.press('enter')
        assert screen.graph.asked == []
        await screen.press('space')
        assert 'switch /bow ON? It can dazzle.' in screen.text
        await screen.press('enter')

    assert show(test, light()).asked == [('/bow', 'on')]


def test_light_is_switched_on_and_off_by_clicks_on_labels() -> None:
    async def test(screen: Screen) -> None:
        await screen.click('on/off')
        await screen.click('yes')
        await screen.click('0 off')
        await screen.click('ALL OFF')

    assert show(test, light()).asked == [('/bow', 'on'), ('/bow', 'off'), ('/bow', 'off')]


def test_first_click_acts_in_a_window_without_the_focus() -> None:
    async def test(screen: Screen) -> None:
        screen.app.post_message(AppBlur())
        await screen.settle()
        await screen.press('end')
        assert 't take control' in screen.text
        [button] = [one for one in screen.app.screen.query('FooterKey')
                    if 'take control' in str(one.render())]
        screen.app.post_message(AppFocus())
        await screen.settle()
        assert button.is_attached

    show(test, light(), gimbal())


BEFORE: tuple[list[str], ...] = ([], ['space'], ['end', 'p', '4', '7'], ['end', 'm'])


def test_all_off_acts_at_once_whatever_is_shown() -> None:
    gone = light('/gone')
    gone.is_gone = True

    async def test(screen: Screen) -> None:
        for before in BEFORE:
            await screen.press('escape', 'home', *before, 'a')
            assert 'ALL OFF' in screen.text

    assert show(test, light(), gone, light('/stern', connected=False), gimbal()).asked == [
        ('/bow', 'off'), ('/stern', 'off')] * len(BEFORE)


@pytest.mark.parametrize(('before', 'size'), [
    *((before, (20, 6)) for before in BEFORE[1:]), (['space'], (80, 24))])
def test_all_off_is_one_touch_away_whatever_is_shown(
    before: list[str], size: tuple[int, int],
) -> None:
    async def test(screen: Screen) -> None:
        await screen.press(*before)
        await screen.click('ALL OFF')

    assert show(test, light(), gimbal(), size=size).asked == [('/bow', 'off')]


def test_all_off_says_of_each_light_whether_it_has_confirmed() -> None:
    async def test(screen: Screen) -> None:
        await screen.press('a')
        for one, off in zip(screen.graph.devices, [
                (DONE, 'off'), (FAILED, 'no answer, trying again')], strict=True):
            one.off = off
        await screen.wait()
        assert 'ALL OFF: 1 of 2 confirmed; /stern FAILED: no answer, trying again' in screen.text
        screen.graph.devices[1].off = DONE, 'off'
        await screen.wait()
        assert 'ALL OFF: 2 of 2 confirmed' in screen.text
        await screen.wait(NEWS_LIFETIME + 1)
        assert 'confirmed' not in screen.text

    show(test, light(), light('/stern'))


def test_dangerous_device_is_first_then_what_is_broken_and_the_selection_stays() -> None:
    async def test(screen: Screen) -> None:
        await screen.press('end')
        screen.graph.devices[1].values['enabled'] = True
        screen.graph.devices[0].diagnoses['lamp'] = Diagnosis(0, 'off', {})
        await screen.wait()
        names = [line.split()[0] for line in screen.lines if line.startswith(' /')]
        assert names[:3] == ['/b', '/c', '/a']
        await screen.press('r')

    assert show(test, *map(light, ('/a', '/b', '/c'))).asked == [('/c', 'refresh')]


def test_80_columns_show_level_and_fault_of_a_device_that_is_not_selected() -> None:
    long_name = '/uav1/payload/searchlight_of_the_bow'
    ill = light(long_name, enabled=True)
    ill.diagnoses['lamp'] = Diagnosis(2, 'switched off because it is too hot', {})

    async def test(screen: Screen) -> None:
        await screen.press('end')
        [row] = [line for line in screen.lines if line.startswith(' …rchlight_of_the_bow ')]
        assert ' ON ERROR! switched off because it is too hot' in ' '.join(row.split())
        assert len(row) <= 80

    show(test, light(), ill, light('/z'), size=(80, 24))


def test_what_is_wrong_above_the_first_visible_row_is_named() -> None:
    lost = light('/lost', enabled=True, connected=False)

    async def test(screen: Screen) -> None:
        assert 'above' not in screen.text
        await screen.press('end')
        await screen.wait()
        assert 'above: /lost LOST WARN!' in screen.text

    fine = [diagnosed(light(f'/l{number:02}'), lamp=0) for number in range(30)]
    show(test, lost, *fine, size=(80, 24))


def test_selected_row_stays_visible_when_the_list_gets_shorter() -> None:
    async def test(screen: Screen) -> None:
        await screen.press('end')
        await screen.press('a')
        for one in screen.graph.devices:
            one.off = FAILED, 'no answer, trying again'
        await screen.wait()
        await screen.wait()
        assert any(line.startswith(' /l11') for line in screen.lines)

    show(test, *(light(f'/l{number:02}') for number in range(12)), size=(80, 25))


def test_80_columns_and_24_rows_show_all_of_twelve_devices_and_the_level_of_the_selected() -> None:
    async def test(screen: Screen) -> None:
        await screen.press('end')
        for number in range(12):
            assert f' /l{number:02} ' in screen.text
        assert 'lamp WARN: dimmed because it is hot' in screen.text

    show(test, *(light(f'/l{number:02}') for number in range(12)), size=(80, 24))


def test_arrows_move_a_gimbal_only_after_steering_has_begun() -> None:
    async def test(screen: Screen) -> None:
        await screen.press('end', 'up', 'end')
        assert 'by 5 deg' not in screen.text
        await screen.press('m', 'up', 'left')
        assert 'left by 5 deg' in screen.text
        await screen.press('escape', 'up', 'end', 'm', 't', 'j')
        assert screen.graph.asked == [
            ('/gimbal', 'pitch to 23.6 down'), (
                '/gimbal', 'yaw to 9.3 right in base_link_stabilized')]
        await screen.press('up', 'm', 'up')

    assert len(show(test, light(), gimbal()).asked) == 2


def test_place_is_typed_or_pasted_corrected_and_sent_with_enter() -> None:
    async def test(screen: Screen) -> None:
        await screen.press('p')
        await screen.press(*'47.1', 'backspace', '3', 'left', 'right', 'space', *'8.5')
        screen.app.post_message(Paste(' 480'))
        await screen.settle()
        assert '47.3 8.5 480' in screen.text
        # As below a question, which a second touch on the same place must not confirm.
        assert 'escape back enter yes' in screen.text
        await screen.press('enter', 'p', '1', 'escape', 'p', 'enter')

    graph = show(test, gimbal())
    assert graph.asked == [('/gimbal', 'point at 47.3 8.5 480')]
    assert graph.devices[0].action is not None
    assert graph.devices[0].action[::2] == (
        'point at a place', "'' is not latitude, longitude and altitude")


def test_each_key_of_the_selected_device_has_a_button_with_its_meaning() -> None:
    async def test(screen: Screen) -> None:
        for view in (light().view, camera().view, gimbal().view):
            # In the order of the view, whatever other devices have the same keys.
            assert ' '.join(f'{key.keys[0]} {key.text}' for key in view.keys) in screen.text
            await screen.press('down')
        await screen.press('m')
        for key in gimbal().view.steering:
            assert f'{key.keys[0]} {key.text}' in screen.text

    show(test, light(), camera(), gimbal(), size=(80, 24))


@pytest.mark.parametrize('key', [
    key for keys, _, _, action in (*ALWAYS, *COMMON_KEYS)
    if action == 'quit' for key in keys])
def test_each_key_to_quit_ends_the_monitor(key: str) -> None:
    async def test(screen: Screen) -> None:
        await screen.press(key)
        assert not screen.app.is_running or screen.app._exit

    show(test, light(), size=(20, 6))


def test_labels_of_keys_are_not_keys_of_others() -> None:
    # A common key that a device has, too, would never act.
    common = {key for keys, *_ in (*ALWAYS, *COMMON_KEYS) for key in keys}
    for one in (light(), gimbal(), camera()):
        own = {key for entry in one.view.keys for key in entry.keys}
        assert own & common == set()


@pytest.mark.parametrize('touch', [False, True])
def test_night_is_red_on_black_whatever_is_shown(touch: bool) -> None:
    async def test(screen: Screen) -> None:
        await screen.press('v', 'v')
        for keys in ([], ['end', 'p'], ['escape', 'home', 'space'], ['escape', 'a']):
            await screen.press(*keys)
            colours = {(part, colour.get_truecolor().green, colour.get_truecolor().blue)
                       for part in screen.app.screen.query('*') for y in range(part.size.height)
                       for segment in part.render_line(y) if segment.style is not None
                       for colour in (segment.style.color, segment.style.bgcolor) if colour}
            assert {(str(part), green, blue) for part, green, blue in colours
                    if green or blue} == set()

    ill = light('/ill', enabled=True)
    show(test, light(), ill, camera(), gimbal('/lost', connected=False), size=(80, 30),
         touch=touch)


def test_colours_for_sunlight_contrast_with_their_background() -> None:
    async def test(screen: Screen) -> None:
        await screen.press('v')
        table = screen.app.query_one(DataTable)
        for y in range(2, 5):
            for segment in table.render_line(y):
                assert segment.style is not None
                assert segment.style.color is not None and segment.style.bgcolor is not None
                front, back = (Color.from_rich_color(one).brightness for one in (
                    segment.style.color, segment.style.bgcolor))
                assert abs(front - back) > 0.5

    show(test, light(), light('/on', enabled=True), camera(), gimbal('/lost', connected=False))


def test_buttons_for_fingers_have_three_rows_and_whole_labels_on_a_phone() -> None:
    async def test(screen: Screen) -> None:
        for view in (light().view, gimbal().view):
            buttons = screen.app.screen.query('Button, FooterKey')
            assert {one.outer_size.height for one in buttons} == {3}
            assert {one.region.x for one in buttons} == {0, 28}
            shown = [*screen.lines]
            for key in view.keys:
                # Whole in one line, and not behind the end of the screen.
                label = f'{key.keys[0]} {key.text}'
                assert any(label in line for line in shown) is (
                    key.has_button and not key.prompt)
            await screen.click('down next')

    show(test, light(), gimbal(), size=(55, 60), touch=True)


def test_view_that_may_only_look_has_no_buttons_to_operate_a_device() -> None:
    async def test(screen: Screen) -> None:
        assert 'ALL OFF' not in screen.text
        assert 'on/off' not in screen.text
        await screen.press('a')

    assert show(test, light(), may_request=False).requests == []
