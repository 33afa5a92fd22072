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

"""Runs of the conformance suite against simulated lights, on a virtual clock."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from illuminator_ros.illuminator.checks.bench import Bench
from illuminator_ros.illuminator.checks.requirement import Verdict
from illuminator_ros.illuminator.checks.suite import Suite
from illuminator_ros.illuminator.faults import FAULTS
from illuminator_ros.illuminator.simulated import simulated_lights
from illuminator_ros.illuminator.simulated_lamp import SimulatedLamp
from illuminator_ros.illuminator.simulated_properties import IlluminatorProperties
from illuminator_ros.mavlink.messages import Address, CommandLong, MavCmd, STATUS_ID
from support.virtual_link import START, VirtualLink

TESTER = Address(255, 190)
# s for which the lights have been on when a run begins.
UPTIME = 100.0


class Run:
    """A suite, a light, and the line between them."""

    def __init__(self, *lights: IlluminatorProperties, faults: tuple[str, ...] = (), **options):
        only = options.pop('only', ())
        first, *others = lights or [IlluminatorProperties()]
        for fault in faults:
            first = replace(first, behaviour=FAULTS.add(first.behaviour, fault))
        self.lights = simulated_lights([first, *others], START - UPTIME)
        self.light = self.lights.components[0]
        self.bench = Bench(TESTER, checksum_errors=lambda: (
            self.link.decoders[0].counters.crc_errors), **options)
        self.suite = Suite(self.bench, only=only)
        self.link = VirtualLink(self.bench, self.lights)

    @property
    def lamp(self) -> SimulatedLamp:
        """Return the state of the light."""
        return self.light.device.lamp

    def press(self, **changes: Any) -> None:
        """Switch or configure the light by hand."""
        now = self.link.now
        self.light.apply(self.light.device.press(now, **changes), now)

    def set_interval(self, seconds: float) -> None:
        """Set the interval of the light's status, as another sender; -1 stops the stream."""
        self.light.receive(Address(255, 1), CommandLong(
            *self.light.address, MavCmd.SET_MESSAGE_INTERVAL, 0, STATUS_ID,
            seconds if seconds < 0 else 1e6 * seconds, 0, 0, 0, 0, 0), self.link.now)

    def fault(self, *names: str) -> None:
        """Switch faults on."""
        for name in names:
            self.light.behave(FAULTS.add(self.light.behaviour, name), self.link.now)

    def finish(self) -> Run:
        """Let the suite run to its end."""
        self.link.run_until(lambda: not self.bench.running, within=3600.0)
        return self

    def names(self, verdict: Verdict) -> set[str]:
        """Return the names of the requirements with a verdict."""
        return {one.requirement.name for one in self.suite.results if one.verdict is verdict}

    @property
    def failed(self) -> set[str]:
        """Return the names of the requirements that the light does not meet."""
        return self.names(Verdict.FAIL)

    def result(self, name: str):
        """Return what became of a requirement."""
        (result,) = [one for one in self.suite.results if one.requirement.name == name]
        return result
