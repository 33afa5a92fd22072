# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""A session with a light: it switches and configures the light, and compares the status."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from ..messages import IlluminatorStatus
from ..model import (
    Configuration,
    DIMMING_FLAGS,
    Mode,
    NOTHING,
    shortest,
    Status,
    unexpected_differences,
)
from ...checks.component_requirements import restore_interval
from ...checks.outcomes import Failed, Skipped
from ...checks.requirements import NOT_AGREED
from ...checks.session import Conditions, Session, Transaction
from ...mavlink.dialect import mavlink
from ...mavlink.messages import ComponentInformationBasic, Message

# %; the brightness of checks without consent, and the most at which the light may then be on.
LOW = 10.0
DIM = 20.0
# %; a light may round the brightness that it reports.
ROUNDING = 1.0
ON_OFF, CONFIGURE = mavlink.MAV_CMD_ILLUMINATOR_ON_OFF, mavlink.MAV_CMD_DO_ILLUMINATOR_CONFIGURE
# s to wait for a status of the stream if the light sends none on request.
STREAM_TIMEOUT = 2.5
# s from an acknowledgement to the status that shows the change: a light may fade.
CHANGE_TIMEOUT = 3.0
# %; the protocol does not limit the steps in which a light is dimmed.
BRIGHTNESS_STEP = 5.0


def status_text(status: Status) -> str:
    """Return the switch and the configuration that a status shows; 0 replaces invalid values."""
    on = {True: 'on', False: 'off', None: 'enable invalid'}[status.enabled]
    return f'{on}, {status.configuration(NOTHING).describe()}'


def differences(asked: Configuration, status: Status) -> list[str]:
    """Return the fields in which a status does not show a configuration."""
    if not status.complete:
        return [text.split()[0] for text in status.invalid]
    shown = status.configuration(NOTHING)
    names = unexpected_differences(asked, shown, status.error_flags, step=True)
    if abs(shown.brightness - asked.brightness) <= BRIGHTNESS_STEP:
        names = [name for name in names if name != 'brightness']
    # A period of 0, and a duty cycle of 0 or 100 %, mean the same: no strobe.
    return names if _strobes(asked) or _strobes(shown) else [
        name for name in names if not name.startswith('strobe_')]


def _strobes(one: Configuration) -> bool:
    return one.strobe_period > 0 and 0 < one.strobe_duty_cycle < 100


def same(one: Status, other: Status) -> bool:
    """Return whether two statuses show the same switch and configuration."""
    if one.enabled != other.enabled or not (one.complete and other.complete):
        return (one.enabled, one.invalid) == (other.enabled, other.invalid)
    return not (differences(one.configuration(NOTHING), other)
                and differences(other.configuration(NOTHING), one))


@dataclass(frozen=True)
class CheckedChange:
    """
    A command that changes the light, and its effect on the status.

    :param not_shown: the fields in which the status does not show the accepted change.
    :param contradiction: the failure because of these fields.
    """

    transaction: Transaction
    not_shown: tuple[str, ...] = ()
    contradiction: Failed | None = None

    def unmet(self, *names: str) -> Failed | None:
        """Return why some fields were not changed; None if a status does not contradict."""
        if not self.transaction.accepted:
            return self.transaction.failure()
        return self.contradiction if set(names) & set(self.not_shown) else None


class LightSession(Session):
    """
    Operates one light; with consent, it may strobe and shine at 100 %.

    :ivar disagreements: accepted changes that the status did not show.
    :ivar rejected_but_applied: rejected changes after which the status was different.
    """

    messages = (*Session.messages, IlluminatorStatus, ComponentInformationBasic)
    mav_type = mavlink.MAV_TYPE_ILLUMINATOR

    def __init__(self, conditions: Conditions) -> None:
        super().__init__(conditions)
        self.disagreements: list[Failed] = []
        self.rejected_but_applied: list[Failed] = []
        self._before: Status | None = None
        # Whether it has been off or dim since its state was saved.
        self._is_safe = False

    def is_device(self, message: Message) -> bool:
        """See :class:`Session`."""
        return isinstance(message, IlluminatorStatus) or super().is_device(message)

    # Commands and statuses

    async def status(self) -> Status | None:
        """Return a new status, None if the light does not send one."""
        message = await self.request(IlluminatorStatus)
        if message is None:
            streamed = await self.receive_more(IlluminatorStatus, STREAM_TIMEOUT)
            message = streamed[-1][1] if streamed else None
        return None if message is None else Status.from_message(message)

    async def enabled(self) -> bool | None:
        """Return whether a new status shows the light on, None if none does show that."""
        status = await self.status()
        return None if status is None else status.enabled

    async def switch(self, on: bool, *, as_int: bool = False) -> CheckedChange:
        """Switch the light, and compare the status."""
        one = await self.command(ON_OFF, float(on), as_int=as_int)
        return await self._compared(one, lambda status: [] if status.enabled == on else ['enable'])

    async def configure(
        self, mode: int = Mode.INTERNAL_CONTROL, brightness: float = LOW, period: float = 0.0,
        duty: float = 0.0,
    ) -> CheckedChange:
        """Configure the light, and compare the status."""
        asked = Configuration(Mode(mode), brightness, period, duty)
        one = await self.command(CONFIGURE, mode, brightness, period, duty)
        return await self._compared(one, lambda status: differences(asked, status))

    async def _compared(
        self, one: Transaction, differ: Callable[[Status], list[str]],
    ) -> CheckedChange:
        if not one.accepted:
            return CheckedChange(one)
        mark = self.record.log.total
        status = await self.after_change(differ)
        if status is None or not (not_shown := differ(status)):
            return CheckedChange(one)
        self.disagreements.append(Failed(
            f'{one.text}: {one.answer}, but then the status differs in '
            f'{" and ".join(not_shown)}: {status_text(status)}',
            one.lines + self.record.log.since(mark)[-3:]))
        return CheckedChange(one, tuple(not_shown), self.disagreements[-1])

    async def after_change(self, differ: Callable[[Status], list[str]]) -> Status | None:
        """Return the first status that shows a change, or the last before CHANGE_TIMEOUT."""
        end = self.now + CHANGE_TIMEOUT
        while (status := await self.status()) and differ(status) and self.now < end:
            await self.sleep(0.1)
        return status

    async def rejected(self, command: int, *params: float) -> Failed | None:
        """Send a command that must be rejected; return a failure unless the result is DENIED."""
        before = await self.status()
        one = await self.command(command, *params)
        after = await self.status()
        restarted = before and after and after.uptime_ms < before.uptime_ms
        if before and after and not (one.accepted or restarted or same(before, after)):
            self.rejected_but_applied.append(
                one.failure(f'{one.answer}, and then {status_text(after)}'))
        if one.result == mavlink.MAV_RESULT_DENIED:
            return None
        if one.accepted:
            await self.baseline()
        return one.failure()

    # States that checks start from

    async def baseline(self) -> None:
        """Bring the light to the state that checks start from: off, dim, no strobe."""
        low = Configuration(Mode.INTERNAL_CONTROL, LOW, 0.0, 0.0)
        status = await self.status()
        if status is None or status.enabled is not False:
            await self.command(ON_OFF, 0.0)
            status = await self.status()
        if status is None or differences(low, status):
            one = await self.command(CONFIGURE, *low.params())
            status = await (self.after_change(lambda status: differences(low, status))
                            if one.accepted else self.status())
        if status is not None and status.enabled:
            # A brightness above 0 switches some lights on.
            await self.command(ON_OFF, 0.0)

    async def ensure_dim(self) -> None:
        """
        Bring the light to a state in which it may be switched on: off, dim, no strobe.

        :raises Skipped: if the light does not apply the configuration, may be too bright, and
            there is no consent.
        """
        await self.baseline()
        if self.consent:
            return
        change = await self.configure()
        status = await self.status()
        if status is not None and status.enabled:
            # A brightness above 0 switches some lights on.
            await self.command(ON_OFF, 0.0)
        if change.transaction.accepted and not change.contradiction:
            return
        if reason := _risk(status):
            raise Skipped(f'switched on, {reason}, and that cannot be changed: {NOT_AGREED}')

    async def _is_lit_by_configuration(self) -> bool:
        """Configure a low brightness while the light is off; return whether it may be on then."""
        await self.configure(brightness=LOW / 2)
        return await self.enabled() is not False

    async def ensure_unlit(self) -> None:
        """
        Bring the light to a state in which it stays off at a brightness that it must reject.

        :raises Skipped: if a brightness switches the light on, and there is no consent.
        """
        await self.baseline()
        if self.consent:
            return
        if await self._is_lit_by_configuration():
            raise Skipped('its brightness switches it on, so that an invalid brightness might '
                          'dazzle: ' + NOT_AGREED)

    # Restoring

    async def save(self) -> str | None:
        """See :class:`Session`."""
        self._before = await self.status()
        return None if self._before is None else status_text(self._before)

    async def restore(self) -> list[str]:
        """See :class:`Session`."""
        assert self._before is not None
        wanted, enabled = _saved(self._before), bool(self._before.enabled)
        on = enabled and not self.danger
        # Switch off first, so that the changes are not visible.
        await self.command(ON_OFF, 0.0)
        dazzles = (
            not (self.consent or on) and (wanted.brightness > DIM or _strobes(wanted))
            and await self._is_lit_by_configuration())
        if not dazzles:
            await self.command(CONFIGURE, *wanted.params())
        # Then restore the switch, because the brightness switches some lights on.
        await self.command(ON_OFF, float(on))
        await restore_interval(self, IlluminatorStatus)
        status = await self.status()
        if status is None:
            return ['unknown']
        return (['configuration, which would switch it on'] if dazzles
                else differences(wanted, status)) + (
                    ['enable'] if status.enabled != enabled else [])

    def danger_of(self, message: Message) -> str:
        """See :class:`Session`: without consent the light must not dazzle."""
        if not isinstance(message, IlluminatorStatus) or self._before is None or self.consent:
            return ''
        status, allowed = Status.from_message(message), NOTHING
        if self.runner.restoring and self._before.enabled:
            allowed = _saved(self._before)
        # The brightness as sent: one of more than 100 % is not valid, and dazzles.
        bright = message.brightness > max(allowed.brightness, DIM) + ROUNDING
        strobes = _strobes(status.configuration(NOTHING)) and not _strobes(allowed)
        if not (status.enabled and (bright or strobes)):
            self._is_safe = True
            return ''
        if not self._is_safe:
            return ''
        return (f'it is {status_text(status)}; without consent it must neither strobe nor be '
                f'brighter than {DIM:g} %')


def _saved(status: Status) -> Configuration:
    """Return the configuration to restore; harmless values replace invalid ones."""
    return Configuration(
        status.mode or Mode.INTERNAL_CONTROL,
        LOW if status.brightness is None else shortest(status.brightness),
        shortest(status.strobe_period or 0.0), shortest(status.strobe_duty_cycle or 0.0))


def _risk(status: Status | None) -> str:
    """Return how a light might dazzle when it is switched on, '' if it would not."""
    # A light that its brightness switches reports 0 while it is off, whatever it had before.
    if status is None or not status.brightness or status.error_flags & DIMMING_FLAGS:
        return 'it might have any brightness'
    if status.brightness > DIM:
        return f'it would shine at {status.brightness:g} %'
    if status.strobe_period != 0.0 and status.strobe_duty_cycle not in (0.0, 100.0):
        return 'it might strobe'
    if status.mode is Mode.EXTERNAL_SYNC:
        return 'it might strobe with another signal'
    return ''
