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
import functools
import math
import random
from typing import Any

from .behaviour import Behaviour
from .device_properties import DeviceProperties
from .lamp import Judgement, Lamp
from .outlet import Outlet, Schedule
from ..mavlink.messages import (
    Address,
    CommandAck,
    CommandInt,
    CommandLong,
    Heartbeat,
    INFORMATION_ID,
    MavCmd,
    MAVLINK_VERSION,
    MavResult,
    STATUS_ID,
)

# s; the fastest status stream on offer. Whoever asks for more gets this.
SHORTEST_INTERVAL = 0.01
# s between looks at the temperature.
THERMAL_INTERVAL = 0.1
# s between reports of progress.
PROGRESS_INTERVAL = 0.5
# The commands that change a light.
CHANGES = (MavCmd.ILLUMINATOR_ON_OFF, MavCmd.DO_ILLUMINATOR_CONFIGURE)


class Device(Lamp):
    """
    One light. No I/O; time is passed in.

    :ivar behaviour: what it does just now, to be replaced with :meth:`behave`.
    :ivar rejections: changes that are still to be rejected temporarily.
    :ivar outgoing: messages to send, each with the address that it is sent from.
    :ivar changed: called when :meth:`next_deadline` may be another but for receive and poll.
    """

    def __init__(
        self, properties: DeviceProperties, now: float,
        outgoing: deque[tuple[Address, Any]] | None = None,
    ) -> None:
        super().__init__(properties)
        self.rejections = properties.behaviour.rejections
        self.outgoing = deque() if outgoing is None else outgoing
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
        """See :meth:`Lamp.restart`."""
        super().restart(now)
        self.interval = self.properties.status_interval
        self._in_progress: set[int] = set()
        self._status_due = now if self.interval else math.inf
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
        self._apply(self._press(enabled, changes), now)

    @property
    def source(self) -> Address:
        """Return the address of the light."""
        return self.properties.source

    def addressed(self, message: Any) -> bool:
        """Return whether a message is for this light (MAVLink guide, "Routing")."""
        if not self.behaviour.filters_target:
            return True
        system, component = self.source
        to = Address(message.target_system, message.target_component)
        if to == self.source:
            return True
        return self.behaviour.takes_broadcast and (
            to.system == 0 or to.system == system and to.component == 0)

    def receive(self, source: Address, message: Any, now: float) -> None:
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

    def _consider(self, source: Address, message: Any, now: float) -> None:
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
        self, source: Address, command: int, result: int, now: float, progress: int = 0,
    ) -> None:
        target = source if self.behaviour.acks_target else Address(0, 0)
        if self.behaviour.misaddresses:
            target = Address(source.system, source.component ^ 1)
        self._send(CommandAck(command, result, progress, 0, *target), now)

    def _progress(
        self, source: Address, command: int, params: list[float], begun: float, now: float,
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
        self, source: Address, command: int, params: list[float], now: float,
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

    def _judge(self, command: int, params: list[float], now: float) -> Judgement:
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
