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

"""The lights in the ROS graph: discovery by their interface, their topics and services."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping
import functools
from typing import Any, NamedTuple, TYPE_CHECKING

from diagnostic_msgs.msg import DiagnosticArray
from rcl_interfaces.msg import ParameterEvent
from rcl_interfaces.srv import GetParameters, SetParametersAtomically
from rclpy.clock import Clock, ClockType
from rclpy.node import Node
from rclpy.parameter import Parameter, parameter_value_to_python
from rclpy.subscription import Subscription
from sensor_msgs.msg import Temperature
from std_msgs.msg import Bool, Float32, Float64, String, UInt32
from std_srvs.srv import SetBool, Trigger

from .key_bindings import Ask, Request, Service
from .model import Diagnosis, DiscoveredLights, Outcome, Values
from ...ros.graph import type_name
from ...ros.node import STATE_QOS, STREAM_QOS

if TYPE_CHECKING:
    from rclpy.task import Future

# The topics of a light with their types.
TOPICS: dict[str, type[object]] = {
    'connected': Bool, 'enabled': Bool, 'brightness': Float32, 'error_flags': UInt32,
    'mode': String, 'strobe_period': Float32, 'strobe_duty_cycle': Float32, 'uptime': Float64,
    'temperature': Temperature,
}
# A node that publishes these topics with their types is a light.
SIGNATURE = ('connected', 'enabled', 'brightness', 'error_flags')
# s between queries of the graph.
QUERY_INTERVAL = 0.5
# s for an answer: longer than a bridge takes, whatever its light does.
ANSWER_LIMIT = 8.0
# s after an unanswered OFF in which a further OFF waits for its answer.
OFF_INTERVAL = 0.5
# The type of each service, and the function that makes its request from the value of a
# :class:`Request`; untyped, since the services differ in both.
SERVICES: dict[Service, tuple[type[Any], Callable[[Any], Any]]] = {
    Service.ENABLE: (SetBool, lambda on: SetBool.Request(data=on)),
    Service.REFRESH: (Trigger, lambda _: Trigger.Request()),
    Service.SET: (SetParametersAtomically, lambda values: SetParametersAtomically.Request(
        parameters=[Parameter(name, value=value).to_parameter_msg()
                    for name, value in values.items()])),
    Service.GET: (GetParameters, lambda names: GetParameters.Request(names=names)),
}
# The request for the setpoint of a light, which the operator does not see.
GET_BRIGHTNESS = Request(Service.GET, '', ['brightness'])


def lights_among(
    topics: list[tuple[str, list[str]]], publishers: Callable[[str], int],
) -> list[str]:
    """
    Return the names of the lights among the topics of a graph.

    :param publishers: returns the number of publishers of a topic; the monitor's own subscriptions
        make topics, too.
    """
    types = dict(topics)
    last = f'/{SIGNATURE[0]}'
    names = [topic.removesuffix(last) for topic in types if topic.endswith(last)]
    return [name for name in names if name and all(
        type_name(TOPICS[topic]) in types.get(f'{name}/{topic}', ())
        and publishers(f'{name}/{topic}') for topic in SIGNATURE)]


class _Pending(NamedTuple):
    request: Request
    future: Future
    deadline: float


class Requests:
    """
    The requests to one light, in the thread of the node's executor.

    Each service has one request at a time; later requests wait. Waiting parameters are merged, so
    that a key held down does not cause a hundred commands; of other requests the newest is kept.
    An OFF does not wait for an ON, and waits for another OFF only :data:`OFF_INTERVAL`: the bridge
    may have been restarted.
    """

    def __init__(
        self, node: Node, name: str, lights: DiscoveredLights, clock: Callable[[], float],
    ) -> None:
        self._node = node
        self._name = name
        self._lights = lights
        self._clock = clock
        self._clients = {service: node.create_client(type_, f'{name}/{service.value}')
                         for service, (type_, _) in SERVICES.items()}
        self._pending: dict[Service, _Pending] = {}
        self._waiting: dict[Service, Request] = {}

    def submit(self, request: Request) -> None:
        """Send a request, or let it wait for the pending one."""
        service = request.service
        pending = self._pending.get(service)
        if pending is not None and not self._overtakes(request, pending):
            waiting = self._waiting.get(service)
            if service is Service.SET and waiting is not None:
                request = Request(service, request.text, waiting.value | request.value)
            self._waiting[service] = request
            self._show_wanted()
            return
        if pending is not None:
            self._clients[service].remove_pending_request(pending.future)
            del self._pending[service]
            self._waiting.pop(service, None)
        self._send(request)

    def _overtakes(self, request: Request, pending: _Pending) -> bool:
        is_off = request.service is Service.ENABLE and not request.value
        sent_at = pending.deadline - ANSWER_LIMIT
        return is_off and (pending.request.value or self._clock() >= sent_at + OFF_INTERVAL)

    def poll(self) -> None:
        """Give up requests without an answer, and request the brightness if it is unknown."""
        for service, one in list(self._pending.items()):
            if self._clock() >= one.deadline:
                self._clients[service].remove_pending_request(one.future)
                self._end(one, False, f'no answer from {self._name} for {ANSWER_LIMIT:g} s')
        with self._lights.light(self._name) as light:
            known = light.gone_at is not None or light.setpoint is not None
        if not known and Service.GET not in self._pending:
            self._send(GET_BRIGHTNESS)

    def destroy(self) -> None:
        """Drop all requests."""
        for client in self._clients.values():
            self._node.destroy_client(client)
        self._pending.clear()
        self._waiting.clear()

    def _send(self, request: Request) -> None:
        client = self._clients[request.service]
        if not client.service_is_ready():
            self._note(request, Outcome.FAILED, f'no service {client.srv_name}')
            return
        future = client.call_async(SERVICES[request.service][1](request.value))
        one = _Pending(request, future, self._clock() + ANSWER_LIMIT)
        self._pending[request.service] = one
        self._note(request, Outcome.PENDING, '')
        self._show_wanted()
        future.add_done_callback(lambda future: self._answered(one))

    def _answered(self, one: _Pending) -> None:
        if self._pending.get(one.request.service) is not one:
            return
        try:
            response = one.future.result()
        except Exception as error:
            self._end(one, False, f'{type(error).__name__}: {error}')
            return
        if one.request.service is Service.GET:
            self._take_brightness(response)
            self._end(one, True, '')
        elif one.request.service is Service.SET:
            if response.result.successful and 'brightness' in one.request.value:
                self._lights.agreed(self._name, one.request.value['brightness'])
            self._end(one, response.result.successful, response.result.reason)
        else:
            self._end(one, response.success, response.message)

    def _end(self, one: _Pending, success: bool, answer: str) -> None:
        service = one.request.service
        del self._pending[service]
        self._note(one.request, Outcome.DONE if success else Outcome.FAILED, answer)
        waiting = self._waiting.pop(service, None)
        # After a refusal the next request would be refused, too, and hide the reason.
        if waiting is not None and (success or service is not Service.SET):
            self._send(waiting)
        self._show_wanted()

    def _take_brightness(self, response: GetParameters.Response) -> None:
        values = [parameter_value_to_python(value) for value in response.values]
        with self._lights.light(self._name) as light:
            # A parameter event that came meanwhile is newer.
            if light.setpoint is None and values and isinstance(values[0], float):
                light.setpoint = values[0]

    def _note(self, request: Request, outcome: Outcome, answer: str) -> None:
        if request.text:
            self._lights.acted(self._name, request.text, outcome, answer, self._clock())

    def _show_wanted(self) -> None:
        wanted: Values = {}
        for request in [*(one.request for one in self._pending.values()),
                        *self._waiting.values()]:
            if request.service is Service.SET:
                wanted |= request.value
            elif request.service is Service.ENABLE:
                wanted['enabled'] = request.value
        with self._lights.light(self._name) as light:
            light.wanted = wanted


class Graph:
    """
    Keeps lights up to date, in the thread of its node's executor.

    :param clock: returns the time, s.
    """

    def __init__(self, node: Node, lights: DiscoveredLights, clock: Callable[[], float]) -> None:
        self._node = node
        self._lights = lights
        self._clock = clock
        self._subscriptions: dict[str, list[Subscription]] = {}
        self._requests: dict[str, Requests] = {}
        # Calls from other threads.
        self._jobs: deque[Callable[[], None]] = deque()
        self._guard = node.create_guard_condition(self._do_jobs)
        node.create_subscription(DiagnosticArray, '/diagnostics', self._diagnosed, STREAM_QOS)
        node.create_subscription(ParameterEvent, '/parameter_events', self._changed, 100)
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        node.create_timer(QUERY_INTERVAL, self.query, clock=steady)

    def submit(self, name: str, ask: Ask) -> None:
        """Send a request to a light; callable from any thread."""
        self._call(lambda: self._submit(name, ask))

    def clear_gone(self) -> None:
        """Remove the lights that are gone; callable from any thread."""
        self._call(self._clear_gone)

    def query(self) -> None:
        """Find new and gone lights, and give up requests without an answer."""
        topics = self._node.get_topic_names_and_types()
        names = lights_among(topics, self._node.count_publishers)
        for name in self._lights.seen(names, self._clock()):
            self._subscriptions[name] = [
                self._node.create_subscription(
                    type_, f'{name}/{topic}', functools.partial(self._take, name, topic),
                    STREAM_QOS if topic == 'temperature' else STATE_QOS)
                for topic, type_ in TOPICS.items()]
            self._requests[name] = Requests(self._node, name, self._lights, self._clock)
        for requests in self._requests.values():
            requests.poll()

    def _call(self, job: Callable[[], None]) -> None:
        self._jobs.append(job)
        self._guard.trigger()

    def _do_jobs(self) -> None:
        while self._jobs:
            self._jobs.popleft()()

    def _submit(self, name: str, ask: Ask) -> None:
        with self._lights.light(name) as light:
            request = ask(light)
        if request is None:
            self._lights.acted(name, 'not asked', Outcome.FAILED,
                               'its brightness is not known yet', self._clock())
        elif name in self._requests:
            self._requests[name].submit(request)

    def _clear_gone(self) -> None:
        for name in self._lights.clear_gone():
            self._requests.pop(name).destroy()
            for subscription in self._subscriptions.pop(name):
                self._node.destroy_subscription(subscription)

    def _take(self, name: str, topic: str, message: object) -> None:
        value = getattr(message, 'temperature' if topic == 'temperature' else 'data')
        self._lights.take(name, topic, value, self._clock())

    def _diagnosed(self, array: DiagnosticArray) -> None:
        for status in array.status:
            values: Mapping[str, str] = {pair.key: pair.value for pair in status.values}
            # The name of the status has the node's name without its namespace.
            name, kind = values.get('node', ''), status.name.rpartition(': ')[2]
            diagnosis = Diagnosis(status.level[0], status.message, values)
            self._lights.diagnosed(name, kind, diagnosis, self._clock())

    def _changed(self, event: ParameterEvent) -> None:
        for parameter in [*event.new_parameters, *event.changed_parameters]:
            if parameter.name == 'brightness':
                value = parameter_value_to_python(parameter.value)
                if isinstance(value, float):
                    self._lights.agreed(event.node, value)
