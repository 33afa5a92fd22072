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
from dataclasses import dataclass, field, replace
import functools
import math
import random
from typing import Any

from .behaviour import Behaviour
from .extended_status import ExtendedIlluminatorStatus
from .model import checked, Configuration, ErrorFlag, Identity, InvalidValue, Limits, Mode
from .outlet import Outlet, Schedule
from .thermal import ThermalModel, ThermalProperties
from ..mavlink.agenda import Agenda
from ..mavlink.dialect import (
    CommandAck,
    CommandInt,
    CommandLong,
    ComponentInformationBasic,
    Heartbeat,
    IlluminatorStatus,
    INFORMATION_ID,
    MAV_COMP_ID_ILLUMINATOR,
    MavCmd,
    MAVLINK_VERSION,
    MavResult,
    Source,
    STATUS_ID,
)
from ..mavlink.endpoint import Endpoint

# s; the fastest status stream on offer. Whoever asks for more gets this.
SHORTEST_INTERVAL = 0.01
# s between looks at the temperature.
THERMAL_INTERVAL = 0.1
# s between reports of progress.
PROGRESS_INTERVAL = 0.5
# The commands that change a light.
CHANGES = (MavCmd.ILLUMINATOR_ON_OFF, MavCmd.DO_ILLUMINATOR_CONFIGURE)


@dataclass(frozen=True)
class DeviceProperties:
    """
    What a simulated light is.

    :param name: what people call it.
    :param mode_bitmask: as reported; here the enum values of the supported modes, or-ed.
    :param modes: what it can be configured to.
    :param status_interval: s between statuses unless told otherwise; 0 sends none.
    :param time_scale: how much faster than time the light gets hot.
    :param behaviour: what it does at first; :attr:`Device.behaviour` can change.
    :param normal: what it does without faults.
    :param seed: of what happens by chance.
    """

    source: Source = Source(1, MAV_COMP_ID_ILLUMINATOR)
    identity: Identity = field(default_factory=lambda: Identity(
        'illuminator_ros', 'simulator', '1.0.0', '1.0.0', 'SIM-1-243'))
    limits: Limits = Limits(0.05, 10.0)
    mode_bitmask: int = Mode.INTERNAL_CONTROL | Mode.EXTERNAL_SYNC
    status_interval: float = 1.0
    thermal: ThermalProperties = ThermalProperties()
    time_scale: float = 1.0
    name: str = ''
    modes: tuple[Mode, ...] = (Mode.INTERNAL_CONTROL, Mode.EXTERNAL_SYNC)
    behaviour: Behaviour = Behaviour()
    normal: Behaviour = Behaviour()
    seed: int = 0


class Device:
    """
    One light. No I/O; time is passed in.

    :ivar behaviour: what it does just now, to be replaced with :meth:`behave`.
    :ivar rejections: changes that are still to be rejected temporarily.
    :ivar outgoing: messages to send, each with the address that it is sent from.
    :ivar changed: called when :meth:`next_deadline` may be another but for receive and poll.
    """

    def __init__(
        self, properties: DeviceProperties, now: float,
        outgoing: deque[tuple[Source, Any]] | None = None,
    ) -> None:
        self.properties = properties
        self.behaviour = properties.behaviour
        self.rejections = properties.behaviour.rejections
        self.outgoing = deque() if outgoing is None else outgoing
        self.thermal = ThermalModel(properties.thermal)
        self.thermal.sensor_failed = self.behaviour.thermistor_failed
        self.changed: Callable[[], None] = lambda: None
        self._outlet = Outlet(
            properties.source, self.outgoing, random.Random(f'{properties.seed} {self.source}'))
        self._schedule = Schedule()
        self.power_on(now)

    def power_on(self, now: float) -> None:
        """Begin: the faults that last for a time last from now on."""
        self._silent_until = now + (self.behaviour.silence or -math.inf)
        self.restart(now)

    def restart(self, now: float) -> None:
        """Begin anew, as after a power cycle; only the heat stays."""
        self.enabled = False
        self.configuration = Configuration(Mode.INTERNAL_CONTROL, 100.0, 0.0, 0.0)
        self._last_brightness = self.configuration.brightness
        self.interval = self.properties.status_interval
        self._in_progress: set[int] = set()
        self._booted_at = now
        self._status_due = now if self.interval else math.inf
        self._thermal_at = now
        self._heartbeat_due = now if self.behaviour.heartbeat_interval else math.inf
        self._outlet.clear()
        self._schedule.clear()
        self._reboot_due = now + (self.behaviour.reboot_interval or math.inf)
        self.changed()

    def behave(self, behaviour: Behaviour, now: float) -> None:
        """Behave otherwise from now on."""
        before, self.behaviour = self.behaviour, behaviour
        self.thermal.sensor_failed = behaviour.thermistor_failed
        if behaviour.rejections != before.rejections:
            self.rejections = behaviour.rejections
        if behaviour.silence != before.silence:
            self._silent_until = now + behaviour.silence
        if behaviour.reboot_interval != before.reboot_interval:
            self._reboot_due = now + (behaviour.reboot_interval or math.inf)
        if behaviour.heartbeat_interval != before.heartbeat_interval:
            self._heartbeat_due = now if behaviour.heartbeat_interval else math.inf
        self.changed()

    def silent(self, now: float) -> bool:
        """Return whether the light neither hears nor says anything."""
        return now < self._silent_until

    def press(self, now: float, *, enabled: bool | None = None, **changes: Any) -> None:
        """
        Switch or configure the light by itself, as with a button on it.

        :raises InvalidValue: if it cannot be so.
        """
        configuration = self.configuration.with_changes({
            name: checked(name, value, self.properties.limits)
            for name, value in changes.items()})

        def change() -> None:
            self.configuration = configuration
            if enabled is not None:
                self.enabled = enabled
            elif self.behaviour.joint_switch:
                self.enabled = configuration.brightness > 0

        self._apply(change, now)

    def heat_to(self, temperature: float, now: float) -> None:
        """Bring the light to a temperature, degC."""
        self._warm(now)
        self.thermal.temperature = temperature

    @property
    def source(self) -> Source:
        """Return the address of the light."""
        return self.properties.source

    def addressed(self, message: Any) -> bool:
        """Return whether a message is for this light (MAVLink guide, "Routing")."""
        if not self.behaviour.filters_target:
            return True
        system, component = self.source
        to = Source(message.target_system, message.target_component)
        if to == self.source:
            return True
        return self.behaviour.takes_broadcast and (
            to.system == 0 or to.system == system and to.component == 0)

    def receive(self, source: Source, message: Any, now: float) -> None:
        """Take a message: commands are answered, the rest is of no interest."""
        if (not isinstance(message, CommandLong | CommandInt) or self.silent(now)
                or not self.addressed(message)):
            return
        if isinstance(message, CommandInt) and not self.behaviour.takes_int:
            return
        if self.behaviour.slow:
            self._schedule.add(now + self.behaviour.slow,
                               functools.partial(self._consider, source, message))
        else:
            self._consider(source, message, now)

    def _consider(self, source: Source, message: Any, now: float) -> None:
        """Answer a command at once, or report its progress first."""
        params = [message.param1, message.param2, message.param3, message.param4]
        if message.command not in CHANGES:
            self._finish(source, message.command, params, now)
        elif self.rejections or message.command in self._in_progress:
            self.rejections = max(self.rejections - 1, 0)
            self._acknowledge(source, message.command, MavResult.TEMPORARILY_REJECTED, now)
        elif self.behaviour.refuse is not None:
            self._acknowledge(source, message.command, self.behaviour.refuse, now)
        elif self.behaviour.progress:
            self._progress(source, message.command, params, now, now)
        else:
            self._finish(source, message.command, params, now)

    def _acknowledge(
        self, source: Source, command: int, result: int, now: float, progress: int = 0,
    ) -> None:
        target = source if self.behaviour.acks_target else Source(0, 0)
        if self.behaviour.misaddresses:
            target = Source(source.system, source.component ^ 1)
        self._send(CommandAck(command, result, progress, 0, *target), now)

    def _progress(
        self, source: Source, command: int, params: list[float], begun: float, now: float,
    ) -> None:
        """Report progress until the time for it is over, then do what was asked for."""
        share = (now - begun) / (self.behaviour.progress or 1e-9)
        if share >= 1:
            self._in_progress.discard(command)
            self._finish(source, command, params, now)
            return
        self._in_progress.add(command)
        self._acknowledge(source, command, MavResult.IN_PROGRESS, now, int(100 * share))
        due = min(now + PROGRESS_INTERVAL, begun + self.behaviour.progress)
        self._schedule.add(due, functools.partial(
            self._progress, source, command, params, begun))

    def _finish(
        self, source: Source, command: int, params: list[float], now: float,
    ) -> None:
        """Answer a command and do what it asks for."""
        behaviour = self.behaviour
        result, change, replies = self._judge(command, params, now)
        refused = result != MavResult.ACCEPTED
        self._acknowledge(source, command, result, now)
        for reply in replies:
            self._send(reply(now), now)
        if change is None or (refused and not behaviour.obeys_refused):
            return
        if behaviour.lies and not refused:
            return
        if behaviour.apply_after:
            self._schedule.add(now + behaviour.apply_after,
                               lambda later: self._apply(change, later))
        else:
            self._apply(change, now)

    def _judge(
        self, command: int, params: list[float], now: float,
    ) -> tuple[MavResult, Callable[[], None] | None, list[Callable[[float], Any]]]:
        """Return the result of a command, the change it makes, and what else answers it."""
        if command == MavCmd.ILLUMINATOR_ON_OFF:
            return self._switch(params[0])
        if command == MavCmd.DO_ILLUMINATOR_CONFIGURE:
            return self._configure(params)
        if command == MavCmd.REQUEST_MESSAGE:
            if params[0] == STATUS_ID and self.behaviour.on_request:
                return MavResult.ACCEPTED, None, [self.status]
            if params[0] == INFORMATION_ID and self.behaviour.identifies:
                return MavResult.ACCEPTED, None, [self.information]
            return self._unknown(MavResult.DENIED), None, []
        if command == MavCmd.SET_MESSAGE_INTERVAL:
            return self._set_interval(params[0], params[1], now), None, []
        return self._unknown(MavResult.UNSUPPORTED), None, []

    def _unknown(self, result: MavResult) -> MavResult:
        return MavResult.ACCEPTED if self.behaviour.accepts_unknown else result

    def _switch(self, param: float) -> tuple[MavResult, Callable[[], None], list[Any]]:
        valid = param in (0.0, 1.0) or self.behaviour.lets_all_in
        on = bool(param == 1.0)
        if on and self.behaviour.toggles:
            on = not self.enabled

        def change() -> None:
            self.enabled = on
            # "0%: Off": where the two are one, being on needs some brightness.
            if on and self.behaviour.joint_switch and not self.configuration.brightness:
                self.configuration = replace(
                    self.configuration, brightness=self._last_brightness)
        return MavResult.ACCEPTED if valid else MavResult.DENIED, change, []

    def _configure(
        self, params: list[float],
    ) -> tuple[MavResult, Callable[[], None] | None, list[Any]]:
        mode, brightness, period, duty = params
        behaviour = self.behaviour
        known = mode in (Mode.INTERNAL_CONTROL, Mode.EXTERNAL_SYNC)
        configuration = Configuration(
            Mode(int(mode)) if known else self.configuration.mode, brightness, period, duty)

        def change() -> None:
            self.configuration = configuration
            if brightness > 0:
                self._last_brightness = brightness
            if behaviour.joint_switch:
                self.enabled = brightness > 0

        try:
            if mode not in self.properties.modes:
                raise InvalidValue(f'mode {mode}')
            if period and not behaviour.measures:
                raise InvalidValue('this light does not strobe')
            for name, value in (('brightness', brightness), ('strobe_period', period),
                                ('strobe_duty_cycle', duty)):
                if not (math.isnan(value) and behaviour.lets_nan_in):
                    checked(name, value, self.properties.limits)
        except InvalidValue:
            accepted = behaviour.lets_all_in
        else:
            accepted = True
        return MavResult.ACCEPTED if accepted else MavResult.DENIED, change, []

    def _apply(self, change: Callable[[], None], now: float) -> None:
        """Make a change and, unless the stream is off, tell of it."""
        self._warm(now)
        change()
        if self.interval and self.behaviour.pushes:
            self._status_due = now + self.interval
            self._send(self.status(now), now)
        self.changed()

    def _set_interval(self, message_id: float, microseconds: float, now: float) -> MavResult:
        """MAV_CMD_SET_MESSAGE_INTERVAL: -1 stops the stream, 0 is the default rate."""
        default = self.properties.status_interval or 1.0
        if message_id != STATUS_ID or not math.isfinite(microseconds):
            return MavResult.DENIED
        if microseconds == -1:
            self.interval = default if self.behaviour.endless_stream else 0.0
        elif microseconds == 0 or self.behaviour.fixed_rate:
            self.interval = default if self.interval or self.behaviour.resumes else 0.0
        elif microseconds > 0:
            self.interval = max(microseconds / 1e6, SHORTEST_INTERVAL)
        else:
            return MavResult.DENIED
        self._status_due = now + self.interval if self.interval else math.inf
        return MavResult.ACCEPTED

    def status(self, now: float) -> Any:
        """Return the ILLUMINATOR_STATUS of this moment."""
        self._warm(now)
        behaviour, configuration = self.behaviour, self.configuration
        brightness = configuration.brightness * self.thermal.output
        if behaviour.joint_switch and not self.enabled:
            brightness = 0.0
        limits = self.properties.limits if behaviour.measures else Limits()
        fields = (
            self.uptime_ms(now), int(self.enabled), self.properties.mode_bitmask,
            int(self._flags()), int(configuration.mode), brightness,
            configuration.strobe_period, configuration.strobe_duty_cycle,
            self.thermal.reading if behaviour.measures else 0.0,
            limits.min_strobe_period, limits.max_strobe_period)
        if behaviour.extension is not None:
            return ExtendedIlluminatorStatus(*fields, extension=behaviour.extension)
        return IlluminatorStatus(*fields)

    def _flags(self) -> int:
        flags = int(self.thermal.flags) | self.behaviour.false_flags
        if self.behaviour.inverted_flags and self.enabled:
            flags ^= ErrorFlag.THERMAL_THROTTLING
        return flags

    def information(self, now: float) -> Any:
        """Return the COMPONENT_INFORMATION_BASIC."""
        identity, behaviour = self.properties.identity, self.behaviour

        def string(text: str, size: int) -> bytes:
            if behaviour.padding:
                return text.ljust(size, behaviour.padding).encode()[:size]
            return text.encode()[:size - behaviour.terminates]

        return ComponentInformationBasic(
            self.uptime_ms(now), 0, 0, string(identity.vendor, 32), string(identity.model, 32),
            string(identity.software_version, 24), string(identity.hardware_version, 24),
            string(identity.serial_number, 32))

    def uptime_ms(self, now: float) -> int:
        """Return the time since the start, ms, wrapping as the field does."""
        if not self.behaviour.has_clock:
            return 0
        return int((now - self._booted_at) * 1000) & 0xFFFFFFFF

    def _warm(self, now: float) -> None:
        configuration = self.configuration
        power = configuration.brightness / 100 if self.enabled else 0.0
        if configuration.strobe_period and configuration.strobe_duty_cycle:
            power *= configuration.strobe_duty_cycle / 100
        # A light that let NaN in is as hot as one at full power, and stays a light.
        power = min(max(power, 0.0), 1.0) if math.isfinite(power) else 1.0
        self.thermal.advance((now - self._thermal_at) * self.properties.time_scale, power)
        self._thermal_at = now

    def _send(self, message: Any, now: float) -> None:
        if not self.silent(now):
            self._outlet.send(message, self.behaviour, now)

    def announce(self, now: float) -> None:
        """Send a heartbeat at once: somebody new is within hearing."""
        if self.behaviour.heartbeat_interval:
            self._beat(now)
        self.changed()

    def _beat(self, now: float) -> None:
        behaviour = self.behaviour
        self._heartbeat_due = now + (behaviour.heartbeat_interval or math.inf)
        self._send(Heartbeat(
            behaviour.heartbeat_type, behaviour.heartbeat_autopilot, 0, 0,
            behaviour.heartbeat_state, MAVLINK_VERSION), now)

    def poll(self, now: float) -> None:
        """Send what is due."""
        if now >= self._reboot_due:
            self.restart(now)
        self._schedule.poll(now)
        if now >= self._heartbeat_due:
            self._beat(now)
        if now >= self._thermal_at + THERMAL_INTERVAL:
            self._warm(now)
        if now >= self._status_due:
            self._status_due += self.interval
            if self._status_due <= now:
                # Held up for longer than an interval: what was missed is not made up for.
                self._status_due = now + self.interval
            self._send(self.status(now), now)
        self._outlet.poll(now)

    def next_deadline(self) -> float:
        """Return when :meth:`poll` has something to do."""
        return min(self._heartbeat_due, self._status_due, self._thermal_at + THERMAL_INTERVAL,
                   self._reboot_due, self._schedule.next_deadline(),
                   self._outlet.next_deadline())


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
