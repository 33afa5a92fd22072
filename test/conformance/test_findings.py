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

"""A check that cannot fail is worth nothing: each fault is found, by the check that is for it."""

from dataclasses import replace
import math

from illuminator_ros.illuminator.checks.catalogue import REQUIREMENTS
from illuminator_ros.illuminator.faults import FAULTS
from illuminator_ros.illuminator.identity import Identity
from illuminator_ros.illuminator.model import Limits, Mode
from illuminator_ros.illuminator.simulated_properties import (
    IlluminatorBehaviour,
    IlluminatorProperties,
)
from illuminator_ros.mavlink.messages import Address, MavCmd
from illuminator_ros.payload.checks.requirement import Verdict
import pytest
from support.conformance_run import Run

ACCEPTED_CHANGES = {'on', 'off', 'mode-internal', 'mode-external', 'brightness', 'strobe',
                    'strobe-limit-values', 'duty-cycle', 'command-int'}
DENIED_VALUES = {'on-off-values', 'mode-values', 'brightness-values', 'strobe-values',
                 'duty-cycle-values', 'not-a-number'}

# The fault, and exactly what is found.
SEEDED = {
    'silence': {'heartbeat'},
    'reboot': {'uptime', 'interval-stop'},
    'thermistor': {'flags-at-rest'},
    'refuse': ACCEPTED_CHANGES,
    'refuse=failed': ACCEPTED_CHANGES | DENIED_VALUES,
    'progress': {'finished'},
    'busy': {'not-busy'},
    'slow': {'acknowledged-promptly'},
    # It is off when it is told to be.
    'lie': ACCEPTED_CHANGES - {'off'} | {'status-agrees'},
    'heartbeat': {'heartbeat-rate'},
    'type': {'heartbeat-type'},
    'autopilot': {'heartbeat-autopilot'},
    'no-clock': {'uptime'},
    'no-int': {'command-int'},
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
# What befalls messages by chance is found by the check that is for it, and may show elsewhere.
BY_CHANCE = {
    'drop': 'acknowledged', 'duplicate': 'acknowledged-once', 'delay': 'acknowledged-promptly',
    'corrupt': 'checksums',
}
# What no fault but the properties of a light bring about.
BUILT_IN = {
    'address': IlluminatorProperties(address=Address(255, 0)),
    'status-stream': IlluminatorProperties(status_interval=0.0),
    'status-mode': IlluminatorProperties(mode_bitmask=0),
    'strobe-limits': IlluminatorProperties(limits=Limits(5.0, 1.0)),
    'information-text': IlluminatorProperties(identity=Identity('\x01\x02', 'm', '1', '1', '1')),
    'mode-internal': IlluminatorProperties(modes=()),
}


@pytest.mark.parametrize('fault', SEEDED)
def test_a_fault_is_found_by_the_check_that_is_for_it_and_by_no_other(fault):
    assert Run(faults=(fault,)).finish().failed == SEEDED[fault]


@pytest.mark.parametrize('fault', BY_CHANCE)
@pytest.mark.parametrize('seed', range(3))
def test_what_befalls_messages_by_chance_is_found_and_named(fault, seed):
    run = Run(IlluminatorProperties(seed=seed), faults=(fault,)).finish()
    assert BY_CHANCE[fault] in run.failed


@pytest.mark.parametrize('name', BUILT_IN)
def test_what_a_light_is_made_like_is_found(name):
    assert name in Run(BUILT_IN[name]).finish().failed


def test_a_value_that_cannot_be_is_found():
    run = Run()
    run.lamp.configuration = replace(run.lamp.configuration, brightness=math.nan)
    assert run.finish().failed == {'status-content'}


def test_every_fault_is_seeded():
    assert set(FAULTS) == {name.partition('=')[0] for name in SEEDED} | set(BY_CHANCE)


def test_every_requirement_can_fail():
    found = set().union(*SEEDED.values()) | set(BY_CHANCE.values()) | set(BUILT_IN)
    assert {one.name for one in REQUIREMENTS} == found | {'status-content'}


def test_a_restart_in_the_middle_of_a_run_is_found():
    run = Run()
    run.link.run(12.0)
    run.light.restart(run.link.now)
    assert 'uptime' in run.finish().failed


def test_a_light_that_falls_silent_in_the_middle_is_found_and_the_rest_is_skipped():
    run = Run()
    run.link.run(8.0)
    run.light.behave(replace(run.light.behaviour, silence=math.inf), run.link.now)
    run.finish()
    assert {'heartbeat-rate', 'acknowledged'} < run.failed
    assert run.result('thermal-flags').detail == 'the light has stopped sending'


def test_a_light_that_has_accepted_what_it_must_not_is_set_right_before_the_next_try():
    run = Run(faults=('anything',)).finish()
    configured = [one for one in run.session.transactions if one.command == 406]
    brightness = next(i for i, one in enumerate(configured) if one.text.endswith('1 -1 0 0'))
    assert configured[brightness + 1].text.endswith(' 1 10 0 0')


def test_a_second_acknowledgement_is_not_taken_for_that_of_the_next_command():
    run = Run(faults=('duplicate=1',)).finish()
    for one in run.session.transactions:
        assert len(one.finals) <= 2
    assert 'on-off-values' not in run.failed
    assert all(len(one.finals) == 2 for one in run.session.transactions if one.expected)


@pytest.mark.parametrize(('name', 'contradiction'), [
    ('on', 'in enable: off'), ('mode-internal', 'in brightness: off'),
    ('mode-external', 'in mode and brightness: off'), ('brightness', 'in brightness: off')])
def test_a_change_that_is_accepted_but_not_shown_is_found_where_it_was_asked_for(
        name, contradiction):
    result = Run(faults=('lie',), only=(name,)).finish().result(name)
    assert result.verdict is Verdict.FAIL
    assert ('MAV_RESULT_ACCEPTED, but then the status differs ' + contradiction) in result.detail
    assert '< ILLUMINATOR_STATUS off' in result.exchange[-1]


def test_a_light_that_cannot_be_brought_back_from_external_sync_does_not_take_internal_control():
    run = Run(only=('mode-internal', 'mode-external'))
    apply = run.light.apply

    def stuck(change, now):
        mode = run.lamp.configuration.mode
        apply(change, now)
        if mode is Mode.EXTERNAL_SYNC:
            run.lamp.configuration = replace(run.lamp.configuration, mode=mode)
    run.light.apply = stuck
    assert run.finish().failed == {'mode-internal'}
    assert 'then the status differs in mode' in run.result('mode-internal').detail


def test_a_light_that_knows_internal_control_only_takes_it():
    run = Run(IlluminatorProperties(modes=(Mode.INTERNAL_CONTROL,)), only=('mode-internal',))
    assert run.finish().result('mode-internal').verdict is Verdict.PASS


def test_a_light_that_stays_on_is_not_switched_off():
    run = Run(faults=('lie',), only=('on', 'off'))
    run.press(enabled=True)
    run.finish()
    assert run.failed == {'off'}
    assert 'could not be switched off before' in run.result('on').detail


def test_that_a_light_was_off_anyway_does_not_count_as_switched_off():
    result = Run(faults=('lie',), only=('off',)).finish().result('off')
    assert result.verdict is Verdict.SKIPPED
    assert 'could not be switched on before' in result.detail


@pytest.mark.parametrize('name', ['on', 'off', 'brightness'])
def test_one_requirement_alone_is_met_by_a_light_that_meets_it(name):
    assert Run(only=(name,)).finish().result(name).verdict is Verdict.PASS


def test_what_a_light_accepts_counts_as_done_where_it_reports_no_status():
    run = Run(IlluminatorProperties(status_interval=0.0), faults=('lie',), only=('on',))
    asked = run.session.command

    async def last_status_before(command, *params, **options):
        if command == MavCmd.ILLUMINATOR_ON_OFF and params == (1.0,):
            run.fault('no-request')
        return await asked(command, *params, **options)
    run.session.command = last_status_before
    assert run.finish().result('on').verdict is Verdict.PASS


def test_thermal_flags_that_go_with_the_temperature_are_in_order():
    run = Run(IlluminatorProperties(time_scale=60.0), heat=20.0).finish()
    assert run.result('thermal-flags').verdict.value == 'PASS'
    assert 'thermal throttling from' in run.result('thermal-flags').detail


def test_the_reason_and_what_was_said_stand_in_the_finding():
    run = Run(faults=('anything',)).finish()
    result = run.result('brightness-values')
    assert 'MAV_CMD_DO_ILLUMINATOR_CONFIGURE 1 101 0 0: MAV_RESULT_ACCEPTED' in result.detail
    sent, came = result.exchange[-2:]
    assert '> COMMAND_LONG to 1/243: MAV_CMD_DO_ILLUMINATOR_CONFIGURE 1 101' in sent
    assert '< COMMAND_ACK MAV_CMD_DO_ILLUMINATOR_CONFIGURE: MAV_RESULT_ACCEPTED' in came


def test_a_light_without_faults_behaves_as_the_protocol_says():
    assert IlluminatorProperties().behaviour == IlluminatorBehaviour()


def test_a_change_that_is_in_progress_for_ever_does_not_hold_up_the_run():
    run = Run(faults=('progress=3600',), only=('on', 'off')).finish()
    assert run.failed == {'on', 'off'}
    assert 'no acknowledgement' in run.result('on').detail
