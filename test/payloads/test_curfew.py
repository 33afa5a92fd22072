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

"""One more rule for lights, made outside the package: never on between two given times."""

from __future__ import annotations

from illuminator_ros.illuminator.commands import SWITCHES
from illuminator_ros.illuminator.events import AutomaticSwitch
from illuminator_ros.illuminator.light import Settings
from illuminator_ros.illuminator.light_switch import RULES, SwitchRule, SwitchState
from illuminator_ros.illuminator.model import Status
from illuminator_ros.payload.reconciler import Desired
from support.back_to_back import Pair, START
from support.fake_light import FakeLight

BEGIN, END = START + 10.0, START + 20.0


def curfew(begin: float, end: float) -> SwitchRule:
    """Return a rule that keeps a light off from one time to another, s."""
    def rule(state: SwitchState, now: float) -> Desired[Status] | None:
        if now >= end:
            return None
        return Desired(SWITCHES[False], 'curfew', since=begin)

    return rule


def test_a_light_goes_off_at_the_beginning_of_a_curfew_and_stays_off_until_its_end() -> None:
    light = FakeLight()
    pair = Pair(light, settings=Settings(switch_rules=(curfew(BEGIN, END), *RULES))).settle()
    assert pair.enable(True).success
    pair.run(BEGIN - pair.now + 0.1)
    assert light.fields['enable'] == 0
    assert [one.reason for one in pair.recorder.others
            if isinstance(one, AutomaticSwitch)] == ['curfew']

    assert pair.enable(True).message == 'curfew'
    assert pair.enable(False).success
    pair.run(END - pair.now)
    assert light.shone == [100.0]
    assert pair.enable(True).success
