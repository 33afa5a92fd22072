# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The interface of the node of one gimbal."""

from __future__ import annotations

from collections.abc import Callable
import functools
from typing import Any, TypeVar

from geometry_msgs.msg import QuaternionStamped, Vector3Stamped
from rclpy.node import Node
from sensor_msgs.msg import NavSatFix
from std_msgs.msg import Bool, Header, String
from std_srvs.srv import SetBool, Trigger

from . import conversions
from .diagnostics import controller, NO_GEOID, reports, why_no_gimbal
from .target import ON_TARGET, ROI, TargetPublisher
from .. import events
from ..client import GimbalClient
from ..commands import Attitude, Control, Move, NEUTRAL, Rates, RETRACT, YAW_LOCKS
from ..gimbal import Gimbal
from ...geometry.mount_attitude import YawFrame
from ...mavlink.dialect import flag_names, mavlink
from ...payload.command_sources import DEFAULT
from ...payload.messages import GeoPoint
from ...payload.requests import Done, Result
from ...ros import node as ros_node
from ...ros.command_sources import prefixes, release_services, SOURCE
from ...ros.conversions import quaternion_message
from ...ros.device_nodes import publish_event
from ...ros.diagnostics_publisher import DiagnosticsSource, MakeReports
from ...ros.node import Entity
from ...ros.parameter_services import ParameterServices
from ...ros.parameters import ChangeableParameters
from ...ros.payload import BridgeContext
from ...ros.qos import STREAM_QOS
from ...ros.throttled_log import NodeLog
from ...ros.transforms import TransformPublisher

T = TypeVar('T')

PUBLICATIONS = (
    Entity('connected', Bool, 'manager and device are heard'),
    Entity('attitude', QuaternionStamped,
           'axes ahead, left and up (FLU); `frame_id` names the yaw frame', STREAM_QOS),
    Entity('angular_velocity', Vector3Stamped, 'rates of roll, pitch and yaw, rad/s; not '
           'published where the device does not measure them', STREAM_QOS),
    Entity('angles', Vector3Stamped, 'roll, pitch, yaw of the attitude, rad', STREAM_QOS),
    Entity('yaw_lock', Bool, 'yaw is held against the earth'),
    Entity('in_control', Bool, 'this node has primary control'),
    Entity('controller', String,
           'the components in control, such as `primary 1/195, secondary none`, or `unknown`'),
    ON_TARGET,
    ROI,
)
# The request of each service to the gimbal; its message is the second argument.
REQUESTS: dict[Entity, Callable[[Gimbal, Any, float, Done], None]] = {
    Entity('take_control', Trigger, 'take primary control'):
        lambda gimbal, _, *asked: gimbal.take_control(*asked),
    Entity('release_control', Trigger, 'stop, and release all control that this node has once '
           'the gimbal stands'):
        lambda gimbal, _, *asked: gimbal.release_control(*asked),
    Entity('neutral', Trigger, 'turn to the neutral position'):
        lambda gimbal, _, *asked: gimbal.request(NEUTRAL, *asked),
    Entity('retract', Trigger, 'turn to the retracted position'):
        lambda gimbal, _, *asked: gimbal.request(RETRACT, *asked),
    Entity('clear_roi', Trigger, 'no longer point at a place'):
        lambda gimbal, _, *asked: gimbal.request(None, *asked),
    Entity('set_yaw_lock', SetBool, 'stop, and hold yaw against the earth or let it follow the '
           'vehicle; refused where the gimbal lacks it'):
        lambda gimbal, message, *asked: gimbal.request(YAW_LOCKS[message.data], *asked),
}
CMD_ATTITUDE = Entity(
    'cmd/attitude', QuaternionStamped,
    'an attitude; `frame_id` names the yaw frame, any other is refused', ros_node.SWITCH_QOS)
CMD_ANGLES = Entity(
    'cmd/angles', Vector3Stamped, 'the same as roll, pitch and yaw, rad; NaN leaves an axis where '
    'it was sent last, else where it is. Refused beyond pi, and pitch beyond pi/2',
    ros_node.SWITCH_QOS)
CMD_RATE = Entity(
    'cmd/rate', Vector3Stamped, 'rates of roll, pitch and yaw, rad/s; `frame_id` is not read. '
    'Refused beyond 2 pi. When no message comes for `setpoint_timeout`, zero is sent until an '
    'attitude shows that the gimbal stands')
CMD_ROI = Entity(
    'cmd/roi', NavSatFix, 'a place to point at (MAV_CMD_DO_SET_ROI_LOCATION); its altitude is '
    'above the ellipsoid. Set `geoid_separation`: until then the diagnostics warn while the '
    'gimbal points at a place', ros_node.SWITCH_QOS)
FIX = Entity(
    'fix', NavSatFix, 'position of the vehicle, for places, where its autopilot sends none; '
    'ignored without a fix')


class GimbalNode:
    """
    Serves one gimbal with a node; all methods are for the link's thread.

    :param transforms: publishes the frame of the gimbal, None for no frame.
    :param changeable: the parameters of the node that may be set while it runs.
    :ivar key: of the gimbal, None while there is none.
    """

    def __init__(
        self, node: Node, context: BridgeContext, log: NodeLog, client: GimbalClient,
        why_none: Callable[[], str], transforms: TransformPublisher | None = None,
        changeable: ChangeableParameters | None = None,
    ) -> None:
        self.key: events.GimbalKey | None = None
        self._context = context
        self._log = log
        self._client = client
        self._why_none = why_none
        self._transforms = transforms
        self._frame = node.get_name()
        self._frames = conversions.Frames.of(context.values)
        self._clock = node.get_clock()
        self._started = context.link.clock()
        self._yaw_lock: bool | None = None
        self._errors = 0
        sources = client.settings.sources
        self._interface = ros_node.NodeEntities(
            node, context.link, log, publications=(*PUBLICATIONS, *([SOURCE] if sources else [])),
            services=(
                *(ros_node.RequestService(one, functools.partial(self._request, one))
                  for one in REQUESTS),
                *release_services(sources, self._release)),
            commands=(self._fix_topic(), *(topic for way in prefixes(sources).items()
                                           for topic in self._command_topics(*way))))
        ParameterServices(node, context.link, log, changeable=changeable)
        if sources:
            self._interface.publish('source', '')
        self._interface.publish('connected', False)
        self._publish_control(None, False)
        self._target = TargetPublisher(
            node, self._interface, client, context, self._frame if transforms else '')
        self.source = DiagnosticsSource(node.get_fully_qualified_name(), self._take_snapshot)

    def bind(self, key: events.GimbalKey, now: float) -> None:
        """Serve a gimbal from now on, and publish its known state."""
        self.key = key
        self._context.frame_log.assign(key.address, self._log)
        if (gimbal := self._gimbal()) is not None:
            snapshot = gimbal.snapshot(now)
            self._interface.publish('connected', not snapshot.unreachable)
            self._publish_control(snapshot.control, snapshot.in_control)
            if snapshot.holder is not None:
                self._interface.publish('source', snapshot.holder)
            for other in snapshot.managers[1:]:
                self.handle(events.SecondManager(key, snapshot.managers[0], other))

    def release(self) -> None:
        """Serve the gimbal no longer, since it was forgotten."""
        if self.key:
            self._context.frame_log.assign(self.key.address, None)
        self.key = None
        self._target.update(None, self._context.link.clock())

    def poll(self, now: float) -> None:
        """Follow what changes without an event: the age of the attitude and of the position."""
        self._target.update(self._gimbal(), now)

    def absence(self, now: float) -> str:
        """Return why there is no gimbal, for people."""
        link = self._context.diagnostics.snapshot(now)
        return 'no gimbal connected: ' + why_no_gimbal(
            link, self._heard(now), self._client.managers_without_id(now), self._why_none())

    def _heard(self, now: float) -> dict[events.GimbalKey, str]:
        """Return the announced gimbals, each with the reason why it is not connected."""
        return {key: gimbal.reports.unreachable(now)
                for key, gimbal in self._client.gimbals.items()}

    def _gimbal(self) -> Gimbal | None:
        return self._client.gimbals.get(self.key) if self.key else None

    # Events

    def handle(self, event: events.GimbalEvent) -> None:
        """Publish an event of the gimbal."""
        self.poll(self._context.link.clock())
        name, warn = f'gimbal {event.key}', self._log.warning
        match event:
            case events.AttitudeReceived():
                self._publish_attitude(event)
                return
            case events.ControlChanged(before=before, after=after):
                if after is not None and event.was_lost:
                    reason = (f'lost: {after.primary} has taken primary control' if after.primary
                              else 'ended: no component has primary control')
                    turns = ', and it may still turn at a rate of this node' * event.may_turn
                    warn(f'control of {name} {reason}{turns}; setpoints have stopped, '
                         '~/take_control takes it back', 'control')
                elif after is not None and after != before:
                    self._log.info(f'control of {name}: {after}', 'control')
                self._publish_control(after, event.ours)
            case events.RateStopped(stands=True):
                self._log.info(f'{name} stands', 'stop')
            case events.RateStopped(turns=turns):
                warn(f'{name} {"still turns" if turns else "may still turn: no attitude comes"}, '
                     'although its rate has ended: a rate of zero is sent until an attitude shows '
                     'that it stands', 'stop')
            case events.SecondManager(manager=manager, other=other):
                warn(f'manager {other} announces {name} too: only {manager} is used, but both may '
                     'move it; disable one', 'manager')
            case events.ManagerChanged(before=before, after=after):
                warn(f'{name} is used through manager {after} from now on: {before} is lost',
                     'manager')
            case events.AutomaticTakeFailed(message=message):
                warn(f'auto_take_control: {message}', 'control')
        publish_event(event, 'gimbal', self._log, self._interface)
        self._context.check_diagnostics()

    def _publish_control(self, control: Control | None, ours: bool) -> None:
        self._interface.publish('in_control', ours)
        self._interface.publish('controller', controller(control))

    def _publish_attitude(self, event: events.AttitudeReceived) -> None:
        publish, attitude = self._interface.publish_to_subscribers, event.attitude
        if attitude is not None:
            header = Header(stamp=self._clock.now().to_msg(),
                            frame_id=self._frames.name(attitude.frame))
            rotation, rates = attitude.rotation, attitude.rates
            publish('attitude', lambda: quaternion_message(header, rotation))
            # A frame has one parent, whatever the yaw is relative to (REP 105).
            if self._transforms and (level := attitude.seen_from(YawFrame.VEHICLE)):
                self._transforms.move(self._frames.vehicle, self._frame, level, header.stamp)
            publish('angles', lambda: conversions.vector_message(header, rotation.euler()))
            if rates is not None:
                publish('angular_velocity', lambda: conversions.vector_message(header, rates))
        lock = bool(event.flags & mavlink.GIMBAL_DEVICE_FLAGS_YAW_LOCK)
        if lock is not self._yaw_lock:
            self._yaw_lock = lock
            self._interface.publish('yaw_lock', lock)
        if event.errors != self._errors:
            log = self._log.warning if event.errors & ~self._errors else self._log.info
            self._errors = event.errors
            names = ', '.join(flag_names('GIMBAL_DEVICE_ERROR_FLAGS', event.errors)) or 'none'
            log(f'gimbal {event.key}: failure flags: {names}', 'flags')
            self._context.check_diagnostics()

    # Requests

    def _release(self, source: str, now: float, answer: ros_node.Answer) -> None:
        if gimbal := self._gimbal():
            answer(True, f'held by {gimbal.release(source, now) or "no source"}')
        else:
            answer(False, self.absence(now))

    def _request(
        self, service: Entity, message: Any, now: float, answer: ros_node.Answer,
    ) -> None:
        gimbal = self._gimbal()
        if gimbal is None:
            answer(False, self.absence(now))
            return
        # All sources need control, so no source must claim the gimbal for it.
        refusal = gimbal.requests.refusal(DEFAULT) if service.name == 'release_control' else ''
        if refusal:
            answer(False, refusal)
        else:
            REQUESTS[service](gimbal, message, now, lambda result, now: answer(
                result.success, result.message))
            self.poll(now)

    # Setpoints

    def _command_topics(self, source: str, prefix: str) -> tuple[ros_node.AnyCommandTopic, ...]:
        separation: float = self._context.values['geoid_separation']

        def topic(
            plain: Entity, send: Callable[..., None], read: Callable[[Any], T],
        ) -> ros_node.CommandTopic[T]:
            endpoint = plain.of(prefix)

            def receive(value: T, now: float) -> None:
                if (gimbal := self._gimbal()) is None:
                    self._refused(endpoint.name, self.absence(now))
                else:
                    send(gimbal, value, now, functools.partial(sent, value), source=source)
                    self.poll(now)

            def sent(value: T, result: Result, now: float) -> None:
                if not (result.success or result.superseded):
                    self._refused(endpoint.name, result.message)
                elif result.success and isinstance(value, GeoPoint) and not (
                        self._target.geoid_is_known):
                    # Once: the condition never ends.
                    self._log.write_conditions([NO_GEOID], 'geoid')

            return ros_node.CommandTopic(endpoint, receive, read)

        def move(gimbal: Gimbal, value: Move, now: float, done: Done, *, source: str) -> None:
            gimbal.request(value, now, done, is_call=False, source=source)

        return (
            topic(CMD_ATTITUDE, move,
                  lambda message: Attitude(*self._frames.read_attitude(message))),
            topic(CMD_ANGLES, lambda gimbal, value, *rest, **source: gimbal.set_angles(
                *value, *rest, **source), self._frames.read_angles),
            topic(CMD_RATE, move, lambda message: Rates(conversions.read_rates(message))),
            topic(CMD_ROI, move, lambda message: conversions.read_place(message, separation)))

    def _fix_topic(self) -> ros_node.AnyCommandTopic:
        separation: float = self._context.values['geoid_separation']

        def receive(position: GeoPoint, now: float) -> None:
            if self.key:
                self._client.vehicle(self.key).position.set(position, now)

        return ros_node.CommandTopic(
            FIX, receive, lambda message: conversions.read_fix(message, separation))

    def _refused(self, topic: str, reason: str) -> None:
        if reason:
            self._log.stream_failed(f'~/{topic}: ignored: {reason}', topic)

    # Diagnostics

    def _take_snapshot(self, now: float) -> MakeReports:
        gimbal = self._gimbal()
        return functools.partial(
            reports, gimbal=gimbal.snapshot(now) if gimbal else None,
            heard=self._heard(now), without_id=self._client.managers_without_id(now),
            known=self._why_none(),
            limit_reached=self._client.discovery.limit_reached,
            interval=self._client.settings.attitude_interval, started=self._started,
            geoid_is_known=self._target.geoid_is_known, off_target=self._target.off_target)
