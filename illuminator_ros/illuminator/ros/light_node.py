# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The interface of the node of one light."""

from __future__ import annotations

from collections.abc import Callable, Mapping
import functools
import itertools

from rclpy.node import Node
from std_msgs.msg import Bool, Float32
from std_srvs.srv import SetBool, Trigger

from .beam import BeamFrame, BeamPublisher
from .diagnostics import hardware_id, LightsHeard, reports, shared_address, why_no_light
from .event_publisher import EventPublisher, PUBLICATIONS
from .parameters import BeamGeometry, device_parameters
from ..client import IlluminatorClient
from ..events import LightEvent
from ..light import Light
from ..model import checked, SafetyLimits
from ...geometry.rotation import Quaternion
from ...mavlink.errors import InvalidValue
from ...mavlink.messages import Address
from ...payload.requests import Result
from ...ros import node as ros_node
from ...ros.command_sources import prefixes, release_services, SOURCE
from ...ros.diagnostics import DISCOVERY_GRACE
from ...ros.diagnostics_publisher import DiagnosticsSource, MakeReports
from ...ros.parameter_services import ParameterServices
from ...ros.parameters import ChangeableParameters, DeviceParameters, ParameterError
from ...ros.payload import BridgeContext
from ...ros.throttled_log import NodeLog
from ...ros.transforms import TransformPublisher

ENABLE = ros_node.Entity('enable', SetBool, 'switch the light on or off')
REFRESH = ros_node.Entity('refresh', Trigger, 'request identity and status again')
CMD_ENABLE = ros_node.Entity(
    'cmd/enable', Bool, 'the same as the service, for joysticks and behaviour trees',
    ros_node.SWITCH_QOS)
CMD_BRIGHTNESS = ros_node.Entity(
    'cmd/brightness', Float32,
    'a stream of setpoints, %: the newest wins, with one command in flight, whatever the rate')
# Refreshes that may wait for their answers: each is two messages of the light.
MAX_REFRESHES = 16
# How many of the heard lights a node without a light names.
MAX_NAMED = 8


class LightNode:
    """
    Serves one light with a node: topics, services, parameters, diagnostics.

    All methods but :meth:`close` are for the link's thread.

    :param limits: those of the start, which the values given for parameters must observe.
    :param services: and ``commands``, of the node in addition to those of its light.
    :param changeable: the parameters of the node that may be set while it runs.
    :param transforms: publishes the frame of the beam, None for no frame.
    :ivar address: of the light, None while there is none.
    :raises ParameterError: if the value given for a parameter of the light is wrong.
    """

    def __init__(
        self, node: Node, context: BridgeContext, log: NodeLog, client: IlluminatorClient,
        geometry: BeamGeometry, limits: SafetyLimits, *,
        services: tuple[ros_node.RequestService, ...] = (),
        commands: tuple[ros_node.AnyCommandTopic, ...] = (),
        changeable: ChangeableParameters | None = None,
        transforms: TransformPublisher | None = None,
    ) -> None:
        self.name = node.get_name()
        self.address: Address | None = None
        self._context = context
        self._log = log
        self._client = client
        self._started = self._bound_at = context.link.clock()
        self._mount_reported = False
        self._hardware_id = ''
        parameters = DeviceParameters(node, device_parameters(limits), log)
        self._overrides = _checked(parameters.overrides(), limits)
        sources = client.settings.sources
        interface = ros_node.NodeEntities(
            node, context.link, log, publications=(*PUBLICATIONS, *([SOURCE] if sources else [])),
            services=(
                *(self._enable_service(*way) for way in prefixes(sources).items()),
                *release_services(sources, self._release),
                ros_node.RequestService(REFRESH, self._refresh, limit=MAX_REFRESHES),
                *services),
            commands=(
                *(topic for way in prefixes(sources).items()
                  for topic in self._command_topics(*way)),
                *commands))
        if sources:
            interface.publish('source', '')
        ParameterServices(
            node, context.link, log, parameters, checked, self._check_value, self._configure,
            changeable)
        self._publishers = EventPublisher(
            node, interface, parameters, log, limits=limits, frame_id=geometry.frame_id,
            check_diagnostics=context.check_diagnostics,
            sender_of=lambda light, command, first_param: (
                context.link.lines.forwarded_commands.sender(
                    light, command, context.link.clock(), first_param)))
        self._beam = (BeamPublisher(node, geometry, self._direction)
                      if geometry.beam_range else None)
        self._frame = (
            BeamFrame(transforms, geometry, f'{self.name}_beam', self._direction)
            if transforms else None)
        self.source = DiagnosticsSource(node.get_fully_qualified_name(), self._take_snapshot)

    def bind(self, address: Address, now: float) -> None:
        """Serve a light from now on, and publish its known state."""
        self.address, self._bound_at = address, now
        self._context.frame_log.assign(address, self._log)
        self.limits_changed()
        light = self._client.lights.get(address)
        if light is not None:
            for event in light.snapshot(now).events():
                self.handle(event)
            if self._overrides:
                light.require(self._overrides, now)

    def release(self) -> None:
        """Serve no light: it was forgotten."""
        if self.address:
            self._context.frame_log.assign(self.address, None)
        self.address = None

    def handle(self, event: LightEvent) -> None:
        """Publish an event of the light."""
        self._publishers.handle(event)
        if self._beam is not None:
            self._beam.handle(event)
        if self._frame is not None:
            self._frame.handle(event)

    def limits_changed(self) -> None:
        """Show the limits of the client in the descriptions of the parameters."""
        self._publishers.change_limits(self._client.settings.limits)

    def mount_moved(self) -> None:
        """Note that a gimbal of the vehicle has sent its attitude."""
        if self._beam is not None:
            self._beam.mount_moved()
        if self._frame is not None:
            self._frame.mount_moved()

    def _direction(self, device_id: int) -> Quaternion | None:
        return self.address and self._client.mounts.direction(
            self.address.system, device_id, self._context.link.clock())

    def _mount_absence(self, now: float) -> str:
        """Return why the beam is not shown, for people; '' if its gimbal was heard."""
        if (self._beam is None or not self._beam.device_id or self.address is None
                or now < self._bound_at + DISCOVERY_GRACE):
            return ''
        return self._client.mounts.absence(self.address.system, self._beam.device_id)

    def poll(self) -> None:
        """Do what is due."""
        if self._beam is not None:
            self._beam.poll()
        light, now = self._light(), self._context.link.clock()
        shared = shared_address(light.snapshot(now)) if light else ''
        self._log.write_conditions(filter(None, [shared]), 'shared address')
        if not self._mount_reported and (absence := self._mount_absence(now)):
            self._mount_reported = True
            self._log.warning(f'{absence}; set mounted_on')

    def close(self) -> None:
        """Remove the beam, after the link's thread has ended."""
        if self._beam is not None:
            self._beam.close()

    def absence(self, now: float) -> str:
        """Return why there is no light, for people."""
        why = why_no_light(self._context.diagnostics.snapshot(now), self._heard())
        return f'no light connected: {why}'

    def _light(self) -> Light | None:
        return self._client.lights.get(self.address) if self.address else None

    # Sources

    def _enable_service(self, source: str, prefix: str) -> ros_node.RequestService:
        def enable(request: SetBool.Request, now: float, answer: ros_node.Answer) -> None:
            if light := self._light_or_refusal(now, answer):
                light.enable(
                    request.data, now,
                    lambda result, now: answer(result.success, result.message),
                    detail=f'{prefix}service', source=source)

        return ros_node.RequestService(ENABLE.of(prefix), enable)

    def _release(self, source: str, now: float, answer: ros_node.Answer) -> None:
        if light := self._light_or_refusal(now, answer):
            answer(True, f'held by {light.release(source, now) or "no source"}')

    def _command_topics(
        self, source: str, prefix: str,
    ) -> tuple[ros_node.AnyCommandTopic, ros_node.AnyCommandTopic]:
        return (
            ros_node.CommandTopic(
                CMD_ENABLE.of(prefix), functools.partial(self._switch, source, prefix)),
            ros_node.CommandTopic(
                CMD_BRIGHTNESS.of(prefix), functools.partial(self._set_brightness, source, prefix),
                lambda message: checked('brightness', message.data)))

    # Requests

    def _light_or_refusal(self, now: float, answer: ros_node.Answer) -> Light | None:
        """Return the light; refuse the request if there is none."""
        light = self._light()
        if light is None:
            answer(False, self.absence(now))
        return light

    def _warning_on(self, topic: str) -> ros_node.Answer:
        """Return a function that logs an answer, since a topic has none."""
        return lambda success, message: self._log.stream_failed(f'~/{topic}: {message}', topic)

    def _switch(self, source: str, prefix: str, on: bool, now: float) -> None:
        warn = self._warning_on(f'{prefix}cmd/enable')

        def done(result: Result, now: float) -> None:
            light = self._light()
            # A source may repeat its request while a higher one holds the light.
            if not (result.success or result.superseded
                    or light and light.is_held_by_other(source)):
                warn(False, result.message)

        if light := self._light_or_refusal(now, warn):
            light.enable(
                on, now, done, detail=f'{prefix}topic', source=source, is_call=False)

    def _refresh(self, request: Trigger.Request, now: float, answer: ros_node.Answer) -> None:
        if light := self._light_or_refusal(now, answer):
            light.refresh(now, lambda result, now: answer(result.success, result.message))

    def _set_brightness(self, source: str, prefix: str, brightness: float, now: float) -> None:
        if light := self._light_or_refusal(now, self._warning_on(f'{prefix}cmd/brightness')):
            light.set_brightness(brightness, now, source=source)

    def _check_value(self, name: str, value: object) -> None:
        light = self._light()
        strobe_range = light.twin.strobe_range if light else None
        self._client.settings.limits.check(name, checked(name, value, strobe_range))

    def _configure(
        self, changes: Mapping[str, object], now: float, answer: Callable[[str], None],
    ) -> None:
        def done(result: Result, now: float) -> None:
            if result.note:
                self._log.info(f'light {self.address}: {result.note}', 'note')
            answer('' if result.success else result.message)

        if light := self._light_or_refusal(now, lambda success, message: answer(message)):
            light.configure(changes, now, done)

    # Diagnostics

    def _take_snapshot(self, now: float) -> MakeReports:
        light = self._light()
        snapshot = light.snapshot(now) if light else None
        if snapshot is not None and snapshot.identity_is_settled:
            # A light that sends its serial number late keeps the id it had.
            self._hardware_id = self._hardware_id or hardware_id(snapshot)
        return functools.partial(
            reports, light=snapshot, heard=self._heard(), hardware_id=self._hardware_id,
            started=self._started, mount_absence=self._mount_absence(now))

    def _heard(self) -> LightsHeard:
        lights, discovery = self._client.lights, self._client.discovery
        # Only a node without a light names them.
        some, unanswering = ((), ()) if self._light() else (
            tuple(itertools.islice(sorted(addresses), MAX_NAMED))
            for addresses in ({*lights, *discovery.ignored}, discovery.candidates))
        return LightsHeard(len(lights), some, unanswering, discovery.limit_reached)


def _checked(overrides: Mapping[str, object], limits: SafetyLimits) -> dict[str, float]:
    try:
        values: dict[str, float] = {
            name: checked(name, value) for name, value in overrides.items()}
        for name, value in values.items():
            limits.check(name, value)
        return values
    except InvalidValue as error:
        raise ParameterError(str(error)) from None
