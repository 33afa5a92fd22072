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

"""A run: finds the light, checks each requirement, and leaves the light as it was. No I/O."""

from __future__ import annotations

from collections.abc import Callable, Sequence
import logging
import math

from .bench import Bench, LOW
from .comparison import differences
from .consent import NOT_AGREED
from .exchange import LightGone
from .requirement import Failed, Requirement, Result, Skipped, Verdict
from .requirements import REQUIREMENTS
from .script import Interrupted
from .timing import median, periods
from ..model import Configuration, Mode, shortest, Status
from ...mavlink.messages import MavCmd, STATUS_ID

# s
FIND_TIMEOUT = 10.0
REST = 4.5
RESTORE_TIMEOUT = 10.0

# Lines of the exchange that are kept for one check.
MAX_LINES = 60
# Others on the link that are named where the light is not heard.
MAX_NAMED = 8

NOT_FOUND = 'no light was heard'
NO_CONSENT = f'it would strobe or shine at 100 %: {NOT_AGREED}'
NO_STATUS = 'the light does not say how it is, so that could not be restored'

_log = logging.getLogger(__name__)


class _Unreached(Skipped):
    """There is no light to check."""


class Suite:
    """
    Checks the requirements one after another.

    :param only: the names of those that are checked, all if empty.
    :param find_timeout: s to wait for the light.
    :param on_result: called with each result when it is there.
    :ivar results: one for each requirement, in order, once the run has ended.
    :ivar restored: what became of the light, for people.
    :ivar left_changed: whether it is not known to be as it was.
    :ivar interrupted: whether the run was ended from outside.
    :ivar missing: why there is no light to check, for people; '' if there is one.
    """

    def __init__(
        self, bench: Bench, *, only: Sequence[str] = (), find_timeout: float = FIND_TIMEOUT,
        on_result: Callable[[Result], None] = lambda result: None,
    ) -> None:
        self.bench = bench
        self.results: list[Result] = []
        self.restored = 'nothing was changed'
        self.left_changed = False
        self.interrupted = False
        self.missing = ''
        self._only = only
        self._find_timeout = find_timeout
        self._on_result = on_result
        self._before: Status | None = None
        self._period: float | None = None
        self._gone = ''
        self._changed = False
        bench.run(self._run())

    @property
    def passed(self) -> bool:
        """Whether all that could be checked is as it should be, and some could."""
        return (not self.left_changed and not self.interrupted
                and not any(one.verdict is Verdict.FAIL for one in self.results)
                and any(one.verdict is Verdict.PASS for one in self.results))

    def count(self, verdict: Verdict) -> int:
        """Return how many requirements have a verdict."""
        return sum(one.verdict is verdict for one in self.results)

    async def _run(self) -> None:
        chosen = [one for one in REQUIREMENTS if not self._only or one.name in self._only]
        try:
            await self._find()
            for one in chosen:
                self._enter(await self._check(one))
        except Interrupted:
            self.interrupted = True
            for one in chosen[len(self.results):]:
                self._enter(Result(one, Verdict.SKIPPED, 'interrupted', reached=False))
        finally:
            self.bench.tidying = True
            if self._changed:
                await self._restore()

    def _enter(self, result: Result) -> None:
        self.results.append(result)
        self._on_result(result)

    async def _find(self) -> None:
        bench = self.bench
        if not await bench.until(lambda: bench.found, self._find_timeout):
            self._gone = f'{bench.target} was not heard' if bench.target else NOT_FOUND
            self.missing = self._what_was_heard()
            return
        await bench.sleep(REST)
        bench.rest = list(bench.statuses)
        if len(bench.rest) > 1:
            self._period = median(periods([at for at, _ in bench.rest]))

    def _what_was_heard(self) -> str:
        bench, text = self.bench, f'{self._gone} within {self._find_timeout:g} s'
        if fault := bench.link_fault():
            return f'link not open: {fault}'
        others = sorted(bench.heard)
        texts = [str(one) for one in others[:MAX_NAMED]]
        if len(others) > MAX_NAMED:
            texts.append(f'{len(others) - MAX_NAMED} more')
        *most, last = texts or ['nobody else']
        heard = f'{", ".join(most)} and {last} were' if most else f'{last} was'
        if bench.target is None:
            text += ': neither HEARTBEAT with MAV_TYPE_ILLUMINATOR nor ILLUMINATOR_STATUS'
        return f'{text}; {heard}'

    async def _check(self, one: Requirement) -> Result:
        bench = self.bench
        begun, line = bench.now, len(bench.log)
        verdict, detail, evidence, reached = Verdict.PASS, '', None, True
        try:
            self._must_be_reachable(one)
            await self._prepare(one)
            detail = await one.check(bench) or ''
        except Failed as error:
            verdict, detail, evidence = Verdict.FAIL, str(error), error.evidence
        except _Unreached as error:
            verdict, detail, reached = Verdict.SKIPPED, str(error), False
        except Skipped as error:
            verdict, detail = Verdict.SKIPPED, str(error)
        except LightGone:
            verdict, detail = Verdict.FAIL, 'the light has fallen silent'
            self._gone = detail
        except Exception as error:
            _log.exception('internal error in the check %s', one.name)
            verdict, detail = Verdict.FAIL, f'internal error in this check: {error!r}'
        lines = bench.log[line:][-MAX_LINES:] if evidence is None else evidence[:MAX_LINES]
        return Result(one, verdict, detail, lines, bench.now - begun, reached)

    def _must_be_reachable(self, one: Requirement) -> None:
        # What shows over the whole of a run shows for a light that is gone, too.
        over_all = one.check.__module__.endswith('.totals')
        if self.missing:
            if one.name != 'heartbeat':
                raise _Unreached(self._gone)
            raise Failed(self.missing)
        if self._gone and not over_all:
            raise _Unreached(self._gone)

    async def _prepare(self, one: Requirement) -> None:
        """See that a check may be made, and that the light can be brought back from it."""
        bench = self.bench
        if one.dazzles and not bench.consent:
            raise Skipped(NO_CONSENT)
        if one.changes:
            self._before = self._before or await bench.status()
            if self._before is None:
                raise Skipped(NO_STATUS)
            self._changed = True

    async def _restore(self) -> None:
        """Bring back what was, for a while even if the light does not answer just now."""
        bench, before = self.bench, self._before
        assert before is not None
        until = bench.now + RESTORE_TIMEOUT
        wanted = _configuration(before)
        while True:
            try:
                status = await self._restore_once(before, wanted)
            except LightGone:
                status = None
            wrong = ['unknown'] if status is None else _wrong(before, wanted, status)
            if not wrong or bench.now >= until:
                break
            await bench.sleep(0.5)
        if not wrong:
            self.restored = 'the light is as it was'
        else:
            self.left_changed = True
            self.restored = (f'THE LIGHT IS NOT AS IT WAS ({", ".join(wrong)}): it was '
                             f'{"on" if before.enabled else "off"}, {wanted.describe()}')

    async def _restore_once(self, before: Status, wanted: Configuration) -> Status | None:
        bench = self.bench
        # Off first: so nobody sees the way back.
        await bench.command(MavCmd.ILLUMINATOR_ON_OFF, 0.0)
        await bench.command(MavCmd.DO_ILLUMINATOR_CONFIGURE, *wanted.params())
        # In a light where brightness is the switch, that has switched it on.
        await bench.command(MavCmd.ILLUMINATOR_ON_OFF, float(bool(before.enabled)))
        await self._restore_stream()
        return await bench.status()

    async def _restore_stream(self) -> None:
        bench = self.bench
        if self._period is None:
            await bench.command(MavCmd.SET_MESSAGE_INTERVAL, STATUS_ID, -1)
            return
        await bench.command(MavCmd.SET_MESSAGE_INTERVAL, STATUS_ID, 0)
        seen = len(bench.statuses)
        await bench.until(lambda: len(bench.statuses) >= seen + 3, 3.5 * self._period + 0.5)
        times = periods([at for at, _ in bench.statuses[seen:]])
        if not times or not math.isclose(median(times), self._period, rel_tol=0.25, abs_tol=0.02):
            await bench.command(
                MavCmd.SET_MESSAGE_INTERVAL, STATUS_ID, round(self._period, 3) * 1e6)


def _configuration(status: Status) -> Configuration:
    """Return what to bring back; what the light itself reported to be nonsense is harmless."""
    return Configuration(
        status.mode or Mode.INTERNAL_CONTROL,
        LOW if status.brightness is None else shortest(status.brightness),
        shortest(status.strobe_period or 0.0), shortest(status.strobe_duty_cycle or 0.0))


def _wrong(before: Status, wanted: Configuration, status: Status) -> list[str]:
    names = differences(wanted, status)
    return names + (['enable'] if bool(before.enabled) != status.enabled else [])
