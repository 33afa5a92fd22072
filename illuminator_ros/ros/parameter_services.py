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
from collections.abc import Callable, Sequence
import contextlib
import functools
from typing import Any

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

        reads: tuple[tuple[type[Any], str, str, Callable[[str], object]], ...] = (
            (srv.DescribeParameters, 'describe_parameters', 'descriptors',
             node.describe_parameter),
            (srv.GetParameters, 'get_parameters', 'values', self._value),
            (srv.GetParameterTypes, 'get_parameter_types', 'types',
             lambda name: self._value(name).type))
        for type_, name, field, look_up in reads:
            serve(type_, name, functools.partial(self._read, type_.Response, field, look_up))
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

    def _read(
        self, response: type[Any], field: str, look_up: Callable[[str], object], request: Any,
        respond: Respond,
    ) -> None:
        found = []
        with contextlib.suppress(ParameterNotDeclaredException):
            if self._is_short(request.names):
                found = [look_up(name) for name in request.names]
        respond(response(**{field: found}))

    def _value(self, name: str) -> ParameterValue:
        try:
            return self._node.get_parameter(name).get_parameter_value()
        except ParameterUninitializedException:
            return ParameterValue()

    def _list(self, request: srv.ListParameters.Request, respond: Respond) -> None:
        """Leave out unset parameters, so that the output of ``ros2 param dump`` can be loaded."""
        result = ListParametersResult()
        if self._is_short(request.prefixes):
            result = self._node.list_parameters(list(request.prefixes), request.depth)
            result.names = [name for name in result.names if self._value(name).type]
        respond(srv.ListParameters.Response(result=result))

    def _set(self, request: srv.SetParameters.Request, respond: Respond) -> None:
        self._start(request.parameters, False, lambda reasons: respond(
            srv.SetParameters.Response(results=[*map(_result, reasons)])))

    def _set_atomically(
        self, request: srv.SetParametersAtomically.Request, respond: Respond,
    ) -> None:
        self._start(request.parameters, True, lambda reasons: respond(
            srv.SetParametersAtomically.Response(
                result=_result(next(filter(None, reasons), '')))))

    def _start(
        self, messages: Messages, atomically: bool, answer: Callable[[list[str]], None],
    ) -> None:
        """Set parameters; answer with the reason why each was not set, '' if it was."""
        if self._is_short(messages):
            self._calls.ask(
                lambda now, done: self._set_all(messages, atomically, now, done), answer,
                lambda reason: [reason] * len(messages))
        else:
            answer([f'{len(messages)} parameters are more than {MAX_NAMES}'])

    # In the link thread

    def _set_all(
        self, messages: Messages, atomically: bool, now: float,
        answer: Callable[[list[str]], None],
    ) -> None:
        """
        Set those of the device with one command, and each other one separately.

        :param atomically: set all or none. Local ones are set first: they can be rolled back.
        """
        reasons = [self._check(message) for message in messages]
        changes = {message.name: _value(message)
                   for message, reason in zip(messages, reasons, strict=True)
                   if not reason and message.name in self._device.specs}
        reasons = [reason or _replacement(message, changes)
                   for message, reason in zip(messages, reasons, strict=True)]
        local = [index for index, message in enumerate(messages)
                 if not reasons[index] and message.name not in changes]
        if atomically and any(reasons):
            answer(reasons)
            return
        before = [self._node.get_parameter(messages[index].name) for index in local]
        for group in filter(None, [local] if atomically else [[index] for index in local]):
            result = self._node.set_parameters_atomically(
                [self._parameter(messages[index]) for index in group])
            if not result.successful:
                reasons[group[0]] = str(result.reason)

        def done(refusal: str) -> None:
            if refusal and atomically and before:
                self._node.set_parameters_atomically(before)
            answer([reason or (refusal if message.name in changes else '')
                    for message, reason in zip(messages, reasons, strict=True)])

        if changes and not (atomically and any(reasons)):
            self._configure(changes, now, done)
        else:
            done('')

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
