# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""
The executables that make MAVLink devices ROS 2 nodes.

``bridge`` serves lights; each other executable serves the payload of its name.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
import os
import sys
from typing import NamedTuple, TYPE_CHECKING

from .entry_point import (
    CANNOT_CREATE,
    complainer,
    own_arguments,
    print_output,
    Refusal,
    refusing,
    run_program,
    start_ros,
)
from .payloads import DEFAULT_PAYLOAD, PAYLOADS
from .termination import Termination
from ..payload.payload_type import PayloadType

if TYPE_CHECKING:
    from ..ros.payload import RosPayload  # Slow to import.


class Executable(NamedTuple):
    """
    One of the executables.

    :param payload: it names the first node, and is the default of the parameter ``payloads``.
    :param payloads: the kinds of payloads that this parameter may name.
    """

    payload: str = DEFAULT_PAYLOAD
    payloads: Mapping[str, PayloadType] = PAYLOADS

    @property
    def name(self) -> str:
        """Return the name of the executable."""
        return 'bridge' if self.payload == DEFAULT_PAYLOAD else self.payload

    def load(self) -> RosPayload:
        """Return the ROS half of its payload."""
        payload: RosPayload = self.payloads[self.payload].load('ros')
        return payload

    def show(self, text: str) -> int:
        """Print a text, and return the exit status."""
        return 0 if print_output(complainer(self.name), text, end='') else 1


def usage(executable: Executable) -> str:
    """Return the text of ``--help``."""
    from .arguments import invocation
    from ..ros.parameters import LINK_PARAMETERS, ParameterSpec

    kind, name = executable.load(), executable.name
    command = invocation(name)
    defaults = {'payloads': [executable.payload], **kind.all_link_defaults}

    def row(spec: ParameterSpec, default: str) -> str:
        limits = f'{spec.shown_range} {spec.unit}'.strip()
        if default and spec.unit:
            default += f' {spec.unit}'
        return (f'  {spec.name:22} {default:27} {spec.description}'
                + (f' ({limits})' if limits else ''))

    fixed, changeable = (
        ''.join(row(spec, spec._replace(
                    default=defaults.get(spec.name, spec.default)).shown_default) + '\n'
                for spec in (*LINK_PARAMETERS, *kind.parameters) if spec.changeable is may)
        for may in (False, True))
    variable = ''.join(row(spec, '') + '\n' for spec in kind.device_parameters) + changeable
    variable = variable and f'parameters that may be set at any time:\n{variable}\n'
    examples = ''.join(f'  {line}\n' for line in kind.examples)
    examples = examples and f'{examples}\n'
    return f"""\
usage: {name} [-h | --version] [URL]
       [--ros-args [-p NAME:=VALUE ...] [--params-file FILE] [-r __ns:=/NAMESPACE]]

Runs the ROS 2 node /{kind.node_name} for {kind.summary}.

examples:
  {command}
  {command} serial:///dev/ttyACM0:57600
  {command} --ros-args -p connection_url:=udpin://0.0.0.0:14550

{examples}--ros-args --log-level {kind.node_name}:=debug shows the messages of this device in the
log, and --log-level debug those of all nodes, among many lines of ROS itself.

connection URLs, with their meanings in MAVROS, MAVSDK and pymavlink:
  udp://[BIND][:PORT]@[HOST][:PORT]   udpin://BIND:PORT   udpout://HOST:PORT
  tcp://HOST:PORT   tcp-l://[BIND][:PORT]   tcpin://BIND:PORT   tcpout://HOST:PORT
  serial:///dev/ttyACM0:57600   /dev/ttyUSB0,57600   udpin:HOST:PORT
  serial://auto: the serial port on which the device is heard (doc/links.md)

{variable}parameters that are fixed at the start, with their defaults:
{fixed}
Each further kind in payloads has a node of its own, with the parameters that --help of its
executable shows: -p gimbal:setpoint_timeout:=0.2 sets that of the node gimbal.

exit status: 0 after a signal (SIGINT, SIGTERM, SIGQUIT ...); 1 if a package is missing; 2 if an
argument or parameter is wrong.
"""


def main(
    args: list[str] | None = None, payloads: Mapping[str, PayloadType] = PAYLOADS, *,
    payload: str = DEFAULT_PAYLOAD,
) -> int:
    """
    Run an executable until a signal; see :func:`usage`.

    :param args: the command line without the executable's name.
    :param payloads: and ``payload``, see :class:`Executable`.
    """
    arguments = sys.argv[1:] if args is None else args
    executable = Executable(payload, payloads)
    return run_program(
        executable.name, lambda termination: _run(arguments, termination, executable))


# The other entry points of setup.py.
rededge = partial(main, payload='rededge')
gimbal = partial(main, payload='gimbal')
gimbal_manager = partial(main, payload='gimbal_manager')


def _run(arguments: list[str], termination: Termination, executable: Executable) -> int:
    own = own_arguments(executable.name, arguments)
    if '-h' in own or '--help' in own:
        return executable.show(usage(executable))
    if '--version' in own:
        # Slow to import, like everything that is imported inside a function here.
        from .. import __version__
        return executable.show(f'{__version__}\n')
    # A parameter without -p has the form of a URL with an unknown scheme.
    url = own.pop(0) if own and not own[0].startswith('-') and ':=' not in own[0] else ''
    if own:
        raise Refusal(
            f'unknown argument {own[0]!r}; parameters and names follow --ros-args, as in '
            f'"--ros-args -r __ns:=/uav1 -p NAME:=VALUE", see {executable.name} --help')
    arguments = [argument for argument in arguments if argument != url]
    return _serve(arguments, url, termination, executable)


def _serve(
    arguments: list[str], url: str, termination: Termination, executable: Executable,
) -> int:
    import gc

    import rclpy

    from ..ros.payload_node import PayloadNode

    # Not before: the import exits at once if the selected middleware is not installed, and a
    # queue would lose the reason.
    termination.queue_output(2)
    # From here on the process must leave the ROS graph in order, so a signal acts later.
    termination.calls(lambda: None)
    _use_profile()
    # rcutils colours its lines on a terminal only, and stderr is the pipe of a queue here.
    if termination.is_terminal:
        os.environ.setdefault('RCUTILS_COLORIZED_OUTPUT', '1')
    start_ros(executable.name, arguments)
    # For example, two topics may have the same name.
    with refusing(CANNOT_CREATE):
        node = PayloadNode(executable.payload, enable_logger_service=True)
        # Other participants discover the node while these modules are imported.
        from ..ros.bridge import Bridge
        from ..ros.parameters import ParameterError
        executable.load()
        try:
            bridge = Bridge(node, arguments, executable.payloads, executable.payload, url)
        except ParameterError as error:
            raise Refusal(f'parameter {error}') from None
    # The existing objects stay: a garbage collection that visits them would only delay answers.
    gc.freeze()
    termination.calls(bridge.end, bridge.report_late)
    bridge.run()
    rclpy.try_shutdown()
    return 0


def _use_profile() -> None:
    """Use the package's profile of Fast DDS, unless the user has one."""
    names = ('FASTRTPS_DEFAULT_PROFILES_FILE', 'FASTDDS_DEFAULT_PROFILES_FILE')
    files = ('DEFAULT_FASTRTPS_PROFILES.xml', 'DEFAULT_FASTDDS_PROFILES.xml')
    if not (any(map(os.environ.get, names)) or any(map(os.path.exists, files))):
        from ..ros.fast_dds import profile_variable
        profile = os.path.join(os.path.dirname(__file__), os.pardir, 'ros', 'fastdds.xml')
        os.environ[profile_variable()] = os.path.abspath(profile)
