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
``tf2_msgs`` for machines without ROS: made from its definition by the generators of ROS.

A ROS installation has the package; there are no wheels of it. The wheels of ROS have the
generators, headers and libraries that it needs.
"""

from __future__ import annotations

import importlib.util
import json
import os
from pathlib import Path
import shutil
import subprocess
import sys
import sysconfig

import pytest

PACKAGE = 'tf2_msgs'
DEFINITIONS = {'TFMessage': 'geometry_msgs/TransformStamped[] transforms\n'}
PREFIX = Path(sys.prefix)
# rmw_fastrtps uses both.
TYPESUPPORTS = ['rosidl_typesupport_introspection_c', 'rosidl_typesupport_fastrtps_c']
DISPATCH = 'rosidl_typesupport_c'
PYTHON, HASHES = 'rosidl_generator_py', 'rosidl_generator_type_description'
_VISIBILITY = '__visibility_control.h'


def tf2_path(folder: Path) -> str:
    """
    Return the PYTHONPATH with which other processes and this one find ``tf2_msgs``.

    The package is made in a folder if it is not installed, and put on this process's path.
    """
    path = os.environ.get('PYTHONPATH', '')
    if importlib.util.find_spec(PACKAGE) is None:
        if shutil.which('gcc') is None or not (PREFIX / 'share' / 'rosidl_generator_c').is_dir():
            pytest.skip(f'{PACKAGE} is not installed, and there is no compiler to make it')
        if not (folder / PACKAGE).exists():
            _make(folder)
        sys.path.append(str(folder))
        path = os.pathsep.join(filter(None, (str(folder), path)))
    return path


def _make(folder: Path) -> None:
    sources, package = folder / 'sources', folder / PACKAGE
    for name, text in DEFINITIONS.items():
        definition = sources / 'definitions' / 'msg' / f'{name}.msg'
        definition.parent.mkdir(parents=True, exist_ok=True)
        definition.write_text(text)
    os.environ.setdefault('AMENT_PREFIX_PATH', str(PREFIX))
    parts = _generate(sources)
    (package / 'msg').mkdir(parents=True)
    for file in (sources / PYTHON / PACKAGE / 'msg').glob('*.py'):
        shutil.copy(file, package / 'msg')
    (package / '__init__.py').touch()
    _compile(parts, sources, package)


def _generate(sources: Path) -> dict[str, list[str]]:
    """Return the files that the generators have written for each library."""
    from rosidl_adapter.msg import convert_msg_to_idl
    from rosidl_generator_c import generate_c
    from rosidl_generator_py import generate_py
    from rosidl_generator_type_description import generate_type_hash
    from rosidl_typesupport_c import generate_c as generate_dispatch
    from rosidl_typesupport_fastrtps_c import generate_typesupport_fastrtps_c as generate_fastrtps
    from rosidl_typesupport_introspection_c import generate_c as generate_introspection

    for name in DEFINITIONS:
        convert_msg_to_idl(
            sources / 'definitions', PACKAGE, Path('msg', f'{name}.msg'), sources / 'msg')
    hashes = sources / HASHES / PACKAGE / 'msg'
    known = [f'{folder.parent.name}:{folder.parent}' for folder in PREFIX.glob('share/*/msg')]

    def arguments(generator: str) -> str:
        templates = PREFIX / 'share' / generator / 'resource'
        output = sources / generator / PACKAGE
        (output / 'msg').mkdir(parents=True)
        if (template := templates / f'{generator}{_VISIBILITY}.in').exists():
            text = template.read_text().replace('@PROJECT_NAME@', PACKAGE)
            (output / 'msg' / f'{generator}{_VISIBILITY}').write_text(
                text.replace('@PROJECT_NAME_UPPER@', PACKAGE.upper()))
        file = sources / f'{generator}.json'
        file.write_text(json.dumps({
            'package_name': PACKAGE, 'output_dir': str(output), 'template_dir': str(templates),
            'idl_tuples': [f'{sources}:msg/{name}.idl' for name in DEFINITIONS],
            'type_description_tuples': [
                f'msg/{name}.idl:{hashes}/{name}.json' for name in DEFINITIONS],
            'ros_interface_dependencies': known, 'include_paths': known,
            'target_dependencies': []}))
        return str(file)

    introspection, fastrtps = TYPESUPPORTS
    generate_type_hash(arguments(HASHES))
    return {
        introspection: [*generate_c(arguments('rosidl_generator_c')),
                        *generate_introspection(arguments(introspection))],
        fastrtps: generate_fastrtps(arguments(fastrtps)),
        DISPATCH: [*generate_dispatch(arguments(DISPATCH), TYPESUPPORTS),
                   *generate_py(arguments(PYTHON), [DISPATCH])]}


def _compile(parts: dict[str, list[str]], sources: Path, package: Path) -> None:
    import numpy

    headers, libraries = PREFIX / 'include', PREFIX / 'lib'
    includes = [*sources.iterdir(), headers, *headers.iterdir(), sysconfig.get_path('include'),
                numpy.get_include()]
    made: list[Path] = []
    for part, files in parts.items():
        # The dispatch loads the typesupports by these names.
        name = f'lib{PACKAGE}__{part}.so' if part in TYPESUPPORTS else f'{PACKAGE}_s__{part}.so'
        subprocess.run(
            ['gcc', '-shared', '-fPIC', '-w', '-o', str(package / name), f'-Wl,-soname,{name}',
             *(file for file in files if file.endswith(('.c', '.cpp'))),
             *(f'-I{folder}' for folder in includes), '-Wl,--no-as-needed', *map(str, made),
             f'-L{libraries}', f'-Wl,-rpath,$ORIGIN:{libraries}',
             *(f'-lgeometry_msgs__{typesupport}' for typesupport in (
                 'rosidl_generator_c', 'rosidl_generator_py', *TYPESUPPORTS, DISPATCH)),
             '-lrosidl_runtime_c', '-lrosidl_typesupport_c', '-lrosidl_typesupport_fastrtps_c',
             '-lrosidl_typesupport_fastrtps_cpp', '-lrosidl_typesupport_introspection_c',
             '-lrmw', '-lrcutils', '-lfastcdr', '-lstdc++'], check=True)
        made.append(package / name)
