# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""A script of users, of other senders and of the light, and the state at its end: one table."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
import itertools
from typing import Any, NamedTuple

from illuminator_ros.illuminator.client import enable_all
from illuminator_ros.illuminator.events import AutomaticSwitch, DesiredStateFailed, LightEvent
from illuminator_ros.illuminator.model import SafetyLimits
from illuminator_ros.illuminator.settings import LightSettings
from illuminator_ros.mavlink.dialect import mavlink
from illuminator_ros.payload.command_sources import SourceSettings
import pytest
from support.back_to_back import Pair
from support.fake_light import FakeLight
from support.records import Answer

ON_OFF, CONFIGURE = mavlink.MAV_CMD_ILLUMINATOR_ON_OFF, mavlink.MAV_CMD_DO_ILLUMINATOR_CONFIGURE
COMMANDS = {'ON_OFF': ON_OFF, 'CONFIGURE': CONFIGURE}
NAMES = ('safety', 'operator', 'default', 'autonomy')
# The answers of the light to a command; the last one is repeated.
ANSWERS = {'obeyed': mavlink.MAV_RESULT_ACCEPTED, 'refused': mavlink.MAV_RESULT_DENIED,
           'failed': mavlink.MAV_RESULT_FAILED, 'lost': None,
           'rejected': mavlink.MAV_RESULT_TEMPORARILY_REJECTED,
           'progress': mavlink.MAV_RESULT_IN_PROGRESS}
LIGHTS: dict[str, dict[str, Any]] = {
    'on': {'enable': 1}, 'off': {'enable': 0}, 'dark': {'enable': 0, 'brightness': 0.0},
    'lit': {'enable': 1, 'error_status': 0}, 'cool': {'enable': 0, 'error_status': 0},
    'hot': {'enable': 0, 'error_status': 2}}


class Stage:
    """
    A light that sources share, while a script is played.

    :ivar answers: to the requests since the mark; ``marked`` is its time.
    """

    def __init__(
        self, *, timeout: float = 60.0, silence: float = 0.0, release: str = 'keep',
        limit: float = 100.0, is_switch: bool = False, restores: bool = True, **fields: Any,
    ) -> None:
        self.light = FakeLight(**{'brightness': 50.0, **fields})
        self.light.brightness_is_switch = is_switch
        self.pair = Pair(self.light, settings=LightSettings(
            sources=SourceSettings(NAMES, timeout), off_on_release=release == 'off',
            restore_configuration=restores,
            limits=SafetyLimits(max_brightness=limit), off_after_silence=silence)).settle()
        self.answers: list[Answer] = []
        self.marked = 0.0

    def play(self, script: str) -> None:
        """Play steps; a number lets so many seconds pass."""
        for step in script.split(', '):
            self._play(step.split())
            self.pair.turn()

    def _play(self, words: Sequence[str]) -> None:
        pair, light = self.pair, self.light
        match words:
            case ['mark']:
                self.answers, self.marked = [], pair.now
            case ['all', *how, value]:
                enable_all([pair.light], value == 'on', pair.now, Answer(0.0), name=str,
                           is_call=bool(how))
            case [source, 'on' | 'off' as value] if source in NAMES:
                self._enable(source, value, is_call=False)
            case [source, 'calls', value]:
                self._enable(source, value, is_call=True)
            case [source, 'dims', value]:
                pair.light.set_brightness(float(value), pair.now, source=source)
            case ['sets', value]:
                self.answers.append(pair.ask_configure(brightness=float(value)))
            case ['strobes', value]:
                self.answers.append(pair.ask_configure(strobe_period=float(value)))
            case ['requires', value]:
                pair.light.require({'brightness': float(value)}, pair.now)
            case ['refreshes']:
                pair.ask_refresh()
            case ['release', source]:
                pair.light.release(source, pair.now)
            case ['limit' | 'silence' | 'timeout' as name, value]:
                self._change(name, float(value))
            case ['close']:
                pair.close()
            case ['open']:
                pair.open()
            case ['stopped', value]:
                pair.now += float(value)
            case ['is', command, *answers]:
                light.results[COMMANDS[command]] = [ANSWERS[one] for one in answers]
            case ['light', 'silent' | 'heard' as value]:
                light.silent = value == 'silent'
            case ['light', 'mute']:
                light.stream, light.answers = 0.0, set()
            case ['light', 'still']:
                light.stream = 0.0
            case ['light', 'late', value]:
                light.apply_after, light.pushes = float(value), True
            case ['light', 'deaf']:
                light.applies = False
            case ['light', 'at', value]:
                light.fields['brightness'] = float(value)
            case ['light', value]:
                light.fields |= LIGHTS[value]
            case ['restart', value]:
                light.restart(pair.now, **LIGHTS[value])
            case [seconds]:
                pair.run(float(seconds))

    def _enable(self, source: str, value: str, *, is_call: bool) -> None:
        answer = Answer(self.pair.now)
        self.answers.append(answer)
        self.pair.light.enable(
            value == 'on', self.pair.now, answer, source=source, is_call=is_call)

    def _change(self, name: str, value: float) -> None:
        changes: dict[str, dict[str, Any]] = {
            'limit': {'limits': SafetyLimits(max_brightness=value)},
            'silence': {'off_after_silence': value},
            'timeout': {'sources': SourceSettings(NAMES, value)}}
        self.pair.controller.change_settings(
            replace(self.pair.controller.settings, **changes[name]), self.pair.now)

    @property
    def state(self) -> str:
        """Return whether the light is on, and the source that holds it."""
        held = f', {holder}' if (holder := self.pair.snapshot.holder) else ''
        return ('on' if self.light.fields['enable'] else 'off') + held

    @property
    def sent(self) -> str:
        """Return the commands since the mark, without those that repeat the one before."""
        words = (('on' if one.param1 else 'off') if one.command == ON_OFF else f'{one.param2:g}'
                 for one in self.pair.commands(ON_OFF, CONFIGURE, since=self.marked))
        return ' '.join(word for word, _ in itertools.groupby(words))


class Row(NamedTuple):
    """
    A script and its outcome.

    :param state: at the end.
    :param sent: the commands since the mark, None for any.
    :param answers: the beginnings of those to the requests since the mark.
    :param brightness: of the light, None for any.
    """

    script: str
    state: str
    sent: str | None = None
    answers: tuple[str, ...] = ()
    brightness: float | None = None
    options: dict[str, Any] = {}


def row(script: str, state: str, sent: str | None = None, *answers: str,
        brightness: float | None = None, **options: Any) -> Row:
    return Row(script, state, sent, answers, brightness, options)


# The light has shown that its brightness is the switch, and is on.
LEARN = 'default calls on, 5, default calls off, 5, default calls on, 5, '
OFF: dict[str, Any] = {'release': 'off'}
SWITCH: dict[str, Any] = {'is_switch': True}
SILENT: dict[str, Any] = {'silence': 5.0}
DONE = 'off, confirmed'
ROWS: dict[str, Row] = {
    # Sources.
    'a lower source is refused': row(
        'safety off, 1, mark, autonomy on, autonomy dims 20, sets 30', 'off, safety', '',
        'held by safety', 'held by safety'),
    'a request after a stop finds the silent source gone': row(
        'safety on, 1, stopped 2.3, autonomy off, 1', 'off, autonomy', timeout=2.3),
    'a refused call leaves nothing': row(
        'safety off, 1, default calls on, mark, release safety, 1', 'off', ''),
    'nor does a refused set': row('safety off, 1, sets 30, mark, release safety, 1', 'off', ''),
    'but a message before it stays': row(
        'safety off, 1, default on, default calls off, mark, release safety, 1', 'on, default',
        'on'),
    'a refused call keeps no light on': row(
        'safety on, 5, autonomy calls on, 2', 'off, safety', silence=6.0),
    'a call that fails refuses lower ones meanwhile': row(
        'operator off, 1, is ON_OFF lost, mark, safety calls on, default calls off, 3, '
        'is ON_OFF obeyed, operator calls off, 1', 'off, operator', 'on off', 'no acknowledgement',
        'held by safety', DONE),
    'a call that is refused gives back': row(
        'operator off, 1, is ON_OFF refused, mark, safety calls on, 1, is ON_OFF obeyed, '
        'operator calls off, 2', 'off, operator', 'on off', 'refused', DONE),
    'a call to a lost light claims nothing': row(
        'operator off, 1, close, mark, safety calls on, default calls off, open, 1, '
        'operator calls off, 1', 'off, operator', 'off', 'light 1/243 is lost',
        'held by operator', DONE),
    'a call that succeeded is sent after a takeover': row(
        'operator calls on, 0.3, safety off, 1, mark, release safety, 1', 'on, operator', 'on'),
    'one under way is not': row(
        'is ON_OFF lost, operator calls on, 0.3, is ON_OFF obeyed, safety off, 3, mark, '
        'release safety, 1', 'off', ''),
    'a call of off that fails ends the on before': row(
        'operator on, 1, close, operator calls off, open, 1, safety off, 1, mark, release safety, '
        '1', 'off, operator', ''),
    'the next wish is sent once after a release': row(
        'safety off, 1, autonomy on, autonomy dims 20, mark, release safety, 0.5', 'on, autonomy',
        '20 on'),
    'and after a silence of the source': row(
        'safety off, 1, autonomy on, autonomy dims 20, mark, 1.9', 'on, autonomy', '20 on',
        timeout=2.3),
    'a brightness goes with an off': row(
        'safety on, operator off, operator dims 20, 1, release safety, 1', 'off, operator',
        brightness=20.0),
    'of the requests to a lost light none': row(
        'light silent, 5, autonomy on, autonomy dims 20, light heard, 2, safety off, 1, mark, '
        'release safety, 1', 'off', ''),
    'but that before the loss': row(
        'autonomy on, 1, light silent, 5, autonomy on, light heard, 2, safety off, 1, mark, '
        'release safety, 1', 'on, autonomy', 'on'),
    'and an off': row(
        'autonomy on, 1, light silent, 5, autonomy off, light heard, 2, safety off, 1, mark, '
        'release safety, 1', 'off, autonomy', 'off'),
    'which an on does not end': row(
        'autonomy off, 1, light silent, 5, autonomy on, light heard, 2, safety off, 1, mark, '
        'release safety, 1', 'off, autonomy', 'off'),
    'an off that a call refuses is sent when that has failed': row(
        'is CONFIGURE refused, mark, sets 30, autonomy off, 1', 'off, autonomy', '30 off',
        'refused', 'held by default', enable=1),
    'but not one that another sender has undone': row(
        'autonomy off, 1, light on, 1, is CONFIGURE refused, sets 30, 2', 'on, autonomy'),
    'a message that is not sent claims no light': row(
        'close, safety on, open, 1, mark, operator calls off, 1', 'off, operator', 'off', DONE),
    'an off of the next source waits for the link': row(
        'safety on, 2, autonomy off, close, 3, open, 0.5', 'off, autonomy', timeout=4.0),
    'an off of all lights ends the on of a lost one': row(
        'default on, 1, close, all off, open, 1, safety off, 1, mark, release safety, 1',
        'off, default', 'off'),
    'also by a call': row(
        'default on, 1, close, all calls off, open, 1, safety off, 1, mark, release safety, 1',
        'off, default', ''),
    'a takeover ends the resends of the lower source': row(
        'is ON_OFF lost, is CONFIGURE lost, mark, autonomy on, autonomy dims 20, '
        'operator dims 40, 1.5', 'off, operator', 'on 20 40', 'held by operator'),
    'a shorter timeout counts at once': row('safety off, 10, timeout 5', 'off'),
    # Releases.
    'a released light stays': row('operator on, 1, mark, release operator, 2', 'on', ''),
    'or goes off': row('operator on, 1, mark, release operator, 2', 'off', 'off', **OFF),
    'an on under way goes on': row(
        'mark, operator on, release operator, 2', 'on', 'on', 'on, confirmed'),
    'an off under way is resent': row(
        'is ON_OFF lost obeyed, mark, operator off, release operator, 3', 'off', 'off', DONE,
        enable=1),
    'the off of a release is sent to a light that is off': row(
        'operator off, 2, mark, release operator, 1', 'off', 'off', **OFF),
    'and to a light that is on unseen': row(
        'operator off, 2, light still, light on, mark, release operator, 1', 'off', 'off', **OFF),
    'and where an on is under way': row(
        'light late 1.2, operator on, release operator, 8', 'off', **OFF),
    'and where a brightness may switch on': row(
        'light dark, 1, light late 1.2, sets 20, release default, 8', 'off', **OFF, **SWITCH),
    'it ends an on that gets no answer': row(
        'is ON_OFF lost, operator off, operator on, release operator, is ON_OFF obeyed, 4', 'off',
        **OFF),
    'also of a call': row(
        'is ON_OFF lost, operator off, operator calls on, release operator, is ON_OFF obeyed, 4',
        'off', **OFF),
    'also by the silence of the source': row(
        'is ON_OFF lost, operator off, operator on, 2.3, is ON_OFF obeyed, 4', 'off', timeout=2.3,
        **OFF),
    'but not a call of a higher source': row(
        'autonomy off, 2.2, is ON_OFF lost, mark, operator calls on, 0.5, is ON_OFF obeyed, 2',
        'on, operator', 'on', 'on, confirmed', timeout=2.3, **OFF),
    'a release ends the calls of its source': row(
        'light late 0.2, mark, operator calls on, release operator, 4', 'on', 'on',
        'released by operator'),
    'and then decides': row(
        'light late 0.2, mark, operator calls on, release operator, 4', 'off', 'on off',
        'released by operator', **OFF),
    'an off after a released call holds': row(
        'light late 0.2, safety calls on, release safety, safety calls off, 2, mark, '
        'autonomy calls on, 3', 'off, safety', '', 'held by safety'),
    'the off outlives a call that fails with the link': row(
        'operator on, 1, is ON_OFF failed, release operator, 0.5, autonomy calls on, close, '
        'is ON_OFF obeyed, open, 3', 'off', **OFF),
    'but not a call that succeeds': row(
        'operator on, 1, is ON_OFF refused, release operator, 1.1, is ON_OFF obeyed, mark, '
        'default calls on, 2', 'on, default', 'on', **OFF),
    'a source that dims does not end it': row(
        'operator on, 1, is ON_OFF failed, release operator, 0.5, autonomy dims 20, '
        'is ON_OFF obeyed, 3', 'off, autonomy', **OFF),
    'it ends values that would switch on': row(
        'light on, 1, light dark, 1, operator off, 2, is CONFIGURE lost, requires 20, 4.4, '
        'release operator, is CONFIGURE obeyed, 1', 'off', **OFF, **SWITCH),
    'a light that restarts on after the silence of its source': row(
        'operator on, 1, close, 3.3, restart on, open, 5', 'off', timeout=2.3, **OFF),
    # Silence.
    'calls keep a light on': row('default calls on, 4, default calls on, 4', 'on, default',
                                 **SILENT),
    'so do sets': row('default calls on, 4, sets 20, 4', 'on, default', **SILENT),
    'and setpoints': row('default calls on, 4, default dims 20, 4', 'on, default', **SILENT),
    'but no refresh': row('default calls on, 4, refreshes, 4', 'off, default', **SILENT),
    'and no refused set': row(
        'default calls on, 1, is CONFIGURE refused, sets 20, 1, sets 21, 1, sets 20, 1, sets 21, '
        '2', 'off, default', **SILENT),
    'an on of another sender ends with the silence': row('light on, 7', 'off', 'off', **SILENT),
    'and not before': row(
        'default calls off, 1, is ON_OFF refused, default calls on, 1, is ON_OFF obeyed, 7, '
        'light on, 4', 'on, default', **SILENT),
    'the off is repeated until it is shown': row(
        'default calls on, 1, is ON_OFF failed failed lost lost obeyed, 20', 'off, default',
        **SILENT),
    'also to a light without a status': row(
        'light mute, is ON_OFF lost, default calls on, 3, mark, 5', 'off', 'off', **SILENT),
    'an on under way ends with the silence': row(
        'is ON_OFF lost, mark, default calls on, 5', 'off', 'on off', 'off_after_silence (500 ms)',
        silence=0.5),
    'also one in progress': row(
        'is ON_OFF progress obeyed, mark, default calls on, 5', 'off', 'on off',
        'off_after_silence (300 ms)', silence=0.3),
    'an off under way is answered as it ends': row(
        'default calls on, 0.3, is ON_OFF lost, mark, default calls off, 1.5, is ON_OFF obeyed, 3',
        'off, default', 'off', DONE, silence=1.0),
    'a light that is lost before its off': row(
        'default calls on, 1, close, 7, open, 2', 'off, default', **SILENT),
    'a light that is lost during its off': row(
        'default calls on, 1, is ON_OFF failed, 4.5, close, 6, is ON_OFF obeyed, open, 2',
        'off, default', **SILENT),
    'an on that takes effect late is not a request': row(
        'default calls off, 0.5, is ON_OFF lost, default calls on, 3, is ON_OFF obeyed, '
        'light on, 1.2',
        'on, default', **SILENT),
    'so that the silence began before it': row(
        'default calls off, 0.5, is ON_OFF lost, default calls on, 3, is ON_OFF obeyed, '
        'light on, 1.9',
        'off, default', **SILENT),
    'a release is not a request': row(
        'safety off, 3, operator on, 0.5, release safety, 4, release safety, 3', 'off, operator',
        silence=6.0),
    'nor is a state that is sent for a source': row(
        'safety off, 3, operator on, 7.5', 'off, operator', silence=6.0, timeout=8.0),
    'of the requests before a silence no on': row(
        'safety on, 2, operator on, 7, mark, release safety, 1', 'off, operator', '', silence=6.0),
    'but an off': row(
        'safety on, 2, operator off, 7, mark, release safety, 1', 'off, operator', 'off',
        silence=6.0),
    'and no brightness that is the switch': row(
        'safety on, 2, safety off, 2, safety on, 2, operator dims 20, 7, mark, release safety, 1',
        'off, operator', '', silence=6.0, **SWITCH),
    'a silence that is set later counts from then': row(
        'default calls on, 50, silence 5, 4.5', 'on, default'),
    'and ends': row('default calls on, 50, silence 5, 5.5', 'off, default'),
    'and may be taken away': row('default calls on, silence 0, 60', 'on, default', **SILENT),
    'a longer silence restores nothing': row(
        'operator on, safety off, 5.1, silence 60, release safety, 5', 'off, operator', **SILENT),
    # Heat.
    'a light that cools down and lights up': row(
        'default calls on, 3, light hot, 1.1, light cool, 1.1, light lit, 2.1', 'off, default',
        **SILENT),
    'an off to a hot light is repeated until it is accepted': row(
        'default on, 2, light hot, 1.1, is ON_OFF rejected, 10, is ON_OFF obeyed, light lit, 4',
        'off, default', **SILENT),
    'and is sent once if it is': row('default on, 2, light hot, 1.1, mark, 10', 'off, default',
                                     'off', **SILENT),
    'so is the off of a release': row(
        'default on, 2, light hot, 1.1, is ON_OFF rejected, release default, 5, is ON_OFF obeyed, '
        'light lit, 4', 'off', **OFF),
    # Lights whose brightness is the switch.
    'a brightness before an off is not sent after it': row(
        LEARN + 'is CONFIGURE lost lost obeyed, default dims 30, default dims 35, 0.05, '
        'default calls off, 10', 'off, default', **SWITCH),
    'nor is a restored brightness': row(
        LEARN + 'is CONFIGURE lost obeyed, restart on, 1.05, default calls off, 10',
        'off, default', **SWITCH),
    'nor after a takeover': row(
        'operator dims 20, 1, operator off, 1, safety on, 1, release safety, 5', 'off, operator',
        **SWITCH),
    'a setpoint waits for an off': row(
        'is ON_OFF lost lost obeyed, mark, default calls off, default dims 30, 0.5',
        'on, default', 'off', enable=1),
    'and follows it where brightness is not the switch': row(
        'is ON_OFF lost lost obeyed, mark, default calls off, default dims 30, 3', 'off, default',
        'off 30', DONE, enable=1),
    'no limit is sent during an off': row(
        LEARN + 'light late 0.5, light at 90, mark, default calls off, refreshes, 10',
        'off, default', 'off', DONE, limit=60.0, **SWITCH),
    'but after an on': row(
        LEARN + 'light late 0.5, light at 90, default calls off, 3, light on, light at 90, 5',
        'on, default', brightness=60.0, limit=60.0, **SWITCH),
    'and where a brightness is shown while off': row(
        'default calls off, 1, light at 90, 3', 'off, default', brightness=60.0, limit=60.0),
    'a set of a dark light keeps it dark': row(
        'light dark, 1, sets 60, 1, mark, default calls off, strobes 1, 3', 'off, default', None,
        DONE, 'strobe_period 1 s', **SWITCH),
    'what is restored keeps it dark': row(
        'light dark, 1, sets 60, 3, restart dark, 5', 'off, default', **SWITCH),
    'a restored brightness waits for the on': row(
        'light at 80, 1, restart dark, 5, light on, light at 50, 5', 'on', brightness=80.0,
        enable=1, **SWITCH),
    'a set beside an off where a brightness was shown while off': row(
        'default calls on, 40, light dark, 5, sets 40, 5, mark, strobes 1, default calls off, 3',
        'off, default', None, 'strobe_period 1 s', DONE),
    'nothing is restored during an off': row(
        LEARN + 'light late 0.5, restart on, mark, default calls off, refreshes, 10',
        'off, default', 'off', DONE, **SWITCH),
    'an off ends a set where that may be the switch': row(
        'is CONFIGURE lost, mark, sets 50, 0.1, is CONFIGURE obeyed, default calls off, '
        'strobes 1, 3', 'off, default', None, 'superseded by off', DONE, 'an OFF is under way',
        enable=1, **SWITCH),
    # Limits that change.
    'within the fence sets that share a command succeed only together': row(
        'is CONFIGURE lost, sets 30, 1, mark, sets 50, strobes 1, 2', 'off', '50',
        'brightness 50 % not confirmed', 'strobe_period 1 s, strobe_duty_cycle 50 % not confirmed',
        brightness=50.0),
    # Repeated messages.
    'a repeated setpoint beside a set of another value is sent after it': row(
        'default dims 30, 2, is CONFIGURE lost obeyed, mark, sets 60, default dims 30, 3',
        'off, default', '60 30', brightness=30.0),
    'and is what its source has asked for last': row(
        'default dims 30, 2, is CONFIGURE lost obeyed, sets 60, default dims 30, 3, '
        'safety calls on, 1, safety dims 80, 1, mark, release safety, 3', 'on, default', '30',
        brightness=30.0),
    'a lower limit dims before a status': row('mark, limit 40, 0.1', 'off', '40', brightness=40.0),
    'a limit that is taken away is not sent again': row(
        'is CONFIGURE lost, limit 40, 1.2, mark, limit 100, is CONFIGURE obeyed, 10', 'off', '',
        brightness=50.0),
    'a set beyond a new limit fails': row(
        'is CONFIGURE lost, mark, sets 90, 0.2, limit 40, is CONFIGURE obeyed, 5', 'off', '90 40',
        'brightness 90 % is above max_brightness 40 %', brightness=40.0),
    'a setpoint beyond it is clipped': row(
        'is CONFIGURE lost, mark, default dims 90, 0.2, limit 40, is CONFIGURE obeyed, 5',
        'off, default', '90 40', brightness=40.0),
}


@pytest.mark.parametrize('name', ROWS)
def test_the_state_of_the_light_follows_from_the_script(name: str) -> None:
    script, state, sent, answers, brightness, options = ROWS[name]
    stage = Stage(**options)

    stage.play(script)

    assert (stage.state, sent if sent is None else stage.sent) == (state, sent)
    assert brightness is None or stage.light.fields['brightness'] == brightness
    assert [one.result.message[:len(text)] for one, text in zip(
        stage.answers, answers, strict=False)] == [*answers]
    # Only what a status has confirmed is a success.
    assert [result.message for one in stage.answers for result in one.results
            if result.success is not (', confirmed by' in result.message)] == []


# The script and the options -> the events of rules and wishes.
@pytest.mark.parametrize(('script', 'options', 'events'), [
    ('operator on, 1, release operator, 1', OFF, ['AutomaticSwitch on_release:']),
    ('light on, 7', SILENT, ['AutomaticSwitch off_after_silence']),
    ('default calls on, 1, is ON_OFF failed, 9, is ON_OFF obeyed, 9', SILENT,
     ['AutomaticSwitch off_after_silence', 'AutomaticSwitch failed']),
    ('safety off, 1, autonomy on, is ON_OFF refused, release safety, 1', {},
     ['DesiredStateFailed autonomy']),
    ('safety off, 1, autonomy on, is ON_OFF lost, release safety, 0.2, operator off, 1', {}, []),
    # A setpoint that an OFF replaces has not failed.
    (LEARN + 'is CONFIGURE lost obeyed, default dims 30, default calls off, 3', SWITCH, [])])
def test_an_automatic_off_and_a_wish_that_fails_are_reported(
    script: str, options: dict[str, Any], events: list[str],
) -> None:
    stage = Stage(**options)

    stage.play(script)

    found = stage.pair.recorder
    assert [text for one in found.others if (text := _text(one))] == events
    assert found.failed_setpoints == []


def _text(event: LightEvent) -> str:
    match event:
        case AutomaticSwitch():
            return f'AutomaticSwitch {"failed" if event.failure else event.reason.split()[0]}'
        case DesiredStateFailed():
            return f'DesiredStateFailed {event.source}'
    return ''
