# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The texts of the monitor for people, and its output for scripts."""

import json
import re

from illuminator_ros.cli.monitor.table import as_json, level, off_report, plain, report
from illuminator_ros.ros.monitor_view import (
    BROKEN,
    DANGEROUS,
    Device,
    Diagnosis,
    DONE,
    FAILED,
    FINE,
    NEWS_LIFETIME,
)
import pytest
from support.monitor import camera, diagnosed, gimbal, light, NOW


def test_table_has_a_heading_and_a_row_for_each_device() -> None:
    lines = plain([light(), light('/stern', connected=False), gimbal(), camera()])

    assert [re.split(' {2,}', line, maxsplit=3) for line in lines] == [
        ['DEVICE', 'STATE', 'LEVEL', 'REPORT'],
        ['/bow', 'off', 'WARN', 'dimmed because it is hot; 40 %  41.5 C  steady  internal'],
        ['/stern', 'LOST', 'WARN', 'dimmed because it is hot; 40 %  41.5 C  steady  internal'],
        ['/gimbal', 'ours', 'OK',
         'primary 1/193  pitch 28.6 down  yaw 14.3 right in base_link_stabilized'],
        ['/camera', 'ok', 'WARN',
         'nothing received on ~/imu; 7  12 ms  fix  47.300000 8.500000 480.0 m']]


def test_unknown_values_are_dashes() -> None:
    one = light()
    one.values.clear()
    one.diagnoses.clear()

    assert plain([one])[1].split() == ['/bow', '?', *'-----']


def test_json_has_all_values_and_null_for_what_is_unknown() -> None:
    loaded = json.loads(as_json([light(brightness=None), gimbal(), camera()]))

    first, second, _ = loaded
    assert (first['name'], first['kind'], first['state']) == ('/bow', 'light', 'off')
    assert (first['values']['enabled'], first['values']['brightness']) == (False, None)
    assert first['diagnostics']['lamp']['level'] == 'WARN'
    assert first['diagnostics']['link']['values']['loss_percent'] == '12.3'
    assert second['values']['angles'] == ['base_link_stabilized', 0.0, 0.5, -0.25]


def gone(one: Device) -> Device:
    """Return a device that is gone."""
    one.is_gone = True
    return one


def disobeying(one: Device) -> Device:
    """Return a device that has not confirmed an OFF."""
    one.off = FAILED, 'no answer'
    return one


@pytest.mark.parametrize(('one', 'attention', 'text'), [
    (diagnosed(light(enabled=True), lamp=0, link=0), FINE, 'OK'),
    (diagnosed(light(enabled=True), lamp=1, link=0), DANGEROUS, 'WARN!'),
    (diagnosed(light(enabled=True), lamp=2, link=0), DANGEROUS, 'ERROR!'),
    (diagnosed(light(enabled=True), lamp=0, link=1), BROKEN, 'WARN'),
    (diagnosed(light(enabled=True, connected=False), lamp=2, link=2), DANGEROUS, 'ERROR!'),
    (disobeying(diagnosed(light(enabled=True), lamp=0)), DANGEROUS, 'OK!'),
    (disobeying(diagnosed(light(), lamp=0)), FINE, 'OK'),
    (diagnosed(light(), lamp=2), BROKEN, 'ERROR'),
    (diagnosed(light(), lamp=1, link=3), BROKEN, 'WARN'),
    # OK is out of date where nothing is heard.
    (gone(diagnosed(light(), lamp=0, link=0)), BROKEN, 'STALE'),
    (gone(diagnosed(gimbal(), device=0)), BROKEN, 'STALE'),
    (diagnosed(camera(), camera=1), BROKEN, 'WARN'),
    (diagnosed(gimbal()), FINE, '-')])
def test_level_says_what_needs_attention_and_what_is_dangerous(
    one: Device, attention: int, text: str,
) -> None:
    [shown] = level(one)

    assert (one.attention, shown if isinstance(shown, str) else shown[0]) == (attention, text)


def text_of(one: Device) -> str:
    """Return the report of a device without styles."""
    return ''.join(cell if isinstance(cell, str) else cell[0] for cell in report(one))


def test_report_begins_with_what_is_new_and_ends_with_the_values() -> None:
    one = light(enabled=True)
    one.action = 'on', DONE, 'confirmed', NOW
    silence = 'off_after_silence (30 s)'
    one.news = f'light 1/243 was switched off by {silence}', NOW
    one.diagnoses['lamp'] = Diagnosis(1, 'dimmed because it is hot', {'off_in_s': '12.3'})

    assert text_of(one).startswith(
        f'on: done; was switched off by {silence}; off in 12 s '
        '(o: keep on); dimmed because it is hot; 40 %  41.5 C')
    # The request itself is said once.
    one.news = 'light 1/243 was switched on by service', NOW
    assert text_of(one).startswith('on: done; off in 12 s')
    one.news = one.news[0], NOW + 5
    assert text_of(one).startswith('on: done; was switched on by service; off in 12 s')
    one.now = one.heard_at = NOW + 5 + NEWS_LIFETIME
    assert text_of(one).startswith('off in 12 s (o: keep on); dimmed because it is hot')
    one.values['connected'] = False
    assert text_of(one).startswith('was ON; dimmed')


def test_gone_device_shows_nothing_as_ok() -> None:
    one = gone(diagnosed(light(), lamp=0, link=0))

    assert ' OK' not in ' '.join(plain([one]))


def test_several_nodes_of_one_name_are_a_finding_since_their_values_are_mixed() -> None:
    one = diagnosed(light(), lamp=0)
    one.nodes = 2

    assert text_of(one).startswith('2 nodes with this name; 40 %')
    assert (one.attention, level(one)) == (BROKEN, [('WARN', 'yellow')])


def test_all_off_counts_the_confirmed_and_names_the_others() -> None:
    cells = off_report([('/bow', DONE, 'off'), ('/stern', FAILED, 'no answer, trying again')])

    assert ''.join(cell if isinstance(cell, str) else cell[0] for cell in cells) == (
        'ALL OFF: 1 of 2 confirmed; /stern FAILED: no answer, trying again')
    cells = off_report([('/bow', DONE, 'off'), ('/stern', DONE, 'off, confirmed')])
    assert ''.join(cell if isinstance(cell, str) else cell[0] for cell in cells) == (
        'ALL OFF: 2 of 2 confirmed: /bow, /stern')
