# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""``/diagnostics`` as published: names, hardware ids, keys, period, and changes of level."""

import math
import re

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
import pytest
from support.light import CONFIGURE, ServedLight
from support.ros import Parameters, Ros, running_bridge, STREAM
from support.slow import CLOCK
from support.tables import diagnostic_values

INFORMATION = 396
# The values that are text; each other value is one number, true or false.
TEXTS = {'url', 'address', 'mode', 'agreed', 'holder', 'vendor', 'model', 'software_version',
         'hardware_version', 'serial_number', 'node', 'not_forwarded'}


def values(status: DiagnosticStatus) -> dict[str, str]:
    return {entry.key: entry.value for entry in status.values}


def complete(array: DiagnosticArray) -> bool:
    """Return whether an array has a lamp, too: the light's first status has arrived."""
    return len(array.status) == 2


@pytest.mark.parametrize('period', [0.5, 1.0])
def test_array_is_published_once_in_each_diagnostics_period(
    own_ros: Ros, port: int, period: float,
) -> None:
    with running_bridge(own_ros.domain, port, diagnostics_period=period):
        recorder = own_ros.subscribe(DiagnosticArray, '/diagnostics', STREAM)
        for count in range(1, 5):
            CLOCK.forward(period)
            recorder.wait(count=count)
        own_ros.synchronize()

        # The initial level, which is published at once, may be among them.
        assert len(recorder.messages) <= 5


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


def test_statuses_have_the_keys_of_the_protocol_page_and_a_change_of_level_comes_at_once(
    own_ros: Ros, port: int,
) -> None:
    # The period is so long that only changes of level are published soon.
    with running_bridge(own_ros.domain, port, diagnostics_period=60.0, off_after_silence=60.0,
                        sources="['safety']"), ServedLight(port) as light:
        recorder = own_ros.subscribe(DiagnosticArray, '/diagnostics', STREAM)
        parameters = Parameters(own_ros)
        parameters.wait(mode='internal_control')
        # Then the source `default` holds the light.
        own_ros.enable(True)
        light.report(error_status=2)
        array = recorder.wait(
            lambda array: complete(array) and array.status[1].level == DiagnosticStatus.ERROR)
        recorder.clear()
        light.report(error_status=0)
        recorder.wait(
            lambda array: complete(array) and array.status[1].level == DiagnosticStatus.OK)
        light.fake.applies = False
        call = parameters.start_set(brightness=30.0)
        light.wait_for(CONFIGURE)
        # A status of the same millisecond as the one before may be older than the command.
        CLOCK.forward(0.01)
        own_ros.catch_up()
        CLOCK.forward(0.9)
        assert not call.result().results[0].successful
        recorder.wait(lambda array: complete(array)
                      and array.status[1].level == DiagnosticStatus.WARN
                      and 'brightness 30 % not confirmed' in array.status[1].message)

    for part, status in zip(('link', 'lamp'), array.status, strict=True):
        assert status.name == f'illuminator: {part}'
        assert values(status).keys() == diagnostic_values('protocol', status.name) | {'node'}
        for key, value in values(status).items():
            if key not in TEXTS and value not in ('true', 'false'):
                assert math.isfinite(float(value)), key
    assert re.fullmatch(r'udpin://127\.0\.0\.1:\d+', array.status[0].hardware_id)
    assert array.status[1].hardware_id == 'T-1'
