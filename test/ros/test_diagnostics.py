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

"""What ``/diagnostics`` is made of: names, ids, keys, values, period (DESIGN.md, 3.5)."""

from collections.abc import Callable
import math
import re
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray
import pytest
from support.embedded import resting_bridge
from support.light import ServedLight
from support.processes import ROOT
from support.recording import Recorder
from support.ros import Ros, running_bridge, STREAM
from support.slow import CLOCK

INFORMATION = 396
PROTOCOL = (ROOT / 'doc' / 'protocol.md').read_text()
# What is text by nature; all other values are one number or true or false.
TEXTS = {'url', 'address', 'mode', 'agreed', 'vendor', 'model', 'software_version',
         'hardware_version', 'serial_number', 'node'}
LINK_KEYS = {
    'url', 'open', 'since_s', 'openings', 'peers', 'lights', 'frames_received', 'frames_sent',
    'frames_dropped', 'bytes_received', 'bytes_sent', 'bytes_received_per_s',
    'bytes_sent_per_s', 'crc_errors', 'frames_lost', 'frames_duplicate', 'frames_reordered',
    'loss_percent', 'round_trip_p50_ms', 'round_trip_p95_ms', 'commands_sent',
    'commands_resent', 'commands_unanswered', 'signatures_good', 'signatures_bad',
    'signatures_replayed', 'unsigned_frames', 'signatures_unchecked', 'node',
}
LAMP_KEYS = {
    'address', 'connected', 'heard_s_ago', 'restarts', 'shared_address', 'enabled', 'mode',
    'brightness_percent', 'strobe_period_s', 'strobe_duty_cycle_percent', 'temperature_c',
    'error_flags', 'uptime_s', 'status_s_ago', 'agreed', 'vendor', 'model', 'software_version',
    'hardware_version', 'serial_number', 'node',
}


@pytest.fixture(scope='module')
def settings() -> dict[str, float]:
    return {'diagnostics_period': 0.1}


@pytest.fixture(scope='module')
def recorder(ros: Ros, shared_bridge: Any) -> Recorder:
    """Return the arrays of the module's bridge, with link and lamp."""
    recorder = ros.subscribe(DiagnosticArray, '/diagnostics', STREAM)
    recorder.wait(lambda array: len(array.status) == 2)
    return recorder


def values(status: Any) -> dict[str, str]:
    return {entry.key: entry.value for entry in status.values}


def wait_for(
    recorder: Recorder, part: str, wanted: Callable[[dict[str, str]], Any] = lambda values: True,
) -> dict[str, str]:
    """Wait until the values of the link or the lamp are as wanted, and return them."""
    index = ('link', 'lamp').index(part)
    recorder.clear()
    CLOCK.forward(0.1)
    return values(recorder.wait(
        lambda array: len(array.status) == 2 and wanted(values(array.status[index]))
    ).status[index])


class TestArray:

    def test_it_has_the_link_and_the_lamp(self, recorder: Recorder) -> None:
        # The first arrays may have come before the light's first status: they have no lamp.
        names = [status.name for status in recorder.wait(
            lambda array: len(array.status) == 2).status]

        assert names == ['illuminator: link', 'illuminator: lamp']

    def test_it_comes_once_a_second(self, own_ros: Ros, port: int) -> None:
        with running_bridge(own_ros.domain, port):
            recorder = own_ros.subscribe(DiagnosticArray, '/diagnostics', STREAM)
            for _ in range(3):
                recorder.clear()
                CLOCK.forward(1.0)
                recorder.wait()

    @pytest.mark.parametrize('period', [0.1, 0.3, 1.0, 1.1, 60.0])
    @pytest.mark.parametrize('late', [0.0, 0.1], ids=['looks in time', 'some looks late'])
    def test_its_period_is_a_parameter(
        self, domain: int, monkeypatch: pytest.MonkeyPatch, period: float, late: float,
    ) -> None:
        now, published = 1000.0, []
        with resting_bridge(domain, lambda: now, diagnostics_period=period) as process:
            node, tick = process.node, process._tick
            monkeypatch.setattr(node, 'publish_diagnostics', lambda: published.append(now))
            monkeypatch.setattr(node, '_worst', lambda now: node._levels)

            for look in range(10 * round(period / tick) + 1):
                now = 1000.0 + tick * (look + late * (look % 2))
                node.poll(tick / 2)

        assert published == pytest.approx(
            [1000.0 + number * period for number in range(11)], abs=late * tick + 1e-6)


def test_a_restart_of_the_light_is_no_loss_of_frames(
    recorder: Recorder, light: ServedLight,
) -> None:
    before = wait_for(recorder, 'lamp')
    assert wait_for(recorder, 'link')['loss_percent'] == '0'

    light.lose_frames(60)
    light.restart()

    wait_for(recorder, 'lamp', lambda values: values['restarts'] != before['restarts'])
    assert wait_for(recorder, 'link')['loss_percent'] == '0'


class TestHardwareId:

    def test_the_link_s_is_its_url(self, recorder: Recorder) -> None:
        [link, _] = recorder.wait().status

        assert re.fullmatch(r'udpin://127\.0\.0\.1:\d+', link.hardware_id)

    def test_the_lamp_s_is_its_serial_number(self, recorder: Recorder) -> None:
        [_, lamp] = recorder.wait().status

        assert lamp.hardware_id == 'T-1'

    def test_a_light_without_serial_number_has_its_address_for_it(
        self, own_ros: Ros, port: int,
    ) -> None:
        light = ServedLight(port)
        light.fake.identity = type(light.fake.identity)('maker', 'torch', '', '', '')
        with running_bridge(own_ros.domain, port) as bridge, light:
            recorder = own_ros.subscribe(DiagnosticArray, '/diagnostics', STREAM)
            bridge.wait_for('is maker torch')

            CLOCK.forward(1.0)
            array = recorder.wait(lambda array: len(array.status) == 2)

            assert array.status[1].hardware_id == 'mavlink:1/243'

    def test_it_never_changes_though_the_light_tells_another_later(
        self, own_ros: Ros, port: int,
    ) -> None:
        light = ServedLight(port)
        light.fake.answers.discard(INFORMATION)
        with running_bridge(own_ros.domain, port, diagnostics_period=0.1) as bridge, light:
            recorder = own_ros.subscribe(DiagnosticArray, '/diagnostics', STREAM)
            bridge.wait_for('connected')
            # As long as it is waited for who the light is.
            CLOCK.forward(2.0)
            array = recorder.wait(lambda array: len(array.status) == 2)
            assert array.status[1].hardware_id == 'mavlink:1/243'

            light.send(light.fake.information())

            CLOCK.forward(0.1)
            told = recorder.wait(lambda array: 'serial_number' in values(array.status[-1]))
            assert told.status[1].hardware_id == 'mavlink:1/243'


class TestValues:

    @pytest.mark.parametrize(('part', 'keys'), [('link', LINK_KEYS), ('lamp', LAMP_KEYS)])
    def test_the_keys(self, recorder: Recorder, part: str, keys: set[str]) -> None:
        assert set(wait_for(recorder, part)) == keys

    @pytest.mark.parametrize('part', ['link', 'lamp'])
    def test_the_protocol_page_has_the_keys(self, recorder: Recorder, part: str) -> None:
        _, _, rest = PROTOCOL.partition(f'| value of `illuminator: {part}` |')
        rows = rest.partition('\n\n')[0].splitlines()[2:]
        named = [key for row in rows for key in re.findall('`([^`]+)`', row.split('|')[1])]

        assert sorted(wait_for(recorder, part)) == sorted([*named, 'node'])

    @pytest.mark.parametrize('part', ['link', 'lamp'])
    def test_what_is_no_text_is_one_number_or_a_truth_value(
        self, recorder: Recorder, part: str,
    ) -> None:
        for key, value in wait_for(recorder, part).items():
            if key not in TEXTS and value not in ('true', 'false'):
                assert math.isfinite(float(value)), f'{key}: {value}'

    def test_the_lamp_s_are_those_of_the_newest_status(
        self, light: ServedLight, recorder: Recorder,
    ) -> None:
        light.report(enable=1, mode=2, brightness=35.5, strobe_period=0.5,
                     strobe_duty_cycle=20.0, temp_c=41.25, error_status=0)

        lamp = wait_for(recorder, 'lamp', lambda values: values['temperature_c'] == '41.25')

        assert {key: lamp[key] for key in (
            'enabled', 'mode', 'brightness_percent', 'strobe_period_s',
            'strobe_duty_cycle_percent', 'error_flags', 'connected', 'address', 'vendor',
            'model', 'serial_number')} == {
                'enabled': 'true', 'mode': 'external_sync', 'brightness_percent': '35.5',
                'strobe_period_s': '0.5', 'strobe_duty_cycle_percent': '20',
                'error_flags': '0', 'connected': 'true', 'address': '1/243',
                'vendor': 'maker', 'model': 'torch', 'serial_number': 'T-1'}

    def test_what_was_agreed_stands_beside_what_is_reported(
        self, light: ServedLight, recorder: Recorder,
    ) -> None:
        light.report(mode=1, brightness=90.0, strobe_period=0.0, strobe_duty_cycle=0.0)
        light.report(brightness=45.0, error_status=1)

        lamp = wait_for(recorder, 'lamp', lambda values: values['brightness_percent'] == '45')

        light.report(brightness=90.0, error_status=0)
        assert lamp['agreed'] == ('mode internal_control, brightness 90 %, strobe_period 0 s, '
                                  'strobe_duty_cycle 0 %')

    def test_what_cannot_be_true_has_no_value(
        self, light: ServedLight, recorder: Recorder,
    ) -> None:
        light.report(brightness=math.nan)

        lamp = wait_for(recorder, 'lamp', lambda values: 'brightness_percent' not in values)

        light.report(brightness=90.0)
        assert 'mode' in lamp

    def test_the_link_counts(self, light: ServedLight, recorder: Recorder) -> None:
        before = wait_for(recorder, 'link')

        after = wait_for(recorder, 'link', lambda values: (
            int(values['frames_received']) >= int(before['frames_received']) + 3))

        assert int(after['bytes_received']) > int(before['bytes_received'])
        assert (after['open'], after['peers'], after['lights']) == ('true', '1', '1')
