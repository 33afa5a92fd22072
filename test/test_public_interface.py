# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The names that other packages and users of the core import."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from importlib import import_module
import inspect
from pathlib import Path
import re
import subprocess
import sys
from types import ModuleType
from typing import Any

from illuminator_ros.mavlink import MavlinkError
import pytest
from support.processes import environment, ROOT
from support.tables import table

WITHOUT_ROS = ('mavlink', 'payload', 'simulation', 'checks', 'illuminator')


def package(name: str) -> ModuleType:
    if name not in WITHOUT_ROS:
        pytest.importorskip('rclpy')
    return import_module(f'illuminator_ros.{name}')


def typed_exports(module: ModuleType) -> dict[str, str]:
    """Return the names that type checkers see, with the modules of the package that have them."""
    assert module.__file__
    [branch] = [one for one in ast.parse(Path(module.__file__).read_text()).body
                if isinstance(one, ast.If)]
    assert ast.unparse(branch.test) == 'TYPE_CHECKING'
    found = {}
    for one in branch.body:
        assert isinstance(one, ast.ImportFrom)
        for alias in one.names:
            found[alias.name] = f'{module.__name__}.{one.module}'
    return found


def own_docstring(one: object) -> str:
    """Return the docstring that was written for a class or function."""
    text = inspect.getdoc(one) or ''
    is_generated = text.startswith(f'{getattr(one, "__name__", "")}(')
    return '' if is_generated else text


@pytest.mark.parametrize('name', [*WITHOUT_ROS, 'ros'])
def test_each_public_name_is_the_documented_object_that_type_checkers_see(name: str) -> None:
    module = package(name)
    exports = typed_exports(module)

    assert sorted(module.__all__) == sorted(exports)
    for public, source in exports.items():
        one = getattr(module, public)
        assert one is getattr(import_module(source), public), public
        if inspect.isclass(one) or inspect.isfunction(one):
            assert own_docstring(one), public
        # A module of this name would take its place when it is imported.
        assert not inspect.ismodule(one) or not one.__name__.startswith('illuminator_ros'), public


@pytest.mark.parametrize('name', [*WITHOUT_ROS, 'ros'])
def test_a_name_that_is_not_public_is_an_attribute_error(name: str) -> None:
    with pytest.raises(AttributeError, match="has no attribute 'no_such_name'"):
        getattr(package(name), 'no_such_name')  # noqa: B009 - mypy knows that it is missing


def test_importing_the_packages_imports_neither_pymavlink_nor_their_modules() -> None:
    script = f"""
import sys
from importlib import import_module
for name in {WITHOUT_ROS + ('ros',)}:
    import_module(f'illuminator_ros.{{name}}')
print(*sorted(name for name in sys.modules if 'mavlink' in name or name.count('.') > 1
              and name.startswith('illuminator_ros')))
"""
    loaded = subprocess.run([sys.executable, '-c', script], cwd=ROOT, text=True, check=True,
                            capture_output=True, env=environment()).stdout

    assert loaded == 'illuminator_ros.mavlink\n'


def test_the_program_of_the_page_runs() -> None:
    page = (ROOT / 'doc' / 'design.md').read_text()
    found = re.search(r'```\n(from illuminator_ros\.illuminator import.*?)```', page, re.DOTALL)
    assert found
    program = found[1].replace('my_winch.', 'payloads.').replace(
        'udpin://127.0.0.1:14590', 'memory://page')
    names: dict[str, Any] = {}
    exec(program, names)
    assert names['link'].is_running()
    names['link'].stop()


def test_the_page_and_the_core_have_the_same_exceptions() -> None:
    page = (ROOT / 'doc' / 'design.md').read_text()
    exported = {name for folder in WITHOUT_ROS for name in package(folder).__all__
                if isinstance(one := getattr(package(folder), name), type)
                and issubclass(one, MavlinkError)}
    listed = {row[0].split('`')[1].rpartition('.')[2] for row in table(page, 'exception')}
    assert listed == exported | {'ParameterError'}


def imported_modules(path: Path) -> Iterator[str]:
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.ImportFrom) and str(node.module).startswith('illuminator_ros'):
            yield str(node.module)


def test_the_payload_to_copy_imports_public_names_only() -> None:
    public = {'illuminator_ros', 'illuminator_ros.ros.monitor_view',
              *(f'illuminator_ros.{name}' for name in (*WITHOUT_ROS, 'ros'))}
    files = [ROOT / 'test' / 'payloads' / name for name in ('winch.py', 'winch_ros.py')]

    assert {one for path in files for one in imported_modules(path)} - public == set()
