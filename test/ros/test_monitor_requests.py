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

"""Which requests of the monitor wait for which, with services that answer when a test says so."""

import threading
from typing import Any

from illuminator_ros.cli.monitor.actions import dim, strobe, switch
from illuminator_ros.cli.monitor.model import Fleet, Outcome
from illuminator_ros.cli.monitor.requests import ANSWER_LIMIT, Requests
import pytest
from rcl_interfaces.msg import SetParametersResult
from rcl_interfaces.srv import GetParameters, SetParametersAtomically
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
        self.fleet = Fleet()
        self.fleet.seen(['/bow'], 0.0)
        self.fleet.take('/bow', 'enabled', False, 0.0)
        self.fleet.agreed('/bow', 50.0)
        self.requests = Requests(self, '/bow', self.fleet, threading.Lock(), lambda: self.now)

    def create_client(self, type_: Any, name: str) -> Client:
        return self.clients.setdefault(name, Client(name))

    def ask(self, ask: Any) -> None:
        request = ask(self.light)
        assert request is not None
        self.requests.submit(request)

    @property
    def light(self) -> Any:
        return self.fleet.lights[0]

    @property
    def sets(self) -> list[dict[str, Any]]:
        """Return the parameters of each set that was sent."""
        return [{parameter.name: parameter_value_to_python(parameter.value)
                 for parameter in request.parameters}
                for request, _ in self.clients['/bow/set_parameters_atomically'].calls]

    @property
    def switches(self) -> list[bool]:
        """Return what the light was switched to."""
        return [request.data for request, _ in self.clients['/bow/enable'].calls]

    def answer_set(self, reason: str = '') -> None:
        """Answer the newest set, which is refused if there is a reason."""
        response = SetParametersAtomically.Response(
            result=SetParametersResult(successful=not reason, reason=reason))
        self.clients['/bow/set_parameters_atomically'].calls[-1][1].set_result(response)

    def answer_switch(self, success: bool = True) -> None:
        """Answer the newest switch."""
        self.clients['/bow/enable'].calls[-1][1].set_result(
            SetBool.Response(success=success, message='so be it'))


def darker(light: Any) -> Any:
    return dim(light, -10.0)


@pytest.fixture
def bench() -> Bench:
    return Bench()


def test_what_an_event_tells_is_not_undone_by_an_older_answer(bench: Bench) -> None:
    bench.light.setpoint = None
    bench.requests.poll()
    [(_, answer)] = bench.clients['/bow/get_parameters'].calls

    bench.fleet.agreed('/bow', 60.0)
    answer.set_result(GetParameters.Response(
        values=[Parameter('brightness', value=50.0).get_parameter_value()]))

    assert bench.light.setpoint == 60.0


def test_sets_that_come_during_one_go_out_as_one(bench: Bench) -> None:
    for ask in (darker, darker, strobe, darker):
        bench.ask(ask)
    assert bench.sets == [{'brightness': 40.0}]

    bench.answer_set()

    assert bench.sets[1:] == [
        {'brightness': 20.0, 'strobe_period': 1.0, 'strobe_duty_cycle': 50.0}]


def test_what_waits_for_a_refused_set_is_dropped_and_the_reason_stays(bench: Bench) -> None:
    bench.ask(darker)
    bench.ask(darker)

    bench.answer_set('no')

    assert len(bench.sets) == 1
    assert (bench.light.action.outcome, bench.light.action.answer) == (Outcome.FAILED, 'no')
    assert bench.light.wanted == {}
    assert bench.light.setpoint == 50.0


def test_the_next_step_starts_from_what_was_accepted(bench: Bench) -> None:
    bench.ask(darker)
    bench.answer_set()

    bench.ask(darker)

    assert bench.sets[-1] == {'brightness': 30.0}


def test_of_switches_that_come_during_one_the_newest_is_sent(bench: Bench) -> None:
    for _ in range(4):
        bench.ask(switch)
    assert bench.switches == [True]

    bench.answer_switch()

    assert bench.switches == [True, False]


def test_off_is_sent_also_after_on_has_failed(bench: Bench) -> None:
    bench.ask(switch)
    bench.ask(switch)

    bench.answer_switch(success=False)

    assert bench.switches == [True, False]


def test_a_switch_does_not_wait_for_a_set(bench: Bench) -> None:
    bench.ask(darker)

    bench.ask(switch)

    assert bench.switches == [True]
    assert bench.light.wanted == {'brightness': 40.0, 'enabled': True}


def test_what_is_not_answered_is_given_up_and_what_waits_is_sent(bench: Bench) -> None:
    bench.ask(switch)
    bench.ask(switch)

    bench.now = ANSWER_LIMIT - 0.1
    bench.requests.poll()
    assert bench.switches == [True]
    bench.now = ANSWER_LIMIT
    bench.requests.poll()

    assert bench.switches == [True, False]
    assert bench.light.wanted == {'enabled': False}


def test_an_answer_that_comes_too_late_is_no_answer_to_the_next(bench: Bench) -> None:
    bench.ask(switch)
    late = bench.clients['/bow/enable'].calls[0][1]
    bench.now = ANSWER_LIMIT
    bench.requests.poll()
    bench.ask(switch)

    late.set_result(SetBool.Response(success=True, message='late'))

    assert bench.light.action.outcome is Outcome.PENDING


def test_a_call_that_fails_is_told(bench: Bench) -> None:
    bench.ask(switch)

    bench.clients['/bow/enable'].calls[0][1].set_exception(RuntimeError('broken'))

    assert bench.light.action.answer == 'RuntimeError: broken'


def test_what_nobody_serves_is_not_sent(bench: Bench) -> None:
    bench.clients['/bow/enable'].ready = False

    bench.ask(switch)

    assert bench.switches == []
    assert bench.light.action.answer == 'nobody serves /bow/enable'


def test_the_agreed_brightness_is_asked_for_until_it_is_known(bench: Bench) -> None:
    getter = bench.clients['/bow/get_parameters']
    bench.requests.poll()
    assert getter.calls == []

    bench.light.setpoint = None
    bench.requests.poll()
    bench.requests.poll()
    assert len(getter.calls) == 1
    bench.now = ANSWER_LIMIT
    bench.requests.poll()

    assert len(getter.calls) == 2
