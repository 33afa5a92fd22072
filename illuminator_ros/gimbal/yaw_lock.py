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

"""The requests for the yaw lock of a gimbal."""

from __future__ import annotations

from collections.abc import Callable
import math

from .commands import Flag
from .setpoint_stream import REPEATS
from ..mavlink.command_sender import format_seconds
from ..mavlink.dialect import flag_names
from ..payload.confirmed_command import Done, Result
from ..payload.device_property import MAX_CALLERS
from ..payload.messages import GimbalDeviceAttitudeStatus
from ..payload.mount_attitude import YawFrame

# s from a request until it has failed.
LIMIT = 2.0
# s by which a status may be late: one that shows the lock sooner may be older than the request.
STATUS_DELAY = 0.2


class YawLock:
    """
    Sets the yaw lock with a rate of zero, until the status of the device shows it.

    A :class:`~..payload.device_property.Property` would need a command. The command with the
    flag, MAV_CMD_DO_GIMBAL_MANAGER_PITCHYAW, turns the gimbal: PX4 reads its unset angles as 0, it
    has no roll, and the other yaw frame needs the heading. No I/O; times are s.

    :param send: sends the rate of zero, whose yaw frame sets the lock.
    """

    def __init__(self, send: Callable[[YawFrame, float], None]) -> None:
        self._send = send
        self._wanted: Flag | None = None
        self._since = math.inf
        self._flags: int | None = None
        self._resend: list[float] = []
        self._callers: list[Done] = []

    def want(self, flag: Flag, now: float, done: Done) -> None:
        """
        Set or clear the lock; an equal request under way is shared, another one superseded.

        :param done: called once with the result.
        """
        if flag is not self._wanted:
            self.cancel(f'superseded by {flag.goal}', now, superseded=True)
            self._wanted, self._since, self._flags = flag, now, None
        elif len(self._callers) >= MAX_CALLERS:
            done(Result(False, f'{MAX_CALLERS} requests are waiting already'), now)
            return
        self._callers.append(done)
        self._resend = [now + delay for delay in REPEATS]
        self._send(YawFrame.EARTH if flag.is_set else YawFrame.VEHICLE, now)

    def stop_resending(self) -> None:
        """Send nothing more; the status may still show the lock."""
        self._resend = []

    def cancel(self, message: str, now: float, *, superseded: bool = False) -> None:
        """End the request."""
        self._finish(Result(False, message, superseded=superseded), now)

    def reported(self, status: GimbalDeviceAttitudeStatus, now: float) -> None:
        """Take a status of the device."""
        wanted = self._wanted
        if wanted is None or now < self._since + STATUS_DELAY:
            return
        self._flags = status.flags
        if bool(status.flags & wanted.flag) is wanted.is_set:
            took = format_seconds(now - self._since)
            self._finish(Result(
                True, f'{wanted.goal}, confirmed by {status.msgname} ({took})'), now)

    def poll(self, now: float) -> None:
        """Send the rate of zero again, or fail, if that is due."""
        wanted = self._wanted
        if wanted is None:
            return
        if now >= self._since + LIMIT:
            name = GimbalDeviceAttitudeStatus.msgname
            shown = (f'no {name} came' if self._flags is None else f'{name} shows ' + (
                ', '.join(flag_names('GIMBAL_DEVICE_FLAGS', self._flags)) or 'no flags'))
            advice = '; the device may need the heading of the vehicle' if wanted.is_set else ''
            self._finish(Result(
                False, f'{wanted.goal} not confirmed: {shown} within {LIMIT:g} s{advice}'), now)
        elif self._resend and now >= self._resend[0]:
            del self._resend[0]
            self._send(YawFrame.EARTH if wanted.is_set else YawFrame.VEHICLE, now)

    def next_deadline(self) -> float:
        """Return when :meth:`poll` is due, infinity if never."""
        return math.inf if self._wanted is None else min([self._since + LIMIT, *self._resend])

    def _finish(self, result: Result, now: float) -> None:
        callers, self._callers, self._wanted = self._callers, [], None
        for done in callers:
            done(result, now)
