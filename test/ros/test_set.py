# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""``set``: the order of settings, what confirms them, and its exit status."""

from __future__ import annotations

from pathlib import Path
from typing import cast

from illuminator_ros.cli.monitor.ros_graph import Graph, GraphDevice
from illuminator_ros.cli.set.run import in_order, Result, Settings
from illuminator_ros.ros.monitor_view import DONE, FAILED, Request, SENT
import pytest
from support.light import ServedLight
from support.monitor import FakeDevice, FakeGraph, gimbal, light
from support.processes import ended, python
from support.ros import Ros, running_bridge


def applied(
    device: FakeDevice, *settings: tuple[str, str], refused: str = '', shows: bool = True,
) -> tuple[list[str], list[Result]]:
    """Apply settings to a device that refuses one of them; return what was sent, and results."""
    graph, sent = FakeGraph(device), []

    def submit(request: Request) -> None:
        sent.append(request.text)
        is_message = request.name.startswith('cmd/')
        device.note(request.text, FAILED if request.text == refused else (
            SENT if is_message else DONE), 'too hot' if request.text == refused else '')
        if request.name == 'take_control':
            device.values['in_control'] = True
        if is_message and shows:
            frame, *angles = device.values['angles']
            targets = zip(('roll', 'pitch', 'yaw'), angles, strict=True)
            device.values['angles'] = frame, *(
                request.values.get(axis, angle) for axis, angle in targets)

    def wait() -> bool:
        graph.now += 0.5
        return False

    device.submit = submit  # type: ignore[method-assign]
    results = [*Settings(cast(Graph, graph), cast(GraphDevice, device), wait, 10.0).apply(
        settings)]
    return sent, results


def test_light_is_switched_on_after_its_other_settings_are_confirmed() -> None:
    sent, results = applied(light(), ('enable', 'true'), ('strobe_period', '1'),
                            ('brightness', '10'))

    assert sent == ['brightness 10 %', 'strobe_period 1 s', 'on']
    assert all(one.confirmed for one in results)


def test_light_is_not_switched_on_after_a_refused_brightness() -> None:
    sent, results = applied(light(), ('brightness', '10'), ('enable', 'true'),
                            refused='brightness 10 %')

    assert sent == ['brightness 10 %']
    assert results == [Result('brightness', '10', confirmed=False, answer='too hot')]


def test_light_is_switched_off_before_anything_else() -> None:
    assert applied(light(), ('brightness', '10'), ('enable', 'false'))[0] == [
        'off', 'brightness 10 %']


def test_gimbal_turns_after_control_is_taken() -> None:
    sent, results = applied(gimbal(in_control=False), ('yaw', '-10'), ('pitch', '45'),
                            ('take_control', 'true'))

    assert sent == ['take control', 'pitch to 45.0 down',
                    'yaw to 10.0 right in base_link_stabilized']
    assert all(one.confirmed for one in results)


def test_gimbal_without_control_is_not_turned() -> None:
    assert applied(gimbal(in_control=False), ('pitch', '45')) == ([], [Result(
        'pitch', '45', confirmed=False,
        answer='not in control (primary 1/193): take control first')])


def test_angle_that_the_gimbal_does_not_show_is_not_confirmed() -> None:
    assert applied(gimbal(), ('pitch', '45'), shows=False)[1] == [Result(
        'pitch', '45', confirmed=False, answer='sent, and not confirmed within 10 s')]


@pytest.mark.parametrize(('settings', 'problem'), [
    ([('brightnes', '3')], 'no setting brightnes; a light has brightness, strobe_duty_cycle, '
     'strobe_period, enable, refresh, release'),
    ([('brightness', '101')], "brightness: '101' is not a number of % from 0 to 100"),
    ([('strobe_period', 'nan')], "strobe_period: 'nan' is not a number of s from 0"),
    ([('enable', 'on')], "enable: 'on' is neither true nor false"),
    ([('refresh', 'false')], "refresh: 'false' is not true"),
    ([('enable', 'true'), ('enable', 'false')], 'a setting is given twice'),
    ([('brightness', '37 %')], '')])
def test_wrong_settings_are_named(settings: list[tuple[str, str]], problem: str) -> None:
    assert in_order(cast(GraphDevice, light()), settings)[1] == problem


def test_exit_status_tells_whether_the_light_confirmed(own_ros: Ros, port: int) -> None:
    environment = {'ROS_DOMAIN_ID': str(own_ros.domain)}
    with ServedLight(port), running_bridge(own_ros.domain, port, until='connected'):
        for arguments, status, text in (
                (['/illuminator', 'brightness=20', 'enable=true'], 0, 'enable=true: confirmed'),
                (['/illuminator', 'strobe_period=1e6', '--json'], 1, '"confirmed": false'),
                (['/illuminator', 'enable=maybe'], 2, 'neither true nor false'),
                (['/belly', 'enable=true'], 1, 'ROS domain'),
                (['/illuminator', 'enable'], 2, "'enable' is not NAME=VALUE")):
            with ended(python('illuminator_ros.set', *arguments, env=environment)) as program:
                program.wait_for(text)
                assert program.wait() == status


def test_shell_completes_names_of_nodes_and_settings(
        own_ros: Ros, port: int, tmp_path: Path) -> None:
    pytest.importorskip('argcomplete')
    found = tmp_path / 'found'
    with ServedLight(port), running_bridge(own_ros.domain, port, until='connected'):
        for line, words in (
                ('set /illu', {'/illuminator'}),
                ('set /illuminator st', {'strobe_duty_cycle=', 'strobe_period='}),
                ('set /belly ', set())):
            # The variables that the function of register-python-argcomplete sets.
            environment = {
                'ROS_DOMAIN_ID': str(own_ros.domain), '_ARGCOMPLETE': '1',
                '_ARGCOMPLETE_IFS': '\n', '_ARGCOMPLETE_STDOUT_FILENAME': str(found),
                'COMP_LINE': line, 'COMP_POINT': str(len(line))}
            with ended(python('illuminator_ros.set', env=environment)) as program:
                assert program.wait() == 0

            given = {word.strip() for word in found.read_text().split('\n')}
            assert {word for word in given if word and not word.startswith('-')} == words
