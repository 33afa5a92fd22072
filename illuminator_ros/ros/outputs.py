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

"""What the node of a light publishes: topics, parameters that follow the light, log lines."""

from __future__ import annotations

from collections.abc import Callable
import threading
from typing import Any

from rcl_interfaces.msg import SetParametersResult
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import Temperature
from std_msgs.msg import Bool

from .conversions import STATUS_TOPICS, status_values, temperature_message
from .diagnostics import ERROR, WARN
from .flag_log import FlagLog
from .parameters import DEVICE_SPECS, period_range
from ..illuminator.events import (
    AnyLightEvent,
    Cause,
    ConfigurationChanged,
    ConfigurationRestored,
    LightConnected,
    LightIdentified,
    LightLost,
    LightRestarted,
    SetpointFailed,
    StatusReceived,
)
from ..illuminator.identity import Identity
from ..illuminator.model import Limits, Mode, shortest

# A late subscriber gets the last value.
STATE_QOS = QoSProfile(
    depth=1, reliability=ReliabilityPolicy.RELIABLE,
    durability=DurabilityPolicy.TRANSIENT_LOCAL)
STREAM_QOS = QoSProfile(depth=10, reliability=ReliabilityPolicy.RELIABLE)


class Outputs:
    """
    Publishes what one light reports, from the link's thread: there is no hop in between.

    :param changed: called after anything that diagnostics might have to tell at once.
    :param beam: takes the events, too, to draw the beam.
    :param begun_anew: called when the light has restarted.
    """

    def __init__(
        self, node: Node, frame_id: str, changed: Callable[[], None],
        beam: Callable[[AnyLightEvent], None] = lambda event: None, *,
        begun_anew: Callable[[], None] = lambda: None,
    ) -> None:
        self._node = node
        self._beam = beam
        self._frame_id = frame_id
        self._changed = changed
        self._begun_anew = begun_anew
        self._publishers = {name: node.create_publisher(type_, f'~/{name}', STATE_QOS)
                            for name, type_ in STATUS_TOPICS.items()}
        self._temperature = node.create_publisher(Temperature, '~/temperature', STREAM_QOS)
        self._connected = node.create_publisher(Bool, '~/connected', STATE_QOS)
        self._connected.publish(Bool(data=False))
        self._identity: Identity | None = None
        self._limits = Limits()
        self._shared = False
        self._flags = FlagLog()
        self._handlers: dict[type, Callable[[Any], None]] = {
            LightConnected: self._light_connected, LightLost: self._light_lost,
            LightRestarted: self._light_restarted, LightIdentified: self._light_identified,
            StatusReceived: self._status_received,
            ConfigurationChanged: self._configuration_changed,
            ConfigurationRestored: self._configuration_restored,
            SetpointFailed: self._setpoint_failed,
        }
        self._mirroring = threading.RLock()
        self._mirrored_by: int | None = None
        node.add_on_set_parameters_callback(self._may_set)

    def take(self, event: AnyLightEvent) -> None:
        """Publish an event."""
        handler = self._handlers.get(type(event))
        if handler is not None:
            handler(event)
        self._beam(event)
        if not isinstance(event, LightRestarted | LightIdentified | ConfigurationChanged
                          | SetpointFailed):
            self._changed()

    def _light_connected(self, event: LightConnected) -> None:
        self._node.get_logger().info(f'light {event.address} connected')
        self._connected.publish(Bool(data=True))

    def _light_lost(self, event: LightLost) -> None:
        self._node.get_logger().warning(f'light {event.address} lost: {event.reason}')
        self._connected.publish(Bool(data=False))

    def _light_restarted(self, event: LightRestarted) -> None:
        self._begun_anew()
        logger = self._node.get_logger()
        logger.info(f'light {event.address} has restarted', throttle_duration_sec=1.0)
        if event.was_on and event.is_on is False:
            logger.warning(f'light {event.address} was on before it restarted, and is off now',
                           throttle_duration_sec=1.0)

    def _light_identified(self, event: LightIdentified) -> None:
        identity = event.identity
        if identity == self._identity:
            return
        before, self._identity = self._identity, identity
        known = ' '.join(filter(None, (identity.vendor, identity.model)))
        serial = f', serial number {identity.serial_number}' if identity.serial_number else ''
        line = f'light {event.address} is {known or "nameless"}{serial}'
        logger = self._node.get_logger()
        if before is None:
            logger.info(line)
        else:
            logger.info(line, throttle_duration_sec=1.0)

    def _status_received(self, event: StatusReceived) -> None:
        status = event.status
        for name, value in status_values(status).items():
            self._publishers[name].publish(STATUS_TOPICS[name](data=value))
        temperature = event.temperature
        if temperature is not None:
            stamp = self._node.get_clock().now().to_msg()
            self._temperature.publish(temperature_message(temperature, stamp, self._frame_id))
        if event.shared_address and not self._shared:
            self._node.get_logger().warning(
                f'several lights answer as {event.address}: parameters stay as they are',
                throttle_duration_sec=5.0)
        self._shared = event.shared_address
        if status.limits != self._limits:
            self._limits = status.limits
            self._fit()
        self._tell_flags(event)

    def _tell_flags(self, event: StatusReceived) -> None:
        logger = self._node.get_logger()
        for severity, text in self._flags.take(event.status.error_flags, event.received_at):
            line = f'light {event.address}: {text}'
            # One call each: rclpy refuses another severity from the same line.
            if severity == ERROR:
                logger.error(line)
            elif severity == WARN:
                logger.warning(line)
            else:
                logger.info(line)

    def _configuration_changed(self, event: ConfigurationChanged) -> None:
        configuration, names = event.configuration, event.names
        if event.cause is Cause.LIGHT:
            self._node.get_logger().info(
                f'light {event.address} was changed: {configuration.describe(names)}')
        if 'strobe_period' in names:
            self._fit(configuration.strobe_period)
        with self._mirroring:
            self._mirrored_by = threading.get_ident()
            try:
                result = self._node.set_parameters_atomically([
                    Parameter(name, value=_value(getattr(configuration, name)))
                    for name in names])
            finally:
                self._mirrored_by = None
        if not result.successful:
            self._node.get_logger().error(f'cannot show the light: {result.reason}')
        if 'strobe_period' in names:
            self._fit()

    def _configuration_restored(self, event: ConfigurationRestored) -> None:
        logger = self._node.get_logger()
        if event.success:
            logger.info(f'light {event.address} configured: {event.message}')
        else:
            logger.error(f'light {event.address} not configured: {event.message}')

    def _setpoint_failed(self, event: SetpointFailed) -> None:
        self._node.get_logger().warning(
            f'~/cmd/brightness: {event.message}', throttle_duration_sec=5.0)

    def _fit(self, period: float = 0.0) -> None:
        """
        Show in the descriptor what strobe periods the light reports to be possible.

        :param period: what it also has to have room for, s: some lights report more.
        """
        name = 'strobe_period'
        value = self._node.get_parameter_or(name).value
        if not isinstance(value, float):
            # rclpy cannot describe anew what has no value; that follows with the first one.
            return
        longest = shortest(self._limits.max_strobe_period) if self._limits.known else 0.0
        with self._mirroring:
            self._node.set_descriptor(name, period_range(longest, max(value, period)))

    def _may_set(self, parameters: list[Parameter]) -> SetParametersResult:
        """Refuse what would show something that the light has not accepted."""
        if self._mirrored_by != threading.get_ident():
            names = [p.name for p in parameters
                     if p.name in DEVICE_SPECS and p.type_ != Parameter.Type.NOT_SET]
            if names:
                return SetParametersResult(successful=False, reason=(
                    f'{", ".join(names)}: only the parameter services reach the light'))
        return SetParametersResult(successful=True)


def _value(value: Any) -> Any:
    return value.label if isinstance(value, Mode) else value
