# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Parameters: their specification, those of the link, and those that show a device."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping
import inspect
import math
import threading
import time
from typing import Any, NamedTuple, TypeVar

from rcl_interfaces import msg
from rclpy.node import Node
from rclpy.parameter import Parameter

from .executor_calls import ExecutorCalls
from .rclpy_private import parameter_overrides
from .ros_home import state_folder
from .throttled_log import NodeLog
from ..mavlink.device_kind import DeviceKind
from ..mavlink.errors import KeyFileError, MavlinkError, UrlError
from ..mavlink.messages import Address
from ..mavlink.signing import Signing, SigningMode
from ..mavlink.signing_files import load_signing, TimestampStore
from ..mavlink.url import AutoUrl, parse_url, resource, Url

T = TypeVar('T')
# Values of parameters by name, each of the type of its default.
Values = Mapping[str, Any]

_TYPES: dict[type, tuple[Parameter.Type, str]] = {
    float: (Parameter.Type.DOUBLE, 'a number'),
    int: (Parameter.Type.INTEGER, 'an integer'),
    str: (Parameter.Type.STRING, 'a string'),
    bool: (Parameter.Type.BOOL, 'a boolean'),
    list: (Parameter.Type.STRING_ARRAY, "a list of strings, as in \"['one', 'two']\""),
}


class ParameterError(MavlinkError, ValueError):
    """A wrong parameter; the message names it and gives the reason."""


class ParameterSpec(NamedTuple):
    """
    One parameter.

    :param default: it defines the type; the value is not used for a parameter of a device.
    :param unit: of the value and of its range, '' for none.
    :param low: and ``high``, the range of a number, both ends included.
    :param choices: the permitted values of a string.
    :param constraints: other conditions on the value, for people.
    :param restricts: whether it limits or protects something, so that the node does not start
        where it has no effect: by a misspelt name, or for a node that does not exist.
    :param changeable: whether it may be set while the node runs, see
        :class:`ChangeableParameters`.
    """

    name: str
    default: bool | int | float | str | list[str]
    description: str
    unit: str = ''
    low: float | None = None
    high: float | None = None
    choices: tuple[str, ...] = ()
    constraints: str = ''
    restricts: bool = False
    changeable: bool = False

    @property
    def type(self) -> Parameter.Type:  # noqa: A003
        """Return the parameter's type."""
        return _TYPES[type(self.default)][0]

    @property
    def shown_default(self) -> str:
        """Return the default as it is written in YAML, '' for none."""
        if self.default in ('', []):
            return ''
        return str(self.default).lower() if isinstance(self.default, bool) else str(self.default)

    @property
    def shown_range(self) -> str:
        """Return the range for people, ``1 to 255``, or the choices; '' if there is none."""
        if self.low is None or self.high is None:
            return ', '.join(self.choices)
        return f'{self.low:g} to {self.high:g}'

    def descriptor(self, *, read_only: bool, high: float | None = None) -> msg.ParameterDescriptor:
        """
        Return the descriptor that tools show.

        :param high: the upper end of the range, if it differs from the table.
        """
        unit = f' [{self.unit}]' if self.unit else ''
        constraints = self.constraints
        if self.choices:
            constraints = f'one of: {", ".join(self.choices)}'
        descriptor = msg.ParameterDescriptor(
            description=self.description + unit, additional_constraints=constraints,
            read_only=read_only, type=self.type.value)
        if self.low is not None and self.high is not None:
            top = self.high if high is None else high
            if isinstance(self.default, float):
                descriptor.floating_point_range = [
                    msg.FloatingPointRange(from_value=float(self.low), to_value=float(top))]
            else:
                descriptor.integer_range = [
                    msg.IntegerRange(from_value=int(self.low), to_value=int(top))]
        return descriptor

    def check(self, value: object) -> Any:
        """
        Return a value of this parameter's type; an integer is taken for a double.

        :raises ParameterError: if it is of another type or out of range.
        """
        wanted = type(self.default)
        if wanted is float and type(value) is int:
            value = float(value)
        if wanted is list and isinstance(value, list | tuple):
            value = [entry for entry in value if entry != '']
        if value is False and 'off' in self.choices:
            # In YAML, on the command line too, a bare off is a boolean.
            value = 'off'
        if type(value) is not wanted:
            raise ParameterError(f'{self.name}: {value!r} is not {_TYPES[wanted][1]}')
        if self.choices and value not in self.choices:
            raise ParameterError(
                f'{self.name}: {value!r} is not one of {", ".join(self.choices)}')
        if (self.low is not None and self.high is not None
                and isinstance(value, float | int) and not self.low <= value <= self.high):
            unit = f' {self.unit}' if self.unit else ''
            raise ParameterError(
                f'{self.name}: {value}{unit} is out of range: {self.low:g} to '
                f'{self.high:g}{unit}')
        return value


# URLs in forward_urls.
MAX_FURTHER = 7
DEFAULT_URL = 'udpin://127.0.0.1:14590'

LINK_PARAMETERS = (
    ParameterSpec('connection_url', DEFAULT_URL, 'where the device is: UDP, TCP or serial'),
    ParameterSpec('forward_urls', [], 'further links; frames are forwarded between all links'),
    ParameterSpec('payloads', ['illuminator'], 'kinds of devices that the bridge serves'),
    ParameterSpec('system_id', 1, 'our MAVLink system id', low=1, high=255),
    ParameterSpec('component_id', 193, 'our MAVLink component id', low=1, high=255),
    ParameterSpec('mavlink_version', 2, 'MAVLink version of sent frames; both are received',
                  low=1, high=2),
    ParameterSpec('command_timeout', 0.25, 'first wait for an acknowledgement', 's', 0.05,
                  60.0),
    ParameterSpec('command_retries', 3, 'resends of an unacknowledged command', low=0, high=20),
    ParameterSpec('diagnostics_period', 1.0, 'period of /diagnostics', 's', 0.1, 60.0),
    ParameterSpec('signing_mode', 'off', 'MAVLink 2 message signing',
                  choices=tuple(mode.value for mode in SigningMode), restricts=True),
    ParameterSpec('signing_key_file', '', 'path of the signing key, readable by its owner only',
                  restricts=True),
)


class LinkParameters(NamedTuple):
    """
    The link parameters, checked; :data:`LINK_PARAMETERS` has their units and ranges.

    :param urls: the connection URL, and the URLs to forward to, by their texts.
    """

    urls: Mapping[str, Url]
    address: Address
    mavlink_version: int
    command_timeout: float
    command_retries: int
    diagnostics_period: float
    signing_mode: SigningMode
    signing_key_file: str

    def signing(self) -> tuple[Signing, TimestampStore | None]:
        """
        Return the signing of the link, and where its time stamps are stored.

        :raises ParameterError: if the key cannot be used, or is given and not used.
        """
        try:
            return load_signing(
                self.signing_mode, self.signing_key_file, f'bridge {self.address}', time.time(),
                state_folder)
        except KeyFileError as error:
            raise ParameterError(f'signing_key_file: {error}') from None


def declare_payloads(node: Node, default: str) -> tuple[str, ...]:
    """
    Declare the parameter ``payloads`` and return it.

    :raises ParameterError: if it is wrong.
    """
    specs = [spec for spec in LINK_PARAMETERS if spec.name == 'payloads']
    payloads = tuple(declare_given(node, specs, {'payloads': [default]})['payloads'])
    if not payloads or len(set(payloads)) < len(payloads):
        raise ParameterError(f'payloads: {list(payloads)} is empty or names one twice')
    return payloads


def declare_link_parameters(
    node: Node, defaults: Values | None = None, devices: Iterable[frozenset[str]] = (),
    known: Collection[DeviceKind] = (),
) -> LinkParameters:
    """
    Declare the other parameters of the link and return them.

    :param defaults: replace those of :data:`LINK_PARAMETERS`.
    :param devices: to look for on a serial port, see :class:`~..mavlink.url.AutoUrl`.
    :param known: the devices of all payloads.
    :raises ParameterError: if one is wrong.
    """
    values = dict(declare_given(
        node, [spec for spec in LINK_PARAMETERS if spec.name != 'payloads'], defaults))
    return LinkParameters(
        urls=_urls(values.pop('connection_url'), values.pop('forward_urls'), tuple(devices),
                   known),
        address=Address(values.pop('system_id'), values.pop('component_id')),
        signing_mode=SigningMode(values.pop('signing_mode')), **values)


def _urls(
    first: str, further: list[str], devices: tuple[frozenset[str], ...],
    known: Collection[DeviceKind],
) -> Mapping[str, Url]:
    """Return the URLs by their texts; no two of them use the same port or device."""
    urls: dict[str, Url] = {}
    if len(further) > MAX_FURTHER:
        raise ParameterError(f'forward_urls: {len(further)} URLs, but {MAX_FURTHER} are possible')
    for name, text in [('connection_url', first), *(('forward_urls', one) for one in further)]:
        try:
            url = parse_url(text, known=known)
        except UrlError as error:
            raise ParameterError(f'{name}: {error}') from None
        for other, used in urls.items():
            if resource(url) == resource(used):
                raise ParameterError(f'{name}: {text!r} and {other!r} are the same link')
        urls[text] = (url._replace(devices=devices)
                      if isinstance(url, AutoUrl) and not url.devices else url)
    return urls


def declare_given(
    node: Node, specs: Iterable[ParameterSpec], defaults: Values | None = None,
) -> Values:
    """
    Declare parameters as they are given, and return their values.

    They are read-only unless they are changeable.

    :param defaults: replace those of the specifications.
    :raises ParameterError: if a value is wrong.
    """
    values = {}
    for spec in specs:
        override = given_parameters(node).get(spec.name)
        default = (defaults or {}).get(spec.name, spec.default)
        # rcl reads an empty list, as "ros2 param dump" writes it, as a parameter without a value.
        value = spec.check(
            default if override is None or override.value is None else override.value)
        values[spec.name] = value
        # The type of an empty list cannot be inferred.
        node.declare_parameter(
            spec.name, spec.type if value == [] else value,
            spec.descriptor(read_only=value != [] and not spec.changeable), ignore_override=True)
        if value == []:
            node.set_parameters_atomically([Parameter(spec.name, spec.type, [])])
            node.set_descriptor(spec.name, spec.descriptor(read_only=True))
    return values


def by_name(make: Callable[..., T], values: Values, **others: object) -> T:
    """
    Return settings, with the value of the parameter that has the name of each field.

    :param make: the class of the settings.
    :param others: fields that are not the value of such a parameter.
    """
    return make(**others, **{
        name: values[name] for name in inspect.signature(make).parameters if name not in others})


def given_parameters(node: Node) -> Mapping[str, Parameter]:
    """
    Return the parameters that the command line and parameter files give for a node, by name.

    rclpy has no public access to values of the wrong type, such as an integer for a double, and to
    parameters that are not declared.
    """
    return parameter_overrides(node)


class ChangeableParameters:
    """
    Parameters of a node that may be set while it runs; for the executor's thread.

    :param specs: of the parameters of the node; only the changeable ones count.
    :param values: of all these parameters.
    :param check: takes the values that they would have; raises ParameterError if they are wrong.
    :ivar values: of all these parameters, as they were set.
    :ivar change: takes the values that were set, in the link's thread, with the time (s).
    """

    def __init__(
        self, node: Node, specs: Iterable[ParameterSpec], values: Values, *,
        check: Callable[[Values], object], change: Callable[[Values, float], None],
    ) -> None:
        self.values = values
        self.change = change
        self._specs = {spec.name: spec for spec in specs if spec.changeable}
        self._check = check
        node.add_on_set_parameters_callback(self._may_set)
        node.add_post_set_parameters_callback(self._set)

    def check(self, name: str, value: object) -> None:
        """
        Check the value of one parameter; others are not checked.

        :raises ParameterError: if it is of another type or out of range.
        """
        if spec := self._specs.get(name):
            spec.check(value)

    def _with(self, parameters: list[Parameter]) -> Values:
        return {**self.values, **{
            parameter.name: self._specs[parameter.name].check(parameter.value)
            for parameter in parameters if parameter.name in self._specs}}

    def _may_set(self, parameters: list[Parameter]) -> msg.SetParametersResult:
        try:
            self._check(self._with(parameters))
        except ParameterError as error:
            return msg.SetParametersResult(successful=False, reason=str(error))
        return msg.SetParametersResult(successful=True)

    def _set(self, parameters: list[Parameter]) -> None:
        self.values = self._with(parameters)


class DeviceParameters:
    """
    Parameters of a node that show a device; callable from any thread.

    They have no value until the device reports one. Only :meth:`show` may set them: a set of the
    parameter services goes to the device. The thread of the node's executor makes the changes,
    before it takes the requests that were sent after them: rclpy's parameters are for one thread.

    :ivar specs: by name.
    :ivar call: has a function called in the executor's thread.
    """

    def __init__(self, node: Node, specs: Iterable[ParameterSpec], log: NodeLog) -> None:
        self.specs = {spec.name: spec for spec in specs}
        self.call = ExecutorCalls(node).call
        self._node = node
        self._log = log
        # The newest values that are not shown yet, and the upper ends of ranges.
        self._values: dict[str, object] = {}
        self._highs: dict[str, float] = {}
        self._lock = threading.Lock()
        for spec in self.specs.values():
            node.declare_parameter(
                spec.name, spec.type, spec.descriptor(read_only=False), ignore_override=True)

    def overrides(self) -> Values:
        """Return the values that the command line or a parameter file gives, unchecked."""
        given = given_parameters(self._node)
        return {name: given[name].value for name in self.specs if name in given}

    def respecify(self, specs: Iterable[ParameterSpec]) -> None:
        """Replace the specifications, which the next :meth:`set_high` shows."""
        self.specs = {spec.name: spec for spec in specs}

    def show(self, values: Values) -> None:
        """Set parameters to the reported values."""
        with self._lock:
            self._values |= values
        self.call(self._change)

    def set_high(self, name: str, high: float) -> None:
        """Show another upper end of the range of a number, or its value if that is higher."""
        with self._lock:
            self._highs[name] = high
        self.call(self._change)

    # In the executor's thread

    def _change(self) -> None:
        with self._lock:
            values, self._values = self._values, {}
            highs = dict(self._highs)
        self._fit(highs, values)
        if values:
            result = self._node.set_parameters_atomically([
                Parameter(name, value=value) for name, value in values.items()])
            if not result.successful:
                self._log.error(f'cannot show parameters of the device: {result.reason}',
                                'parameters')
            self._fit(highs, {})

    def _fit(self, highs: Mapping[str, float], values: Values) -> None:
        """Set the upper ends of ranges, which include the present and the next values."""
        for name, high in highs.items():
            value = self._node.get_parameter_or(name).value
            # rclpy cannot change the descriptor of a parameter without a value; the call after its
            # first value can.
            if isinstance(value, float):
                high = max(high, value, values.get(name, high))
                if math.isfinite(high):
                    self._node.set_descriptor(name, self.specs[name].descriptor(
                        read_only=False, high=high))
