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

"""The node of one light."""

from __future__ import annotations

import threading
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray, KeyValue
from rclpy.node import Node

from .beam_output import BeamOutput
from .diagnostics import (
    hardware_id,
    lamp_findings,
    lamp_status,
    level,
    link_findings,
    link_status,
    why_no_light,
)
from .inputs import Inputs
from .mounting import Mounting
from .outputs import Outputs, STREAM_QOS
from .parameters import declare_device_parameters, misspelt
from ..illuminator.client import IlluminatorClient
from ..illuminator.light import Light
from ..mavlink.component import Component
from ..mavlink.link import Link

# s without a light, after which the log says once what is known of the reason.
PATIENCE = 5.0
DEFAULT_NAME = 'illuminator'


class IlluminatorNode(Node):
    """
    Serves one light: topics, services, parameters, diagnostics.

    The link's parameters are not declared here but by whoever makes the link.

    :param kwargs: as for rclpy's Node: namespace, parameter_overrides, context ...
    """

    def __init__(self, name: str = DEFAULT_NAME, **kwargs: Any) -> None:
        super().__init__(name, start_parameter_services=False, enable_logger_service=True,
                         **kwargs)
        self.light: Light | None = None
        self._hardware_id = ''
        self._levels: list[bytes] = []
        self._publishing = threading.Lock()

    def serve(
        self, link: Link, component: Component, client: IlluminatorClient, *, url: str,
        mounting: Mounting, period: float,
    ) -> None:
        """
        Create what the node offers.

        :param url: the connection URL, which diagnostics show as the link's hardware id.
        :param period: of diagnostics, s.
        :raises ParameterError: if the value given for a parameter of the light is wrong.
        """
        self._link = link
        self._component = component
        self._client = client
        self._url = url
        self._started = link.clock()
        self._overrides = declare_device_parameters(self)
        for warning in misspelt(self):
            self.get_logger().warning(warning)
        self._beam = BeamOutput(self, mounting, link.clock) if mounting.beam_range else None
        self.outputs = Outputs(
            self, mounting.frame_id, self._check_lamp,
            self._beam.take if self._beam else lambda event: None,
            begun_anew=self._forgive_loss)
        self.inputs = Inputs(self, link, lambda: self.light, self.absence)
        self._diagnostics = self.create_publisher(DiagnosticArray, '/diagnostics', STREAM_QOS)
        self._period = period
        self._missed = False
        self._diagnostics_due = self._started

    def bind(self, light: Light, now: float) -> None:
        """Serve a light from now on, and tell what is known of it; in the link's thread."""
        self.light = light
        for event in light.snapshot(now).events():
            self.outputs.take(event)
        if self._overrides:
            light.set_desired(self._overrides, now)

    def end(self) -> None:
        """Take back what others would go on to show, after the executor has ended."""
        if self._beam is not None:
            self._beam.end()

    def absence(self) -> str:
        """Return why there is no light, for people."""
        return f'no light connected: {why_no_light(self._link.state(), self._client)}'

    def poll(self, tolerance: float) -> None:
        """
        Publish diagnostics if it is time to, or if a level has changed.

        :param tolerance: how much too early it may be, s.
        """
        now = self._link.clock()
        if self.light is None and not self._missed and now >= self._started + PATIENCE:
            self._missed = True
            self.get_logger().warning(self.absence())
        if now >= self._diagnostics_due - tolerance:
            self._diagnostics_due = now + self._period
            self.publish_diagnostics()
        elif self._worst(now) != self._levels:
            self.publish_diagnostics()

    def _worst(self, now: float) -> list[bytes]:
        """Return the levels that would be published now."""
        levels = [level(link_findings(
            self._link.state(), self._component, self._client, self.light, now=now,
            started=self._started))]
        if self.light is not None and self.light.identification.settled(now):
            levels.append(level(lamp_findings(self.light, now)))
        return levels

    def _check_lamp(self) -> None:
        """Publish at once where the lamp's level has changed; asked after each status."""
        light = self.light
        if light is not None and self._levels[1:] not in (
                [], [level(lamp_findings(light, self._link.clock()))]):
            self.publish_diagnostics()

    def _forgive_loss(self) -> None:
        """Take the step back of a restarted light's sequence numbers for no loss of frames."""
        counter = self.light and self._link.state().traffic.sources.get(self.light.address)
        if counter:
            counter.forgive()

    def publish_diagnostics(self) -> None:
        """Publish both statuses, or only the link's while it is open who the light is."""
        with self._publishing:
            now = self._link.clock()
            light = self.light
            array = DiagnosticArray()
            array.header.stamp = self.get_clock().now().to_msg()
            array.status = [link_status(
                self.get_name(), self._url, self._link.state(), self._component, self._client,
                light, now=now, started=self._started)]
            if light is not None and light.identification.settled(now):
                # A light that tells its serial number late keeps the id it had.
                self._hardware_id = self._hardware_id or hardware_id(light)
                array.status.append(
                    lamp_status(self.get_name(), self._hardware_id, light, now))
            for status in array.status:
                # Their names leave out the namespace.
                status.values.append(KeyValue(key='node', value=self.get_fully_qualified_name()))
            self._levels = [status.level for status in array.status]
            self._diagnostics.publish(array)
