# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The values that each kind of device shows, and the requests of its keys. No ROS graph."""

import math
from typing import Any

from illuminator_ros.gimbal.ros import monitor_view as gimbal_view
from illuminator_ros.illuminator.ros import monitor_view as light_view
from illuminator_ros.mavlink.dialect import mavlink
from illuminator_ros.ros import monitor_view as shared
import pytest
from support.monitor import camera, gimbal, light, NOW


def request(of: shared.Device, key: str, typed: str = '') -> shared.Request:
    """Return the request of a key."""
    made = ask(of, key, typed)
    assert isinstance(made, shared.Request), made
    return made


def ask(of: shared.Device, key: str, typed: str = '') -> shared.Request | str:
    """Return the request of a key, or why there is none."""
    found = next(one for one in (*of.view.steering, *of.view.keys) if key in one.keys)
    return found.request(of, typed)


def wanting(of: shared.Device, **wanted: Any) -> shared.Device:
    """Return a device with requests under way."""
    of.wanted = {name: (value, math.inf) for name, value in wanted.items()}
    return of


@pytest.mark.parametrize(('values', 'state'), [
    ({}, 'off'), ({'enabled': True}, 'ON'), ({'connected': False}, 'LOST')])
def test_state_follows_from_the_topics(values: dict[str, Any], state: str) -> None:
    assert light(**values).state == state


def test_device_that_has_published_nothing_is_unknown_then_silent_and_gone_if_it_left() -> None:
    for one in (light(), gimbal(), camera()):
        one.values.clear()
        assert one.state == '?'
        one.now = NOW + shared.SILENCE + 0.1
        assert one.state == 'silent'
        one.is_gone = True
        assert one.state == 'gone'


@pytest.mark.parametrize(('one', 'on'), [
    (light(enabled=True), False), (light(), True), (wanting(light(), enabled=True), False)])
def test_switch_reverses_the_requested_or_reported_state_and_asks_before_on(
    one: shared.Device, on: bool,
) -> None:
    made = request(one, 'space')

    assert (made.values, made.is_off, bool(made.question)) == ({'enabled': on}, not on, on)
    off = request(one, '0')
    assert (off.message.data, off.is_off, off.question) == (False, True, '')


@pytest.mark.parametrize(('one', 'key', 'target'), [
    (light(), '+', 50.0), (light(), '-', 30.0), (light(), '.', 41.0), (light(), 'comma', 39.0),
    (light(brightness=95.0), 'right', 100.0), (light(brightness=5.0), 'left', 0.0),
    # A hot light shines less than agreed; a request takes precedence.
    (light(error_flags=1), '-', 80.0), (wanting(light(), brightness=60.0), '-', 50.0)])
def test_dim_steps_from_the_newest_brightness_within_the_range(
    one: shared.Device, key: str, target: float,
) -> None:
    made = request(one, key)

    assert made.values == {'brightness': target}
    assert [(parameter.name, parameter.value.double_value)
            for parameter in made.message.parameters] == [('brightness', target)]


def test_dim_is_refused_while_the_brightness_is_unknown() -> None:
    one = light()
    del one.values['brightness']

    assert ask(one, '+') == 'its brightness is not known yet'


@pytest.mark.parametrize(('one', 'values', 'asks'), [
    (light(), {'strobe_period': 1.0, 'strobe_duty_cycle': 50.0}, True),
    (light(strobe_duty_cycle=20.0), {'strobe_period': 1.0, 'strobe_duty_cycle': 20.0}, True),
    (light(strobe_period=0.5), {'strobe_period': 0.0}, False),
    (wanting(light(), strobe_period=1.0), {'strobe_period': 0.0}, False)])
def test_strobe_asks_and_starts_with_the_last_duty_cycle_or_ends(
    one: shared.Device, values: object, asks: bool,
) -> None:
    assert request(one, 's').values == values
    assert bool(request(one, 's').question) is asks


@pytest.mark.parametrize(('source', 'values', 'names'), [
    ('autonomy', {'source': ''}, ['autonomy/enable', 'autonomy/cmd/brightness',
                                  'autonomy/release']),
    ('', {'source': 'safety'}, ['enable', 'set_parameters_atomically', 'default/release']),
    # A light without sources has the plain interface only.
    ('autonomy', {}, ['enable', 'set_parameters_atomically', ''])])
def test_requests_of_a_source_have_its_names_where_the_device_has_sources(
    source: str, values: dict[str, str], names: list[str],
) -> None:
    one = light(**values)
    one.source = source

    made = [ask(one, key) for key in ('0', '+', 'u')]

    assert [one.name if isinstance(one, shared.Request) else '' for one in made] == names
    assert isinstance(ask(one, 's'), str) is names[0].startswith('autonomy')


@pytest.mark.parametrize(('key', 'axis', 'target'), [
    ('left', 'z', -0.25 + math.radians(5)), ('right', 'z', -0.25 - math.radians(5)),
    ('up', 'y', 0.5 - math.radians(5)), ('down', 'y', 0.5 + math.radians(5))])
def test_arrow_turns_one_axis_in_the_frame_of_the_attitude(
    key: str, axis: str, target: float,
) -> None:
    message = request(gimbal(), key).message

    assert message.header.frame_id == 'base_link_stabilized'
    assert getattr(message.vector, axis) == pytest.approx(target)
    assert math.isnan(message.vector.x)


@pytest.mark.parametrize(('one', 'key', 'target'), [
    (wanting(gimbal(), yaw=1.0), 'left', 1.0 + math.radians(5)),
    (gimbal(angles=('map', 0.0, 0.0, 3.13)), 'left', 3.13 + math.radians(5) - 2 * math.pi),
    (gimbal(angles=('map', 0.0, 1.56, 0.0)), 'down', math.pi / 2)])
def test_arrows_add_up_turn_on_beyond_half_a_turn_and_stop_straight_down(
    one: shared.Device, key: str, target: float,
) -> None:
    assert [*request(one, key).values.values()] == pytest.approx([target])


@pytest.mark.parametrize(('one', 'reason'), [
    (gimbal(in_control=False), 'not in control (primary 1/193): take control first'),
    (gimbal(angles=('map', 0.0, None, 0.0)), 'its angles are unknown')])
def test_arrow_is_refused_where_the_node_would_ignore_it(one: shared.Device, reason: str) -> None:
    assert ask(one, 'up') == reason


@pytest.mark.parametrize(('typed', 'place'), [
    ('47.3 8.5 480', (47.3, 8.5, 480.0)), ('-47.3,8.5, 0', (-47.3, 8.5, 0.0)), ('', None),
    ('47.3 8.5', None), ('91 8.5 0', None), ('nan 0 0', None), ('0 0 inf', None)])
def test_point_takes_a_place_and_nothing_else(
    typed: str, place: tuple[float, ...] | None,
) -> None:
    made = ask(gimbal(), 'p', typed)

    message = made.message if isinstance(made, shared.Request) else None
    assert place == (message and (message.latitude, message.longitude, message.altitude))


@pytest.mark.parametrize(('values', 'asks'), [
    ({'in_control': True}, False),
    ({'in_control': False, 'controller': 'primary none, secondary none'}, False),
    ({'in_control': False}, True), ({'in_control': False, 'controller': 'unknown'}, True)])
def test_control_that_another_component_may_have_is_taken_only_after_a_question(
    values: dict[str, Any], asks: bool,
) -> None:
    assert bool(request(gimbal(**values), 't').question) is asks


def test_gimbal_asks_before_it_turns_to_neutral_and_releases_at_once() -> None:
    assert request(gimbal(), 'n').question == 'turn /gimbal to its neutral position?'
    assert not request(gimbal(), 'l').question


@pytest.mark.parametrize(('values', 'key', 'name'), [
    ({'enabled': True}, 'o', 'set_parameters_atomically'),
    ({'enabled': True, 'source': ''}, 'o', 'autonomy/cmd/brightness'), ({}, 'o', '')])
def test_light_is_kept_on_by_a_request_that_cannot_switch_it_on(
    values: dict[str, Any], key: str, name: str,
) -> None:
    one = light(**values, brightness=37.53)
    one.source = 'autonomy'

    made = ask(one, key)

    if name:
        assert isinstance(made, shared.Request)
        assert (made.name, made.values, made.text) == (name, {'brightness': 37.53}, 'keep on')
    else:
        assert made == 'it is not on'


def test_temperature_of_a_failed_sensor_is_not_shown_nor_kept() -> None:
    one = light(error_flags=mavlink.ILLUMINATOR_ERROR_FLAGS_THERMISTOR_FAILURE)

    assert one.view.trend is not None
    assert one.view.trend(one) is None
    assert '41.5 C' not in one.view.values(one)
    assert 'temp' not in [label for label, _ in one.view.details(one)]


@pytest.mark.parametrize(('angles', 'key', 'text'), [
    ((0.0, 0.5, -0.25), 'up', 'pitch to 23.6 down'), ((0.0, 0.0, 0.0), 'up', 'pitch to 5.0 up'),
    ((0.0, 0.0, 0.0), 'right', 'yaw to 5.0 right in map'),
    ((0.0, 0.0, 0.0), 'left', 'yaw to 5.0 left in map')])
def test_requested_angle_has_a_direction_as_shown_angles_have(
    angles: tuple[float, ...], key: str, text: str,
) -> None:
    assert request(gimbal(angles=('map', *angles)), key).text == text


def test_keys_of_the_camera_are_its_services() -> None:
    assert [request(camera(), key).name for key in ('space', 'b', 'p')] == [
        'capture', 'capture_panel', 'ping']


def ranging(one: shared.Device) -> shared.Device:
    """Return a gimbal whose range of yaw is known."""
    one.diagnoses['device'] = shared.Diagnosis(0, 'in control', {
        f'yaw_{end}_rad': f'{math.radians(yaw)}' for end, yaw in (('min', -170), ('max', 170))})
    return one


@pytest.mark.parametrize(('one', 'texts'), [
    (light(error_flags=1), ['40 % (agreed: 90 %)', 'maker torch', 'no. T-1', 'up 5 min',
                            '30.0 to 41.5 in 2 min']),
    (light(strobe_period=0.5, strobe_duty_cycle=20.0), ['0.5 s 20 %']),
    (gimbal(), ['28.6 down', '14.3 right', 'ours: primary 1/193']),
    # The range counts from ahead, as its frame may not.
    (ranging(gimbal(angles=('map', 0.0, 0.5, math.pi / 2))),
     ['90.0 left in map (range from ahead: 170.0 right to 170.0 left)']),
    (camera(), ['7, at 47.300000 8.500000 480.0 m', 'fix ok 0 s', 'imu stale 9 s',
                'imu stale', 'mount unused']),
    (camera(fix=(-1, 0.0, 0.0, 0.0)), ['7, at -'])])
def test_details_have_what_is_known(one: shared.Device, texts: list[str]) -> None:
    shown = '\n'.join(''.join(part if isinstance(part, str) else part[0] for part in parts)
                      for _, parts in one.view.details(one))

    assert [text for text in texts if text not in shown] == []


def test_control_and_image_from_before_the_monitor_are_those_of_the_diagnostics() -> None:
    turned, shot = gimbal(), camera()
    turned.diagnoses['device'] = shared.Diagnosis(0, 'in control', {'controller_s': '90.2'})
    del shot.values['image/index']
    shot.diagnoses['camera'] = shared.Diagnosis(0, 'connected', {'image_index': '6'})

    assert ('control', ['ours: ', 'primary 1/193', ' for 90 s']) in turned.view.details(turned)
    assert ('image', ['6, at 47.300000 8.500000 480.0 m']) in shot.view.details(shot)
    turned.changed_at['controller'] = NOW - 1
    assert ('control', ['ours: ', 'primary 1/193', ' for 1 s']) in turned.view.details(turned)


def test_nothing_known_is_shown_as_unknown() -> None:
    for one in (light(), gimbal(), camera()):
        one.values.clear()
        one.trend.clear()
        one.diagnoses.clear()
        assert {*one.view.values(one)} <= {
            '-', 'none', '', 'pitch -', 'yaw -'}
        assert [*one.view.details(one)]


@pytest.mark.parametrize('value', [None, -1e9, 1e9])
def test_numbers_that_cannot_be_are_shown(value: float | None) -> None:
    one = light(brightness=value, strobe_period=value, strobe_duty_cycle=value, uptime=value,
                temperature=value)
    one.trend.append(value)
    for of in (one, gimbal(angles=('map', value, value, value)),
               camera(fix=(0, value, value, value))):
        assert any(of.view.values(of))
        assert [*of.view.details(of)]
    assert all(ask(one, key) for key in '0+-s')


@pytest.mark.parametrize(('seconds', 'text'), [
    (59.6, '60 s'), (150.0, '2.5 min'), (1e6, '11.6 d')])
def test_length_of_time_has_one_unit(seconds: float, text: str) -> None:
    assert shared.age(seconds) == text


def test_target_of_the_last_request_counts_as_long_as_it_lasts() -> None:
    one = light()
    one.wanted = {'brightness': (60.0, NOW + 2.0)}

    assert one.wants('brightness', 40.0) == 60.0
    one.now = NOW + 2.0
    assert one.wants('brightness', 40.0) == 40.0


def test_keys_of_a_device_have_one_meaning() -> None:
    for one in (light(), gimbal(), camera()):
        keys = [key for key_ in one.view.keys for key in key_.keys]
        assert len(keys) == len(set(keys))


def test_steps_are_those_of_the_labels() -> None:
    texts = [key.text for key in (*light_view.VIEW.keys, *gimbal_view.VIEW.steering)]

    assert f'brighter {light_view.STEP:g} %' in texts
    assert f'darker {light_view.FINE_STEP:g} %' in texts
    assert f'by {gimbal_view.STEP:g} deg' in texts
