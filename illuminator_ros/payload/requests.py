# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The standing requests to one device, and the claims of their sources."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import dataclass, replace
from enum import IntEnum
import math
from typing import Any, NamedTuple

from .arbitration import Arbiter, Cause, HolderChanged, Policy
from .command_sources import DEFAULT, SourceSettings
from ..mavlink.schedule import call_each

# By field; whether a light is on is a field like the others.
Values = Mapping[str, Any]
# s in which an equal message of a topic that no status shows, or an equal OFF, counts once.
REPEAT_TIME = 1.0
# Calls that may wait for one field.
MAX_CALLS = 32


class Result(NamedTuple):
    """
    The result of a request.

    :param success: whether the device accepted it and, if it sends a status, shows it.
    :param message: the result for people.
    :param refused: whether the device answered with another result than ACCEPTED.
    :param permanent: whether the same request will fail again.
    :param contradicted: whether the device accepted it and then showed something else.
    :param superseded: whether a newer request replaced it.
    :param note: a change that was not asked for but came with it, for people, '' if none.
    """

    success: bool
    message: str
    refused: bool = False
    permanent: bool = False
    contradicted: bool = False
    superseded: bool = False
    note: str = ''


Done = Callable[[Result, float], None]


class Why(IntEnum):
    """The reasons why values are wanted; the smallest has the highest rank."""

    END = 0
    SILENCE = 1
    REQUEST = 2
    RELEASE = 3
    OVERRIDE = 4
    RESTORED = 5
    LIMIT = 6


# The requests that a new one ends if they want another value of one of its fields. A release ends
# only messages of topics.
ENDS: Mapping[Why, Collection[Why]] = {
    Why.END: {*Why}, Why.SILENCE: {Why.REQUEST, Why.RELEASE},
    Why.REQUEST: {Why.SILENCE, Why.REQUEST, Why.RELEASE}, Why.RELEASE: {Why.REQUEST}}
# Sent until a status shows them, whatever the device answers.
INSISTENT = frozenset((Why.END, Why.SILENCE, Why.RELEASE))
# Values that were given or agreed before do not undo a value that a user has set.
WEAK = frozenset((Why.OVERRIDE, Why.RESTORED, Why.LIMIT))


def no_reply(result: Result, now: float) -> None:
    """Take the result of a request that has no receiver."""


@dataclass(eq=False)
class Request:
    """
    Values that are wanted until a status shows them, or until they are refused or superseded.

    :param since: when it was made, s; a command that began before confirms nothing of it.
    :param done: takes the result, once.
    :param is_call: whether a caller waits for the result. What a topic asks for stays as the
        wish of its source, for a hand-over.
    :param detail: how it was requested, or the reason of a rule, for people.
    :param deadline: s; it fails at that time.
    :param not_before: s; it is not sent before.
    :ivar is_open: whether it is still to be reached. What a status has shown is not sent again if
        another sender changes it; a hand-over opens it again.
    :ivar is_served: whether an attempt serves it, which ends it.
    :ivar may_be_repeated: whether an equal message of its source is a repetition.
    :ivar tried: how often a rule has failed, and ``failure`` why it failed last.
    """

    values: dict[str, Any]
    why: Why
    since: float
    source: str = DEFAULT
    done: Done = no_reply
    is_call: bool = False
    detail: str = ''
    deadline: float = math.inf
    not_before: float = -math.inf
    is_open: bool = True
    is_served: bool = False
    may_be_repeated: bool = True
    tried: int = 0
    failure: str = ''

    @property
    def is_wish(self) -> bool:
        """Whether it is kept as the wish of its source."""
        return self.why is Why.REQUEST and not self.is_call

    def contradicts(self, old: Request) -> bool:
        """Return whether both want other values of one field; a setpoint waits for a call."""
        if self.is_wish and old.is_call and 'enabled' not in self.values:
            return False
        return any(old.values.get(name, value) != value for name, value in self.values.items())

    def ends(self, old: Request) -> bool:
        """Return whether making it ends an older request; a newer wish replaces the older one."""
        if not old.is_open or old.why not in ENDS.get(self.why, ()) or not self.contradicts(old):
            return False
        # A call that fails leaves nothing behind, so the OFF of a release stays until it succeeds.
        is_call_and_release = (old.is_call and self.why is Why.RELEASE
                               or self.is_call and old.why is Why.RELEASE)
        return not is_call_and_release and not (old.is_wish and self.is_wish)


class Goal(NamedTuple):
    """
    The values of one command, and the requests that it serves.

    :param deadline: s; the command ends then, unless it insists.
    :param note: a change that comes with it and that no request asks for, for people.
    :param gives_way: whether it leaves another command that is under way alone.
    :param is_awaited: whether a caller waits for it.
    :param insists: whether it is sent until a status shows it.
    :param is_final: whether the process ends.
    """

    values: Any
    serves: tuple[Request, ...]
    deadline: float = math.inf
    note: str = ''
    gives_way: bool = False
    is_awaited: bool = False
    insists: bool = False
    is_final: bool = False

    @classmethod
    def strongest(cls, some: Iterable[Request], field: str, now: float) -> Goal | None:
        """
        Return the goal of the strongest of some requests for a field, None if none is due.

        The newest is the strongest of those with one reason.
        """
        due = [one for one in some if field in one.values and now >= one.not_before]
        if not due:
            return None
        value = min(reversed(due), key=lambda one: (one.why, -one.since)).values[field]
        serves = tuple(one for one in due if one.values[field] == value)
        return cls.of(value, serves, deadline=max(one.deadline for one in serves))

    @classmethod
    def of(cls, values: Any, serves: tuple[Request, ...], **how: Any) -> Goal:
        """Return the goal that serves some requests; ``how``: deadline, note, gives_way."""
        reasons = {one.why for one in serves}
        return cls(values, serves, **how, is_awaited=any(one.is_call for one in serves),
                   insists=not reasons.isdisjoint(INSISTENT), is_final=Why.END in reasons)


class Requests:
    """
    The standing requests to one device, and the claims of their sources. No I/O; times are s.

    A message of a topic claims the device at once, a call when it has succeeded. The highest
    source that has claimed the device holds it. While a call is under way, lower sources are
    refused as if its source held the device.

    :param device: its name, for people.
    :param settings: of the sources, None if commands have no sources.
    :param describe: describes values, for people.
    :param report: takes each change of the holder.
    :ivar standing: the requests, in the order in which they were made.
    :ivar claims: the claims of the sources.
    """

    def __init__(
        self, device: str, settings: SourceSettings | None = None,
        describe: Callable[[Values], str] = str,
        report: Callable[[HolderChanged[str], float], None] = lambda change, now: None,
    ) -> None:
        ranked = settings or SourceSettings((DEFAULT,))
        self.are_ranked = settings is not None
        self.standing: list[Request] = []
        self.claims: Arbiter[str] = Arbiter(
            Policy.PRIORITY, ranked.names.index, lease=ranked.timeout, remembers=True)
        self._rank = ranked.names.index
        self._device = device
        self._describe = describe
        self._report = report
        self._replies: deque[tuple[Done, Result]] = deque()

    # Sources

    @property
    def commander(self) -> str | None:
        """Return the highest source that holds the device or has a call under way."""
        sources = [one.source for one in self.standing if one.is_call]
        if self.claims.holder is not None:
            sources.append(self.claims.holder)
        return min(sources, key=self._rank, default=None)

    @property
    def shown_holder(self) -> str | None:
        """Return the holder for snapshots: '' for none, None if commands have no sources."""
        return self.claims.holder or '' if self.are_ranked else None

    @property
    def are_calling(self) -> bool:
        """Whether a caller waits for a result."""
        return any(one.is_call for one in self.standing)

    def refusal(self, source: str) -> str:
        """Return why a source may not command the device, '' if it may."""
        if not self.are_ranked:
            return ''
        commander = self.commander
        is_lower = commander is not None and self._rank(commander) < self._rank(source)
        return f'held by {commander}' if is_lower else ''

    def live(self) -> list[Request]:
        """Return the open requests of rules, and of the source that commands the device."""
        return self.of_commander([one for one in self.standing if one.is_open])

    def of_commander(self, some: list[Request]) -> list[Request]:
        """Return those of some requests that may be sent."""
        # The requests of the last holder are still sent after its release.
        if not (some and self.are_ranked) or (commander := self.commander) is None:
            return some
        return [one for one in some
                if one.why is not Why.REQUEST or one.source == commander]

    # Requests come

    def put(self, new: Request, now: float) -> None:
        """Make a request. It ends those that it contradicts, and those of lower sources."""
        if not self.are_ranked:
            new.source = DEFAULT
        held = self.refusal(new.source) if new.why is Why.REQUEST else ''
        if held:
            self.reply(new, Result(False, held))
            if new.is_call:
                return
        elif new.is_call and self._are_too_many(new):
            self.reply(new, Result(
                False, f'{MAX_CALLS} requests are waiting for {self._device} already'))
            return
        else:
            self._supersede(new, now)
        if new.is_wish:
            self._remember(new, now)
        else:
            self.standing.append(new)

    def _are_too_many(self, new: Request) -> bool:
        return sum(one.is_call and not one.values.keys().isdisjoint(new.values)
                   for one in self.standing) >= MAX_CALLS

    def _supersede(self, new: Request, now: float) -> None:
        is_request = new.why is Why.REQUEST
        text = new.detail if not is_request else f'superseded by {self._describe(new.values)}'
        for old in [*self.standing]:
            if is_request and old.why is Why.REQUEST and old.source != new.source:
                self._displace(old, f'held by {new.source}', now)
            elif new.ends(old):
                self.end(old, Result(False, text, superseded=True), now)
        if new.values.get('enabled') is False:
            # An OFF ends an ON that is remembered, though it may fail.
            self.forget({'enabled': True}, new.source if is_request else None, text)

    def _displace(self, old: Request, text: str, now: float) -> None:
        """End a request of a source that another one replaces; a claimed wish is kept."""
        result = Result(False, text, superseded=True)
        if old.is_call or not self.claims.is_claimed_by(old.source):
            self.end(old, result, now)
        elif old.is_open:
            self.reply(old, result)

    def forget(self, values: Values, source: str | None = None, text: str = '') -> None:
        """
        Forget the wishes for some values, of one source or of all.

        :param values: None for any value of a field.
        :param text: the answer to open wishes.
        """
        for old in [*self.standing]:
            if old.is_wish and source in (None, old.source):
                self.drop(old, [name for name, value in values.items()
                                if name in old.values and value in (None, old.values[name])], text)

    def drop(self, old: Request, names: Collection[str], text: str = '') -> None:
        """Remove some fields of a request, and the request if no field is left."""
        if not names:
            return
        old.values = {name: value for name, value in old.values.items() if name not in names}
        if not old.values:
            old.is_open = False
            self.standing.remove(old)
            self.reply(old, Result(False, text, superseded=True))

    def _remember(self, new: Request, now: float) -> None:
        """Keep the wish of a source in place of its older ones for the same fields."""
        self.claim(new.source, now)
        if not new.values:
            return
        text = f'superseded by {self._describe(new.values)}'
        for old in self.wishes(new.source):
            names = old.values.keys() & new.values.keys()
            if not names:
                continue
            if old.is_served:
                # Its attempt ends it. Other fields stay wanted.
                self.standing.remove(old)
                old = replace(old, done=no_reply, is_served=False)
                self.standing.append(old)
            self.drop(old, names, text)
        self.standing.append(new)

    def claim(self, source: str, now: float) -> None:
        """Note that a source asks for something; it then holds the device unless refused."""
        change = self.claims.claim(source if self.are_ranked else DEFAULT, now)
        if change is not None and self.are_ranked:
            self._report(change, now)

    def repeated(self, new: Request) -> Request | None:
        """Return the request of its source that a message of a topic repeats, None if none."""
        return next((old for old in self.standing if old.is_wish and old.may_be_repeated
                     and old.source == new.source and old.values == new.values), None)

    # Requests end

    def end(self, one: Request, result: Result, now: float) -> None:
        """End a request. A call that has succeeded claims the device."""
        is_known, one.is_open, one.is_served = one in self.standing, False, False
        # A message may have come in the turn of a call, after it.
        later = self.standing[self.standing.index(one):] if is_known and one.is_call else []
        if is_known and not (one.is_wish and self.claims.is_claimed_by(one.source)):
            self.standing.remove(one)
        if result.success and one.why is Why.REQUEST:
            for old in [*self.standing]:
                if old.why in WEAK:
                    self.drop(old, [*one.values.keys() & old.values.keys()])
                elif old.why is Why.RELEASE and one.contradicts(old):
                    self.end(old, Result(False, result.message, superseded=True), now)
            if one.is_call:
                newer = {name for old in later if old.is_wish and old.source == one.source
                         for name in old.values}
                values = {name: value for name, value in one.values.items() if name not in newer}
                self._remember(Request(values, one.why, one.since, one.source,
                                       is_open=False, may_be_repeated=False), now)
        self.reply(one, result)

    def end_all(self, result: Result, now: float) -> None:
        """End the requests of users: the device is lost. The wishes of sources are kept."""
        for one in [*self.standing]:
            one.may_be_repeated = False
            if one.why is Why.REQUEST and one.is_open:
                self.end(one, result, now)

    def close(self, result: Result, now: float) -> None:
        """End all requests and claims, and have no sources any more."""
        self.are_ranked = False
        self.claims = Arbiter(Policy.PRIORITY)
        for one in [*self.standing]:
            self.end(one, result, now)
        self.standing.clear()

    def wishes(self, source: str) -> list[Request]:
        """Return what a source has asked for last."""
        return [one for one in self.standing if one.is_wish and one.source == source]

    def reply(self, one: Request, result: Result) -> None:
        """Answer a request, once, after this step."""
        done, one.done = one.done, no_reply
        if done is not no_reply:
            self._replies.append((done, result))

    def send_replies(self, now: float) -> None:
        """Call the replies that have come due, in their order, even if one of them raises."""
        while self._replies:
            replies, self._replies = self._replies, deque()
            call_each([_call(*one) for one in replies], now)

    def release(self, source: str, now: float) -> HolderChanged[str] | None:
        """
        End the claim of a source, and its calls.

        :return: the change of the holder; a source that had only a call under way counts as one
            that held the device.
        """
        if not self.are_ranked:
            return None
        was_commander, before = source == self.commander, self._claimed()
        calls = [one for one in self.standing if one.is_call and one.source == source]
        for one in calls:
            self.end(one, Result(False, f'released by {source}', superseded=True), now)
        change = self.claims.release(source, now)
        if calls and was_commander and change is None:
            change = HolderChanged(source, self.claims.holder, Cause.RELEASE)
        return self._end_unclaimed(change, before, now)

    def expire(self, now: float) -> HolderChanged[str] | None:
        """End the claims of silent sources; return the change of the holder."""
        if not self.are_ranked or now < self.claims.due:
            return None
        before = self._claimed()
        return self._end_unclaimed(self.claims.poll(now), before, now)

    def _claimed(self) -> set[str]:
        """Return the sources with wishes that have claimed the device."""
        return {one.source for one in self.standing
                if one.is_wish and self.claims.is_claimed_by(one.source)}

    def _end_unclaimed(
        self, change: HolderChanged[str] | None, before: set[str], now: float,
    ) -> HolderChanged[str] | None:
        """
        End the wishes of sources whose claim has ended.

        An open wish of the last holder is still sent if no source follows.

        :param before: the sources that had claimed the device before.
        """
        for one in [*self.standing]:
            if not one.is_wish or self.claims.is_claimed_by(one.source):
                continue
            was_holder = change is not None and change.before == one.source
            if change is not None and change.after is not None:
                self.end(one, Result(False, f'held by {change.after}', superseded=True), now)
            elif not one.is_open or one.source in before and not was_holder:
                self.end(one, Result(False, f'released by {one.source}', superseded=True), now)
        if change is not None and self.are_ranked:
            self._report(change, now)
        return change

    def overdue(self, now: float) -> list[Request]:
        """Return the open requests whose time is over, and that no attempt will end."""
        return [one for one in self.standing
                if one.is_open and not one.is_served and now >= one.deadline]

    def next_due(self, now: float) -> float:
        """Return when a request becomes due or is late next, or when a claim ends, s."""
        due = self.claims.due if self.are_ranked else math.inf
        for one in self.standing:
            if one.is_open:
                due = min(due, one.deadline, one.not_before if one.not_before > now else math.inf)
        return due


def _call(done: Done, result: Result) -> Callable[[float], None]:
    return lambda now: done(result, now)
