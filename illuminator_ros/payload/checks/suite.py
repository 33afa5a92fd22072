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

"""A run: checks each requirement, and restores the state of the device. No I/O."""

from __future__ import annotations

from collections.abc import Callable, Sequence
import logging
from typing import Generic

from .coroutine import Interrupted
from .requirement import Failed, Requirement, Result, Skipped, T, Verdict
from .session import DeviceLost, Session
from ...mavlink.messages import Address

# s
RESTORE_TIMEOUT = 10.0
RESTORE_PAUSE = 0.5
# Lines of the log that are kept of one check.
MAX_LINES = 60
# Addresses that are named in one text.
MAX_NAMED = 8

_log = logging.getLogger(__name__)


class _Unreached(Skipped):
    """There is no device to check."""


def names(addresses: Sequence[Address]) -> str:
    """Return a list of addresses as text, the first few by name."""
    texts = [str(one) for one in addresses[:MAX_NAMED]]
    if len(addresses) > MAX_NAMED:
        texts.append(f'{len(addresses) - MAX_NAMED} more')
    *most, last = texts
    return f'{", ".join(most)} and {last}' if most else last


def absence(session: Session, device: str, evidence: str, timeout: float) -> str:
    """
    Return why there is no device to check.

    :param device: the kind of device.
    :param evidence: the messages that identify one.
    :param timeout: s for which it was awaited.
    """
    heard = sorted(session.heard)
    others = (f'heard instead: {names(heard)}' if heard else 'nothing else was heard')
    if session.target is not None:
        return f'{session.target} was not heard within {timeout:g} s; {others}'
    return f'no {device} was heard within {timeout:g} s, that is, no {evidence}; {others}'


class Suite(Generic[T]):
    """
    Checks requirements one after another; :meth:`run` does it.

    :param tester: operates the device.
    :param device: the kind of device, for texts.
    :param missing: why there is no device to check, '' if there is one.
    :param no_consent: why a check that needs consent is skipped.
    :param on_result: called with each result.
    :ivar results: one for each requirement, in order, after the run.
    :ivar restored: the state in which the device was left, as text.
    :ivar changed: whether the state of the device may have been changed.
    :ivar left_changed: whether restoring it has failed.
    """

    def __init__(
        self, tester: T, requirements: Sequence[Requirement[T]], *, device: str,
        missing: str = '', no_consent: str = '',
        on_result: Callable[[Result], None] = lambda result: None,
    ) -> None:
        self.results: list[Result] = []
        self.restored = 'nothing was changed'
        self.changed = False
        self.left_changed = False
        self._tester = tester
        self._session = tester.session
        self._requirements = requirements
        self._device = device
        self._missing = missing
        self._no_consent = no_consent
        self._on_result = on_result
        self._lost = ''

    @property
    def passed(self) -> bool:
        """Whether at least one requirement is met, none is missed, and the run was complete."""
        verdicts = [one.verdict for one in self.results]
        return (not self.left_changed and not self._session.runner.interrupted
                and Verdict.FAIL not in verdicts and Verdict.PASS in verdicts)

    async def run(self) -> None:
        """Check all requirements; to be run once by the session's runner."""
        try:
            for one in self._requirements:
                # Raises Interrupted, before the first check too.
                await self._session.runner.sleep(0.0)
                self._enter(await self._check(one))
        except Interrupted:
            for one in self._requirements[len(self.results):]:
                self._enter(Result(one, Verdict.SKIPPED, 'interrupted', reached=False))
        finally:
            self._session.runner.restoring = True
            if self.changed:
                await self._restore()

    def _enter(self, result: Result) -> None:
        self.results.append(result)
        self._on_result(result)

    async def _check(self, one: Requirement[T]) -> Result:
        session = self._session
        begun, mark = session.now, session.log.count
        verdict, detail, lines, reached = Verdict.PASS, '', None, True
        try:
            await self._prepare(one)
            detail = await one.check(self._tester) or ''
        except Failed as error:
            verdict, detail, lines = Verdict.FAIL, str(error), error.lines
        except Skipped as error:
            verdict, detail = Verdict.SKIPPED, str(error)
            reached = not isinstance(error, _Unreached)
        except DeviceLost:
            verdict, detail = Verdict.FAIL, f'the {self._device} has stopped sending'
            self._lost = detail
        except Exception as error:
            _log.exception('internal error in the check %s', one.name)
            verdict, detail = Verdict.FAIL, f'internal error in this check: {error!r}'
        exchange = session.log.since(mark)[-MAX_LINES:] if lines is None else lines[:MAX_LINES]
        return Result(one, verdict, detail, exchange, session.now - begun, reached)

    async def _prepare(self, one: Requirement[T]) -> None:
        """Raise where the check cannot be made, or the device could not be restored after it."""
        if self._missing:
            raise Failed(self._missing) if one.presence else _Unreached(
                self._missing.partition(';')[0])
        if self._lost and not one.whole_run:
            raise _Unreached(self._lost)
        if one.needs_consent and not self._tester.conditions.consent:
            raise Skipped(self._no_consent)
        if one.changes:
            if not await self._tester.save():
                raise Skipped(f'the {self._device} does not report its state, so it could not be '
                              'restored')
            self.changed = True

    async def _restore(self) -> None:
        """Restore the device; repeat it for some time if the device does not answer."""
        until = self._session.now + RESTORE_TIMEOUT
        while True:
            try:
                differing = await self._tester.restore()
            except DeviceLost:
                differing = ['unknown']
            if not differing or self._session.now >= until:
                break
            await self._session.runner.sleep(RESTORE_PAUSE)
        self.left_changed = bool(differing)
        self.restored = f'the {self._device} is as it was' if not differing else (
            f'THE {self._device.upper()} IS NOT AS IT WAS ({", ".join(differing)}): it was '
            + self._tester.saved)
