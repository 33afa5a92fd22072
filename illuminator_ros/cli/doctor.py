# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The executable ``doctor``: checks the machine, the ports and the nodes; it changes nothing."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from importlib.util import find_spec
import os
from pathlib import Path
import platform
import signal
import time
from typing import Any

from .arguments import option, Parser
from .entry_point import complainer, escape_output, explained, OLDEST, package, print_output

# A check: what was found, for people, with the next step where it has failed; whether it passed.
Finding = tuple[bool, str]

# 2026-01-01, s; a clock without a battery is before.
OLDEST_TIME = 1_767_225_600
# s for the messages of running nodes.
ROS_TIME = 3.0
UNITS = Path('/etc/illuminator_ros')
DESCRIPTION = """\
Checks this machine, its ports and the running nodes: "pass", or "FAIL" with the next step. It
sends nothing to devices and changes nothing. The text can be pasted into a bug report."""
EPILOG = 'exit status: 0 if each check passes, 1 if one fails, 2 if an argument is wrong.'
# The programs that do without them say so.
OPTIONAL = {'textual', 'textual_serve'}


def main(args: list[str] | None = None) -> int:
    """
    Check, print the findings, and return the exit status.

    :param args: the command line without the program's name, by default from ``sys.argv``.
    """
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    escape_output()
    return explained('doctor', lambda: _run(args))


def _seconds(text: str) -> float:
    # The reader of numbers of other programs imports pymavlink, which may be what is missing.
    if not 1 <= float(text) <= 3600:
        raise ValueError(f'{text} is outside 1 to 3600')
    return float(text)


def _run(args: list[str] | None) -> int:
    parser = Parser('doctor', DESCRIPTION, EPILOG)
    parser.add_argument('file', nargs='*', type=Path, help='parameter file to check, too')
    parser.add_argument('--seconds', type=option(_seconds), default=14.0, metavar='S',
                        help='how long to listen to the ports (default: %(default)g)')
    options = parser.parse_args(args)
    passed = []

    def show(findings: Iterable[Finding]) -> None:
        for is_fine, text in findings:
            written = print_output(
                complainer('doctor'), f'{"pass" if is_fine else "FAIL"}  {text}')
            passed.append(written and is_fine)

    show(machine(time.time(), os.environ))
    from .discover.report import report
    from .discover.run import listen, ports_of
    from ..mavlink.transport.ports import serial_ports
    ports = ports_of([], options.seconds, time.monotonic, serial_ports())
    listen(ports, options.seconds)
    show(on_ports([report(port) for port in ports]))
    if find_spec('rclpy'):
        nodes, found = _ros()
        show(found)
        show(in_files([*options.file, *sorted(UNITS.glob('*.yaml'))], nodes))
    return 0 if all(passed) else 1


def machine(now: float, environ: Mapping[str, str]) -> Iterator[Finding]:
    """Return the findings on packages, the environment and the clock."""
    yield True, f'Python {platform.python_version()}, {platform.platform()}'
    for module in OLDEST:
        name, problem = package(module)
        yield not problem or module in OPTIONAL, problem or name
    yield True, ', '.join(f'{name} {environ.get(name, "not set")}' for name in (
        'ROS_DISTRO', 'ROS_DOMAIN_ID', 'ROS_AUTOMATIC_DISCOVERY_RANGE'))
    shown = time.strftime('%Y-%m-%d %H:%M:%S UTC', time.gmtime(now))
    yield now > OLDEST_TIME, f'clock: {shown}' + (
        '' if now > OLDEST_TIME else ': set it, as by NTP, or signed frames are refused')


def on_ports(reports: Sequence[Mapping[str, Any]]) -> Iterator[Finding]:
    """
    Return the findings on ports and the devices on them.

    :param reports: of ``discover``, one for each port.
    """
    from .discover.report import lines
    from .discover.run import CONSOLE
    from ..mavlink.search.listener import NOT_SENT_HERE

    addresses: dict[str, list[str]] = {}
    for one in reports:
        for device in one['components']:
            addresses.setdefault(device['address'], []).append(one['url'])
        trouble = one['trouble']
        # A UDP port may be silent, and one program may use a port, such as our node.
        passed = one['run'] or trouble in (CONSOLE, NOT_SENT_HERE) or trouble.startswith(
            'in use') and ' and "' not in trouble and 'ModemManager' not in trouble
        yield bool(passed), '\n      '.join(lines(one))
    for address, urls in addresses.items():
        if len(urls) > 1:
            yield False, (f'{address} is heard on {" and ".join(urls)}: give one device another '
                          'id, or connect it over one link only (doc/links.md)')


def _ros() -> tuple[list[str], list[Finding]]:
    """Return the names of the nodes in the graph, and the findings on them."""
    from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
    import rclpy

    statuses: dict[tuple[str, str], DiagnosticStatus] = {}

    def receive(message: DiagnosticArray) -> None:
        for status in message.status:
            if node := {one.key: one.value for one in status.values}.get('node'):
                statuses[node, status.name] = status

    rclpy.init()
    own = rclpy.create_node('_doctor', enable_rosout=False, start_parameter_services=False)
    try:
        own.create_subscription(DiagnosticArray, '/diagnostics', receive, 100)
        end = time.monotonic() + ROS_TIME
        while (left := end - time.monotonic()) > 0:
            rclpy.spin_once(own, timeout_sec=left)
        names = [f'{space.rstrip("/")}/{name}' for name, space in
                 own.get_node_names_and_namespaces() if not name.startswith('_')]
    finally:
        own.destroy_node()
        rclpy.shutdown()
    served = ', '.join(sorted({node for node, _ in statuses})) or 'none'
    return names, [(True, f'{rclpy.get_rmw_implementation_identifier()}; nodes with a device: '
                    f'{served}'), *shared_names(names), *(
        (status.level == DiagnosticStatus.OK, f'{node}: {status.name}: {status.message}')
        for (node, _), status in sorted(statuses.items(), key=lambda one: one[0]))]


def shared_names(names: Iterable[str]) -> Iterator[Finding]:
    """Return the names that several nodes have."""
    for name, count in Counter(names).items():
        if count > 1:
            yield False, f'{count} nodes are called {name}: rename one with -r __node:=NAME'


def in_files(files: Sequence[Path], nodes: Sequence[str]) -> Iterator[Finding]:
    """
    Return the findings on parameter files.

    :param nodes: the names of running nodes; those of our executables, and the name of the file,
        which the unit of systemd gives a node, count as well.
    """
    from .payloads import PAYLOADS
    from ..ros.ignored_parameters import given_sections
    from ..ros.parameters import LINK_PARAMETERS, ParameterError

    kinds = [payload.load('ros') for payload in PAYLOADS.values()] if files else []
    restrictions = {spec.name for specs in (LINK_PARAMETERS, *(one.parameters for one in kinds))
                    for spec in specs if spec.restricts}
    for path in files:
        known = [*nodes, f'/{path.stem}', *(f'/{one.node_name}' for one in kinds)]
        try:
            lost = [section for section in given_sections(['--params-file', str(path)])
                    if restrictions & section.names and not any(map(section.matches, known))]
        except ParameterError as error:
            yield False, str(error)
            continue
        yield not lost, f'{path}' + ''.join(
            f': {", ".join(sorted(restrictions & section.names))} has no effect, since '
            f'{section.pattern} matches no node: give it the name of the node, or /**'
            for section in lost)
