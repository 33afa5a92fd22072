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

"""What the pages for people say is what the code has."""

from pathlib import Path
import re

from illuminator_ros.cli.simulator.console import COMMANDS, OTHERS
from illuminator_ros.cli.simulator.lights import scene
from illuminator_ros.cli.simulator.settings import SETTINGS
from illuminator_ros.illuminator.behaviour import PROFILES
from illuminator_ros.illuminator.checks.requirements import REQUIREMENTS
from illuminator_ros.illuminator.faults import FAULTS
import pytest

ROOT = Path(__file__).resolve().parents[2]
CONFORMANCE = (ROOT / 'doc' / 'conformance.md').read_text()
SIMULATOR = (ROOT / 'doc' / 'simulator.md').read_text()
README = (ROOT / 'README.md').read_text()

NOTES = {(False, False): '', (True, False): 'changes', (True, True): 'dazzles'}


def rows(document: str, heading: str) -> list[list[str]]:
    """Return the rows of the table that begins with a heading."""
    _, found, rest = document.partition(f'| {heading} |')
    assert found, heading
    table = rest.partition('\n\n')[0].splitlines()[2:]
    return [[cell.strip() for cell in row.strip('|').split(' | ')] for row in table]


def test_the_page_has_every_requirement_in_order_with_its_section():
    assert rows(CONFORMANCE, 'requirement') == [
        [f'`{one.name}`', one.title,
         f'[{one.specification.title}]({one.specification.url}), {one.section}',
         NOTES[one.changes, one.dazzles]] for one in REQUIREMENTS]


def test_the_sample_report_has_every_requirement():
    sample = CONFORMANCE.partition('$ conformance udpout')[2].partition('```')[0]
    found = re.findall(r'^(?:PASS|FAIL|SKIPPED) +([\w-]+)', sample, re.MULTILINE)
    assert found == [one.name for one in REQUIREMENTS]


def test_the_sample_report_is_of_its_command():
    asked, begun = re.findall(r'(?:\$ conformance|checking the light on) (\S+)', CONFORMANCE)
    assert asked == begun


def test_the_readme_counts_the_requirements():
    assert f'for {len(REQUIREMENTS)} requirements' in README


def test_the_page_has_every_fault():
    assert rows(SIMULATOR, 'fault') == [
        [f'`{name}={fault.metavar}`' if fault.metavar else f'`{name}`', fault.description,
         fault.default_text] for name, fault in FAULTS.items()]


def test_the_page_has_every_profile():
    assert rows(SIMULATOR, 'profile') == [
        [f'`{name}`', profile.description] for name, profile in PROFILES.items()]


def test_the_page_has_every_setting():
    assert rows(SIMULATOR, 'setting') == [
        [f'`{name}`', setting.metavar, setting.help] for name, setting in SETTINGS.items()]


def test_the_page_has_every_command():
    assert rows(SIMULATOR, 'command') == [
        *([f'`{one.usage}`', one.help] for one in COMMANDS.values()),
        *([f'`{name}`', text] for name, text in OTHERS.items())]


def test_the_sample_file_is_one():
    yaml = pytest.importorskip('yaml')
    text = SIMULATOR.partition('```yaml\n')[2].partition('```')[0]
    found = scene(yaml.safe_load(text), 'the sample')
    assert [name for _, name, _ in found.lights] == ['bow', 'stern']
