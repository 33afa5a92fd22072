# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""A script of requests, and what a light should be then: one table of the rules."""

from __future__ import annotations

from collections.abc import Sequence
import math
from typing import Any, NamedTuple

from illuminator_ros.illuminator.decide import decide, describe, DUTY_CYCLE_NOTE, Goals, Shown
from illuminator_ros.illuminator.model import (
    Configuration,
    FIELDS,
    Mode,
    SafetyLimits,
    StrobeRange,
)
from illuminator_ros.payload.arbitration import Cause, HolderChanged
from illuminator_ros.payload.command_sources import SourceSettings
from illuminator_ros.payload.requests import MAX_CALLS, Request, Requests, Result, Why
import pytest

INTERNAL = Mode.INTERNAL_CONTROL
AGREED = Configuration(INTERNAL, 30.0, 0.0, 0.0)
LIMITS = SafetyLimits(max_brightness=40.0, min_strobe_period=0.5)
SOURCES = SourceSettings(('safety', 'operator', 'default'), 5.0)
LIGHT = Shown(AGREED, brightness_is_switch=False)
UNSEEN = Shown(AGREED)
DARK = Shown(Configuration(INTERNAL, 0.0, 0.0, 0.0), is_dark=True, brightness_is_switch=True)
LIT = Shown(AGREED, brightness_is_switch=True)
NEW = Shown()
ON, OFF = {'enabled': True}, {'enabled': False}
ALL: dict[str, Any] = {'mode': INTERNAL, 'brightness': 10.0, 'strobe_period': 0.0,
                       'strobe_duty_cycle': 0.0}


def b(value: float) -> dict[str, Any]:
    return {'brightness': value}


def s(value: float) -> dict[str, Any]:
    return {'strobe_period': value, 'strobe_duty_cycle': 50.0}


class Call(NamedTuple):
    """A call of a source."""

    values: dict[str, Any]
    source: str = 'default'


class Topic(NamedTuple):
    """A message of a topic of a source."""

    values: dict[str, Any]
    source: str = 'default'


class Rule(NamedTuple):
    """A rule, which is due then."""

    why: Why
    values: dict[str, Any]
    due: float = -math.inf


class End(NamedTuple):
    """The end of a request, by its number in the script."""

    number: int
    success: bool


class Release(NamedTuple):
    """A release by a source."""

    source: str


class Wait(NamedTuple):
    """Time that passes, s."""

    seconds: float


def shown(number: int) -> End:
    return End(number, success=True)


def failed(number: int) -> End:
    return End(number, success=False)


class Play:
    """Plays a script; ``answers`` has the answer to each call that was answered, by its number."""

    def __init__(self, script: Sequence[Any], sources: SourceSettings | None = SOURCES) -> None:
        self.now = 0.0
        self.answers: dict[int, str] = {}
        self.held: list[HolderChanged[str]] = []
        self.made: dict[int, Request] = {}
        self.requests = Requests('light 1/243', sources, describe,
                                 lambda change, now: self.held.append(change))
        for number, step in enumerate(script):
            self._play(number, step)
            self.requests.send_replies(self.now)
            self.now += 0.1

    def _play(self, number: int, step: Any) -> None:
        requests, now = self.requests, self.now

        def done(result: Result, now: float) -> None:
            self.answers[number] = result.message
            # A result that is shown is a success; one that another request replaces says so.
            assert (result.success, result.permanent) == (result.message == 'shown', False)
            assert result.superseded or not result.message.startswith('superseded by ')

        match step:
            case Call(values, source) | Topic(values, source):
                self.made[number] = Request(
                    dict(values), Why.REQUEST, now, source, done, is_call=isinstance(step, Call))
                requests.put(self.made[number], now)
            case Rule(why, values, not_before):
                self.made[number] = Request(
                    dict(values), why, now, detail=why.name, not_before=not_before)
                requests.put(self.made[number], now)
            case End(of, success):
                requests.end(self.made[of], Result(success, 'shown' if success else 'failed'), now)
            case Release(source):
                self._hand_over(requests.release(source, now))
            case Wait(seconds):
                self.now += seconds
                self._hand_over(requests.expire(self.now))

    def _hand_over(self, change: HolderChanged[str] | None) -> None:
        if change is not None and change.after and change.cause is not Cause.CLAIM:
            for wish in self.requests.wishes(change.after):
                wish.is_open, wish.since = True, self.now

    def decide(self, light: Shown) -> Goals:
        return decide(self.requests.live(), light, LIMITS, self.now)


# The script, the light -> ON or OFF (None for anything), the fields of the configuration that
# differ from the agreed ones (None for no configuration), the answers.
ROWS: dict[str, tuple[list[Any], Shown, bool | None, dict[str, Any] | None, dict[int, str]]] = {
    'nothing': ([], LIGHT, None, None, {}),
    # Requests of one source.
    'a call': ([Call(ON)], LIGHT, True, None, {}),
    'a newer call wins': ([Call(ON), Call(OFF)], LIGHT, False, None, {0: 'superseded by off'}),
    'an equal call joins': ([Call(ON), Call(ON)], LIGHT, True, None, {}),
    'the second of equal calls goes on': ([Call(ON), Call(ON), shown(0)], LIGHT, True, None,
                                          {0: 'shown'}),
    'a call that has failed leaves nothing': ([Call(ON), failed(0)], LIGHT, None, None,
                                              {0: 'failed'}),
    'what was shown is not sent again': ([Topic(ON), shown(0)], LIGHT, None, None, {0: 'shown'}),
    'a newer message wins': ([Topic(ON), Topic(OFF)], LIGHT, False, None,
                             {0: 'superseded by off'}),
    'an OFF that fails ends the ON before': (
        [Topic(ON), shown(0), Call(OFF, 'default'), failed(2), Topic(OFF, 'safety'),
         Release('safety')], LIGHT, None, None, {0: 'shown', 2: 'failed', 4: 'held by default'}),
    'switch and configuration are independent': ([Call(ON), Call(b(10.0))], LIGHT, True, b(10.0),
                                                 {}),
    # Sets and setpoints.
    'sets of different fields share a command': ([Call(b(10.0)), Call(s(1.0))], LIGHT, None,
                                                 {**b(10.0), **s(1.0)}, {}),
    'sets of one field do not': ([Call({**b(10.0), **s(1.0)}), Call(b(20.0))], LIGHT, None,
                                 b(20.0), {0: 'superseded by brightness 20 %'}),
    'a setpoint waits for a set': ([Call(b(10.0)), Topic(b(20.0))], LIGHT, None, b(10.0), {}),
    'and is sent after it': ([Call(b(10.0)), Topic(b(20.0)), shown(0)], LIGHT, None, b(20.0),
                             {0: 'shown'}),
    'a set replaces a setpoint': ([Topic(b(20.0)), Call(b(10.0))], LIGHT, None, b(10.0),
                                  {0: 'superseded by brightness 10 %'}),
    'the newest setpoint wins': ([Topic(b(20.0)), Topic(b(10.0))], LIGHT, None, b(10.0),
                                 {0: 'superseded by brightness 10 %'}),
    'a strobe needs a duty cycle': ([Call({'strobe_period': 1.0})], LIGHT, None, s(1.0), {}),
    # Rules.
    'a silence ends an ON': ([Call(ON), Rule(Why.SILENCE, OFF)], LIGHT, False, None,
                             {0: 'SILENCE'}),
    'a silence forgets all ONs': (
        [Topic(ON), shown(0), Topic(ON, 'safety'), shown(2), Rule(Why.SILENCE, OFF), shown(4),
         Release('safety')], LIGHT, None, None, {0: 'shown', 2: 'shown'}),
    'a request ends a silence': ([Rule(Why.SILENCE, OFF), Call(ON)], LIGHT, True, None, {}),
    'an equal request does not': ([Rule(Why.SILENCE, OFF), Call(OFF), shown(1)], LIGHT, False,
                                  None, {1: 'shown'}),
    'a rule that is not due': ([Rule(Why.SILENCE, OFF, 9.0)], LIGHT, None, None, {}),
    'the end ends all': ([Call(ON), Rule(Why.END, OFF)], LIGHT, False, None, {0: 'END'}),
    'the end outranks a request': ([Rule(Why.END, OFF), Call(ON)], LIGHT, False, None, {}),
    'a release ends an ON of a topic': (
        [Topic(ON), Release('default'), Rule(Why.RELEASE, OFF)], LIGHT, False, None,
        {0: 'RELEASE'}),
    'a release does not end a call': ([Call(ON), Rule(Why.RELEASE, OFF)], LIGHT, True, None, {}),
    'a call that succeeds ends a release': (
        [Rule(Why.RELEASE, OFF), Call(ON), shown(1)], LIGHT, None, None, {1: 'shown'}),
    'also one that comes during the call': (
        [Call(ON), Rule(Why.RELEASE, OFF), shown(0)], LIGHT, None, None, {0: 'shown'}),
    'a call that fails leaves a release': (
        [Rule(Why.RELEASE, OFF), Call(ON), failed(1)], LIGHT, False, None, {1: 'failed'}),
    'a message ends a release': ([Rule(Why.RELEASE, OFF), Topic(ON)], LIGHT, True, None, {}),
    'it is sent when the call has failed': ([Call(ON), Rule(Why.RELEASE, OFF), failed(0)], LIGHT,
                                            False, None, {0: 'failed'}),
    'a setpoint leaves a release': ([Rule(Why.RELEASE, OFF), Topic(b(10.0))], LIGHT, False,
                                    b(10.0), {}),
    'an override within a limit': ([Rule(Why.OVERRIDE, b(33.0)), Rule(Why.LIMIT, b(40.0))], LIGHT,
                                   None, b(33.0), {}),
    'a limit before an override': ([Rule(Why.LIMIT, b(40.0)), Rule(Why.OVERRIDE, b(33.0))], LIGHT,
                                   None, b(33.0), {}),
    'a restored value within a limit': ([Rule(Why.RESTORED, b(33.0)), Rule(Why.LIMIT, b(40.0))],
                                        LIGHT, None, b(33.0), {}),
    'a limit before a restored value': ([Rule(Why.LIMIT, b(40.0)), Rule(Why.RESTORED, b(33.0))],
                                        LIGHT, None, b(33.0), {}),
    'an override outranks a restored value': (
        [Rule(Why.RESTORED, b(20.0)), Rule(Why.OVERRIDE, b(33.0))], LIGHT, None, b(33.0), {}),
    'in either order': ([Rule(Why.OVERRIDE, b(33.0)), Rule(Why.RESTORED, b(20.0))], LIGHT, None,
                        b(33.0), {}),
    'a request outranks an override': ([Rule(Why.OVERRIDE, b(33.0)), Call(b(10.0))], LIGHT, None,
                                       b(10.0), {}),
    'in either order, too': ([Call(b(10.0)), Rule(Why.OVERRIDE, b(33.0))], LIGHT, None, b(10.0),
                             {}),
    'a request outranks a limit': ([Topic(b(10.0)), Rule(Why.LIMIT, b(40.0))], LIGHT, None,
                                   b(10.0), {}),
    'a limit before a request': ([Rule(Why.LIMIT, b(40.0)), Topic(b(10.0))], LIGHT, None, b(10.0),
                                 {}),
    'a limit alone': ([Rule(Why.LIMIT, b(40.0))], LIGHT, None, b(40.0), {}),
    'a set takes its field from a rule': (
        [Rule(Why.OVERRIDE, {**b(20.0), **s(1.0)}), Call(b(10.0)), shown(1)], LIGHT, None, s(1.0),
        {1: 'shown'}),
    'a set that fails does not': ([Rule(Why.OVERRIDE, b(20.0)), Call(b(10.0)), failed(1)], LIGHT,
                                  None, b(20.0), {1: 'failed'}),
    'a rule goes along before it is due': ([Rule(Why.RESTORED, s(1.0), 9.0), Call(b(10.0))], LIGHT,
                                           None, {**b(10.0), **s(1.0)}, {}),
    'and waits without company': ([Rule(Why.RESTORED, s(1.0), 9.0)], LIGHT, None, None, {}),
    # Limits.
    'each command is within the limits': ([Call(s(1.0))], Shown(Configuration(
        INTERNAL, 90.0, 0.0, 0.0), brightness_is_switch=False), None,
        {**s(1.0), **b(40.0)}, {}),
    # Sources.
    'a lower call is refused': ([Topic(OFF, 'safety'), shown(0), Call(ON)], LIGHT, None, None,
                                {0: 'shown', 2: 'held by safety'}),
    'a lower message waits': ([Topic(OFF, 'safety'), shown(0), Topic(ON)], LIGHT, None, None,
                              {0: 'shown', 2: 'held by safety'}),
    'until the release': ([Topic(OFF, 'safety'), shown(0), Topic(ON), Release('safety')], LIGHT,
                          True, None, {0: 'shown', 2: 'held by safety'}),
    'or the silence of the source': (
        [Topic(OFF, 'safety'), shown(0), Wait(3.0), Topic(ON), Wait(3.0)], LIGHT, True, None,
        {0: 'shown', 3: 'held by safety'}),
    'its silence ends its own wish': (
        [Topic(OFF, 'safety'), shown(0), Topic(ON), Wait(3.0), Topic(OFF, 'safety'), Wait(3.0),
         Release('safety')], LIGHT, False, None, {0: 'shown', 2: 'held by safety'}),
    'a higher message takes over': ([Topic(ON), Topic(OFF, 'safety')], LIGHT, False, None,
                                    {0: 'held by safety'}),
    'a higher call takes over': ([Call(ON), Call(OFF, 'safety')], LIGHT, False, None,
                                 {0: 'held by safety'}),
    'a higher call that fails gives back': ([Topic(ON), Call(OFF, 'safety'), failed(1)], LIGHT,
                                            True, None, {0: 'held by safety', 1: 'failed'}),
    'what was shown stays shown': ([Topic(ON), shown(0), Call(OFF, 'safety'), failed(2)], LIGHT,
                                   None, None, {0: 'shown', 2: 'failed'}),
    'a higher setpoint stops a lower ON': ([Topic(ON), Topic(b(10.0), 'safety')], LIGHT, None,
                                           b(10.0), {0: 'held by safety'}),
    'a call that succeeded is a wish': (
        [Call(ON), shown(0), Topic(OFF, 'safety'), shown(2), Release('safety')], LIGHT, True, None,
        {0: 'shown', 2: 'shown'}),
    'a release ends the calls of its source': ([Call(ON, 'safety'), Release('safety')], LIGHT,
                                               None, None, {0: 'released by safety'}),
    'the wish of the holder follows a released call': (
        [Topic(OFF), shown(0), Call(ON, 'safety'), Release('safety')], LIGHT, False, None,
        {0: 'shown', 2: 'released by safety'}),
    'a release of another source leaves what goes on': (
        [Topic(OFF, 'operator'), Release('operator'), Release('default'), Release('safety')],
        LIGHT, False, None, {}),
    'a message under way goes on after it': ([Topic(OFF, 'safety'), Release('safety')], LIGHT,
                                             False, None, {}),
    'but not past the next source': (
        [Topic(b(10.0)), shown(0), Topic(ON, 'safety'), Release('safety')], LIGHT, None, b(10.0),
        {0: 'shown', 2: 'held by default'}),
    'a call claims after a released one': (
        [Call(ON, 'safety'), Release('safety'), Call(OFF, 'safety'), shown(2), Call(ON)], LIGHT,
        None, None, {0: 'released by safety', 2: 'shown', 4: 'held by safety'}),
    # Lights whose brightness is the switch.
    'an OFF hides a setpoint': ([Topic(b(10.0)), Topic(OFF)], LIT, False, None, {}),
    'also before that is known': ([Topic(b(10.0)), Topic(OFF)], UNSEEN, False, None, {}),
    'but not where it is not': ([Topic(b(10.0)), Topic(OFF)], LIGHT, False, b(10.0), {}),
    'an OFF hides what is restored': ([Rule(Why.RESTORED, s(1.0)), Topic(OFF)], LIT, False, None,
                                      {}),
    'a set beside an OFF carries 0': ([Topic(OFF), Call(s(1.0))], LIT, False,
                                      {**s(1.0), **b(0.0)}, {}),
    'a set of a dark light carries 0': ([Call(s(1.0))], DARK, None, s(1.0), {}),
    'but what is asked for': ([Call(b(10.0))], DARK, None, b(10.0), {}),
    'a setpoint waits for the next ON': ([Topic(b(10.0))], DARK, None, None, {}),
    'a restored brightness waits, too': ([Rule(Why.RESTORED, {**b(20.0), **s(1.0)})], DARK, None,
                                         s(1.0), {}),
    # Before the first status.
    'a complete set': ([Rule(Why.OVERRIDE, ALL)], NEW, None, ALL, {}),
}


@pytest.mark.parametrize('name', ROWS)
def test_the_goals_follow_from_the_requests(name: str) -> None:
    script, light, on, changes, answers = ROWS[name]
    play = Play(script)

    switch, configuration, _ = play.decide(light)

    assert (switch and switch.values) is on
    base = light.agreed or AGREED
    assert (configuration and {
        name: getattr(configuration.values, name) for name in FIELDS
        if light is NEW or getattr(configuration.values, name) != getattr(base, name)}) == changes
    assert play.answers == answers


def test_a_configuration_without_all_fields_names_the_missing_ones() -> None:
    goals = Play([Rule(Why.OVERRIDE, b(10.0))]).decide(NEW)

    assert goals.missing == ('mode', 'strobe_period', 'strobe_duty_cycle')


def test_a_period_outside_of_the_own_range_of_a_light_is_replaced_by_the_nearest() -> None:
    light = Shown(Configuration(Mode.EXTERNAL_SYNC, 30.0, 25.0, 50.0), brightness_is_switch=False,
                  strobe_range=StrobeRange(0.5, 2.0))

    _, configuration, _ = Play([Call(b(10.0))]).decide(light)

    assert configuration
    assert configuration.values.strobe_period == 2.0


# The script -> how the goal of the switch, else of the configuration, is sent.
@pytest.mark.parametrize(('script', 'insists', 'gives_way', 'is_awaited', 'deadline'), [
    ([Call(ON)], False, False, True, math.inf),
    ([Topic(ON)], False, False, False, math.inf),
    ([Rule(Why.SILENCE, OFF)], True, False, False, math.inf),
    ([Rule(Why.RELEASE, OFF), Call(OFF)], True, False, True, math.inf),
    ([Topic(b(10.0))], False, True, False, 0.95),
    ([Rule(Why.RESTORED, b(10.0))], False, True, False, math.inf),
    ([Rule(Why.RESTORED, s(1.0)), Call(b(10.0))], False, False, True, math.inf)])
def test_a_goal_says_how_its_command_is_sent(
    script: list[Any], insists: bool, gives_way: bool, is_awaited: bool, deadline: float,
) -> None:
    goals = Play(script).decide(LIGHT)
    goal = goals.switch or goals.configuration

    assert goal
    assert (goal.insists, goal.gives_way, goal.is_awaited) == (insists, gives_way, is_awaited)
    assert goal.deadline == pytest.approx(deadline)


def test_a_goal_serves_the_requests_whose_values_it_has() -> None:
    play = Play([Rule(Why.LIMIT, b(40.0)), Rule(Why.RESTORED, s(1.0)), Topic(b(10.0)),
                 Call(b(20.0))])

    _, goal, _ = play.decide(LIGHT)

    assert goal
    assert set(goal.serves) == {play.made[1], play.made[3]}
    assert goal.note == ''


def test_a_duty_cycle_that_comes_with_a_strobe_period_is_noted() -> None:
    _, goal, _ = Play([Call({'strobe_period': 1.0})]).decide(LIGHT)

    assert goal
    assert goal.note == DUTY_CYCLE_NOTE


def test_the_holder_is_reported_when_it_changes() -> None:
    play = Play([Call(ON), failed(0), Call(ON), shown(2), Topic(OFF, 'safety'), Release('safety'),
                 Wait(6.0)])

    assert [(one.before, one.after, one.cause) for one in play.held] == [
        (None, 'default', Cause.CLAIM), ('default', 'safety', Cause.CLAIM),
        ('safety', 'default', Cause.RELEASE), ('default', None, Cause.SILENCE)]


def test_a_call_beyond_the_bound_is_answered_with_it() -> None:
    play = Play([*[Call(ON)] * (MAX_CALLS + 1), Call(b(10.0)), Topic(ON)])

    assert play.answers == {MAX_CALLS: '32 requests are waiting for light 1/243 already'}


def test_without_sources_no_request_is_refused_and_no_holder_is_reported() -> None:
    play = Play([Topic(ON), shown(0), Call(OFF)], None)

    assert (play.held, play.requests.shown_holder) == ([], None)
    assert play.decide(LIGHT).switch
