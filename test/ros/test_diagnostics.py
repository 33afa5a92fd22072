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

"""The content of ``/diagnostics``: names, hardware ids, keys, values, period."""

from collections.abc import Callable
import math
import re

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
import pytest
from support.light import ServedLight
from support.processes import ROOT
from support.recording import Recorder
from support.ros import Ros, running_bridge, STREAM
from support.slow import CLOCK

INFORMATION = 396
PROTOCOL = (ROOT / 'doc' / 'protocol.md').read_text()
# The values that are text; all others are one number, or true or false.
TEXTS = {'url', 'address', 'mode', 'agreed', 'holder', 'vendor', 'model', 'software_version',
         'hardware_version', 'serial_number', 'node'}
PARTS = ('link', 'lamp')
Values = dict[str, str]


@pytest.fixture(scope='module')
def settings() -> dict[str, object]:
    return {'diagnostics_period': 0.1, 'sources': "['safety']"}


@pytest.fixture(scope='module')
def recorder(ros: Ros, shared_bridge: object) -> Recorder:
    """Return the arrays of the module's bridge, from the first with link and lamp on."""
    recorder = ros.subscribe(DiagnosticArray, '/diagnostics', STREAM)
    wait_for(recorder, 'lamp')
    return recorder


def values(status: DiagnosticStatus) -> Values:
    return {entry.key: entry.value for entry in status.values}


def complete(array: DiagnosticArray) -> bool:
    """Return whether an array has a lamp, too: the light's first status has come."""
    return len(array.status) == 2


def wait_for(
    recorder: Recorder, part: str, wanted: Callable[[Values], object] = lambda values: True,
) -> Values:
    """Wait until the values of the link or the lamp are as wanted, and return them."""
    index = PARTS.index(part)
    recorder.clear()
    CLOCK.forward(0.1)
    return values(recorder.wait(
        lambda array: complete(array) and wanted(values(array.status[index]))).status[index])


def test_array_has_link_and_lamp_with_url_and_serial_number_as_hardware_ids(
    recorder: Recorder,
) -> None:
    link, lamp = recorder.wait(complete).status

    assert (link.name, lamp.name) == ('illuminator: link', 'illuminator: lamp')
    assert re.fullmatch(r'udpin://127\.0\.0\.1:\d+', link.hardware_id)
    assert lamp.hardware_id == 'T-1'


@pytest.mark.parametrize('period', [1.0, 2.0])
def test_array_is_published_once_in_each_diagnostics_period(
    own_ros: Ros, port: int, period: float,
) -> None:
    with running_bridge(own_ros.domain, port, diagnostics_period=period):
        recorder = own_ros.subscribe(DiagnosticArray, '/diagnostics', STREAM)
        # A level may change at the beginning, which is published at once.
        CLOCK.forward(period)
        recorder.wait()
        for _ in range(3):
            recorder.clear()
            CLOCK.forward(period)
            recorder.wait()
            assert len(recorder.messages) == 1


def test_hardware_id_of_a_light_without_serial_number_is_its_address_and_never_changes(
    own_ros: Ros, port: int,
) -> None:
    light = ServedLight(port)
    light.fake.answers.discard(INFORMATION)
    with running_bridge(own_ros.domain, port, diagnostics_period=0.1) as bridge, light:
        recorder = own_ros.subscribe(DiagnosticArray, '/diagnostics', STREAM)
        bridge.wait_for('connected')
        # The bridge waits so long for the identity.
        CLOCK.forward(2.0)
        assert recorder.wait(complete).status[1].hardware_id == 'mavlink:1/243'

        light.send(light.fake.information())

        CLOCK.forward(0.1)
        told = recorder.wait(lambda array: 'serial_number' in values(array.status[-1]))
        assert told.status[1].hardware_id == 'mavlink:1/243'


@pytest.mark.parametrize('part', PARTS)
def test_keys_are_those_of_the_protocol_page_and_values_parse(
    ros: Ros, light: ServedLight, recorder: Recorder, part: str,
) -> None:
    # Then the source `default` holds the light.
    ros.enable(False)
    _, _, rest = PROTOCOL.partition(f'| value of `illuminator: {part}` |')
    rows = rest.partition('\n\n')[0].splitlines()[2:]
    documented = [key for row in rows for key in re.findall('`([^`]+)`', row.split('|')[1])]

    published = wait_for(recorder, part)

    assert sorted(published) == sorted([*documented, 'node'])
    for key, value in published.items():
        if key not in TEXTS and value not in ('true', 'false'):
            assert math.isfinite(float(value)), key


def test_lamp_values_are_those_of_the_light(light: ServedLight, recorder: Recorder) -> None:
    light.report(enable=1, mode=2, brightness=35.5, strobe_period=0.5,
                 strobe_duty_cycle=20.0, temp_c=41.25, error_status=0)

    lamp = wait_for(recorder, 'lamp', lambda values: values['temperature_c'] == '41.25')

    assert lamp.items() >= {
        'enabled': 'true', 'mode': 'external_sync', 'brightness_percent': '35.5',
        'strobe_period_s': '0.5', 'strobe_duty_cycle_percent': '20', 'error_flags': '0',
        'connected': 'true', 'address': '1/243', 'vendor': 'maker', 'model': 'torch',
        'serial_number': 'T-1'}.items()


def test_throttled_light_has_the_agreed_configuration_beside_the_reported_one(
    light: ServedLight, recorder: Recorder,
) -> None:
    light.report(mode=1, brightness=90.0, strobe_period=0.0, strobe_duty_cycle=0.0)
    light.report(brightness=45.0, error_status=1)

    lamp = wait_for(recorder, 'lamp', lambda values: values['brightness_percent'] == '45')

    light.report(brightness=90.0, error_status=0)
    assert lamp['agreed'] == ('mode internal_control, brightness 90 %, strobe_period 0 s, '
                              'strobe_duty_cycle 0 %')


def test_link_values_count_frames_and_bytes(light: ServedLight, recorder: Recorder) -> None:
    before = wait_for(recorder, 'link')

    after = wait_for(recorder, 'link', lambda values: (
        int(values['frames_received']) >= int(before['frames_received']) + 3))

    assert int(after['bytes_received']) > int(before['bytes_received'])
    assert (after['open'], after['peers'], after['lights']) == ('true', '1', '1')


def test_restart_of_the_light_is_not_a_loss_of_frames(
    recorder: Recorder, light: ServedLight,
) -> None:
    before = wait_for(recorder, 'lamp')
    assert wait_for(recorder, 'link')['loss_percent'] == '0'

    light.lose_frames(60)
    light.restart()

    wait_for(recorder, 'lamp', lambda values: values['restarts'] != before['restarts'])
    assert wait_for(recorder, 'link')['loss_percent'] == '0'
