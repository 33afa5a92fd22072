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

"""What the parts of the package may know of each other (DESIGN.md, 5)."""

import ast
from collections.abc import Iterator
from pathlib import Path
import re
import subprocess

import pytest

ROOT = Path(__file__).parents[1]
PACKAGE = 'illuminator_ros'
# From the bottom to the top; a module may import from its own layer and from those below.
LAYERS = ('mavlink', 'payload', 'illuminator', 'ros', 'cli', '')
ROS = {'rclpy', 'rcl_interfaces', 'std_msgs', 'std_srvs', 'sensor_msgs', 'diagnostic_msgs',
       'geometry_msgs', 'visualization_msgs', 'ament_index_python'}
IO = {'socket', 'selectors', 'select', 'serial', 'asyncio', 'subprocess', 'os', 'io', 'pathlib'}
TIME = {'time', 'datetime'}
THREADS = {'threading', 'queue', 'multiprocessing', 'concurrent'}
FORBIDDEN = {'mavlink': ROS, 'illuminator': ROS | IO | TIME | THREADS, 'ros': {'socket'}}
# Inside mavlink/ too, the protocol itself does no I/O and has no clock.
SANS_IO = ('deadline_queue', 'command', 'command_sender', 'messages', 'loopback_filter',
           'component', 'frame', 'round_trip', 'signing', 'statistics', 'url')
# What parts of the monitor must do without.
PURE = ROS | IO | TIME | THREADS
MONITOR = {
    **dict.fromkeys(('model', 'actions', 'keys', 'operator', 'texts'), PURE | {'rich'}),
    'view': PURE, 'terminal': ROS | {'rich'}, 'graph': {'rich'} | IO | TIME | THREADS,
    'requests': {'rich'} | IO | TIME | THREADS,
}
# Imported before signals are taken, and therefore quick to import.
FIRST = ('', 'bridge', 'conformance', 'monitor', 'simulator', 'cli', 'cli.bridge',
         'cli.conformance', 'cli.monitor', 'cli.simulator', 'cli.program', 'cli.termination')
QUICK = {'__future__', 'collections', 'contextlib', 'os', 're', 'signal', 'sys', 'threading',
         'time', 'typing', PACKAGE}
LONGEST = 400
# What is one subject all the same: the URLs of three families, each with its type.
LONGER = {ROOT / PACKAGE / 'mavlink' / 'url.py'}

MODULES = {
    '.'.join(path.relative_to(ROOT).with_suffix('').parts).removesuffix('.__init__'): path
    for path in sorted((ROOT / PACKAGE).rglob('*.py'))}


def layer(module: str) -> str:
    """Return the folder of a module of ours; '' for the entry points."""
    parts = module.split('.')
    return parts[1] if len(parts) > 1 and parts[1] in LAYERS else ''


def imports(module: str, nodes: Iterator[ast.AST] | None = None) -> set[str]:
    """Return the full names of what a module imports, wherever in it."""
    path = MODULES[module]
    package = module if path.name == '__init__.py' else module.rpartition('.')[0]
    names = set()
    for node in nodes or ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.level:
            base = package.split('.')[:len(package.split('.')) - node.level + 1]
            target = '.'.join([*base, *filter(None, [node.module])])
            names |= {f'{target}.{alias.name}' if f'{target}.{alias.name}' in MODULES else target
                      for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            names.add(str(node.module))
    return names


def roots(names: set[str]) -> set[str]:
    return {name.partition('.')[0] for name in names}


@pytest.mark.parametrize('module', MODULES)
def test_imports_point_downwards(module: str) -> None:
    own = LAYERS.index(layer(module))

    above = {name for name in imports(module) if name.startswith(f'{PACKAGE}.')
             and LAYERS.index(layer(name)) > own}

    assert above == set()


@pytest.mark.parametrize('module', [m for m in MODULES if layer(m) in FORBIDDEN])
def test_a_layer_knows_nothing_of_what_is_not_its_own(module: str) -> None:
    assert roots(imports(module)) & FORBIDDEN[layer(module)] == set()


@pytest.mark.parametrize(
    'module', [m for m in MODULES
               if m.split('.')[1:3] in (['cli', 'simulator'], ['cli', 'conformance'])])
def test_simulator_and_conformance_need_no_ros(module: str) -> None:
    assert roots(imports(module)) & ROS == set()
    assert not [name for name in imports(module) if name.startswith(f'{PACKAGE}.ros')]


@pytest.mark.parametrize('name', MONITOR)
def test_a_part_of_the_monitor_knows_only_its_own(name: str) -> None:
    module = f'{PACKAGE}.cli.monitor.{name}'

    assert roots(imports(module)) & MONITOR[name] == set()


@pytest.mark.parametrize('module', [m for m in MODULES if m.split('.')[1:3] == ['cli', 'monitor']])
def test_the_monitor_knows_lights_by_ros_only(module: str) -> None:
    below = {'illuminator_ros.illuminator.error_flags', 'illuminator_ros.ros.spinner'}

    assert {name for name in imports(module) if name.startswith(tuple(
        f'{PACKAGE}.{part}' for part in LAYERS
        if part not in ('', 'cli')))} <= below


@pytest.mark.parametrize('name', SANS_IO)
def test_the_protocol_in_mavlink_does_no_io_and_has_no_clock(name: str) -> None:
    module = f'{PACKAGE}.mavlink.{name}'

    assert roots(imports(module)) & (IO | TIME | THREADS) == set()
    assert not any(other.startswith((f'{PACKAGE}.mavlink.transport', f'{PACKAGE}.mavlink.link'))
                   for other in imports(module))


@pytest.mark.parametrize(
    'module', [m for m in MODULES if layer(m) == 'mavlink' and not m.endswith('.messages')])
def test_mavlink_knows_no_light(module: str) -> None:
    """It is to carry other payloads later; only the dialect lists the messages of this one."""
    names = set()
    for node in ast.walk(ast.parse(MODULES[module].read_text())):
        if isinstance(node, ast.Name):
            names.add(node.id)
        elif isinstance(node, ast.Attribute):
            names.add(node.attr)
        elif isinstance(node, ast.alias):
            names.add(node.name)

    assert [name for name in names if 'illuminator' in name.lower()] == []


@pytest.mark.parametrize('name', FIRST)
def test_what_comes_before_signals_are_taken_imports_nothing_slow(name: str) -> None:
    module = f'{PACKAGE}.{name}'.rstrip('.')
    top_level = iter(ast.parse(MODULES[module].read_text()).body)

    names = imports(module, top_level)

    assert roots(names) <= QUICK
    assert {n for n in names if n.startswith(f'{PACKAGE}.')} <= {
        f'{PACKAGE}.{first}' for first in FIRST}


def tracked() -> list[Path]:
    """Return all Python files that belong to the repository."""
    listed = subprocess.run(['git', 'ls-files', '*.py'], cwd=ROOT, text=True,
                            capture_output=True, check=False).stdout.split()
    if listed:
        return [ROOT / name for name in listed if (ROOT / name).exists()]
    return [*MODULES.values(), *sorted((ROOT / 'test').rglob('*.py'))]


# The rest of what is here measures, or is a clock itself.
CLOCKS = re.compile(r'\btime\.(monotonic|perf_counter|process_time|clock_gettime|time)(_ns)?\(')


@pytest.mark.parametrize('path', sorted((ROOT / 'test').rglob('test_*.py')),
                         ids=lambda path: str(path.relative_to(ROOT)))
def test_no_test_looks_at_a_clock_of_the_machine(path: Path) -> None:
    assert not CLOCKS.search(path.read_text())


@pytest.mark.parametrize('path', tracked(), ids=lambda path: str(path.relative_to(ROOT)))
def test_files_are_of_a_size_to_be_read_at_once(path: Path) -> None:
    if path not in LONGER:
        assert len(path.read_text().splitlines()) <= LONGEST
