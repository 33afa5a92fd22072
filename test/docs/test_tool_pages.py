# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The pages of simulator, conformance and discover, compared with these programs; needs no ROS."""

import json
from pathlib import Path
import re
import shlex
from typing import Any

from illuminator_ros.checks.report import as_json, RunReport
from illuminator_ros.checks.requirements import CheckResult, CheckVerdict, Requirement
from illuminator_ros.cli.conformance.run import parse
from illuminator_ros.cli.discover import run as discover
from illuminator_ros.cli.payloads import PAYLOADS
from illuminator_ros.cli.simulator.components import scenario
from illuminator_ros.cli.simulator.options import parser, payload_types
from illuminator_ros.gimbal.checks import device, manager
from illuminator_ros.illuminator.checks.requirements import REQUIREMENTS
from illuminator_ros.illuminator.simulated import SIMULATED
from payloads.winch import WINCH
import pytest
from support.tables import table

DOC = Path(__file__).parents[2] / 'doc'
CONFORMANCE = (DOC / 'conformance.md').read_text()
SIMULATOR = (DOC / 'simulator.md').read_text()


def test_the_keys_of_a_json_report_are_listed_in_order_for_each_kind_of_device() -> None:
    report_keys, result_keys = (
        [key for row in table(CONFORMANCE, heading) for key in re.findall('`(.+?)`', row[0])]
        for heading in ('key of the JSON report', 'key of a result'))
    devices = [one.load('checks').device for one in PAYLOADS.values() if one.checks]

    for device_key in devices:
        content = json.loads(as_json(RunReport(
            'name', device_key, '', '', (CheckResult(REQUIREMENTS[0], CheckVerdict.PASS),), '',
            0.0, True)))
        others = {*devices} - {device_key}
        assert list(content) == [key for key in report_keys if key not in others]
        assert list(content['results'][0]) == result_keys


COMMANDS = [
    (page.name, *one.groups())
    for page in (*DOC.glob('*.md'), DOC.parent / 'README.md')
    for block in page.read_text().split('```')[1::2]
    for one in re.finditer(
        r'^[^#\n]*?\b(?:illuminator-|ros2 run illuminator_ros )'
        r'(simulator|conformance|discover)\b(.*)', block, re.M)]
# The design page adds a winch.
KINDS = {**PAYLOADS, 'winch': WINCH}


@pytest.mark.parametrize(('page', 'program', 'text'), COMMANDS)
def test_a_command_in_a_block_of_code_has_arguments_that_the_program_takes(
    page: str, program: str, text: str,
) -> None:
    arguments = shlex.split(text.partition('$(')[0], comments=True)

    if program == 'simulator':
        parser(payload_types(arguments, KINDS), KINDS).parse_args(arguments)
    elif program == 'discover':
        discover.parse(arguments)
    else:
        parse(arguments, KINDS)


def test_the_kinds_of_devices_are_listed_with_their_options() -> None:
    kinds = {name: one.load('simulated') for name, one in PAYLOADS.items()}

    assert {(row[0], *row[2:]) for row in table(SIMULATOR, '`--payload`')} == {
        (f'`{name}`', str(kind.address({})), f'`--{kind.noun}`, `{kind.plural}`')
        for name, kind in kinds.items()}


def test_the_sample_file_of_the_simulator_is_valid() -> None:
    yaml = pytest.importorskip('yaml')
    text = SIMULATOR.partition('```yaml\n')[2].partition('```')[0]

    lights = scenario(yaml.safe_load(text), 'the sample', [SIMULATED]).listed

    assert [one.name for one in lights] == ['bow', 'stern']


def test_each_rule_of_gimbals_is_listed_with_its_requirements_and_has_a_test_or_requirement(
        ) -> None:
    requirements: list[Requirement[Any]] = [*device.REQUIREMENTS, *manager.REQUIREMENTS]
    checked: dict[str, list[str]] = {}
    for one in requirements:
        for rule in re.findall(r'GM-\d+', f'{one.title} {one.section}'):
            checked[rule] = [*dict.fromkeys([*checked.get(rule, ()), one.name])]
    tested = {f'GM-{number}' for path in (DOC.parent / 'test' / 'gimbal').glob('test_*.py')
              for name in re.findall(r'^(?:async )?def test(\w+)', path.read_text(), re.MULTILINE)
              for number in re.findall(r'_gm_(\d+)', name)}
    listed = {rule: re.findall('`(.+?)`', names) for rule, _, names in table(
        (DOC / 'design.md').read_text(), 'rule')}

    assert {*listed} == tested | {*checked}
    assert {rule: names for rule, names in listed.items() if names} == checked
