# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The order of the monitor's requests, with services that answer when a test lets them."""

from types import SimpleNamespace
from typing import Any, cast

from illuminator_ros.cli.monitor.ros_graph import (
    ANSWER_LIMIT,
    DISCOVERY_LIMIT,
    GraphDevice,
    OFF_INTERVAL,
    OFF_LIMIT,
    OFF_RETRY,
    WANTED_LIFETIME,
)
from illuminator_ros.ros.monitor_view import Device, DONE, FAILED, ON_AGAIN, Request
import pytest
from rclpy.node import Node
from rclpy.task import Future
from std_srvs.srv import SetBool
from support.monitor import gimbal, light


class Endpoint:
    """The common part of clients and publishers, with the messages that were sent."""

    def __init__(self, type_: Any = None) -> None:
        self.srv_type = type_
        self.handle = self
        self.ready = True
        self.sent: list[Any] = []


class Client(Endpoint):
    """A client of a service."""

    def __init__(self, type_: Any) -> None:
        super().__init__(type_)
        self.futures: dict[int, Future] = {}
        self.answers: list[tuple[Any, Any]] = []

    def service_is_ready(self) -> bool:
        return self.ready

    def call_async(self, request: Any) -> Future:
        self.sent.append(request)
        return self.futures.setdefault(len(self.sent), Future())

    def get_pending_request(self, number: int) -> Future:
        return self.futures[number]

    def take_response(self, type_: Any) -> tuple[Any, Any]:
        return self.answers.pop(0) if self.answers else (None, None)


class Topic(Endpoint):
    """A publisher."""

    def get_subscription_count(self) -> int:
        return int(self.ready)

    def publish(self, message: Any) -> None:
        self.sent.append(message)


class Bench:
    """A device, by default a light that is off and steady, at 40 %."""

    def __init__(self, of: Device | None = None, may_request: bool = True) -> None:
        self.endpoints: dict[str, Any] = {}
        of = of or light()
        self.device = GraphDevice(
            cast(Node, self), of.name, of.view, 0.0, may_request=may_request)
        self.device.values = of.values

    def create_subscription(self, *arguments: Any) -> None:
        """Do nothing: the values are known."""

    def create_client(self, type_: Any, name: str) -> Client:
        made: Client = self.endpoints.setdefault(name, Client(type_))
        return made

    def create_publisher(self, type_: Any, name: str, depth: int) -> Topic:
        made: Topic = self.endpoints.setdefault(name, Topic())
        return made

    def poll(self, now: float = 0.0) -> None:
        """Let time pass, up to a time, s."""
        self.device.poll_answers(now)

    def press(self, *keys: str, typed: str = '') -> None:
        for key in keys:
            [found] = [one for one in (*self.device.view.keys, *self.device.view.steering)
                       if key in one.keys]
            request = found.request(self.device, typed)
            assert isinstance(request, Request)
            self.device.submit(request)

    def sets(self) -> list[dict[str, float]]:
        """Return the parameters of each set that was sent."""
        sent = self.endpoints['/bow/set_parameters_atomically'].sent
        return [{one.name: one.value.double_value for one in request.parameters}
                for request in sent]

    def switches(self) -> list[bool]:
        """Return the values of the enable requests that were sent."""
        return [request.data for request in self.endpoints['/bow/enable'].sent]

    def answer(self, service: str, number: int, success: bool = True, text: str = 'fine') -> None:
        """Answer a request, which is counted from 1."""
        header = SimpleNamespace(request_id=SimpleNamespace(sequence_number=number))
        answer = (SetBool.Response(success=success, message=text) if service == 'enable' else
                  SimpleNamespace(result=SimpleNamespace(successful=success, reason=text)))
        self.endpoints[f'/bow/{service}'].answers.append((header, answer))
        self.poll(self.device.now)

    def outcome(self) -> tuple[str, str, str]:
        """Return text, outcome and answer of the last request."""
        assert self.device.action is not None
        text, (outcome, _), answer, _ = self.device.action
        return text, outcome, answer


@pytest.fixture
def bench() -> Bench:
    return Bench()


SET = 'set_parameters_atomically'


def test_sets_during_another_go_out_as_one_and_start_from_the_requested_value(
    bench: Bench,
) -> None:
    bench.press('-', '-', '-')
    assert bench.sets() == [{'brightness': 30.0}]

    bench.answer(SET, 1)
    assert bench.sets()[1:] == [{'brightness': 10.0}]

    bench.answer(SET, 2)
    bench.press('+')
    assert bench.sets()[2:] == [{'brightness': 20.0}]


def test_refused_set_drops_those_behind_it_and_keeps_its_reason(bench: Bench) -> None:
    bench.press('-', '-')

    bench.answer(SET, 1, success=False, text='no\x1b[2J')

    assert len(bench.sets()) == 1
    assert bench.outcome() == ('brightness 30 %', 'FAILED', 'no [2J')
    assert bench.device.wants('brightness', 40.0) == 40.0


def test_strobe_and_switch_do_not_wait_for_a_set_of_the_brightness(bench: Bench) -> None:
    bench.press('-', 's', 'space')

    assert len(bench.sets()) == 2
    assert bench.switches() == [True]
    assert bench.device.wants('enabled', None) is True


def test_answers_in_another_order_reach_their_requests(bench: Bench) -> None:
    bench.press('-', 's')

    bench.answer(SET, 2)
    assert bench.outcome() == ('strobe 1 s, 50 %', 'done', 'fine')
    bench.answer(SET, 1)
    assert bench.outcome() == ('brightness 30 %', 'done', 'fine')


def test_newest_switch_is_sent_after_the_one_before(bench: Bench) -> None:
    bench.device.values['enabled'] = True
    bench.press('space', 'space')
    assert bench.switches() == [False]

    bench.answer('enable', 1)

    assert bench.switches() == [False, True]


def test_on_is_dropped_when_the_off_before_it_fails(bench: Bench) -> None:
    bench.device.values['enabled'] = True
    bench.press('space', 'space')

    bench.answer('enable', 1, success=False, text='no')

    assert bench.switches() == [False]
    assert bench.outcome() == ('off', 'FAILED', 'no')


def test_off_does_not_wait_for_an_on_whose_answer_is_then_ignored(bench: Bench) -> None:
    bench.press('space', '0')

    assert bench.switches() == [True, False]
    bench.answer('enable', 1)
    assert bench.outcome()[:2] == ('off', '...')
    bench.answer('enable', 2)
    assert bench.outcome() == ('off', 'done', 'fine')


def test_off_is_sent_again_at_an_interval_while_it_is_unanswered(bench: Bench) -> None:
    for number in range(11):
        bench.poll(OFF_INTERVAL / 5 * number)
        bench.press('0')

    assert bench.switches() == [False] * 3


@pytest.mark.parametrize('success', [True, False])
def test_off_that_waits_is_sent_whatever_became_of_the_one_before(
    bench: Bench, success: bool,
) -> None:
    bench.press('0', '0')

    bench.answer('enable', 1, success=success)

    assert bench.switches() == [False, False]


def test_unanswered_request_is_given_up_and_its_late_answer_is_ignored(bench: Bench) -> None:
    bench.press('space')

    bench.poll(ANSWER_LIMIT - 0.1)
    assert bench.outcome()[1] == '...'
    bench.poll(ANSWER_LIMIT)
    assert bench.outcome() == ('on', 'FAILED', 'no answer for 8 s')

    bench.press('space')
    bench.answer('enable', 1)
    assert bench.outcome()[1] == '...'


def test_on_is_not_sent_to_a_service_that_appears_late(bench: Bench) -> None:
    bench.endpoints['/bow/enable'] = Client(SetBool)
    bench.endpoints['/bow/enable'].ready = False
    bench.press('space')

    bench.poll(DISCOVERY_LIMIT)
    bench.endpoints['/bow/enable'].ready = True
    bench.poll(DISCOVERY_LIMIT)

    assert bench.switches() == []
    assert bench.outcome() == ('on', 'FAILED', 'nothing takes /bow/enable')


def test_message_on_a_topic_waits_for_a_subscriber_and_has_no_answer() -> None:
    bench = Bench(gimbal())
    topic = bench.endpoints['/gimbal/cmd/angles'] = Topic()
    topic.ready = False
    bench.press('up')
    assert topic.sent == []

    topic.ready = True
    bench.poll()
    bench.press('up')

    assert [round(message.vector.y, 3) for message in topic.sent] == [0.413, 0.325]
    assert bench.outcome()[1:] == ('sent', '')


def test_steps_of_several_axes_before_the_subscriber_is_known_reach_it_together() -> None:
    bench = Bench(gimbal())
    angles, place = (bench.endpoints.setdefault(f'/gimbal/cmd/{name}', Topic())
                     for name in ('angles', 'roi'))
    angles.ready = place.ready = False
    bench.press('up', 'up', 'left')
    bench.press('p', typed='47.3 8.5 480')

    angles.ready = place.ready = True
    bench.poll()

    # The yaw of the last one, with the pitch of both steps; the place was sent once.
    last = angles.sent[-1].vector
    assert (round(last.y, 3), round(last.z, 3)) == (0.325, -0.163)
    assert len(place.sent) == 1
    bench.poll(WANTED_LIFETIME)
    assert bench.device.wants('pitch', 0.5) == 0.5


def require_off(bench: Bench) -> None:
    """Switch off as ALL OFF does."""
    assert bench.device.view.off is not None
    bench.device.require_off(bench.device.view.off(bench.device))


def test_off_of_all_off_is_sent_again_until_an_answer_confirms_it(bench: Bench) -> None:
    require_off(bench)

    bench.answer('enable', 1, success=False, text='not confirmed')
    assert bench.device.off == (FAILED, 'not confirmed, trying again')
    bench.poll(OFF_RETRY - 0.1)
    assert bench.switches() == [False]
    bench.poll(OFF_RETRY)
    assert bench.switches() == [False, False]

    bench.answer('enable', 2, text='off, confirmed')
    assert bench.device.off == (DONE, 'off, confirmed')
    bench.poll(2 * OFF_LIMIT)
    assert len(bench.switches()) == 2


def test_a_light_that_another_switches_on_after_all_off_is_no_longer_confirmed(
    bench: Bench,
) -> None:
    bench.device.learn('enabled', True)
    require_off(bench)
    bench.answer('enable', 1, text='off, confirmed')
    # The light was on when it was confirmed, as far as the topic says.
    bench.device.learn('enabled', True)
    assert bench.device.off == (DONE, 'off, confirmed')

    for value, outcome in ((False, DONE), (True, ON_AGAIN), (True, ON_AGAIN), (False, DONE)):
        bench.device.learn('enabled', value)
        bench.device.learn('brightness', 10.0 + value)
        assert bench.device.off[0] == outcome


def test_off_that_is_never_confirmed_is_given_up_and_says_so(bench: Bench) -> None:
    require_off(bench)

    for number in range(100):
        bench.poll(number * OFF_RETRY)
        if len(bench.switches()) > number:
            bench.answer('enable', number + 1, success=False, text='no light connected')

    assert len(bench.switches()) == round(OFF_LIMIT / OFF_RETRY) + 1
    assert bench.device.off == (FAILED, 'no light connected')


def test_on_of_the_operator_ends_the_repetition_of_an_off(bench: Bench) -> None:
    require_off(bench)
    bench.answer('enable', 1, success=False)

    bench.press('space')
    bench.answer('enable', 2)
    bench.poll(OFF_LIMIT / 2)

    assert bench.switches() == [False, True]


def test_message_that_the_node_refuses_is_shown_as_failed_with_the_reason() -> None:
    bench = Bench(gimbal())
    bench.press('p', typed='47.3 8.5 480')
    assert bench.outcome() == ('point at 47.3 8.5 480', 'sent', '')

    bench.device.log('gimbal 1/154 connected')
    assert bench.outcome()[1] == 'sent'
    bench.device.log('~/cmd/roi: ignored: held by safety')

    assert bench.outcome() == ('point at 47.3 8.5 480', 'FAILED', 'ignored: held by safety')


def test_monitor_that_may_only_look_sends_nothing() -> None:
    bench = Bench(may_request=False)

    bench.press('space', '0', '-', 'r')

    assert bench.endpoints == {}
    assert bench.outcome() == ('refresh', 'FAILED', 'this monitor may only look')
