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
The parameter services of a node whose parameters live in a device.

rclpy's own answer from synchronous callbacks: while one waits for the device, the executor
stands still, and each parameter of a list is a command of its own. These are coroutines: a set
waits for the light's acknowledgement while everything else goes on, and what comes in one call
goes out in one command.
"""

from __future__ import annotations

from array import array
from collections.abc import Awaitable, Callable
import contextlib
import inspect
from typing import Any

from rcl_interfaces.msg import ParameterValue, SetParametersResult
from rcl_interfaces.srv import (
    DescribeParameters,
    GetParameters,
    GetParameterTypes,
    ListParameters,
    SetParameters,
    SetParametersAtomically,
)
from rclpy.callback_groups import CallbackGroup
from rclpy.exceptions import ParameterNotDeclaredException, ParameterUninitializedException
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.qos import qos_profile_parameters

from .parameters import DEVICE_SPECS
from ..illuminator.model import checked, InvalidValue, Limits

# Sets values in the device; returns '' or why not.
Configure = Callable[[dict[str, Any]], Awaitable[str]]


class ParameterServices:
    """
    The six parameter services of a node made with ``start_parameter_services=False``.

    :param configure: sets some of the parameters of the device with one command.
    :param limits: returns what the device reports to be possible.
    """

    def __init__(
        self, node: Node, group: CallbackGroup, configure: Configure,
        limits: Callable[[], Limits],
    ) -> None:
        self._node = node
        self._configure = configure
        self._limits = limits
        callbacks: tuple[tuple[str, type[Any], Callable[[Any, Any], Any]], ...] = (
            ('describe_parameters', DescribeParameters, self._describe),
            ('get_parameters', GetParameters, self._get),
            ('get_parameter_types', GetParameterTypes, self._types),
            ('list_parameters', ListParameters, self._list),
            ('set_parameters', SetParameters, self._set),
            ('set_parameters_atomically', SetParametersAtomically, self._set_atomically),
        )
        for name, service, callback in callbacks:
            node.create_service(service, f'~/{name}', self._answering(callback),
                                qos_profile=qos_profile_parameters, callback_group=group)

    def _answering(self, callback: Callable[[Any, Any], Any]) -> Callable[[Any, Any], Any]:
        """Return a service callback that answers whatever goes wrong in it."""
        async def answering(request: Any, response: Any) -> Any:
            try:
                answer = callback(request, response)
                return await answer if inspect.isawaitable(answer) else answer
            except Exception as error:
                reason = f'internal error: {error!r}'
                self._node.get_logger().error(reason)
                failure = SetParametersResult(successful=False, reason=reason)
                if isinstance(response, SetParameters.Response):
                    response.results = [failure] * len(request.parameters)
                elif isinstance(response, SetParametersAtomically.Response):
                    response.result = failure
                return response
        return answering

    def _describe(self, request: Any, response: Any) -> Any:
        try:
            response.descriptors = self._node.describe_parameters(request.names)
        except ParameterNotDeclaredException:
            response.descriptors = []
        return response

    def _get(self, request: Any, response: Any) -> Any:
        try:
            response.values = [self._value(name) for name in request.names]
        except ParameterNotDeclaredException:
            # rclpy and rclcpp answer so; tools take it for "not set".
            response.values = []
        return response

    def _value(self, name: str) -> ParameterValue:
        try:
            return self._node.get_parameter(name).get_parameter_value()
        except ParameterUninitializedException:
            return ParameterValue()

    def _types(self, request: Any, response: Any) -> Any:
        try:
            response.types = [self._value(name).type for name in request.names]
        except ParameterNotDeclaredException:
            response.types = []
        return response

    def _list(self, request: Any, response: Any) -> Any:
        with contextlib.suppress(TypeError, ValueError):
            response.result = self._node.list_parameters(list(request.prefixes), request.depth)
        return response

    async def _set(self, request: Any, response: Any) -> Any:
        """Set each parameter for itself, those of the light all with one command."""
        results = [SetParametersResult() for _ in request.parameters]
        changes: dict[str, Any] = {}
        changing = []
        for message, result in zip(request.parameters, results, strict=True):
            result.reason = self._check(message)
            if not result.reason and message.name in DEVICE_SPECS:
                changes[message.name] = _value(message)
                changing.append(result)
            elif not result.reason:
                result.reason = self._set_local([message])
        reason = await self._configure(changes) if changes else ''
        for result in changing:
            result.reason = reason
        for result in results:
            result.successful = not result.reason
        response.results = results
        return response

    async def _set_atomically(self, request: Any, response: Any) -> Any:
        """Set all or none. What is ours is set first: it can be taken back, light cannot."""
        reason = next(filter(None, map(self._check, request.parameters)), '')
        local = [p for p in request.parameters if p.name not in DEVICE_SPECS]
        changes = [p for p in request.parameters if p.name in DEVICE_SPECS]
        before = [self._node.get_parameter(p.name) for p in local] if not reason else []
        if not reason and local:
            reason = self._set_local(local)
        if not reason and changes:
            reason = await self._configure({p.name: _value(p) for p in changes})
            if reason and before:
                self._node.set_parameters_atomically(before)
        response.result = SetParametersResult(successful=not reason, reason=reason)
        return response

    def _set_local(self, messages: list[Any]) -> str:
        result = self._node.set_parameters_atomically(
            [Parameter.from_parameter_msg(message) for message in messages])
        return '' if result.successful else str(result.reason)

    def _check(self, message: Any) -> str:
        """Return why a parameter cannot be set, '' if that is left to see."""
        name = message.name
        if not self._node.has_parameter(name):
            return f'{name} is no parameter of this node'
        try:
            value = _value(message)
        except ValueError:
            return f'{name}: {message.value.type} is no parameter type'
        if name not in DEVICE_SPECS:
            return ''
        if value is None:
            return f'{name} cannot be deleted'
        try:
            checked(name, value, self._limits())
        except InvalidValue as error:
            return str(error)
        return ''


def _value(message: Any) -> Any:
    value = Parameter.from_parameter_msg(message).value
    # As people write it, for the answer that refuses it.
    return list(value) if isinstance(value, array) else value
