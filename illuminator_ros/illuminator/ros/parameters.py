# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The parameters of the light's nodes."""

from __future__ import annotations

from collections.abc import Mapping
import functools
import math
import re
import reprlib
from typing import NamedTuple

from rclpy.node import Node

from ..model import MAX_STROBE_PERIOD, MODES, SafetyLimits
from ..settings import LightSettings
from ...mavlink.messages import Address
from ...ros.command_sources import SOURCE_PARAMETERS, source_settings
from ...ros.parameters import (
    by_name,
    declare_given,
    ParameterError,
    ParameterSpec,
    Values,
)
from ...ros.transforms import PUBLISH_TF

LIGHT_PARAMETERS = (
    ParameterSpec('target_system', 0, 'system id of the light to serve; 0 = any', low=0,
                  high=255),
    ParameterSpec('target_component', 0, 'component id of the light to serve; 0 = any', low=0,
                  high=255),
    ParameterSpec('only_target', False, 'leave lights alone that the target does not select',
                  restricts=True),
    ParameterSpec('names', [], 'node names of further lights, such as 1/244=belly'),
    ParameterSpec('heartbeat_timeout', 3.0, 'silence after which the light is lost', 's', 1.1,
                  3600.0),
    ParameterSpec('status_interval', 0.0, "period of the light's status; 0 = its own", 's', 0.0,
                  3600.0),
    ParameterSpec('frame_id', 'illuminator', 'frame of temperature and beam'),
    ParameterSpec('beam_range', 0.0, 'length of the cone on ~/beam; 0 = no ~/beam', 'm', 0.0,
                  10_000.0),
    ParameterSpec('beam_angle', 0.5, 'full opening angle of the cone on ~/beam', 'rad', 0.01,
                  3.0),
    ParameterSpec('mounted_on', 0, 'gimbal device id of the mount; 0 = as the light reports',
                  low=0, high=255),
    PUBLISH_TF,
    ParameterSpec('off_on_shutdown', False, 'switch the lights off when the node ends',
                  restricts=True),
    ParameterSpec('restore_configuration', True,
                  'configure a light that has restarted as it was before'),
    *SOURCE_PARAMETERS,
    ParameterSpec('on_release', 'keep', 'state of a light that no source holds any more',
                  choices=('keep', 'off'), restricts=True),
    ParameterSpec('max_brightness', 100.0, 'limit of the brightness that is sent', '%', 0.0,
                  100.0, restricts=True, changeable=True),
    ParameterSpec('min_strobe_period', 0.0,
                  'limit of the strobe period that is sent; 0 = none', 's', 0.0,
                  MAX_STROBE_PERIOD, restricts=True, changeable=True),
    ParameterSpec('off_after_silence', 0.0,
                  'silence of all sources that switches a light off; 0 = never', 's',
                  0.0, 3600.0, restricts=True, changeable=True),
)

DEVICE_PARAMETERS = (
    ParameterSpec('mode', '', 'what controls the light', choices=tuple(MODES)),
    ParameterSpec('brightness', 0.0, 'brightness', '%', 0.0, 100.0),
    ParameterSpec('strobe_period', 0.0, 'strobe period', 's', 0.0, MAX_STROBE_PERIOD,
                  constraints='0 = no strobe, else within the range that the light reports'),
    ParameterSpec('strobe_duty_cycle', 0.0, 'share of the strobe period in which it is lit', '%',
                  0.0, 100.0),
)
# Parameters that each node may have for itself.
_GEOMETRY = ('frame_id', 'beam_range', 'beam_angle', 'mounted_on')
OF_FURTHER_LIGHTS = frozenset({*_GEOMETRY, *(spec.name for spec in DEVICE_PARAMETERS)})


class BeamGeometry(NamedTuple):
    """
    The frame of a light, and the cone of its beam along +x of that frame.

    :param frame_id: of the frame.
    :param beam_range: the length of the beam, m; 0 for none.
    :param beam_angle: the full opening angle of the beam, rad.
    :param mounted_on: gimbal device id of the gimbal that turns it, 0 for the one that the light
        reports.
    """

    frame_id: str
    beam_range: float
    beam_angle: float
    mounted_on: int

    @classmethod
    def of(cls, values: Values) -> BeamGeometry:
        """Return the geometry that parameters give."""
        return cls(*(values[name] for name in _GEOMETRY))

    def declare(self, node: Node) -> BeamGeometry:
        """
        Declare the geometry of a further light and return it.

        :raises ParameterError: if a parameter is wrong.
        """
        return BeamGeometry.of(declare_given(
            node, (spec for spec in LIGHT_PARAMETERS if spec.name in _GEOMETRY), self._asdict()))


def settings(values: Values) -> LightSettings:
    """
    Return the settings of the lights.

    :raises ParameterError: if the sources are wrong.
    """
    sources, off = source_settings(values), values['on_release'] == 'off'
    if off and sources is None:
        raise ParameterError('on_release: is given, but sources is empty')
    return by_name(LightSettings, values, limits=by_name(SafetyLimits, values), sources=sources,
                   off_on_release=off)


def check_not_loosened(values: Values, start: Values) -> None:
    """
    Check that no protection is weaker than at the start of the node.

    :raises ParameterError: if one is.
    """
    for name, is_weaker in (
            ('max_brightness', values['max_brightness'] > start['max_brightness']),
            ('min_strobe_period', values['min_strobe_period'] < start['min_strobe_period']),
            ('off_after_silence', 0 < start['off_after_silence'] < (
                values['off_after_silence'] or math.inf))):
        if is_weaker:
            raise ParameterError(
                f'{name}: {values[name]:g} is a weaker limit than {start[name]:g}, which was '
                f'given at the start: restart the node with -p {name}:=VALUE')


# The nodes of all lights have the same limits.
@functools.lru_cache(1)
def device_parameters(limits: SafetyLimits) -> tuple[ParameterSpec, ...]:
    """Return the parameters of a light, with limits in their descriptions."""
    notes = {}
    if limits.max_brightness < 100.0:
        notes['brightness'] = f'at most {limits.max_brightness:g} %, which is max_brightness'
    if limits.min_strobe_period:
        notes['strobe_period'] = (f'0 = no strobe, else at least {limits.min_strobe_period:g} s, '
                                  'which is min_strobe_period, and within the range that the '
                                  'light reports')
    return tuple(spec._replace(constraints=notes.get(spec.name, spec.constraints))
                 for spec in DEVICE_PARAMETERS)


class Selection:
    """Selects the lights that are served."""

    def __init__(self, values: Values) -> None:
        self._target = Address(values['target_system'], values['target_component'])
        self._only_target = bool(values['only_target'])

    def is_target(self, address: Address) -> bool:
        """Return whether the first node may serve a light."""
        return self._target.includes(address)

    def is_served(self, address: Address) -> bool:
        """Return whether any node may serve a light."""
        return not self._only_target or self.is_target(address)


class NodeNames:
    """
    The names of the nodes of lights.

    :param values: of the parameters.
    :param first: the name of the first node.
    :raises ParameterError: if ``names`` is wrong.
    """

    def __init__(self, values: Values, first: str) -> None:
        self._first = first
        self._names = _parse_names(values['names'], first)
        self._selection = Selection(values)

    def node_name(self, address: Address) -> str:
        """Return the name of the node of a further light."""
        return (self._names.get(address)
                or f'{self._first}_{address.system}_{address.component}')

    def may_name(self, name: str) -> bool:
        """Return whether the node of a further light may have a name."""
        return (name in self._names.values()
                or re.fullmatch(rf'{self._first}_[0-9]+_[0-9]+', name) is not None)

    def unused_name(self, served: Address) -> str:
        """Return the warning for a name of the light that the first node serves, '' for none."""
        name = self._names.get(served)
        return (f'names: {served}={name} is not used, since light {served} is served by the first '
                f'node, {self._first}: -r __node:={name} renames it; target_system and '
                'target_component choose its light') if name else ''

    def unused_names(self, heard: Mapping[Address, object]) -> list[str]:
        """Return a warning for each name of a light that is not served or was not heard."""
        return [f'names: {address}={name} is not used, since only_target leaves light {address} '
                'alone' if not self._selection.is_served(address) else
                f'names: {address}={name} is not used yet, since no light {address} has been '
                'heard'
                for address, name in self._names.items()
                if not self._selection.is_served(address) or address not in heard]


def _parse_names(entries: list[str], first: str) -> dict[Address, str]:
    names: dict[Address, str] = {}
    for entry in entries:
        match = re.fullmatch(r'([0-9]{1,3})/([0-9]{1,3})=(.*)', str(entry))
        if not match or int(match[1]) > 255 or int(match[2]) > 255:
            raise ParameterError(
                f'names: {reprlib.repr(entry)} is not of the form 1/244=belly')
        name = match[3]
        if not re.fullmatch(r'[A-Za-z_][A-Za-z0-9_]{0,199}', name):
            raise ParameterError(f'names: {reprlib.repr(name)} is not a valid node name')
        address = Address(int(match[1]), int(match[2]))
        if address in names or name in names.values():
            raise ParameterError(f'names: {entry!r} repeats an address or a name')
        if name == first:
            raise ParameterError(f'names: {entry!r} is the name of the first node')
        other = re.fullmatch(rf'{first}_([0-9]+)_([0-9]+)', name)
        if other and other.groups() != (str(address.system), str(address.component)):
            raise ParameterError(
                f'names: {entry!r} is the name of light {"/".join(other.groups())}')
        names[address] = name
    return names
