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

"""The gimbals of a link and their nodes."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Mapping
import functools
import logging
import math

from rclpy.node import Node

from .conversions import FRAME_PARAMETERS
from .gimbal_node import GimbalNode
from ..client import GimbalClient
from ..events import GimbalConnected, GimbalEvent, GimbalForgotten, GimbalKey
from ..gimbal import GimbalSettings
from ...payload.request import Result
from ...ros.command_sources import SOURCE_PARAMETERS, source_settings
from ...ros.conversions import GEOID_SEPARATION
from ...ros.parameters import ignored_parameters, ParameterSpec, Values
from ...ros.payload import Host, RosPayload, ServedPayload, ShutdownReport
from ...ros.throttled_log import NodeLog

# s without a gimbal until the log gives the reason, once.
NO_GIMBAL_DELAY = 5.0

GIMBAL_PARAMETERS = (
    ParameterSpec('gimbal_device_id', 0, 'gimbal device id of the gimbal to serve; 0 = the first',
                  low=0, high=255),
    ParameterSpec('auto_take_control', False,
                  'take control of a gimbal that no component controls when it connects'),
    ParameterSpec('setpoint_timeout', 0.5, 'silence of ~/cmd/rate after which zero is sent', 's',
                  0.05, 60.0),
    *FRAME_PARAMETERS,
    GEOID_SEPARATION,
    ParameterSpec('attitude_interval', 0.0, "period of the attitude; 0 = the device's own", 's',
                  0.0, 3600.0),
    *SOURCE_PARAMETERS,
)


def settings(values: Values) -> GimbalSettings:
    """
    Return how gimbals are treated.

    :raises ParameterError: if the sources are wrong.
    """
    return GimbalSettings(values['setpoint_timeout'], values['attitude_interval'],
                          values['auto_take_control'], values['gimbal_device_id'],
                          source_settings(values))


class Gimbals(ServedPayload):
    """
    Gives each gimbal on the link a node; for turns of the link.

    :param why_none: returns why there is no gimbal, as far as this process knows; '' if not.
    :raises ParameterError: if a parameter is wrong.
    """

    def __init__(
        self, client: GimbalClient, host: Host, why_none: Callable[[], str] = lambda: '',
    ) -> None:
        self._client = client
        self._host = host
        self._settings = settings(host.values)
        self._name = host.node.get_name()
        self._why_none = why_none
        self._first = GimbalNode(
            host.node, host, host.log, client, self._settings, why_none)
        self._nodes: dict[GimbalKey, GimbalNode] = {}
        # The names of the nodes of further gimbals.
        self._names: dict[GimbalKey, str] = {}
        self._no_gimbal_due = host.link.clock() + NO_GIMBAL_DELAY
        host.diagnostics.add(self._first.source)
        client.events.subscribe(self._take)

    def _take(self, event: GimbalEvent) -> None:
        if isinstance(event, GimbalForgotten):
            self._forget(event.key)
        elif node := self._nodes.get(event.key):
            node.take(event)
        elif isinstance(event, GimbalConnected):
            self._serve(event)

    def _serve(self, event: GimbalConnected) -> None:
        """Give a gimbal a node: the first one, or one of its own."""
        key = event.key
        if self._first.key is None and (
                self._host.values['gimbal_device_id'] in (0, key.device_id)):
            self._bind(self._first, key, self._host.link.clock())
            self._first.take(event)
        elif key not in self._names:
            name = f'{self._name}_{key.address.system}_{key.device_id}'
            if name in self._names.values():
                # The same number behind another manager.
                name += f'_{key.address.component}'
            self._names[key] = name
            self._host.nodes.make(key, f'gimbal {key}', name,
                                  functools.partial(self._serve_further, key))

    def _serve_further(self, key: GimbalKey, node: Node) -> None:
        """Give the node of a further gimbal its interface; in the thread that makes nodes."""
        log = NodeLog(node.get_logger())
        gimbal_node = GimbalNode(node, self._host, log, self._client, self._settings,
                                 self._why_none)
        for warning in ignored_parameters(node, self._host.node):
            log.warning(warning)
        self._host.log.info(f'gimbal {key} is served by {gimbal_node.full_name}', 'served')
        self._host.link.call(lambda now: self._bind(gimbal_node, key, now))

    def _bind(self, node: GimbalNode, key: GimbalKey, now: float) -> None:
        if key in self._client.gimbals:
            self._nodes[key] = node
            node.bind(key, now)
            self._host.diagnostics.add(node.source)

    def _forget(self, key: GimbalKey) -> None:
        self._names.pop(key, None)
        node = self._nodes.pop(key, None)
        if node is not None:
            node.release()
        if node is not None and node is not self._first:
            self._host.diagnostics.remove(node.source)
            self._host.log.info(
                f'gimbal {key} was silent for long: {node.full_name} is removed', 'forgotten')
        self._host.nodes.remove(key)

    def poll(self, now: float) -> None:
        """See :meth:`ServedPayload.poll`."""
        if now >= self._no_gimbal_due:
            self._no_gimbal_due = math.inf
            if self._first.key is None:
                self._host.log.warning(self._first.absence(now))

    def shut_down(self, now: float, report: ShutdownReport) -> Mapping[Hashable, str]:
        """See :meth:`ServedPayload.shut_down`: release the gimbals that we control."""
        def done(key: GimbalKey, result: Result, now: float) -> None:
            severity = logging.INFO if result.success else logging.ERROR
            report(key, severity, f'gimbal {key}: {result.message}')

        controlled = [one for one in self._client.gimbals.values() if one.has_any_control]
        for gimbal in controlled:
            gimbal.release_control(now, functools.partial(done, gimbal.key))
        return {one.key: f'control of gimbal {one.key} may not be released: no confirmation'
                for one in controlled}


GIMBAL = RosPayload(
    'gimbal', lambda commands, values: GimbalClient(commands, settings(values)), Gimbals,
    GIMBAL_PARAMETERS, summary='a gimbal that a MAVLink gimbal manager controls', examples=(
        'ros2 service call /gimbal/take_control std_srvs/srv/Trigger',
        'ros2 topic pub -1 /gimbal/cmd/angles geometry_msgs/msg/Vector3Stamped '
        '"{header: {frame_id: base_link_stabilized}, vector: {y: 0.785, z: 0.524}}"'),
    mavlink_version=2)
