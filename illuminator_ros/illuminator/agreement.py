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

"""The configuration agreed with a light: who changed it last, and what is still to be sent."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
import math
from typing import Any, TYPE_CHECKING

from .comparison import unexplained
from .configure import Configure
from .model import checked, Configuration, FIELDS, InvalidValue, NOTHING, Status
from .observer import Cause
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


class Agreement:
    """
    What a light is configured to be.

    :ivar agreed: the configuration that was last accepted from us or, where somebody else has
        changed it since, reported; None before the first status.
    :ivar discrepancy: in what the light differs from what it has accepted, '' if in nothing.
    """

    def __init__(self, light: Light) -> None:
        self._light = light
        self.agreed: Configuration | None = None
        self.discrepancy = ''
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
        # What the light has accepted and then not shown.
        self._unfulfilled: Configuration | None = None
        # What was last asked for or told: small steps away from it add up to a change.
        self._reference: Configuration | None = None

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

    def check(self, changes: Mapping[str, Any]) -> dict[str, Any]:
        """
        Return the changes, ready to be sent.

        :raises InvalidValue: if one must not be.
        """
        limits = self._light.limits
        return {name: checked(name, value, limits) for name, value in changes.items()}

    def with_changes(self, changes: Mapping[str, Any]) -> Configuration:
        """
        Return the agreed configuration with changes.

        :raises InvalidValue: if nothing is agreed yet and the changes are not complete.
        """
        if self.agreed is not None:
            return self._sendable(self.agreed, changes).with_changes(changes)
        missing = [name for name in FIELDS if name not in changes]
        if missing:
            raise InvalidValue(
                'the light has not reported its configuration yet, so '
                f'{", ".join(missing)} must be set in the same call')
        return Configuration(**changes)

    def _sendable(self, agreed: Configuration, changes: Mapping[str, Any]) -> Configuration:
        """
        Return what is agreed but for what the light's own limits rule out.

        A light that has once reported such a value would deny every change that carries it.
        """
        status, limits = self._light.status, self._light.limits
        if status is None:
            return agreed
        reported = status.configuration(agreed)
        ruled_out = {}
        for name in FIELDS:
            try:
                if name != 'mode' and name not in changes:
                    checked(name, getattr(agreed, name), limits)
            except InvalidValue:
                ruled_out[name] = getattr(reported, name)
        return agreed.with_changes(ruled_out)

    def set_brightness(self, brightness: float, now: float) -> None:
        """
        Take a setpoint of a stream: the newest wins, and one command is under way at a time.

        :param brightness: %, checked.
        """
        if unreachable := self._light.unreachable(now):
            self._light.observer.setpoint_failed(self._light, unreachable)
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

    def agree(self, wanted: Configuration, status: Status | None) -> None:
        """
        Note that the light has accepted a configuration, with the status that shows it.

        What the status shows in other steps than asked for is what is agreed; what it shows
        otherwise for a good reason (heat, external sync) is not.
        """
        if status:
            reported = status.configuration(wanted)
            far = wanted.differences(reported)
            wanted = wanted.with_changes({
                name: getattr(reported, name)
                for name in wanted.differences(reported, step=False) if name not in far})
        self._fulfilled()
        self._adopt(wanted, Cause.REQUEST)

    def _fulfilled(self) -> None:
        self._unfulfilled = None
        self.discrepancy = ''

    def _adopt(self, configuration: Configuration, cause: Cause) -> None:
        old, self.agreed = self.agreed, configuration
        if cause is not Cause.ROUNDING:
            self._reference = configuration
        names = [name for name in FIELDS
                 if old is None or getattr(old, name) != getattr(configuration, name)]
        if names:
            self._light.observer.configured(self._light, configuration, names, cause)

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
            self._light.observer.setpoint_failed(self._light, f'the light is lost: {reason}')

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

    def _follow(self, status: Status, agreed: Configuration, reported: Configuration) -> None:
        # Under external sync too: somebody else may have changed what cannot be told apart.
        names = unexplained(agreed, reported, status.error_flags, step=False, external=False)
        if names:
            far = unexplained(
                self._reference or agreed, reported, status.error_flags, step=True,
                external=False)
            self._adopt(
                agreed.with_changes({name: getattr(reported, name) for name in names}),
                Cause.LIGHT if far else Cause.ROUNDING)

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
                self._light.observer.setpoint_failed(self._light, result.message)

        try:
            self._submit({'brightness': value}, now, finished, stream=True)
        except InvalidValue as error:
            self._light.observer.setpoint_failed(self._light, str(error))

    def _send_wanted(self, now: float) -> None:
        self._wanted_at = now + RESTORE_INTERVAL
        observer, light = self._light.observer, self._light
        try:
            self.with_changes(self._wanted)
        except InvalidValue as error:
            # They still wait for a status; but whoever gave them should know.
            self._told = True
            self.discrepancy = f'{", ".join(self._wanted)} not sent: {error}'
            observer.restored(light, False, self.discrepancy)
            return
        for name, value in list(self._wanted.items()):
            try:
                checked(name, value, light.limits)
            except InvalidValue as error:
                self._want_no_more([name])
                observer.restored(light, False, str(error))
        if self._wanted_due == math.inf:
            return

        def finished(result: Result, now: float) -> None:
            self._contradictions += result.contradicted
            if (result.success or result.permanent
                    or self._contradictions >= MAX_CONTRADICTIONS):
                self._want_no_more(self._wanted)
                observer.restored(light, result.success, result.message)
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
