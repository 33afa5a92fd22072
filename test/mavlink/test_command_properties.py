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

"""Every command ends in exactly one outcome, and no success is invented."""

from __future__ import annotations

from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import initialize, invariant, rule, RuleBasedStateMachine
from illuminator_ros.mavlink.command_sender import CommandStatus, MAX_WAITING
from illuminator_ros.mavlink.messages import Address
from support.command_rig import LIGHT, LONG, Rig, Run

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

    @rule(component=COMPONENTS, command=COMMANDS, limit=st.just(float('inf')) | st.floats(0, 5),
          count=st.integers(1, 3), overtake=st.booleans())
    def start(self, component: Address, command: int, limit: float, count: int,
              overtake: bool) -> None:
        for _ in range(count):
            run = self.rig.start(command, component, limit=limit, overtake=overtake)
            self.deadlines.append((run, self.rig.now + limit))

    @rule(source=COMPONENTS, command=COMMANDS, result=RESULTS, progress=st.integers(0, 255),
          addressee=st.sampled_from([Address(1, 193), Address(0, 0), Address(9, 9)]))
    def acknowledge(self, source: Address, command: int, result: int, progress: int,
                    addressee: Address) -> None:
        self.rig.ack(result, command, source=source, progress=progress, target=addressee)

    @rule(seconds=TIMES)
    def time_passes_with_polls(self, seconds: float) -> None:
        self.rig.run(seconds)

    @rule(seconds=TIMES)
    def time_passes_and_the_poll_comes_late(self, seconds: float) -> None:
        self.rig.now += seconds
        self.rig.poll()

    @rule(component=st.none() | COMPONENTS,
          ending=st.sampled_from([CommandStatus.LINK_LOST, CommandStatus.CANCELLED]))
    def link_is_lost(self, component: Address | None, ending: CommandStatus) -> None:
        self.rig.sender.end_all(self.rig.now, ending, component)
        for run in self.rig.runs:
            assert run.outcomes or component not in (None, run.command.target)

    @invariant()
    def each_command_has_at_most_one_outcome_with_its_tries(self) -> None:
        for run in self.rig.runs:
            assert len(run.outcomes) <= 1
            assert not run.outcomes or run.outcome.tries == len(run.frames)

    @invariant()
    def frames_are_sent_before_the_deadline_only(self) -> None:
        for run, deadline in self.deadlines:
            assert all(time < deadline for time, _ in run.frames)

    @invariant()
    def commands_that_wait_are_bounded(self) -> None:
        waiting = [run for run in self.rig.runs if not run.outcomes and not run.frames]
        assert len(waiting) <= 4 * MAX_WAITING

    def teardown(self) -> None:
        self.rig.run(LONG * len(self.rig.runs) + LONG)
        assert all(len(run.outcomes) == 1 for run in self.rig.runs)
        assert self.rig.idle
        self.frames_are_sent_before_the_deadline_only()


TestCommandSenderMachine = CommandSenderMachine.TestCase
TestCommandSenderMachine.settings = settings(max_examples=80, stateful_step_count=30)
