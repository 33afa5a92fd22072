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

"""The output of the monitor for scripts."""

import json
import re

from illuminator_ros.cli.monitor.table import as_json, plain
from support.monitor import camera, gimbal, light


def test_table_has_a_heading_and_a_row_for_each_device_of_a_kind() -> None:
    lines = plain([light(), light('/stern', connected=False), gimbal(), camera()])

    heading, *rows = [re.split(' {2,}', line) for line in lines[:3]]
    assert heading == ['LIGHT', 'STATE', 'BRIGHT', 'TEMP', 'STROBE', 'MODE', 'SOURCE', 'LOSS',
                       'RTT', 'DIAGNOSTICS']
    assert rows == [[name, state, '40 %', '41.5 C', 'steady', 'internal', '-', '12 %', '3.2 ms',
                     'WARN: dimmed because it is hot']
                    for name, state in (('/bow', 'off'), ('/stern', 'LOST'))]
    assert [line.split()[:2] for line in lines[3:]] == [
        [], ['GIMBAL', 'STATE'], ['/gimbal', 'ours'], [], ['CAMERA', 'STATE'], ['/camera', 'ok']]


def test_unknown_values_are_dashes() -> None:
    one = light()
    one.values.clear()
    one.diagnoses.clear()

    assert plain([one])[1].split() == ['/bow', '?', *'--------']


def test_json_has_all_values_and_null_for_what_is_unknown() -> None:
    loaded = json.loads(as_json([light(brightness=None), gimbal(), camera()]))

    first, second, _ = loaded
    assert (first['name'], first['kind'], first['state']) == ('/bow', 'light', 'off')
    assert (first['values']['enabled'], first['values']['brightness']) == (False, None)
    assert first['diagnostics']['lamp']['level'] == 'WARN'
    assert first['diagnostics']['link']['values']['loss_percent'] == '12.3'
    assert second['values']['angles'] == ['base_link_stabilized', 0.0, 0.5, -0.25]
