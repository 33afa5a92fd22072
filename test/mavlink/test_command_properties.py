# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Every command ends in exactly one outcome, and no success is invented."""

from __future__ import annotations

from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import initialize, invariant, rule, RuleBasedStateMachine
from illuminator_ros.mavlink.command_sender import CommandStatus
from illuminator_ros.mavlink.messages import Address
from support.command_rig import LIGHT, LONG, OURS, Rig, Run

COMPONENTS = st.sampled_from([LIGHT, Address(1, 244)])
COMMANDS = st.sampled_from([405, 406])
# Half of the results have a special meaning.
RESULTS = st.integers(0, 255) | st.sampled_from([0, 1, 5, 7, 8])
TIMES = st.floats(0, 4)


class CommandSenderMachine(RuleBasedStateMachine):
    """Commands, acknowledgements of all sorts, polls early and late, and lost links."""

    @initialize(timeout=st.sampled_from([0.1, 0.5, 2.0]), retries=st.integers(0, 4))
    def begin(self, timeout: float, retries: int) -> None:
        self.rig = Rig(timeout=timeout, retries=retries)
        self.deadlines: list[tuple[Run, float]] = []
        self.accepted = 0

    @rule(component=COMPONENTS, command=COMMANDS, limit=st.just(float('inf')) | st.floats(0, 5))
    def start(self, component: Address, command: int, limit: float) -> None:
        run = self.rig.start(command, component, limit=limit)
        self.deadlines.append((run, self.rig.now + limit))

    @rule(source=COMPONENTS, command=COMMANDS, result=RESULTS, progress=st.integers(0, 255),
          addressee=st.sampled_from([OURS, Address(0, 0), Address(9, 9)]))
    def acknowledge(self, source: Address, command: int, result: int, progress: int,
                    addressee: Address) -> None:
        self.accepted += result == 0 and addressee.system != 9
        self.rig.ack(result, command, source=source, progress=progress, target=addressee)

    @rule(seconds=TIMES)
    def time_passes_with_polls(self, seconds: float) -> None:
        self.rig.run(seconds)

    @rule(seconds=TIMES)
    def time_passes_and_the_poll_comes_late(self, seconds: float) -> None:
        self.rig.now += seconds
        self.rig.poll()

    @rule(component=st.none() | COMPONENTS)
    def link_is_lost(self, component: Address | None) -> None:
        self.rig.sender.end_all(self.rig.now, CommandStatus.LINK_LOST, component)

    @invariant()
    def each_command_has_at_most_one_outcome_with_its_tries_and_successes_are_acknowledged(
            self) -> None:
        ended = [run for run in self.rig.runs if run.outcomes]
        assert all(run.outcome.tries == len(run.frames) for run in ended)
        assert sum(run.outcome.accepted for run in ended) <= self.accepted
        assert len(self.rig.runs) - len(ended) == len(self.rig.sender) <= 4

    @invariant()
    def frames_are_sent_before_the_deadline_only(self) -> None:
        for run, deadline in self.deadlines:
            assert all(time < deadline for time, _ in run.frames)

    def teardown(self) -> None:
        self.rig.run(LONG)
        self.frames_are_sent_before_the_deadline_only()
        assert all(run.outcome for run in self.rig.runs)
        assert len(self.rig.sender) == 0


TestCommandSenderMachine = CommandSenderMachine.TestCase
TestCommandSenderMachine.settings = settings(max_examples=40, stateful_step_count=30)
