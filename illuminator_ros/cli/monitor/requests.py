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

"""The requests to one light through its services, and the answers."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple, TYPE_CHECKING

from rcl_interfaces.srv import GetParameters, SetParametersAtomically
from rclpy.node import Node
from rclpy.parameter import Parameter, parameter_value_to_python
from std_srvs.srv import SetBool, Trigger

from .key_bindings import Request, Service
from .model import Fleet, Outcome

if TYPE_CHECKING:
    from rclpy.task import Future

# s for an answer: longer than a bridge takes, whatever its light does.
ANSWER_LIMIT = 8.0
_TYPES: dict[Service, Any] = {
    Service.ENABLE: SetBool, Service.REFRESH: Trigger, Service.SET: SetParametersAtomically}


class _Pending(NamedTuple):
    request: Request
    future: Future[Any]
    deadline: float


class Requests:
    """
    The requests to one light, in the thread of the node's executor.

    Each service has one request at a time. Later ones wait: parameters are merged, so that a key
    held down is not a hundred commands; of others the newest is kept.
    """

    def __init__(
        self, node: Node, name: str, fleet: Fleet, clock: Callable[[], float],
    ) -> None:
        self._node = node
        self._name = name
        self._fleet = fleet
        self._clock = clock
        self._clients = {service: node.create_client(type_, f'{name}/{service.value}')
                         for service, type_ in _TYPES.items()}
        self._getter = node.create_client(GetParameters, f'{name}/get_parameters')
        self._pending: dict[Service, _Pending] = {}
        self._waiting: dict[Service, Request] = {}
        self._asked: tuple[Future[GetParameters.Response], float] | None = None

    def submit(self, request: Request) -> None:
        """Send a request, or let it wait for the pending one."""
        service = request.service
        if service not in self._pending:
            self._send(request)
            return
        waiting = self._waiting.get(service)
        if service is Service.SET and waiting is not None:
            request = Request(service, request.text, waiting.value | request.value)
        self._waiting[service] = request
        self._show_wanted()

    def poll(self) -> None:
        """Give up requests without an answer, and request the brightness if it is unknown."""
        now = self._clock()
        for service, one in list(self._pending.items()):
            if now >= one.deadline:
                self._clients[service].remove_pending_request(one.future)
                self._end(one, False, f'no answer from {self._name} for {ANSWER_LIMIT:g} s')
        if self._asked is not None and now >= self._asked[1]:
            self._getter.remove_pending_request(self._asked[0])
            self._asked = None
        with self._fleet.light(self._name) as light:
            known = light.gone_at is not None or light.setpoint is not None
        if not known and self._asked is None and self._getter.service_is_ready():
            future = self._getter.call_async(GetParameters.Request(names=['brightness']))
            self._asked = future, now + ANSWER_LIMIT
            future.add_done_callback(self._got)

    def destroy(self) -> None:
        """Drop all requests."""
        for client in [*self._clients.values(), self._getter]:
            self._node.destroy_client(client)
        self._pending.clear()
        self._waiting.clear()

    def _send(self, request: Request) -> None:
        client = self._clients[request.service]
        if not client.service_is_ready():
            self._note(request, Outcome.FAILED, f'no service {client.srv_name}')
            return
        future = client.call_async(_message(request))
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
        if one.request.service is Service.SET:
            if response.result.successful and 'brightness' in one.request.value:
                self._fleet.agreed(self._name, one.request.value['brightness'])
            self._end(one, response.result.successful, response.result.reason)
        else:
            self._end(one, response.success, response.message)

    def _end(self, one: _Pending, success: bool, answer: str) -> None:
        service = one.request.service
        del self._pending[service]
        self._note(one.request, Outcome.DONE if success else Outcome.FAILED, answer)
        waiting = self._waiting.pop(service, None)
        # After a refusal the next would be refused too, and hide the reason.
        if waiting is not None and (success or service is not Service.SET):
            self._send(waiting)
        self._show_wanted()

    def _got(self, future: Future[GetParameters.Response]) -> None:
        self._asked = None
        if future.exception() is None and future.result() is not None:
            values = [parameter_value_to_python(value) for value in future.result().values]
            with self._fleet.light(self._name) as light:
                # A parameter event that came meanwhile is newer.
                if light.setpoint is None and values and isinstance(values[0], float):
                    light.setpoint = values[0]

    def _note(self, request: Request, outcome: Outcome, answer: str) -> None:
        self._fleet.acted(self._name, request.text, outcome, answer, self._clock())

    def _show_wanted(self) -> None:
        wanted: dict[str, Any] = {}
        for request in [*(one.request for one in self._pending.values()),
                        *self._waiting.values()]:
            if request.service is Service.SET:
                wanted |= request.value
            elif request.service is Service.ENABLE:
                wanted['enabled'] = request.value
        with self._fleet.light(self._name) as light:
            light.wanted = wanted


def _message(request: Request) -> Any:
    if request.service is Service.ENABLE:
        return SetBool.Request(data=request.value)
    if request.service is Service.REFRESH:
        return Trigger.Request()
    return SetParametersAtomically.Request(parameters=[
        Parameter(name, value=value).to_parameter_msg()
        for name, value in request.value.items()])
