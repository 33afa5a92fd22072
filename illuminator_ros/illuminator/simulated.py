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
The simulated light: the device's side of the illuminator protocol.

https://mavlink.io/en/services/illuminator.html
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from functools import partial
import math
from typing import Any

from .faults import FAULTS
from .messages import STATUS_ID
from .model import checked, Configuration, flag_names, InvalidValue, Mode
from .simulated_lamp import SimulatedLamp
from .simulated_properties import IlluminatorBehaviour, IlluminatorProperties
from ..mavlink.messages import INFORMATION_ID, MavCmd, MavResult
from ..payload.faults import Behaviour
from ..payload.settings import number
from ..payload.simulated import (
    AnyCommand,
    Change,
    CommandReply,
    ConsoleCommand,
    Description,
    Reply,
    SimulatedComponents,
    SimulatedDevice,
    Snapshot,
)

# K by which the temperature must change to deserve a line of its own.
TEMPERATURE_STEP = 5.0
# % of a strobe that is started by hand while the duty cycle is 0 %.
DEFAULT_DUTY_CYCLE = 50.0


_number = number(-math.inf, math.inf)
_celsius = number(-273.15, 1000.0)


def _strobe(light: SimulatedIlluminator, words: list[str], now: float) -> Change:
    # 0 % is dark, so that a period alone would end the light.
    duty_cycle = (_number(words[1]) if len(words) > 1
                  else light.lamp.configuration.strobe_duty_cycle or DEFAULT_DUTY_CYCLE)
    return light.press(now, strobe_period=_number(words[0]), strobe_duty_cycle=duty_cycle)


COMMANDS: dict[str, ConsoleCommand[SimulatedIlluminator, Change]] = {
    'on': ConsoleCommand('on', 'switch on, as by a button on the light',
                         lambda light, words, now: light.press(now, enabled=True)),
    'off': ConsoleCommand('off', 'switch off, likewise',
                          lambda light, words, now: light.press(now, enabled=False)),
    'brightness': ConsoleCommand(
        'brightness PERCENT', 'set it, likewise',
        lambda light, words, now: light.press(now, brightness=_number(words[0])), (1,)),
    'mode': ConsoleCommand(
        'mode MODE', 'internal_control or external_sync, likewise',
        lambda light, words, now: light.press(now, mode=words[0]), (1,)),
    'strobe': ConsoleCommand(
        'strobe S [PERCENT]', 'period and duty cycle, likewise; 0 ends it', _strobe, (1, 2)),
    'ambient': ConsoleCommand(
        'ambient DEG_C', 'change the ambient temperature',
        lambda light, words, now: partial(light.lamp.set_ambient, _celsius(words[0]), now),
        (1,)),
    'temperature': ConsoleCommand(
        'temperature DEG_C', "change the light's own temperature",
        lambda light, words, now: partial(light.lamp.heat_to, _celsius(words[0]), now), (1,)),
}


class SimulatedIlluminator(SimulatedDevice):
    """A simulated light, without the link: see :class:`SimulatedDevice`."""

    changes = frozenset({MavCmd.ILLUMINATOR_ON_OFF, MavCmd.DO_ILLUMINATOR_CONFIGURE})
    faults = FAULTS
    commands = COMMANDS
    behaviour: IlluminatorBehaviour
    lamp: SimulatedLamp

    def __init__(self, properties: IlluminatorProperties) -> None:
        super().__init__(properties.behaviour)
        self.properties = properties
        self.lamp = SimulatedLamp(properties)
        self.lamp.thermal.sensor_failed = self.behaviour.thermistor_failed

    def behave(self, behaviour: Behaviour, now: float) -> None:
        """See :meth:`SimulatedDevice.behave`."""
        self.lamp.warm(now)
        super().behave(behaviour, now)
        self.lamp.thermal.sensor_failed = self.behaviour.thermistor_failed

    def restart(self, now: float) -> None:
        """See :meth:`SimulatedDevice.restart`."""
        self.lamp.restart(now)

    def streams(self) -> Mapping[int, float]:
        """See :meth:`SimulatedDevice.streams`."""
        return {STATUS_ID: self.properties.status_interval}

    def message(self, message_id: int, now: float) -> Any:
        """See :meth:`SimulatedDevice.message`."""
        if message_id == STATUS_ID:
            return self.status(now)
        if message_id == INFORMATION_ID and self.behaviour.identifies:
            return self.lamp.information(self.behaviour, now)
        return None

    def status(self, now: float) -> Any:
        """Return the ILLUMINATOR_STATUS of this moment."""
        return self.lamp.status(self.behaviour, now)

    def execute(self, command: AnyCommand, now: float) -> Reply:
        """See :meth:`SimulatedDevice.execute`."""
        self.lamp.warm(now)
        if command.command == MavCmd.ILLUMINATOR_ON_OFF:
            return self._switch(command.param1)
        if command.command == MavCmd.DO_ILLUMINATOR_CONFIGURE:
            return self._configure(
                command.param1, command.param2, command.param3, command.param4)
        return None

    def _switch(self, param: float) -> CommandReply:
        valid = param in (0.0, 1.0) or self.behaviour.accepts_out_of_range
        on = param == 1.0 and not (self.behaviour.toggles and self.lamp.enabled)
        return CommandReply(
            MavResult.ACCEPTED if valid else MavResult.DENIED, lambda: self.lamp.switch(
                on, brightness_is_switch=self.behaviour.brightness_is_switch))

    def _configure(
        self, mode: float, brightness: float, period: float, duty_cycle: float,
    ) -> CommandReply:
        behaviour, limits = self.behaviour, self.properties.limits
        known = mode in (Mode.INTERNAL_CONTROL, Mode.EXTERNAL_SYNC)
        configuration = Configuration(
            Mode(int(mode)) if known else self.lamp.configuration.mode, brightness, period,
            duty_cycle)
        try:
            if mode not in self.properties.modes:
                raise InvalidValue(f'mode {mode}')
            if period and not behaviour.measures:
                raise InvalidValue('this light does not strobe')
            for name, value in (('brightness', brightness), ('strobe_period', period),
                                ('strobe_duty_cycle', duty_cycle)):
                if not (math.isnan(value) and behaviour.accepts_nan):
                    checked(name, value, limits)
        except InvalidValue:
            accepted = behaviour.accepts_out_of_range
        else:
            accepted = True
        return CommandReply(
            MavResult.ACCEPTED if accepted else MavResult.DENIED, lambda: self.lamp.configure(
                configuration, brightness_is_switch=behaviour.brightness_is_switch))

    def press(self, now: float, *, enabled: bool | None = None, **changes: Any) -> Change:
        """
        Return the change that a button on the light makes.

        :raises InvalidValue: if the light cannot be set so.
        """
        self.lamp.warm(now)
        configuration = self.lamp.configuration.with_changes({
            name: checked(name, value, self.properties.limits)
            for name, value in changes.items()})

        def change() -> None:
            is_switch = self.behaviour.brightness_is_switch
            if changes:
                self.lamp.configure(configuration, brightness_is_switch=is_switch)
            if enabled is not None:
                self.lamp.switch(enabled, brightness_is_switch=is_switch)
        return change

    def snapshot(self, now: float) -> Snapshot:
        """See :meth:`SimulatedDevice.snapshot`."""
        status, temperature = self.status(now), self.lamp.thermal.temperature
        period, duty = status.strobe_period, status.strobe_duty_cycle
        mode = Mode(status.mode)
        state = ('ON ' if self.lamp.enabled else 'off', f'{status.brightness:>5.3g} %',
                 f'{f"strobe {period:g} s, {duty:g} %" if period else "no strobe":18}')
        notes = tuple(filter(None, (
            '' if mode is Mode.INTERNAL_CONTROL else mode.label,
            ', '.join(flag_names(status.error_status)))))
        return Snapshot('  '.join((*state, f'{temperature:6.1f} degC', *notes)),
                        (*state, *notes), temperature / TEMPERATURE_STEP)


def describe(properties: IlluminatorProperties) -> Description[SimulatedIlluminator]:
    """Return the simulated component that has these properties."""
    return Description(properties.address, SimulatedIlluminator(properties), properties.name,
                       properties.seed)


def simulated_lights(
    properties: Iterable[IlluminatorProperties], now: float,
) -> SimulatedComponents[SimulatedIlluminator]:
    """Return an endpoint of simulated lights that are powered on now, s."""
    return SimulatedComponents(map(describe, properties), now)
