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

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
import json
from typing import Any
from xml.etree import ElementTree

from .requirement import HEARTBEAT, Requirement, Result, Verdict
from .requirements import REQUIREMENTS
from ... import __version__

# Lines of the exchange that a table shows; the files have more.
SHOWN_LINES = 12
# What XML 1.0 cannot carry, not even escaped.
_NOT_XML = {code: '?' for code in range(32) if code not in (9, 10, 13)}


@dataclass(frozen=True)
class Report:
    """
    A run.

    :param light: its address and what it says of itself, for people.
    :param restored: what became of it.
    """

    url: str
    light: str
    results: tuple[Result, ...]
    restored: str
    seconds: float
    passed: bool

    def count(self, verdict: Verdict) -> int:
        """Return how many results have a verdict."""
        return sum(one.verdict is verdict for one in self.results)

    @property
    def summary(self) -> str:
        """Return the last line."""
        return (f'{self.count(Verdict.PASS)} passed, {self.count(Verdict.FAIL)} failed, '
                f'{self.count(Verdict.SKIPPED)} skipped in {self.seconds:.0f} s; '
                f'{self.restored}')


def line(result: Result) -> str:
    """Return a result in one line."""
    one = result.requirement
    detail = f' ({result.detail})' if result.detail and result.verdict is Verdict.PASS else ''
    return f'{result.verdict.value:8}{one.name:23}{one.title}{detail}'


def lines(result: Result, *, verbose: bool = False) -> list[str]:
    """Return a result for a table: more than a line where there is something to say."""
    one = result.requirement
    text = [line(result)]
    if result.verdict is not Verdict.PASS:
        text.append(f'{"":8}{result.detail}')
    if result.verdict is Verdict.FAIL or verbose:
        text.append(f'{"":8}see {section(one)}')
        said = [said for said in result.exchange
                if one.specification is HEARTBEAT or ' HEARTBEAT ' not in said]
        text += [f'{"":8}  {exchanged}' for exchanged in said[:SHOWN_LINES]]
        if len(said) > SHOWN_LINES:
            text.append(f'{"":8}  ... {len(said) - SHOWN_LINES} lines more, in --json')
    return text


class Table:
    """
    Turns results into lines for people: one line for all in a row that were not come to.

    :param verbose: as in :func:`lines`.
    """

    def __init__(self, *, verbose: bool = False) -> None:
        self._verbose = verbose
        self._unreached: list[Result] = []

    def add(self, result: Result) -> list[str]:
        """Take a result, and return the lines that can be shown now."""
        if not result.reached:
            ended = []
            if self._unreached and self._unreached[0].detail != result.detail:
                ended = self.end()
            self._unreached.append(result)
            return ended
        return [*self.end(), *lines(result, verbose=self._verbose)]

    def end(self) -> list[str]:
        """Return what has been held back."""
        held, self._unreached = self._unreached, []
        if len(held) < 2:
            return [text for one in held for text in lines(one, verbose=self._verbose)]
        return [f'{Verdict.SKIPPED.value:8}{len(held)} requirements: {held[0].detail}']


def section(one: Requirement) -> str:
    """Return which part of the specification a requirement follows."""
    return f'{one.specification.title}, "{one.section}": {one.specification.url}'


def catalogue(requirements: Iterable[Requirement] = REQUIREMENTS) -> list[str]:
    """Return all requirements, a line each."""
    notes = {(False, False): '', (True, False): ', changes the light',
             (True, True): ', needs your consent'}
    return [f'{one.name:23}{one.title} [{one.specification.title}, "{one.section}"'
            f'{notes[one.changes, one.dazzles]}]' for one in requirements]


def as_json(report: Report) -> str:
    """Return the report as JSON."""
    return json.dumps({
        'tool': f'illuminator_ros conformance {__version__}',
        'url': report.url,
        'light': report.light,
        'passed': report.passed,
        'seconds': round(report.seconds, 3),
        'restored': report.restored,
        'counts': {one.value: report.count(one) for one in Verdict},
        'results': [_result(one) for one in report.results],
    }, indent=2) + '\n'


def _result(result: Result) -> dict[str, Any]:
    one = result.requirement
    return {
        'name': one.name,
        'title': one.title,
        'verdict': result.verdict.value,
        'detail': result.detail,
        'specification': one.specification.title,
        'section': one.section,
        'specification_url': one.specification.url,
        'seconds': round(result.seconds, 3),
        'exchange': result.exchange,
    }


def as_junit(report: Report) -> str:
    """Return the report as JUnit XML, as CI servers read it."""
    suite = ElementTree.Element(
        'testsuite', name='illuminator conformance', tests=str(len(report.results)),
        failures=str(report.count(Verdict.FAIL)), errors='0',
        skipped=str(report.count(Verdict.SKIPPED)), time=f'{report.seconds:.3f}')
    properties = ElementTree.SubElement(suite, 'properties')
    for name, value in (('url', report.url), ('light', report.light),
                        ('restored', report.restored)):
        ElementTree.SubElement(properties, 'property', name=name, value=_clean(value))
    for result in report.results:
        one = result.requirement
        case = ElementTree.SubElement(
            suite, 'testcase', name=f'{one.name}: {one.title}',
            classname=one.specification.title, time=f'{result.seconds:.3f}')
        if result.verdict is Verdict.FAIL:
            failure = ElementTree.SubElement(case, 'failure', message=_clean(result.detail))
            failure.text = f'see {section(one)}'
        elif result.verdict is Verdict.SKIPPED:
            ElementTree.SubElement(case, 'skipped', message=_clean(result.detail))
        ElementTree.SubElement(case, 'system-out').text = _clean('\n'.join(result.exchange))
    ElementTree.indent(suite)
    return ElementTree.tostring(suite, encoding='unicode', xml_declaration=True) + '\n'


def _clean(text: str) -> str:
    return text.translate(_NOT_XML)
