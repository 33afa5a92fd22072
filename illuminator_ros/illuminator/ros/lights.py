# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The lights of a link and their nodes."""

from __future__ import annotations

from collections.abc import Set
import logging
import math

from std_msgs.msg import Bool
from std_srvs.srv import SetBool

from . import parameters
from .light_node import LightNode
from .. import events
from ..client import enable_all, IlluminatorClient
from ..light import Light
from ...mavlink.command_sender import CommandSender
from ...mavlink.messages import Address
from ...payload.device_events import DeviceConnected
from ...payload.requests import Done, Result
from ...ros.device_nodes import DeviceNodes
from ...ros.node import Answer, CommandTopic, Entity, RequestService, SWITCH_QOS
from ...ros.parameters import ChangeableParameters, Values
from ...ros.payload import BridgeContext, RosPayload, ServedPayload, ShutdownReport
from ...ros.transforms import TransformPublisher

ENABLE_ALL = Entity(
    'enable_all', SetBool, 'first node only: switch all connected lights; the answer names each '
    'outcome, and is `true` if all succeeded')
CMD_ENABLE_ALL = Entity(
    'cmd/enable_all', Bool, 'the same as the service `~/enable_all`', SWITCH_QOS)
# s from the first light to the warnings on unused names: lights that start together are heard by
# then.
NAMES_DELAY = 10.0


class Lights(ServedPayload):
    """
    Gives each light on the link a node. All methods but :meth:`close` are for the link's thread.

    :raises ParameterError: if a parameter is wrong.
    """

    def __init__(self, client: IlluminatorClient, context: BridgeContext) -> None:
        self._client = client
        self._context = context
        self._selection = parameters.Selection(context.values)
        self._names = parameters.NodeNames(context.values, context.node.get_name())
        geometry = parameters.BeamGeometry.of(context.values)
        limits = client.settings.limits
        transforms = TransformPublisher.of(context.node, context.values, context.log)
        self._nodes = DeviceNodes[Address, LightNode](
            context, 'light', LightNode(
                context.node, context, context.log, client, geometry, limits,
                services=(RequestService(ENABLE_ALL, self._enable_all),),
                commands=(CommandTopic(CMD_ENABLE_ALL, self._switch_all),),
                changeable=ChangeableParameters(
                    context.node, parameters.LIGHT_PARAMETERS, context.values,
                    check=self._check_parameters, change=self._change_parameters),
                transforms=transforms),
            lambda node, log: LightNode(node, context, log, client, geometry.declare(node), limits,
                                        transforms=transforms),
            LightNode.bind)
        if 0.0 < (limit := context.values['max_brightness']) < 1.0:
            context.log.warning(
                f'max_brightness is {limit:g} %: it is a percentage, not a fraction')
        self._second_reported = False
        self._names_due = math.inf
        client.events.subscribe(self._handle)
        client.mount_moved.subscribe(self._mount_moved)

    def _mount_moved(self, system: int) -> None:
        for node in self._nodes:
            if node.address and node.address.system == system:
                node.mount_moved()

    def _handle(self, event: events.LightEvent) -> None:
        if isinstance(event, events.LightRestarted):
            # Its sequence numbers have restarted, which is not a loss.
            self._context.link.lines.reset_loss(event.key)
        if not self._nodes.handle(event) and isinstance(
                event, DeviceConnected | events.StatusReceived):
            self._serve(event.key)

    def _serve(self, address: Address) -> None:
        """Give a light a node: the first node, or a node of its own."""
        now = self._context.link.clock()
        nodes, selected = self._nodes, self._selection.is_target(address)
        if selected and nodes.first_is_free:
            if warning := self._names.unused_name(address):
                self._context.log.warning(warning)
            self._names_due = now + NAMES_DELAY
            nodes.bind(nodes.first, address, now)
        elif (nodes.serve(address, self._names.node_name(address)) and selected
                and not self._second_reported):
            self._second_reported = True
            self._context.log.warning(
                f'a second light, {address}, was found; {nodes.first.source.node} serves '
                f'{nodes.first.address}. After a restart the order may differ: set '
                'target_system and target_component')

    # Parameters

    def _check_parameters(self, values: Values) -> None:
        """Check the values that parameters would have, in the executor's thread."""
        parameters.settings(values)
        parameters.check_not_loosened(values, self._context.values)

    def _change_parameters(self, values: Values, now: float) -> None:
        """Take parameters that were set, in the link's thread."""
        self._client.change_settings(parameters.settings(values), now)
        for node in {self._nodes.first, *self._nodes}:
            node.limits_changed()

    # Requests to all lights

    def _enable_all(self, request: SetBool.Request, now: float, answer: Answer) -> None:
        self._switch(request.data, now,
                     lambda result, now: answer(result.success, result.message))

    def _switch_all(self, on: bool, now: float) -> None:
        def done(result: Result, now: float) -> None:
            if not (result.success or result.superseded):
                self._context.log.warning(f'~/cmd/enable_all: {result.message}', 'cmd/enable_all')

        self._switch(on, now, done, is_call=False)

    def _switch(self, on: bool, now: float, done: Done, *, is_call: bool = True) -> None:
        if lights := self._client.lights_by_address:
            enable_all(lights, on, now, done, name=self._name_of, detail='enable_all',
                       is_call=is_call)
        else:
            done(Result(False, self._nodes.first.absence(now)), now)

    def _name_of(self, light: Light) -> str:
        node = self._nodes.get(light.address)
        return f'{node.name} ({light.address})' if node else str(light.address)

    # The bridge's calls

    def poll(self, now: float) -> None:
        """See :meth:`ServedPayload.poll`."""
        self._nodes.poll(now)
        if now >= self._names_due:
            self._names_due = math.inf
            for warning in self._names.unused_names(self._client.lights):
                self._context.log.warning(warning)
        for node in self._nodes:
            node.poll()

    def further_parameters(self, name: str) -> Set[str] | None:
        """See :meth:`ServedPayload.further_parameters`."""
        return parameters.OF_FURTHER_LIGHTS if self._names.may_name(name) else None

    def shut_down(self, now: float, report: ShutdownReport) -> None:
        """See :meth:`ServedPayload.shut_down`: switch all off, or name the lights that stay on."""
        if not self._context.values['off_on_shutdown']:
            for light in self._client.lights_by_address:
                if light.may_be_on(now):
                    known = light.twin.status and light.twin.status.enabled
                    report(light.address, logging.WARNING,
                           f'light {light.address} {"is" if known else "may be"} left on')
            return

        def take(light: Light, result: Result, now: float) -> None:
            if result.success:
                report(light.address, logging.INFO,
                       f'light {light.address} is off: {result.message}')
            else:
                report(light.address, logging.ERROR if result.permanent else None,
                       f'light {light.address} may still be on: '
                       f'{result.message or "no confirmation in time"}')

        self._client.switch_off_finally(now, take)

    def close(self) -> None:
        """See :meth:`ServedPayload.close`."""
        for node in {self._nodes.first, *self._nodes}:
            node.close()


def _make_client(commands: CommandSender, values: Values) -> IlluminatorClient:
    return IlluminatorClient(
        commands, parameters.settings(values), wanted=parameters.Selection(values).is_served,
        needs_mounts=bool(
            values['beam_range'] or values['mounted_on'] or values['publish_tf']))


ILLUMINATOR = RosPayload(
    'illuminator', _make_client, Lights, parameters.LIGHT_PARAMETERS,
    parameters.DEVICE_PARAMETERS,
    summary='a MAVLink illuminator (searchlight, torch, strobe)', examples=(
        'ros2 service call /illuminator/enable std_srvs/srv/SetBool "{data: true}"',
        'ros2 param set /illuminator brightness 60'),
    mavlink_version=2)
