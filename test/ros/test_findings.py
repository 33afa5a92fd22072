# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The findings of ``/diagnostics``: levels and texts that follow from received frames."""

from __future__ import annotations

import math
import re
from typing import Any
from unittest.mock import Mock

from diagnostic_msgs.msg import DiagnosticStatus
from illuminator_ros.illuminator.events import LightSnapshot
from illuminator_ros.illuminator.ros.diagnostics import (
    FLAG_PAUSE,
    FlagLog,
    hardware_id,
    LightsHeard,
    reports,
)
from illuminator_ros.illuminator.settings import LightSettings
from illuminator_ros.mavlink.dialect import mavlink
from illuminator_ros.mavlink.link_state import LinkState
from illuminator_ros.mavlink.messages import Address, CommandAck, Heartbeat, heartbeat
from illuminator_ros.mavlink.signing import Signing, SigningMode
from illuminator_ros.ros.diagnostics import line_reports, link_diagnostics
import pytest
from support.client import Client
from support.fake_light import LIGHT, status_message
from support.frames import frame_of, heartbeat_frame, spoilt
from support.signers import KEY, signed_frame, WRONG_KEY
from support.simulated_link import SimulatedLink

BRIDGE, AUTOPILOT = Address(1, 193), Address(1, 1)
PEER = ('127.0.0.1', 14550)
OK, WARN, ERROR = DiagnosticStatus.OK, DiagnosticStatus.WARN, DiagnosticStatus.ERROR


class Reported:
    """A client on a link, and the statuses of its node."""

    def __init__(self, mode: SigningMode = SigningMode.OFF) -> None:
        self.client = Client(BRIDGE, LightSettings())
        self.link = SimulatedLink(
            self.client, lambda data, peer: None, signing=Signing(mode, KEY))
        self._started = self.link.now
        self._sequence = 0

    def status(self, lost: int = 0, **fields: Any) -> None:
        """Send a status after frames that are lost."""
        self._sequence += 1 + lost
        self.link.run(0.1)
        self.link.receive((frame_of(status_message(
            int(self.link.now * 1000), **fields), self._sequence & 0xFF, LIGHT), PEER))

    def receive(self, *data: bytes) -> None:
        self.link.receive(*((one, PEER) for one in data))

    def snapshot(self) -> LightSnapshot | None:
        light = self.client.lights.get(LIGHT)
        return light.snapshot(self.link.now) if light else None

    def statuses(self, heard: LightsHeard | None = None) -> dict[str, DiagnosticStatus]:
        """Return the statuses by what they are of."""
        light = self.snapshot()
        made = reports(
            link_diagnostics(self.link, self.client, ['udpin://'], (), self.link.now), light=light,
            heard=heard or LightsHeard(0, (), (), False),
            hardware_id=hardware_id(light) if light else '', started=self._started)
        return {one.name: one.message('/illuminator') for one in made}


def found(status: DiagnosticStatus) -> tuple[bytes, str]:
    return status.level, status.message


def value(status: DiagnosticStatus, key: str) -> str:
    return str({entry.key: entry.value for entry in status.values}[key])


def test_each_further_line_has_a_status_and_a_loop_is_a_warning_that_names_both_lines() -> None:
    reported = Reported()
    one = reported.link.state()
    lost = one._replace(state=LinkState.LOST, reason='the device has gone', forwarded=7,
                        not_forwarded={30: 2, 36: 5, 8: 1})
    link = Mock()
    link.lines.snapshots.return_value = one, lost, one
    link.lines.copies.return_value = {(0, 2): 3, (2, 2): 1, (-1, 2): 2}
    urls = ['udpin://', 'serial:///dev/light:57600', 'tcp://router:5760']
    second, third = (report.message('/illuminator') for report in line_reports(
        link_diagnostics(link, reported.client, urls, (), reported.link.now)))

    assert found(second) == (ERROR, 'not open: the device has gone')
    assert (second.name, second.hardware_id) == ('illuminator: link 2', urls[1])
    assert [value(second, key) for key in (
        'frames_forwarded', 'frames_not_forwarded', 'not_forwarded', 'copies_received')] == [
            '7', '8', 'SERVO_OUTPUT_RAW 5, ATTITUDE 2, 8 1', '0']
    assert (third.level, value(third, 'copies_received')) == (WARN, '6')
    for text in (f'copies of frames from {urls[0]} come over {urls[2]}: there is a loop',
                 f'copies of frames come over two senders on {urls[2]}: there is a loop',
                 f'our own frames return over {urls[2]}: there is a loop'):
        assert text in third.message


@pytest.mark.parametrize(('fields', 'level', 'text'), [
    ({'enable': 1}, OK, 'on'),
    ({}, OK, 'off'),
    ({'error_status': 1}, WARN, 'dimmed because it is hot'),
    ({'error_status': 4}, WARN, 'temperature sensor failed'),
    ({'error_status': 3}, ERROR, 'switched off because it is too hot; dimmed because it is hot'),
    ({'error_status': 0x80000000}, WARN, 'unknown flags 0x80000000'),
    ({'brightness': math.nan}, WARN, 'implausible: brightness nan'),
])
def test_status_of_a_light_makes_its_finding_and_the_next_one_ends_it(
    fields: dict[str, Any], level: bytes, text: str,
) -> None:
    reported = Reported()
    reported.status(**fields)
    assert found(reported.statuses()['lamp']) == (level, text)
    reported.status(enable=1)
    assert found(reported.statuses()['lamp']) == (OK, 'on')


def test_lamp_values_are_those_of_the_light_beside_what_was_agreed() -> None:
    reported = Reported()
    reported.status(brightness=90.0)
    reported.status(enable=1, brightness=45.5, temp_c=41.25, error_status=1)
    lamp = reported.statuses()['lamp']
    shown = {entry.key: entry.value for entry in lamp.values}
    assert lamp.hardware_id == 'mavlink:1/243'
    assert shown.items() >= {
        'enabled': 'true', 'mode': 'internal_control', 'brightness_percent': '45.5',
        'strobe_period_s': '0', 'temperature_c': '41.25', 'error_flags': '1', 'address': '1/243',
        'connected': 'true', 'agreed': 'mode internal_control, brightness 90 %, strobe_period '
        '0 s, strobe_duty_cycle 0 %'}.items()


def test_silence_of_a_light_is_a_warning_and_its_loss_an_error() -> None:
    reported = Reported()
    reported.status()
    for _ in range(11):
        reported.link.run(1.0)
        reported.receive(frame_of(heartbeat(mavlink.MAV_TYPE_ILLUMINATOR), 0, LIGHT))
    assert found(reported.statuses()['lamp']) == (WARN, 'no status for 11.00 s')
    reported.link.run(5.0)
    level, text = found(reported.statuses()['lamp'])
    assert (level, text) == (ERROR, 'light 1/243 is lost: no heartbeat for 5.00 s')


def test_lost_frames_are_a_warning_unless_the_light_has_restarted() -> None:
    reported = Reported()
    for _ in range(3):
        reported.status()
    assert value(reported.statuses()['link'], 'loss_percent') == '0'
    reported.status(lost=60)
    reported.link.run(2.0)
    link = reported.statuses()['link']
    assert found(link) == (WARN, '98 % of the frames lost')
    assert value(link, 'frames_lost') == '60'


def test_loss_is_unknown_while_another_component_is_heard_over_the_same_peer() -> None:
    reported = Reported()
    reported.status()
    reported.receive(FOREIGN)
    for _ in range(20):
        # A router sends the answers to another program only to that one.
        reported.status(lost=1)
    link = reported.statuses()['link']
    assert found(link)[0] == OK
    assert [value(link, key) for key in ('loss_percent', 'frames_lost')] == ['unknown'] * 2
    # The other component is silent for 10 s; earlier gaps do not count.
    for _ in range(110):
        reported.status()
    link = reported.statuses()['link']
    assert [value(link, key) for key in ('loss_percent', 'frames_lost')] == ['0', '0']


def test_another_sender_with_our_address_is_an_error_and_the_reason_for_a_missing_light() -> None:
    for message, sender in (
            (heartbeat(mavlink.MAV_TYPE_ONBOARD_CONTROLLER),
             'MAV_TYPE_ONBOARD_CONTROLLER, MAV_AUTOPILOT_INVALID by its HEARTBEAT'),
            (heartbeat(253), 'MAV_TYPE 253, MAV_AUTOPILOT_INVALID by its HEARTBEAT'),
            (CommandAck(405, 0, 0, 0, 0, 0), 'a component without a HEARTBEAT')):
        reported = Reported()
        reported.receive(frame_of(message, 100, BRIDGE))
        text = (f'another sender uses our address 1/193 ({sender}): set the parameter '
                'component_id to an id that is free')
        assert reported.statuses()['link'].message.endswith(text)
        reported.status()
        assert found(reported.statuses()['link']) == (ERROR, text)


def test_peers_beyond_the_limit_which_get_no_answer_are_a_warning() -> None:
    reported = Reported()
    for port, expected in ((32, ''), (33, '33 peers send, and only the first 32 get an answer')):
        reported.link.receive(*((heartbeat_frame(Address(2, one)), ('127.0.0.1', one))
                                for one in range(1, port + 1)))
        message = reported.statuses()['link'].message
        assert ('peers' in message, expected in message) == (bool(expected), True)


FOREIGN = frame_of(Heartbeat(
    mavlink.MAV_TYPE_QUADROTOR, mavlink.MAV_AUTOPILOT_PX4, 0, 0, 4, 3), 0, AUTOPILOT)
UNADDRESSABLE = frame_of(heartbeat(mavlink.MAV_TYPE_ILLUMINATOR), 0, Address(0, 243))


@pytest.mark.parametrize(('mode', 'received', 'reason'), [
    (SigningMode.OFF, [], 'nothing is received: check that the device is on, and that it, or a '
     'router, sends to this address or line; on a serial line, that TX and RX are not swapped'),
    (SigningMode.OFF, [bytes(range(90)), spoilt(FOREIGN)],
     r'111 bytes received, no valid frame; check the baud rate \(discover\)'),
    (SigningMode.OFF, [FOREIGN, frame_of(heartbeat(mavlink.MAV_TYPE_GCS), 0, Address(255, 190))],
     r'2 frames from 1/1 \(autopilot, PX4\) and 255/190 \(ground station\), none from a light: '
     'check that it is on, and that routers forward its frames; discover names the node for '
     'each device'),
    (SigningMode.OFF, [FOREIGN, UNADDRESSABLE], '0/243 heard, whose system id 0 cannot be '
     'addressed: set its system id, such as 1'),
    (SigningMode.REQUIRE, [FOREIGN], '1 frames refused because they are not signed: sign '
     'them at the other side, or set signing_mode to sign'),
    (SigningMode.REQUIRE, [signed_frame(1, key=WRONG_KEY)],
     '1 frames refused for their signature, made with another key: both sides need the same key'),
    (SigningMode.REQUIRE, [signed_frame(1)],
     '1 frames refused as replayed: their time stamps are not newer than the last; compare the '
     'clocks'),
])
def test_missing_light_is_a_warning_with_its_likeliest_reason_and_an_error_after_10_s(
    mode: SigningMode, received: list[bytes], reason: str,
) -> None:
    reported = Reported(mode)
    reported.receive(*received)
    for seconds, level in ((8, WARN), (11, ERROR)):
        reported.link.run(1000.0 + seconds - reported.link.now)
        link = reported.statuses()['link']
        assert link.level == level
        assert re.fullmatch(
            rf'no light connected for {seconds}\.00 s: none heard yet on udp [\d.:]+: {reason}',
            link.message)


def test_silent_light_that_signs_while_signing_is_off_is_a_warning_with_the_remedy() -> None:
    reported = Reported()
    reported.receive(signed_frame(1))
    reported.link.ask(lambda now: reported.client.lights[LIGHT].enable(
        True, now, lambda result, now: None))
    for _ in range(3):
        reported.link.run(1.0)
        reported.receive(signed_frame(1))
    level, text = found(reported.statuses()['link'])
    assert (level, text) == (WARN, 'commands are not answered, and others sign their frames while '
                             'signing_mode is off')


def test_lights_that_are_not_the_target_or_too_many_are_named() -> None:
    link = Reported().statuses(LightsHeard(100, (LIGHT, AUTOPILOT), (), True))['link']
    assert link.message == (
        'no light connected for 0 ms: 1/243, 1/1 heard, none of which is the target: set '
        'target_system and target_component; '
        'more than 100 lights, some ignored')


def test_each_flag_is_logged_when_it_is_set_and_cleared_and_not_more_often_than_in_the_pause(
) -> None:
    log = FlagLog()
    hot = (WARN, 'thermal throttling: dimmed because it is hot')
    assert [log.note(flags, now) for flags, now in (
        (1, 0.0), (1, 1.0), (0, 2.0), (1, 3.0), (0, FLAG_PAUSE), (8, FLAG_PAUSE),
        (0x18, 2 * FLAG_PAUSE))] == [
        [hot], [], [], [], [(OK, 'thermal throttling cleared')], [(WARN, 'unknown flags 0x8')],
        [(WARN, 'unknown flags 0x18')]]
