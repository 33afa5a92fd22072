# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Each fault of a simulated device is found by the requirement that covers it, and by no other."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
import math
from typing import Any

from illuminator_ros.checks.requirements import CheckVerdict
from illuminator_ros.cli.payloads import PAYLOADS
from illuminator_ros.gimbal import messages as gimbal
from illuminator_ros.gimbal.manager_setpoint import Setpoint
from illuminator_ros.illuminator.model import Mode
from illuminator_ros.illuminator.simulated_properties import PROFILES
from illuminator_ros.mavlink.dialect import mavlink, replaced
from illuminator_ros.mavlink.messages import Address, CommandAck, CommandInt, CommandLong
from illuminator_ros.payload.messages import GimbalDeviceAttitudeStatus as AttitudeStatus
from illuminator_ros.rededge.messages import Firmware
from illuminator_ros.simulation.simulated import CommandReply, Effect
import pytest
from support.checks_run import ChecksRun, KINDS, run, start

PASS, FAIL, SKIPPED = CheckVerdict
REQUIREMENTS = {kind: PAYLOADS[kind].load('checks').requirements for kind in KINDS}
every_kind = pytest.mark.parametrize('kind', KINDS)

# Requirements on a light.
ACCEPTED_CHANGES = {'on', 'off', 'mode-internal', 'mode-external', 'brightness', 'strobe',
                    'strobe-limit-values', 'duty-cycle', 'command-int'}
DENIED_VALUES = {'on-off-values', 'mode-values', 'brightness-values', 'strobe-values',
                 'duty-cycle-values', 'not-a-number'}
# On a camera.
CAPTURES = {one.name for one in REQUIREMENTS['rededge'] if one.needs_consent}
UNCONFIRMED = CAPTURES - {'capture-status', 'shot-values', 'other-component'}
PINGS = {'ping', 'ping-sequence', 'ping-once', 'ping-target', 'system-id'}
INJECTED = {'raw-position', 'fused-position', 'attitude', 'validity'}
# On a gimbal manager; the last are those that need a command.
POINTING = {'set-attitude', 'set-pitchyaw', 'pitchyaw', 'one-axis', 'angles-with-rates',
            'all-devices', 'earth-frame'}
TURNING = {'rate', 'pitchyaw-rate', 'manual'}
CHANGED = {'take', 'release', 'unchanged', 'secondary', 'neutral', 'retract', 'flags-shown', 'roi',
           *POINTING, *TURNING}

# Fault -> all requirements that fail: of any component with commands, of both kinds of gimbals, of
# each kind.
COMPONENT = {
    'silence': {'heartbeat'},
    'slow': {'acknowledged-promptly'},
    'heartbeat': {'heartbeat-rate'},
    'no-int': set(),
    'no-broadcast': {'broadcast'},
    'any-target': {'other-target'},
    'no-stop': {'interval-stop'},
    'fixed-rate': {'interval'},
    'unknown': {'unknown-command', 'unknown-message'},
    'no-resume': {'interval-default'},
    'misaddress': {'acknowledged-to-us'},
}
GIMBAL = {
    'no-request': set(),
    'jumps': {'continuous'},
    'no-frame': set(),
    'flags': {'failures-at-rest'},
    'no-identity': {'information'},
    'changing-identity': {'information-static'},
    'no-limits': {'range'},
    'degrees': {'limits', 'range'},
    'runaway': {'stop'},
}
SEEDED: dict[str, dict[str, set[str]]] = {
    'illuminator': {
        **COMPONENT,
        'reboot': {'uptime'},
        'thermistor': {'flags-at-rest'},
        'refuse': ACCEPTED_CHANGES,
        'refuse=failed': ACCEPTED_CHANGES | DENIED_VALUES,
        'progress': set(),
        'progress=3600': ACCEPTED_CHANGES | DENIED_VALUES | {'finished', 'not-busy'},
        'busy': set(),
        'busy=1000': ACCEPTED_CHANGES | DENIED_VALUES | {'not-busy'},
        # The light is already off when it is switched off, and strobes neither at 0 nor at 100 %.
        'lie': ACCEPTED_CHANGES - {'off', 'duty-cycle'} | {'status-agrees'},
        'type': {'heartbeat-type'},
        'autopilot': {'heartbeat-autopilot'},
        'no-clock': {'uptime'},
        'no-identity': {'information-request'},
        'no-terminator': {'information-terminated'},
        'nan': {'not-a-number'},
        'anything': DENIED_VALUES,
        'disobey': {'status-unchanged'},
        'toggle': {'repeated'},
        'on-bright': {'on-configuration'},
        'configure-on': {'configure-switch'},
        'no-request': {'status-request'},
        'flags': {'flags-at-rest'},
        'flags=0x80': {'flags-at-rest'},
        'cold-throttling': {'thermal-flags'},
    },
    'rededge': {
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
        'no-feedback': UNCONFIRMED,
        'late': UNCONFIRMED,
        'same-index': {'capture-index'},
        'no-captures': CAPTURES,
        'no-panel': {'capture-panel'},
        # The 21st image ends the run.
        'burst': {'capture-once', 'raw-position'},
        'any-shot': {'shot-values'},
        'no-injection': INJECTED,
        'stale': {'validity'},
        'extension': {'lengths'},
    },
    'gimbal': {
        **COMPONENT,
        **GIMBAL,
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
        **GIMBAL,
        'refuse': CHANGED,
        'progress': set(),
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
RANDOM = {
    **dict.fromkeys(('illuminator', 'gimbal'), {
        'drop': 'acknowledged', 'duplicate': 'acknowledged-once', 'corrupt': 'checksums',
        'delay': 'acknowledged-promptly', 'reboot': 'uptime'}),
    'rededge': {'drop': 'heartbeat-rate', 'duplicate': 'ping-once', 'delay': 'ping',
                'corrupt': 'checksums', 'reboot': 'capture-index'},
    'gimbal_manager': {},
}
# Profile -> all requirements that fail.
DEVIATIONS: dict[str, dict[str, set[str]]] = {
    'illuminator': {
        'default': set(),
        'extended': set(),
        'reference': {'address', 'information-terminated', 'other-target',
                      'not-a-number', 'interval', 'uptime'},
        'ardusub': {'heartbeat-type', 'heartbeat-autopilot', 'information-request',
                    'configure-switch', 'not-a-number'},
    },
    'gimbal_manager': {
        'reference': set(),
        'px4': {'secondary', 'release-others', 'configure-values', 'no-control-roi',
                'other-device', 'pitchyaw-rate', 'set-pitchyaw', 'one-axis', 'earth-frame'},
        'ardupilot': {'secondary', 'one-player', 'no-control-command', 'no-control-messages',
                      'no-control-roi', 'angles-with-rates', 'one-axis', 'manual', 'earth-frame',
                      'flags-shown', 'limit-flags'},
    },
}


@pytest.mark.parametrize(('kind', 'fault'), [
    (kind, fault) for kind, faults in SEEDED.items() for fault in faults])
def test_a_fault_fails_exactly_its_requirements(kind: str, fault: str) -> None:
    assert run(kind, fault).failed == SEEDED[kind][fault]


@pytest.mark.parametrize(('kind', 'fault'), [
    (kind, fault) for kind, faults in RANDOM.items() for fault in faults])
def test_a_random_fault_fails_its_requirement(kind: str, fault: str) -> None:
    assert RANDOM[kind][fault] in run(kind, fault, seed=1).failed


@pytest.mark.parametrize(('kind', 'profile'), [
    (kind, profile) for kind, profiles in DEVIATIONS.items() for profile in profiles])
def test_a_profile_fails_exactly_its_known_deviations_and_is_restored(
        kind: str, profile: str) -> None:
    profiles = PAYLOADS[kind].load('simulated').profiles
    assert profiles.keys() == DEVIATIONS[kind].keys()
    done = run(kind, of=profiles[profile].properties)
    assert done.failed == DEVIATIONS[kind][profile]
    assert done.runner.restored == f'the {done.checks.device} is as it was'


@every_kind
def test_a_device_without_faults_meets_every_requirement_and_is_restored(kind: str) -> None:
    # A light must get hot.
    done = run(kind, time_scale=120.0)
    assert done.names(PASS) == {one.name for one in REQUIREMENTS[kind]}
    assert done.runner.passed
    assert done.runner.restored.startswith(f'the {done.checks.device} is as it was')


# Faulty devices that no fault of the simulator makes

def _sends_irregularly(one: ChecksRun) -> None:
    for interval in (0.2, 2.0):
        one.link.run(1.0)
        one.set_interval(interval)


def _wrap(owner: Any, method: str, change: Callable[..., Any]) -> None:
    """Replace a method by a function that is also given the method."""
    original = getattr(owner, method)
    setattr(owner, method, lambda *arguments: change(original, *arguments))


def _changed(cls: type[Any], **fields: Any) -> Callable[[ChecksRun], None]:
    def message(original: Any, message_id: int, now: float) -> Any:
        found = original(message_id, now)
        return replaced(found, **fields) if isinstance(found, cls) else found
    return lambda one: _wrap(one.device, 'message', message)


def _moves_when_unset(one: ChecksRun) -> None:
    def moved(original: Any, demand: Setpoint, *others: Any) -> None:
        unset = all(map(math.isnan, (*demand.angles, *demand.rates))) and not demand.is_pose
        original(Setpoint(angles=(0.0, 0.5, 0.0)) if unset else demand, *others)
    _wrap(one.device, 'obey', moved)


def _turns_with_the_vehicle(one: ChecksRun) -> None:
    def turned(original: Any, demand: Setpoint, *others: Any) -> None:
        original(demand._replace(angles=(0.0, -0.26, 0.5)) if (
            demand.flags & mavlink.GIMBAL_DEVICE_FLAGS_YAW_LOCK) else demand, *others)
    _wrap(one.device, 'obey', turned)


def _forgets_at_minus_1(one: ChecksRun) -> None:
    def execute(original: Any, source: Address, command: Any, now: float) -> Any:
        unchanged = command.command == mavlink.MAV_CMD_DO_GIMBAL_MANAGER_CONFIGURE and (
            command.param1 == command.param3 == -1)
        return original(source, replaced(
            command, param1=0.0, param2=0.0) if unchanged else command, now)
    _wrap(one.device, 'execute', execute)


def _accepts_what_it_ignores(one: ChecksRun) -> None:
    def execute(original: Any, *arguments: Any) -> Any:
        reply = original(*arguments)
        denied = reply is not None and reply.result == mavlink.MAV_RESULT_DENIED
        return CommandReply(mavlink.MAV_RESULT_ACCEPTED) if denied else reply
    _wrap(one.device, 'execute', execute)


def _answers_requests(cls: type[Any], *answers: CommandAck) -> Callable[[ChecksRun], None]:
    """Answer MAV_CMD_REQUEST_MESSAGE, in messages of a class, with these messages only."""
    def seed(one: ChecksRun) -> None:
        def receive(original: Any, source: Address, message: Any, now: float) -> None:
            if isinstance(message, cls) and message.command == mavlink.MAV_CMD_REQUEST_MESSAGE:
                one.component.outgoing.extend((one.component.address, ack) for ack in answers)
            else:
                original(source, message, now)
        _wrap(one.component, 'receive', receive)
    return seed


def _is_silent_at_device_0(one: ChecksRun) -> None:
    _wrap(one.device, 'receive', lambda original, source, message, now: () if getattr(
        message, 'gimbal_device_id', None) == 0 else original(source, message, now))


ACCEPTED = CommandAck(mavlink.MAV_CMD_REQUEST_MESSAGE, mavlink.MAV_RESULT_ACCEPTED)
BOTH_FRAMES = _changed(
    AttitudeStatus, flags=mavlink.GIMBAL_DEVICE_FLAGS_YAW_IN_VEHICLE_FRAME
    | mavlink.GIMBAL_DEVICE_FLAGS_YAW_IN_EARTH_FRAME)
SHORT_QUATERNION = _changed(AttitudeStatus, q=(0.5, 0.0, 0.0, 0.0))
INFORMATION, STATUS = gimbal.GimbalDeviceInformation, gimbal.GimbalManagerStatus
# The kind and a requirement -> properties, or a change of a device that does not meet it.
FAULTY: dict[tuple[str, str], Mapping[str, Any] | Callable[[ChecksRun], None]] = {
    ('illuminator', 'address'): {'address': Address(255, 0)},
    ('illuminator', 'status-mode'): {'mode_bitmask': 0},
    ('illuminator', 'strobe-limits'): {'min_strobe_period': 5.0, 'max_strobe_period': 1.0},
    ('illuminator', 'information-text'): {'vendor': '\x01\x02'},
    ('illuminator', 'mode-internal'): {'modes': (), 'mode_bitmask': 3},
    ('illuminator', 'status-content'): lambda one: setattr(
        one.device, 'configuration', replace(one.device.configuration, brightness=math.nan)),
    ('illuminator', 'status-stream'): _sends_irregularly,
    ('rededge', 'mavlink-1'): {'version': 2},
    ('gimbal', 'device-id'): _changed(INFORMATION, gimbal_device_id=3),
    ('gimbal', 'limits'): _changed(INFORMATION, roll_min=1.0),
    ('gimbal', 'pitch-axis'): _changed(INFORMATION, cap_flags2=256),
    ('gimbal', 'status-request'): _answers_requests(CommandLong),
    ('gimbal_manager', 'status-request'): _answers_requests(CommandLong),
    ('gimbal', 'command-int'): _answers_requests(CommandInt, ACCEPTED),
    ('gimbal_manager', 'command-int'): _answers_requests(CommandInt, ACCEPTED),
    ('gimbal', 'yaw-frame'): BOTH_FRAMES,
    ('gimbal_manager', 'yaw-frame'): BOTH_FRAMES,
    ('gimbal', 'yaw-lock'): _turns_with_the_vehicle,
    ('gimbal', 'attitude'): SHORT_QUATERNION,
    ('gimbal', 'status-to-all'): _changed(AttitudeStatus, target_system=1),
    ('gimbal', 'uptime'): _changed(AttitudeStatus, time_boot_ms=0),
    ('gimbal', 'limit-flags'): _changed(AttitudeStatus, failure_flags=0),
    ('gimbal', 'hold'): _moves_when_unset,
    ('gimbal_manager', 'hold'): _moves_when_unset,
    ('gimbal_manager', 'manager-status-request'): _changed(STATUS, gimbal_device_id=2),
    ('gimbal_manager', 'attitude-stream'): _changed(AttitudeStatus, gimbal_device_id=0),
    ('gimbal_manager', 'attitude'): SHORT_QUATERNION,
    ('gimbal_manager', 'limits'): _changed(gimbal.GimbalManagerInformation, roll_min=1.0),
    ('gimbal_manager', 'pitch-axis'): _changed(gimbal.GimbalManagerInformation, cap_flags=256),
    ('gimbal_manager', 'unchanged'): _forgets_at_minus_1,
    ('gimbal_manager', 'all-devices'): _is_silent_at_device_0,
    ('gimbal_manager', 'no-control-command'): _accepts_what_it_ignores,
}


@pytest.mark.parametrize(('kind', 'name'), FAULTY)
def test_a_faulty_device_fails_its_requirement(kind: str, name: str) -> None:
    fault = FAULTY[kind, name]
    one = start(kind, only=(name,), **fault if isinstance(fault, Mapping) else {})
    if not isinstance(fault, Mapping):
        fault(one)
    assert name in one.finish().failed


# A gimbal shares the checks of the address, and of changes by command, with a light.
UNBROKEN = {'gimbal': {'address', 'finished', 'not-busy'},
            'gimbal_manager': {'address', 'finished'}}


@every_kind
def test_every_fault_is_seeded_and_every_requirement_can_fail(kind: str) -> None:
    # The checks of a component are the same ones for a manager.
    shared = {**COMPONENT, **{name: {one} for name, one in RANDOM['gimbal'].items()}} if (
        kind == 'gimbal_manager') else {}
    assert set(PAYLOADS[kind].load('simulated').device.faults) == {
        *(name.partition('=')[0] for name in (*SEEDED[kind], *shared)), *RANDOM[kind]}
    found = set().union(
        *SEEDED[kind].values(), *shared.values(), RANDOM[kind].values(),
        *DEVIATIONS.get(kind, {}).values(),
        {name for one, name in FAULTY if one == kind})
    assert {one.name for one in REQUIREMENTS[kind]} - found == UNBROKEN.get(kind, set())


# Details of results

LIE = 'MAV_RESULT_ACCEPTED, but then the status differs in '
ARDUSUB = PROFILES['ardusub'].properties


@pytest.mark.parametrize(('kind', 'fault', 'name', 'verdict', 'detail', 'line'), [
    ('illuminator', 'lie', 'on', FAIL, LIE + 'enable: off', '< ILLUMINATOR_STATUS '),
    ('illuminator', 'lie', 'mode-internal', FAIL, LIE + 'brightness: off',
     '< ILLUMINATOR_STATUS '),
    ('illuminator', 'lie', 'mode-external', FAIL, LIE + 'mode and brightness: off', ''),
    ('illuminator', 'lie', 'brightness', FAIL, LIE + 'brightness: off', ''),
    ('illuminator', 'lie', 'off', SKIPPED, 'could not be switched on before', ''),
    ('illuminator', 'lie', 'thermal-flags', SKIPPED, 'never reported that it was on', ''),
    ('illuminator', 'refuse', 'status-agrees', SKIPPED, 'no change was accepted', ''),
    ('illuminator', 'anything', 'status-unchanged', SKIPPED, 'no change was rejected', ''),
    ('illuminator', 'anything', 'brightness-values', FAIL,
     'MAV_CMD_DO_ILLUMINATOR_CONFIGURE 1 101 0 0: MAV_RESULT_ACCEPTED',
     '< COMMAND_ACK MAV_CMD_DO_ILLUMINATOR_CONFIGURE: MAV_RESULT_ACCEPTED'),
    # A change that never completes does not delay the run.
    ('illuminator', 'progress=3600', 'on', FAIL, 'no acknowledgement', ''),
    ('rededge', 'ping-sequence', 'ping-sequence', FAIL, 'answers sequence number 0 with 1', ''),
    ('rededge', 'ping-target', 'ping-target', FAIL, 'to 0/0 instead of 255/190', ''),
    ('rededge', 'other-ping', 'ping', FAIL, 'no answer to 3 requests within 1 s each', ''),
    ('rededge', 'fixed-system', 'system-id', FAIL,
     'after a message from 2/190 it sends from 255/100', ''),
    ('rededge', 'no-captures', 'validity', FAIL, 'confirms no captures, with firmware 7.1.0', ''),
    ('rededge', 'late', 'capture-feedback', FAIL,
     'no CAMERA_FEEDBACK within 10 s after CAMERA_STATUS', ''),
    ('rededge', 'stale', 'validity', FAIL, 'still used 7 s later', ''),
    ('rededge', 'no-injection', 'raw-position', FAIL,
     '47.3977420, 8.5455940, 488.00 m instead of -48.8766667', ''),
])
def test_a_result_has_its_reason_and_the_messages_that_show_it(
    kind: str, fault: str, name: str, verdict: CheckVerdict, detail: str, line: str,
) -> None:
    # The comparison of statuses needs commands of other checks.
    only = (name, 'on', 'on-off-values')
    result = run(kind, fault, only=only).result(name)
    assert result.verdict is verdict
    assert detail in result.detail
    assert line in '\n'.join(result.exchange[-1:])


@pytest.mark.parametrize('name', ['strobe', 'strobe-values', 'duty-cycle'])
def test_a_light_without_strobe_limits_is_not_made_to_strobe(name: str) -> None:
    result = run('illuminator', of=ARDUSUB, only=(name,)).result(name)
    assert (result.verdict, result.detail) == (SKIPPED, 'it reports no strobe limits')


def test_a_light_that_sends_its_status_on_request_only_passes() -> None:
    done = run('illuminator', status_interval=0.0)
    assert done.failed == set()
    assert done.result('status-stream').verdict is SKIPPED


def test_a_light_that_stays_in_external_sync_fails_mode_internal() -> None:
    one = start('illuminator', only=('mode-internal', 'mode-external'))

    def stuck(original: Any, effect: Effect, now: float) -> None:
        mode = one.device.configuration.mode
        original(effect, now)
        if mode is Mode.EXTERNAL_SYNC:
            one.device.configuration = replace(one.device.configuration, mode=mode)
    _wrap(one.component, 'apply', stuck)
    assert one.finish().failed == {'mode-internal'}
    assert 'then the status differs in mode' in one.result('mode-internal').detail


def test_an_accepted_change_passes_where_the_light_reports_no_status() -> None:
    one = start('illuminator', 'lie', status_interval=0.0, only=('on',))
    one.link.run_until(lambda: any(
        sent.text.endswith('ON_OFF 1') for sent in one.session.transactions), within=60.0)
    one.fault('no-request')
    assert one.finish().result('on').verdict is PASS


def test_the_heading_of_another_component_leaves_north_unchecked() -> None:
    names = {'north-needs-heading', 'earth-frame', 'yaw-lock'}
    one = start('gimbal', only=tuple(names))
    one.device.motion.receive_heading(0.0, 0.0, 0.3, 0.0, one.link.now, math.inf)
    assert one.finish().names(SKIPPED) == names


@pytest.mark.parametrize(('firmware', 'fault', 'skipped'), [
    ('1.3.2', (), CAPTURES | {'capture-index'}),
    ('1.3.2', ('type',), CAPTURES | {'capture-index', 'heartbeat-contents'}),
    ('1.3.2', ('fixed-system',), CAPTURES | {'capture-index', 'system-id'}),
    ('1.5.5', ('fixed-system',), {'system-id', 'any-system'}),
    ('1.5.5', ('any-target',), {'other-component'}),
])
def test_requirements_of_later_firmware_are_skipped_with_the_firmware_that_brought_them(
        firmware: str, fault: tuple[str, ...], skipped: set[str]) -> None:
    done = run('rededge', *fault, firmware=Firmware.parse(firmware))
    assert done.failed == set()
    assert done.names(SKIPPED) == skipped
    assert all('as firmware before ' in done.result(name).detail
               for name in skipped - {'capture-index'})


# Devices that stop, or do not answer

def test_a_device_that_stops_sending_fails_and_later_checks_are_skipped() -> None:
    light = start('illuminator')
    light.link.run(8.0)
    light.fault('silence')
    assert {'heartbeat-rate', 'acknowledged'} < light.finish().failed
    assert light.result('thermal-flags').detail == 'the light has stopped sending'

    camera = start('rededge')
    camera.link.run_until(lambda: 'ping-sequence' in camera.names(PASS), within=60.0)
    camera.fault('silence=600')
    camera.finish()
    assert camera.result('ping-target').detail == 'the camera has stopped sending'
    assert camera.names(SKIPPED) >= {'system-id'} | CAPTURES


def deafen(one: ChecksRun) -> None:
    """Let the devices of a run receive nothing more."""
    one.devices.receive = lambda *args: None


def test_a_light_that_receives_nothing_fails_within_five_minutes() -> None:
    one = start('illuminator')
    deafen(one)
    begun = one.link.now
    one.finish()
    assert one.link.now - begun < 300.0
    assert {'status-request', 'on', 'acknowledged'} < one.failed
    assert one.result('on').detail == 'MAV_CMD_ILLUMINATOR_ON_OFF 1: no acknowledgement'


def test_a_light_that_is_busy_for_ever_fails_within_five_minutes() -> None:
    one = start('illuminator', 'busy=1000000')
    begun = one.link.now
    assert one.finish().link.now - begun < 300.0


def test_a_light_that_has_acknowledged_a_command_is_sent_each_attempt() -> None:
    one = start('illuminator')
    receive = one.devices.receive
    deafen(one)
    one.link.run_until(lambda: one.session.transactions.total == 5, within=100.0)
    one.devices.receive = receive
    one.link.run_until(lambda: any(sent.acks for sent in one.session.transactions), within=10.0)
    deafen(one)
    one.finish()

    assert [len(sent.sent) for sent in one.session.transactions][3:5] == [4, 1]
    assert len(one.session.transactions[-1].sent) == 4
