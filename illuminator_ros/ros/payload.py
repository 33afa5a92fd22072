# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The ROS half of a payload, as the bridge runs it."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Set
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from rclpy.node import Node

from .diagnostics_publisher import DiagnosticsPublisher
from .node_manager import NodeManager
from .parameters import ParameterSpec, Values
from .throttled_log import LogForwarder, NodeLog
from ..mavlink.command_sender import CommandSender
from ..mavlink.component import Payload
from ..mavlink.link import Link

# Takes a device's key, a severity (logging) and a line on its end. With None for the severity the
# bridge waits for the device: if no other line replaces this one in time, it is an error.
ShutdownReport = Callable[[Hashable, int | None, str], None]


class BridgeContext(NamedTuple):
    """
    The services that the bridge offers to the ROS half of one payload.

    :param node: the payload's own node.
    :param frame_log: shows the frames of a device in the log of its node.
    :param nodes: makes nodes of further devices.
    :param values: of the read-only parameters of that node, without those of the link.
    :param check_diagnostics: checks the levels at once; callable from any thread.
    """

    node: Node
    link: Link
    log: NodeLog
    frame_log: LogForwarder
    nodes: NodeManager
    diagnostics: DiagnosticsPublisher
    values: Values
    check_diagnostics: Callable[[], None]


class ServedPayload:
    """A payload that is served. All but :meth:`close` runs in the link's thread."""

    def poll(self, now: float) -> None:
        """Do what is due; called a few times a second."""

    def further_parameters(self, name: str) -> Set[str] | None:
        """
        Return the parameters of the node of a further device.

        :param name: of the node, without namespace.
        :return: their names; None if no node of a further device may have this name.
        """
        return None

    def shut_down(self, now: float, report: ShutdownReport) -> None:
        """
        Bring devices into their final state, because the bridge ends.

        The component has been closed, see :meth:`~..mavlink.component.Component.close`.
        """

    def close(self) -> None:
        """Remove data that other programs would go on to show, before the nodes are destroyed."""


@dataclass(frozen=True)
class RosPayload:
    """
    The ROS half of one kind of payload.

    :param node_name: the default name of its first node.
    :param parameters: the read-only ones of that node, beside those of the link.
    :param device_parameters: those that may be set at any time; for ``--help``.
    :param make_client: returns the MAVLink side, given the command sender and the parameters; may
        raise :class:`~.parameters.ParameterError`.
    :param serve: serves devices with nodes, given the client; may raise it, too.
    :param summary: the device, for ``--help``.
    :param examples: commands, for ``--help``.
    :param link_defaults: defaults of the link's parameters where it is the first payload.
    :param devices: the sets of kinds of components that show one of its devices, see
        :class:`~..mavlink.url.AutoUrl`; by default the device of its
        :class:`~..payload.payload_type.PayloadType`.
    :param mavlink_version: the version that its devices need, 1 or 2; None for any.
    """

    node_name: str
    make_client: Callable[[CommandSender, Values], Payload]
    # Untyped: the client is the one that make_client has returned.
    serve: Callable[[Any, BridgeContext], ServedPayload]
    parameters: tuple[ParameterSpec, ...] = ()
    device_parameters: tuple[ParameterSpec, ...] = ()
    summary: str = ''
    examples: tuple[str, ...] = ()
    link_defaults: Values = field(default_factory=dict)
    devices: tuple[frozenset[str], ...] = ()
    mavlink_version: int | None = None

    @property
    def all_link_defaults(self) -> Values:
        """Return :attr:`link_defaults` with the version that is needed."""
        version = {'mavlink_version': self.mavlink_version} if self.mavlink_version else {}
        return {**self.link_defaults, **version}
