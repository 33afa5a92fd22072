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

"""The lights of a link and their nodes."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Mapping
import functools
import logging
import math

from rclpy.node import Node
from std_msgs.msg import Bool
from std_srvs.srv import SetBool

from . import parameters
from .light_node import LightNode
from .. import events
from ..client import enable_all, IlluminatorClient
from ..light import Light
from ...mavlink.command_sender import CommandSender
from ...mavlink.messages import Address
from ...payload.request import Result
from ...ros.link_call import LatestOnly
from ...ros.node import Answer, CommandTopic, RequestService
from ...ros.parameters import ignored_parameters, Values
from ...ros.payload import Host, RosPayload, ServedPayload, ShutdownReport
from ...ros.throttled_log import NodeLog

# s without a light until the log gives the reason, once.
NO_LIGHT_DELAY = 5.0
# s after the first light in which lights that start together are heard.
NAMES_DELAY = 10.0


class Lights(ServedPayload):
    """
    Gives each light on the link a node. In turns of the link, except :meth:`close`.

    :raises ParameterError: if a parameter is wrong.
    """

    def __init__(self, client: IlluminatorClient, host: Host) -> None:
        self._client = client
        self._host = host
        self._selection = parameters.Selection(host.values, host.node.get_name())
        self._geometry = parameters.BeamGeometry.of(host.values)
        self._switching = LatestOnly(self._switch_all)
        self._first = LightNode(
            host.node, host, host.log, client, self._geometry,
            services=(RequestService('enable_all', SetBool, self._enable_all),),
            commands=(CommandTopic('cmd/enable_all', Bool, self._switching.offer),))
        # By the addresses of their lights.
        self._nodes: dict[Address, LightNode] = {}
        self._wanted: set[Address] = set()
        self._second_reported = False
        self._no_light_due = host.link.clock() + NO_LIGHT_DELAY
        self._names_due = math.inf
        host.diagnostics.add(self._first.source)
        client.events.subscribe(self._take)
        client.mount_moved.subscribe(self._turn)

    def _turn(self, system: int) -> None:
        for address, node in self._nodes.items():
            if address.system == system:
                node.turn()

    def _take(self, event: events.AnyLightEvent) -> None:
        node = self._nodes.get(event.address)
        if isinstance(event, events.LightForgotten):
            self._forget(event.address)
        elif node is not None:
            if isinstance(event, events.LightRestarted):
                # Its sequence numbers have restarted, which is not a loss.
                self._host.link.reset_loss(event.address)
            node.take(event)
        elif isinstance(event, events.LightConnected | events.StatusReceived):
            self._serve(event.address)

    def _serve(self, address: Address) -> None:
        """Give a light a node: the first one, or one of its own."""
        now = self._host.link.clock()
        selected = self._selection.is_target(address)
        if selected and self._first.address is None:
            if warning := self._selection.unused_name(address):
                self._host.log.warning(warning)
            self._names_due = now + NAMES_DELAY
            self._bind(self._first, address, now)
        elif address not in self._wanted:
            self._wanted.add(address)
            if selected and not self._second_reported:
                self._second_reported = True
                self._host.log.info(
                    f'a second light, {address}, was found; {self._first.full_name} serves '
                    f'{self._first.address}. Set target_system and target_component to choose')
            self._host.nodes.make(
                address, f'light {address}', self._selection.node_name(address),
                functools.partial(self._serve_further, address))

    def _serve_further(self, address: Address, node: Node) -> None:
        """Give the node of a further light its interface; in the thread that makes nodes."""
        log = NodeLog(node.get_logger())
        geometry = self._geometry.declare(node)
        light_node = LightNode(node, self._host, log, self._client, geometry)
        for warning in ignored_parameters(node, self._host.node):
            log.warning(warning)
        self._host.log.info(f'light {address} is served by {light_node.full_name}', 'served')
        self._host.link.call(lambda now: self._bind(light_node, address, now))

    def _bind(self, node: LightNode, address: Address, now: float) -> None:
        if address in self._client.lights:
            self._nodes[address] = node
            node.bind(address, now)
            self._host.diagnostics.add(node.source)

    def _forget(self, address: Address) -> None:
        self._wanted.discard(address)
        node = self._nodes.pop(address, None)
        if node is not None:
            node.release()
        if node is not self._first:
            if node is not None:
                self._host.diagnostics.remove(node.source)
                self._host.log.info(f'light {address} was silent for long: {node.full_name} '
                                    'is removed', 'forgotten')
            self._host.nodes.remove(address)

    # Requests to all lights

    def _enable_all(self, request: SetBool.Request, now: float, answer: Answer) -> None:
        lights = self._client.commanded_or_found
        if lights:
            enable_all(lights, request.data, now,
                       lambda result, now: answer(result.success, result.message),
                       name=self._name_of, detail='enable_all')
        else:
            answer(False, self._first.absence(now))

    def _switch_all(self, on: bool, now: float, ended: Callable[[float], None]) -> None:
        def answer(success: bool, message: str) -> None:
            if not success:
                self._host.log.warning(f'~/cmd/enable_all: {message}', 'cmd/enable_all')
            ended(self._host.link.clock())

        self._enable_all(SetBool.Request(data=on), now, answer)

    def _name_of(self, light: Light) -> str:
        node = self._nodes.get(light.address)
        return f'{node.name} ({light.address})' if node else str(light.address)

    # The bridge's calls

    def poll(self, now: float) -> None:
        """See :meth:`ServedPayload.poll`."""
        if now >= self._no_light_due:
            self._no_light_due = math.inf
            if self._first.address is None:
                self._host.log.warning(self._first.absence(now))
        if now >= self._names_due:
            self._names_due = math.inf
            for warning in self._selection.unused_names(self._client.lights):
                self._host.log.warning(warning)
        for node in self._nodes.values():
            node.poll()

    def may_name(self, name: str) -> bool:
        """See :meth:`ServedPayload.may_name`."""
        return self._selection.may_name(name)

    def shut_down(self, now: float, report: ShutdownReport) -> Mapping[Hashable, str]:
        """See :meth:`ServedPayload.shut_down`: switch all off, or name the lights that stay on."""
        lights = self._client.commanded_or_found
        if not self._host.values['off_on_shutdown']:
            on = [light for light in lights if light.status and light.status.enabled]
            for light in on:
                report(light.address, logging.WARNING, f'light {light.address} is left on')
            return {light.address: '' for light in on}

        def done(address: Address, result: Result, now: float) -> None:
            if result.success:
                report(address, logging.INFO, f'light {address} is off: {result.message}')
            else:
                report(address, logging.ERROR, f'light {address} may still be on: '
                                               f'{result.message}')

        for light in lights:
            light.shut_down(now, functools.partial(done, light.address))
        return {light.address: f'light {light.address} may still be on: no confirmation'
                for light in lights}

    def close(self) -> None:
        """See :meth:`ServedPayload.close`."""
        self._first.close()
        for node in self._nodes.values():
            if node is not self._first:
                node.close()


def _make_client(commands: CommandSender, values: Values) -> IlluminatorClient:
    selection = parameters.Selection(values, 'illuminator')
    return IlluminatorClient(
        commands, parameters.settings(values), wanted=selection.is_served,
        needs_mounts=bool(values['beam_range'] or values['mounted_on']))


ILLUMINATOR = RosPayload(
    'illuminator', _make_client, Lights, parameters.LIGHT_PARAMETERS,
    parameters.DEVICE_PARAMETERS,
    summary='a MAVLink illuminator (searchlight, torch, strobe)', examples=(
        'ros2 service call /illuminator/enable std_srvs/srv/SetBool "{data: true}"',
        'ros2 param set /illuminator brightness 60'),
    mavlink_version=2)
