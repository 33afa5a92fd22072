# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The faults of simulated lights: their effects, their values, and their ends."""

from typing import Any

from illuminator_ros.illuminator.simulated_properties import FAULTS, IlluminatorBehaviour
from illuminator_ros.mavlink.dialect import mavlink
from illuminator_ros.mavlink.messages import CommandAck, Heartbeat
from illuminator_ros.simulation.faults import FaultError
from illuminator_ros.simulation.simulated import MAX_DELAYED
import pytest
from support.light_bench import LightBench

ON = (mavlink.MAV_CMD_ILLUMINATOR_ON_OFF, 1)
NORMAL = IlluminatorBehaviour()


def acks(bench: LightBench) -> Any:
    return [(at, ack.result) for at, ack in bench.timed(CommandAck)]


def active(bench: LightBench) -> Any:
    return FAULTS.as_typed(bench.component.behaviour, NORMAL)


def test_a_silent_light_neither_sends_nor_obeys_until_its_silence_is_over() -> None:
    bench = LightBench('silence=3')
    bench.run(2.0)
    bench.command(*ON)
    assert (bench.sent, bench.lamp.enabled, active(bench)) == ([], False, ['silence=3'])
    bench.run(3.5)
    assert [at for at, _ in bench.timed(Heartbeat)] == [3.0, 4.0, 5.0]
    assert active(bench) == []


def test_a_hot_light_reports_its_heat_as_soon_as_its_sensor_is_mended() -> None:
    bench = LightBench('thermistor')
    bench.lamp.heat_to(85.0, bench.now)
    assert bench.status().error_status == mavlink.ILLUMINATOR_ERROR_FLAGS_THERMISTOR_FAILURE
    bench.component.behave(NORMAL, bench.now)
    assert bench.status().error_status == mavlink.ILLUMINATOR_ERROR_FLAGS_THERMAL_THROTTLING


@pytest.mark.parametrize('fault', ['slow=2', 'progress=2', 'delay=3'])
def test_a_restart_drops_unfinished_commands_and_delayed_messages(fault: str) -> None:
    bench = LightBench(fault, status_interval=0.0)
    for _ in range(20):
        bench.command(*ON)
    bench.component.restart(0.5)
    bench.now = 0.5
    bench.sent.clear()
    bench.run(5.0)
    assert (acks(bench), bench.lamp.enabled) == ([], False)


def test_commands_that_a_fault_delays_are_bounded() -> None:
    bench = LightBench('slow=2', status_interval=0.0)
    for _ in range(MAX_DELAYED + 1):
        bench.command(*ON)
    bench.run(3.0)
    assert len(acks(bench)) == MAX_DELAYED


def test_progress_is_reported_until_the_change_and_rejects_a_second_command() -> None:
    bench = LightBench('progress=2')
    bench.command(*ON)
    bench.run(1.9)
    assert bench.result(*ON) == mavlink.MAV_RESULT_TEMPORARILY_REJECTED
    assert not bench.lamp.enabled
    bench.run(0.2)
    reported = [(at, ack.result, ack.progress) for at, ack in bench.timed(CommandAck)]
    assert reported == [(0.0, 5, 0), (0.5, 5, 25), (1.0, 5, 50), (1.5, 5, 75), (1.9, 1, 0),
                        (2.0, 0, 0)]
    assert bench.lamp.enabled


def test_a_busy_light_rejects_some_changes_temporarily_and_is_then_normal() -> None:
    bench = LightBench('busy=2')
    assert [(bench.result(*ON), active(bench)) for _ in range(3)] == [
        (1, ['busy=1']), (1, []), (0, [])]
    assert bench.lamp.enabled


@pytest.mark.parametrize(('fault', 'low', 'high'), [
    ('drop=0.2', 140, 180), ('drop=1', 0, 0), ('duplicate=0.25', 230, 270)])
def test_a_share_of_the_messages_is_lost_or_doubled(fault: str, low: float, high: float) -> None:
    assert low <= len(LightBench(fault, status_interval=0.0).run(199.5).sent) <= high


@pytest.mark.parametrize('fault', ['drop', 'duplicate', 'delay', 'corrupt'])
def test_the_same_seed_gives_the_same_faults(fault: str) -> None:
    def run(seed: int) -> Any:
        bench = LightBench(fault, seed=seed)
        bench.run(50.0)
        return [(at, message.crc_extra) for at, message in bench.sent]

    assert run(1) == run(1) != run(2)


@pytest.mark.parametrize(('text', 'reason'), [
    ('nope', "no fault 'nope'; there are silence, reboot"), ('', "no fault ''"),
    ('lie=1', 'lie takes no value'), ('drop=2', "'drop=2': 2 is outside 0.001 to 1"),
    ('drop=0', '0 is outside'), ('drop=nan', 'nan is outside'), ('drop=', "'' is not a number"),
    ('slow=-1', '-1 is outside 0.001 to 3600'), ('slow=inf', 'inf is outside'),
    ('busy=0', '0 is outside'), ('refuse=maybe', "'maybe' is not a MAV_RESULT"),
    ('flags=0', '0 is outside'), ('type=256', '256 is outside 0 to 255')])
def test_a_wrong_fault_is_refused_with_the_reason(text: str, reason: str) -> None:
    with pytest.raises(FaultError) as caught:
        FAULTS.add(NORMAL, text)
    assert reason in str(caught.value)
