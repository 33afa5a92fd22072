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

"""What a run has found, for people and for programs."""

import json
from xml.etree import ElementTree

from illuminator_ros.illuminator.checks.catalogue import REQUIREMENTS
from illuminator_ros.illuminator.identity import Identity
from illuminator_ros.illuminator.simulated_properties import IlluminatorProperties
from illuminator_ros.mavlink.messages import Address
from illuminator_ros.payload.checks.report import (
    as_json,
    as_junit,
    catalogue,
    lines,
    Report,
    Table,
)
import pytest
from support.conformance_run import Run


@pytest.fixture(scope='module')
def run():
    return Run(IlluminatorProperties(identity=Identity('\x07bell', 'm', '1', '1', 'x&<y>')),
               faults=('nan', 'any-target')).finish()


@pytest.fixture(scope='module')
def report(run):
    return Report('illuminator', 'light', 'udpin://127.0.0.1:1', 'light 1/243: x&<y>',
                  tuple(run.suite.results), run.suite.restored, 12.5, run.suite.passed)


def test_the_json_report_has_every_requirement_with_all_that_was_said(report):
    content = json.loads(as_json(report))
    assert [one['name'] for one in content['results']] == [one.name for one in REQUIREMENTS]
    (nan,) = [one for one in content['results'] if one['name'] == 'not-a-number']
    assert nan['verdict'] == 'FAIL'
    assert nan['specification'] == 'common message set'
    assert nan['section'] == 'MAV_CMD_DO_ILLUMINATOR_CONFIGURE'
    assert any('> COMMAND_LONG' in line for line in nan['exchange'])
    assert any('< COMMAND_ACK' in line for line in nan['exchange'])
    assert content['counts']['FAIL'] == 3
    assert content['passed'] is False
    assert content['restored'] == 'the light is as it was'


def test_the_junit_report_counts_as_the_run_did(report):
    suite = ElementTree.fromstring(as_junit(report))
    assert suite.tag == 'testsuite'
    assert int(suite.get('tests')) == len(suite.findall('testcase')) == len(REQUIREMENTS)
    assert int(suite.get('failures')) == len(suite.findall('testcase/failure')) == 3
    assert int(suite.get('skipped')) == len(suite.findall('testcase/skipped')) == 1


def test_the_junit_report_says_what_is_wrong_and_where_it_is_written(report):
    suite = ElementTree.fromstring(as_junit(report))
    (case,) = [one for one in suite.findall('testcase')
               if one.get('name').startswith('other-target: ')]
    assert case.get('classname') == 'routing'
    assert 'switched on by a command for 1/200' in case.find('failure').get('message')
    assert 'guide/routing.html' in case.find('failure').text
    assert 'COMMAND_LONG to 1/200' in case.find('system-out').text


def test_the_table_has_a_line_for_what_is_met(run):
    assert lines(run.result('off')) == ['PASS    off                    can be switched off']


def test_the_table_says_of_what_is_not_met_what_is_wrong_what_was_said_and_the_section(run):
    first, reason, section, *said = lines(run.result('other-target'))
    assert first.startswith('FAIL    other-target')
    assert 'switched on by a command for 1/200' in reason
    assert section.strip() == ('see routing, "Routing Detail": '
                               'https://mavlink.io/en/guide/routing.html')
    assert '> COMMAND_LONG to 1/200: MAV_CMD_ILLUMINATOR_ON_OFF 1' in said[0]
    assert not any(' HEARTBEAT ' in line for line in said)


def test_the_table_says_why_something_was_skipped(run):
    assert 'no flag; try a longer --heat' in lines(run.result('thermal-flags'))[1]


def shown(run):
    table = Table()
    return [line for one in run.suite.results for line in table.add(one)] + table.end()


def test_without_a_light_the_table_has_one_line_for_all_that_was_not_checked():
    run = Run(target=Address(9, 9)).finish()
    assert shown(run)[:2] == lines(run.result('heartbeat'))[:2]
    assert shown(run)[-1] == 'SKIPPED 47 requirements: 9/9 was not heard within 10 s'
    assert len(shown(run)) == 4
    assert len(run.suite.results) == len(REQUIREMENTS)


def test_after_an_interruption_the_table_has_one_line_for_the_rest():
    run = Run(consent=False)
    run.link.run_until(lambda: len(run.suite.results) == 10, within=100.0)
    run.interrupt()
    run.finish()
    assert len(shown(run)) == 11
    assert shown(run)[-1] == 'SKIPPED 38 requirements: interrupted'


def test_a_light_that_falls_silent_leaves_one_line_for_what_was_not_checked():
    run = Run()
    run.link.run(8.0)
    run.fault('silence')
    run.finish()
    (line,) = [line for line in shown(run) if 'requirements: ' in line]
    assert line.endswith('the light has stopped sending')
    assert any('FAIL    acknowledged ' in line for line in shown(run))


def test_what_was_skipped_for_a_reason_of_its_own_keeps_its_lines():
    run = Run(consent=False).finish()
    assert sum('not agreed to' in line for line in shown(run)) == 6


def test_one_requirement_that_was_not_checked_is_named():
    run = Run(target=Address(9, 9), only=('on',)).finish()
    assert shown(run) == lines(run.result('on'))


def test_the_summary_counts(report):
    assert report.summary == '44 passed, 3 failed, 1 skipped in 12 s; the light is as it was'


def test_the_catalogue_has_every_requirement_with_its_section():
    text = catalogue(REQUIREMENTS, 'light')
    assert len(text) == len(REQUIREMENTS)
    for one, row in zip(REQUIREMENTS, text, strict=True):
        assert row.startswith(one.name)
        assert f'[{one.specification.title}, "{one.section}"' in row
