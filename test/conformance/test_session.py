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

"""The session: the light that is checked, others on the link, and bounded memory."""

from collections.abc import Sequence
import tracemalloc

from illuminator_ros.illuminator.checks.requirements import CHECKS
from illuminator_ros.illuminator.messages import IlluminatorStatus
from illuminator_ros.illuminator.model import Configuration, Mode
from illuminator_ros.illuminator.simulated_properties import (
    FAULTS,
    IlluminatorBehaviour,
    IlluminatorProperties,
)
from illuminator_ros.mavlink.messages import Address, CommandAck, heartbeat
from illuminator_ros.payload.checks.record import MAX_ENTRIES
from illuminator_ros.payload.checks.session import Conditions
import pytest
from support.checks_run import TESTER
from support.conformance_run import Run

FIRST, SECOND = (IlluminatorProperties(address=Address(1, n)) for n in (243, 244))
BAD = IlluminatorProperties(address=SECOND.address, behaviour=FAULTS.add(
    FAULTS.add(IlluminatorBehaviour(), 'nan'), 'lie'))


def test_the_first_light_is_checked_and_another_one_neither_changed_nor_judged() -> None:
    run = Run(FIRST, BAD)
    other = run.lights.components[1].device
    other.enabled = True
    run.finish()
    assert run.session.components.found == FIRST.address
    assert run.session.components.devices == {FIRST.address, SECOND.address}
    assert run.failed == set()
    assert other.enabled
    assert other.configuration == Configuration(Mode.INTERNAL_CONTROL, 100.0, 0.0, 0.0)


def test_the_target_is_checked() -> None:
    run = Run(FIRST, BAD, target=SECOND.address).finish()
    assert run.session.components.found == SECOND.address
    assert {'not-a-number', 'status-agrees'} <= run.failed


@pytest.mark.parametrize(('addresses', 'target', 'text'), [
    ((), Address(9, 9), '9/9 was not heard within 10 s; nothing else was heard'),
    ((243, 244), Address(9, 9), '9/9 was not heard within 10 s; heard instead: 1/243 and 1/244'),
    ((243, 244), None, 'no light was heard within 10 s, that is, no HEARTBEAT with '
     'MAV_TYPE_ILLUMINATOR or ILLUMINATOR_STATUS; heard instead: 1/243 and 1/244'),
    (range(1, 12), Address(9, 9), '9/9 was not heard within 10 s; heard instead: 1/1, 1/2, 1/3, '
     '1/4, 1/5, 1/6, 1/7, 1/8 and 3 more'),
])
def test_without_the_light_heartbeat_fails_and_names_the_components_that_were_heard(
        addresses: Sequence[int], target: Address | None, text: str) -> None:
    silent = FAULTS.add(IlluminatorBehaviour(), 'silence')
    other = FAULTS.add(FAULTS.add(IlluminatorBehaviour(), 'type=18'), 'no-request')
    lights = [IlluminatorProperties(address=Address(1, n), behaviour=other, status_interval=0.0)
              for n in addresses] or [IlluminatorProperties(behaviour=silent)]
    run = Run(*lights, target=target).finish()
    assert run.failed == {'heartbeat'}
    assert run.result('heartbeat').detail == text
    assert run.result('on').detail == 'no light was found'
    assert not run.runner.passed


@pytest.mark.parametrize(('others', 'reason'), [
    ([Address(1, n) for n in range(200, 256)], 'each component id from 200 of system 1 is in use'),
    ([Address(n, 1) for n in range(1, 241)], 'each system id up to 240 is in use')])
def test_a_check_that_needs_an_unused_address_is_skipped_on_a_link_without_one(
        others: Sequence[Address], reason: str) -> None:
    run = Run(only=('other-target',))
    run.session.components.heard.update(others)
    run.finish()

    assert run.result('other-target').detail == reason
    assert run.failed == set()


def test_a_flood_from_the_light_takes_a_bounded_memory() -> None:
    session = CHECKS.session(Conditions(TESTER))
    status = IlluminatorStatus(1, 0, 3, 0, 1, 10.0, 0.0, 0.0, 20.0, 0.05, 10.0)
    flood = (heartbeat(44), status, CommandAck(405, 0))

    async def command() -> None:
        await session.command(405, 1.0)

    def receive(count: int) -> int:
        for number in range(count):
            session.receive(FIRST.address, flood[number % len(flood)], 0.001 * number)
        return tracemalloc.get_traced_memory()[0]

    session.runner.run(command())
    tracemalloc.start()
    before = receive(3 * MAX_ENTRIES)
    grown = receive(MAX_ENTRIES) - before
    tracemalloc.stop()

    assert grown < 500_000
