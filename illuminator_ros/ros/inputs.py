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

"""What the node of a light takes: services and command topics."""

from __future__ import annotations

from collections.abc import Callable
import threading
from typing import Any

from rclpy.node import Node
from std_msgs.msg import Bool, Float32
from std_srvs.srv import SetBool, Trigger

from .handover import Handover, Newest
from .parameter_services import ParameterServices
from ..illuminator.light import Light
from ..illuminator.model import checked, InvalidValue
from ..illuminator.operation import Result
from ..mavlink.link import Link

# A request to a light: it answers once, through the last argument.
Request = Callable[[Light, float, Callable[[Result, float], None]], None]


class Inputs:
    """
    Services, command topics and parameter services of one node.

    :param light: returns the light that they are for, None while there is none.
    :param absent: returns why there is none, for people.
    """

    def __init__(
        self, node: Node, link: Link, light: Callable[[], Light | None],
        absent: Callable[[], str],
    ) -> None:
        self._node = node
        self._link = link
        self._light = light
        self._absent = absent
        self._handover: Handover[Result] = Handover(node, link)
        self._setpoint: float | None = None
        self._setting = threading.Lock()
        self._switching = Newest(self._switch_to)
        group = self._handover.group
        node.create_service(SetBool, '~/enable', self._enable, callback_group=group)
        node.create_service(Trigger, '~/refresh', self._refresh, callback_group=group)
        node.create_subscription(Bool, '~/cmd/enable', self._cmd_enable, 10,
                                 callback_group=group)
        node.create_subscription(Float32, '~/cmd/brightness', self._cmd_brightness, 10,
                                 callback_group=group)
        ParameterServices(node, group, self._configure, self._limits)

    async def ask(self, request: Request) -> Result:
        """Have a request to the light carried out; it always ends with a result."""
        def run(now: float, answer: Callable[[Result], None]) -> None:
            light = self._light()
            if light is None:
                answer(Result(False, self._absent()))
            else:
                request(light, now, lambda result, now: answer(result))

        try:
            return await self._handover.ask(run)
        except Exception as error:
            # Whatever is wrong with us, the caller gets an answer, and the executor goes on.
            self._node.get_logger().error(f'internal error: {error!r}')
            return Result(False, f'internal error: {error!r}')

    async def _enable(self, request: Any, response: Any) -> Any:
        result = await self.ask(
            lambda light, now, done: light.enable(request.data, now, done))
        response.success, response.message = result.success, result.message
        return response

    async def _refresh(self, request: Any, response: Any) -> Any:
        result = await self.ask(lambda light, now, done: light.refresh(now, done))
        response.success, response.message = result.success, result.message
        return response

    async def _configure(self, changes: dict[str, Any]) -> str:
        result = await self.ask(
            lambda light, now, done: light.configure(changes, now, done))
        return '' if result.success else result.message

    def _limits(self) -> Any:
        light = self._light()
        return light.limits if light else None

    async def _cmd_enable(self, message: Any) -> None:
        await self._switching.want(bool(message.data))

    async def _switch_to(self, on: bool) -> None:
        result = await self.ask(lambda light, now, done: light.enable(on, now, done))
        if not result.success:
            self._node.get_logger().warning(
                f'~/cmd/enable: {result.message}', throttle_duration_sec=5.0)

    def _cmd_brightness(self, message: Any) -> None:
        try:
            value = checked('brightness', message.data)
        except InvalidValue as error:
            self._node.get_logger().warning(
                f'~/cmd/brightness: {error}', throttle_duration_sec=5.0)
            return
        assert isinstance(value, float)
        with self._setting:
            waiting, self._setpoint = self._setpoint is not None, value
        if not waiting:
            self._link.call(self._hand_over_setpoint)

    def _hand_over_setpoint(self, now: float) -> None:
        """Pass on the newest setpoint, in the link's thread; those before it are gone."""
        with self._setting:
            value, self._setpoint = self._setpoint, None
        light = self._light()
        if light is None:
            self._node.get_logger().warning(
                f'~/cmd/brightness: {self._absent()}', throttle_duration_sec=5.0)
        elif value is not None:
            light.set_brightness(value, now)
