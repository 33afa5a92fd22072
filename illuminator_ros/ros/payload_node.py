# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The node of a payload, which is made before all else is imported."""

from __future__ import annotations

from typing import Any

from rcl_interfaces.msg import SetParametersResult
from rclpy.event_handler import PublisherEventCallbacks, SubscriptionEventCallbacks
from rclpy.node import Node
from rclpy.parameter import get_parameter_value, Parameter
from rclpy.publisher import Publisher

PARAMETER_EVENTS = '/parameter_events'


class PayloadNode(Node):
    """
    A node without rclpy's parameter services and QoS events.

    An executor would wait for an event of each publisher and subscription, which also take memory.

    :param first: the first node of the process. This one shares its context; its publisher of
        parameter events, since each event names its node; and its service of type descriptions,
        which takes 0.13 MB.
    :param options: as for rclpy's Node: namespace, parameter_overrides, context ...
    """

    # Untyped: rclpy's own signatures are long, and differ between its versions.
    def __init__(self, name: str, *, first: PayloadNode | None = None, **options: Any) -> None:
        self._events: Publisher | None = first._events if first else None
        if first:
            options |= {
                'context': first.context, 'use_global_arguments': False, 'parameter_overrides': [
                    Parameter('start_type_description_service', value=False)]}
        super().__init__(name, start_parameter_services=False, **options)

    def set_parameters_atomically(self, parameter_list: list[Parameter]) -> SetParametersResult:
        """
        See :meth:`Node.set_parameters_atomically`.

        A read-only parameter may be set to its value, as ``ros2 param load`` does with a dump.
        """
        changes = []
        for parameter in parameter_list:
            name = parameter.name
            if not self.has_parameter(name) or not self.describe_parameter(name).read_only:
                changes.append(parameter)
            elif not _is_value(parameter, self.get_parameter(name).value):
                return SetParametersResult(successful=False, reason=(
                    f'{name} is read-only: restart the node with -p {name}:=VALUE'))
        return super().set_parameters_atomically(changes)

    def create_publisher(self, *arguments: Any, **options: Any) -> Any:
        """See :meth:`Node.create_publisher`."""
        if PARAMETER_EVENTS in arguments and self._events is not None:
            return self._events
        options.setdefault(
            'event_callbacks', PublisherEventCallbacks(use_default_callbacks=False))
        publisher = super().create_publisher(*arguments, **options)
        if PARAMETER_EVENTS in arguments:
            self._events = publisher
        return publisher

    def create_subscription(self, *arguments: Any, **options: Any) -> Any:
        """See :meth:`Node.create_subscription`."""
        options.setdefault(
            'event_callbacks', SubscriptionEventCallbacks(use_default_callbacks=False))
        return super().create_subscription(*arguments, **options)


def _is_value(parameter: Parameter, value: object) -> bool:
    """Return whether a parameter has a value, or what ``ros2 param`` makes of its text."""
    # It reads the text 'off' as a boolean.
    return bool(parameter.value == value
                or parameter.get_parameter_value() == get_parameter_value(str(value)))
