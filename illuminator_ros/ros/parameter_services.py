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

from collections.abc import Awaitable, Callable
import contextlib
from typing import Any

from rcl_interfaces.msg import ParameterType, ParameterValue, SetParametersResult
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

from ..illuminator.model import checked, InvalidValue, Limits
from .parameters import cast, DEVICE_SPECS

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
        for name, service, callback in (
            ('describe_parameters', DescribeParameters, self._describe),
            ('get_parameters', GetParameters, self._get),
            ('get_parameter_types', GetParameterTypes, self._types),
            ('list_parameters', ListParameters, self._list),
            ('set_parameters', SetParameters, self._set),
            ('set_parameters_atomically', SetParametersAtomically, self._set_atomically),
        ):
            node.create_service(service, f'~/{name}', callback,
                                qos_profile=qos_profile_parameters, callback_group=group)

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
        parameters = [Parameter.from_parameter_msg(p) for p in request.parameters]
        results = [SetParametersResult(successful=True) for _ in parameters]
        changes: dict[str, Any] = {}
        for parameter, result in zip(parameters, results, strict=True):
            reason = self._check(parameter)
            if not reason and parameter.name in DEVICE_SPECS:
                changes[parameter.name] = cast(parameter.name, parameter.value)
            elif not reason:
                reason = self._set_local([parameter])
            result.successful, result.reason = not reason, reason
        if changes:
            reason = await self._configure(changes)
            for parameter, result in zip(parameters, results, strict=True):
                if parameter.name in changes and result.successful:
                    result.successful, result.reason = not reason, reason
        response.results = results
        return response

    async def _set_atomically(self, request: Any, response: Any) -> Any:
        """Set all or none. What is ours is set first: it can be taken back, light cannot."""
        parameters = [Parameter.from_parameter_msg(p) for p in request.parameters]
        reason = next(filter(None, map(self._check, parameters)), '')
        local = [p for p in parameters if p.name not in DEVICE_SPECS]
        changes = {p.name: cast(p.name, p.value) for p in parameters if p.name in DEVICE_SPECS}
        before = [self._node.get_parameter(p.name) for p in local] if not reason else []
        if not reason and local:
            reason = self._set_local(local)
        if not reason and changes:
            reason = await self._configure(changes)
            if reason and before:
                self._set_local(before)
        response.result = SetParametersResult(successful=not reason, reason=reason)
        return response

    def _set_local(self, parameters: list[Parameter]) -> str:
        result = self._node.set_parameters_atomically(parameters)
        return '' if result.successful else str(result.reason)

    def _check(self, parameter: Parameter) -> str:
        """Return why a parameter cannot be set, '' if that is left to see."""
        name = parameter.name
        if not self._node.has_parameter(name):
            return f'{name} is no parameter of this node'
        if name not in DEVICE_SPECS:
            return ''
        if parameter.type_.value == ParameterType.PARAMETER_NOT_SET:
            return f'{name} cannot be deleted'
        try:
            checked(name, parameter.value, self._limits())
        except InvalidValue as error:
            return str(error)
        return ''
