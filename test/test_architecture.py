# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The imports that are allowed between parts of the package, and the limits of the core."""

from __future__ import annotations

import ast
from collections.abc import Iterator, Sequence
import functools
import graphlib
from pathlib import Path
import re
import subprocess
import sys

import pytest
from support.processes import environment

ROOT = Path(__file__).parents[1]
PACKAGE = 'illuminator_ros'
MODULES = {
    '.'.join(path.relative_to(ROOT).with_suffix('').parts).removesuffix('.__init__'): path
    for path in sorted((ROOT / PACKAGE).rglob('*.py'))}
# Every other folder holds one payload.
SHARED = {'mavlink', 'payload', 'geometry', 'simulation', 'checks', 'ros', 'cli'}
PAYLOADS = {module.split('.')[1] for module, path in MODULES.items()
            if path.name == '__init__.py' and module.count('.') == 1} - SHARED

ROS = {'rclpy', 'rcl_interfaces', 'std_msgs', 'std_srvs', 'sensor_msgs', 'diagnostic_msgs',
       'geometry_msgs', 'visualization_msgs', 'ament_index_python', 'builtin_interfaces'}
IO = {'socket', 'selectors', 'select', 'serial', 'asyncio', 'subprocess', 'os', 'io', 'pathlib'}
TIME = {'time', 'datetime'}
THREADS = {'threading', 'queue', 'multiprocessing', 'concurrent'}
# The modules of mavlink/ that do I/O, run a thread or read a clock; all others must not.
MAVLINK_IO = {
    'transport', 'line', 'lines', 'link', 'link_thread', 'listener', 'connector', 'sender',
    'serial_search', 'signing_files', 'silent_port'}
PAYLOAD_WORD = re.compile('illuminator|gimbal|camera|rededge|winch|lamp', re.IGNORECASE)
# A message that several payloads receive.
SHARED_NAMES = {'GimbalDeviceAttitudeStatus', 'gimbal_device_id'}


def folder(module: str) -> tuple[str, ...]:
    """Return the folder that decides what a module may import, such as ('illuminator', 'ros')."""
    parts = module.split('.')[1:]
    # A program of its own, such as "python3 -m illuminator_ros.gimbal".
    if not parts or parts[-1] == '__main__' or (
            len(parts) == 1 and parts[0] not in SHARED | PAYLOADS):
        return ()
    return ('ros',) if parts[0] == 'ros' else tuple(
        parts[:2] if parts[0] in PAYLOADS and parts[1:2] == ['ros'] else parts[:1])


def allowed(importer: tuple[str, ...]) -> set[tuple[str, ...]]:
    """Return the folders from which a module of this folder may import."""
    if importer in ((), ('cli',)):
        return {(), ('cli',), ('ros',), ('simulation',), ('checks',), ('geometry',), ('payload',),
                ('mavlink',),
                *((name,) for name in PAYLOADS), *((name, 'ros') for name in PAYLOADS)}
    if importer == ('mavlink',):
        return {importer, ()}
    if importer == ('payload',):
        return {importer, ('mavlink',), ()}
    if importer in (('ros',), ('simulation',), ('checks',), ('geometry',)):
        return {importer, ('geometry',), ('payload',), ('mavlink',), ()}
    own = {(importer[0],), ('simulation',), ('checks',), ('geometry',), ('payload',), ('mavlink',),
           ()}
    return own | {importer, ('ros',)} if importer[1:] else own


@functools.cache
def nodes(module: str) -> Sequence[ast.AST]:
    return [*ast.walk(ast.parse(MODULES[module].read_text()))]


@functools.cache
def imports(module: str) -> set[str]:
    """Return the full names of the modules that a module imports, TYPE_CHECKING included."""
    path = MODULES[module]
    package = module if path.name == '__init__.py' else module.rpartition('.')[0]
    names = set()
    for node in nodes(module):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            target = str(node.module)
            if node.level:
                base = package.split('.')[:len(package.split('.')) - node.level + 1]
                target = '.'.join([*base, *filter(None, [node.module])])
            names |= {f'{target}.{alias.name}' if f'{target}.{alias.name}' in MODULES else target
                      for alias in node.names}
    return names


def own_imports(module: str) -> set[str]:
    return {name for name in imports(module) if name in MODULES}


def roots(names: set[str]) -> set[str]:
    return {name.partition('.')[0] for name in names}


def identifiers(module: str) -> Iterator[str]:
    """Return the names that a module defines or uses."""
    for node in nodes(module):
        for field in ('id', 'attr', 'name', 'arg'):
            if isinstance(name := getattr(node, field, None), str):
                yield name


def test_modules_import_only_from_folders_below_their_own() -> None:
    assert {module: above for module in MODULES if (above := [
        name for name in own_imports(module) if folder(name) not in allowed(folder(module))])
    } == {}


def test_one_module_uses_private_parts_of_rclpy() -> None:
    assert [module for module in MODULES
            if any(name.startswith(('rclpy.impl', 'rclpy._')) for name in imports(module))
            or '_parameter_overrides' in identifiers(module)
            ] == [f'{PACKAGE}.ros.rclpy_private']


def test_modules_outside_the_ros_folders_do_not_import_ros() -> None:
    without_ros = [module for module in MODULES if folder(module)[-1:] not in (('ros',), ('cli',))
                   or module.split('.')[2:3] in (['simulator'], ['conformance'], ['discover'])]

    assert {module: found for module in without_ros if (found := [
        *roots(imports(module)) & ROS,
        *(name for name in own_imports(module) if folder(name)[-1:] == ('ros',))])} == {}


def test_tests_of_make_unit_are_collected_without_ros() -> None:
    recipe = re.search(r'-m pytest (-p support\.no_ros.*(?:\n\t\t.*)*)',
                       (ROOT / 'Makefile').read_text())
    assert recipe is not None
    arguments = recipe[1].replace('\\', '').split()
    collected = subprocess.run(
        [sys.executable, '-m', 'pytest', '--collect-only', '-q', *arguments], cwd=ROOT, text=True,
        stdout=subprocess.PIPE, stderr=subprocess.STDOUT, env=environment())
    assert collected.returncode == 0, collected.stdout[-2000:]


def test_no_module_imports_itself_by_way_of_others() -> None:
    chain: list[str] = []

    try:
        graphlib.TopologicalSorter(
            {module: own_imports(module) - {module} for module in MODULES}).prepare()
    except graphlib.CycleError as error:
        # The sorter names each module before the one that imports it.
        chain = list(reversed(error.args[1]))

    assert not chain, 'import circle: ' + ' -> '.join(chain)


def test_protocol_modules_do_no_io_and_have_no_clock_and_no_thread() -> None:
    sans_io = [module for module in MODULES if folder(module) and (
        # The folder itself imports a public name only when that is used.
        folder(module) == ('mavlink',) and module != f'{PACKAGE}.mavlink'
        and not set(module.split('.')[2:]) & MAVLINK_IO
        or folder(module)[0] in {'payload', 'simulation', 'checks'} | PAYLOADS
        and folder(module)[1:] != ('ros',))]
    above = tuple(f'{PACKAGE}.mavlink.{name}' for name in (
        'line', 'link', 'connector', 'transport.'))

    assert {module: found for module in sans_io if (found := [
        *roots(imports(module)) & (IO | TIME | THREADS),
        *(name for name in own_imports(module) if name.startswith(above)
          and not name.endswith('.link_state'))])} == {}


def test_shared_protocol_modules_name_no_payload() -> None:
    # MAVLink's own names: entries of enums are in capitals, and pymavlink's classes begin with its
    # name; payload/messages.py has messages of MAVLink that several payloads read.
    assert {module: found for module in MODULES if folder(module) in (
                ('mavlink',), ('payload',), ('simulation',), ('checks',))
            and module != f'{PACKAGE}.payload.messages'
            and (found := [name for name in identifiers(module) if PAYLOAD_WORD.search(name)
                           and name not in {PACKAGE, *SHARED_NAMES}
                           and not (name.isupper() or name.startswith('MAVLink_'))])} == {}


# The parts of the monitor that may use the terminal, and those that may use the ROS graph.
@pytest.mark.parametrize(('part', 'foreign'), [
    ('table', ROS | IO | TIME | THREADS | {'textual'}), ('app', ROS | THREADS),
    ('terminal', ROS), ('web', ROS | {'textual'}), ('ros_graph', {'textual'} | IO | THREADS)])
def test_part_of_the_monitor_imports_only_its_own_libraries(
    part: str, foreign: set[str],
) -> None:
    assert roots(imports(f'{PACKAGE}.cli.monitor.{part}')) & foreign == set()


def test_monitor_loads_no_mavlink() -> None:
    pytest.importorskip('textual')
    script = """
import sys
from illuminator_ros.cli.monitor import app, run
from illuminator_ros.cli.payloads import PAYLOADS
views = [one.load('view') for one in PAYLOADS.values() if one.view]
print(len(views), *(name for name in sys.modules if 'pymavlink' in name))
"""
    loaded = subprocess.run([sys.executable, '-c', script], cwd=ROOT, text=True, check=True,
                            capture_output=True, env=environment()).stdout

    assert loaded == '3\n'


def tracked() -> list[Path]:
    """Return all files of the repository."""
    listed = subprocess.run(['git', 'ls-files'], cwd=ROOT, text=True, capture_output=True,
                            check=False).stdout.split()
    return [ROOT / name for name in listed] or [
        *MODULES.values(), *(ROOT / 'test').rglob('*.py'), *(ROOT / 'doc').rglob('*.md')]


def test_classes_have_at_most_15_fields_and_30_methods() -> None:
    """More show that a class has several subjects."""
    large = {}
    for module in MODULES:
        for cls in nodes(module):
            if isinstance(cls, ast.ClassDef):
                methods = [node for node in cls.body if isinstance(node, ast.FunctionDef)]
                assigned = (target for method in methods for node in ast.walk(method)
                            if isinstance(node, ast.Assign | ast.AnnAssign) for target in (
                                node.targets if isinstance(node, ast.Assign) else [node.target]))
                fields = {one.attr for target in assigned
                          for one in (target, *getattr(target, 'elts', ()))
                          if isinstance(one, ast.Attribute) and isinstance(one.value, ast.Name)
                          and one.value.id == 'self'}
                if len(fields) > 15 or len(methods) > 30:
                    large[f'{module}.{cls.name}'] = len(fields), len(methods)

    assert large == {}


def test_no_file_refers_to_documents_outside_the_repository() -> None:
    # In parts, so that this file does not contain it.
    outside = re.compile('DESIGN' r'\.md|\.\./' 'shared/|/work' '/(shared|plan)')
    texts = {path: path.read_text(errors='replace') for path in tracked() if path.is_file()}

    assert [str(path.relative_to(ROOT)) for path, text in texts.items()
            if outside.search(text)] == []


def test_tests_do_not_read_the_clock_of_the_machine() -> None:
    clock = re.compile(
        r'\btime\.(monotonic|perf_counter|process_time|clock_gettime|time)(_ns)?\(')

    assert [path.name for path in (ROOT / 'test').rglob('test_*.py')
            if clock.search(path.read_text())] == []
