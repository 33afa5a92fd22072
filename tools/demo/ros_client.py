# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""An ordinary ROS client: it uses the node's names and standard types, nothing else."""

from __future__ import annotations

from collections.abc import Callable
import functools
import math
import threading
from typing import Any, TypeVar

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import Vector3Stamped
from rcl_interfaces.srv import GetParameters, SetParametersAtomically
import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.parameter import Parameter
from rclpy.qos import DurabilityPolicy, qos_profile_sensor_data, QoSProfile
from std_msgs.msg import Bool, Float32
from std_srvs.srv import SetBool, Trigger

Result = TypeVar('Result')

STATE_QOS = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)


class Failed(Exception):
    """An event did not happen in time, or a request was not granted; the text says which."""


class RosClient:
    """Uses the services and topics of the nodes ``/illuminator`` and ``/gimbal``."""

    def __init__(self) -> None:
        rclpy.init()
        self._node = rclpy.create_node('demo')
        self._changed = threading.Condition()
        self._topics: dict[str, bool | float] = {}
        self._lamp: DiagnosticStatus | None = None
        for topic, type_ in (('connected', Bool), ('enabled', Bool), ('brightness', Float32),
                             ('strobe_period', Float32)):
            self._node.create_subscription(
                type_, f'/illuminator/{topic}', functools.partial(self._received, topic),
                STATE_QOS)
        self._node.create_subscription(DiagnosticArray, '/diagnostics', self._diagnosed, 10)
        self._angles: tuple[float, float] | None = None
        self._node.create_subscription(
            Vector3Stamped, '/gimbal/angles', self._turned, qos_profile_sensor_data)
        self._setpoints = self._node.create_publisher(Vector3Stamped, '/gimbal/cmd/angles', 10)
        self._executor = SingleThreadedExecutor()
        self._executor.add_node(self._node)
        self._thread = threading.Thread(target=self._executor.spin, daemon=True)
        self._thread.start()

    def _received(self, topic: str, message: Bool | Float32) -> None:
        with self._changed:
            self._topics[topic] = message.data
            self._changed.notify_all()

    def _turned(self, message: Vector3Stamped) -> None:
        with self._changed:
            self._angles = math.degrees(message.vector.y), math.degrees(message.vector.z)
            self._changed.notify_all()

    def _diagnosed(self, array: DiagnosticArray) -> None:
        with self._changed:
            for status in array.status:
                if status.name == 'illuminator: lamp':
                    self._lamp = status
            self._changed.notify_all()

    def wait(self, event: str, condition: Callable[[], Result | None],
             timeout: float = 10.0) -> Result:
        """
        Return the result of a condition on topics and diagnostics once it holds.

        :raises Failed: if it does not hold within ``timeout`` s.
        """
        with self._changed:
            result = self._changed.wait_for(condition, timeout)
        if not result:
            raise Failed(f'no {event} within {timeout:g} s')
        return result

    def topic(self, name: str) -> bool | float | None:
        """Return the last value of a topic, None before the first."""
        return self._topics.get(name)

    def lamp(self) -> DiagnosticStatus | None:
        """Return the last diagnostic status of the lamp, None before the first."""
        return self._lamp

    def call(self, type_: type[Any], service: str, request: object, timeout: float = 10.0) -> Any:
        """
        Call a service.

        :raises Failed: if it is not there or does not answer.
        """
        client = self._node.create_client(type_, service)
        try:
            if not client.wait_for_service(timeout):
                raise Failed(f'no service {service} within {timeout:g} s')
            answered = threading.Event()
            future = client.call_async(request)
            future.add_done_callback(lambda _: answered.set())
            if not answered.wait(timeout):
                raise Failed(f'no answer of {service} within {timeout:g} s')
            return future.result()
        finally:
            self._node.destroy_client(client)

    def request(self, type_: type[Any], service: str, request: object) -> str:
        """
        Call a service that says whether it succeeded, and return its message.

        :raises Failed: if it did not; see also :meth:`call`.
        """
        answer = self.call(type_, service, request)
        if not answer.success:
            raise Failed(answer.message)
        return str(answer.message)

    def enable(self, on: bool) -> str:
        """Call ``~/enable``, and return its message."""
        return self.request(SetBool, '/illuminator/enable', SetBool.Request(data=on))

    def set(self, **values: float) -> None:  # noqa: A003
        """
        Set parameters in one call.

        :raises Failed: if they are refused, with the reason.
        """
        parameters = [Parameter(name, value=value).to_parameter_msg()
                      for name, value in values.items()]
        result = self.call(
            SetParametersAtomically, '/illuminator/set_parameters_atomically',
            SetParametersAtomically.Request(parameters=parameters)).result
        if not result.successful:
            raise Failed(result.reason)

    def get(self, name: str) -> float:
        """Return the value of a floating-point parameter."""
        response = self.call(GetParameters, '/illuminator/get_parameters',
                             GetParameters.Request(names=[name]))
        return float(response.values[0].double_value)

    def take_control(self) -> str:
        """Call ``take_control`` of the gimbal, and return its message."""
        return self.request(Trigger, '/gimbal/take_control', Trigger.Request())

    def angles(self) -> tuple[float, float] | None:
        """Return the last pitch and yaw of the gimbal, degrees, None before the first."""
        return self._angles

    def turn(self, pitch: float, yaw: float) -> None:
        """Publish a setpoint of the gimbal, degrees: down and to the left are positive."""
        setpoint = Vector3Stamped()
        # Relative to the vehicle: the default of the parameter vehicle_frame.
        setpoint.header.frame_id = 'base_link_stabilized'
        setpoint.vector.y, setpoint.vector.z = math.radians(pitch), math.radians(yaw)
        self._setpoints.publish(setpoint)

    def close(self) -> None:
        """Leave the ROS graph."""
        self._executor.shutdown()
        self._thread.join(2.0)
        rclpy.try_shutdown()
