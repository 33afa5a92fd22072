# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""A light whose response to commands a test sets."""

from __future__ import annotations

from collections.abc import Mapping
import math
from typing import Any

from illuminator_ros.illuminator.messages import IlluminatorStatus, STATUS_ID
from illuminator_ros.mavlink import messages as mav
from illuminator_ros.mavlink.component import Endpoint
from illuminator_ros.mavlink.dialect import mavlink
from illuminator_ros.mavlink.schedule import Schedule
from illuminator_ros.payload.identity import Identity

LIGHT = mav.Address(1, 243)
DEFAULT_STATUS = {
    'enable': 0, 'mode_bitmask': 3, 'error_status': 0, 'mode': 1, 'brightness': 100.0,
    'strobe_period': 0.0, 'strobe_duty_cycle': 0.0, 'temp_c': 25.0, 'min_strobe_period': 0.05,
    'max_strobe_period': 10.0,
}


def status_message(uptime_ms: int = 100_000, **fields: Any) -> Any:
    """Return an ILLUMINATOR_STATUS; ``fields`` replace the usual values."""
    return IlluminatorStatus(uptime_ms=uptime_ms, **{**DEFAULT_STATUS, **fields})


class FakeLight(Endpoint):
    """
    One light whose behaviour is a set of attributes, which a test changes as it goes.

    :ivar results: the answers to commands by MAV_CMD, by default MAV_RESULT_ACCEPTED; None means
        no answer. A list is used up from its front; its last entry is kept.
    :ivar applies: whether an accepted command changes the light.
    :ivar brightness_is_switch: whether it is on where the brightness is above 0 (ArduSub).
    :ivar apply_after: s from the acknowledgement to the change.
    :ivar stream: s between statuses, 0 for none.
    :ivar silent: whether it sends nothing.
    :ivar answers: the message ids that it sends on request.
    :ivar pushes: whether a change is followed by a status.
    :ivar targeted: whether acknowledgements carry their target.
    :ivar boot: when it was started; None if its uptime is always 0.
    :ivar fields: the values that it reports.
    :ivar shone: the brightness at each ON, %.
    """

    messages = (mav.CommandLong, mav.CommandInt)

    def __init__(
        self, source: mav.Address = LIGHT, *, heartbeat_type: int
        | None = mavlink.MAV_TYPE_ILLUMINATOR,
        stream: float = 1.0, results: Mapping[int, Any] | None = None, **fields: Any,
    ) -> None:
        super().__init__()
        self.source = source
        self.heartbeat = mav.heartbeat(heartbeat_type or 0)
        self.beats = heartbeat_type is not None
        self.results: dict[int, Any] = dict(results or {})
        self.applies = True
        self.brightness_is_switch = False
        self.apply_after = 0.0
        self._stream, self._silent = stream, False
        self.answers = {STATUS_ID, mav.INFORMATION_ID}
        self.pushes = False
        self.targeted = True
        self.boot: float | None = 0.0
        self.identity = Identity('maker', 'torch', '1.2', '3', 'T-1')
        self.fields = {**DEFAULT_STATUS, **fields}
        self.shone: list[float] = []
        self._status_due, self._beat_due = 0.0, math.inf
        self._to_apply: list[tuple[float, Any]] = []

    def use(self, schedule: Schedule) -> None:
        """Use the schedule of the endpoint that this light is a part of."""
        self.schedule = schedule
        schedule.by(self.poll, 0.0)

    @property
    def silent(self) -> bool:
        return self._silent

    @silent.setter
    def silent(self, value: bool) -> None:
        self._silent = value
        self.schedule.by(self.poll, -math.inf)

    @property
    def stream(self) -> float:
        return self._stream

    @stream.setter
    def stream(self, value: float) -> None:
        self._stream = value
        self.schedule.by(self.poll, -math.inf)

    def link_opened(self, now: float) -> None:
        self._beat_due = now
        self.schedule.by(self.poll, now)

    def restart(self, now: float, **fields: Any) -> None:
        """Restart with the default settings, or others."""
        self.boot = now if self.boot is not None else None
        self.fields = {**DEFAULT_STATUS, **fields}
        self._to_apply.clear()
        self._status_due = self._beat_due = now
        self.schedule.by(self.poll, now)

    def delay_status(self, seconds: float) -> None:
        """Delay the statuses of the stream."""
        self._status_due += seconds

    def receive(self, source: mav.Address, message: Any, now: float) -> None:
        if self.silent or not isinstance(message, mav.CommandLong | mav.CommandInt):
            return
        if (message.target_system, message.target_component) != self.source:
            return
        result = self._result(message.command)
        if result is None:
            return
        target = source if self.targeted else (0, 0)
        self.send(mav.CommandAck(message.command, result, 0, 0, *target))
        if result == mavlink.MAV_RESULT_ACCEPTED:
            self._carry_out(message, now)

    def _result(self, command: int) -> int | None:
        result = self.results.get(command, mavlink.MAV_RESULT_ACCEPTED)
        if isinstance(result, list):
            result = result.pop(0) if len(result) > 1 else result[0]
        return None if result is None else int(result)

    def _carry_out(self, message: Any, now: float) -> None:
        if message.command == mavlink.MAV_CMD_REQUEST_MESSAGE and message.param1 in self.answers:
            self.send(self.status(now) if message.param1 == STATUS_ID else self.information())
        elif message.command == mavlink.MAV_CMD_SET_MESSAGE_INTERVAL:
            self.stream = message.param2 / 1e6
            self._status_due = now + self.stream
            self._set_due()
        elif self.applies and self.apply_after:
            self._to_apply.append((now + self.apply_after, message))
            self._set_due()
        elif self.applies:
            self._apply(message, now)

    def _apply(self, message: Any, now: float) -> None:
        if message.command == mavlink.MAV_CMD_ILLUMINATOR_ON_OFF:
            self.fields['enable'] = int(message.param1)
            if message.param1:
                self.shone.append(self.fields['brightness'])
        elif message.command == mavlink.MAV_CMD_DO_ILLUMINATOR_CONFIGURE:
            self.fields |= {
                'mode': int(message.param1), 'brightness': message.param2,
                'strobe_period': message.param3, 'strobe_duty_cycle': message.param4}
        if self.brightness_is_switch:
            if message.command == mavlink.MAV_CMD_ILLUMINATOR_ON_OFF:
                self.fields['brightness'] = 50.0 if message.param1 else 0.0
            self.fields['enable'] = int(self.fields['brightness'] > 0)
        if self.pushes:
            self.send(self.status(now))

    def uptime_ms(self, now: float) -> int:
        """Return the uptime that it reports."""
        return 0 if self.boot is None else int((now - self.boot) * 1000) % 2 ** 32

    def status(self, now: float) -> Any:
        """Return its ILLUMINATOR_STATUS."""
        return status_message(self.uptime_ms(now), **self.fields)

    def information(self) -> Any:
        """Return its COMPONENT_INFORMATION_BASIC."""
        one = self.identity
        return mav.ComponentInformationBasic(
            0, 0, 0, one.vendor.encode(), one.model.encode(), one.software_version.encode(),
            one.hardware_version.encode(), one.serial_number.encode())

    def send(self, message: Any) -> None:
        """Send any message."""
        self.outgoing.append((self.source, message))

    def poll(self, now: float) -> None:
        for due, message in list(self._to_apply):
            if now >= due:
                self._to_apply.remove((due, message))
                self._apply(message, now)
        if self.beats and not self.silent and now >= self._beat_due:
            self._beat_due = now + 1.0
            self.send(self.heartbeat)
        if self.stream and not self.silent and now >= self._status_due:
            self._status_due = now + self.stream
            self.send(self.status(now))
        self._set_due()

    def _set_due(self) -> None:
        due = [at for at, _ in self._to_apply]
        if not self.silent:
            due += [self._beat_due] * self.beats + [self._status_due] * bool(self.stream)
        self.schedule.at(self.poll, min(due, default=math.inf))
