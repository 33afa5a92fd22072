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

"""Parameters show the light, whichever sender has changed it."""

import math

import pytest
from support.light import CONFIGURE, ServedLight
from support.processes import Program
from support.recording import Recorder
from support.ros import Parameters, Ros

THROTTLING = 1
# s between two lines about changes by another sender, at least.
LOG_INTERVAL = 1.0
START = {'mode': 'internal_control', 'brightness': 80.0, 'strobe_period': 0.0,
         'strobe_duty_cycle': 0.0}


@pytest.fixture
def events(light: ServedLight, parameters: Parameters) -> Recorder:
    """Return the parameter events from now on; each test begins with the same configuration."""
    light.report(mode=1, brightness=80.0, strobe_period=0.0, strobe_duty_cycle=0.0,
                 error_status=0)
    parameters.wait(**START)
    light.forget()
    return parameters.events()


@pytest.mark.parametrize(('report', 'shown', 'line'), [
    ({'brightness': 35.0}, {'brightness': 35.0}, 'brightness 35 %'),
    ({'mode': 2}, {'mode': 'external_sync'}, 'mode external_sync'),
    ({'strobe_duty_cycle': 12.5}, {'strobe_duty_cycle': 12.5}, 'strobe_duty_cycle 12.5 %'),
    ({'brightness': 36.0, 'strobe_period': 2.0}, {'brightness': 36.0, 'strobe_period': 2.0},
     'brightness 36 %, strobe_period 2 s'),
])
def test_change_by_another_sender_moves_parameters_with_one_line_one_event_and_no_command(
    ros: Ros, light: ServedLight, parameters: Parameters, bridge: Program, events: Recorder,
    report: dict[str, float], shown: dict[str, object], line: str,
) -> None:
    ros.outlast(LOG_INTERVAL, ['/illuminator'])
    lines = len(bridge.lines)

    light.report(**report)

    parameters.wait(**shown)
    ros.catch_up()
    [told] = [line for line in bridge.lines[lines:] if 'was changed' in line]
    assert told.startswith('[INFO]') and f'light 1/243 was changed: {line}' in told
    assert {p.name for p in events.wait().changed_parameters} == set(shown)
    assert len(events.messages) == 1
    assert light.commands(CONFIGURE) == []


@pytest.mark.parametrize('reports', [
    # Float32 carries 60.1 as 60.099998.
    [{'brightness': 80.000003}, {}],
    [{'brightness': 40.0, 'error_status': THROTTLING}, {'brightness': 80.0, 'error_status': 0}],
    [{'mode': 0}, {'mode': 1}],
    [{'brightness': math.nan}, {'brightness': 80.0}],
], ids=['rounding', 'throttling', 'unknown mode', 'implausible'])
def test_report_that_is_no_change_makes_no_line_no_event_and_no_command(
    ros: Ros, light: ServedLight, parameters: Parameters, bridge: Program, events: Recorder,
    reports: list[dict[str, float]],
) -> None:
    lines = bridge.count('was changed')

    for report in reports:
        light.report(**report)
        ros.catch_up()

    assert parameters.get(*START) == list(START.values())
    assert events.messages == []
    assert bridge.count('was changed') == lines
    assert light.commands(CONFIGURE) == []
