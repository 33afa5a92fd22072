# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The node of the camera: topics, services, parameters."""

from __future__ import annotations

from collections.abc import Callable, Mapping
import functools
import logging
import math
from typing import Any

from builtin_interfaces.msg import Time
from geometry_msgs.msg import QuaternionStamped
from sensor_msgs.msg import NavSatFix, NavSatStatus
from std_msgs.msg import Bool, Header, UInt32
from std_srvs.srv import Trigger

from .diagnostics import (
    InputTopic,
    missing,
    reports,
    shared_topics,
    topics,
    why_no_camera,
    why_unused,
)
from .inputs import subscriptions
from ..client import CameraEvent, ImageTaken, RedEdgeClient
from ..conversions import fixed_mount, image_attitude, image_position, MountFrame, MountParent
from ..input_states import (
    CameraSettings,
    Input,
    InputState,
    PositionSource,
    Stamp,
)
from ..messages import CameraFeedback, Shot
from ...geometry.rotation import Vector
from ...mavlink.command_sender import CommandSender
from ...mavlink.dialect import mavlink
from ...ros.conversions import GEOID_SEPARATION, quaternion_message
from ...ros.device_nodes import ABSENCE_DELAY, publish_event
from ...ros.diagnostics_publisher import DiagnosticsSource, MakeReports
from ...ros.node import Answer, Entity, NodeEntities, RequestService
from ...ros.parameter_services import ParameterServices
from ...ros.parameters import (
    by_name,
    ChangeableParameters,
    DeviceParameters,
    given_parameters,
    ParameterError,
    ParameterSpec,
    Values,
)
from ...ros.payload import BridgeContext, RosPayload, ServedPayload
from ...ros.qos import STREAM_QOS
from ...ros.transforms import PUBLISH_TF, TransformPublisher

# The frame of ~/image/attitude: its axes point to east, north and up (REP-105).
EARTH_FRAME = 'map'
# s in which a publisher of ~/mount is discovered; shorter than the 5 s for which the camera keeps
# what it got before a restart of the node.
DISCOVERY_TIME = 2.0

# s between counts of the publishers of the inputs.
COUNT_INTERVAL = 1.0

PUBLICATIONS = (
    Entity('connected', Bool, "the camera's heartbeat is heard"),
    Entity('image/fix', NavSatFix, 'position of an image; its altitude is above the ellipsoid',
           STREAM_QOS),
    Entity('image/attitude', QuaternionStamped,
           'orientation of the camera in that image, in `map` (ENU)', STREAM_QOS),
    Entity('image/index', UInt32, 'its number, as the camera counts captures by MAVLink',
           STREAM_QOS),
)
PING = Entity('ping', Trigger, 'round trip through the camera; the message has the time in ms')
CAPTURES = {
    Entity('capture', Trigger, 'take an image'): Shot.SURVEY,
    Entity('capture_panel', Trigger, 'take an image of the calibration panel'): Shot.PANEL,
}
PARAMETERS = (
    ParameterSpec('position_source', 'raw', 'messages that carry the position: GPS_RAW_INT, or '
                  'GLOBAL_POSITION_INT with SYSTEM_TIME',
                  choices=tuple(source.value for source in PositionSource)),
    GEOID_SEPARATION,
    ParameterSpec('mount_frame', 'camera', 'the camera in ~/mount: x out of the lens and z to the '
                  'top of the image, or z out of the lens',
                  choices=tuple(frame.value for frame in MountFrame)),
    ParameterSpec('attitude_rate', 20.0, 'highest rate of attitudes', 'Hz', 1.0, 200.0,
                  changeable=True),
    # The camera uses received values for 5 s.
    ParameterSpec('position_timeout', 1.0, 'age at which position and velocity are stale', 's',
                  0.05, 5.0),
    ParameterSpec('attitude_timeout', 0.5, 'age at which attitude and mount are stale', 's',
                  0.02, 5.0),
    ParameterSpec('send_gps_status', False, "send the number of satellites to the camera's page"),
    ParameterSpec('heartbeat_timeout', 3.5, 'silence after which the camera is lost', 's', 1.1,
                  3600.0),
    ParameterSpec('frame_id', 'rededge', 'frame of ~/image/fix'),
    PUBLISH_TF,
)
MOUNT_PARAMETERS = tuple(
    ParameterSpec(f'mount_{name}', 0.0, f'{name} of a fixed camera in its own axes; 0 at first',
                  'degrees', -180.0, 180.0) for name in ('roll', 'pitch', 'yaw'))


class CameraNode(ServedPayload):
    """
    Serves the camera of a link; in the link's thread, except the constructor.

    :raises ParameterError: if a parameter is wrong.
    """

    def __init__(self, client: RedEdgeClient, context: BridgeContext) -> None:
        self._client = client
        self._context = context
        # Untyped: rclpy types it as a Clock, which lacks ``ros_time_is_active``.
        self._clock: Any = context.node.get_clock()
        self._started = context.link.clock()
        self._absence_due = self._started + ABSENCE_DELAY
        # The states of the inputs as they were logged.
        self._states: dict[Input, InputState] = {}
        self._geoid_is_known = GEOID_SEPARATION.name in given_parameters(context.node)
        self._topics = {one: context.node.resolve_topic_name(f'~/{one.value}') for one in Input}
        self._graph: dict[Input, InputTopic] = {}
        self._count_due = -math.inf
        self._interface = NodeEntities(
            context.node, context.link, context.log, publications=PUBLICATIONS,
            services=(
                RequestService(PING, self._ping),
                *(RequestService(one, self._capture(shot)) for one, shot in CAPTURES.items())),
            commands=subscriptions(context.node, context.link, client.feeder))
        self._interface.publish('connected', False)
        # The first NavSatFix imports numpy, which takes too long for the link's thread.
        NavSatFix()
        self._parameters = DeviceParameters(context.node, MOUNT_PARAMETERS, context.log)
        given = self._parameters.overrides()
        angles = {spec.name: spec.check(given.get(spec.name, spec.default))
                  for spec in MOUNT_PARAMETERS}
        self._parameters.show(angles)
        self._transforms = TransformPublisher.of(context.node, context.values, context.log)
        self._frame_due = self._started + DISCOVERY_TIME
        client.feeder.orientation.set_fixed_mount(
            _angles(angles), context.link.clock() + DISCOVERY_TIME)
        ParameterServices(
            context.node, context.link, context.log, self._parameters, configure=self._set_mount,
            changeable=ChangeableParameters(
                context.node, PARAMETERS, context.values, check=lambda values: None,
                change=self._change_parameters))
        context.diagnostics.add(DiagnosticsSource(
            context.node.get_fully_qualified_name(), self._take_snapshot))
        client.events.subscribe(self._handle)

    # Requests

    def _absence(self, now: float) -> str:
        """Return why no camera was ever heard, for people; '' if one was."""
        if self._client.snapshot(now).address is not None:
            return ''
        return f'no camera connected: {why_no_camera(self._context.diagnostics.snapshot(now))}'

    def _ping(self, request: Trigger.Request, now: float, answer: Answer) -> None:
        if failure := self._context.diagnostics.snapshot(now).failure:
            answer(False, failure)
        else:
            self._client.ping(now, answer)

    def _capture(self, shot: Shot) -> Callable[[Trigger.Request, float, Answer], None]:
        def capture(request: Trigger.Request, now: float, answer: Answer) -> None:
            before = self._lacking(now)

            def done(success: bool, message: str) -> None:
                # The camera may have taken the image at any time between.
                lacking = dict.fromkeys((*before, *self._lacking(self._context.link.clock())))
                if success and lacking:
                    message += f', without {", ".join(lacking)}'
                answer(success, message)

            if absence := self._absence(now):
                answer(False, absence)
            else:
                self._client.capture(shot, now, done)

        return capture

    def _lacking(self, now: float) -> list[str]:
        """Return the state that the camera does not get, for people."""
        feeder = self._client.feeder.snapshot(now)
        pair = [f'attitude and mount ({feeder.no_pair})'] if feeder.no_pair else []
        return [*map(topics, feeder.lacking), *pair]

    def _set_mount(
        self, changes: Mapping[str, object], now: float, answer: Callable[[str], None],
    ) -> None:
        orientation = self._client.feeder.orientation
        if orientation.fixed_mount is None:
            answer('the mount is not fixed: ~/mount has or had a publisher; restart the node for '
                   'a fixed one')
            return
        specs = self._parameters.specs
        angles = {name: specs[name].check(changes.get(name, angle))
                  for name, angle in zip(specs, orientation.fixed_mount, strict=True)}
        orientation.set_fixed_mount(_angles(angles), now)
        self._frame_due = now
        self._parameters.show(angles)
        answer('')

    def _change_parameters(self, values: Values, now: float) -> None:
        """Take parameters that were set."""
        self._client.feeder.orientation.change_rate(values['attitude_rate'], now)

    def poll(self, now: float) -> None:
        """See :meth:`ServedPayload.poll`."""
        if now >= self._absence_due:
            self._absence_due = math.inf
            if absence := self._absence(now):
                self._context.log.warning(absence)
        self._log_inputs(now)
        if now >= self._count_due:
            self._count_due = now + COUNT_INTERVAL
            self._graph = {one: InputTopic(name, self._context.node.count_publishers(name))
                           for one, name in self._topics.items()}
            self._context.log.write_conditions(shared_topics(self._graph), 'shared input')
            # Publishers and their first messages take some time.
            if self._absence_due == math.inf:
                self._context.log.write_conditions(
                    missing(self._client.feeder.snapshot(now), self._graph), 'missing input')
        orientation = self._client.feeder.orientation
        if orientation.mount_is_fixed and self._context.node.count_publishers(
                self._topics[Input.MOUNT]):
            orientation.expect_mount()
            self._context.log.info('~/mount has a publisher: the mount is not fixed')
        if self._transforms and orientation.fixed_mount and now >= self._frame_due:
            self._frame_due = math.inf
            self._transforms.fix(
                MountParent.VEHICLE.value, self._context.values['frame_id'],
                fixed_mount(orientation.fixed_mount, self._client.settings.mount_frame))

    def _log_inputs(self, now: float) -> None:
        """Log each input whose state has changed."""
        for name, one in self._client.feeder.snapshot(now).inputs.items():
            if one.state is not self._states.get(name, InputState.MISSING):
                self._states[name] = one.state
                used = one.state is InputState.OK
                self._context.log.write(
                    logging.INFO if used else logging.WARNING,
                    f'~/{name.value}: received' if used else why_unused(name, one),
                    f'input {name.value}')

    # Events

    def _handle(self, event: CameraEvent) -> None:
        if isinstance(event, ImageTaken):
            self._publish(event.feedback)
        else:
            publish_event(event, 'camera', self._context.log, self._interface)
        self._context.check_diagnostics()

    def _publish(self, feedback: CameraFeedback) -> None:
        """Publish the metadata of an image, stamped with its own time."""
        settings = self._client.settings
        present = Stamp(self._clock.now().nanoseconds, 0.0, self._clock.ros_time_is_active)
        seconds, nanoseconds = divmod(
            self._client.feeder.ros_time(feedback.time_usec * 1000, present), 1_000_000_000)
        stamp = Time(sec=seconds, nanosec=nanoseconds)
        position = image_position(feedback, settings.geoid_separation)
        fix = NavSatFix(header=Header(stamp=stamp, frame_id=self._context.values['frame_id']),
                        status=NavSatStatus(status=NavSatStatus.STATUS_NO_FIX))
        if position is not None:
            fix.status.status = position.status
            fix.latitude, fix.longitude = position.latitude, position.longitude
            fix.altitude = position.altitude
        self._interface.publish('image/fix', fix)
        attitude = image_attitude(feedback, settings.mount_frame)
        if attitude is not None:
            self._interface.publish('image/attitude', quaternion_message(
                Header(stamp=stamp, frame_id=EARTH_FRAME), attitude))
        self._interface.publish('image/index', feedback.img_idx)

    def _take_snapshot(self, now: float) -> MakeReports:
        return functools.partial(
            reports, camera=self._client.snapshot(now),
            feeder=self._client.feeder.snapshot(now), graph=self._graph, started=self._started,
            geoid_is_known=self._geoid_is_known)


def _angles(values: Values) -> Vector:
    return values['mount_roll'], values['mount_pitch'], values['mount_yaw']


def _make_client(commands: CommandSender, values: Values) -> RedEdgeClient:
    if commands.address.component == mavlink.MAV_COMP_ID_CAMERA:
        raise ParameterError(f'component_id: {mavlink.MAV_COMP_ID_CAMERA} is the id of the camera')
    return RedEdgeClient(commands, by_name(
        CameraSettings, values, position_source=PositionSource(values['position_source']),
        mount_frame=MountFrame(values['mount_frame'])))


REDEDGE = RosPayload(
    'rededge', _make_client, CameraNode, PARAMETERS, MOUNT_PARAMETERS,
    summary='a MicaSense camera (RedEdge, RedEdge-MX, RedEdge-P, Altum)', examples=(
        'ros2 run illuminator_ros rededge serial:///dev/ttyUSB0:57600 --ros-args '
        '-r '"'~/fix:=/gps/fix' -r '~/imu:=/imu/data'",
        'ros2 service call /rededge/capture std_srvs/srv/Trigger',
        'ros2 param set /rededge mount_pitch 15.0'),
    # MAV_COMP_ID_ONBOARD_COMPUTER.
    link_defaults={'connection_url': 'udpin://127.0.0.1:14592', 'component_id': 191},
    mavlink_version=1)
