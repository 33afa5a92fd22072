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

"""The ROS half of a winch: it publishes ``~/line_length`` and takes ``~/cmd/release``."""

from __future__ import annotations

from illuminator_ros.payload.confirmed_command import Result
from illuminator_ros.ros.node import CommandTopic, Endpoint, NodeInterface
from illuminator_ros.ros.payload import Host, RosPayload, ServedPayload
from payloads.winch import WinchClient, WinchReport
from std_msgs.msg import Float32

LINE_LENGTH = Endpoint('line_length', Float32, 'length of the line that is out, m')
RELEASE = Endpoint('cmd/release', Float32, 'length of line to release, m')


class WinchNode(ServedPayload):
    """Serves all winches of a link with one node; at the end the winch stays as it is."""

    def __init__(self, client: WinchClient, host: Host) -> None:
        self._client = client
        self._log = host.log
        self._interface = NodeInterface(
            host.node, host.link, host.log, publications=[LINE_LENGTH],
            commands=[CommandTopic(RELEASE, self._release)])
        client.events.subscribe(self._publish)

    def _publish(self, report: WinchReport) -> None:
        self._interface.publish('line_length', report.line_length)

    def _release(self, length: float, now: float) -> None:
        for winch in self._client.winches.values():
            winch.release(length, now, self._released)

    def _released(self, result: Result, now: float) -> None:
        self._log.info(f'~/cmd/release: {result.message}', 'release')


WINCH = RosPayload(
    'winch', lambda commands, values: WinchClient(commands), WinchNode, summary='a winch',
    link_defaults={'component_id': 195})
