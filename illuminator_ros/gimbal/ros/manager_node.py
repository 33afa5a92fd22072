# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The node of a gimbal manager: the interface of a gimbal, and the manager's own part."""

from __future__ import annotations

import logging
import math

from geometry_msgs.msg import QuaternionStamped
from nav_msgs.msg import Odometry
from sensor_msgs.msg import Imu
from std_msgs.msg import Header

from .conversions import Frames
from .gimbals import GIMBAL_PARAMETERS, Gimbals, settings
from ..axes import other_signs, Range
from ..manager import (
    AddressShared,
    GimbalManager,
    ManagerEvent,
    ManagerSettings,
    RequestRefused,
)
from ..manager_control import ControlSettings, Role, RoleHolderChanged
from ..manager_state import ManagerState, StateChanged
from ..manager_with_client import ManagerWithClient
from ..setpoint_mixer import AnglesClipped, RateStopped, ReferenceLost, SetpointSent
from ...geometry.mount_attitude import AXES, from_mavlink
from ...geometry.rotation import enu_ned, ned_frd, Quaternion, Vector
from ...mavlink.command_sender import CommandSender
from ...mavlink.messages import Address
from ...payload.arbitration import Cause, Policy
from ...ros.conversions import (
    GEOID_SEPARATION,
    quaternion_message,
    read_orientation,
    read_quaternion,
    read_vector,
)
from ...ros.diagnostics import ERROR, Finding, Report, Value, WARN
from ...ros.diagnostics_publisher import DiagnosticsSource, MakeReports
from ...ros.node import AnyCommandTopic, CommandTopic, Entity, NodeEntities
from ...ros.parameters import (
    by_name,
    given_parameters,
    ParameterError,
    ParameterSpec,
    Values,
)
from ...ros.payload import BridgeContext, RosPayload, ServedPayload, ShutdownReport
from ...ros.qos import STREAM_QOS

# The name of ROS in the lists of players.
ROS = 'ros'
# The limits of a plausible vehicle, rad/s and m/s.
VEHICLE_RATE_LIMIT, VEHICLE_SPEED_LIMIT = 100.0, 10e3
_RANGES = ((0.0, 0.0), (-math.pi / 2, math.pi / 2), (-math.pi, math.pi))

DEVICE_SETPOINT = Entity(
    'device/setpoint', QuaternionStamped, 'the attitude for the driver of a gimbal without '
    'MAVLink', STREAM_QOS)
DEVICE_ATTITUDE = Entity(
    'device/attitude', QuaternionStamped, 'the attitude that the driver measures')
IMU = Entity('imu', Imu, 'attitude of the vehicle, FLU in ENU')
ODOMETRY = Entity('odometry', Odometry, 'attitude and velocity of the vehicle; the twist is in '
                  'the axes of the body')
MANAGER_PARAMETERS = (
    ParameterSpec('policy', Policy.HOLD.value, 'when a player takes control from another one',
                  choices=tuple(policy.value for policy in Policy), restricts=True),
    ParameterSpec('priority', [], 'players, the highest first: sysid/compid, or ros',
                  restricts=True),
    ParameterSpec('overruling', [], 'players that take control under each policy',
                  restricts=True),
    ParameterSpec('lease', 3.0, 'silence after which a player loses control', 's', 2.0, 3600.0,
                  restricts=True),
    ParameterSpec('nudge_limit', 0.175, 'largest angle that secondary control adds', 'rad', 0.0,
                  math.pi, restricts=True),
    *(ParameterSpec(f'{axis}_{end}', round(limits[index], 3),
                    f'{word} of a gimbal without MAVLink', 'rad', -2 * math.pi, 2 * math.pi,
                    restricts=True)
      for axis, limits in zip(AXES, _RANGES, strict=True)
      for index, (end, word) in enumerate((
          ('min', f'smallest {axis}'), ('max', f'largest {axis}')))),
)


def _players(values: Values, name: str, ros: Address) -> tuple[Address, ...]:
    """
    Return the players that a parameter lists.

    :raises ParameterError: if an entry is wrong.
    """
    players = []
    for entry in values[name]:
        system, slash, component = entry.partition('/')
        try:
            player = ros if entry == ROS else Address(int(system), int(component))
        except ValueError:
            player = Address(0, 0)
        if not all(1 <= id_ <= 255 for id_ in player):
            raise ParameterError(f'{name}: {entry!r} is neither sysid/compid nor {ROS!r}')
        players.append(player)
    return tuple(players)


def manager_settings(values: Values, ros: Address) -> ManagerSettings:
    """
    Return the settings of the manager.

    :param ros: the address of ROS as a player.
    :raises ParameterError: if a parameter is wrong.
    """
    ranges = []
    for axis in AXES:
        # With the signs of ROS: pitch down and yaw left are positive.
        low, high = values[f'{axis}_min'], values[f'{axis}_max']
        if low > high:
            raise ParameterError(f'{axis}_min: {low} rad is above {axis}_max: {high} rad')
        ranges.append(other_signs(axis, Range(low, high)))
    return by_name(
        ManagerSettings, values, device_id=values['gimbal_device_id'], ranges=tuple(ranges),
        control=by_name(
            ControlSettings, values, policy=Policy(values['policy']),
            priority=_players(values, 'priority', ros),
            overruling=frozenset(_players(values, 'overruling', ros))))


class ManagerNode(ServedPayload):
    """
    Serves a manager with one node, in the link's thread.

    :raises ParameterError: if a parameter is wrong.
    """

    def __init__(self, both: ManagerWithClient, context: BridgeContext) -> None:
        self._manager = manager = both.manager
        self._context = context
        self._log = context.log
        self._frames = Frames.of(context.values)
        self._clock = context.node.get_clock()
        # Takes the results of the end of the process, None before.
        self._report: ShutdownReport | None = None
        self._gimbals = Gimbals(both.client, context, lambda: manager.tracker.inactive_reason)
        self._interface = NodeEntities(
            context.node, context.link, context.log,
            publications=() if manager.tracker.has_mavlink else (DEVICE_SETPOINT,),
            commands=tuple(self._topics()))
        context.diagnostics.add(DiagnosticsSource(
            context.node.get_fully_qualified_name(), self._take_snapshot))
        manager.events.subscribe(self._handle)

    def _topics(self) -> list[AnyCommandTopic]:
        topics: list[AnyCommandTopic] = [
            CommandTopic(IMU, self._receive_imu, _read_imu),
            CommandTopic(ODOMETRY, self._receive_odometry, _read_odometry)]
        if not self._manager.tracker.has_mavlink:
            topics.append(CommandTopic(
                DEVICE_ATTITUDE, self._manager.receive_attitude, self._frames.read_attitude))
        return topics

    # The vehicle and the device

    def _receive_imu(self, value: tuple[Quaternion, float], now: float) -> None:
        self._manager.vehicle.attitude.set(value, now)
        self._manager.vehicle_changed(now)

    def _receive_odometry(
        self, value: tuple[tuple[Quaternion, float], Vector], now: float,
    ) -> None:
        attitude, velocity = value
        self._manager.vehicle.set_velocity(velocity, now)
        self._receive_imu(attitude, now)

    # Events

    def _handle(self, event: ManagerEvent) -> None:
        log = self._log
        match event:
            case SetpointSent(setpoint):
                # A setpoint without an attitude is the neutral position: level and ahead.
                attitude = from_mavlink(setpoint.attitude or Quaternion(), setpoint.frame)
                header = Header(stamp=self._clock.now().to_msg(),
                                frame_id=self._frames.name(setpoint.frame))
                self._interface.publish(DEVICE_SETPOINT.name, quaternion_message(header, attitude))
            case StateChanged():
                self._state_changed(event)
            case RoleHolderChanged():
                log.info(_control_text(event, self._manager.settings.control.lease), 'control')
            case RequestRefused(player, reason):
                log.warning(f'a request of {player} is refused: {reason}', 'refused')
            case AnglesClipped(clipped):
                for axis, requested, limit in clipped:
                    log.warning(f'the setpoint is clipped: {axis} {requested:.3f} rad in MAVLink '
                                f'is beyond the limit {limit:.3f} rad', f'clipped {axis}')
            case AddressShared(player):
                log.error(f'{player} has control, and two different senders use that address: '
                          'require signing, or give one another address', 'shared')
            case ReferenceLost(unknown):
                log.warning(f'the {unknown} of the vehicle is unknown: the gimbal does not follow '
                            'its setpoint', f'lost {unknown}')
            case RateStopped(stands):
                if not stands:
                    log.warning(self._may_turn(), 'stop')
                elif self._report is not None:
                    self._report('device', logging.INFO, f'{self._device()} stands')
                else:
                    log.info(f'{self._device()} stands', 'stop')

    def _device(self) -> str:
        tracker = self._manager.tracker
        return f'gimbal {tracker.device or tracker.device_id}'

    def _may_turn(self) -> str:
        return f'{self._device()} may still turn: no attitude has shown that it stands'

    def _state_changed(self, event: StateChanged) -> None:
        device = f'gimbal {event.device or event.device_id}'
        if event.after is ManagerState.INACTIVE:
            self._log.error(f'{event.other} manages {device} too: this manager is inactive; '
                            'end one of the two', 'state')
        elif event.after is ManagerState.ACTIVE:
            self._log.info(f'{device} is managed', 'state')
        elif event.after is ManagerState.NO_DEVICE:
            self._log.warning(f'{device} is lost', 'state')
        self._context.check_diagnostics()

    # The bridge's calls

    def poll(self, now: float) -> None:
        """See :meth:`ServedPayload.poll`."""
        self._gimbals.poll(now)

    def shut_down(self, now: float, report: ShutdownReport) -> None:
        """See :meth:`ServedPayload.shut_down`: wait until a gimbal that turned stands."""
        if self._manager.setpoints.rate_stop.is_running:
            self._report = report
            report('device', None, self._may_turn())
        self._gimbals.shut_down(now, report)

    # Diagnostics

    def _take_snapshot(self, now: float) -> MakeReports:
        holder = self._manager.control.holder(Role.PRIMARY)
        peers = self._context.link.lines.peer_count_of(holder, now) if holder else 0
        found, values = findings(self._manager, peers), _values(self._manager, now)
        if (self._manager.setpoints.has_place and self._manager.vehicle.position.is_of_ros(now)
                and GEOID_SEPARATION.name not in given_parameters(self._context.node)):
            found.append((WARN, 'geoid_separation is not set, so the altitude of ~/fix is above '
                                'the ellipsoid'))
        return lambda link: [Report('manager', f'manager {values["gimbal_device_id"]}', found,
                                    'active', lambda: values)]


def findings(manager: GimbalManager, peers: int) -> list[Finding]:
    """
    Return the findings on a manager.

    :param peers: the number of peers over which the player in primary control is heard.
    """
    found: list[Finding] = []
    if manager.tracker.state is ManagerState.INACTIVE:
        found.append((ERROR, f'{manager.tracker.other} manages the gimbal too: inactive'))
    elif manager.tracker.state is not ManagerState.ACTIVE:
        found.append((WARN, manager.tracker.state.value))
    if peers > 1:
        found.append((WARN, f'{manager.control.holder(Role.PRIMARY)} has control and is heard '
                            f'over {peers} peers: another sender may use its address'))
    return found


def _values(manager: GimbalManager, now: float) -> dict[str, Value]:
    control, settings = manager.control, manager.settings.control
    since = control.primary.since
    return {
        'state': manager.tracker.state.value,
        'gimbal_device_id': manager.tracker.device_id,
        'policy': settings.policy.value,
        **{f'{role.value}_control': str(control.holder(role) or 'none') for role in Role},
        **({'control_s_ago': now - since} if math.isfinite(since) else {}),
        'other_manager': str(manager.tracker.other or 'none')}


def _control_text(event: RoleHolderChanged, lease: float) -> str:
    before, after = event.before or 'none', event.after or 'none'
    why = (f'{event.before} was silent for {lease:g} s' if event.cause is Cause.SILENCE
           else f'by {event.by}')
    return f'{event.role.value} control: {before} -> {after}, {why}'


def _read_imu(message: Imu) -> tuple[Quaternion, float]:
    """Return the attitude and the yaw rate, NED and FRD; ValueError if there is none."""
    orientation = read_orientation(message)
    if orientation is None:
        raise ValueError('the message has no orientation')
    return ned_frd(orientation.normalized()), -_within(
        message.angular_velocity.z, VEHICLE_RATE_LIMIT)


def _read_odometry(message: Odometry) -> tuple[tuple[Quaternion, float], Vector]:
    """Return attitude, yaw rate and velocity, NED and FRD; the twist is in the child frame."""
    attitude = read_quaternion(message.pose.pose.orientation).normalized()
    twist = message.twist.twist
    x, y, z = (_within(value, VEHICLE_SPEED_LIMIT) for value in read_vector(twist.linear))
    return ((ned_frd(attitude), -_within(twist.angular.z, VEHICLE_RATE_LIMIT)),
            enu_ned(attitude.rotate((x, y, z))))


def _within(value: float, limit: float) -> float:
    """Return a value of the twist, which may be NaN; ValueError beyond the limit."""
    if abs(value) > limit:
        raise ValueError(f'a twist of {value:g} is beyond {limit:g}')
    return value


def _make(commands: CommandSender, values: Values) -> ManagerWithClient:
    return ManagerWithClient(commands, manager_settings(values, commands.address),
                             settings(values))


GIMBAL_MANAGER = RosPayload(
    'gimbal_manager', _make, ManagerNode, (*GIMBAL_PARAMETERS, *MANAGER_PARAMETERS),
    summary='the manager of a gimbal, which obeys one player at a time', examples=(
        'ros2 run illuminator_ros gimbal_manager --ros-args -p gimbal_device_id:=154',
        'ros2 service call /gimbal_manager/take_control std_srvs/srv/Trigger'))
