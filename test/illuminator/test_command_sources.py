# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Sources share a light: the highest that claims it holds it, and only its requests are sent."""

from __future__ import annotations

from collections.abc import Callable
import random

from illuminator_ros.illuminator.client import enable_all
from illuminator_ros.illuminator.events import AutomaticSwitch, DesiredStateFailed
from illuminator_ros.illuminator.model import SafetyLimits
from illuminator_ros.illuminator.settings import LightSettings
from illuminator_ros.mavlink.dialect import mavlink
from illuminator_ros.payload.arbitration import Cause
from illuminator_ros.payload.command_sources import SourceSettings
from illuminator_ros.payload.device_events import DeviceHeld
import pytest
from support.back_to_back import Pair
from support.fake_light import FakeLight
from support.records import Answer
from support.wire import Faults

ON_OFF, CONFIGURE = mavlink.MAV_CMD_ILLUMINATOR_ON_OFF, mavlink.MAV_CMD_DO_ILLUMINATOR_CONFIGURE
NAMES = ('safety', 'operator', 'default', 'autonomy')
TIMEOUT, SILENCE = 2.3, 6.0


class Shared:
    """A light that sources share, and their requests."""

    def __init__(self, *, light: FakeLight | None = None, timeout: float = TIMEOUT,
                 off_on_release: bool = False, seed: int = 0, **faults: float) -> None:
        self.light = light or FakeLight(brightness=50.0)
        self.pair = Pair(self.light, seed=seed, there=Faults(**faults), settings=LightSettings(
            sources=SourceSettings(NAMES, timeout), off_on_release=off_on_release,
            limits=SafetyLimits(max_brightness=80.0), off_after_silence=SILENCE))
        self.pair.run_until(lambda: self.pair.controller.lights)

    def enable(self, source: str, on: bool, *, is_stream: bool = True) -> Answer:
        answer = Answer(self.pair.now)
        self.pair.light.enable(
            on, self.pair.now, answer, source=source, is_stream=is_stream)
        self.pair.turn()
        return answer

    def call(self, source: str, on: bool) -> Answer:
        """Switch by a service, which does not repeat its request."""
        return self.enable(source, on, is_stream=False)

    def dim(self, source: str, brightness: float) -> None:
        self.pair.light.set_brightness(brightness, self.pair.now, source=source)
        self.pair.turn()

    def release(self, source: str) -> None:
        self.pair.light.release(source, self.pair.now)
        self.pair.turn()

    def take_over(self) -> float:
        """Let the highest source switch off and release; return the time of the release."""
        self.enable('safety', False)
        self.pair.run(1.0)
        released_at = self.pair.now
        self.release('safety')
        self.pair.run(1.0)
        return released_at

    @property
    def holder(self) -> str | None:
        return self.pair.snapshot.holder

    def sent(self, kind: int, since: float = 0.0) -> list[float]:
        return [command.param1 if kind is ON_OFF else command.param2
                for command in self.pair.commands(kind, since=since)]


def test_a_request_of_a_lower_source_is_refused_and_not_sent() -> None:
    shared = Shared()
    shared.enable('safety', False)
    shared.pair.run(1.0)
    sent = len(shared.pair.commands(ON_OFF))

    answer = shared.enable('autonomy', True)
    shared.dim('autonomy', 20.0)
    configured = shared.pair.ask_configure(brightness=30.0)

    assert (answer.result.success, answer.result.message) == (False, 'held by safety')
    assert configured.result.message == 'held by safety'
    assert (len(shared.pair.commands(ON_OFF)), shared.pair.commands(CONFIGURE)) == (sent, [])


def test_a_request_after_a_stop_finds_the_silent_source_gone_and_reports_that() -> None:
    shared = Shared()
    shared.enable('safety', True)
    shared.pair.run(1.0)
    shared.pair.now += TIMEOUT

    shared.enable('autonomy', False)
    shared.pair.run(1.0)

    holders = [event.change.after for event in shared.pair.recorder.others
               if isinstance(event, DeviceHeld)]
    assert (holders, shared.light.fields['enable']) == (['safety', None, 'autonomy'], 0)


@pytest.mark.parametrize('ask', [
    lambda shared: shared.call('default', True), lambda shared: shared.call('default', False),
    lambda shared: shared.pair.ask_configure(brightness=30.0)], ids=['on', 'off', 'set'])
@pytest.mark.parametrize(('before', 'sent', 'holder'), [
    (lambda shared: None, [], ''),
    (lambda shared: shared.enable('default', True), [1.0], 'default')], ids=['nothing', 'topic'])
def test_a_refused_call_leaves_nothing_behind_and_a_request_of_a_topic_stays(
    ask: Callable[[Shared], Answer], before: Callable[[Shared], object], sent: list[float],
    holder: str,
) -> None:
    shared = Shared(timeout=60.0)
    shared.enable('safety', False)
    shared.pair.run(1.0)
    before(shared)
    answer = ask(shared)
    assert answer.result.message == 'held by safety'
    released_at = shared.pair.now
    shared.release('safety')
    shared.pair.run(1.0)

    assert (shared.sent(ON_OFF, released_at), shared.sent(CONFIGURE)) == (sent, [])
    assert shared.holder == holder


def test_a_refused_call_keeps_no_light_on() -> None:
    shared = Shared(timeout=60.0)
    shared.pair.settle()
    shared.pair.wait_for(shared.enable('safety', True))
    shared.pair.run(SILENCE - 1.0)
    shared.call('autonomy', True)
    shared.pair.run(2.0)

    assert shared.light.fields['enable'] == 0


@pytest.mark.parametrize('result', [mavlink.MAV_RESULT_DENIED, None, 'lost'])
def test_a_call_that_fails_refuses_lower_sources_while_it_is_under_way_and_not_after_it(
    result: int | str | None,
) -> None:
    shared = Shared(timeout=60.0)
    shared.pair.settle()
    shared.pair.wait_for(shared.enable('operator', False))
    if result == 'lost':
        shared.pair.close()
    else:
        shared.light.results[ON_OFF] = result
    call = shared.call('safety', True)
    during = shared.call('default', False)
    assert during.result.message == ('held by operator' if result == 'lost' else 'held by safety')
    assert not shared.pair.wait_for(call).success
    shared.light.results.clear()
    shared.pair.open()
    shared.pair.run(0.5)
    assert shared.holder == 'operator'
    assert shared.pair.wait_for(shared.call('operator', False)).success


@pytest.mark.parametrize(('answer', 'sent'), [(mavlink.MAV_RESULT_ACCEPTED, [1.0]), (None, [])])
def test_of_two_calls_only_the_one_that_succeeded_before_a_takeover_is_sent_after_it(
    answer: int | None, sent: list[float],
) -> None:
    shared = Shared(timeout=60.0)
    shared.pair.settle()
    shared.light.results[ON_OFF] = answer
    call = shared.call('operator', True)
    shared.pair.run(0.3)
    assert bool(call.results) is bool(sent)
    shared.light.results.clear()
    released_at = shared.take_over()

    assert call.result.success is bool(sent)
    # The OFF of the higher source is repeated within the fence of the ON that it replaced.
    assert set(shared.sent(ON_OFF, released_at)) - {0.0} == set(sent)
    assert shared.holder == ('operator' if sent else '')


def test_a_call_of_off_that_fails_ends_the_on_that_was_kept_and_is_not_sent_later() -> None:
    shared = Shared(timeout=60.0)
    shared.pair.settle()
    shared.pair.wait_for(shared.enable('operator', True))
    shared.pair.close()
    assert not shared.call('operator', False).result.success
    shared.pair.open()
    shared.pair.run(1.0)
    released_at = shared.take_over()

    assert (shared.sent(ON_OFF, released_at), shared.holder) == ([], 'operator')


# The ends of the hold of ``safety``, each with the cause of the change of the holder.
ENDS: dict[Cause, Callable[[Shared], None]] = {
    Cause.RELEASE: lambda shared: shared.release('safety'),
    Cause.SILENCE: lambda shared: shared.pair.run(TIMEOUT - 0.9),
}


@pytest.mark.parametrize(('cause', 'end'), ENDS.items())
def test_the_state_that_the_next_source_requested_is_sent_once_when_the_hold_of_a_higher_one_ends(
        cause: Cause, end: Callable[[Shared], None]) -> None:
    shared = Shared()
    shared.enable('safety', False)
    shared.pair.run(1.0)
    shared.enable('autonomy', True)
    shared.dim('autonomy', 20.0)
    before = shared.pair.now
    end(shared)
    shared.pair.run(0.5)

    assert shared.holder == 'autonomy'
    assert (shared.sent(ON_OFF, before), shared.sent(CONFIGURE, before)) == ([1.0], [20.0])
    [held] = [one.change for one in shared.pair.recorder.others
              if isinstance(one, DeviceHeld)][-1:]
    assert (held.before, held.after, held.cause) == ('safety', 'autonomy', cause)


@pytest.mark.parametrize(('before', 'while_lost', 'sent'), [
    (None, True, []), (True, True, [1.0]), (True, False, [0.0]), (False, True, [0.0])])
def test_of_the_requests_to_a_lost_light_only_an_off_has_an_effect_later(
    before: bool | None, while_lost: bool, sent: list[float],
) -> None:
    shared = Shared(timeout=60.0)
    if before is not None:
        shared.enable('autonomy', before)
        shared.pair.run(1.0)
    shared.light.silent = True
    shared.pair.run_until(lambda: not shared.pair.light.connected)
    assert not shared.enable('autonomy', while_lost).result.success
    shared.dim('autonomy', 20.0)
    shared.light.silent = False
    shared.pair.run(2.0)
    released_at = shared.take_over()

    assert shared.sent(ON_OFF, released_at) == sent
    assert shared.sent(CONFIGURE) == []


@pytest.mark.parametrize(('off', 'enabled'), [(False, 1), (True, 0)])
def test_a_light_that_no_source_holds_stays_or_goes_off_as_configured(
        off: bool, enabled: int) -> None:
    shared = Shared(off_on_release=off)
    shared.enable('operator', True)
    shared.pair.run(1.0)
    shared.release('operator')
    shared.pair.run(2.0)

    assert shared.holder == ''
    assert shared.light.fields['enable'] == enabled


def test_an_on_under_way_is_answered_though_its_source_releases_the_light() -> None:
    shared = Shared()
    shared.pair.settle()
    answer = shared.enable('operator', True)
    shared.release('operator')

    assert shared.pair.wait_for(answer).success


def test_an_off_under_way_is_resent_though_its_source_releases_the_light() -> None:
    shared = Shared(light=FakeLight(brightness=50.0, enable=1))
    shared.pair.settle()
    shared.light.results[ON_OFF] = [None, mavlink.MAV_RESULT_ACCEPTED]
    answer = shared.enable('operator', False)
    shared.release('operator')

    assert shared.pair.wait_for(answer).success
    assert shared.light.fields['enable'] == 0


def _switch_on_unseen(shared: Shared) -> None:
    """Let another sender switch on, so that the status that shows it comes after the release."""
    shared.light.stream = 0.0
    shared.light.fields['enable'] = 1


@pytest.mark.parametrize('act', [lambda shared: None, _switch_on_unseen], ids=['off', 'unseen on'])
def test_the_off_of_a_release_is_sent_whatever_was_shown_last(
    act: Callable[[Shared], object],
) -> None:
    shared = Shared(off_on_release=True)
    shared.pair.settle()
    shared.pair.wait_for(shared.enable('operator', False))
    shared.pair.run(1.0)
    act(shared)
    released_at = shared.pair.now
    shared.release('operator')
    shared.pair.run(1.0)

    assert (shared.sent(ON_OFF, released_at), shared.light.fields['enable']) == ([0.0], 0)


@pytest.mark.parametrize(('is_switch', 'act'), [
    (False, lambda shared: shared.enable('operator', True)),
    (False, lambda shared: shared.pair.wait_for(shared.enable('operator', True))),
    (True, lambda shared: shared.pair.ask_configure(brightness=20.0)),
], ids=['under way', 'not confirmed', 'brightness that is the switch'])
def test_a_light_that_may_go_on_after_its_release_goes_off_where_release_is_off(
    is_switch: bool, act: Callable[[Shared], object],
) -> None:
    shared = Shared(off_on_release=True)
    light = shared.light
    light.brightness_is_switch = is_switch
    shared.pair.settle()
    if is_switch:
        light.fields |= {'enable': 0, 'brightness': 0.0}
        shared.pair.run(1.0)
    light.apply_after, light.pushes = 1.2, True
    act(shared)
    released_at = shared.pair.now
    shared.release('operator')
    shared.pair.run(8.0)

    assert light.fields['enable'] == 0
    assert 0.0 in shared.sent(ON_OFF, released_at)


@pytest.mark.parametrize(('end', 'is_stream'), [
    (lambda shared: shared.release('operator'), True),
    (lambda shared: shared.release('operator'), False),
    (lambda shared: shared.pair.run(TIMEOUT), True),
], ids=['release', 'release during a call', 'source_timeout'])
def test_an_on_under_way_ends_with_the_hold_of_its_source_where_release_is_off(
    end: Callable[[Shared], None], is_stream: bool,
) -> None:
    shared = Shared(off_on_release=True)
    shared.pair.settle()
    shared.light.results[ON_OFF] = None
    shared.enable('operator', False)
    answer = shared.enable('operator', True, is_stream=is_stream)
    end(shared)
    shared.light.results.clear()
    shared.pair.run(4.0)

    assert not answer.result.success
    assert (shared.light.fields['enable'], shared.holder) == (0, '')


def test_an_on_of_a_call_goes_on_when_the_hold_of_a_lower_source_ends() -> None:
    shared = Shared(off_on_release=True)
    shared.pair.settle()
    shared.enable('autonomy', False)
    shared.pair.run(TIMEOUT - 0.1)
    shared.light.results[ON_OFF] = None
    answer = shared.call('operator', True)
    shared.pair.run(0.5)
    assert shared.holder == ''
    shared.light.results.clear()

    assert shared.pair.wait_for(answer).success
    shared.pair.run(2.0)
    assert (shared.light.fields['enable'], shared.holder) == (1, 'operator')


@pytest.mark.parametrize('off', [False, True])
def test_a_release_ends_the_calls_of_its_source_and_then_decides(off: bool) -> None:
    shared = Shared(off_on_release=off)
    shared.light.apply_after = 0.2
    shared.pair.settle()
    answer = shared.call('operator', True)
    shared.release('operator')
    shared.pair.run(4.0)

    assert (answer.result.success, answer.result.message) == (False, 'released by operator')
    assert off is any(one.reason.startswith('on_release') for one in shared.pair.recorder.others
                      if isinstance(one, AutomaticSwitch))
    assert shared.holder == ''
    assert shared.pair.wait_for(shared.call('autonomy', False)).success
    # The release is reported, too, since the call had taken the light.
    assert [event.change.after for event in shared.pair.recorder.others
            if isinstance(event, DeviceHeld)] == [None, 'autonomy']


def test_an_off_after_a_released_call_holds_the_light_though_that_call_ends_later() -> None:
    shared = Shared(timeout=60.0)
    shared.light.apply_after = 0.2
    shared.pair.settle()
    shared.call('safety', True)
    shared.release('safety')
    assert shared.pair.wait_for(shared.call('safety', False)).success
    refused = shared.call('autonomy', True)
    shared.pair.run(3.0)

    assert refused.result.message == 'held by safety'
    assert (shared.holder, shared.light.fields['enable']) == ('safety', 0)


def test_an_off_that_a_call_under_way_refuses_is_sent_when_the_call_has_failed() -> None:
    shared = Shared(light=FakeLight(enable=1))
    shared.pair.settle()
    shared.light.results[CONFIGURE] = mavlink.MAV_RESULT_DENIED
    configured = shared.pair.ask_configure(brightness=30.0)
    off = shared.enable('autonomy', False)
    shared.pair.run(1.0)

    assert (configured.result.success, off.result.message) == (False, 'held by default')
    assert (shared.light.fields['enable'], shared.holder) == (0, 'autonomy')


def test_a_call_that_fails_repeats_no_off_that_another_sender_has_undone() -> None:
    shared = Shared(timeout=60.0)
    shared.pair.settle()
    assert shared.pair.wait_for(shared.enable('autonomy', False)).success
    shared.light.fields['enable'] = 1
    shared.pair.run(1.0)
    shared.light.results[CONFIGURE] = mavlink.MAV_RESULT_DENIED
    assert not shared.pair.wait_for(shared.pair.ask_configure(brightness=30.0)).success
    shared.pair.run(1.0)

    assert (shared.light.fields['enable'], shared.holder) == (1, 'autonomy')


def test_a_message_that_is_not_sent_claims_no_light() -> None:
    shared = Shared(timeout=60.0)
    shared.pair.settle()
    shared.pair.close()
    shared.enable('safety', True)
    shared.pair.open()
    shared.pair.run(1.0)

    assert shared.holder == ''
    assert shared.pair.wait_for(shared.call('operator', False)).success


def test_the_off_of_a_release_outlives_a_call_that_fails_with_the_link() -> None:
    shared = Shared(off_on_release=True, timeout=60.0)
    shared.pair.settle()
    shared.pair.wait_for(shared.enable('operator', True))
    shared.light.results[ON_OFF] = mavlink.MAV_RESULT_FAILED
    shared.release('operator')
    shared.pair.run(0.5)
    shared.call('autonomy', True)
    shared.pair.close()
    shared.light.results.clear()
    shared.pair.open()
    shared.pair.run(3.0)

    assert (shared.holder, shared.light.fields['enable']) == ('', 0)


def test_an_off_of_the_next_source_is_sent_when_the_light_is_heard_again() -> None:
    shared = Shared(timeout=4.0)
    shared.pair.settle()
    assert shared.pair.wait_for(shared.enable('safety', True)).success
    shared.pair.run(2.0)
    shared.enable('autonomy', False)
    shared.pair.close()
    shared.pair.run(3.0)
    assert shared.holder == 'autonomy'
    shared.pair.open()
    shared.pair.run(1.0)

    assert shared.light.fields['enable'] == 0


def test_a_request_replaces_the_off_of_a_release_that_is_not_confirmed() -> None:
    shared = Shared(off_on_release=True)
    shared.pair.settle()
    shared.pair.wait_for(shared.enable('operator', True))
    shared.light.results[ON_OFF] = mavlink.MAV_RESULT_DENIED
    shared.release('operator')
    shared.pair.run(1.1)
    shared.light.results.clear()
    requested_at = shared.pair.now
    assert shared.pair.wait_for(shared.call('default', True)).success
    shared.pair.run(1.0)
    assert set(shared.sent(ON_OFF, requested_at)) == {1.0}


def test_values_that_wait_when_a_light_is_released_do_not_switch_it_on_later() -> None:
    shared = Shared(off_on_release=True, timeout=60.0)
    light, pair = shared.light, shared.pair
    light.brightness_is_switch = True
    pair.settle()
    light.fields['enable'] = 1
    pair.run(1.0)
    light.fields |= {'enable': 0, 'brightness': 0.0}
    pair.run(1.0)
    pair.wait_for(shared.enable('operator', False))
    light.results[CONFIGURE] = None
    pair.light.require({'brightness': 20.0}, pair.now)
    # The second try of the values was sent 2.4 s ago, and the third one is due in 0.3 s.
    pair.run(4.4)
    shared.release('operator')
    light.results.clear()
    pair.run(1.0)

    assert light.fields['enable'] == 0


def test_an_off_at_a_release_is_repeated_though_a_source_that_dims_takes_the_light() -> None:
    shared = Shared(off_on_release=True, timeout=60.0)
    shared.pair.settle()
    shared.pair.wait_for(shared.enable('operator', True))
    shared.light.results[ON_OFF] = mavlink.MAV_RESULT_FAILED
    shared.release('operator')
    shared.pair.run(0.5)
    shared.dim('autonomy', 20.0)
    shared.light.results.clear()
    shared.pair.run(3.0)

    assert (shared.holder, shared.light.fields['enable']) == ('autonomy', 0)


@pytest.mark.parametrize(('is_stream', 'sent'), [(True, [0.0]), (False, [])])
def test_an_off_for_all_lights_ends_a_remembered_on_of_a_lost_light(
    is_stream: bool, sent: list[float],
) -> None:
    shared = Shared(timeout=60.0)
    shared.enable('default', True)
    shared.pair.run(1.0)
    shared.pair.close()
    enable_all([shared.pair.light], False, shared.pair.now, Answer(0.0), name=str,
               is_stream=is_stream)
    shared.pair.open()
    shared.pair.run(1.0)
    released_at = shared.take_over()

    assert shared.sent(ON_OFF, released_at) == sent


@pytest.mark.parametrize(('is_switch', 'act', 'sent'), [
    (False, lambda shared: shared.enable('operator', True), []),
    (False, lambda shared: shared.enable('operator', False), [0.0]),
    (True, lambda shared: shared.dim('operator', 20.0), []),
], ids=['on', 'off', 'brightness that is the switch'])
@pytest.mark.parametrize('then', ['nothing', 'a request', 'another sender'])
def test_only_an_off_of_the_requests_before_a_silence_has_an_effect_after_it(
    is_switch: bool, act: Callable[[Shared], object], sent: list[float], then: str,
) -> None:
    shared = Shared(timeout=60.0)
    shared.light.brightness_is_switch = is_switch
    shared.pair.settle()
    for on in (True, False, True):
        shared.enable('safety', on)
        shared.pair.run(2.0)
    act(shared)
    shared.pair.run(SILENCE + 1.0)
    assert shared.light.fields['enable'] == 0
    # Neither a request after the silence nor another sender's ON restores those before it.
    if then == 'a request':
        shared.enable('autonomy', True)
    elif then == 'another sender':
        # A change soon after a configuration counts as its effect.
        shared.pair.run(40.0)
        shared.light.fields |= {'enable': 1, 'brightness': 50.0}
        shared.pair.run(1.5)
        shared.light.fields |= {'enable': 0, 'brightness': 0.0 if is_switch else 50.0}
        shared.pair.run(1.5)
    released_at = shared.pair.now
    shared.release('safety')
    shared.pair.run(1.0)

    assert shared.holder == 'operator'
    assert (shared.sent(ON_OFF, released_at), shared.light.fields['enable']) == (sent, 0)


@pytest.mark.parametrize('beats', [True, False])
def test_a_light_that_restarts_on_after_its_source_fell_silent_goes_off_where_release_is_off(
    beats: bool,
) -> None:
    shared = Shared(off_on_release=True)
    # Its status comes first then.
    shared.light.beats = beats
    shared.enable('operator', True)
    shared.pair.close()
    shared.pair.run(TIMEOUT + 1.0)
    shared.light.restart(shared.pair.now, enable=1)
    shared.pair.open()
    shared.pair.run(5.0)

    assert shared.light.fields['enable'] == 0


@pytest.mark.parametrize(('on', 'shone'), [(True, [20.0]), (False, [50.0])])
def test_the_brightness_that_the_next_source_requested_is_sent_before_its_on_and_with_its_off(
    on: bool, shone: list[float],
) -> None:
    shared = Shared()
    shared.pair.settle()
    shared.enable('safety', not on)
    shared.enable('operator', on)
    shared.dim('operator', 20.0)
    shared.pair.run(1.0)
    shared.release('safety')
    shared.pair.run(1.0)

    assert shared.light.shone == shone
    assert (shared.light.fields['enable'], shared.light.fields['brightness']) == (on, 20.0)


def test_the_brightness_before_an_off_is_not_sent_with_it_where_that_is_the_switch() -> None:
    light = FakeLight(brightness=50.0)
    light.brightness_is_switch = True
    shared = Shared(light=light, timeout=60.0)
    shared.pair.settle()
    shared.dim('operator', 20.0)
    shared.pair.run(1.0)
    shared.enable('operator', False)
    shared.pair.run(1.0)
    shared.enable('safety', True)
    shared.pair.run(1.0)
    shared.release('safety')
    shared.pair.run(5.0)

    assert light.fields['enable'] == 0


@pytest.mark.parametrize('act', [
    lambda shared: shared.release('safety'), lambda shared: None], ids=['release', 'nothing'])
def test_neither_a_release_nor_the_state_that_is_sent_for_a_source_counts_as_a_request(
    act: Callable[[Shared], None],
) -> None:
    shared = Shared(timeout=SILENCE + 2.0)
    shared.pair.settle()
    shared.enable('safety', False)
    shared.pair.run(3.0)
    shared.enable('operator', True)
    requested_at = shared.pair.now
    while shared.pair.now < requested_at + SILENCE + 1.5:
        shared.pair.run(0.5)
        act(shared)

    assert shared.light.fields['enable'] == 0


def test_a_takeover_ends_the_requests_of_the_lower_source_and_their_resends() -> None:
    shared = Shared(light=FakeLight(
        brightness=50.0, results={ON_OFF: None, CONFIGURE: None}))
    shared.pair.settle()
    answer = shared.enable('autonomy', True)
    shared.dim('autonomy', 20.0)
    taken_over_at = shared.pair.now
    shared.dim('operator', 40.0)
    assert shared.pair.recorder.failed_setpoints == []
    shared.pair.run(1.5)

    assert answer.result.message == 'held by operator'
    assert shared.sent(ON_OFF, taken_over_at + 0.01) == []
    assert set(shared.sent(CONFIGURE, taken_over_at + 0.01)) == {40.0}


def test_a_requested_state_that_the_light_refuses_is_reported() -> None:
    shared = Shared()
    shared.enable('safety', False)
    shared.pair.run(1.0)
    shared.enable('autonomy', True)
    shared.light.results[ON_OFF] = mavlink.MAV_RESULT_DENIED
    shared.release('safety')
    shared.pair.run(1.0)

    assert [one.source for one in shared.pair.recorder.others
            if isinstance(one, DesiredStateFailed)] == ['autonomy']


class Model:
    """An independent, simple implementation of the rules."""

    def __init__(self) -> None:
        self.heard: dict[str, float] = {}

    def expire(self, now: float) -> None:
        self.heard = {name: at for name, at in self.heard.items() if now < at + TIMEOUT}

    @property
    def holder(self) -> str:
        return min(self.heard, key=NAMES.index, default='')


@pytest.mark.parametrize('seed', range(60))
def test_the_highest_source_wins_within_one_turn_and_only_its_requests_are_sent(seed: int) -> None:
    draw = random.Random(seed)
    shared = Shared(seed=seed, drop=draw.choice((0.0, 0.3)), duplicate=draw.choice((0.0, 0.2)),
                    delay=draw.choice((0.0, 0.3)), reorder=0.1)
    pair, model = shared.pair, Model()
    pair.run_until(lambda: pair.snapshot.configuration)
    # Each source has brightnesses of its own, which identify its frames.
    of_source = {name: 10.0 * (index + 1) for index, name in enumerate(NAMES)}
    desired: dict[str, list[bool]] = {name: [] for name in NAMES}
    alive = dict.fromkeys(NAMES, True)
    allowed, checked, last_heard = '', len(pair.near.sent), pair.now

    for _ in range(120):
        source = draw.choice(NAMES)
        act = draw.choices(('enable', 'dim', 'release', 'die', 'revive', 'wait'),
                           (6, 6, 2, 1, 1, 4))[0]
        if act in ('die', 'revive'):
            alive[source] = act == 'revive'
        elif alive[source] and act != 'wait':
            model.expire(pair.now)
            if act == 'release':
                model.heard.pop(source, None)
            else:
                last_heard = model.heard[source] = pair.now
            if act == 'enable':
                desired[source].append(on := draw.random() < 0.5)
                shared.enable(source, on)
            elif act == 'dim':
                shared.dim(source, of_source[source] + draw.randrange(9))
            else:
                shared.release(source)
        until = pair.now + draw.choice((0.0, 0.05, 1.0, 3.0)) * draw.random()
        while True:
            model.expire(pair.now)
            assert shared.holder == model.holder
            # A light that no source holds keeps the state requested by the last one.
            allowed = model.holder or allowed
            for at, message in pair.near.sent[checked:]:
                command = getattr(message, 'command', None)
                if command == CONFIGURE:
                    assert message.param2 // 10 == of_source[allowed] // 10, (at, allowed)
                elif command == ON_OFF:
                    silent = at >= last_heard + SILENCE and not message.param1
                    assert silent or bool(message.param1) in desired[allowed], (at, allowed)
            checked = len(pair.near.sent)
            if not pair.step(until):
                break

    pair.mend()
    pair.run(SILENCE + 5.0)
    assert shared.light.fields['enable'] == 0
