# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""A run: checks each requirement, and restores the state of the device. No I/O."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
import logging
from typing import Generic

from .components import names
from .coroutines import Interrupted
from .outcomes import DeviceLost, Failed, Skipped
from .requirements import CheckResult, CheckVerdict, NOT_AGREED, PayloadChecks, Requirement, T
from .session import Session

# s
RESTORE_TIMEOUT = 10.0
RESTORE_PAUSE = 0.5
# The most lines of the log that are kept of one check.
MAX_LINES = 60

_log = logging.getLogger(__name__)


class _Unreached(Skipped):
    """There is no device to check."""


def absence(session: Session, checks: PayloadChecks[T], timeout: float) -> str:
    """
    Return why there is no device to check.

    :param timeout: s for which the device was awaited.
    """
    target, heard = session.components.target, session.components.heard
    awaited = f'no {checks.device} was' if target is None else f'{target} was not'
    evidence = '' if target else f', that is, no {checks.evidence}'
    others = f'heard instead: {names(heard)}' if heard else 'nothing else was heard'
    return f'{awaited} heard within {timeout:g} s{evidence}; {others}'


class CheckRunner(Generic[T]):
    """
    Checks requirements one after another in :meth:`run`.

    :param checks: the checks of the payload.
    :param requirements: the requirements to check.
    :param on_result: called with each result.
    :param left_out: the reasons for requirements that are not checked, by name.
    :ivar results: one for each requirement, in order, after the run.
    :ivar restored: the state in which the device was left, as text.
    :ivar changed: whether the state of the device may have been changed.
    :ivar left_changed: whether restoring it has failed.
    """

    def __init__(
        self, checks: PayloadChecks[T], session: T, requirements: Sequence[Requirement[T]],
        on_result: Callable[[CheckResult], None] = lambda result: None,
        left_out: Mapping[str, str] = {},
    ) -> None:
        self.results: list[CheckResult] = []
        self.restored = 'nothing was changed'
        self.changed = False
        self.left_changed = False
        self._checks = checks
        self._session = session
        self._requirements = requirements
        self._on_result = on_result
        self._left_out = left_out
        # Why there is no device to check any more.
        self._lost = ''
        # The state to be restored, as text.
        self._saved = ''

    @property
    def passed(self) -> bool:
        """Whether a requirement is met, no requirement has failed, and the run was complete."""
        verdicts = [one.verdict for one in self.results]
        return (not self.left_changed and not self._session.runner.interrupted
                and CheckVerdict.FAIL not in verdicts and CheckVerdict.PASS in verdicts)

    async def run(self, missing: str = '') -> None:
        """
        Check all requirements; the session's runner must run it once.

        :param missing: why there is no device to check, '' if there is one.
        """
        try:
            for one in self._requirements:
                # This raises Interrupted, also before the first check.
                await self._session.sleep(0.0)
                self._add(await self._check(one, missing))
        except Interrupted:
            reason = 'stopped' if self._session.danger else 'interrupted'
            for one in self._requirements[len(self.results):]:
                self._add(CheckResult(one, CheckVerdict.SKIPPED, reason, reached=False))
        finally:
            self._session.runner.restoring = True
            if self.changed:
                await self._restore()

    def _add(self, result: CheckResult) -> None:
        self.results.append(result)
        self._on_result(result)

    async def _check(self, one: Requirement[T], missing: str) -> CheckResult:
        log = self._session.record.log
        begun, mark = self._session.now, log.total
        verdict, lines, reached = CheckVerdict.FAIL, None, True
        try:
            await self._prepare(one, missing)
            verdict, detail = CheckVerdict.PASS, await one.check(self._session) or ''
        except Failed as error:
            detail, lines = str(error), error.lines
        except Skipped as error:
            verdict, detail = CheckVerdict.SKIPPED, str(error)
            reached = not isinstance(error, _Unreached)
        except Interrupted:
            if not self._session.danger:
                raise
            detail = f'stopped: {self._session.danger}'
        except DeviceLost:
            self._lost = detail = f'the {self._checks.device} has stopped sending'
        except Exception as error:
            _log.exception('internal error in the check %s', one.name)
            detail = f'internal error in this check: {error!r}'
        exchange = log.since(mark)[-MAX_LINES:] if lines is None else lines[:MAX_LINES]
        return CheckResult(one, verdict, detail, exchange, self._session.now - begun, reached)

    async def _prepare(self, one: Requirement[T], missing: str) -> None:
        """Raise if the check cannot be made, or if the device could not be restored after it."""
        device = self._checks.device
        if one.name in self._left_out:
            raise Skipped(f'left out: {self._left_out[one.name]}')
        if missing:
            raise Failed(missing) if one.presence else _Unreached(f'no {device} was found')
        if self._lost and not one.whole_run:
            raise _Unreached(self._lost)
        if one.needs_consent and not self._session.consent:
            raise Skipped(f'the {device} would {self._checks.risk}: {NOT_AGREED}')
        if one.changes and not self.changed:
            saved = await self._session.save()
            if saved is None:
                raise Skipped(
                    f'the {device} does not report its state, so it could not be restored')
            self._saved, self.changed = saved, True

    async def _restore(self) -> None:
        """Restore the device; repeat this for :data:`RESTORE_TIMEOUT` while its state differs."""
        device, until = self._checks.device, self._session.now + RESTORE_TIMEOUT
        while True:
            try:
                differing = await self._session.restore()
            except DeviceLost:
                differing = ['unknown']
            except Interrupted:
                # Restoring was dangerous. The session now restores only what is safe.
                self._session.runner.restoring = True
                continue
            if not differing or self._session.now >= until:
                break
            await self._session.sleep(RESTORE_PAUSE)
        self.left_changed = bool(differing)
        self.restored = f'the {device} is as it was{self._checks.traces}' if not differing else (
            f'THE {device.upper()} IS NOT AS IT WAS ({", ".join(differing)}): it was '
            + self._saved)
        if self._session.danger:
            self.restored = f'stopped: {self._session.danger}; {self.restored}'
