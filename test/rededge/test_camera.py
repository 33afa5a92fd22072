# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The client of a camera: liveness, PING and captures, message by message."""

from __future__ import annotations

from typing import Any

from illuminator_ros.geometry.rotation import Quaternion
from illuminator_ros.mavlink.command_sender import CommandSender
from illuminator_ros.mavlink.component import Component
from illuminator_ros.mavlink.messages import Address, Heartbeat, heartbeat, Message
from illuminator_ros.payload.device_events import DeviceConnected, DeviceDisconnected
from illuminator_ros.rededge import messages as rededge
from illuminator_ros.rededge.client import ImageTaken, RedEdgeClient
from illuminator_ros.rededge.input_states import CameraSettings, Input, Stamp
import pytest
from support.bench import Bench

OWN, NEW, ADOPTED = Address(1, 191), Address(255, 100), Address(1, 100)
# The heartbeat of real cameras; its type and autopilot do not identify a camera.
BEAT = Heartbeat(0, 1, 2, 3, 4, 3)
PHOTO, CLOSED_LOOP, OPEN_LOOP = 0, 3, 4
ENDING = 'the bridge is ending'


def feedback(index: int, flags: int = CLOSED_LOOP) -> rededge.CameraFeedback:
    return rededge.CameraFeedback(0, 1, 0, index, 0, 0, 0, 0, 0, 0, 0, 0, flags)


def status(index: int, event: int = 1) -> rededge.CameraStatus:
    return rededge.CameraStatus(0, 1, 0, index, event, 0, 0, 0, 0)


class Rig(Bench):
    """A client on an open link, and the results of its requests."""

    def __init__(self, *, connected: bool = True) -> None:
        commands = CommandSender(OWN)
        self.client = RedEdgeClient(commands, CameraSettings(), sequence=0xFFFFFFFE)
        self.component = Component(commands, [self.client])
        super().__init__(self.component, 100.0)
        self.events: list[Any] = []
        self.results: list[tuple[bool, str]] = []
        self.client.events.subscribe(self.events.append)
        self.component.link_opened(self.now)
        # Our own heartbeats then coincide with no other deadline.
        self.run(0.3)
        if connected:
            self.hear(BEAT)

    def hear(self, *messages: Message, source: Address = NEW) -> None:
        for message in messages:
            self.component.receive(source, message, self.now)

    def run(self, seconds: float, beats: bool = False) -> Rig:
        """Let time pass in steps of 50 ms; the camera may send a heartbeat each second."""
        end = round(self.now + seconds, 6)
        self.poll()
        while self.now < end:
            self.now = round(min(self.now + 0.05, end), 6)
            if beats and not round(self.now * 20) % 20:
                self.hear(BEAT)
            self.poll()
        return self

    def take_result(self, success: bool, text: str) -> None:
        self.results.append((success, text))

    def ping(self) -> rededge.Ping:
        """Request a PING and return it."""
        self.client.ping(self.now, self.take_result)
        self.run(0.0)
        found: rededge.Ping = self.messages(rededge.Ping)[-1]
        return found

    def capture(self, shot: rededge.Shot = rededge.Shot.SURVEY) -> None:
        self.client.capture(shot, self.now, self.take_result)
        self.run(0.0)

    @property
    def state(self) -> Any:
        return self.client.snapshot(self.now)


def reply(request: rededge.Ping, **changes: int) -> rededge.Ping:
    return rededge.Ping(**{'time_usec': 0, 'seq': request.seq, 'target_system': OWN.system,
                           'target_component': OWN.component, **changes})


def test_the_camera_is_known_by_its_component_id_alone_re_6_re_7() -> None:
    rig = Rig(connected=False)
    rig.hear(BEAT, source=Address(255, 1))
    rig.hear(heartbeat(30), source=Address(1, 101))
    assert rig.events == []

    rig.hear(BEAT)
    assert rig.events == [DeviceConnected(NEW)]


def test_a_camera_that_adopts_our_system_id_is_the_same_camera_re_8() -> None:
    rig = Rig()
    rig.hear(BEAT, source=ADOPTED)
    rig.run(3.4)
    assert rig.events == [DeviceConnected(NEW)]
    assert (rig.state.address, rig.state.conflict) == (ADOPTED, False)
    rig.capture()
    control = rig.messages(rededge.DigicamControl)[-1]
    assert (control.target_system, control.target_component) == ADOPTED


def test_a_camera_with_our_system_id_is_kept_beside_those_of_other_vehicles() -> None:
    rig = Rig()
    for system in range(2, 50):
        rig.hear(BEAT, source=ADOPTED)
        rig.run(0.1)
        rig.hear(BEAT, source=Address(system, 100))
    assert (rig.state.address, rig.state.conflict) == (ADOPTED, True)
    # A camera that has restarted has another system id until it hears us.
    rig.run(3.6)
    rig.hear(BEAT)
    assert rig.state.address == NEW


def test_a_camera_is_lost_after_3_5_s_and_found_again_re_9() -> None:
    rig = Rig()
    rig.run(3.4)
    assert rig.events == [DeviceConnected(NEW)]
    rig.run(0.2)
    assert rig.events[1:] == [DeviceDisconnected(NEW, 'no heartbeat for 3.50 s')]
    rig.run(6.4)
    rig.capture()
    assert rig.results == [(False, f'camera {NEW} is lost: no heartbeat for 10.00 s')]
    assert rig.state.loss == rig.results[0][1]
    rig.hear(BEAT)
    assert rig.events[2:] == [DeviceConnected(NEW)]

    rig.component.components_lost([ADOPTED], rig.now, 'unplugged')
    assert rig.events[3:] == []
    rig.component.components_lost([NEW], rig.now, 'unplugged')
    assert rig.events[3:] == [DeviceDisconnected(NEW, 'link lost: unplugged')]
    rig.hear(BEAT)
    rig.component.link_closed(rig.now, 'unplugged')
    assert rig.events[4:] == [
        DeviceConnected(NEW), DeviceDisconnected(NEW, 'link lost: unplugged')]


def test_two_components_with_the_camera_s_id_are_noticed() -> None:
    rig = Rig()
    rig.run(8.0, beats=True)
    assert not rig.state.conflict
    for _ in range(7):
        rig.hear(BEAT, source=ADOPTED)
        rig.run(1.0, beats=True)
    assert rig.state.conflict
    rig.capture()
    rig.hear(status(1), feedback(1))
    assert rig.results == [(True, 'image 1 taken, confirmed after 0 ms; several components have '
                                  "the camera's id, so another may have taken it")]
    rig.run(10.0, beats=True)
    assert not rig.state.conflict


def test_each_ping_is_a_request_with_a_new_sequence_number_that_wraps_re_10() -> None:
    rig = Rig()
    rig.run(5.0, beats=True)
    pings = rig.messages(rededge.Ping)
    assert [(one.target_system, one.target_component) for one in pings] == [(0, 0)] * 3
    assert [one.seq for one in pings] == [0xFFFFFFFF, 0, 1]


def test_ping_answers_with_the_round_trip_by_our_clock_re_11() -> None:
    rig = Rig()
    request = rig.ping()
    rig.run(0.25)
    rig.hear(reply(request, time_usec=1))
    rig.run(2.1, beats=True)
    assert rig.results == [(True, '250.0 ms round trip')]
    assert rig.state.round_trip == pytest.approx(0.25)


@pytest.mark.parametrize(('source', 'changes'), [
    (NEW, {'seq': 5}), (NEW, {'target_system': 0, 'target_component': 0}),
    (NEW, {'target_component': 190}), (Address(1, 1), {})],
    ids=['sequence', 'request', 'for another', 'from another'])
def test_what_is_no_reply_of_the_camera_to_us_is_no_success_re_12(
        source: Address, changes: dict[str, int]) -> None:
    rig = Rig()
    request = rig.ping()
    rig.hear(reply(request, **changes), source=source)
    rig.run(2.1, beats=True)
    assert rig.results == [(False, 'no reply to 2 PINGs')]


def test_a_lost_ping_is_sent_again_with_another_number_re_12() -> None:
    rig = Rig()
    first = rig.ping()
    rig.run(1.2)
    second = rig.messages(rededge.Ping)[-1]
    rig.hear(reply(second))
    assert second.seq != first.seq
    assert [success for success, _ in rig.results] == [True]


def test_a_camera_that_hears_nothing_is_noticed() -> None:
    rig = Rig()
    rig.run(4.6, beats=True)
    assert not rig.state.is_unresponsive
    rig.run(3.0, beats=True)
    assert rig.state.is_unresponsive
    rig.hear(reply(rig.ping()))
    assert not rig.state.is_unresponsive


def test_no_request_waits_without_a_link() -> None:
    rig = Rig()
    rig.ping()
    rig.capture()
    rig.component.link_closed(rig.now, 'unplugged')
    rig.client.ping(rig.now, rig.take_result)
    rig.capture()
    assert rig.results == [
        (False, 'link lost: unplugged'),
        (False, 'link lost: unplugged; the image may have been taken'),
        (False, 'link lost: unplugged'), (False, f'camera {NEW} is lost: link lost: unplugged')]
    pings = len(rig.messages(rededge.Ping))
    rig.run(5.0)
    assert (len(rig.messages(rededge.Ping)), rig.state.unanswered_pings) == (pings, 0)
    rig.component.link_opened(rig.now)
    assert rig.state.loss.startswith(f'camera {NEW} is lost: no heartbeat for ')


@pytest.mark.parametrize('shot', rededge.Shot)
def test_a_capture_is_a_success_after_its_feedback_re_5(shot: rededge.Shot) -> None:
    rig = Rig()
    rig.capture(shot)
    assert rig.messages(rededge.DigicamControl) == [
        rededge.DigicamControl(255, 100, 1, 1, 0, 0, shot, 0, 0, 0.0)]
    rig.hear(status(1))
    rig.run(0.5)
    assert rig.results == []
    rig.hear(feedback(1))
    assert rig.results == [(True, 'image 1 taken, confirmed after 500 ms')]
    assert rig.events[-1] == ImageTaken(feedback(1))


CAPTURE = object()
NO_ANSWER = 'no answer to DIGICAM_CONTROL within 5.00 s'
OPEN = ('image 7 triggered, not confirmed: its CAMERA_FEEDBACK has the flags 4 '
        '(CAMERA_FEEDBACK_OPENLOOP)')
AMBIGUOUS = f'{NO_ANSWER}; an image was reported that an earlier request may have caused'


class Lost(float):
    """So many seconds without a heartbeat, and then one."""


def image(index: int) -> tuple[Message, Message]:
    """Return the reports of an image that was taken."""
    return status(index), feedback(index)


def triggered(index: int) -> str:
    return f'image {index} triggered, not confirmed: no CAMERA_FEEDBACK within 5.00 s'


def taken(index: int) -> str:
    return f'image {index} taken, confirmed after 0 ms'


# Captures, seconds that pass, and messages of the camera; and the answers.
@pytest.mark.parametrize(('steps', 'answers'), [
    ([CAPTURE, 4.9], []),
    ([CAPTURE, 5.0], [NO_ANSWER]),
    ([CAPTURE, status(7, event=3), 5.0], [NO_ANSWER]),
    ([CAPTURE, status(7), 5.0], [triggered(7)]),
    # CAMERA_FEEDBACK_PHOTO, as ArduPilot sends it.
    ([CAPTURE, status(7), feedback(7, PHOTO)], [taken(7)]),
    ([CAPTURE, status(7), feedback(7, OPEN_LOOP), 5.0], [OPEN]),
    ([CAPTURE, status(7), feedback(7, OPEN_LOOP), feedback(7)], [taken(7)]),
    ([CAPTURE, status(7), feedback(8), 5.0], [triggered(7)]),
    # An answer that comes late does not confirm the next capture,
    ([CAPTURE, 5.0, CAPTURE, *image(1), *image(2)], [NO_ANSWER, taken(2)]),
    ([CAPTURE, status(3), 5.0, CAPTURE, feedback(3), *image(4)], [triggered(3), taken(4)]),
    # which may make captures fail for 15 s only.
    ([CAPTURE, 5.0, *(step for index in range(1, 6) for step in (CAPTURE, *image(index), 5.0))],
     [NO_ANSWER, AMBIGUOUS, AMBIGUOUS, AMBIGUOUS, taken(4), taken(5)]),
    # An image that is older than the newest confirms nothing; its number has 16 bits.
    ([CAPTURE, 5.0, CAPTURE, status(2), feedback(1)], [NO_ANSWER]),
    ([CAPTURE, 5.0, CAPTURE, status(0), feedback(0xFFFF)], [NO_ANSWER]),
    # A camera that has restarted is 32 or more behind,
    ([*image(40), CAPTURE, *image(9)], []),
    ([*image(40), CAPTURE, *image(8)], [taken(8)]),
    # or was lost, and counts from the start again.
    ([CAPTURE, *image(1), 5.1, Lost(4.0), CAPTURE, *image(1)], [taken(1), taken(1)]),
    ([CAPTURE, status(1), 5.1, Lost(4.0), CAPTURE, *image(1)], [triggered(1), taken(1)]),
    ([CAPTURE, status(1), Lost(26.1), CAPTURE, feedback(1)], [triggered(1), taken(1)]),
])
def test_a_capture_is_answered_by_the_first_new_image_after_it(
        steps: list[Any], answers: list[str]) -> None:
    rig = Rig()
    for step in steps:
        if step is CAPTURE:
            rig.capture()
        elif isinstance(step, float):
            rig.run(step, beats=not isinstance(step, Lost))
            rig.hear(BEAT)
        else:
            rig.hear(step)
    assert rig.results == [('taken,' in text, text) for text in answers]


def test_an_image_that_was_not_requested_here_is_reported() -> None:
    rig = Rig()
    rig.hear(status(3), feedback(3))
    assert rig.events[1:] == [ImageTaken(feedback(3))]
    assert (rig.state.images, rig.state.image_index) == (1, 3)


def test_a_report_that_comes_again_over_a_second_path_is_one_image() -> None:
    rig = Rig()
    for index in (1, 2):
        rig.capture()
        rig.hear(*image(index), *image(index))
    rig.hear(*image(1))
    assert [one.feedback for one in rig.events[1:]] == [feedback(1), feedback(2)]
    assert rig.state.images == 2
    assert rig.results == [(True, taken(1)), (True, taken(2))]


@pytest.mark.parametrize('triggered', [[], [status(1)], [status(1), status(1)]],
                         ids=['no status', 'status', 'status twice'])
@pytest.mark.parametrize('end', ['link', 'heartbeat', 'both'])
def test_an_answer_from_before_a_loss_does_not_confirm_the_next_capture(
        end: str, triggered: list[Message]) -> None:
    rig = Rig()
    rig.capture()
    rig.hear(*triggered)
    if end != 'link':
        rig.run(5.1)
    if end != 'heartbeat':
        rig.component.link_closed(rig.now, 'unplugged')
        rig.component.link_opened(rig.now)
    rig.hear(BEAT)
    rig.capture()
    rig.hear(feedback(1))
    assert [success for success, _ in rig.results] == [False]
    rig.hear(status(2), feedback(2))
    assert rig.results[1:] == [(True, 'image 2 taken, confirmed after 0 ms')]


def test_from_the_beginning_of_the_end_requests_are_answered_and_nothing_is_sent() -> None:
    rig = Rig()
    rig.ping()
    rig.capture()
    sent = len(rig.sent)
    rig.component.close(rig.now, ENDING)
    rig.client.ping(rig.now, rig.take_result)
    rig.capture()
    rig.client.feeder.orientation.receive_attitude(
        Input.ATTITUDE, Quaternion(), (0.0, 0.0, 0.0), Stamp(1, 0.0), rig.now)
    rig.run(0.6)

    assert rig.results == [(False, text) for text in (
        ENDING, f'{ENDING}; the image may have been taken', ENDING, ENDING)]
    assert len(rig.sent) == sent


def test_a_capture_is_refused_without_a_camera_or_while_another_runs() -> None:
    rig = Rig(connected=False)
    rig.capture()
    rig.hear(BEAT)
    rig.capture()
    rig.run(1.2)
    rig.capture()
    assert rig.results == [(False, 'no camera connected: none heard yet'), (
        False, 'another capture is under way since 1.20 s: the camera has not answered; it ends '
        'within 3.80 s')]
    assert len(rig.messages(rededge.DigicamControl)) == 1
