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

"""The order of the monitor's requests, with services that answer when a test lets them."""

from typing import Any, cast

from illuminator_ros.cli.monitor.key_bindings import dim, Request, Service, strobe, switch
from illuminator_ros.cli.monitor.model import DiscoveredLights, Outcome
from illuminator_ros.cli.monitor.ros_graph import ANSWER_LIMIT, Requests
import pytest
from rcl_interfaces.msg import SetParametersResult
from rcl_interfaces.srv import GetParameters, SetParametersAtomically
from rclpy.node import Node
from rclpy.parameter import Parameter, parameter_value_to_python
from rclpy.task import Future
from std_srvs.srv import SetBool


class Client:
    """A client of a service, with the requests that it was given."""

    def __init__(self, srv_name: str) -> None:
        self.srv_name = srv_name
        self.calls: list[tuple[Any, Any]] = []
        self.ready = True

    def service_is_ready(self) -> bool:
        return self.ready

    def call_async(self, request: Any) -> Any:
        self.calls.append((request, Future()))
        return self.calls[-1][1]

    def remove_pending_request(self, future: Any) -> None:
        pass


class Bench:
    """The requests to a light that is off and steady, at 50 %."""

    def __init__(self) -> None:
        self.now = 0.0
        self.clients: dict[str, Client] = {}
        self.lights = DiscoveredLights()
        self.lights.seen(['/bow'], 0.0)
        self.lights.take('/bow', 'enabled', False, 0.0)
        self.lights.agreed('/bow', 50.0)
        self.requests = Requests(cast(Node, self), '/bow', self.lights, lambda: self.now)
        self.enable = self.clients['/bow/enable']
        self.setter = self.clients['/bow/set_parameters_atomically']
        self.getter = self.clients['/bow/get_parameters']

    def create_client(self, type_: Any, name: str) -> Client:
        return self.clients.setdefault(name, Client(name))

    def ask(self, *asks: Any) -> None:
        for ask in asks:
            self.requests.submit(ask(self.light))

    def poll(self, now: float) -> None:
        self.now = now
        self.requests.poll()

    @property
    def light(self) -> Any:
        with self.lights.light('/bow') as light:
            return light

    @property
    def sets(self) -> list[dict[str, Any]]:
        """Return the parameters of each set that was sent."""
        return [{parameter.name: parameter_value_to_python(parameter.value)
                 for parameter in request.parameters} for request, _ in self.setter.calls]

    @property
    def switches(self) -> list[bool]:
        """Return the values of the enable requests that were sent."""
        return [request.data for request, _ in self.enable.calls]

    def answer_set(self, reason: str = '') -> None:
        """Answer the newest set, which is refused if there is a reason."""
        self.setter.calls[-1][1].set_result(SetParametersAtomically.Response(
            result=SetParametersResult(successful=not reason, reason=reason)))

    def answer_switch(self, success: bool = True) -> None:
        """Answer the newest switch."""
        self.enable.calls[-1][1].set_result(SetBool.Response(success=success, message='done'))


def turn_off(light: Any) -> Request:
    return Request(Service.ENABLE, 'off', False)


def darker(light: Any) -> Any:
    return dim(light, -10.0)


@pytest.fixture
def bench() -> Bench:
    return Bench()


def test_parameter_event_is_not_undone_by_an_older_answer(bench: Bench) -> None:
    bench.light.setpoint = None
    bench.requests.poll()
    [(_, answer)] = bench.getter.calls

    bench.lights.agreed('/bow', 60.0)
    answer.set_result(GetParameters.Response(
        values=[Parameter('brightness', value=50.0).get_parameter_value()]))

    assert bench.light.setpoint == 60.0


def test_sets_during_another_go_out_as_one_and_start_from_the_accepted_value(
    bench: Bench,
) -> None:
    bench.ask(darker, darker, strobe, darker)
    assert bench.sets == [{'brightness': 40.0}]

    bench.answer_set()

    assert bench.sets[1:] == [
        {'brightness': 20.0, 'strobe_period': 1.0, 'strobe_duty_cycle': 50.0}]
    bench.answer_set()
    bench.ask(darker)
    assert bench.sets[-1] == {'brightness': 10.0}


def test_refused_set_drops_those_behind_it_and_keeps_its_reason(bench: Bench) -> None:
    bench.ask(darker, darker)

    bench.answer_set('no')

    assert len(bench.sets) == 1
    assert (bench.light.action.outcome, bench.light.action.answer) == (Outcome.FAILED, 'no')
    assert (bench.light.wanted, bench.light.setpoint) == ({}, 50.0)


@pytest.mark.parametrize(('asks', 'success'), [(4, True), (2, False)])
def test_newest_switch_is_sent_after_the_one_before_whatever_its_outcome(
    bench: Bench, asks: int, success: bool,
) -> None:
    bench.lights.take('/bow', 'enabled', True, 0.0)
    bench.ask(*[switch] * asks)
    assert bench.switches == [False]

    bench.answer_switch(success)

    assert bench.switches == [False, True]


def test_off_does_not_wait_for_an_on(bench: Bench) -> None:
    bench.ask(switch, switch)

    assert bench.switches == [True, False]
    bench.enable.calls[0][1].set_result(SetBool.Response(success=True, message='on'))
    assert bench.light.action.outcome is Outcome.PENDING


def test_off_is_sent_again_at_an_interval_while_it_is_unanswered(bench: Bench) -> None:
    for tenths in range(11):
        bench.now = 0.1 * tenths
        bench.ask(turn_off)

    assert bench.switches == [False] * 3


def test_switch_does_not_wait_for_a_set(bench: Bench) -> None:
    bench.ask(darker, switch)

    assert bench.switches == [True]
    assert bench.light.wanted == {'brightness': 40.0, 'enabled': True}


def test_unanswered_request_is_given_up_and_its_late_answer_is_ignored(bench: Bench) -> None:
    bench.lights.take('/bow', 'enabled', True, 0.0)
    bench.ask(switch, switch)

    bench.poll(ANSWER_LIMIT - 0.1)
    assert bench.switches == [False]
    bench.poll(ANSWER_LIMIT)

    assert bench.switches == [False, True]
    assert bench.light.wanted == {'enabled': True}
    bench.enable.calls[0][1].set_result(SetBool.Response(success=True, message='late'))
    assert bench.light.action.outcome is Outcome.PENDING


def test_failed_call_and_missing_service_are_reported(bench: Bench) -> None:
    bench.ask(switch)
    bench.enable.calls[0][1].set_exception(RuntimeError('broken'))
    assert bench.light.action.answer == 'RuntimeError: broken'

    bench.enable.ready = False
    bench.ask(switch)

    assert bench.switches == [True]
    assert '/bow/enable' in bench.light.action.answer
