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
from ..illuminator.identity import Identity
from ..illuminator.light import Light
from ..illuminator.model import Configuration, FIELDS, Limits, Mode, shortest, Status
from ..illuminator.observer import Cause, LightObserver

# A late subscriber gets the last value.
STATE_QOS = QoSProfile(
    depth=1, reliability=ReliabilityPolicy.RELIABLE,
    durability=DurabilityPolicy.TRANSIENT_LOCAL)
STREAM_QOS = QoSProfile(depth=10, reliability=ReliabilityPolicy.RELIABLE)


class Outputs(LightObserver):
    """
    Publishes what one light reports, from the link's thread: there is no hop in between.

    :param changed: called after anything that diagnostics might have to tell at once.
    :param beam: who also is told what to show, if anybody is.
    :param begun_anew: called when the light has restarted.
    """

    def __init__(
        self, node: Node, frame_id: str, changed: Callable[[], None],
        beam: LightObserver | None = None, begun_anew: Callable[[], None] = lambda: None,
    ) -> None:
        self._node = node
        self._beam = beam or LightObserver()
        self._frame_id = frame_id
        self._changed = changed
        self._begun_anew = begun_anew
        self._publishers = {name: node.create_publisher(type_, f'~/{name}', STATE_QOS)
                            for name, type_ in STATUS_TOPICS.items()}
        self._temperature = node.create_publisher(Temperature, '~/temperature', STREAM_QOS)
        self._connected = node.create_publisher(Bool, '~/connected', STATE_QOS)
        self._connected.publish(Bool(data=False))
        self._identity: Identity | None = None
        self._enabled: bool | None = None
        self._limits = Limits()
        self._shared = False
        self._flags = FlagLog()
        self._mirroring = threading.RLock()
        self._mirrored_by: int | None = None
        node.add_on_set_parameters_callback(self._may_set)

    def catch_up(self, light: Light) -> None:
        """Tell what has happened before somebody listened."""
        if light.connected:
            self.connected(light)
        if light.identification.identity:
            self.identified(light, light.identification.identity)
        if light.status:
            self.status(light, light.status)
        if light.agreement.agreed:
            self.configured(
                light, light.agreement.agreed, list(FIELDS), Cause.FIRST_STATUS)

    def connected(self, light: Light) -> None:
        """See :meth:`LightObserver.connected`."""
        self._node.get_logger().info(f'light {light.source} connected')
        self._connected.publish(Bool(data=True))
        self._changed()

    def lost(self, light: Light, reason: str) -> None:
        """See :meth:`LightObserver.lost`."""
        self._node.get_logger().warning(f'light {light.source} lost: {reason}')
        self._connected.publish(Bool(data=False))
        self._beam.lost(light, reason)
        self._changed()

    def restarted(self, light: Light) -> None:
        """See :meth:`LightObserver.restarted`."""
        self._begun_anew()
        logger = self._node.get_logger()
        logger.info(f'light {light.source} has restarted', throttle_duration_sec=1.0)
        if self._enabled and light.status and light.status.enabled is False:
            logger.warning(f'light {light.source} was on before it restarted, and is off now',
                           throttle_duration_sec=1.0)

    def identified(self, light: Light, identity: Identity) -> None:
        """See :meth:`LightObserver.identified`."""
        if identity == self._identity:
            return
        before, self._identity = self._identity, identity
        known = ' '.join(filter(None, (identity.vendor, identity.model)))
        serial = f', serial number {identity.serial_number}' if identity.serial_number else ''
        line = f'light {light.source} is {known or "nameless"}{serial}'
        logger = self._node.get_logger()
        if before is None:
            logger.info(line)
        else:
            logger.info(line, throttle_duration_sec=1.0)

    def status(self, light: Light, status: Status) -> None:
        """See :meth:`LightObserver.status`."""
        self._enabled = status.enabled
        for name, value in status_values(status).items():
            self._publishers[name].publish(STATUS_TOPICS[name](data=value))
        temperature = light.temperature
        if temperature is not None:
            stamp = self._node.get_clock().now().to_msg()
            self._temperature.publish(temperature_message(temperature, stamp, self._frame_id))
        if light.sharing.recognised and not self._shared:
            self._node.get_logger().warning(
                f'several lights answer as {light.source}: parameters stay as they are',
                throttle_duration_sec=5.0)
        self._shared = light.sharing.recognised
        if status.limits != self._limits:
            self._limits = status.limits
            self._fit()
        self._tell_flags(light, status)
        self._beam.status(light, status)
        self._changed()

    def _tell_flags(self, light: Light, status: Status) -> None:
        logger = self._node.get_logger()
        for severity, text in self._flags.take(status.error_flags, light.status_at):
            line = f'light {light.source}: {text}'
            # One call each: rclpy refuses another severity from the same line.
            if severity == ERROR:
                logger.error(line)
            elif severity == WARN:
                logger.warning(line)
            else:
                logger.info(line)

    def configured(
        self, light: Light, configuration: Configuration, names: list[str], cause: Cause,
    ) -> None:
        """See :meth:`LightObserver.configured`."""
        if cause is Cause.LIGHT:
            self._node.get_logger().info(
                f'light {light.source} was changed: {configuration.describe(names)}')
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

    def restored(self, light: Light, success: bool, message: str) -> None:
        """See :meth:`LightObserver.restored`."""
        logger = self._node.get_logger()
        if success:
            logger.info(f'light {light.source} configured: {message}')
        else:
            logger.error(f'light {light.source} not configured: {message}')
        self._changed()

    def setpoint_failed(self, light: Light, message: str) -> None:
        """See :meth:`LightObserver.setpoint_failed`."""
        self._node.get_logger().warning(
            f'~/cmd/brightness: {message}', throttle_duration_sec=5.0)

    def _fit(self, period: float = 0.0) -> None:
        """
        Show in the descriptor what strobe periods the light reports to be possible.

        :param period: what it also has to have room for, s: some lights report more.
        """
        name = 'strobe_period'
        value = self._node.get_parameter_or(name).value
        if value is None:
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
