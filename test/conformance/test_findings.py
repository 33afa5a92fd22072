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

"""Each fault of a light is found by the requirement that covers it, and by no other."""

from dataclasses import replace
import math

from illuminator_ros.illuminator.checks.requirements import REQUIREMENTS
from illuminator_ros.illuminator.model import Mode
from illuminator_ros.illuminator.simulated_properties import (
    FAULTS,
    IlluminatorProperties,
    PROFILES,
)
from illuminator_ros.mavlink.messages import Address
from illuminator_ros.payload.checks.requirement import Verdict
from illuminator_ros.payload.simulated import Effect
import pytest
from support.conformance_run import Run

PASS, FAIL, SKIPPED = Verdict
HEALTHY = IlluminatorProperties()
ACCEPTED_CHANGES = {'on', 'off', 'mode-internal', 'mode-external', 'brightness', 'strobe',
                    'strobe-limit-values', 'duty-cycle', 'command-int'}
DENIED_VALUES = {'on-off-values', 'mode-values', 'brightness-values', 'strobe-values',
                 'duty-cycle-values', 'not-a-number'}

# Fault -> all requirements that fail.
SEEDED = {
    'silence': {'heartbeat'},
    'reboot': {'uptime', 'interval-stop'},
    'thermistor': {'flags-at-rest'},
    'refuse': ACCEPTED_CHANGES,
    'refuse=failed': ACCEPTED_CHANGES | DENIED_VALUES,
    'progress': set(),
    'progress=3600': ACCEPTED_CHANGES | DENIED_VALUES | {'finished', 'not-busy'},
    'busy': set(),
    'busy=1000': ACCEPTED_CHANGES | DENIED_VALUES | {'not-busy'},
    'slow': {'acknowledged-promptly'},
    # The light is already off when it is switched off, and strobes neither at 0 nor at 100 %.
    'lie': ACCEPTED_CHANGES - {'off', 'duty-cycle'} | {'status-agrees'},
    'heartbeat': {'heartbeat-rate'},
    'type': {'heartbeat-type'},
    'autopilot': {'heartbeat-autopilot'},
    'no-clock': {'uptime'},
    'no-int': set(),
    'no-broadcast': {'broadcast'},
    'any-target': {'other-target'},
    'no-stop': {'interval-stop'},
    'fixed-rate': {'interval'},
    'no-identity': {'information-request'},
    'no-terminator': {'information-terminated'},
    'nan': {'not-a-number'},
    'anything': DENIED_VALUES,
    'disobey': {'status-unchanged'},
    'toggle': {'repeated'},
    'unknown': {'unknown-command', 'unknown-message'},
    'no-request': {'status-request'},
    'no-resume': {'interval-default'},
    'misaddress': {'acknowledged-to-us'},
    'flags': {'flags-at-rest'},
    'flags=0x80': {'flags-at-rest'},
    'cold-throttling': {'thermal-flags'},
}
# Random fault -> a requirement that fails; others may fail, too.
RANDOM = {
    'drop': 'acknowledged', 'duplicate': 'acknowledged-once', 'delay': 'acknowledged-promptly',
    'corrupt': 'checksums',
}
# Requirement -> a light that does not meet it, without a fault.
PROPERTIES = {
    'address': IlluminatorProperties(address=Address(255, 0)),
    'status-mode': IlluminatorProperties(mode_bitmask=0),
    'strobe-limits': IlluminatorProperties(min_strobe_period=5.0, max_strobe_period=1.0),
    'information-text': IlluminatorProperties(vendor='\x01\x02'),
    'mode-internal': IlluminatorProperties(modes=(), mode_bitmask=3),
}
# Profile -> all requirements that fail.
DEVIATIONS = {
    'default': set(),
    'extended': set(),
    'reference': {'address', 'information-terminated', 'other-target',
                  'not-a-number', 'interval', 'uptime'},
    'ardusub': {'heartbeat-type', 'heartbeat-autopilot', 'information-request', 'not-a-number'},
}


@pytest.mark.parametrize('fault', SEEDED)
def test_a_fault_fails_exactly_its_requirements(fault: str) -> None:
    assert Run(faults=(fault,)).finish().failed == SEEDED[fault]


@pytest.mark.parametrize('fault', RANDOM)
@pytest.mark.parametrize('seed', range(3))
def test_a_random_fault_fails_its_requirement(fault: str, seed: int) -> None:
    run = Run(seed=seed, faults=(fault,)).finish()
    assert RANDOM[fault] in run.failed


@pytest.mark.parametrize('name', PROPERTIES)
def test_properties_out_of_order_fail_their_requirement(name: str) -> None:
    assert name in Run(PROPERTIES[name]).finish().failed


@pytest.mark.parametrize('profile', PROFILES)
def test_a_profile_fails_exactly_its_known_deviations_and_is_restored(profile: str) -> None:
    run = Run(PROFILES[profile].properties).finish()
    assert run.failed == DEVIATIONS[profile]
    assert run.runner.restored == 'the light is as it was'


def test_every_fault_is_seeded_and_every_requirement_can_fail() -> None:
    assert set(FAULTS) == {name.partition('=')[0] for name in SEEDED} | set(RANDOM)
    assert {one.name for one in REQUIREMENTS} == set().union(
        *SEEDED.values(), RANDOM.values(), PROPERTIES, {'status-content', 'status-stream'})


def test_a_status_with_nan_fails_status_content() -> None:
    run = Run()
    run.lamp.configuration = replace(run.lamp.configuration, brightness=math.nan)
    assert run.finish().failed == {'status-content'}


def test_a_light_that_sends_its_status_irregularly_fails_status_stream() -> None:
    run = Run(only=('status-stream',))
    for interval in (0.2, 2.0):
        run.link.run(1.0)
        run.set_interval(interval)
    assert run.finish().failed == {'status-stream'}


def test_a_light_that_sends_its_status_on_request_only_passes() -> None:
    run = Run(IlluminatorProperties(status_interval=0.0)).finish()
    assert run.failed == set()
    assert run.result('status-stream').verdict is Verdict.SKIPPED


def test_a_hot_light_without_faults_meets_every_requirement() -> None:
    run = Run(IlluminatorProperties(time_scale=120.0)).finish()
    assert run.names(Verdict.PASS) == {one.name for one in REQUIREMENTS}
    assert run.runner.passed


def test_a_light_that_stops_sending_fails_and_later_checks_are_skipped() -> None:
    run = Run()
    run.link.run(8.0)
    run.fault('silence')
    run.finish()
    assert {'heartbeat-rate', 'acknowledged'} < run.failed
    assert run.result('thermal-flags').detail == 'the light has stopped sending'


def test_a_light_that_receives_nothing_fails_within_five_minutes(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    run = Run()
    monkeypatch.setattr(run.lights, 'receive', lambda *args: None)
    begun = run.link.now

    run.finish()

    assert run.link.now - begun < 300.0
    assert {'status-request', 'on', 'acknowledged'} < run.failed
    assert run.result('on').detail == 'MAV_CMD_ILLUMINATOR_ON_OFF 1: no acknowledgement'


def test_a_light_that_is_busy_for_ever_fails_within_five_minutes() -> None:
    run = Run(faults=('busy=1000000',))
    begun = run.link.now
    run.finish()
    assert run.link.now - begun < 300.0


def test_a_light_that_has_acknowledged_a_command_is_sent_each_attempt(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    run = Run()
    with monkeypatch.context() as context:
        context.setattr(run.lights, 'receive', lambda *args: None)
        run.link.run_until(lambda: run.session.transactions.total == 5, within=100.0)
    run.link.run_until(lambda: any(one.acks for one in run.session.transactions), within=10.0)
    monkeypatch.setattr(run.lights, 'receive', lambda *args: None)
    run.finish()

    assert [len(one.sent) for one in run.session.transactions][3:5] == [4, 1]
    assert len(run.session.transactions[-1].sent) == 4


LIE = 'MAV_RESULT_ACCEPTED, but then the status differs in '
ARDUSUB = PROFILES['ardusub'].properties


@pytest.mark.parametrize(('light', 'fault', 'name', 'verdict', 'detail', 'line'), [
    (HEALTHY, 'lie', 'on', FAIL, LIE + 'enable: off', '< ILLUMINATOR_STATUS uptime_ms'),
    (HEALTHY, 'lie', 'mode-internal', FAIL, LIE + 'brightness: off', '< ILLUMINATOR_STATUS uptime_ms'),
    (HEALTHY, 'lie', 'mode-external', FAIL, LIE + 'mode and brightness: off', ''),
    (HEALTHY, 'lie', 'brightness', FAIL, LIE + 'brightness: off', ''),
    (HEALTHY, 'lie', 'off', SKIPPED, 'could not be switched on before', ''),
    (HEALTHY, 'lie', 'thermal-flags', SKIPPED, 'never reported that it was on', ''),
    (HEALTHY, 'anything', 'brightness-values', FAIL,
     'MAV_CMD_DO_ILLUMINATOR_CONFIGURE 1 101 0 0: MAV_RESULT_ACCEPTED',
     '< COMMAND_ACK MAV_CMD_DO_ILLUMINATOR_CONFIGURE: MAV_RESULT_ACCEPTED'),
    # A change that never completes does not delay the run.
    (HEALTHY, 'progress=3600', 'on', FAIL, 'no acknowledgement', ''),
    # The checks do not make a light without strobe limits strobe.
    *((ARDUSUB, '', name, SKIPPED, 'reports no strobe limits', '')
      for name in ('strobe', 'strobe-values', 'duty-cycle')),
    (replace(HEALTHY, time_scale=120.0), '', 'thermal-flags', PASS,
     'thermal throttling from', ''),
])
def test_a_result_has_its_reason_and_the_messages_that_show_it(
    light: IlluminatorProperties, fault: str, name: str, verdict: Verdict, detail: str, line: str,
) -> None:
    result = Run(light, faults=(fault,) if fault else (), only=(name,)
                 ).finish().result(name)
    assert result.verdict is verdict
    assert detail in result.detail
    assert line in result.exchange[-1]


@pytest.mark.parametrize(('fault', 'name', 'detail'), [
    ('refuse', 'status-agrees', 'no change was accepted'),
    ('anything', 'status-unchanged', 'no change was rejected')])
def test_statuses_are_not_compared_where_there_was_no_such_change(
    fault: str, name: str, detail: str,
) -> None:
    result = Run(faults=(fault,)).finish().result(name)
    assert (result.verdict, result.detail) == (SKIPPED, detail)


def test_a_status_that_contradicts_is_reported_with_its_request() -> None:
    exchange = Run(faults=('lie',), only=('on',)).finish().result('on').exchange

    assert '> COMMAND_LONG to 1/243: MAV_CMD_REQUEST_MESSAGE' in exchange[-3]


def test_a_light_that_stays_in_external_sync_fails_mode_internal() -> None:
    run = Run(only=('mode-internal', 'mode-external'))
    apply = run.light.apply

    def stuck(effect: Effect, now: float) -> None:
        mode = run.lamp.configuration.mode
        apply(effect, now)
        if mode is Mode.EXTERNAL_SYNC:
            run.lamp.configuration = replace(run.lamp.configuration, mode=mode)
    run.light.apply = stuck  # type: ignore[method-assign]
    assert run.finish().failed == {'mode-internal'}
    assert 'then the status differs in mode' in run.result('mode-internal').detail


def test_an_accepted_change_passes_where_the_light_reports_no_status() -> None:
    run = Run(IlluminatorProperties(status_interval=0.0), faults=('lie',), only=('on',))
    run.link.run_until(lambda: any(
        one.text.endswith('ON_OFF 1') for one in run.session.transactions), within=60.0)
    run.fault('no-request')
    assert run.finish().result('on').verdict is Verdict.PASS
