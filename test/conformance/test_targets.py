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

"""Which light is checked, and that others on the line do not matter."""

from illuminator_ros.illuminator.faults import FAULTS
from illuminator_ros.illuminator.simulated_properties import (
    IlluminatorBehaviour,
    IlluminatorProperties,
)
from illuminator_ros.mavlink.messages import Address
import pytest
from support.conformance_run import Run

FIRST, SECOND = Address(1, 243), Address(1, 244)
BAD = FAULTS.add(FAULTS.add(IlluminatorBehaviour(), 'nan'), 'lie')


def test_the_first_light_that_is_heard_is_checked():
    run = Run(IlluminatorProperties(address=FIRST), IlluminatorProperties(address=SECOND)).finish()
    assert run.session.found == FIRST
    assert run.failed == set()


def test_the_light_that_is_named_is_checked():
    run = Run(IlluminatorProperties(address=FIRST),
              IlluminatorProperties(address=SECOND, behaviour=BAD), target=SECOND).finish()
    assert run.session.found == SECOND
    assert {'not-a-number', 'status-agrees'} <= run.failed


def test_another_light_that_misbehaves_is_no_finding():
    run = Run(IlluminatorProperties(address=FIRST),
              IlluminatorProperties(address=SECOND, behaviour=BAD))
    assert run.finish().failed == set()


def test_another_light_is_not_changed():
    run = Run(IlluminatorProperties(address=FIRST), IlluminatorProperties(address=SECOND))
    other = run.lights.components[1]
    other.device.lamp.switch(True, brightness_is_switch=False)
    run.finish()
    assert other.device.lamp.enabled is True
    assert other.device.lamp.configuration.brightness == 100.0


def test_a_light_without_a_heartbeat_of_its_own_is_found_by_its_status():
    run = Run(faults=('type=12',)).finish()
    assert run.session.found == FIRST


def test_without_a_light_there_is_one_finding_and_nothing_is_said_to_be_met():
    run = Run(IlluminatorProperties(address=FIRST), target=SECOND).finish()
    assert run.failed == {'heartbeat'}
    assert not run.suite.passed
    assert run.result('on').detail == '1/244 was not heard within 10 s'


@pytest.mark.parametrize(('target', 'said'), [
    (Address(9, 9), '9/9 was not heard within 10 s; heard instead: 1/243 and 1/244'),
    (None, 'no light was heard within 10 s, that is, no HEARTBEAT with MAV_TYPE_ILLUMINATOR or '
           'ILLUMINATOR_STATUS; heard instead: 1/243 and 1/244')])
def test_who_was_heard_instead_of_the_light_is_said(target, said):
    other_components = FAULTS.add(FAULTS.add(IlluminatorBehaviour(), 'type=18'), 'no-request')
    run = Run(*[IlluminatorProperties(address=one, behaviour=other_components, status_interval=0.0)
                for one in (FIRST, SECOND)], target=target).finish()
    assert run.result('heartbeat').detail == run.result('heartbeat').detail == said


def test_of_a_crowd_that_was_heard_instead_of_the_light_some_are_named():
    lights = [IlluminatorProperties(address=Address(1, n)) for n in range(1, 12)]
    run = Run(*lights, target=Address(9, 9))
    assert run.finish().result('heartbeat').detail.endswith('1/7, 1/8 and 3 more')


def test_that_nobody_was_heard_is_said():
    run = Run(faults=('silence',)).finish()
    assert run.result('heartbeat').detail.endswith('ILLUMINATOR_STATUS; nothing else was heard')
