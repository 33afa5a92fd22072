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

"""Each fault of a camera is found by the requirement that covers it, and by no other."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from illuminator_ros.mavlink.messages import Address
from illuminator_ros.payload.checks.requirement import Verdict
from illuminator_ros.payload.messages import GeoPoint
from illuminator_ros.payload.simulated import SimulatedComponents
from illuminator_ros.rededge.checks import CHECKS, REQUIREMENTS
from illuminator_ros.rededge.messages import CAPTURES as CAPTURES_FIRMWARE
from illuminator_ros.rededge.messages import Firmware, PARAMETERS
from illuminator_ros.rededge.simulated import FAULTS, RedEdgeProperties, SimulatedRedEdge
import pytest
from support.checks_run import ChecksRun
from support.virtual_link import START

UTC = 1.7e9
CAMERA = Address(255, 100)
# Without images the index cannot be checked.
WITHOUT_CONSENT = {one.name for one in REQUIREMENTS if not one.needs_consent} - {'capture-index'}
CAPTURES = {one.name for one in REQUIREMENTS if one.needs_consent}
PINGS = {'ping', 'ping-sequence', 'ping-once', 'ping-target', 'system-id'}
INJECTED = {'raw-position', 'fused-position', 'attitude', 'validity'}

# Fault -> all requirements that fail.
SEEDED = {
    'silence': {'heartbeat'},
    'slow': PINGS,
    'heartbeat': {'heartbeat-rate'},
    'type': {'heartbeat-contents'},
    'autopilot': {'heartbeat-contents'},
    'any-target': {'other-component'},
    'fixed-system': {'system-id', 'any-system'},
    'other-ping': PINGS,
    'ping-sequence': {'ping-sequence'},
    'ping-target': {'ping-target'},
    'no-status': {'capture-status'},
    'no-feedback': CAPTURES - {'capture-status', 'shot-values', 'other-component'},
    'late': CAPTURES - {'capture-status', 'shot-values', 'other-component'},
    'same-index': {'capture-index'},
    'no-captures': CAPTURES,
    'no-panel': {'capture-panel'},
    'any-shot': {'shot-values'},
    'no-injection': INJECTED,
    'stale': {'validity'},
    'extension': {'lengths'},
}
# Fault -> a requirement, and the text of its result.
DETAILS = {
    'ping-sequence': ('ping-sequence', 'answers sequence number 0 with 1'),
    'ping-target': ('ping-target', 'to 0/0 instead of 255/190'),
    'other-ping': ('ping', 'no answer to 3 requests within 1 s each'),
    'fixed-system': ('system-id', 'after a message from 2/190 it sends from 255/100'),
    'no-captures': ('validity', 'confirms no captures, with firmware 7.1.0'),
    'late': ('capture-feedback', 'no CAMERA_FEEDBACK within 10 s after CAMERA_STATUS'),
    'same-index': ('capture-index', 'img_idx 0, then 0'),
    'stale': ('validity', 'still used 7 s later'),
    'no-injection': ('raw-position', '47.0000000, 8.0000000, 400.00 m instead of -48.8766667'),
    'extension': ('lengths', 'CAMERA_FEEDBACK with 47 bytes'),
}
# Random fault -> a requirement that fails; others may fail, too.
RANDOM = {'drop': 'heartbeat-rate', 'duplicate': 'ping-once', 'delay': 'ping',
          'corrupt': 'checksums', 'reboot': 'capture-index'}


def start(
    fault: str = '', *, address: Address = CAMERA, others: Iterable[int] = (), version: int = 1,
    seed: int = 0, firmware: Firmware = PARAMETERS, **options: Any,
) -> ChecksRun:
    """
    Begin to check a camera.

    :param others: component ids of further cameras.
    """
    camera = SimulatedRedEdge(RedEdgeProperties(
        address, seed=seed, firmware=firmware, own_gps=GeoPoint(47.0, 8.0, 400.0)))
    if fault:
        camera.behave(FAULTS.add(camera.behaviour, fault), START)
    camera.set_clock(UTC + START, START)
    cameras = SimulatedComponents([
        camera,
        *(SimulatedRedEdge(RedEdgeProperties(one))
          for one in (Address(255, other) for other in others))], START)
    return ChecksRun(CHECKS, cameras, version=version, utc=UTC, **options)


def run(fault: str = '', **options: Any) -> ChecksRun:
    """Check a camera, given as for :func:`start`."""
    return start(fault, **options).finish()


def test_camera_without_faults_meets_every_requirement() -> None:
    done = run()
    assert done.names(Verdict.PASS) == {one.name for one in REQUIREMENTS}
    assert done.runner.restored == 'the camera is as it was, besides its new images'


@pytest.mark.parametrize('fault', SEEDED)
def test_fault_fails_exactly_its_requirements(fault: str) -> None:
    done = run(fault)
    assert done.failed == SEEDED[fault]
    if fault in DETAILS:
        name, detail = DETAILS[fault]
        assert detail in done.result(name).detail


@pytest.mark.parametrize(('firmware', 'fault', 'skipped'), [
    (Firmware(1, 3, 2), '', CAPTURES | {'capture-index'}),
    (Firmware(1, 3, 2), 'type', CAPTURES | {'capture-index', 'heartbeat-contents'}),
    (CAPTURES_FIRMWARE, 'fixed-system', {'system-id', 'any-system'}),
    (CAPTURES_FIRMWARE, 'any-target', {'other-component'}),
])
def test_requirements_of_later_firmware_are_skipped(
        firmware: Firmware, fault: str, skipped: set[str]) -> None:
    done = run(fault, firmware=firmware)
    assert done.failed == set()
    assert done.names(Verdict.SKIPPED) == skipped


def test_a_skipped_requirement_names_the_firmware_that_brought_it() -> None:
    done = run('fixed-system', firmware=Firmware(1, 3, 2))
    assert done.result('capture-panel').detail == (
        'confirms no captures, as firmware before 1.5.5')
    assert done.result('system-id').detail.endswith(
        'it sends from 255/100, as firmware before 3.3.0 may')


def test_camera_that_stops_sending_fails_a_ping_and_later_checks_are_skipped() -> None:
    started = start()
    started.link.run_until(
        lambda: 'ping-sequence' in started.names(Verdict.PASS), within=60.0)
    component = started.component
    component.behave(FAULTS.add(component.behaviour, 'silence=600'), started.link.now)
    done = started.finish()
    assert done.result('ping-target').detail == 'the camera has stopped sending'
    assert done.names(Verdict.SKIPPED) >= {'system-id'} | INJECTED | CAPTURES


@pytest.mark.parametrize('fault', RANDOM)
def test_random_fault_fails_its_requirement(fault: str) -> None:
    assert RANDOM[fault] in run(fault).failed


def test_every_fault_is_seeded_and_every_requirement_can_fail() -> None:
    assert set(FAULTS) == set(SEEDED) | set(RANDOM)
    assert {one.name for one in REQUIREMENTS} == set().union(
        *SEEDED.values(), RANDOM.values(), {'mavlink-1'})


def test_camera_that_sends_mavlink_2_fails_mavlink_1_only_re_1() -> None:
    assert run(version=2).failed == {'mavlink-1'}


def test_without_consent_no_image_is_taken() -> None:
    done = run(consent=False)
    assert not done.device.images
    assert done.names(Verdict.PASS) == WITHOUT_CONSENT
    assert done.names(Verdict.SKIPPED) == CAPTURES | {'capture-index'}
    assert done.runner.restored == 'nothing was changed'
    assert 'would take images with a false position: not agreed to' in (
        done.result('validity').detail)


def test_camera_is_one_device_whatever_its_system_id_re_8() -> None:
    done = run(address=Address(1, 100), target=Address(9, 100))
    assert not done.failed
    assert done.session.components.devices == done.session.components.heard == {Address(255, 100)}


def test_component_other_than_100_is_not_a_camera_re_7() -> None:
    done = run(others=[101])
    assert not done.failed
    assert done.session.components.devices == {Address(255, 100)}
    absent = run(address=Address(255, 101))
    assert absent.failed == {'heartbeat'}
    assert absent.result('heartbeat').detail.startswith(
        'no camera was heard within 10 s, that is, no HEARTBEAT from component 100')
