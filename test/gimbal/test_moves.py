# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""A script of users, managers and devices, and the messages that move the gimbal: one table."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
import itertools
import math
import random
from typing import Any, NamedTuple

from illuminator_ros.geometry.mount_attitude import STILL, YawFrame
from illuminator_ros.geometry.rotation import Quaternion
from illuminator_ros.gimbal.commands import (
    Attitude,
    Move,
    NEUTRAL,
    Rates,
    RETRACT,
    YAW_LOCKS,
)
from illuminator_ros.gimbal.messages import GimbalManagerSetAttitude, rates_of
from illuminator_ros.mavlink import messages as mav
from illuminator_ros.mavlink.dialect import mavlink
from illuminator_ros.payload.command_sources import SourceSettings
from illuminator_ros.payload.messages import GeoPoint
import pytest
from support.gimbals import DEVICE, FakeManager, NAN, OTHER, OURS, PLACE, Rig
from support.records import Answer

NAMES = ('safety', 'operator', 'default', 'autonomy')
LOCK = mavlink.GIMBAL_DEVICE_FLAGS_YAW_LOCK
RATE = (0.0, 0.0, -0.2)
# The moves of a script; the last two are angles and the yaw lock.
MOVES: dict[str, Move] = {
    'rate': Rates((0.0, 0.0, 0.2)), 'zero': Rates(), 'neutral': NEUTRAL, 'retract': RETRACT,
    'level': Attitude(Quaternion(), YawFrame.VEHICLE),
    'north': Attitude(Quaternion.from_euler(0.0, 0.0, math.pi / 2), YawFrame.EARTH),
    'lock': YAW_LOCKS[True], 'unlock': YAW_LOCKS[False],
    'place': PLACE, 'field': GeoPoint(47.1, 8.5, 500.0), 'clear': None}
TOPICS = ('rate', 'zero', 'level', 'north')
COMMANDS = {mavlink.MAV_CMD_DO_SET_ROI_NONE: 'clear',
            mavlink.MAV_CMD_DO_GIMBAL_MANAGER_CONFIGURE: 'control'}


@dataclass
class Turning(FakeManager):
    """A manager whose device turns at the rates that reach it, until it gets another move."""

    rates: tuple[float, float, float] = STILL

    def take(
        self, source: mav.Address, message: mav.Message,
    ) -> list[tuple[mav.Address, mav.Message]]:
        if (isinstance(message, GimbalManagerSetAttitude) and self.alive and self.hears
                and self.primary == source):
            rates = rates_of(message)
            self.rates = STILL if any(map(math.isnan, rates)) else rates
            if self.rates == STILL and not any(map(math.isnan, message.q)):
                w, x, y, z = message.q
                self.q = w, x, y, z
        answers = super().take(source, message)
        is_place = isinstance(message, mav.CommandInt)
        if (is_place or word(message) in ('neutral', 'retract')) and any(
                isinstance(one, mav.CommandAck) and one.result == mavlink.MAV_RESULT_ACCEPTED
                for _, one in answers):
            self.rates = STILL
        return answers


def word(message: mav.Message) -> str:
    """Return the name of a message that moves the gimbal or takes control, '' for another."""
    if isinstance(message, GimbalManagerSetAttitude):
        lock = '+lock' if message.flags & LOCK else ''
        if not any(map(math.isnan, message.q)):
            angles = Quaternion(*message.q).euler()
            return f'attitude {math.degrees(angles[1]):.0f}{lock}'
        return ('rate' if any(rates_of(message)) else 'zero') + lock
    if isinstance(message, mav.CommandInt):
        return 'place' if message.x == 470000000 else 'field'
    if not isinstance(message, mav.CommandLong):
        return ''
    if message.command == mavlink.MAV_CMD_DO_GIMBAL_MANAGER_PITCHYAW:
        return 'neutral' if int(message.param5) & NEUTRAL.flag else 'retract'
    return COMMANDS.get(message.command, '')


class Stage:
    """
    A gimbal that sources share, while a script is played.

    :ivar answers: to the requests since the mark; ``marked`` is the number of messages before.
    """

    def __init__(
        self, *, timeout: float = 60.0, shared: bool = True, lasts: float = 0.5,
        primary: mav.Address = OURS, **fields: Any,
    ) -> None:
        self.manager = Turning(primary=primary, **fields)
        self.rig = Rig(
            self.manager, sources=SourceSettings(NAMES, timeout) if shared else None,
            setpoint_timeout=lasts).run(4.0)
        self.answers: list[Answer] = []
        self.marked = 0

    def play(self, script: str) -> None:
        """Play steps; a number lets so many seconds pass."""
        for step in script.split(', '):
            self._play(step.split())

    def _play(self, words: Sequence[str]) -> None:
        rig, manager = self.rig, self.manager
        match words:
            case ['mark']:
                self.answers, self.marked = [], len(rig.sent)
            case [source, *rest] if source in NAMES:
                self._ask(rest, source)
            case ['take' | 'give' as name]:
                ask = {'take': rig.gimbal.take_control, 'give': rig.gimbal.release_control}[name]
                ask(rig.now, self._answer())
            case ['frees', source]:
                rig.gimbal.release(source, rig.now)
            case ['cut']:
                rig.component.link_closed(rig.now, 'cut')
            case ['open']:
                rig.component.link_opened(rig.now)
            case ['close']:
                rig.component.close(rig.now, 'the process ends')
            case ['lose', 'device']:
                rig.component.components_lost([DEVICE], rig.now, 'cut')
            case ['manager', state]:
                self._change(state)
            case ['other' | 'ours' | 'nobody' as name]:
                manager.primary = {'other': OTHER, 'ours': OURS,
                                   'nobody': mav.Address(0, 0)}[name]
            case ['device', 'turns']:
                manager.rates = RATE
            case ['device', 'stands']:
                manager.rates = STILL
            case ['device', 'mute' | 'reports' as state]:
                manager.device_reports = state == 'reports'
            case ['device', 'neutral']:
                manager.flags |= NEUTRAL.flag
            case ['device', 'locked']:
                manager.flags |= LOCK
            case [number] if number.replace('.', '').isdigit():
                rig.run(float(number))
            case _:
                self._ask(words, 'default')
        rig.run(0.02)

    def _ask(self, words: Sequence[str], source: str) -> None:
        """Ask for a move: a setpoint or ``topic`` by a topic, else by a call."""
        gimbal, now, answer, name = self.rig.gimbal, self.rig.now, self._answer(), words[-1]
        if name == 'down':
            gimbal.set_angles(
                (NAN, math.radians(30), NAN), YawFrame.VEHICLE, now, answer, source=source)
        else:
            is_call = words[0] != 'topic' and name not in TOPICS
            gimbal.request(MOVES[name], now, answer, is_call=is_call, source=source)

    def _answer(self) -> Answer:
        self.answers.append(Answer(self.rig.now))
        return self.answers[-1]

    def _change(self, state: str) -> None:
        manager = self.manager
        match state:
            case 'deaf' | 'hears':
                manager.hears = state == 'hears'
            case 'silent' | 'heard':
                manager.alive = state == 'heard'
            case 'mute' | 'answers':
                manager.answers = state == 'answers'
            case 'obeys' | 'idles':
                manager.applies = state == 'obeys'
            case 'denies' | 'rejects' | 'accepts':
                result = {'denies': mavlink.MAV_RESULT_DENIED,
                          'rejects': mavlink.MAV_RESULT_TEMPORARILY_REJECTED,
                          'accepts': mavlink.MAV_RESULT_ACCEPTED}[state]
                manager.results = dict.fromkeys((
                    mavlink.MAV_CMD_DO_GIMBAL_MANAGER_PITCHYAW,
                    mavlink.MAV_CMD_DO_SET_ROI_LOCATION, mavlink.MAV_CMD_DO_SET_ROI_NONE), result)
            case _:
                raise ValueError(state)

    @property
    def sent(self) -> str:
        """Return what was sent since the mark, without what repeats the one before."""
        words = (word(one) for _, one in self.rig.sent[self.marked:])
        return ' '.join(one for one, _ in itertools.groupby(filter(None, words)))

    @property
    def state(self) -> str:
        """Return the holder, and whether the gimbal may turn at a rate or to a place."""
        snapshot = self.rig.gimbal.snapshot(self.rig.now)
        turns = ('place' if snapshot.has_place else
                 'turns' if self.rig.gimbal.setpoints.may_turn else '')
        return ', '.join(filter(None, (snapshot.holder, turns)))


class Row(NamedTuple):
    """
    A script and its outcome.

    :param sent: the messages since the mark, None for any.
    :param state: at the end.
    :param answers: the beginnings of those to the requests since the mark.
    """

    script: str
    sent: str | None
    state: str
    answers: tuple[str, ...]
    options: dict[str, Any]


def row(script: str, sent: str | None, state: str = '', *answers: str, **options: Any) -> Row:
    return Row(script, sent, state, answers, {'shared': False, **options})


# A source holds the gimbal.
SHARED: dict[str, Any] = {'shared': True}
DENIED = 'manager 1/1 refused'
BY_SETPOINT = 'superseded by a setpoint'
BEING_RELEASED = 'control of gimbal 1/154 is being released'
ROWS: dict[str, Row] = {
    # A newer move ends the older one.
    'a pose ends the repeats of an attitude': row('level, mark, neutral, 3', 'neutral'),
    'an attitude ends those of another': row('level, 0.1, mark, down, 3', 'attitude -30'),
    'an attitude ends a pose': row(
        'manager mute, mark, neutral, 0.1, level, 3', 'neutral attitude 0', '', BY_SETPOINT),
    'a rate ends a pose': row(
        'manager mute, mark, neutral, 0.1, rate, 0.3', 'neutral rate', 'turns', BY_SETPOINT),
    'a place ends a pose': row(
        'manager mute, mark, neutral, 0.1, manager denies, manager answers, place, 3',
        'neutral place', '', 'superseded by point at 47', DENIED),
    'a pose ends a place': row(
        'manager mute, mark, place, 0.1, manager answers, neutral, 3', 'place neutral', '',
        'superseded by turn to neutral', 'neutral position, confirmed'),
    'no place ends a place': row(
        'manager mute, mark, place, 0.1, manager answers, clear, 3', 'place clear', '',
        'superseded by point at no place', 'MAV_RESULT_ACCEPTED'),
    'an attitude ends a place': row(
        'manager mute, mark, place, 0.1, manager answers, level, 3', 'place attitude 0', '',
        BY_SETPOINT),
    'a lock ends a place': row(
        'manager mute, mark, place, 0.1, manager answers, lock, 3', 'place zero+lock', '',
        'superseded by lock yaw', 'yaw locked, confirmed'),
    'a release ends a place': row(
        'manager mute, mark, place, 0.1, manager answers, give, 3', 'place zero control', '',
        'superseded by a release', 'control released'),
    'equal poses share an outcome': row(
        'mark, neutral, neutral, 3', 'neutral', '', *['neutral position, confirmed'] * 2),
    'a place of a call ends a place at once': row(
        'manager mute, mark, place, field, 0.1', 'place field', 'place',
        'superseded by point at 47.1'),
    'a place of a topic waits for the place under way': row(
        'manager mute, mark, place, topic field, 0.1, manager answers, 2', 'place field',
        'place', 'MAV_RESULT_ACCEPTED', 'MAV_RESULT_ACCEPTED'),
    'only the newest of a topic': row(
        'manager mute, mark, topic place, topic field, topic place, 0.1, manager answers, 2',
        'place', 'place', 'MAV_RESULT_ACCEPTED', 'superseded by point', 'MAV_RESULT_ACCEPTED'),
    'a setpoint ends one that waits': row(
        'manager mute, mark, place, topic field, manager answers, level, 3', 'place attitude 0',
        '', BY_SETPOINT, BY_SETPOINT),
    'a rate ends both, and ends': row(
        'manager mute, mark, topic place, topic field, rate, 1', 'place rate zero'),
    'after an attitude none of them counts': row(
        'manager mute, mark, topic place, topic field, level, 3', 'place attitude 0'),
    'a place of a topic ends a pose': row(
        'manager mute, mark, neutral, 0.1, manager answers, topic place, 3', 'neutral place',
        'place', 'superseded by point at 47'),
    # Repeated messages of topics.
    'an equal attitude that is shown is not sent': row(
        'level, 3, mark, level, 3', '', '', 'repeated'),
    'nor angles that leave axes': row('down, 3, mark, down, 3', ''),
    'also of a gimbal that is tilted': row(
        'down, 3, mark, down, 3', '', q=Quaternion.from_euler(0.13, -0.21, 0.37)),
    'it is sent after a rate': row('level, 3, rate, 0.1, zero, 3, mark, level, 1', 'attitude 0'),
    'after a pose': row('level, 3, neutral, 3, mark, level, 1', 'attitude 0'),
    'during a pose': row(
        'level, 3, manager mute, neutral, 0.1, mark, level, 1', 'attitude 0'),
    'after the lock': row('level, 3, lock, 3, mark, level, 1', 'attitude 0'),
    'after a loss of the device': row('level, 3, lose device, 3, mark, level, 1', 'attitude 0'),
    'after a loss of control': row(
        'level, 3, other, 1, ours, 1, mark, level, 1', 'attitude 0'),
    'after the end of its claim': row(
        'safety level, 3, frees safety, mark, safety level, 1', 'attitude 0', 'safety', **SHARED),
    'and of another source': row(
        'autonomy level, 3, mark, operator level, 1', 'attitude 0', 'operator', **SHARED),
    'but not after a refused pose': row(
        'level, 3, manager denies, neutral, 1, mark, level, 1', ''),
    # Axes that are left.
    'the last attitude counts before a refused place': row(
        'north, 0.1, level, 0.1, manager denies, place, 1, mark, down, 0.1', 'attitude -30'),
    # A rate ends.
    'with its time': row('mark, rate, 2', 'rate zero'),
    'with its user, though the zero is lost': row(
        'rate, 0.1, manager deaf, 20, mark, manager hears, 3', 'zero'),
    'with a zero that is lost': row(
        'rate, 0.1, manager deaf, zero, 20, mark, manager hears, 3', 'zero'),
    'with a lost zero, at once': row(
        'rate, 0.1, manager deaf, zero, mark, manager hears, 0.3', 'zero', lasts=30.0),
    'with an attitude that is lost': row(
        'rate, 0.1, manager deaf, level, 2, mark, manager hears, 3', 'attitude 0'),
    'with an attitude after a zero, though both are lost': row(
        'rate, 0.1, manager deaf, zero, level, 2, mark, manager hears, 3', 'attitude 0'),
    'with the release of its source': row(
        'safety rate, 0.1, manager deaf, frees safety, 20, mark, manager hears, 3', 'zero',
        **SHARED),
    'with the silence of its source': row(
        'safety rate, mark, 3', 'zero', timeout=1.0, lasts=30.0, **SHARED),
    'but not with a call or a message of a lower source': row(
        'safety rate, mark, autonomy neutral, autonomy rate, 0.2', '', 'safety, turns',
        'held by safety', 'held by safety', lasts=30.0, **SHARED),
    'with the call of a higher source': row(
        'autonomy rate, manager mute, mark, safety clear, 0.1', 'zero clear', 'autonomy',
        lasts=30.0, **SHARED),
    'before a pose': row('rate, mark, neutral, 3', 'zero neutral'),
    'before a place': row('rate, mark, place, 3', 'zero place', 'place'),
    'before no place': row('rate, mark, clear, 3', 'zero clear zero'),
    'before a pose after an attitude that may be lost': row(
        'rate, level, mark, neutral, 3', 'zero neutral'),
    'before the release after one': row(
        'safety rate, safety level, mark, frees safety, 1', 'zero', **SHARED),
    'when control is unknown': row(
        'rate, mark, cut, open, 2', 'zero', lasts=30.0),
    'also after an attitude': row('rate, level, mark, cut, open, 2', 'zero'),
    'but an attitude alone does not': row('level, mark, cut, open, 2', ''),
    'when the manager is lost, which may hear it': row(
        'rate, manager silent, mark, 4', 'zero', 'turns', lasts=30.0),
    'and when it is heard again': row(
        'rate, manager silent, 4, mark, manager heard, 2', 'zero', lasts=30.0),
    'and not again once the gimbal stands': row('rate, 2, mark, 10', ''),
    'but if a late rate turns it': row('rate, 0.9, mark, device turns, 3', 'zero'),
    'a zero is not sent while a request is under way': row(
        'rate, manager mute, clear, device turns, mark, 1.5', 'clear', 'turns'),
    'nor when the hold of another source ends meanwhile': row(
        'autonomy level, 0.2, safety rate, manager mute, safety clear, device turns, mark, 1.2',
        'clear', 'safety, turns', timeout=1.4, **SHARED),
    'it is after a refused pose': row(
        'manager denies, rate, neutral, device turns, mark, 3', 'zero'),
    'and after a refused place': row(
        'manager denies, rate, place, device turns, mark, 3', 'zero'),
    'and after no place': row('rate, clear, device turns, mark, 3', 'zero'),
    'but not after a pose': row(
        'rate, 0.1, neutral, 0.5, device turns, mark, 3', ''),
    'nor after a place': row('rate, 0.1, place, 0.1, device turns, mark, 3', '', 'place'),
    'nor after a pose that has replaced a refused place': row(
        'manager rejects, rate, 0.1, place, manager idles, manager accepts, neutral, '
        'device neutral, 0.5, device turns, mark, 3', ''),
    'it is after a place that has replaced a pose and is refused': row(
        'rate, 0.1, manager mute, neutral, manager answers, manager denies, place, '
        'device turns, mark, 3', 'zero'),
    'it is after a place without an answer': row(
        'rate, manager deaf, place, 6, mark, manager hears, 3', 'zero'),
    'also of two': row(
        'rate, manager deaf, place, 0.1, field, 6, mark, manager hears, 3', 'zero'),
    'a place without an answer is left where no rate was': row(
        'manager mute, mark, place, 6', 'place', 'place', 'no acknowledgement'),
    'a zero that has stopped the gimbal is not sent after a pose that fails': row(
        'rate, 3, manager idles, device turns, neutral, mark, 3', ''),
    # The yaw lock that rates keep.
    'as the device has it': row('device locked, 1, mark, rate, 0.1', 'rate+lock', 'turns'),
    'as an attitude before it': row(
        'manager idles, north, 0.1, mark, rate, 0.1', 'rate+lock', 'turns'),
    'as another attitude': row(
        'device locked, 1, manager idles, level, mark, rate, 0.1', 'rate', 'turns'),
    'as a request': row('manager idles, lock, mark, rate, 0.1', 'rate+lock', 'turns'),
    'as the newer request': row(
        'manager idles, level, lock, mark, rate, 0.1', 'rate+lock', 'turns'),
    'as the newer attitude': row(
        'manager idles, lock, level, mark, rate, 0.1', 'rate', 'turns'),
    'as a pose': row(
        'device locked, 1, manager idles, neutral, 0.3, mark, rate, 0.1', 'rate', 'turns'),
    'but not as a refused one': row(
        'device locked, 1, manager denies, neutral, 0.3, mark, rate, 0.1', 'rate+lock', 'turns'),
    # The yaw lock.
    'is a zero until it is shown': row(
        'manager idles, mark, lock, 0.7, manager obeys, 3', 'zero+lock', '',
        'yaw locked, confirmed'),
    'has its time': row(
        'manager idles, mark, lock, 3', 'zero+lock', '', 'yaw locked not confirmed'),
    'goes on beside a rate': row(
        'manager idles, mark, lock, 0.1, rate, manager obeys, rate, 0.3',
        'zero+lock rate+lock', 'turns', 'yaw locked, confirmed', lasts=30.0),
    'is not sent against it': row(
        'manager idles, mark, lock, 0.1, rate, 3', 'zero+lock rate+lock', 'turns',
        'yaw locked not confirmed', lasts=30.0),
    'nor against an attitude': row(
        'manager idles, mark, lock, 0.1, level, 3', 'zero+lock attitude 0', '',
        'yaw locked not confirmed'),
    'ends with a pose': row(
        'manager idles, mark, lock, 0.1, neutral, 0.5', 'zero+lock neutral', '',
        'superseded by turn to neutral'),
    'ends with a place': row(
        'manager idles, mark, lock, 0.1, place, 3', 'zero+lock place', 'place',
        'superseded by point'),
    'ends with its opposite': row(
        'manager idles, mark, unlock, lock, lock, manager obeys, 2', 'zero zero+lock', '',
        'superseded by lock yaw', *['yaw locked, confirmed'] * 2),
    # Sources.
    'a lower source is refused': row(
        'safety level, 3, mark, autonomy rate, neutral, topic place, 1', '', 'safety',
        *['held by safety'] * 3, **SHARED),
    'and holds the gimbal next, with what it sends then': row(
        'safety level, 3, autonomy down, mark, frees safety, 1', '', 'autonomy', **SHARED),
    'also after a silence': row(
        'safety level, 1, autonomy level, mark, 1.5', '', 'autonomy', timeout=2.0, **SHARED),
    'a higher source takes the gimbal': row(
        'autonomy rate, mark, safety down, 1', 'zero attitude -30', 'safety', **SHARED),
    'and ends the repeats of an attitude': row(
        'autonomy level, mark, safety zero, 3', 'zero', 'safety', **SHARED),
    'and what is under way': row(
        'manager mute, mark, autonomy lock, autonomy rate, autonomy place, 0.1, safety level, 3',
        'zero+lock rate+lock zero+lock place zero+lock attitude 0', 'safety',
        'superseded by point', 'sent', 'held by safety', **SHARED),
    'a topic leaves the call of its own source': row(
        'manager mute, mark, operator place, operator topic field, manager answers, 3',
        'place field', 'operator, place', *['MAV_RESULT_ACCEPTED'] * 2, **SHARED),
    'a place ends with the release of its source': row(
        'safety place, 1, mark, frees safety, 1', 'zero', **SHARED),
    'a place under way too': row(
        'manager mute, safety place, mark, frees safety, 1', 'zero', '', **SHARED),
    'with its silence': row('safety topic place, mark, 3', 'zero', timeout=1.0, **SHARED),
    'one under way with its silence': row(
        'manager mute, safety topic place, 0.5, mark, 0.6', 'place zero', timeout=1.0, **SHARED),
    'and with a call of a higher source': row(
        'autonomy topic place, 1, manager mute, mark, safety neutral, 0.1', 'zero neutral',
        'autonomy, turns', **SHARED),
    'a release ends a call, which claims nothing later': row(
        'manager idles, mark, neutral, frees default, device neutral, 1', 'neutral', '',
        'default has released', **SHARED),
    'also if its source holds': row(
        'level, manager idles, mark, neutral, frees default, device neutral, 1', 'neutral', '',
        'default has released', **SHARED),
    'a call goes on when a lower hold ends': row(
        'autonomy level, manager idles, mark, neutral, frees autonomy, device neutral, 1',
        'neutral', 'default', 'neutral position, confirmed', **SHARED),
    'and when its time is over': row(
        'autonomy level, 0.8, manager idles, mark, neutral, 0.4, device neutral, 0.5', 'neutral',
        'default', 'neutral position, confirmed', timeout=1.0, **SHARED),
    'a call that fails claims nothing': row(
        'manager denies, mark, safety neutral, 1', 'neutral', '', DENIED, **SHARED),
    'one that succeeds claims': row('safety neutral, 1', None, 'safety', **SHARED),
    'without sources all are alike': row(
        'safety level, mark, autonomy down, frees safety, 0.1', 'attitude -30'),
    # Control.
    'nothing is sent without it': row(
        'mark, level, down, rate, neutral, place, lock, 1', '', '',
        *['no control of gimbal 1/154: primary 1/195'] * 6, primary=OTHER),
    'nor where it is unknown': row(
        'mark, level, rate, place, 1', '', '',
        *['manager 1/1 has sent no GIMBAL_MANAGER_STATUS'] * 3, reports=False),
    'a release waits until the gimbal stands': row(
        'rate, manager deaf, mark, give, 1, manager hears, 1', 'zero control', '',
        'control released, confirmed'),
    'and fails if that is not shown': row(
        'rate, device mute, mark, give, 10', 'zero', 'turns',
        'no attitude shows that the gimbal stands, 5 s after a rate of zero: control is kept'),
    'and names the component that has taken control': row(
        'rate, device mute, mark, give, 1, other, 6', 'zero', 'turns',
        'no attitude shows that the gimbal stands, 5 s after a rate of zero: no control of'),
    'and if it still turns': row(
        'rate, manager deaf, mark, give, 5.1', 'zero', 'turns', 'the gimbal still turns'),
    'meanwhile nothing moves it': row(
        'rate, device mute, mark, give, 0.5, rate, level, down, neutral, place, 6', 'zero',
        'turns', 'no attitude shows', *[BEING_RELEASED] * 5),
    'a release stops a place': row('place, 1, mark, give, 1', 'zero control'),
    'also a place that was refused after it': row(
        'place, 1, manager denies, field, 1, mark, give, 1', 'zero control'),
    'one that a refused place has replaced': row(
        'manager mute, place, manager answers, manager denies, field, 3, mark, give, 1',
        'zero control'),
    'one without an answer': row(
        'manager mute, place, 6, manager answers, mark, give, 1', 'zero control'),
    'and a place before a failed pose': row(
        'place, 1, manager idles, manager mute, neutral, 6, manager answers, manager obeys, mark, '
        'give, 1', 'zero control'),
    'also while the pose is under way': row(
        'place, 1, manager mute, neutral, manager answers, mark, give, 1', 'zero control'),
    'and waits until the gimbal stands': row(
        'place, 1, manager deaf, device turns, mark, give, 1', 'zero', 'turns'),
    'but no attitude': row('level, 3, mark, give, 1', 'control'),
    'the end of the process sends a zero and a release': row(
        'rate, mark, close, give, 1', 'zero control', '', 'control released'),
    'a lost control ends what is under way': row(
        'manager mute, mark, place, lock, other, 1', 'place zero+lock', '', 'superseded',
        'no control of gimbal'),
    'a rate that another player left gets its zero later': row(
        'rate, other, 1, device turns, 2, mark, ours, 2', 'zero', ''),
    'also after two, where an attitude before them showed that it stood': row(
        'manager deaf, rate, 0.3, device turns, device mute, other, 0.3, nobody, 1, '
        'device reports, manager hears, mark, ours, 2', 'zero', lasts=30.0),
    'but not one that it has stopped': row(
        'rate, other, device turns, 2, device stands, 2, device turns, mark, ours, 3', ''),
    'nor one whose end was shown before': row(
        'rate, 1, other, 0.2, device turns, 1, mark, ours, 2', ''),
    'nor an attitude': row('level, other, device turns, 2, mark, ours, 2', ''),
    'nor a rate whose end was shown before the release': row(
        'rate, give, 2, device turns, mark, ours, 2', ''),
    'a gimbal that no zero has stopped gets one when control is back': row(
        'rate, manager deaf, 3, other, 1, mark, ours, manager hears, 1', 'zero'),
    'and at a release': row('rate, manager deaf, 3, mark, manager hears, give, 0.5',
                            'zero control'),
    'a gimbal that a killed process has left turning gets one': row('1', 'zero', rates=RATE),
    'one that it has left standing does not': row('1', ''),
    'a place of a lost manager is not followed after a release': row(
        'place, manager silent, 4, mark, give, 1', '', 'turns', 'gimbal 1/154 is not connected'),
    'a zero waits for a lost manager': row(
        'place, manager silent, 4, give, mark, 1, manager heard, 2', 'zero', '', lasts=30.0),
}


@pytest.mark.parametrize('name', ROWS)
def test_the_messages_to_the_gimbal_follow_from_the_script(name: str) -> None:
    script, sent, state, answers, options = ROWS[name]
    stage = Stage(**options)

    stage.play(script)

    assert (stage.sent if sent is not None else None, stage.state) == (sent, state)
    assert [one.result.message[:len(text)] for one, text in zip(
        stage.answers, answers, strict=False)] == [*answers]


# Steps in any order; ``SANE`` ends what keeps a zero from the gimbal.
STEPS = [f'{source}{move}' for source in ('safety ', 'autonomy ', '')
         for move in ('rate', 'rate', 'zero', 'level', 'down', 'topic place')] + [
    'neutral', 'lock', 'place', 'field', 'clear', 'take', 'give', 'frees safety', 'cut', 'open',
    'lose device', 'other', 'ours', 'nobody', 'device mute', 'device reports', *(
        f'manager {state}' for state in (
            'deaf', 'hears', 'silent', 'heard', 'mute', 'answers', 'denies', 'rejects',
            'accepts'))]
SANE = ('open, ours, device reports, manager hears, manager heard, manager answers, '
        'manager accepts, 30')


@pytest.mark.parametrize('seed', range(40))
def test_a_gimbal_stands_after_any_script(seed: int) -> None:
    draw = random.Random(seed)
    stage = Stage(shared=draw.random() < 0.5, timeout=draw.choice((2.0, 60.0)))

    for _ in range(30):
        stage.play(f'{draw.choice(STEPS)}, {draw.choice((0.0, 0.1, 0.4, 1.2))}')
    stage.play(SANE)

    assert stage.manager.rates == STILL


def test_a_release_tells_which_source_holds_the_gimbal_then() -> None:
    stage = Stage()
    stage.play('autonomy rate, safety rate')
    gimbal, now = stage.rig.gimbal, stage.rig.now

    assert gimbal.release('safety', now) == 'autonomy'
    assert gimbal.release('autonomy', now) == ''
