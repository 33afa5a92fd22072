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

"""The parameters of the node: one table each for the link and for the light."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
import difflib
import math
import re
import reprlib
from typing import Any

from rcl_interfaces.msg import ParameterDescriptor
from rclpy.node import Node
from rclpy.parameter import Parameter

from .parameter_spec import ParameterError, ParameterSpec
from ..illuminator.model import checked, InvalidValue, MAX_STROBE_PERIOD, MODES
from ..mavlink.messages import Address
from ..mavlink.signing import SigningMode
from ..mavlink.url import parse_url, Url, UrlError

DEFAULT_URL = 'udpin://127.0.0.1:14590'

LINK_PARAMETERS = (
    ParameterSpec('connection_url', DEFAULT_URL, 'where the light is: UDP, TCP or serial'),
    ParameterSpec('system_id', 1, 'our MAVLink system id', low=1, high=255),
    ParameterSpec('component_id', 194, 'our MAVLink component id', low=1, high=255),
    ParameterSpec('target_system', 0, 'system id of the light to serve; 0 = any', low=0,
                  high=255),
    ParameterSpec('target_component', 0, 'component id of the light to serve; 0 = any', low=0,
                  high=255),
    ParameterSpec('only_target', False, 'leave lights alone that the target does not select'),
    ParameterSpec('names', [''], 'node names of further lights, such as 1/244=belly'),
    ParameterSpec('heartbeat_timeout', 3.0, 'silence after which the light is lost', 's', 1.1,
                  3600.0),
    ParameterSpec('command_timeout', 0.5, 'longest wait for one acknowledgement', 's', 0.05,
                  60.0),
    ParameterSpec('command_retries', 3, 'resends of an unacknowledged command', low=0, high=20),
    ParameterSpec('status_interval', 0.0, "period of the light's status; 0 = its own", 's', 0.0,
                  3600.0),
    ParameterSpec('frame_id', 'illuminator', 'frame of temperature and beam'),
    ParameterSpec('beam_range', 0.0, 'length of the cone on ~/beam; 0 = no ~/beam', 'm', 0.0,
                  10_000.0),
    ParameterSpec('beam_angle', 0.5, 'full opening angle of the cone on ~/beam', 'rad', 0.01,
                  3.0),
    ParameterSpec('diagnostics_period', 1.0, 'period of /diagnostics', 's', 0.1, 60.0),
    ParameterSpec('off_on_shutdown', False, 'switch the light off when the node ends'),
    ParameterSpec('restore_configuration', True,
                  'configure a light that has restarted as it was before'),
    ParameterSpec('signing_mode', 'off', 'MAVLink 2 message signing',
                  choices=tuple(mode.value for mode in SigningMode)),
    ParameterSpec('signing_key_file', '', 'path of the signing key, readable by its owner only'),
)

DEVICE_PARAMETERS = (
    ParameterSpec('mode', '', 'what controls the light', choices=tuple(MODES)),
    ParameterSpec('brightness', 0.0, 'brightness', '%', 0.0, 100.0),
    ParameterSpec('strobe_period', 0.0, 'strobe period', 's', 0.0, MAX_STROBE_PERIOD,
                  constraints='0 = no strobe, else within what the light reports'),
    ParameterSpec('strobe_duty_cycle', 0.0, 'share of the strobe period in which it is lit', '%',
                  0.0, 100.0),
)
DEVICE_SPECS = {spec.name: spec for spec in DEVICE_PARAMETERS}


@dataclass(frozen=True)
class LinkParameters:
    """The link parameters, checked; :data:`LINK_PARAMETERS` has their units and ranges."""

    url: Url
    identity: Address
    target: Address
    only_target: bool
    names: Mapping[Address, str]
    heartbeat_timeout: float
    command_timeout: float
    command_retries: int
    status_interval: float
    off_on_shutdown: bool
    restore_configuration: bool
    signing_mode: SigningMode
    signing_key_file: str
    connection_url: str
    frame_id: str
    beam_range: float
    beam_angle: float
    diagnostics_period: float


def declare_link_parameters(node: Node) -> LinkParameters:
    """
    Declare the parameters of the link, read-only, and return them.

    :raises ParameterError: if one is wrong.
    """
    values = {spec.name: declare_read_only(node, spec, spec.default) for spec in LINK_PARAMETERS}
    try:
        url = parse_url(values['connection_url'])
    except UrlError as error:
        raise ParameterError(f'connection_url: {error}') from None
    return LinkParameters(
        url=url, identity=Address(values['system_id'], values['component_id']),
        target=Address(values['target_system'], values['target_component']),
        names=_parse_names(values['names'], node.get_name()),
        signing_mode=SigningMode(values['signing_mode']),
        **{name: values[name] for name in (
            'only_target', 'heartbeat_timeout', 'command_timeout', 'command_retries',
            'status_interval', 'off_on_shutdown', 'restore_configuration', 'signing_key_file',
            'connection_url', 'frame_id', 'beam_range', 'beam_angle', 'diagnostics_period')})


def declare_read_only(node: Node, spec: ParameterSpec, otherwise: Any) -> Any:
    """
    Declare a parameter as it is given, else with another value, and return it.

    :raises ParameterError: if it is wrong.
    """
    override = take_override(node, spec.name)
    value = spec.check(otherwise if override is None else override)
    node.declare_parameter(
        spec.name, value, spec.descriptor(read_only=True), ignore_override=True)
    return value


def _parse_names(entries: list[str], first: str) -> dict[Address, str]:
    names: dict[Address, str] = {}
    for entry in filter(None, entries):
        match = re.fullmatch(r'([0-9]{1,3})/([0-9]{1,3})=(.*)', str(entry))
        if not match or int(match[1]) > 255 or int(match[2]) > 255:
            raise ParameterError(
                f'names: {reprlib.repr(entry)} is not of the form 1/244=belly')
        name = match[3]
        if not re.fullmatch(r'[A-Za-z_][A-Za-z0-9_]*', name):
            raise ParameterError(f'names: {name!r} in {entry!r} is no node name')
        source = Address(int(match[1]), int(match[2]))
        if source in names or name in names.values():
            raise ParameterError(f'names: {entry!r} repeats an address or a name')
        if name == first:
            raise ParameterError(f'names: {entry!r} is the name of the first node')
        other = re.fullmatch(rf'{first}_([0-9]+)_([0-9]+)', name)
        if other and other.groups() != (str(source.system), str(source.component)):
            raise ParameterError(
                f'names: {entry!r} is the name of light {"/".join(other.groups())}')
        names[source] = name
    return names


def declare_device_parameters(node: Node) -> dict[str, Any]:
    """
    Declare the parameters of the light, without values, and return their overrides.

    They get values from the light: until its first status they are not set.

    :raises ParameterError: if an override is wrong.
    """
    overrides = {}
    for spec in DEVICE_PARAMETERS:
        override = take_override(node, spec.name)
        if override is not None:
            try:
                overrides[spec.name] = checked(spec.name, override)
            except InvalidValue as error:
                raise ParameterError(str(error)) from None
        kind = Parameter.Type.from_parameter_value(spec.default)
        node.declare_parameter(
            spec.name, kind, spec.descriptor(read_only=False), ignore_override=True)
    return overrides


def take_override(node: Node, name: str) -> Any:
    """
    Return what the command line or a parameter file gives for a parameter, None if nothing.

    Declaring it for a moment with any type is the public way to an override of a wrong type:
    an integer for a double would otherwise end the node.
    """
    node.declare_parameter(name, None, ParameterDescriptor(dynamic_typing=True))
    value = node.get_parameter(name).value
    node.undeclare_parameter(name)
    return value


def misspelt(node: Node) -> list[str]:
    """Return a warning for each override that looks like one of our parameters but is none."""
    known = [spec.name for spec in (*LINK_PARAMETERS, *DEVICE_PARAMETERS)]
    warnings = []
    # There is no public way to overrides that nobody declares.
    for name in getattr(node, '_parameter_overrides', {}):
        if not node.has_parameter(name) and name not in known:
            close = difflib.get_close_matches(name, known, 1, 0.75)
            if close:
                warnings.append(
                    f'parameter {name!r} is unknown and ignored; did you mean {close[0]!r}?')
    return warnings


def period_range(max_period: float, reported: float) -> ParameterDescriptor:
    """Return the descriptor of ``strobe_period`` for a light that reports these values, s."""
    spec = DEVICE_SPECS['strobe_period']
    high = max_period if max_period > 0 else MAX_STROBE_PERIOD
    # What the light reports must fit, or it could not be shown.
    high = max(high, reported) if math.isfinite(reported) else high
    return spec.descriptor(read_only=False, high=high)
