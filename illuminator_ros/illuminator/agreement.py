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

"""Changing the configuration that is agreed with a light: what is under way, and to be sent."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
import math
from typing import Any, TYPE_CHECKING

from .agreed import Agreed
from .comparison import unexplained
from .configure import Configure
from .events import Cause, ConfigurationRestored, SetpointFailed
from .model import checked, FIELDS, InvalidValue, NOTHING, Status
from .operation import Done, Result
from .operation_queue import OperationQueue

if TYPE_CHECKING:
    from .light import Light

# s; rqt_reconfigure gives up after 1.0 s, and a set must have answered by then.
CONFIGURE_LIMIT = 0.85
# s between tries of overrides and restored configurations that got no answer.
RESTORE_INTERVAL = 2.0
# How often a light may accept one of these and show another: then it is left alone.
MAX_CONTRADICTIONS = 3
# s without a status after which a complete set of overrides is sent all the same.
STATUS_PATIENCE = 3.0


class Agreement(Agreed):
    """What a light is configured to be, and is to become."""

    def __init__(self, light: Light) -> None:
        super().__init__(light)
        self._queue = OperationQueue()
        self._setpoint: float | None = None
        # Overrides, or what a restart has undone: still to be sent.
        self._wanted: dict[str, Any] = {}
        self._wanted_at = 0.0
        # Whether it was said that they wait in vain.
        self._told = False
        self._restoring = False
        self._contradictions = 0
        # Whether it is open what the last command did: it failed, or was not waited for.
        self._doubtful = False

    @property
    def changing(self) -> bool:
        """Whether a command of ours is under way."""
        return self._queue.current is not None

    # Requests

    def configure(self, changes: Mapping[str, Any], now: float, done: Done) -> None:
        """
        Change some fields with one command.

        :param changes: values by name, see :data:`~.model.FIELDS`; if one is wrong none is sent.
        :param done: called once with the result.
        """
        if unreachable := self._light.unreachable(now):
            done(Result(False, unreachable), now)
            return
        try:
            values = self.check(changes)
            self.with_changes(values)
        except InvalidValue as error:
            done(Result(False, str(error), permanent=True), now)
            return

        def finished(result: Result, now: float) -> None:
            if result.success:
                self._want_no_more(values)
            done(result, now)

        self._submit(values, now, finished)
        self._light.changed()

    def set_brightness(self, brightness: float, now: float) -> None:
        """
        Take a setpoint of a stream: the newest wins, and one command is under way at a time.

        :param brightness: %, checked.
        """
        if unreachable := self._light.unreachable(now):
            self._setpoint_failed(unreachable)
            return
        current = self._queue.current
        if (isinstance(current, Configure) and current.stream and not current.finished
                and current.wanted.brightness == brightness):
            # Under way already; what has come in between is overtaken.
            self._setpoint = None
            return
        self._setpoint = brightness
        self.poll(now)
        self._light.changed()

    def want(self, values: Mapping[str, Any], now: float) -> None:
        """
        Have values sent as soon as the light has reported its configuration.

        :param values: by name, checked but for the limits that the light reports.
        """
        self._wanted.update(values)
        self._wanted_at = now
        self._contradictions = 0
        self._light.changed()

    def cancel(self, now: float) -> None:
        """End all changes, and want nothing any more."""
        self._wanted.clear()
        self._restoring = False
        self._setpoint = None
        self._queue.cancel(now)

    def _want_no_more(self, names: Iterable[str]) -> None:
        """Note that fields have been set otherwise, or not at all: they are not to be restored."""
        for name in list(names):
            self._wanted.pop(name, None)
        if not self._wanted:
            self._restoring = False

    def _submit(
        self, values: Mapping[str, Any], now: float, done: Done, *, stream: bool = False,
    ) -> None:
        def finished(result: Result, now: float) -> None:
            self._doubtful = not result.success or result.superseded
            if result.contradicted:
                self._unfulfilled = operation.wanted
                self.discrepancy = result.message
            done(result, now)

        operation = Configure(
            self._light, values, finished, now=now, limit=now + CONFIGURE_LIMIT, stream=stream)
        self._queue.submit(operation, now)

    # What the light says

    def restarted(self, now: float) -> None:
        """Note that the light has restarted, so what was agreed may be gone."""
        if self._light.settings.restore_configuration and self.agreed is not None:
            agreed = self.agreed
            # Overrides that have not been sent yet come before what was there without them.
            self.want({**{name: getattr(agreed, name) for name in FIELDS
                          if name != 'mode' or agreed.mode}, **self._wanted}, now)
            self._restoring = True

    def lost(self, reason: str) -> None:
        """Note that the light is lost: a setpoint of now must not take effect when it is back."""
        if self._setpoint is not None:
            self._setpoint = None
            self._setpoint_failed(f'the light is lost: {reason}')

    def take_status(self, status: Status, sent_by: float, now: float) -> None:
        """
        Confirm what is under way, or follow what somebody else has changed.

        :param sent_by: the latest time at which the status can have been sent.
        """
        current = self._queue.current
        if current is not None:
            current.status(status, sent_by, now)
            return
        if self.agreed is None and not status.complete:
            return
        reported = status.configuration(self.agreed or NOTHING)
        if self._unfulfilled and not unexplained(
                self._unfulfilled, reported, status.error_flags, step=True):
            self._fulfilled()
        if self.agreed is None:
            self._adopt(reported, Cause.FIRST_STATUS)
        elif self._restoring:
            wanted = self.agreed.with_changes(self._wanted)
            if not unexplained(wanted, reported, status.error_flags, step=True):
                # It kept its configuration, or got it back from somebody else.
                self._want_no_more(self._wanted)
        elif self._light.sharing.settled and not self._light.sharing.recognised:
            self._follow(status, self.agreed, reported)

    # Time

    def poll(self, now: float) -> None:
        """Send what is still to be sent, one command at a time."""
        if self._setpoint is not None and self._replaceable:
            self._replaceable.supersede(now)
        self._queue.poll(now)
        if self._queue.current is not None or not self._light.connected:
            return
        # First what is sent once and tried again seldom: a stream of setpoints never ends.
        if now >= self._wanted_due:
            self._send_wanted(now)
        if self._setpoint is not None and self._queue.current is None:
            value, self._setpoint = self._setpoint, None
            self._send_setpoint(value, now)

    def _setpoint_failed(self, message: str) -> None:
        self._light.emit(SetpointFailed(self._light.address, message))

    def _restored(self, success: bool, message: str) -> None:
        self._light.emit(ConfigurationRestored(self._light.address, success, message))

    @property
    def _replaceable(self) -> Configure | None:
        """Return the setpoint that is accepted but not confirmed: a newer one need not wait."""
        current = self._queue.current
        if isinstance(current, Configure) and current.stream and current.confirming:
            return current
        return None

    @property
    def _wanted_due(self) -> float:
        """When the wanted values are to be sent."""
        if self._wanted and self.agreed is not None:
            return self._wanted_at
        # A light that sends no status has nothing to add to a complete set.
        if all(name in self._wanted for name in FIELDS) or self._wanted and not self._told:
            return self._wanted_at + STATUS_PATIENCE
        return math.inf

    def _send_setpoint(self, value: float, now: float) -> None:
        if self.agreed is not None and self.agreed.brightness == value and not self._doubtful:
            return

        def finished(result: Result, now: float) -> None:
            if result.success:
                self._want_no_more(['brightness'])
            else:
                self._setpoint_failed(result.message)

        try:
            self._submit({'brightness': value}, now, finished, stream=True)
        except InvalidValue as error:
            self._setpoint_failed(str(error))

    def _send_wanted(self, now: float) -> None:
        self._wanted_at = now + RESTORE_INTERVAL
        light = self._light
        try:
            self.with_changes(self._wanted)
        except InvalidValue as error:
            # They still wait for a status; but whoever gave them should know.
            self._told = True
            self.discrepancy = f'{", ".join(self._wanted)} not sent: {error}'
            self._restored(False, self.discrepancy)
            return
        for name, value in list(self._wanted.items()):
            try:
                checked(name, value, light.limits)
            except InvalidValue as error:
                self._want_no_more([name])
                self._restored(False, str(error))
        if self._wanted_due == math.inf:
            return

        def finished(result: Result, now: float) -> None:
            self._contradictions += result.contradicted
            if (result.success or result.permanent
                    or self._contradictions >= MAX_CONTRADICTIONS):
                self._want_no_more(self._wanted)
                self._restored(result.success, result.message)
            if not result.success:
                self.discrepancy = result.message

        self._submit(self.check(self._wanted), now, finished)

    def next_deadline(self) -> float:
        """Return when :meth:`poll` has something to do."""
        if not self._light.connected:
            return self._queue.next_deadline()
        if self._setpoint is not None and (self._queue.current is None or self._replaceable):
            return -math.inf
        if self._queue.current is not None:
            return self._queue.next_deadline()
        return self._wanted_due
