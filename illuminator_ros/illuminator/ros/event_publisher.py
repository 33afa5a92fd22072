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

"""From the events of one light to topics, parameters and log lines."""

from __future__ import annotations

from collections.abc import Callable
import logging
from typing import Any

from rclpy.node import Node
from sensor_msgs.msg import Temperature
from std_msgs.msg import Bool, Float32, Float64, String, UInt32

from .diagnostics import FlagLog
from .. import events, model
from ..sources import DEFAULT
from ...payload.arbitration import Cause as HolderCause
from ...ros.cdr import temperature
from ...ros.diagnostics import ERROR, WARN
from ...ros.node import NodeInterface, Publication, STREAM_QOS
from ...ros.parameters import DeviceParameters
from ...ros.throttled_log import NodeLog

# One value of each status, by topic. ``enabled`` is first, since callers wait for it.
STATUS_TOPICS: dict[str, tuple[Any, Callable[[model.Status], object]]] = {
    'enabled': (Bool, lambda status: status.enabled),
    'brightness': (Float32, lambda status: status.brightness),
    'mode': (String, lambda status: status.mode.label),
    'strobe_period': (Float32, lambda status: status.strobe_period),
    'strobe_duty_cycle': (Float32, lambda status: status.strobe_duty_cycle),
    'error_flags': (UInt32, lambda status: status.error_flags),
    'uptime': (Float64, lambda status: status.uptime_ms / 1000.0),
}
PUBLICATIONS = (
    *(Publication(name, type_) for name, (type_, _) in STATUS_TOPICS.items()),
    Publication('temperature', Temperature, STREAM_QOS),
    Publication('connected', Bool),
)
# Why a source no longer holds a light.
_REASONS = {
    HolderCause.CLAIM: ', which has taken it from {}',
    HolderCause.RELEASE: ': {} has released it',
    HolderCause.SILENCE: ': {} was silent for source_timeout',
}
_SEVERITIES = {ERROR: logging.ERROR, WARN: logging.WARNING}


class EventPublisher:
    """
    Publishes the events of one light, in the link's thread, without a change of threads.

    :param interface: has :data:`PUBLICATIONS`.
    :param check_diagnostics: called if a level may have changed.
    """

    def __init__(
        self, node: Node, interface: NodeInterface, parameters: DeviceParameters, log: NodeLog, *,
        limits: model.SafetyLimits, frame_id: str, check_diagnostics: Callable[[], None],
    ) -> None:
        self._clock = node.get_clock()
        self._interface = interface
        self._parameters = parameters
        self._log = log
        self._frame_id = frame_id
        self._check_diagnostics = check_diagnostics
        self._identity: object = None
        self._max_brightness = limits.max_brightness
        # The source of setpoints as a part of its topics.
        self._source = ''
        self._limits = model.Limits()
        self._condition: tuple[object, ...] = ()
        self._shared = False
        self._flags = FlagLog()
        # Events have no common content.
        self._handlers: dict[type, Callable[[Any], None]] = {
            events.StatusReceived: self._status_received,
            events.LightConnected: self._connected,
            events.LightLost: self._lost,
            events.LightRestarted: self._restarted,
            events.LightIdentified: self._identified,
            events.LightSwitched: self._switched,
            events.ConfigurationChanged: self._configuration_changed,
            events.ConfigurationRestored: self._configuration_restored,
            events.SetpointFailed: self._setpoint_failed,
            events.SetpointClipped: self._setpoint_clipped,
            events.LimitExceeded: self._limit_exceeded,
            events.AutomaticSwitch: self._automatic_switch,
            events.ChangedByOther: self._changed_by_other,
            events.LightHeld: self._held,
            events.WishFailed: self._wish_failed,
        }
        interface.publish('connected', False)

    def take(self, event: events.AnyLightEvent) -> None:
        """Publish an event."""
        handler = self._handlers.get(type(event))
        if handler is not None:
            handler(event)

    def _status_received(self, event: events.StatusReceived) -> None:
        status = event.status
        publish = self._interface.publish
        for name, (_, read) in STATUS_TOPICS.items():
            # An implausible value is None.
            if (value := read(status)) is not None:
                publish(name, value)
        if event.temperature is not None:
            publish('temperature', temperature(
                event.temperature, self._clock.now().nanoseconds, self._frame_id))
        condition = (status.error_flags, status.invalid, event.shared_address, status.limits)
        if condition != self._condition:
            self._condition = condition
            self._condition_changed(event)

    def _condition_changed(self, event: events.StatusReceived) -> None:
        if event.shared_address and not self._shared:
            self._log.warning(f'several lights answer as {event.address}: parameters stay as '
                              'they are', 'shared')
        self._shared = event.shared_address
        if event.status.limits != self._limits:
            self._limits = event.status.limits
            self._fit(0.0)
        for level, text in self._flags.take(event.status.error_flags, event.received_at):
            self._log.write(_SEVERITIES.get(level, logging.INFO), f'light {event.address}: {text}',
                            'flags')
        self._check_diagnostics()

    def _connected(self, event: events.LightConnected) -> None:
        self._log.info(f'light {event.address} connected', 'connection')
        self._interface.publish('connected', True)
        self._check_diagnostics()

    def _lost(self, event: events.LightLost) -> None:
        self._log.warning(f'light {event.address} lost: {event.reason}', 'connection')
        self._interface.publish('connected', False)
        self._check_diagnostics()

    def _restarted(self, event: events.LightRestarted) -> None:
        self._log.info(f'light {event.address} has restarted', 'restart')
        if event.was_on and event.is_on is False:
            self._log.warning(f'light {event.address} was on before it restarted, and is off now',
                              'restart off')

    def _identified(self, event: events.LightIdentified) -> None:
        identity = event.identity
        if identity != self._identity:
            self._identity = identity
            known = ' '.join(filter(None, (identity.vendor, identity.model)))
            serial = (f', serial number {identity.serial_number}' if identity.serial_number
                      else '')
            self._log.info(f'light {event.address} is {known or "nameless"}{serial}', 'identity')
            self._check_diagnostics()

    def _switched(self, event: events.LightSwitched) -> None:
        if event.left_out is not None:
            way = event.detail if event.origin is events.Origin.REQUEST else event.origin.value
            self._log.info(f'light {event.address} was switched {"on" if event.on else "off"} by '
                           f'{way or "a request"}{_left_out(event.left_out)}', 'switched')

    def _held(self, event: events.LightHeld) -> None:
        change = event.change
        reason = _REASONS[change.cause] if change.before else ''
        self._log.info(f'light {event.address} is held by {change.after or "no source"}'
                       f'{reason.format(change.before)}', 'holder')
        self._source = f'{change.after}/' if change.after not in (None, DEFAULT) else ''
        self._interface.publish('source', change.after or '')
        self._check_diagnostics()

    def _wish_failed(self, event: events.WishFailed) -> None:
        self._log.warning(f'light {event.address} is not as {event.source} has asked for before: '
                          f'{event.message}', 'wish')

    def _automatic_switch(self, event: events.AutomaticSwitch) -> None:
        on = 'on' if event.on else 'off'
        if event.failure:
            self._log.error(f'light {event.address} is not confirmed to be {on}, which is '
                            f'repeated: {event.failure}', 'automatic')
        else:
            self._log.warning(f'light {event.address} is switched {on} by {event.reason}',
                              'automatic')

    def _changed_by_other(self, event: events.ChangedByOther) -> None:
        if not event.undone:
            self._log.error(
                f'light {event.address}: another sender insists on {event.change}, which stays '
                'from now on: only one of the two programs must control the light', 'insists')
        elif event.left_out is not None:
            self._log.warning(
                f'light {event.address} was changed by another sender, which is undone: '
                f'{event.change}{_left_out(event.left_out)}', 'changed')

    def _configuration_changed(self, event: events.ConfigurationChanged) -> None:
        configuration, names = event.configuration, event.names
        if event.cause is events.Cause.LIGHT and event.left_out is not None:
            self._log.info(f'light {event.address} was changed: '
                           f'{configuration.describe(names)}{_left_out(event.left_out)}',
                           'changed')
        if 'strobe_period' in names:
            self._fit(configuration.strobe_period)
        if 'brightness' in names:
            self._fit_brightness(configuration.brightness)
        reason = self._parameters.show({name: _value(configuration, name) for name in names})
        if reason:
            self._log.error(f'cannot update parameters from status: {reason}', 'parameters')
        if 'strobe_period' in names:
            self._fit(0.0)
        if 'brightness' in names:
            self._fit_brightness(0.0)
        self._check_diagnostics()

    def _configuration_restored(self, event: events.ConfigurationRestored) -> None:
        if event.success:
            self._log.info(f'light {event.address} configured: {event.message}', 'configured')
        else:
            self._log.error(f'light {event.address} not configured: {event.message}',
                            'not configured')
        self._check_diagnostics()

    def _setpoint_failed(self, event: events.SetpointFailed) -> None:
        self._log.warning(f'~/{self._source}cmd/brightness: {event.message}', 'setpoint')

    def _setpoint_clipped(self, event: events.SetpointClipped) -> None:
        self._log.warning(f'~/{self._source}cmd/brightness: {event.message}: the limit is sent'
                          f'{_left_out(event.left_out)}', 'clipped')

    def _limit_exceeded(self, event: events.LimitExceeded) -> None:
        if event.impossible:
            self._log.error(f'light {event.address}: {event.impossible}', 'impossible limit')
        if event.excess:
            self._log.warning(f'light {event.address}: {", ".join(event.excess)}',
                              'limit exceeded')
        self._check_diagnostics()

    def _fit_brightness(self, brightness: float) -> None:
        """Show the limit of the brightness, or more where the light shines brighter."""
        if self._max_brightness < 100.0:
            self._parameters.set_high('brightness', max(self._max_brightness, brightness))

    def _fit(self, period: float) -> None:
        """
        Show the longest strobe period that the light reports to be possible.

        :param period: a value that must fit too, s: some lights report more than they allow.
        """
        longest = model.shortest(self._limits.max_strobe_period) if self._limits.known else 0.0
        self._parameters.set_high(
            'strobe_period', max(longest if longest > 0 else model.MAX_STROBE_PERIOD, period))


def _value(configuration: model.Configuration, name: str) -> object:
    value = getattr(configuration, name)
    return value.label if isinstance(value, model.Mode) else value


def _left_out(changes: int) -> str:
    return f' ({changes} changes before were not logged)' if changes else ''
