# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The simulated light follows the illuminator, heartbeat, command and interval protocols."""

from collections.abc import Iterable
from typing import Any

from illuminator_ros.illuminator.messages import IlluminatorStatus
from illuminator_ros.illuminator.simulated import SimulatedIlluminator
from illuminator_ros.illuminator.simulated_properties import IlluminatorProperties
from illuminator_ros.illuminator.thermal import ThermalProperties
from illuminator_ros.mavlink import messages as mav
from illuminator_ros.mavlink.dialect import encode, mavlink
from illuminator_ros.simulation.simulated import SimulatedComponents
import pytest
from support.bench import GROUND
from support.light_bench import LightBench

NAN, INF = float('nan'), float('inf')
ON_OFF, CONFIGURE = mavlink.MAV_CMD_ILLUMINATOR_ON_OFF, mavlink.MAV_CMD_DO_ILLUMINATOR_CONFIGURE
REQUEST, SET_INTERVAL = mavlink.MAV_CMD_REQUEST_MESSAGE, mavlink.MAV_CMD_SET_MESSAGE_INTERVAL
ACCEPTED, DENIED = mavlink.MAV_RESULT_ACCEPTED, mavlink.MAV_RESULT_DENIED
HOT: dict[str, Any] = {
    'ambient': 40.0, 'thermal': ThermalProperties(rise=80.0, time_constant=10.0)}


@pytest.fixture
def bench() -> LightBench:
    bench = LightBench()
    bench.run(0.5)
    bench.sent.clear()
    return bench


def statuses(messages: Iterable[Any]) -> list[IlluminatorStatus]:
    return [message for message in messages if isinstance(message, IlluminatorStatus)]


def test_a_stream_keeps_its_rate_when_polled_late_and_leaves_out_what_it_missed() -> None:
    bench = LightBench(status_interval=0.1)
    for turn in range(101):
        bench.component.schedule.run(turn * 0.1 + 0.03)
    for now in (60.2, 60.21):
        bench.component.schedule.run(now)
    assert len(statuses(message for _, message in bench.component.outgoing)) == 102


def test_the_uptime_counts_from_the_start_and_wraps_at_32_bits(bench: LightBench) -> None:
    assert bench.lamp.uptime_ms(1.234) == 1234
    assert bench.lamp.uptime_ms(2 ** 32 / 1000 + 1.5) == 1500


def test_strings_that_are_too_long_are_cut_and_terminated() -> None:
    bench = LightBench(vendor='v' * 40, model='m' * 40, software_version='s' * 40,
                       hardware_version='h' * 40, serial_number='n' * 40)
    _, information = bench.command(REQUEST, mav.INFORMATION_ID)
    assert encode(information)[16:] == (
        b'v' * 31 + b'\0' + b'm' * 31 + b'\0' + b's' * 23 + b'\0' + b'h' * 23 + b'\0'
        + b'n' * 31 + b'\0')


@pytest.mark.parametrize(('target', 'enabled'), [((1, 244), [False, True]), ((0, 0), [True] * 2)])
def test_lights_on_one_link_obey_only_their_own_commands(
    target: tuple[int, int], enabled: list[bool],
) -> None:
    lights = SimulatedComponents([
        SimulatedIlluminator(IlluminatorProperties(mav.Address(1, one))) for one in (243, 244)],
        0.0)
    lights.receive(GROUND, mav.CommandLong(*target, ON_OFF, 0, 1, 0, 0, 0, 0, 0, 0), 0.0)
    assert [light.device.enabled for light in lights.components] == enabled
    assert len({source for source, _ in lights.outgoing}) == sum(enabled)


@pytest.mark.parametrize('form', [mav.CommandLong, mav.CommandInt])
def test_a_change_is_acknowledged_then_applied_then_reported(
    bench: LightBench, form: type[mav.CommandLong | mav.CommandInt],
) -> None:
    for value in (1, 0):
        ack, status = bench.command(ON_OFF, value, form=form)
        assert (ack.result, status.enable) == (ACCEPTED, value)
    for params in ((1, 100, 0, 0), (2, 0, 0, 100), (1, 50, 1, 50), (1, 33.3, 10, 0)):
        ack, status = bench.command(CONFIGURE, *params, form=form)
        assert (ack.result, bench.shown()) == (ACCEPTED, params)
        assert status.brightness == params[1]


def test_a_restart_resets_the_settings_and_keeps_the_temperature() -> None:
    bench = LightBench()
    bench.command(ON_OFF, 1)
    bench.command(CONFIGURE, 2, 50, 1, 10)
    bench.lamp.heat_to(60.0, 0.0)
    bench.now = 100.0
    bench.component.restart(bench.now)
    bench.sent.clear()
    assert isinstance(bench.run(0.0).sent[0][1], mav.Heartbeat)
    status = bench.status()
    assert (status.uptime_ms, status.enable, status.temp_c) == (0, 0, 60.0)
    assert bench.shown() == (1, 100.0, 0, 0)


def test_a_light_that_is_on_heats_and_dims_and_recovers() -> None:
    bench = LightBench(**HOT, status_interval=0.0)
    bench.now = 100.0
    assert bench.status().temp_c == pytest.approx(40.0)
    bench.command(ON_OFF, 1)
    bench.run(3.0)
    assert bench.status().temp_c > 45.0
    bench.run(5.0)
    status = bench.status()
    assert (status.error_status, status.brightness, status.enable) == (1, 50.0, 1)
    bench.command(ON_OFF, 0)
    bench.run(52.0)
    assert (bench.status().error_status, bench.status().brightness) == (0, 100.0)


@pytest.mark.parametrize(('brightness', 'period', 'duty_cycle', 'rise'), [
    (100, 1, 10, 8.0), (50, 1, 50, 20.0), (40, 0, 10, 32.0), (40, 0, 0, 32.0), (100, 1, 0, 0.0)])
def test_a_strobe_heats_by_its_duty_cycle_and_not_at_0_percent(
    brightness: float, period: float, duty_cycle: float, rise: float,
) -> None:
    bench = LightBench(**HOT)
    bench.command(ON_OFF, 1)
    bench.command(CONFIGURE, 1, brightness, period, duty_cycle)
    bench.now = 100.0
    assert bench.status().temp_c == pytest.approx(40.0 + rise, abs=0.1)
