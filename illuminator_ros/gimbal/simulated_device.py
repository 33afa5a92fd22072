# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""
A simulated gimbal device: it obeys its gimbal manager and no other component.

https://mavlink.io/en/services/gimbal_v2.html. Its manager is the component of its own system that
announces it, that is, names the device's component id in GIMBAL_MANAGER_STATUS or
GIMBAL_MANAGER_INFORMATION. The first such component stays its manager until it has not announced
the device for :data:`MANAGER_TIMEOUT`.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import partial
import math
from typing import Any

from . import messages as gimbal
from .axes import range_fields
from .manager_setpoint import Setpoint
from .simulated_motion import GimbalMechanics, GimbalMotion
from .. import __version__
from ..geometry.mount_attitude import AXES, yaw_frame, YawFrame
from ..geometry.rotation import Quaternion
from ..mavlink.dialect import flag_names, mavlink
from ..mavlink.messages import Address, Message, time_boot_ms
from ..payload.messages import GimbalDeviceAttitudeStatus
from ..simulation import simulated
from ..simulation.faults import Behaviour, fault, FaultTable, FaultValue, FLAGS
from ..simulation.settings import integer, number, one_of, setting, text

# s without an announcement after which a component is no longer the manager.
MANAGER_TIMEOUT = 5.0
# rad of movement after which the view shows another line.
TRAVEL_STEP = math.radians(15.0)

_degrees = number(-180.0, 180.0)


@dataclass(frozen=True)
class GimbalBehaviour(Behaviour):
    """
    The behaviour of a simulated gimbal; the defaults follow the protocol.

    :param enforces_control: whether it ignores setpoints of components that do not control it.
    :param reports: whether it sends its status.
    :param frozen_flags: whether its status always shows the flags that it had at the start.
    :param frozen_axis: the name of an axis that does not move, '' for none.
    :param jump: angle by which every tenth reported attitude is wrong, degrees.
    :param names_frame: whether the status names its yaw frame.
    :param false_flags: GIMBAL_DEVICE_ERROR_FLAGS that are set without a reason.
    :param identifies: whether it sends its INFORMATION message.
    :param static_information: whether its INFORMATION message always has the same content.
    :param limits_range: whether it keeps within the range that it reports.
    :param limits_in_degrees: whether it reports its ranges in degrees.
    :param stops: whether a rate of 0 stops it.
    :param accepts_earth_always: whether it reports ACCEPTS_YAW_IN_EARTH_FRAME even without a
        heading.
    :param takes_manager_set: whether a device obeys the messages to managers.
    :param reports_earth: whether it reports yaw relative to north if its setpoint has such a yaw.
    :param reports_failures: whether its failure flags show the axes at their limits.
    """

    heartbeat_type: int = mavlink.MAV_TYPE_GIMBAL
    reports_earth: bool = True
    reports_failures: bool = True
    enforces_control: bool = fault(True, 'obeys-others', 'obeys components that do not control it')
    reports: bool = fault(True, 'no-status', 'sends no status')
    frozen_flags: bool = fault(False, 'stale-flags', 'reports the flags of its start')
    frozen_axis: str = fault(
        '', 'frozen-axis', 'an axis does not move', 'pitch', FaultValue('AXIS', one_of(AXES), str))
    jump: float = fault(
        0.0, 'jumps', 'every tenth reported attitude is wrong by DEG', 20.0,
        FaultValue('DEG', number(1, 180)))
    names_frame: bool = fault(True, 'no-frame', 'does not name the yaw frame of its attitude')
    false_flags: int = fault(
        0, 'flags', 'reports failure flags without a reason',
        mavlink.GIMBAL_DEVICE_ERROR_FLAGS_MOTOR_ERROR, FLAGS)
    identifies: bool = fault(True, 'no-identity', 'sends no INFORMATION message')
    static_information: bool = fault(
        True, 'changing-identity', 'changes the limits that it reports')
    limits_range: bool = fault(True, 'no-limits', 'turns beyond the range that it reports')
    limits_in_degrees: bool = fault(False, 'degrees', 'reports its ranges in degrees')
    stops: bool = fault(True, 'runaway', 'goes on turning when the rate is set to 0')
    accepts_earth_always: bool = fault(
        False, 'false-north',
        'claims to accept yaw relative to north without a heading from the vehicle')
    takes_manager_set: bool = fault(False, 'manager-set', 'obeys the messages to gimbal managers')


# No command changes a device, so the faults in the results of such commands are left out.
FAULTS = FaultTable.of(GimbalBehaviour, 'refuse', 'progress', 'busy', 'disobey')


@dataclass(frozen=True)
class MountProperties(GimbalMechanics, simulated.Properties):
    """
    The properties of a simulated gimbal, with or without a manager of its own.

    :param status_interval: s between messages with its attitude.
    :param device_id: gimbal_device_id of its messages, 0 for a component of its own.
    """

    device_id: int = 0
    vendor: str = setting('illuminator_ros', 'TEXT', 'vendor_name', text)
    model: str = setting('simulator', 'TEXT', 'model_name', text)
    custom_name: str = setting('', 'TEXT', 'custom_name', text)
    status_interval: float = setting(
        0.1, 'S', 'time between attitudes; 0 sends them only on request', number(0, 3600))


@dataclass(frozen=True)
class GimbalProperties(MountProperties):
    """
    The properties of a simulated gimbal device.

    :param manager_id: component id of the only component that it obeys, None for the first that
        announces it.
    """

    address: Address = Address(1, mavlink.MAV_COMP_ID_GIMBAL)
    behaviour: GimbalBehaviour = GimbalBehaviour()
    drift: float = setting(
        GimbalMechanics.drift, 'DEG_S',
        'drift of a locked yaw without a heading from the vehicle', number(-10, 10))
    manager_id: int | None = setting(
        None, 'ID', 'component id of its manager; without it, the first component that announces '
        'itself', integer(1, 255))

    @property
    def manager(self) -> Address | None:
        """Return the only component that it obeys, None for the first that announces it."""
        return Address(self.address.system, self.manager_id) if self.manager_id else None


def _turn(device: Any, words: list[str], now: float) -> simulated.Effect:
    pitch, yaw = (math.radians(_degrees(word)) for word in words)
    return partial(device.motion.turn, pitch, yaw, now)


COMMANDS: tuple[simulated.ConsoleCommand[Any, simulated.Effect], ...] = (
    simulated.ConsoleCommand('turn PITCH YAW', 'turn it by hand, degrees, relative to horizon '
                             'and vehicle', _turn),
)


class SimulatedMount(simulated.SimulatedDevice):
    """
    The motion of a gimbal and its reports, for a device and for a manager that is its own device.

    :ivar motion: of its axes.
    """

    commands = COMMANDS
    properties: MountProperties
    behaviour: GimbalBehaviour

    def restart(self, now: float) -> None:
        """See :meth:`SimulatedDevice.restart`."""
        self.motion = GimbalMotion(self.properties, now)
        self._booted_at = now
        self._first_flags = self.motion.flags
        self._informed = self._reported = 0
        self.behave(self.behaviour, now)

    def behave(self, behaviour: Behaviour, now: float) -> None:
        """See :meth:`SimulatedDevice.behave`."""
        super().behave(behaviour, now)
        self.motion.advance(now)
        self.motion.fail(self.behaviour.frozen_axis, limited=self.behaviour.limits_range)

    def reports(self) -> Mapping[type[Message], simulated.Report]:
        """See :meth:`SimulatedDevice.reports`."""
        return {
            GimbalDeviceAttitudeStatus: simulated.Report(
                self.status, self.properties.status_interval),
            gimbal.GimbalDeviceInformation: simulated.Report(self._information)}

    def uptime_ms(self, now: float) -> int:
        """Return the time since the start, ms, wrapping as the field does."""
        return time_boot_ms(now - self._booted_at)

    def obey(self, setpoint: Setpoint, now: float) -> None:
        """Receive a setpoint, see :meth:`GimbalMotion.obey`."""
        stop = setpoint.has_rates_only and not any(
            rate for rate in setpoint.rates if math.isfinite(rate))
        if not self.behaviour.ignores_changes and (self.behaviour.stops or not stop):
            self.motion.obey(setpoint, now)

    @property
    def flags(self) -> int:
        """Return the flags of the setpoint as they are reported."""
        return self._first_flags if self.behaviour.frozen_flags else self.motion.flags

    def status(self, now: float, failures: int = 0) -> GimbalDeviceAttitudeStatus | None:
        """
        Return the status of this moment, None if it sends none.

        :param failures: GIMBAL_DEVICE_ERROR_FLAGS besides the flags of the axes.
        """
        behaviour, motion = self.behaviour, self.motion
        if not behaviour.reports:
            return None
        motion.advance(now)
        known = motion.heading_known(now)
        frame = motion.frame if known and behaviour.reports_earth else YawFrame.VEHICLE
        flags = self.flags
        if behaviour.names_frame:
            flags |= frame.flag
        elif known:
            # In older devices YAW_LOCK also selects the frame.
            frame = yaw_frame(flags)
        if behaviour.accepts_earth_always or known and (
                self.properties.capabilities
                & mavlink.GIMBAL_DEVICE_CAP_FLAGS_SUPPORTS_YAW_IN_EARTH_FRAME):
            flags |= mavlink.GIMBAL_DEVICE_FLAGS_ACCEPTS_YAW_IN_EARTH_FRAME
        q = motion.attitude(frame)
        self._reported += 1
        if behaviour.jump and not self._reported % 10:
            q = Quaternion.from_euler(0.0, 0.0, math.radians(behaviour.jump)) * q
        if behaviour.reports_failures:
            failures |= motion.limits()
        turning = motion.vehicle.rate if known else math.nan
        roll_rate, pitch_rate, yaw_rate = motion.rates
        return GimbalDeviceAttitudeStatus(
            0, 0, self.uptime_ms(now), flags, q, roll_rate, pitch_rate,
            yaw_rate + (turning if frame is YawFrame.EARTH else 0.0),
            failures | behaviour.false_flags, motion.vehicle.yaw if known else math.nan, turning,
            self.properties.device_id)

    def limits(self) -> Mapping[str, float]:
        """Return the fields roll_min to yaw_max of an INFORMATION message."""
        fields = range_fields(self.properties.ranges)
        if self.behaviour.limits_in_degrees:
            fields = {name: math.degrees(value) for name, value in fields.items()}
        self._informed += 1
        return fields if self.behaviour.static_information else {
            **fields, 'pitch_max': fields['pitch_max'] + 0.01 * self._informed}

    def _information(self, now: float) -> gimbal.GimbalDeviceInformation | None:
        properties, capabilities = self.properties, self.properties.capabilities
        if not self.behaviour.identifies:
            return None
        vendor, model, custom = (
            name.encode()[:31] for name in (
                properties.vendor, properties.model, properties.custom_name))
        release = [int(part) for part in __version__.split('.')[:3]]
        version = sum(part << 8 * place for place, part in enumerate(release))
        return gimbal.GimbalDeviceInformation(
            self.uptime_ms(now), vendor, model, custom, version, version,
            properties.address.system << 8 | properties.address.component,
            capabilities & 0xFFFF, 0, **self.limits(), gimbal_device_id=properties.device_id,
            cap_flags2=capabilities)

    def describe(self, now: float, *notes: str) -> simulated.Snapshot:
        """Return the actual state of this moment, for people."""
        motion = self.motion
        motion.advance(now)
        roll, pitch, yaw = map(math.degrees, motion.angles)
        shown_flags = (mavlink.GIMBAL_DEVICE_FLAGS_RETRACT | mavlink.GIMBAL_DEVICE_FLAGS_NEUTRAL
                       | mavlink.GIMBAL_DEVICE_FLAGS_YAW_LOCK)
        shown = (*flag_names('GIMBAL_DEVICE_FLAGS', shown_flags & motion.flags),
                 *flag_names('GIMBAL_DEVICE_ERROR_FLAGS', motion.limits()), *filter(None, notes))
        return simulated.Snapshot(
            '  '.join((f'roll {roll:6.1f}  pitch {pitch:6.1f}  yaw {yaw:6.1f} deg', *shown)),
            (*shown, motion.moving), motion.travelled / TRAVEL_STEP)


class SimulatedGimbal(SimulatedMount):
    """
    A simulated gimbal device, without the link: see :class:`SimulatedDevice`.

    :ivar manager: the component that it obeys, None while no component announces itself.
    """

    messages = (
        gimbal.GimbalManagerInformation, gimbal.GimbalManagerStatus,
        gimbal.GimbalDeviceSetAttitude, gimbal.AutopilotStateForGimbalDevice,
        gimbal.GimbalManagerSetAttitude)
    faults = FAULTS
    properties: GimbalProperties

    def restart(self, now: float) -> None:
        """See :meth:`SimulatedDevice.restart`; it forgets its manager."""
        super().restart(now)
        self.manager = self.properties.manager
        self._announced_at = now

    def status(self, now: float, failures: int = 0) -> GimbalDeviceAttitudeStatus | None:
        """See :class:`SimulatedMount`."""
        self._expire(now)
        if not self.manager:
            failures |= mavlink.GIMBAL_DEVICE_ERROR_FLAGS_NO_MANAGER
        return super().status(now, failures)

    def receive(self, source: Address, message: Message, now: float) -> Iterable[Message]:
        """See :meth:`SimulatedDevice.receive`."""
        self._expire(now)
        own, behaviour = self.properties.address, self.behaviour
        if isinstance(message, gimbal.GimbalManagerInformation | gimbal.GimbalManagerStatus):
            # Component ids are unique in one system only.
            if (message.gimbal_device_id == own.component and source.system == own.system
                    and self.manager in (None, source)):
                self.manager, self._announced_at = source, now
        elif isinstance(message, gimbal.AutopilotStateForGimbalDevice):
            if source.system == own.system:
                self._receive_heading(message, now)
        elif (source == self.manager or not behaviour.enforces_control) and (
                isinstance(message, gimbal.GimbalDeviceSetAttitude)
                or isinstance(message, gimbal.GimbalManagerSetAttitude)
                and behaviour.takes_manager_set):
            self._obey(message, now)
        return ()

    def _expire(self, now: float) -> None:
        if self.properties.manager is None and now - self._announced_at >= MANAGER_TIMEOUT:
            self.manager = None

    def _receive_heading(self, message: gimbal.AutopilotStateForGimbalDevice, now: float) -> None:
        try:
            roll, pitch, yaw = Quaternion(*message.q).normalized().euler()
        except ValueError:
            return
        # An angular velocity of 0 means unknown.
        self.motion.receive_heading(
            roll, pitch, yaw, message.angular_velocity_z or math.nan, now)

    def _obey(
        self, message: gimbal.GimbalDeviceSetAttitude | gimbal.GimbalManagerSetAttitude,
        now: float,
    ) -> None:
        try:
            setpoint = Setpoint.from_attitude(message)
        except ValueError:
            return
        if setpoint.frame is YawFrame.VEHICLE or self.motion.heading_known(now):
            self.obey(setpoint, now)

    def snapshot(self, now: float) -> simulated.Snapshot:
        """See :meth:`SimulatedDevice.snapshot`."""
        self._expire(now)
        return self.describe(
            now, f'manager {self.manager}' if self.manager else 'no manager',
            '' if self.motion.heading_known(now) else 'heading unknown')


SIMULATED = simulated.SimulatedType(
    'gimbal', 'gimbals', SimulatedGimbal, GimbalProperties(),
    examples=(
        '--payload gimbal',
        '--payload illuminator,gimbal      # a light and a gimbal on one vehicle',
        '--payload gimbal --pitch-range=-90,30 --lacks has_yaw_lock'),
    mavlink_version=2)
