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

"""Checks of gimbal devices and managers: a fault fails exactly the requirements it breaks."""

from __future__ import annotations

from collections.abc import Callable
import math
from typing import Any

from illuminator_ros.gimbal import messages as gimbal
from illuminator_ros.gimbal import simulated_device, simulated_manager
from illuminator_ros.gimbal.checks import device, manager
from illuminator_ros.gimbal.manager_setpoint import Setpoint
from illuminator_ros.mavlink.dialect import mavlink, replaced
from illuminator_ros.mavlink.messages import (
    Address,
    CommandAck,
    CommandInt,
    CommandLong,
)
from illuminator_ros.payload.checks.requirement import PayloadChecks, Verdict
from illuminator_ros.payload.checks.session import Conditions
from illuminator_ros.payload.messages import GimbalDeviceAttitudeStatus as AttitudeStatus
from illuminator_ros.payload.simulated import (
    CommandReply,
    SimulatedComponents,
    SimulatedType,
)
import pytest
from support.checks_run import ChecksRun
from support.virtual_link import START

KINDS: dict[str, tuple[PayloadChecks[Any], SimulatedType[Any]]] = {
    'gimbal': (device.CHECKS, simulated_device.SIMULATED),
    'gimbal_manager': (manager.CHECKS, simulated_manager.SIMULATED)}
every_kind = pytest.mark.parametrize('kind', KINDS)

# The faults that both can have, and the requirements that each breaks.
COMMON = {
    'silence': {'heartbeat'},
    'slow': {'acknowledged-promptly'},
    'heartbeat': {'heartbeat-rate'},
    'no-int': set(),
    'no-broadcast': {'broadcast'},
    'any-target': {'other-target'},
    'no-stop': {'interval-stop'},
    'fixed-rate': {'interval'},
    'unknown': {'unknown-command', 'unknown-message'},
    'no-request': set(),
    'no-resume': {'interval-default'},
    'misaddress': {'acknowledged-to-us'},
    'jumps': {'continuous'},
    'no-frame': set(),
    'flags': {'failures-at-rest'},
    'no-identity': {'information'},
    'changing-identity': {'information-static'},
    'no-limits': {'range'},
    'degrees': {'limits', 'range'},
    'runaway': {'stop'},
}
POINTING = {'set-attitude', 'set-pitchyaw', 'pitchyaw', 'one-axis', 'angles-with-rates',
            'all-devices', 'earth-frame'}
TURNING = {'rate', 'pitchyaw-rate', 'manual'}
# The requirements on a manager that need a command.
CHANGED = {'take', 'release', 'unchanged', 'secondary', 'neutral', 'retract', 'flags-shown', 'roi',
           *POINTING, *TURNING}
SEEDED = {
    'gimbal': {
        **COMMON,
        'type': {'heartbeat-type'},
        'autopilot': {'heartbeat-autopilot'},
        'lie': {'setpoint', 'rate', 'neutral', 'retract', 'earth-frame', 'yaw-lock'},
        'frozen-axis': {'setpoint', 'rate', 'earth-frame', 'yaw-lock'},
        'obeys-others': {'only-manager', 'one-manager'},
        'no-status': {'status-stream'},
        'stale-flags': {'neutral', 'retract', 'yaw-lock'},
        'false-north': {'north-needs-heading'},
        'manager-set': {'manager-set'},
    },
    'gimbal_manager': {
        **COMMON,
        'refuse': CHANGED,
        'progress': set(),
        'busy': set(),
        'busy=1000': {'not-busy', *CHANGED},
        'disobey': {'no-control-command', 'no-control-roi'},
        'lie': {'take', 'secondary', 'one-player', 'roi', 'neutral', 'retract',
                'flags-shown', *POINTING, *TURNING},
        'frozen-axis': {'roi', *POINTING, *TURNING},
        'obeys-others': {'no-control-command', 'no-control-messages', 'one-player'},
        'no-status': {'status-stream', 'attitude-stream'},
        'stale-flags': {'neutral', 'retract', 'flags-shown'},
        'stale-control': {'take', 'secondary', 'one-player'},
    },
}
# Random fault -> a requirement that fails; others fail too, depending on its moment.
RANDOM = {'drop': 'acknowledged', 'duplicate': 'acknowledged-once', 'corrupt': 'checksums',
          'delay': 'acknowledged-promptly', 'reboot': 'uptime'}
PROFILES: dict[str, set[str]] = {
    'reference': set(),
    'px4': {'secondary', 'release-others', 'configure-values', 'no-control-roi', 'other-device',
            'pitchyaw-rate', 'set-pitchyaw', 'one-axis', 'earth-frame'},
    'ardupilot': {'secondary', 'one-player', 'no-control-command', 'no-control-messages',
                  'no-control-roi', 'angles-with-rates', 'one-axis', 'manual', 'earth-frame',
                  'flags-shown', 'limit-flags'},
}


def run(
    kind: str, *faults: str, consent: bool = True, only: tuple[str, ...] = (), **settings: Any,
) -> ChecksRun:
    checks, simulated = KINDS[kind]
    if kind == 'gimbal_manager':
        settings = {'heading': 40.0, **settings}
    address = simulated.address(settings)
    device = simulated.make(settings, address)
    for fault in faults:
        device.behave(device.faults.add(device.behaviour, fault), START - 100.0)
    devices = SimulatedComponents([device], START - 100.0)
    return ChecksRun(checks, devices, consent=consent, only=only)


@pytest.mark.parametrize(('kind', 'fault'), [
    (kind, fault) for kind, faults in SEEDED.items() for fault in faults])
def test_a_fault_fails_exactly_its_requirements(kind: str, fault: str) -> None:
    assert run(kind, fault).finish().failed == SEEDED[kind][fault]


@every_kind
@pytest.mark.parametrize('fault', RANDOM)
def test_a_random_fault_fails_its_requirement(kind: str, fault: str) -> None:
    assert RANDOM[fault] in run(kind, fault).finish().failed


@every_kind
def test_a_gimbal_without_faults_meets_every_requirement_and_is_turned_back(kind: str) -> None:
    done = run(kind).finish()
    assert done.names(Verdict.PASS) == {one.name for one in done.checks.requirements}
    assert done.runner.passed
    assert done.runner.restored == f'the {done.checks.device} is as it was'


@pytest.mark.parametrize('profile', PROFILES)
def test_a_profile_fails_exactly_its_known_deviations(profile: str) -> None:
    assert simulated_manager.PROFILES.keys() == PROFILES.keys()
    done = run('gimbal_manager', profile=profile).finish()
    assert done.failed == PROFILES[profile]
    assert done.runner.restored == 'the gimbal manager is as it was'


# Deviations that no fault of the simulator has

def _changed(cls: type[Any], **fields: Any) -> Callable[[ChecksRun], None]:
    def seed(one: ChecksRun) -> None:
        original = one.device.message

        def message(message_id: int, now: float) -> Any:
            found = original(message_id, now)
            return replaced(found, **fields) if isinstance(found, cls) else found
        one.device.message = message
    return seed


def _moves_when_unset(one: ChecksRun) -> None:
    mount = one.device.mount
    original = mount.obey

    def moved(demand: Setpoint, *others: Any) -> None:
        unset = all(map(math.isnan, (*demand.angles, *demand.rates))) and not demand.is_pose
        original(Setpoint(angles=(0.0, 0.5, 0.0)) if unset else demand, *others)
    mount.obey = moved


def _forgets_at_minus_1(one: ChecksRun) -> None:
    original = one.device.execute

    def execute(source: Address, command: Any, now: float) -> Any:
        unchanged = command.command == mavlink.MAV_CMD_DO_GIMBAL_MANAGER_CONFIGURE and (
            command.param1 == command.param3 == -1)
        return original(source, replaced(
            command, param1=0.0, param2=0.0) if unchanged else command, now)
    one.device.execute = execute


def _accepts_what_it_ignores(one: ChecksRun) -> None:
    original = one.device.execute

    def execute(source: Address, command: Any, now: float) -> Any:
        reply = original(source, command, now)
        denied = reply is not None and reply.result == mavlink.MAV_RESULT_DENIED
        return CommandReply(mavlink.MAV_RESULT_ACCEPTED) if denied else reply
    one.device.execute = execute


def _answers_requests(cls: type[Any], *answers: CommandAck) -> Callable[[ChecksRun], None]:
    """Answer MAV_CMD_REQUEST_MESSAGE, in messages of a class, with these messages only."""
    def seed(one: ChecksRun) -> None:
        original = one.component.receive

        def receive(source: Address, message: Any, now: float) -> None:
            if isinstance(message, cls) and message.command == mavlink.MAV_CMD_REQUEST_MESSAGE:
                one.component.outgoing.extend((one.component.address, ack) for ack in answers)
            else:
                original(source, message, now)
        one.component.receive = receive  # type: ignore[method-assign]
    return seed


def _turns_with_the_vehicle(one: ChecksRun) -> None:
    mount = one.device.mount
    original = mount.obey

    def turned(demand: Setpoint, *others: Any) -> None:
        original(demand._replace(angles=(0.0, -0.26, 0.5)) if (
            demand.flags & mavlink.GIMBAL_DEVICE_FLAGS_YAW_LOCK) else demand, *others)
    mount.obey = turned


def _silent_at(param: float) -> Callable[[ChecksRun], None]:
    def seed(one: ChecksRun) -> None:
        original = one.device.receive
        one.device.receive = lambda source, message, now: () if getattr(
            message, 'gimbal_device_id', None) == param else original(source, message, now)
    return seed


ACCEPTED = CommandAck(mavlink.MAV_CMD_REQUEST_MESSAGE, mavlink.MAV_RESULT_ACCEPTED)
BOTH_FRAMES = (mavlink.GIMBAL_DEVICE_FLAGS_YAW_IN_VEHICLE_FRAME
               | mavlink.GIMBAL_DEVICE_FLAGS_YAW_IN_EARTH_FRAME)
INFORMATION, STATUS = gimbal.GimbalDeviceInformation, gimbal.GimbalManagerStatus
DEVIATIONS = {
    ('gimbal', 'device-id'): _changed(INFORMATION, gimbal_device_id=3),
    ('gimbal', 'limits'): _changed(INFORMATION, roll_min=1.0),
    ('gimbal', 'pitch-axis'): _changed(INFORMATION, cap_flags2=256),
    ('gimbal', 'status-request'): _answers_requests(CommandLong),
    ('gimbal_manager', 'status-request'): _answers_requests(CommandLong),
    ('gimbal', 'command-int'): _answers_requests(CommandInt, ACCEPTED),
    ('gimbal_manager', 'command-int'): _answers_requests(CommandInt, ACCEPTED),
    ('gimbal', 'yaw-frame'): _changed(AttitudeStatus, flags=BOTH_FRAMES),
    ('gimbal_manager', 'yaw-frame'): _changed(AttitudeStatus, flags=BOTH_FRAMES),
    ('gimbal', 'yaw-lock'): _turns_with_the_vehicle,
    ('gimbal', 'attitude'): _changed(AttitudeStatus, q=(0.5, 0.0, 0.0, 0.0)),
    ('gimbal', 'status-to-all'): _changed(AttitudeStatus, target_system=1),
    ('gimbal', 'uptime'): _changed(AttitudeStatus, time_boot_ms=0),
    ('gimbal', 'limit-flags'): _changed(AttitudeStatus, failure_flags=0),
    ('gimbal', 'hold'): _moves_when_unset,
    ('gimbal_manager', 'hold'): _moves_when_unset,
    ('gimbal_manager', 'manager-status-request'): _changed(STATUS, gimbal_device_id=2),
    ('gimbal_manager', 'attitude-stream'): _changed(AttitudeStatus, gimbal_device_id=0),
    ('gimbal_manager', 'attitude'): _changed(AttitudeStatus, q=(0.5, 0.0, 0.0, 0.0)),
    ('gimbal_manager', 'limits'): _changed(gimbal.GimbalManagerInformation, roll_min=1.0),
    ('gimbal_manager', 'pitch-axis'): _changed(gimbal.GimbalManagerInformation, cap_flags=256),
    ('gimbal_manager', 'unchanged'): _forgets_at_minus_1,
    ('gimbal_manager', 'all-devices'): _silent_at(0),
    ('gimbal_manager', 'no-control-command'): _accepts_what_it_ignores,
}


@pytest.mark.parametrize(('kind', 'name'), DEVIATIONS)
def test_a_deviation_fails_its_requirement(kind: str, name: str) -> None:
    one = run(kind, only=(name,))
    DEVIATIONS[kind, name](one)
    assert name in one.finish().failed


@every_kind
def test_every_fault_is_seeded_and_every_requirement_can_fail(kind: str) -> None:
    checks, simulated = KINDS[kind]
    assert set(simulated.device.faults) == {
        *(name.partition('=')[0] for name in SEEDED[kind]), *RANDOM}
    found = set().union(*SEEDED[kind].values(), RANDOM.values(), *PROFILES.values(),
                        {name for one, name in DEVIATIONS if one == kind})
    # test/conformance covers the address, and changes by command, which a device does not have.
    others = {'address', 'finished'} | ({'not-busy'} if kind == 'gimbal' else set())
    assert {one.name for one in checks.requirements} - found == others


# Consent and restoring

@every_kind
def test_without_consent_nothing_moves_and_no_component_gets_control(kind: str) -> None:
    one = run(kind, consent=False)
    one.device.mount.motion.turn(-0.5, 0.4, one.link.now)
    one.finish()
    assert one.device.mount.motion.angles == (0.0, -0.5, 0.4)
    assert getattr(one.device, 'primary', Address(0, 0)) == Address(0, 0)
    assert one.failed == set()
    assert {found.requirement.name for found in one.runner.results
            if 'not agreed to; see --yes' in found.detail
            } == {found.name for found in one.checks.requirements if found.needs_consent}


@pytest.mark.parametrize('kind', KINDS)
@pytest.mark.parametrize('after', [5.0, 12.0, 20.0, 31.0])
def test_an_interrupted_run_turns_the_gimbal_back(kind: str, after: float) -> None:
    one = run(kind)
    motion = one.device.mount.motion
    motion.turn(-0.5, 0.4, one.link.now)
    one.link.run(after)
    one.session.runner.interrupt(one.link.now)
    one.finish()
    assert motion.angles == pytest.approx((0.0, -0.5, 0.4), abs=0.01)
    assert one.runner.restored in ('nothing was changed', f'the {one.checks.device} is as it was')


def test_control_is_given_back_to_the_player_that_had_it() -> None:
    one = run('gimbal_manager')
    player = Address(1, 195)
    one.component.receive(player, CommandLong(
        1, 154, mavlink.MAV_CMD_DO_GIMBAL_MANAGER_CONFIGURE, 0, *player, *player, 0, 0, 0),
        one.link.now)
    one.finish()
    assert one.failed == set()
    assert (one.device.primary, one.device.secondary) == (player, player)


def test_a_gimbal_that_cannot_be_turned_back_is_reported_with_its_former_pose() -> None:
    one = run('gimbal')
    one.device.mount.motion.turn(-0.5, 0.0, one.link.now)
    one.link.run(15.0)
    one.component.behave(one.device.faults.add(one.device.behaviour, 'lie'), one.link.now)
    one.finish()
    assert one.runner.restored == (
        'THE GIMBAL IS NOT AS IT WAS (attitude): it was pitch -28.6, yaw 0.0 deg')
    assert not one.runner.passed


@every_kind
def test_the_gimbal_keeps_its_yaw_lock(kind: str) -> None:
    one = run(kind, drift=0.0)
    motion, lock = (one.device.mount.motion, mavlink.GIMBAL_DEVICE_FLAGS_YAW_LOCK
                    | mavlink.GIMBAL_DEVICE_FLAGS_PITCH_LOCK)
    motion.obey(Setpoint(lock, angles=(0.0, -0.2, 0.1)), one.link.now)
    one.finish()
    assert motion.flags == lock
    assert motion.angles[1:] == pytest.approx((-0.2, 0.1), abs=0.05)


def test_a_manager_without_its_status_is_found_by_its_information() -> None:
    one = run('gimbal_manager', 'no-status', only=('heartbeat', 'status-stream')).finish()
    assert one.session.components.found == Address(1, 154)
    assert one.failed == {'status-stream'}


def test_the_attitude_of_a_manager_is_that_of_the_device_that_it_names() -> None:
    session, managed = manager.CHECKS.session(Conditions(Address(255, 190))), Address(1, 194)
    session.receive(managed, gimbal.GimbalManagerStatus(0, 0, 154, 0, 0, 0, 0), 1.0)
    q = (1.0, 0.0, 0.0, 0.0)
    for component in (154, 171):
        session.receive(Address(1, component), AttitudeStatus(
            0, 0, component, 32, q, 0.0, 0.0, 0.0, 0), 1.0)
    assert [one.time_boot_ms for _, one in session.received(AttitudeStatus)] == [154]


def test_the_heading_of_another_component_leaves_north_unchecked() -> None:
    one = run('gimbal', only=('north-needs-heading', 'earth-frame', 'yaw-lock'))
    one.device.mount.motion.take_heading(0.0, 0.0, 0.3, 0.0, one.link.now, math.inf)
    assert one.finish().names(Verdict.SKIPPED) == {
        'north-needs-heading', 'earth-frame', 'yaw-lock'}
