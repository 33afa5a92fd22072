# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The reports of a run: table, JSON, JUnit."""

import dataclasses
import json
from xml.etree import ElementTree

from illuminator_ros.checks import report as reports
from illuminator_ros.checks.report import lines, RunReport, unreached
from illuminator_ros.checks.requirements import CheckVerdict
from illuminator_ros.illuminator.checks.requirements import REQUIREMENTS
from illuminator_ros.mavlink.messages import Address
import pytest
from support.checks_run import ChecksRun, run, start


@pytest.fixture(scope='module')
def done() -> ChecksRun:
    return run('illuminator', 'nan', 'any-target', vendor='\x07bell', serial_number='x&<y>')


@pytest.fixture(scope='module')
def report(done: ChecksRun) -> RunReport:
    return RunReport('illuminator', 'light', 'udpin://127.0.0.1:1', 'light 1/243: x&<y>',
                     tuple(done.runner.results), done.runner.restored, 12.5, done.runner.passed)


def test_the_json_report_has_every_requirement_with_its_messages(report: RunReport) -> None:
    content = json.loads(reports.as_json(report))
    assert [one['name'] for one in content['results']] == [one.name for one in REQUIREMENTS]
    (nan,) = [one for one in content['results'] if one['name'] == 'not-a-number']
    assert nan['verdict'] == 'FAIL'
    assert nan['specification'] == 'common message set'
    assert nan['section'] == 'MAV_CMD_DO_ILLUMINATOR_CONFIGURE'
    assert any('> COMMAND_LONG' in line for line in nan['exchange'])
    assert any('< COMMAND_ACK' in line for line in nan['exchange'])
    assert content['counts']['FAIL'] == 3
    assert content['passed'] is False
    assert report.summary == '46 passed, 3 failed, 1 skipped in 12 s; the light is as it was'
    assert (content['light'], content['restored']) == (report.device, 'the light is as it was')


def test_the_end_names_what_failed_and_what_a_correct_light_does(report: RunReport) -> None:
    first, *each = reports.remedies(report.results, 'light')

    assert first == 'To change; a correct light ...'
    assert [line.split()[0] for line in each] == [
        one.requirement.name for one in report.results if one.verdict is CheckVerdict.FAIL]
    assert ('        not-a-number           rejects NaN and infinity in every parameter: '
            'https://mavlink.io/en/messages/common.html') in each
    assert reports.remedies([one for one in report.results if one.verdict is CheckVerdict.PASS],
                            'light') == []


def test_the_junit_report_has_counts_reasons_and_sections(report: RunReport) -> None:
    suite = ElementTree.fromstring(reports.as_junit(report))
    assert (suite.tag, suite.get('name')) == ('testsuite', 'illuminator conformance')
    assert [suite.get(key) for key in ('tests', 'failures', 'skipped')] == ['50', '3', '1']
    assert [len(suite.findall(path)) for path in (
        'testcase', 'testcase/failure', 'testcase/skipped')] == [50, 3, 1]
    (case,) = [one for one in suite.findall('testcase') if 'other-target: ' in one.attrib['name']]
    assert case.get('classname') == 'routing'
    (failure,) = case.findall('failure')
    assert 'switched on by a command for 1/200' in failure.attrib['message']
    assert 'guide/routing.html' in str(failure.text)
    assert 'COMMAND_LONG to 1/200' in str(case.findtext('system-out'))


@pytest.mark.parametrize('passed, errors', [(True, 0), (False, 1)])
def test_the_junit_report_of_a_run_without_exit_status_0_has_a_failure_or_an_error(
    report: RunReport, passed: bool, errors: int,
) -> None:
    assert ElementTree.fromstring(reports.as_junit(report)).get('errors') == '0'
    no_fault = tuple(one for one in report.results if one.verdict is not CheckVerdict.FAIL)
    suite = ElementTree.fromstring(reports.as_junit(dataclasses.replace(
        report, results=no_fault, restored='THE LIGHT IS NOT AS IT WAS', passed=passed)))

    assert [suite.get(key) for key in ('tests', 'failures', 'errors')] == [
        str(len(suite.findall('testcase'))), '0', str(errors)]
    assert [one.get('message') for one in suite.findall('testcase/error')] == [
        'incomplete: 46 passed, 0 failed, 1 skipped in 12 s; THE LIGHT IS NOT AS IT WAS'][:errors]


def test_the_junit_report_contains_no_character_that_xml_excludes(report: RunReport) -> None:
    url = 'a\0b\x1bc\udcffd\uffffe'
    suite = ElementTree.fromstring(reports.as_junit(dataclasses.replace(report, url=url)))

    assert suite.findall('properties/property')[0].get('value') == 'a?b?c?d?e'


def test_the_table_has_reason_section_and_messages_of_a_failed_requirement(
        done: ChecksRun) -> None:
    assert lines(done.result('off')) == ['PASS    off                    can be switched off']
    first, reason, section, *messages = lines(done.result('other-target'))
    assert first.startswith('FAIL    other-target')
    assert 'switched on by a command for 1/200' in reason
    assert section.strip() == ('see routing, "Routing Detail": '
                               'https://mavlink.io/en/guide/routing.html')
    assert '> COMMAND_LONG to 1/200: MAV_CMD_ILLUMINATOR_ON_OFF 1' in messages[0]
    assert not any(' HEARTBEAT ' in line for line in messages)
    assert 'set no flag; try a longer --heat' in lines(done.result('thermal-flags'))[1]


def test_the_table_has_the_last_messages_of_a_long_exchange() -> None:
    text = lines(run('illuminator', 'toggle', only=('repeated',)).result('repeated'))

    assert text[3].endswith('earlier lines with --json')
    assert any(line.endswith('ON_OFF 1, confirmation 1') for line in text[4:])


def test_requirements_that_were_not_reached_share_one_line() -> None:
    absent = run('illuminator', target=Address(9, 9))
    assert unreached(absent.runner.results) == ['SKIPPED 49 not reached: no light was found']

    interrupted = start('illuminator', consent=False)
    interrupted.link.run_until(lambda: len(interrupted.runner.results) >= 10, within=100.0)
    left = len(REQUIREMENTS) - len(interrupted.runner.results)
    interrupted.interrupt()
    # Requirements that lack consent keep their lines.
    assert unreached(interrupted.finish().runner.results) == [
        f'SKIPPED {left} not reached: interrupted']


def test_the_catalogue_has_a_line_for_each_requirement_with_its_section() -> None:
    for one, row in zip(REQUIREMENTS, reports.catalogue(REQUIREMENTS, 'light'), strict=True):
        assert row.startswith(one.name)
        assert f'[{one.specification.title}, "{one.section}"' in row
