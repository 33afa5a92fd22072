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

"""The light's side: the two commands that change it, and what they do not let in."""

from illuminator_ros.illuminator.simulated import describe
from illuminator_ros.illuminator.simulated_properties import IlluminatorProperties
from illuminator_ros.illuminator.thermal import ThermalProperties
from illuminator_ros.mavlink.messages import (
    Address,
    CommandInt,
    CommandLong,
    decode_payload,
    encode_payload,
    IlluminatorStatus,
    INFORMATION_ID,
    MavCmd,
    MavResult,
    STATUS_ID,
)
from illuminator_ros.payload.simulated import SimulatedComponent
import pytest

GROUND = Address(255, 190)
NAN, INF = float('nan'), float('inf')
ON_OFF, CONFIGURE = MavCmd.ILLUMINATOR_ON_OFF, MavCmd.DO_ILLUMINATOR_CONFIGURE
ACCEPTED, DENIED = MavResult.ACCEPTED, MavResult.DENIED


def fresh(now=0.0, **properties):
    return SimulatedComponent(describe(IlluminatorProperties(**properties)), now)


def send(device, command, *params, form=CommandLong, now=0.0):
    """Return the result of a command that went over the wire, and what came after it."""
    values = [*params, *[0.0] * (7 - len(params))]
    message = (CommandInt(0, 0, 0, command, 0, 0, *values[:4], 0, 0, 0.0)
               if form is CommandInt else CommandLong(0, 0, command, 0, *values))
    device.receive(GROUND, decode_payload(message.id, encode_payload(message)), now)
    (_, ack), *rest = device.outgoing
    device.outgoing.clear()
    return MavResult(ack.result), [message for _, message in rest]


def shown(device, now=0.0):
    """Return mode, brightness, strobe period and duty cycle as the status shows them."""
    status = device.device.status(now)
    return (status.mode, status.brightness, status.strobe_period, status.strobe_duty_cycle)


@pytest.mark.parametrize('form', [CommandLong, CommandInt])
def test_on_and_off_are_done_and_followed_by_a_status(form):
    device = fresh()
    for value in (1, 0):
        result, (status,) = send(device, ON_OFF, value, form=form)
        assert (result, status.enable) == (ACCEPTED, value)


@pytest.mark.parametrize('value', [-1, 2, 0.5, 1.5, 255, NAN, INF, -INF])
def test_on_off_with_anything_else_is_denied_and_changes_nothing(value):
    device = fresh()
    send(device, ON_OFF, 1)
    assert send(device, ON_OFF, value) == (DENIED, [])
    assert device.device.lamp.enabled is True


@pytest.mark.parametrize('params', [
    (1, 100, 0, 0), (2, 0, 0, 100), (1, 50, 1, 50), (1, 33.3, 10, 0), (2, 100, 0.05, 100),
])
@pytest.mark.parametrize('form', [CommandLong, CommandInt])
def test_a_configuration_is_done_and_followed_by_a_status(params, form):
    device = fresh()
    result, (status,) = send(device, CONFIGURE, *params, form=form)
    assert result == ACCEPTED
    assert (status.mode, status.brightness, status.strobe_period,
            status.strobe_duty_cycle) == pytest.approx(params)


@pytest.mark.parametrize(('position', 'value'), [
    *((0, value) for value in (0, -1, 3, 1.5, 255, NAN, INF)),
    *((1, value) for value in (-1, -0.001, 100.001, 101, NAN, INF, -INF)),
    *((2, value) for value in (-1, 0.04, 10.01, 1e30, NAN, INF, -INF)),
    *((3, value) for value in (-1, -0.001, 100.001, 101, NAN, INF, -INF)),
])
def test_one_wrong_value_denies_the_whole_configuration(position, value):
    device = fresh()
    before = shown(device)
    params = [2, 50, 1, 25]
    params[position] = value
    assert send(device, CONFIGURE, *params) == (DENIED, [])
    assert shown(device) == before


def test_a_change_is_no_news_to_whom_the_stream_is_off():
    device = fresh(status_interval=0.0)
    assert send(device, ON_OFF, 1) == (ACCEPTED, [])


def test_switching_does_not_change_the_configuration_nor_the_other_way_round():
    device = fresh()
    send(device, CONFIGURE, 2, 50, 1, 25)
    send(device, ON_OFF, 1)
    assert shown(device) == (2, 50, 1, 25)
    send(device, CONFIGURE, 1, 60, 0, 0)
    assert device.device.lamp.enabled is True


# What the developer guide's emulator is tested for, one row for each of the 18 tests: what is
# done before, the command with its params, its result, and what the light then sends or shows.
GUIDE = {
    'status_request': (
        [(MavCmd.SET_MESSAGE_INTERVAL, STATUS_ID, -1)],
        (MavCmd.REQUEST_MESSAGE, STATUS_ID), ACCEPTED, {'sent': STATUS_ID}),
    'status_stream': (
        [], (MavCmd.SET_MESSAGE_INTERVAL, STATUS_ID, 0), ACCEPTED, {'streamed': STATUS_ID}),
    'component_information_basic_request': (
        [], (MavCmd.REQUEST_MESSAGE, INFORMATION_ID), ACCEPTED, {'sent': INFORMATION_ID}),
    'on_off_lowerbound': ([], (ON_OFF, -1), DENIED, {'enable': 0}),
    'on_off_upperbound': ([], (ON_OFF, 2), DENIED, {'enable': 0}),
    'turning_on': ([], (ON_OFF, 1), ACCEPTED, {'enable': 1}),
    'turning_off': ([(ON_OFF, 1)], (ON_OFF, 0), ACCEPTED, {'enable': 0}),
    'mode_internal_control': (
        [(CONFIGURE, 2, 100, 0, 0)], (CONFIGURE, 1, 100, 0, 0), ACCEPTED,
        {'shown': (1, 100, 0, 0)}),
    'mode_external_sync': (
        [], (CONFIGURE, 2, 100, 0, 0), ACCEPTED, {'shown': (2, 100, 0, 0)}),
    'mode_lowerbound': ([], (CONFIGURE, -1, 100, 0, 0), DENIED, {'shown': (1, 100, 0, 0)}),
    'mode_upperbound': ([], (CONFIGURE, 3, 100, 0, 0), DENIED, {'shown': (1, 100, 0, 0)}),
    'brightness': ([], (CONFIGURE, 1, 50, 0, 0), ACCEPTED, {'shown': (1, 50, 0, 0)}),
    'brightness_lowerbound': ([], (CONFIGURE, 1, -1, 0, 0), DENIED, {'shown': (1, 100, 0, 0)}),
    'brightness_upperbound': ([], (CONFIGURE, 1, 101, 0, 0), DENIED, {'shown': (1, 100, 0, 0)}),
    'strobe': (
        [(CONFIGURE, 1, 100, 0.5, 25)], (CONFIGURE, 1, 100, 1, 50), ACCEPTED,
        {'shown': (1, 100, 1, 50)}),
    'strobe_period_lowerbound': (
        [], (CONFIGURE, 1, 100, -1, 50), DENIED, {'shown': (1, 100, 0, 0)}),
    'strobe_duty_lowerbound': (
        [], (CONFIGURE, 1, 100, 1, -1), DENIED, {'shown': (1, 100, 0, 0)}),
    'strobe_duty_upperbound': (
        [], (CONFIGURE, 1, 100, 1, 101), DENIED, {'shown': (1, 100, 0, 0)}),
}


@pytest.mark.parametrize(('before', 'command', 'result', 'then'), GUIDE.values(), ids=GUIDE)
def test_it_passes_what_the_developer_guide_tests(before, command, result, then):
    device = fresh()
    for step in before:
        assert send(device, *step)[0] == ACCEPTED
    actual, messages = send(device, *command)
    assert actual == result
    if 'sent' in then:
        assert [message.id for message in messages] == [then['sent']]
    if 'streamed' in then:
        for now in (1.0, 2.0, 3.0):
            device.poll(now)
        assert [m.id for _, m in device.outgoing].count(then['streamed']) == 3
    if 'enable' in then:
        assert device.device.status(0.0).enable == then['enable']
    if 'shown' in then:
        assert shown(device) == then['shown']


HOT = ThermalProperties(ambient=40.0, rise=80.0, time_constant=10.0)


def lit(seconds, **changes):
    """Return the status of a light that has been on at full power for a time (s)."""
    device = fresh(thermal=HOT, status_interval=0.0, **changes)
    send(device, ON_OFF, 1)
    while device.next_deadline() <= seconds:
        device.poll(device.next_deadline())
    device.outgoing.clear()
    return device


def test_a_light_that_is_on_gets_warm_and_one_that_is_off_does_not():
    device = lit(3.0)
    assert device.device.status(3.0).temp_c > 45.0
    off = fresh(thermal=HOT)
    assert off.device.status(100.0).temp_c == pytest.approx(40.0)


def test_a_hot_light_says_so_and_shows_the_brightness_that_it_still_gives():
    device = lit(8.0)
    status = device.device.status(8.0)
    assert isinstance(status, IlluminatorStatus)
    assert (status.error_status, status.brightness, status.enable) == (1, 50.0, 1)


def test_a_light_that_has_cooled_down_is_as_bright_as_it_was_told_to_be():
    device = lit(8.0)
    send(device, ON_OFF, 0, now=8.0)
    status = device.device.status(60.0)
    assert (status.error_status, status.brightness) == (0, 100.0)


@pytest.mark.parametrize(('brightness', 'period', 'duty', 'rise'), [
    (100, 1, 10, 8.0),
    (50, 1, 50, 20.0),
    (40, 0, 10, 32.0),      # no strobe
    (40, 1, 0, 0.0),        # a strobe that is never lit
])
def test_a_strobe_heats_by_its_duty_cycle(brightness, period, duty, rise):
    device = fresh(thermal=HOT)
    send(device, ON_OFF, 1)
    send(device, CONFIGURE, 1, brightness, period, duty)
    assert device.device.status(100.0).temp_c == pytest.approx(40.0 + rise, abs=0.1)


def test_time_can_be_scaled():
    assert lit(1.0, time_scale=8.0).device.status(1.0).error_status == 1
