# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The commands between what is wanted of a light and what it shows."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
import math

from . import events
from .commands import Configure, OFF, ON, SWITCHES
from .decide import decide, Goals
from .model import FIELDS, Status
from .rules import Rules
from .twin import IMPLIED_TIME, OwnCommands, Twin
from .user_requests import not_reported
from ..payload.attempt import Change, Served, Target
from ..payload.device_property import plan_of, Property
from ..payload.requests import Goal, Request, Requests, Result, WEAK, Why


def _is_left_out(one: Request, goal: Goal, name: str) -> bool:
    """Return whether a field of a rule waits until the light is on."""
    return (name == 'brightness' and not goal.values.brightness
            and bool(one.values[name]) and one.why in WEAK)


def plan_configuration(goal: Goal) -> tuple[Change[Status], Mapping[Request, Change[Status]]]:
    """Return the command of a goal of the configuration, and what each request asks of it."""
    asked: dict[Request, list[str]] = {one: [
        name for name in FIELDS if name in one.values and not _is_left_out(one, goal, name)
        or goal.note and name == 'strobe_duty_cycle' and 'strobe_period' in one.values]
        for one in goal.serves}
    whole = [name for name in FIELDS if any(name in names for names in asked.values())]
    return Configure.whole(goal.values, whole), {
        one: Configure.part(goal.values, names, goal.note) for one, names in asked.items()}


class LightControl:
    """
    Sends one light what is wanted of it, and ends the requests that it shows. Times are s.

    No I/O. :meth:`step` is the only method that sends what is wanted; to run it again changes
    nothing.

    :param emit: takes the events.
    :ivar switch: the switch of the light, and ``configuration``, its other fields.
    """

    def __init__(
        self, target: Target, requests: Requests, twin: Twin, rules: Rules,
        emit: Callable[[events.LightEvent], None],
    ) -> None:
        self._target = target
        self._requests = requests
        self._twin = twin
        self._rules = rules
        self._emit = emit
        self.switch: Property[Status] = Property(
            target, plan_of(lambda goal: SWITCHES[bool(goal.values)]))
        self.configuration: Property[Status] = Property(target, plan_configuration)
        # Takes the results of the OFF at the end of the process.
        self._report: Callable[[Result, float], None] | None = None

    # The step

    def step(self, now: float) -> None:
        """Decide what the light should be, send it, and go on with what is under way."""
        self._rules.put_due(now, self.silence_due(now))
        live = self._requests.live()
        if not live and not self.is_busy:
            return
        self._rules.check_range(live)
        goals = self._decide(live, now)
        switch = goals.switch
        if (switch is not None and not switch.values and not self.switch.is_under_way(OFF)
                and self._twin.brightness_is_switch is not False):
            self._end_configuration(now)
            goals = self._decide(self._requests.live(), now)
        # First the configuration, so that an ON finds it.
        if self._steer(self.configuration, goals.configuration, now):
            self._rules.sent(now)
        if self._steer(self.switch, goals.switch, now) and self._report is None:
            self._tell_automatic('')
        attempt = self.switch.attempt
        failure = attempt.failure() if attempt is not None and attempt.goal.insists else ''
        for one in self._requests.overdue(now):
            if 'enabled' in one.values:
                self._requests.end(one, Result(False, failure or (
                    'off not confirmed: no answer to an earlier OFF, which is sent again')), now)
        if failure:
            if self._report is None:
                self._tell_automatic(failure)
            else:
                self._report(Result(False, failure), now)

    def _decide(self, live: list[Request], now: float) -> Goals:
        goals = decide(live, self._twin.shown, self._rules.settings.limits, now)
        if not goals.missing or goals.configuration is None:
            return goals
        text = not_reported(goals.missing)
        for one in goals.configuration.serves:
            if one.why in WEAK:
                self._rules.failed(one, f'{", ".join(one.values)} not sent: {text}', now)
            else:
                self._requests.end(one, Result(False, text), now)
        return goals._replace(configuration=None)

    def _end_configuration(self, now: float) -> None:
        """End what an OFF must not be followed by, where the brightness may be the switch."""
        text = 'superseded by off'
        for one in self._requests.live():
            if (one.why is Why.REQUEST and 'enabled' not in one.values
                    and (one.is_call or one.since < now)):
                self._requests.end(one, Result(False, text, superseded=True), now)
        self._withdrawn(self.configuration.withdraw(text, now), now)
        self.switch.fence_until(self.configuration.fence_ends_at)

    def _steer(self, prop: Property[Status], goal: Goal | None, now: float) -> bool:
        """Have a goal under way; return whether a command was begun."""
        before = prop.attempt
        if before is not None and self._requests.of_commander(before.serves) != before.serves:
            self._withdrawn(prop.withdraw('held by another source', now), now)
        served = prop.steer(goal, now, self._twin.status, self._twin.order.gap)
        if prop.attempt is before:
            return False
        self._withdrawn(served, now)
        return prop.attempt is not None

    def _tell_automatic(self, failure: str) -> None:
        """Report an automatic OFF, and once why it is not confirmed."""
        attempt = self.switch.attempt
        rule = next((one for one in attempt.goal.serves if one.why is not Why.REQUEST), None
                    ) if attempt is not None else None
        if rule is not None and not rule.failure:
            rule.failure = failure
            self._emit(events.AutomaticSwitch(self._target.address, False, rule.detail, failure))

    def _withdrawn(self, served: Iterable[Served[Status]], now: float) -> None:
        """Take the requests of a command that is sent no more; those that stand stay wanted."""
        for one in served:
            if one.request not in self._requests.standing:
                self._requests.end(one.request, one.result, now)
        self._note_failure(now)

    # Requests

    def cancel(self, text: str, now: float) -> None:
        """Send nothing any more of what is under way: the light is lost, or the process ends."""
        for prop in self.switch, self.configuration:
            self._withdrawn(prop.withdraw(text, now), now)

    def cancel_configuration(self, now: float) -> None:
        """Send no configuration again that is beyond the limits, or that a limit has asked for."""
        attempt = self.configuration.attempt
        if attempt is None:
            return
        goal, limits = attempt.goal.values, self._rules.settings.limits
        if (limits.clipped(goal, self._twin.strobe_range) != goal
                or not any(one.why is Why.REQUEST for one in attempt.goal.serves)):
            self._withdrawn(self.configuration.withdraw('a limit was changed', now), now)

    def switch_off_finally(self, now: float, report: Callable[[Result, float], None]) -> None:
        """Report the results of the OFF at the end of the process."""
        self._report = report
        self._rules.want_off()
        is_fenced = now < self.switch.fence_ends_at
        report(Result(False, 'sent, not confirmed' if is_fenced else ''), now)

    # Known facts

    @property
    def is_busy(self) -> bool:
        """Whether a command is under way."""
        return self.switch.is_busy or self.configuration.is_busy

    def is_settled(self, now: float) -> bool:
        """Return whether a status that shows nothing new has no effect."""
        twin = self._twin
        return (not self.is_busy and not self._requests.live() and twin.is_told
                and not twin.changing.are_changing
                and self.switch.unconfirmed(now) is None
                and self.configuration.unconfirmed(now) is None
                and not (twin.failure.text or self._rules.limits.exceeded.excess))

    def may_go_off(self, now: float) -> bool:
        """Return whether the light is on, or may go on by an ON, and no OFF is under way."""
        return self._may_be_switched_on(now) and not self.switch.is_under_way(OFF)

    def may_be_on(self, now: float) -> bool:
        """Return whether the light is on, or may go on by a command of ours that was sent."""
        return self._may_be_switched_on(now) or self._may_light_up(now)

    def _may_be_switched_on(self, now: float) -> bool:
        switch, enabled = self.switch, self._twin.enabled
        return bool(enabled or self.switch.is_under_way(ON) or switch.unconfirmed(now) == ON
                    and (enabled is None or now < switch.fence_ends_at))

    def _may_light_up(self, now: float) -> bool:
        """Return whether a configuration of ours may have switched the light on."""
        return bool(self._twin.brightness_is_switch) and (
            self.configuration.is_busy or now <= self.configuration.sent_at + IMPLIED_TIME)

    def _is_late(self, now: float) -> bool:
        """Return whether a command of ours that ended unconfirmed asked for the present state."""
        enabled = self._twin.enabled
        return enabled is not None and self.switch.unconfirmed(now) == SWITCHES[enabled]

    def _note_failure(self, now: float) -> None:
        """Note that a command has ended unconfirmed."""
        if self._twin.is_off_by_heat and self.switch.unconfirmed(now) == ON:
            # It may light up once it has cooled down.
            self._twin.enabled = None
        elif self._is_late(now):
            self._twin.tell(events.LATE_EFFECT)

    # Reports

    def expects(self, status: Status) -> bool:
        """Return whether a status shows what a command under way changes."""
        return self.switch.expects(status) or self.configuration.expects(status)

    def may_cause(self, now: float) -> bool:
        """Return whether a command of ours may have caused what a status shows."""
        switch, configuration = self.switch, self.configuration
        return self.is_busy or (
            now <= max(switch.sent_at, configuration.sent_at) + IMPLIED_TIME)

    def reported(self, status: Status, now: float) -> None:
        """Take a status that is not older than those before."""
        twin, switch, configuration = self._twin, self.switch, self.configuration
        gap, unconfirmed = twin.order.gap or 0.0, configuration.unconfirmed(now)
        sent_at = max(switch.sent_at, -math.inf if unconfirmed else configuration.sent_at)
        ours = OwnCommands(self.configuration.is_busy, unconfirmed, sent_at + IMPLIED_TIME)
        before, was_off_by_heat = twin.enabled, twin.is_off_by_heat
        twin.update(status)
        # Before the properties receive the status, which ends what was unconfirmed.
        origin = (events.LATE_EFFECT if self._is_late(now) else
                  events.A_REQUEST if self._may_light_up(now) else events.OTHER_SENDER)
        is_idle = not switch.is_busy and not twin.changing.are_changing
        if twin.enabled and is_idle and not was_off_by_heat and (
                before is None or not before and origin == events.OTHER_SENDER):
            # Another sender has switched it on, or it was on when it was found.
            self._rules.note_request(now)
        served = self._serve(switch, switch.reported(status, gap, now), now)
        if not served and switch.attempt is None and (
                twin.enabled is not before or not twin.is_told):
            twin.tell(origin if twin.may_tell else '')
        self._serve(configuration, configuration.reported(status, gap, now), now)
        self._compare(status, ours, now)

    def _compare(self, status: Status, ours: OwnCommands, now: float) -> None:
        """Compare a status with what was agreed, with the rules, and with the limits."""
        twin, rules, was_agreed = self._twin, self._rules, self._twin.agreed is not None
        weak = rules.weak
        if weak and was_agreed and not ours.is_busy:
            rules.drop_shown(status)
        twin.compare(rules.waiting if weak else (), ours)
        if weak and not was_agreed and twin.agreed is not None:
            for one in weak:
                one.not_before = min(one.not_before, now)
        rules.keep_limits(now, is_busy=self.configuration.is_busy)

    def restarted(self, status: Status, now: float) -> None:
        """Take the first status after a restart, which confirms nothing."""
        if not self._rules.settings.restore_configuration:
            # Its command would bring back the fields that no request asks for.
            self._withdrawn(self.configuration.withdraw('the light restarted', now), now)
        attempt, wanted = self.configuration.attempt, self._twin.agreed
        self._rules.restore({} if wanted is None else {
            name: getattr(wanted, name) for name in FIELDS if name != 'mode' or wanted.mode}, now)
        for prop in self.switch, self.configuration:
            prop.restarted(status, now)
        self._twin.restarted(status)
        self._compare(status, OwnCommands(is_busy=attempt is not None), now)

    # Results

    def _serve(self, prop: Property[Status], ended: list[Served[Status]], now: float) -> bool:
        """Take the requests that a command has ended; return whether there are any."""
        for served in ended:
            if prop is self.switch:
                self._switched(served, now)
            else:
                self._configured(served, now)
        for one in self._requests.live() if ended and prop.attempt is None else ():
            # A call for the same values that has no time to wait for another command.
            if (one.is_call and one.values == ended[-1].request.values
                    and now + self._target.commands.timeout > one.deadline):
                self._requests.end(one, ended[-1].result, now)
        return bool(ended)

    def _switched(self, served: Served[Status], now: float) -> None:
        one, result, on = served.request, served.result, served.change == ON
        twin = self._twin
        if result.success:
            twin.enabled = on
            self._rules.switched(one, on, now)
            twin.tell(one.detail or events.A_REQUEST)
            if on and served.status is not None and (reported := twin.reported) and (
                    excess := self._rules.settings.limits.excess(reported)):
                result = result._replace(
                    message=f'{result.message}; {", ".join(excess)}, and is brought back')
        else:
            self._note_failure(now)
        self._end(one, result, now)
        if self._report is not None and result.success:
            self._report(result, now)

    def _configured(self, served: Served[Status], now: float) -> None:
        one, result, change = served.request, served.result, served.change
        assert isinstance(change, Configure)
        if result.success:
            self._twin.agree(change.configuration, change.names, served.status)
        elif result.contradicted:
            self._twin.fail(result.message, change.configuration)
        if one.why in WEAK:
            self._rules.ended(one, change.names, result, now)
        else:
            self._end(one, result, now)

    def _end(self, one: Request, result: Result, now: float) -> None:
        """End a request; a call that has succeeded counts from now on."""
        self._requests.end(one, result, now)
        if one.is_call and result.success:
            self._rules.note_request(now)

    # Time

    def poll(self, now: float) -> None:
        """Go on with the commands that are due."""
        for prop in self.switch, self.configuration:
            self._serve(prop, prop.poll(now), now)

    def silence_due(self, now: float) -> float:
        """Return when ``off_after_silence`` switches the light off, infinity for never."""
        due = self._rules.silence_due
        return due if due < math.inf and self.may_go_off(now) else math.inf

    def due(self, now: float) -> float:
        """Return when a command, or the OFF of a silence, is due, s."""
        return min(self.switch.due, self.configuration.due, self.silence_due(now))
