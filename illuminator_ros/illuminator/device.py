# Copyright 2026 The illuminator_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.

"""
The light's side of the illuminator protocol, as the simulator and the tests run it.

https://mavlink.io/en/services/illuminator.html
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
import functools
import math
from typing import Any

from ..mavlink.agenda import Agenda
from ..mavlink.dialect import (
    CommandAck,
    CommandInt,
    CommandLong,
    ComponentInformationBasic,
    IlluminatorStatus,
    INFORMATION_ID,
    MAV_COMP_ID_ILLUMINATOR,
    MavCmd,
    MavResult,
    MavType,
    Source,
    STATUS_ID,
)
from ..mavlink.endpoint import Endpoint, Heartbeat
from .model import checked, Configuration, Identity, InvalidValue, Limits, Mode
from .thermal import ThermalModel, ThermalProperties

# s; the fastest status stream on offer. Whoever asks for more gets this.
SHORTEST_INTERVAL = 0.01
# s between looks at the temperature.
THERMAL_INTERVAL = 0.1


@dataclass(frozen=True)
class DeviceProperties:
    """
    What a simulated light is.

    :param mode_bitmask: here the enum values of the supported modes, or-ed.
    :param status_interval: s between statuses unless told otherwise; 0 sends none.
    :param time_scale: how much faster than time the light gets hot.
    """

    source: Source = Source(1, MAV_COMP_ID_ILLUMINATOR)
    identity: Identity = field(default_factory=lambda: Identity(
        'illuminator_ros', 'simulator', '1.0.0', '1.0.0', 'SIM-1-243'))
    limits: Limits = Limits(0.05, 10.0)
    mode_bitmask: int = Mode.INTERNAL_CONTROL | Mode.EXTERNAL_SYNC
    status_interval: float = 1.0
    thermal: ThermalProperties = ThermalProperties()
    time_scale: float = 1.0


class Device:
    """
    One light. No I/O; time is passed in.

    :ivar outgoing: messages to send, each with the address that it is sent from.
    :ivar changed: called when :meth:`next_deadline` may be another but for receive and poll.
    """

    def __init__(
        self, properties: DeviceProperties, now: float,
        outgoing: deque[tuple[Source, Any]] | None = None,
    ) -> None:
        self.properties = properties
        self.outgoing = deque() if outgoing is None else outgoing
        self.heartbeat = Heartbeat(properties.source, MavType.ILLUMINATOR)
        self.changed: Callable[[], None] = lambda: None
        self.restart(now)

    def restart(self, now: float) -> None:
        """Begin anew, as after a power cycle; only the heat stays."""
        heat = getattr(self, 'thermal', None)
        self.enabled = False
        self.configuration = Configuration(Mode.INTERNAL_CONTROL, 100.0, 0.0, 0.0)
        self.interval = self.properties.status_interval
        self.thermal: ThermalModel = heat or ThermalModel(self.properties.thermal)
        self._booted_at = now
        self._status_due = now if self.interval else math.inf
        self._thermal_at = now
        self.heartbeat.due = now
        self.changed()

    @property
    def source(self) -> Source:
        """The address of the light."""
        return self.properties.source

    def addressed(self, message: Any) -> bool:
        """Return whether a message is for this light (MAVLink guide, "Routing")."""
        system, component = self.source
        return (message.target_system == 0
                or message.target_system == system
                and message.target_component in (0, component))

    def receive(self, source: Source, message: Any, now: float) -> None:
        """Take a message: commands are answered, the rest is of no interest."""
        if not isinstance(message, CommandLong | CommandInt) or not self.addressed(message):
            return
        params = [message.param1, message.param2, message.param3, message.param4]
        result, afterwards = self._carry_out(message.command, params, now)
        self._send(CommandAck(message.command, result, 0, 0, source.system, source.component))
        for reply in afterwards:
            self._send(reply)

    def _carry_out(
        self, command: int, params: list[float], now: float,
    ) -> tuple[MavResult, list[Any]]:
        """Return the result of a command and what is sent after its acknowledgement."""
        if command == MavCmd.ILLUMINATOR_ON_OFF:
            return self._switch(params[0], now)
        if command == MavCmd.DO_ILLUMINATOR_CONFIGURE:
            return self._configure(params, now)
        if command == MavCmd.REQUEST_MESSAGE:
            if params[0] == STATUS_ID:
                return MavResult.ACCEPTED, [self.status(now)]
            if params[0] == INFORMATION_ID:
                return MavResult.ACCEPTED, [self.information(now)]
            return MavResult.DENIED, []
        if command == MavCmd.SET_MESSAGE_INTERVAL:
            return self._set_interval(params[0], params[1], now), []
        return MavResult.UNSUPPORTED, []

    def _switch(self, param: float, now: float) -> tuple[MavResult, list[Any]]:
        if param not in (0.0, 1.0):
            return MavResult.DENIED, []
        self.enabled = bool(param)
        return MavResult.ACCEPTED, self._news(now)

    def _configure(self, params: list[float], now: float) -> tuple[MavResult, list[Any]]:
        mode, brightness, period, duty = params
        try:
            if mode not in (Mode.INTERNAL_CONTROL, Mode.EXTERNAL_SYNC):
                raise InvalidValue(f'mode {mode}')
            self.configuration = Configuration(
                Mode(int(mode)), float(checked('brightness', brightness)),
                float(checked('strobe_period', period, self.properties.limits)),
                float(checked('strobe_duty_cycle', duty)))
        except InvalidValue:
            return MavResult.DENIED, []
        return MavResult.ACCEPTED, self._news(now)

    def _news(self, now: float) -> list[Any]:
        """Return the status that a change is followed by; none where the stream is off."""
        if not self.interval:
            return []
        self._status_due = now + self.interval
        return [self.status(now)]

    def _set_interval(self, message_id: float, microseconds: float, now: float) -> MavResult:
        """MAV_CMD_SET_MESSAGE_INTERVAL: -1 stops the stream, 0 is the default rate."""
        if message_id != STATUS_ID or not math.isfinite(microseconds):
            return MavResult.DENIED
        if microseconds == -1:
            self.interval = 0.0
        elif microseconds == 0:
            self.interval = self.properties.status_interval or 1.0
        elif microseconds > 0:
            self.interval = max(microseconds / 1e6, SHORTEST_INTERVAL)
        else:
            return MavResult.DENIED
        self._status_due = now + self.interval if self.interval else math.inf
        return MavResult.ACCEPTED

    def status(self, now: float) -> Any:
        """Return the ILLUMINATOR_STATUS of this moment."""
        self._warm(now)
        configuration, limits = self.configuration, self.properties.limits
        return IlluminatorStatus(
            self.uptime_ms(now), int(self.enabled), self.properties.mode_bitmask,
            int(self.thermal.flags), int(configuration.mode),
            configuration.brightness * self.thermal.output, configuration.strobe_period,
            configuration.strobe_duty_cycle, self.thermal.temperature,
            limits.min_strobe_period, limits.max_strobe_period)

    def information(self, now: float) -> Any:
        """Return the COMPONENT_INFORMATION_BASIC, strings cut so that they are terminated."""
        identity = self.properties.identity
        return ComponentInformationBasic(
            self.uptime_ms(now), 0, 0, identity.vendor.encode()[:31],
            identity.model.encode()[:31], identity.software_version.encode()[:23],
            identity.hardware_version.encode()[:23], identity.serial_number.encode()[:31])

    def uptime_ms(self, now: float) -> int:
        """Return the time since the start, ms, wrapping as the field does."""
        return int((now - self._booted_at) * 1000) & 0xFFFFFFFF

    def _warm(self, now: float) -> None:
        configuration = self.configuration
        power = configuration.brightness / 100 if self.enabled else 0.0
        if configuration.strobe_period and configuration.strobe_duty_cycle:
            power *= configuration.strobe_duty_cycle / 100
        self.thermal.advance((now - self._thermal_at) * self.properties.time_scale, power)
        self._thermal_at = now

    def _send(self, message: Any) -> None:
        self.outgoing.append((self.source, message))

    def announce(self, now: float) -> None:
        """Send a heartbeat at once: somebody new is within hearing."""
        self.heartbeat.send(now, self.outgoing)
        self.changed()

    def poll(self, now: float) -> None:
        """Send what is due."""
        self.heartbeat.poll(now, self.outgoing)
        if now >= self._thermal_at + THERMAL_INTERVAL:
            self._warm(now)
        if now >= self._status_due:
            self._status_due += self.interval
            if self._status_due <= now:
                # Held up for longer than an interval: what was missed is not made up for.
                self._status_due = now + self.interval
            self._send(self.status(now))

    def next_deadline(self) -> float:
        """Return when :meth:`poll` has something to do."""
        return min(self.heartbeat.due, self._status_due, self._thermal_at + THERMAL_INTERVAL)


class Devices(Endpoint):
    """Several lights on one link."""

    def __init__(self, properties: list[DeviceProperties], now: float) -> None:
        super().__init__()
        self.devices = [Device(one, now, self.outgoing) for one in properties]
        self._agenda: Agenda[int] = Agenda()
        for index, device in enumerate(self.devices):
            device.changed = functools.partial(self._schedule, index)
            device.changed()

    def _schedule(self, index: int) -> None:
        self._agenda.set(index, self.devices[index].next_deadline())

    def link_opened(self, now: float) -> None:
        """See :meth:`Endpoint.link_opened`."""
        for device in self.devices:
            device.announce(now)

    def receive(self, source: Source, message: Any, now: float) -> None:
        """See :meth:`Endpoint.receive`."""
        if isinstance(message, CommandLong | CommandInt):
            for index, device in enumerate(self.devices):
                if device.addressed(message):
                    device.receive(source, message, now)
                    self._schedule(index)

    def poll(self, now: float) -> None:
        """See :meth:`Endpoint.poll`."""
        for index in self._agenda.due(now):
            self.devices[index].poll(now)
            self._schedule(index)

    def next_deadline(self) -> float:
        """See :meth:`Endpoint.next_deadline`."""
        return self._agenda.next_deadline()
