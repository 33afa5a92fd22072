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


"""The script that runs the documented ros2 commands: what it reads, and what fails."""

import importlib.util
from pathlib import Path

import pytest
from support.processes import ROOT

SPEC = importlib.util.spec_from_file_location(
    'documented_commands', ROOT / 'tools' / 'documented_commands.py')
assert SPEC and SPEC.loader
script = importlib.util.module_from_spec(SPEC)
SPEC.loader.exec_module(script)


def test_commands_of_all_pages_are_read_with_their_continuations_and_comments() -> None:
    found = list(script.commands())

    assert {'README.md', 'ros.md', 'gimbal.md'} <= {one.page for one in found}
    assert all(one.text.startswith('ros2 ') and '\\' not in one.text for one in found)
    assert ('safety.md', 'ros2 topic echo --once /illuminator/connected', 'data: true') in found


@pytest.mark.parametrize(('text', 'expected', 'fails'), [
    ('echo "data: true"', 'data: true, and it shines', False),
    ('echo "data: false"', 'data: true, and it shines', True),
    ('echo "success=False"', '', True), ('exit 1', '', True),
    ('echo "Setting parameter failed"', '', True),
    ('printf "x: -0.10\\ny: 0.5\\n"', '-0.099, 0.5', False),
    ('printf "x: -0.10\\ny: 0.6\\n"', '-0.099, 0.5', True)])
def test_a_command_whose_output_differs_from_the_page_fails(
        tmp_path: Path, text: str, expected: str, fails: bool) -> None:
    command = script.Command('page.md', text, expected)
    try:
        script.run_command(command, tmp_path)
        failed = False
    except script.Failed:
        failed = True

    assert failed is fails


@pytest.mark.parametrize(('text', 'fails'), [
    ('sleep 60', False), ('bash -c "exit 2"', True), ("trap '' INT; sleep 60", True)])
def test_a_program_that_ends_or_does_not_obey_ctrl_c_fails(
        tmp_path: Path, monkeypatch: pytest.MonkeyPatch, text: str, fails: bool) -> None:
    monkeypatch.setattr(script, 'RUNNING_TIME', 0.5)
    monkeypatch.setattr(script, 'END_LIMIT', 0.5)
    command = script.Command('page.md', f'bash -c "{text}"' if 'trap' in text else text, '')
    try:
        script.run_program(command, tmp_path)
        failed = False
    except script.Failed:
        failed = True

    assert failed is fails
