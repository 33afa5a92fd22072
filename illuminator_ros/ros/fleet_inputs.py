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

"""What only the first node takes: requests to all lights on the link."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from rclpy.node import Node
from std_msgs.msg import Bool
from std_srvs.srv import SetBool

from .handover import Handover, Newest
from ..illuminator.fleet import enable_all
from ..illuminator.light import Light
from ..illuminator.operation import Result
from ..mavlink.link import Link


class FleetInputs:
    """
    The service and the command topic that switch all connected lights.

    :param lights: returns those that have been found; called in the link's thread.
    :param name: returns what to call a light, for people.
    :param absent: returns why there is none, for people.
    """

    def __init__(
        self, node: Node, link: Link, lights: Callable[[], Sequence[Light]],
        name: Callable[[Light], str], absent: Callable[[], str],
    ) -> None:
        self._node = node
        self._lights = lights
        self._name = name
        self._absent = absent
        self._handover: Handover[Result] = Handover(node, link)
        self._switching = Newest(self._switch_to)
        group = self._handover.group
        node.create_service(SetBool, '~/enable_all', self._enable_all, callback_group=group)
        node.create_subscription(Bool, '~/cmd/enable_all', self._cmd_enable_all, 10,
                                 callback_group=group)

    async def _ask(self, on: bool) -> Result:
        def run(now: float, answer: Callable[[Result], None]) -> None:
            lights = self._lights()
            if lights:
                enable_all(lights, on, now, lambda result, now: answer(result), name=self._name)
            else:
                answer(Result(False, self._absent()))

        try:
            return await self._handover.ask(run)
        except Exception as error:
            self._node.get_logger().error(f'internal error: {error!r}')
            return Result(False, f'internal error: {error!r}')

    async def _enable_all(self, request: Any, response: Any) -> Any:
        result = await self._ask(request.data)
        response.success, response.message = result.success, result.message
        return response

    async def _cmd_enable_all(self, message: Any) -> None:
        await self._switching.want(bool(message.data))

    async def _switch_to(self, on: bool) -> None:
        result = await self._ask(on)
        if not result.success:
            self._node.get_logger().warning(
                f'~/cmd/enable_all: {result.message}', throttle_duration_sec=5.0)
