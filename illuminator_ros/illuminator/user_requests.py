# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The requests of the users of a light: refused, remembered, or made."""

from __future__ import annotations

from collections.abc import Callable, Iterable

from . import events
from .commands import OFF
from .model import checked, FIELDS, Status
from .rules import Rules
from .twin import Twin
from ..mavlink.command_sender import Command
from ..mavlink.errors import InvalidValue
from ..payload.arbitration import Cause, HolderChanged
from ..payload.attempt import Target
from ..payload.device_property import Property
from ..payload.liveness import Liveness
from ..payload.requests import Done, REPEAT_TIME, Request, Requests, Result

# s from an OFF call to its failure, while an OFF that insists is under way.
INSISTENT_LIMIT = 4.0


class UserRequests:
    """
    Makes the requests of users to one light, for their sources. No I/O; times are s.

    :param emit: takes the events.
    :ivar were_made: whether a user has ever made one.
    """

    def __init__(
        self, target: Target, liveness: Liveness, requests: Requests, twin: Twin, rules: Rules,
        switch: Property[Status], emit: Callable[[events.LightEvent], None],
    ) -> None:
        self.were_made = False
        self._target = target
        self._liveness = liveness
        self._requests = requests
        self._twin = twin
        self._rules = rules
        self._switch = switch
        self._emit = emit

    def make(self, new: Request, now: float) -> None:
        """Make a request, or answer why it is refused."""
        requests = self._requests
        self.expire(now)
        self.were_made = True
        is_off, is_held = new.values.get('enabled') is False, bool(requests.refusal(new.source))
        if not is_off and (late := self._target.commands.lateness(now)):
            requests.reply(new, Result(False, late))
            return
        if new.is_wish:
            self._rules.note_request(now)
        if not self._liveness.connected:
            self._refuse_lost(new, now, is_off=is_off, is_held=is_held)
        elif not is_held and self._is_repetition(new, now):
            requests.claim(new.source, now)
            requests.reply(new, Result(False, 'repeated', superseded=True))
        elif is_held or self._is_right(new):
            if new.is_call and not is_held and not requests.are_calling:
                self._rules.note_call(now)
            attempt = self._switch.attempt
            if new.is_call and is_off and attempt is not None and attempt.goal.insists:
                # It may never end, and a later call waits for the next one.
                new.deadline = now + INSISTENT_LIMIT
            requests.put(new, now)

    def _refuse_lost(self, new: Request, now: float, *, is_off: bool, is_held: bool) -> None:
        """Refuse a request to a light that is lost: only an OFF has an effect later."""
        requests, liveness = self._requests, self._liveness
        # It may hear though it is not heard.
        is_sent = is_off and not is_held and self.send_unheard_off()
        if is_sent:
            self._switch.note_sent(OFF, now)
        refusal = requests.refusal(new.source) or liveness.loss(
            f'light {self._target.address}', now)
        if is_sent:
            refusal += '; an OFF was sent once, and the light may still be on'
        requests.reply(new, Result(False, refusal))
        if new.is_wish and is_off:
            new.is_open = new.may_be_repeated = False
            requests.put(new, now)
        elif is_off and not is_held:
            requests.forget({'enabled': None}, new.source)

    def send_unheard_off(self) -> bool:
        """Send an OFF once, without an attempt; return whether the link is open for it."""
        if self._liveness.link_failure:
            return False
        self._target.commands.send_once(Command(self._target.address, OFF.command, OFF.params))
        return True

    def _is_repetition(self, new: Request, now: float) -> bool:
        """
        Return whether a message of a topic repeats the one before, so that nothing must be sent.

        One that the light does not show, and an OFF, is sent again once in a while.
        """
        old = self._requests.repeated(new) if new.is_wish else None
        if old is None or old.is_open:
            return old is not None
        [(name, value)] = new.values.items()
        if any(one.values.get(name, value) != value for one in self._requests.live()):
            return False
        is_settled = self._twin.shows(name, value) and new.values != {'enabled': False}
        return is_settled or now < old.since + REPEAT_TIME

    def _is_right(self, new: Request) -> bool:
        """Check the values of a request, and answer one that the light must not get."""
        try:
            if 'enabled' not in new.values:
                self._check(new)
        except InvalidValue as error:
            self._requests.reply(new, Result(False, str(error), permanent=True))
            return False
        return True

    def _check(self, new: Request) -> None:
        twin = self._twin
        new.values = {name: checked(name, value, twin.strobe_range)
                      for name, value in new.values.items()}
        for one in new.values.items():
            self._rules.settings.limits.check(*one)
        if (self._switch.is_under_way(OFF) and new.is_call and twin.brightness_is_switch is None
                and 'brightness' not in new.values):
            raise InvalidValue('an OFF is under way, which the brightness in this command '
                               'may undo; repeat it')
        known = {name for one in (*self._rules.weak, new) for name in one.values}
        if twin.agreed is None and not known.issuperset(FIELDS):
            raise InvalidValue(not_reported(name for name in FIELDS if name not in known))

    # Sources

    def release(self, source: str, now: float) -> None:
        """Release the light."""
        self.expire(now)
        self._hand_over(self._requests.release(source, now), now)

    def expire(self, now: float) -> None:
        """End the claims of silent sources."""
        self._hand_over(self._requests.expire(now), now)

    def _hand_over(self, change: HolderChanged[str] | None, now: float) -> None:
        """Want what the next holder has asked for, or an OFF where there is none."""
        if change is None or change.cause is Cause.CLAIM:
            return
        after, is_heard = change.after, self._liveness.connected
        if after is None:
            if self._rules.settings.off_on_release:
                self._rules.put_release_off(f'on_release: {change.before} no longer holds it', now)
            return
        self._rules.forget_silenced(now)
        reason = f'{after}, which holds the light now'
        for one in self._requests.wishes(after):
            if is_heard:
                one.is_open, one.since, one.detail = True, now, reason
                one.done = self._failure_report(after)
            elif one.values.get('enabled') is False:
                # It is sent when the light is heard again.
                self._rules.put_release_off(reason, now)

    def _failure_report(self, source: str) -> Done:
        """Return a function that reports that the light does not have what a source wants."""
        def done(result: Result, now: float) -> None:
            if not (result.success or result.superseded):
                self._emit(events.DesiredStateFailed(
                    self._target.address, source, result.message))

        return done


def not_reported(missing: Iterable[str]) -> str:
    """Return why a configuration that is not complete cannot be sent."""
    return ('the light has not reported its configuration yet, so '
            f'{", ".join(missing)} must be set in the same call')
