# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The pages about the ROS interface, compared with the bridge."""

from collections.abc import Sequence
import re

from illuminator_ros.cli.bridge import Executable, usage
from illuminator_ros.gimbal.ros.gimbals import GIMBAL_PARAMETERS
from illuminator_ros.gimbal.ros.manager_node import MANAGER_PARAMETERS
from illuminator_ros.illuminator.ros.parameters import DEVICE_PARAMETERS, LIGHT_PARAMETERS
from illuminator_ros.rededge.ros import camera_node as camera
from illuminator_ros.ros.conversions import GEOID_SEPARATION
from illuminator_ros.ros.parameters import LINK_PARAMETERS as SHARED_PARAMETERS
from illuminator_ros.ros.parameters import ParameterSpec
import pytest
from support.processes import ROOT
from support.tables import parameter_file, table
from tools.doc_tables import values_of

README = (ROOT / 'README.md').read_text()
YAML = (ROOT / 'config' / 'bridge.yaml').read_text()
REFERENCE, MONITOR = (
    (ROOT / 'doc' / f'{page}.md').read_text() for page in ('reference', 'monitor'))
LINK_PARAMETERS = (*SHARED_PARAMETERS, *LIGHT_PARAMETERS)
CAMERA_PARAMETERS = (*camera.PARAMETERS, *camera.MOUNT_PARAMETERS)
URL, CAMERA_URL = (
    SHARED_PARAMETERS[0]._replace(default=default)
    for default in (SHARED_PARAMETERS[0].default, camera.REDEDGE.link_defaults['connection_url']))
PARAMETERS = (*LINK_PARAMETERS, *DEVICE_PARAMETERS)


def test_the_reference_has_each_parameter_that_may_change() -> None:
    specs = (*LINK_PARAMETERS, *GIMBAL_PARAMETERS, *MANAGER_PARAMETERS, *camera.PARAMETERS)

    assert [row[0].strip('`') for row in table(REFERENCE, 'may be set at any time')] == [
        *dict.fromkeys(spec.name for spec in specs if spec.changeable)]


@pytest.mark.parametrize(('file', 'specs'), [
    ('bridge', LINK_PARAMETERS), ('gimbal', (URL, *GIMBAL_PARAMETERS)),
    ('gimbal_manager', (URL, *GIMBAL_PARAMETERS, *MANAGER_PARAMETERS)),
    ('rededge', (CAMERA_URL, *CAMERA_PARAMETERS))],
    ids=['bridge', 'gimbal', 'gimbal_manager', 'rededge'])
def test_a_parameter_file_has_each_parameter_with_its_default(
    file: str, specs: Sequence[ParameterSpec],
) -> None:
    assert [(name, type(value), value) for name, value in parameter_file(file).items()] == [
        # While it is not set, the diagnostics warn.
        (spec.name, type(spec.default), spec.default) for spec in specs
        if spec is not GEOID_SEPARATION]


@pytest.mark.parametrize('spec', PARAMETERS, ids=lambda spec: spec.name)
def test_parameter_file_and_help_have_each_parameter_with_its_unit(spec: ParameterSpec) -> None:
    limits = f'{values_of(spec)} {spec.unit}'.replace('`', '').strip()
    shown = re.escape(spec.description + (f' ({limits})' if limits else ''))
    unit = f'# {re.escape(spec.unit)}(,|$)' if spec.unit else ''

    assert re.search(rf'^  {spec.name} +.*{shown}$', usage(Executable()), re.MULTILINE)
    assert re.search(rf'^    (# )?{spec.name}: .+{unit}', YAML, re.MULTILINE)


def test_the_readme_has_each_executable_which_is_also_a_module() -> None:
    package = ROOT / 'illuminator_ros'
    modules = {*(path.stem for path in package.glob('[!_]*.py')),
               *(path.parent.name for path in package.glob('*/__main__.py'))}
    scripts = (ROOT / 'setup.py').read_text().partition("'console_scripts'")[2]
    executables = {name for names in re.findall(r'for name in \(([^)]*)\)', scripts)
                   for name in re.findall(r'\w+', names)}

    assert {row[0].strip('`') for row in table(README, 'executable')} == modules == executables
