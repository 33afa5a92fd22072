# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""
The parameter services of a node whose parameters are kept by a device.

rclpy's own answer from synchronous callbacks: while one waits for the device, the executor
is blocked, and each parameter of a list needs a command of its own. Here a set waits for the
device's acknowledgement without blocking, and the values of one call are one command. The
executor's thread checks them, so that a request costs the link's thread one call for the node,
and one for the device.
"""

from __future__ import annotations

from array import array
from collections.abc import Callable, Mapping, Sequence
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

from .deferred_service import DeferredService, Handler, Respond
from .ignored_parameters import did_you_mean
from .link_call import LinkCalls
from .parameters import ChangeableParameters, DeviceParameters, Values
from .throttled_log import NodeLog
from ..mavlink.link import Link

Messages = Sequence[ParameterMessage]

# Names in one request, more than a node has; longer lists would delay the other services.
MAX_NAMES = 200
# Unknown names in one request for which similar ones are looked for, each in milliseconds.
SUGGESTIONS = 10
# Requests that wait in the middleware, each of the size of a few parameters.
QUEUE_DEPTH = 100

# Sets values in the device, in the link's thread, given the time (s); calls its last argument
# once with '' or why the values were not set.
ConfigureDevice = Callable[[Values, float, Callable[[str], None]], None]
# Raises ValueError if a parameter cannot have a value, given its name.
CheckValue = Callable[[str, object], object]


class ParameterServices:
    """
    The six parameter services of a node made with ``start_parameter_services=False``.

    :param device: the parameters that the device accepts or refuses, None if it has none.
    :param check: checks a value without the device, by default as the specification of each
        parameter.
    :param check_by_device: checks a value with what is known of the device, in the link's thread.
    :param changeable: the parameters of the node itself that may be set, None if it has none.
    """

    def __init__(
        self, node: Node, link: Link, log: NodeLog, device: DeviceParameters | None = None,
        check: CheckValue | None = None, check_by_device: CheckValue = lambda name, value: None,
        configure: ConfigureDevice = lambda changes, now, answer: answer(''),
        changeable: ChangeableParameters | None = None,
    ) -> None:
        self._node = node
        self._log = log
        self._device = device or DeviceParameters(node, (), log)
        specs = self._device.specs
        self._check_value = check or (lambda name, value: specs[name].check(value))
        self._check_by_device = check_by_device
        self._configure = configure
        self._changeable = changeable
        self._link = link
        self._calls = LinkCalls(link, log)
        qos = QoSProfile(depth=QUEUE_DEPTH,
                         reliability=qos_profile_services_default.reliability)

        def serve(type_: type[Any], name: str, handle: Handler) -> None:
            DeferredService(node, type_, f'~/{name}', handle, qos, log)

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
        """
        Set parameters; answer with the reason why each was not set, '' if it was.

        All those of the node are one change of it, and all those of the device one command.

        :param atomically: set all or none, which is possible for the node or for the device.
        """
        if not self._is_short(messages):
            answer([f'{len(messages)} parameters are more than {MAX_NAMES}'])
            return
        suggests = len(messages) <= SUGGESTIONS
        reasons = [self._check(message, suggests) for message in messages]
        last = {message.name: message
                for message, reason in zip(messages, reasons, strict=True) if not reason}
        reasons = [reason or _replacement(message, last[message.name])
                   for message, reason in zip(messages, reasons, strict=True)]
        of_device = {name: _value(message) for name, message in last.items()
                     if name in self._device.specs}
        own = [self._parameter(message) for name, message in last.items() if name not in of_device]
        if atomically and own and of_device and not any(reasons):
            reasons = [f'set {", ".join(of_device)} of the device in a request without others']
        if atomically and any(reasons):
            answer(reasons)
            return
        failures = self._set_own(own, atomically) if own else {}

        def done(refusals: Mapping[str, str]) -> None:
            answer([reason or failures.get(message.name, '') or refusals.get(message.name, '')
                    for message, reason in zip(messages, reasons, strict=True)])

        if of_device:
            self._calls.ask(
                functools.partial(self._set_device, of_device, atomically), done,
                lambda reason: dict.fromkeys(of_device, reason))
        else:
            done({})

    def _set_own(
        self, parameters: Sequence[Parameter], atomically: bool,
    ) -> Mapping[str, str]:
        """Set parameters of the node itself; return by name why some were not set."""
        changeable, failures = self._changeable, dict[str, str]()
        before = changeable.values if changeable else {}
        result = self._node.set_parameters_atomically([*parameters])
        if not result.successful and (atomically or len(parameters) == 1):
            failures = {parameters[0].name: str(result.reason)}
        elif not result.successful:
            results = ((one.name, self._node.set_parameters_atomically([one]))
                       for one in parameters)
            failures = {name: str(one.reason) for name, one in results if not one.successful}
        if changeable and changeable.values != before:
            self._link.call(functools.partial(changeable.change, changeable.values))
        return failures

    # In the link's thread

    def _set_device(
        self, values: Values, atomically: bool, now: float,
        answer: Callable[[Mapping[str, str]], None],
    ) -> None:
        """Set parameters of the device; answer by name why some were not set."""
        refusals: dict[str, str] = {}
        for name, value in values.items():
            try:
                self._check_by_device(name, value)
            except ValueError as error:
                refusals[name] = str(error)
        allowed = {name: value for name, value in values.items() if name not in refusals}
        if allowed and not (atomically and refusals):
            self._configure(allowed, now, lambda refusal: answer(
                {**dict.fromkeys(allowed, refusal), **refusals}))
        else:
            answer(refusals)

    # In the executor's thread

    def _parameter(self, message: ParameterMessage) -> Parameter:
        """Return a parameter to set; an integer is taken for a double."""
        parameter: Parameter = Parameter.from_parameter_msg(message)
        if (parameter.type_ is Parameter.Type.INTEGER
                and self._node.get_parameter(message.name).type_ is Parameter.Type.DOUBLE):
            return Parameter(message.name, value=float(parameter.value))
        return parameter

    def _check(self, message: ParameterMessage, suggests: bool) -> str:
        """
        Return why a parameter cannot be set, '' if the device or rclpy decides that.

        :param suggests: whether the name that resembles an unknown one is looked for.
        """
        name = message.name
        if not self._node.has_parameter(name):
            names = self._node.list_parameters([], 0).names if suggests else []
            return f'{name} is not a parameter of this node{did_you_mean(name, names)}'
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


def _replacement(message: ParameterMessage, last: ParameterMessage) -> str:
    """Return that a parameter has another value later in the request, '' if it has not."""
    return '' if message is last or _value(message) == _value(last) else (
        f'{message.name} has another value later in the request')


def _value(message: ParameterMessage) -> object:
    value = Parameter.from_parameter_msg(message).value
    # A list instead of an array, since a refusal quotes it.
    return list(value) if isinstance(value, array) else value
