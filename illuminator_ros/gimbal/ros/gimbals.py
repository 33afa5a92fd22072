# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The gimbals of a link and their nodes."""

from __future__ import annotations

from collections.abc import Callable, Set
import functools
import logging
import re

from .conversions import FRAME_PARAMETERS
from .gimbal_node import GimbalNode
from .target import TARGET_TOLERANCE
from ..client import GimbalClient
from ..events import GimbalEvent, GimbalKey
from ..gimbal import GimbalSettings
from ..setpoint_mixer import STEP_LIMIT
from ...mavlink.search.component_kinds import AUTOPILOT
from ...payload.device_events import DeviceConnected
from ...payload.requests import Result
from ...ros.command_sources import SOURCE_PARAMETERS, source_settings
from ...ros.conversions import GEOID_SEPARATION
from ...ros.device_nodes import DeviceNodes
from ...ros.parameters import by_name, ChangeableParameters, ParameterSpec, Values
from ...ros.payload import BridgeContext, RosPayload, ServedPayload, ShutdownReport
from ...ros.transforms import PUBLISH_TF, TransformPublisher

GIMBAL_PARAMETERS = (
    ParameterSpec('gimbal_device_id', 0, 'gimbal device id of the gimbal to serve; 0 = the first',
                  low=0, high=255),
    ParameterSpec('auto_take_control', False,
                  'take control of a gimbal that no component controls when it connects'),
    ParameterSpec('setpoint_timeout', 0.5, 'silence of ~/cmd/rate after which zero is sent', 's',
                  STEP_LIMIT, 60.0, restricts=True, changeable=True),
    TARGET_TOLERANCE,
    *FRAME_PARAMETERS,
    PUBLISH_TF,
    GEOID_SEPARATION,
    ParameterSpec('attitude_interval', 0.0, "period of the attitude; 0 = the device's own, or "
                  '0.2 s of a device that sends none', 's', 0.0, 3600.0),
    *SOURCE_PARAMETERS,
)


def settings(values: Values) -> GimbalSettings:
    """
    Return the settings of the gimbals.

    :raises ParameterError: if the sources are wrong.
    """
    return by_name(GimbalSettings, values, device_id=values['gimbal_device_id'],
                   sources=source_settings(values))


class Gimbals(ServedPayload):
    """
    Gives each gimbal on the link a node; for the link's thread.

    :param why_none: returns a reason in this process why there is no gimbal, '' if there is none.
    :raises ParameterError: if a parameter is wrong.
    """

    def __init__(
        self, client: GimbalClient, context: BridgeContext,
        why_none: Callable[[], str] = lambda: '',
    ) -> None:
        self._client = client
        self._context = context
        transforms = TransformPublisher.of(context.node, context.values, context.log)
        self._nodes = DeviceNodes[GimbalKey, GimbalNode](
            context, 'gimbal', GimbalNode(
                context.node, context, context.log, client, why_none, transforms,
                ChangeableParameters(
                    context.node, GIMBAL_PARAMETERS, context.values, check=settings,
                    change=self._change_parameters)),
            lambda node, log: GimbalNode(node, context, log, client, why_none, transforms),
            GimbalNode.bind)
        client.events.subscribe(self._handle)

    def _change_parameters(self, values: Values, now: float) -> None:
        """Take parameters that were set."""
        self._client.change_settings(settings(values), now)

    def _handle(self, event: GimbalEvent) -> None:
        if not self._nodes.handle(event) and isinstance(event, DeviceConnected):
            self._serve(event)

    def _serve(self, event: DeviceConnected[GimbalKey]) -> None:
        """Give a gimbal a node: the first node, or a new one."""
        key, nodes = event.key, self._nodes
        if nodes.first_is_free and self._context.values['gimbal_device_id'] in (0, key.device_id):
            nodes.bind(nodes.first, key, self._context.link.clock())
            nodes.first.handle(event)
        else:
            name = f'{self._context.node.get_name()}_{key.address.system}_{key.device_id}'
            if nodes.has_name(name):
                # Another manager has a gimbal with this number.
                name += f'_{key.address.component}'
            nodes.serve(key, name)

    def further_parameters(self, name: str) -> Set[str] | None:
        """See :meth:`ServedPayload.further_parameters`: they have none of their own."""
        pattern = rf'{self._context.node.get_name()}(_[0-9]+){{2,3}}'
        return frozenset() if re.fullmatch(pattern, name) else None

    def poll(self, now: float) -> None:
        """See :meth:`ServedPayload.poll`."""
        self._nodes.poll(now)
        for node in self._nodes:
            node.poll(now)

    def shut_down(self, now: float, report: ShutdownReport) -> None:
        """See :meth:`ServedPayload.shut_down`: release all gimbals under our control."""
        def done(key: GimbalKey, result: Result, now: float) -> None:
            stands = result.success and not gimbals[key].setpoints.may_turn
            report(key, logging.INFO if stands else logging.ERROR,
                   f'gimbal {key}: {result.message}')

        gimbals = self._client.gimbals
        for gimbal in gimbals.values():
            if gimbal.has_any_control:
                turns = '; it may still turn' * gimbal.setpoints.may_turn
                report(gimbal.key, None, f'this node may still control gimbal {gimbal.key}: '
                                         f'no confirmation in time{turns}')
                gimbal.release_control(now, functools.partial(done, gimbal.key))


GIMBAL = RosPayload(
    'gimbal', lambda commands, values: GimbalClient(commands, settings(values)), Gimbals,
    GIMBAL_PARAMETERS, summary='a gimbal that a MAVLink gimbal manager controls', examples=(
        'ros2 service call /gimbal/take_control std_srvs/srv/Trigger',
        'ros2 topic pub -1 /gimbal/cmd/angles geometry_msgs/msg/Vector3Stamped '
        '"{header: {frame_id: base_link_stabilized}, vector: {y: 0.785, z: 0.524}}"'),
    devices=(frozenset({'gimbal manager'}), frozenset({'gimbal', AUTOPILOT})),
    mavlink_version=2)
