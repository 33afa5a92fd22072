# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Reports of a run: text, JSON, JUnit XML."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass
import json
from xml.etree import ElementTree

from .requirements import AnyRequirement, CheckResult, CheckVerdict
from .specifications import HEARTBEAT
from .. import __version__

SHOWN_LINES = 12
# Characters that XML 1.0 excludes ("Char"): control characters, surrogates, and two others.
_NOT_XML = {code: '?' for code in (*range(32), *range(0xd800, 0xe000), 0xfffe, 0xffff)
            if code not in (9, 10, 13)}


@dataclass(frozen=True)
class RunReport:
    """
    The report of a run.

    :param payload: name of the payload.
    :param kind: the kind of device.
    :param device: its address and identity, as text.
    :param restored: the state in which the device was left, as text.
    """

    payload: str
    kind: str
    url: str
    device: str
    results: tuple[CheckResult, ...]
    restored: str
    seconds: float
    passed: bool

    def count(self, verdict: CheckVerdict) -> int:
        """Return the number of results with a verdict."""
        return sum(one.verdict is verdict for one in self.results)

    @property
    def summary(self) -> str:
        """Return the last line."""
        return (f'{self.count(CheckVerdict.PASS)} passed, {self.count(CheckVerdict.FAIL)} failed, '
                f'{self.count(CheckVerdict.SKIPPED)} skipped in {self.seconds:.0f} s; '
                f'{self.restored}')


def lines(result: CheckResult, *, verbose: bool = False) -> list[str]:
    """
    Return a result as lines of the table.

    :param verbose: whether to show the lines of the log for a requirement that is met, too.
    """
    one = result.requirement
    met = result.verdict is CheckVerdict.PASS
    detail = f' ({result.detail})' if result.detail and met else ''
    text = [f'{result.verdict.value:8}{one.name:23}{one.title}{detail}']
    if not met:
        text.append(f'{"":8}{result.detail}')
    if result.verdict is CheckVerdict.FAIL or verbose:
        text.append(f'{"":8}see {one.place}: {one.specification.url}')
        shown = [line for line in result.exchange
                 if one.specification is HEARTBEAT or ' HEARTBEAT ' not in line]
        # The last lines show the failure.
        if len(shown) > SHOWN_LINES:
            text.append(f'{"":8}  ... {len(shown) - SHOWN_LINES} earlier lines with --json')
        text += [f'{"":8}  {line}' for line in shown[-SHOWN_LINES:]]
    return text


def unreached(results: Iterable[CheckResult]) -> list[str]:
    """Return a line for all requirements that were not reached for the same reason."""
    reasons = Counter(one.detail for one in results if not one.reached)
    return [f'{CheckVerdict.SKIPPED.value:8}{count} not reached: {reason}'
            for reason, count in reasons.items()]


def remedies(results: Iterable[CheckResult], kind: str) -> list[str]:
    """Return what a device must do instead, a line for each requirement that is not met."""
    failed = [one.requirement for one in results if one.verdict is CheckVerdict.FAIL]
    return [f'To change; a correct {kind} ...', *(
        f'{"":8}{one.name:23}{one.title}: {one.specification.url}' for one in failed)
    ] if failed else []


def catalogue(requirements: Iterable[AnyRequirement], kind: str) -> list[str]:
    """Return all requirements on a kind of device, a line each."""
    notes = {(False, False): '', (True, False): f', changes the {kind}',
             (True, True): ', needs your consent'}
    return [f'{one.name:23}{one.title} [{one.place}{notes[one.changes, one.needs_consent]}]'
            for one in requirements]


def as_json(report: RunReport) -> str:
    """Return the report as JSON."""
    return json.dumps({
        'tool': f'illuminator_ros conformance {__version__}',
        'url': report.url,
        report.kind: report.device,
        'passed': report.passed,
        'seconds': round(report.seconds, 3),
        'restored': report.restored,
        'counts': {one.value: report.count(one) for one in CheckVerdict},
        'results': [{
            'name': one.requirement.name,
            'title': one.requirement.title,
            'verdict': one.verdict.value,
            'detail': one.detail,
            'specification': one.requirement.specification.title,
            'section': one.requirement.section,
            'specification_url': one.requirement.specification.url,
            'seconds': round(one.seconds, 3),
            'exchange': one.exchange,
        } for one in report.results],
    }, indent=2) + '\n'


def as_junit(report: RunReport) -> str:
    """Return the report as JUnit XML, in UTF-8."""
    def add(parent: ElementTree.Element, tag: str, **attributes: str) -> ElementTree.Element:
        return ElementTree.SubElement(
            parent, tag, {name: text.translate(_NOT_XML) for name, text in attributes.items()})

    failures = report.count(CheckVerdict.FAIL)
    # A reader of the report alone must not take an incomplete run for one without a fault.
    error = not (report.passed or failures)
    suite = ElementTree.Element(
        'testsuite', name=f'{report.payload} conformance',
        tests=str(len(report.results) + error), failures=str(failures), errors=str(int(error)),
        skipped=str(report.count(CheckVerdict.SKIPPED)), time=f'{report.seconds:.3f}')
    properties = add(suite, 'properties')
    for name, value in (('url', report.url), (report.kind, report.device),
                        ('restored', report.restored)):
        add(properties, 'property', name=name, value=value)
    for result in report.results:
        one = result.requirement
        case = add(suite, 'testcase', name=f'{one.name}: {one.title}',
                   classname=one.specification.title, time=f'{result.seconds:.3f}')
        if result.verdict is CheckVerdict.FAIL:
            failure = add(case, 'failure', message=result.detail)
            failure.text = f'see {one.place}: {one.specification.url}'
        elif result.verdict is CheckVerdict.SKIPPED:
            add(case, 'skipped', message=result.detail)
        add(case, 'system-out').text = '\n'.join(result.exchange).translate(_NOT_XML)
    if error:
        case = add(suite, 'testcase', name='run', classname='conformance', time='0.000')
        add(case, 'error', message=f'incomplete: {report.summary}')
    ElementTree.indent(suite)
    # Not 'unicode', which declares the encoding of the locale.
    text: bytes = ElementTree.tostring(suite, encoding='utf-8', xml_declaration=True)
    return text.decode() + '\n'
