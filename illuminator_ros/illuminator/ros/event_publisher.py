# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Publishes the events of one light as topics, parameters and log lines."""

from __future__ import annotations

from collections.abc import Callable
import logging
import operator

from rclpy.node import Node
from sensor_msgs.msg import Temperature
from std_msgs.msg import Bool, Float32, Float64, String, UInt32

from .diagnostics import changing_states, FlagLog
from .parameters import device_parameters
from .. import events, model
from ...mavlink.dialect import mavlink
from ...mavlink.messages import Address
from ...payload.command_sources import DEFAULT
from ...payload.device_events import DeviceConnected, DeviceDisconnected, DeviceHeld
from ...ros.device_nodes import publish_event
from ...ros.diagnostics import ERROR, WARN
from ...ros.node import Entity, NodeEntities
from ...ros.parameters import DeviceParameters
from ...ros.qos import STREAM_QOS
from ...ros.throttled_log import NodeLog

# One value of each status, by topic. ``enabled`` is first, since callers wait for it.
STATUS_TOPICS: dict[Entity, Callable[[model.Status], object]] = {
    Entity('enabled', Bool, 'the light is on'): operator.attrgetter('enabled'),
    Entity('brightness', Float32, '%'): operator.attrgetter('brightness'),
    Entity('mode', String, '`unknown`, `internal_control`, `external_sync`'):
        operator.attrgetter('mode.label'),
    Entity('strobe_period', Float32, 's, 0 = no strobe'): operator.attrgetter('strobe_period'),
    Entity('strobe_duty_cycle', Float32, '%'): operator.attrgetter('strobe_duty_cycle'),
    Entity('error_flags', UInt32, 'ILLUMINATOR_ERROR_FLAGS as sent: 1 thermal throttling, '
           '2 over-temperature shutdown, 4 thermistor failure'):
        operator.attrgetter('error_flags'),
    Entity('uptime', Float64, 's'): lambda status: status.uptime_ms / 1000.0,
}
PUBLICATIONS = (
    Entity('connected', Bool, 'the bridge hears the light; on change'),
    *STATUS_TOPICS,
    Entity('temperature', Temperature, 'degC; not published if the light does not measure it '
           'or its sensor failed', STREAM_QOS),
)
# Events that may change a level.
_DIAGNOSED = (DeviceConnected, DeviceDisconnected, events.LightIdentified, DeviceHeld,
              events.StatesChanging, events.ConfigurationChanged, events.ConfigurationRestored,
              events.LimitExceeded)
ON_OFF = mavlink.MAV_CMD_ILLUMINATOR_ON_OFF
CONFIGURE = mavlink.MAV_CMD_DO_ILLUMINATOR_CONFIGURE
_SEVERITIES = {ERROR: logging.ERROR, WARN: logging.WARNING}


class EventPublisher:
    """
    Publishes the events of one light, in the link's thread.

    :param interface: has :data:`PUBLICATIONS`.
    :param check_diagnostics: called if a level may have changed.
    :param sender_of: returns who has lately commanded a light through this program, given its
        address, the command, and the first parameter, None for any.
    """

    def __init__(
        self, node: Node, interface: NodeEntities, parameters: DeviceParameters, log: NodeLog, *,
        limits: model.SafetyLimits, frame_id: str, check_diagnostics: Callable[[], None],
        sender_of: Callable[[Address, int, float | None], Address | None],
    ) -> None:
        self._clock = node.get_clock()
        self._interface = interface
        self._parameters = parameters
        self._log = log
        self._frame_id = frame_id
        self._check_diagnostics = check_diagnostics
        self._sender_of = sender_of
        self._identity: object = None
        self._limits = limits
        # The source of setpoints, as a prefix of its topics.
        self._source = ''
        self._strobe_range = model.StrobeRange()
        self._condition: tuple[object, ...] = ()
        self._flags = FlagLog()
        interface.publish('connected', False)
        self._fit()

    def change_limits(self, limits: model.SafetyLimits) -> None:
        """Show other limits in the descriptions of the parameters."""
        if limits == self._limits:
            return
        self._limits = limits
        self._parameters.respecify(device_parameters(limits))
        self._fit()

    def handle(self, event: events.LightEvent) -> None:
        """Publish an event."""
        if isinstance(event, events.StatusReceived):
            self._status_received(event)
            return
        log, light = self._log, f'light {event.key}'
        publish_event(event, 'light', log, self._interface)
        match event:
            case events.StatesChanging(is_changing=True):
                log.warning(f'{changing_states(event.key)}; parameters stay as they are '
                            'meanwhile', 'changing')
            case events.LightRestarted(was_on=was_on, is_on=is_on):
                log.info(f'{light} has restarted', 'restart')
                if was_on and is_on is False:
                    log.warning(f'{light} was on before it restarted, and is off now',
                                'restart off')
            case events.LightIdentified(identity=identity) if identity != self._identity:
                self._identity = identity
                known = ' '.join(filter(None, (identity.vendor, identity.model)))
                serial = identity.serial_number and f', serial number {identity.serial_number}'
                log.info(f'{light} is {known or "nameless"}{serial}', 'identity')
            case events.LightSwitched(on=on, origin=origin):
                by = self._by(event.key, ON_OFF, on) if origin == events.OTHER_SENDER else ''
                log.info(f'{light} was switched {_state(on)} by {origin}{by}', 'switched')
            case DeviceHeld(change=change):
                self._source = f'{change.after}/' if change.after not in (None, DEFAULT) else ''
            case events.DesiredStateFailed(source=source, message=message):
                log.warning(f'{light} does not have the state that {source} requested: {message}',
                            'desired')
            # One that succeeds is logged when the light shows it.
            case events.AutomaticSwitch(on=on, reason=reason, failure=failure) if failure:
                log.warning(f'{light}: {_state(on).upper()} by {reason} is not confirmed and will '
                            f'be repeated: {failure}', 'automatic')
            case events.ConfigurationChanged():
                self._configuration_changed(event)
            case events.ConfigurationRestored(success=True, message=message):
                log.info(f'{light} configured: {message}', 'configured')
            case events.ConfigurationRestored(message=message, is_final=False):
                log.warning(f'{light} not configured: {message}', 'not configured')
            case events.ConfigurationRestored(message=message):
                log.error(f'{light} not configured: {message}', 'not configured')
            case events.SetpointFailed(message=message):
                topic = f'{self._source}cmd/brightness'
                log.stream_failed(f'~/{topic}: {message}', topic)
            case events.SetpointClipped(message=message):
                log.stream_failed(
                    f'~/{self._source}cmd/brightness: {message}: the limit is sent', 'clipped')
            case events.LimitExceeded(excess=excess, impossible=impossible):
                if impossible:
                    log.error(f'{light}: {impossible}', 'impossible limit')
                if excess:
                    again = '; it does not keep the limit' if event.is_again else ''
                    log.warning(f'{light}: {", ".join(excess)}{again}', 'limit exceeded')
        if isinstance(event, _DIAGNOSED):
            self._check_diagnostics()

    def _by(self, light: Address, command: int, first_param: float | None = None) -> str:
        """Return the sender of a command that another one gave, '' if it did not pass here."""
        sender = self._sender_of(light, command, first_param)
        return f' {sender}' if sender else ''

    def _status_received(self, event: events.StatusReceived) -> None:
        status, values = event.status, {}
        for topic, read in STATUS_TOPICS.items():
            # An implausible value is None.
            if (value := read(status)) is not None:
                values[topic.name] = value
        if event.temperature is not None:
            message = Temperature(temperature=event.temperature)
            message.header.stamp = self._clock.now().to_msg()
            message.header.frame_id = self._frame_id
            values['temperature'] = message
        self._interface.publish_all(values)
        condition = (status.error_flags, status.invalid, status.strobe_range)
        if condition != self._condition:
            self._condition = condition
            self._condition_changed(event)

    def _condition_changed(self, event: events.StatusReceived) -> None:
        if event.status.strobe_range != self._strobe_range:
            self._strobe_range = event.status.strobe_range
            self._fit()
        for level, text in self._flags.note(event.status.error_flags, event.received_at):
            self._log.write(_SEVERITIES.get(level, logging.INFO), f'light {event.key}: {text}',
                            'flags')
        self._check_diagnostics()

    def _configuration_changed(self, event: events.ConfigurationChanged) -> None:
        configuration, names = event.configuration, event.names
        if event.cause is events.ChangeCause.LIGHT:
            by = self._by(event.key, CONFIGURE)
            self._log.info(f'light {event.key} was changed: {configuration.describe(names)}'
                           f'{by and " by"}{by}', 'changed')
        elif event.cause is events.ChangeCause.LATE_EFFECT:
            self._log.info(f'light {event.key}: {configuration.describe(names)}, '
                           f'{events.LATE_EFFECT}', 'changed')
        self._parameters.show({name: _value(configuration, name) for name in names})

    def _fit(self) -> None:
        """Show the limit of the brightness, and the longest strobe period that is possible."""
        possible = self._strobe_range
        longest = model.shortest(possible.max_strobe_period) if possible.known else 0.0
        self._parameters.set_high('brightness', self._limits.max_brightness)
        self._parameters.set_high(
            'strobe_period', longest if longest > 0 else model.MAX_STROBE_PERIOD)


def _value(configuration: model.Configuration, name: str) -> object:
    value = getattr(configuration, name)
    return value.label if isinstance(value, model.Mode) else value


def _state(on: bool) -> str:
    return 'on' if on else 'off'
