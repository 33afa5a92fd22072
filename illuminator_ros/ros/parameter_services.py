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

"""
The parameter services of a node whose parameters are kept by a device.

rclpy's own answer from synchronous callbacks: while one waits for the device, the executor
is blocked, and each parameter of a list needs a command of its own. Here a set waits for the
device's acknowledgement without blocking, and the values of one call are one command.
"""

from __future__ import annotations

from array import array
from collections.abc import Callable, Iterable, Sequence
from typing import Any, TypeVar

from rcl_interfaces import srv
from rcl_interfaces.msg import ListParametersResult, ParameterValue, SetParametersResult
from rcl_interfaces.msg import Parameter as ParameterMessage
from rclpy.exceptions import ParameterNotDeclaredException, ParameterUninitializedException
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.qos import qos_profile_services_default, QoSProfile

from .executor import DeferredService, Respond, Take
from .link_call import LinkCalls
from .parameters import ChangeableParameters, DeviceParameters, Values
from .throttled_log import NodeLog
from ..mavlink.link import Link

T = TypeVar('T')
Messages = Sequence[ParameterMessage]

# Names in one request; longer lists would delay the other services of the node.
MAX_NAMES = 1000
# Requests that wait in the middleware, each of the size of a few parameters.
QUEUE_DEPTH = 100
# s, in addition to the 0.78 s that a light may take: a set is answered within 0.9 s.
ANSWER_SPREAD = 0.1

# Sets values in the device, in the link's thread, given the time (s); calls its last argument
# once with '' or why the values were not set.
Configure = Callable[[Values, float, Callable[[str], None]], None]
# Raises ValueError where the device cannot take a value of a parameter, given its name.
Check = Callable[[str, object], object]


class ParameterServices:
    """
    The six parameter services of a node made with ``start_parameter_services=False``.

    :param device: the parameters that the device accepts or refuses, None if it has none.
    :param check: by default as the specification of each parameter.
    :param changeable: the parameters of the node itself that may be set, None if it has none.
    """

    def __init__(
        self, node: Node, link: Link, log: NodeLog, device: DeviceParameters | None = None,
        check: Check | None = None,
        configure: Configure = lambda changes, now, answer: answer(''),
        changeable: ChangeableParameters | None = None,
    ) -> None:
        self._node = node
        self._log = log
        self._device = device or DeviceParameters(node, ())
        specs = self._device.specs
        self._check_value = check or (lambda name, value: specs[name].check(value))
        self._configure = configure
        self._changeable = changeable
        self._calls = LinkCalls(link, log)
        qos = QoSProfile(depth=QUEUE_DEPTH,
                         reliability=qos_profile_services_default.reliability)

        def serve(type_: type[Any], name: str, take: Take) -> None:
            DeferredService(node, type_, f'~/{name}', take, self._calls.refuse_waiting, qos,
                            ANSWER_SPREAD)

        each = self._each
        serve(srv.DescribeParameters, 'describe_parameters', lambda request, respond: respond(
            srv.DescribeParameters.Response(
                descriptors=each(request.names, node.describe_parameter))))
        serve(srv.GetParameters, 'get_parameters', lambda request, respond: respond(
            srv.GetParameters.Response(values=each(request.names, self._value))))
        serve(srv.GetParameterTypes, 'get_parameter_types', lambda request, respond: respond(
            srv.GetParameterTypes.Response(
                types=each(request.names, lambda name: self._value(name).type))))
        serve(srv.ListParameters, 'list_parameters', self._list)
        serve(srv.SetParameters, 'set_parameters', self._set)
        serve(srv.SetParametersAtomically, 'set_parameters_atomically', self._set_atomically)

    def _is_short(self, names: Sequence[object]) -> bool:
        if len(names) <= MAX_NAMES:
            return True
        self._log.warning(f'a request for {len(names)} parameters was refused: the limit is '
                          f'{MAX_NAMES}', 'parameter names')
        return False

    # In the executor's thread. Where a name is unknown or the list too long, the answer is an
    # empty list, as that of rclpy and rclcpp; tools take it for "not set".

    def _each(self, names: list[str], look_up: Callable[[str], T]) -> list[T]:
        try:
            return [look_up(name) for name in names] if self._is_short(names) else []
        except ParameterNotDeclaredException:
            return []

    def _value(self, name: str) -> ParameterValue:
        try:
            return self._node.get_parameter(name).get_parameter_value()
        except ParameterUninitializedException:
            return ParameterValue()

    def _list(
        self, request: srv.ListParameters.Request, respond: Respond,
    ) -> None:
        """Leave out unset parameters, so that the output of ``ros2 param dump`` can be loaded."""
        result = ListParametersResult()
        if self._is_short(request.prefixes):
            try:
                result = self._node.list_parameters(list(request.prefixes), request.depth)
            except (TypeError, ValueError) as error:
                self._log.warning(f'list_parameters: {error}', 'list_parameters')
            result.names = [name for name in result.names if self._value(name).type]
        respond(srv.ListParameters.Response(result=result))

    def _set(
        self, request: srv.SetParameters.Request, respond: Respond,
    ) -> None:
        messages = list(request.parameters) if self._is_short(request.parameters) else []

        def answer(reasons: list[str]) -> None:
            respond(srv.SetParameters.Response(results=[_result(reason) for reason in reasons]))

        self._calls.ask(lambda now, done: self._set_each(messages, now, done), answer,
                        lambda reason: [reason] * len(messages))

    def _set_atomically(
        self, request: srv.SetParametersAtomically.Request,
        respond: Respond,
    ) -> None:
        def answer(reason: str) -> None:
            respond(srv.SetParametersAtomically.Response(result=_result(reason)))

        messages = request.parameters
        if not self._is_short(messages):
            answer(f'{len(messages)} parameters are more than {MAX_NAMES}')
            return
        self._calls.ask(
            lambda now, done: self._set_all(messages, now, done), answer, str)

    # In the link thread

    def _set_each(
        self, messages: Messages, now: float, answer: Callable[[list[str]], None],
    ) -> None:
        """Set each parameter separately, but those of the device with one command."""
        reasons = [self._check(message) for message in messages]
        changes = self._device_values(
            message for message, reason in zip(messages, reasons, strict=True) if not reason)
        for index, message in enumerate(messages):
            if not reasons[index]:
                reasons[index] = (_replacement(message, changes) if message.name in changes
                                  else self._set_local([message]))

        def done(refusal: str) -> None:
            answer([reason or (refusal if message.name in changes else '')
                    for message, reason in zip(messages, reasons, strict=True)])

        if changes:
            self._configure(changes, now, done)
        else:
            done('')

    def _set_all(self, messages: Messages, now: float, answer: Callable[[str], None]) -> None:
        """Set all or none. Local ones are set first: they can be rolled back."""
        local = [message for message in messages if message.name not in self._device.specs]
        reason = next(filter(None, map(self._check, messages)), '')
        changes = {} if reason else self._device_values(messages)
        reason = reason or next(
            filter(None, (_replacement(message, changes) for message in messages)), '')
        before = [] if reason else [self._node.get_parameter(one.name) for one in local]
        if not reason and local:
            reason = self._set_local(local)

        def done(refusal: str) -> None:
            if refusal and before:
                self._node.set_parameters_atomically(before)
            answer(refusal)

        if reason or len(local) == len(messages):
            answer(reason)
        else:
            self._configure(changes, now, done)

    def _device_values(self, messages: Iterable[ParameterMessage]) -> Values:
        """Return the last value of each parameter of the device."""
        return {message.name: _value(message) for message in messages
                if message.name in self._device.specs}

    def _set_local(self, messages: Messages) -> str:
        result = self._node.set_parameters_atomically(
            [self._parameter(message) for message in messages])
        return '' if result.successful else str(result.reason)

    def _parameter(self, message: ParameterMessage) -> Parameter:
        """Return a parameter to set; an integer is taken for a double."""
        parameter: Parameter = Parameter.from_parameter_msg(message)
        if (parameter.type_ is Parameter.Type.INTEGER
                and self._node.get_parameter(message.name).type_ is Parameter.Type.DOUBLE):
            return Parameter(message.name, value=float(parameter.value))
        return parameter

    def _check(self, message: ParameterMessage) -> str:
        """Return why a parameter cannot be set, '' if the device or rclpy decides that."""
        name = message.name
        if not self._node.has_parameter(name):
            return f'{name} is not a parameter of this node'
        try:
            value = _value(message)
        except ValueError:
            return f'{name}: {message.value.type} is not a parameter type'
        if name in self._device.specs and value is None:
            return f'{name} cannot be deleted'
        try:
            if name in self._device.specs:
                self._check_value(name, value)
            elif self._changeable:
                self._changeable.check(name, value)
        except ValueError as error:
            return str(error)
        return ''


def _result(reason: str) -> SetParametersResult:
    return SetParametersResult(successful=not reason, reason=reason)


def _replacement(message: ParameterMessage, changes: Values) -> str:
    """Return that a parameter has another value among the changes, '' if it has not."""
    name = message.name
    return (f'{name} has another value later in the request'
            if name in changes and changes[name] != _value(message) else '')


def _value(message: ParameterMessage) -> object:
    value = Parameter.from_parameter_msg(message).value
    # A list instead of an array, since a refusal quotes it.
    return list(value) if isinstance(value, array) else value
