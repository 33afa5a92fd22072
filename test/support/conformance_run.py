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

from illuminator_ros.illuminator.checks.bench import Bench
from illuminator_ros.illuminator.checks.requirement import Verdict
from illuminator_ros.illuminator.checks.suite import Suite
from illuminator_ros.illuminator.device_properties import DeviceProperties
from illuminator_ros.illuminator.devices import Devices
from illuminator_ros.illuminator.faults import with_fault
from illuminator_ros.mavlink.messages import Address
from support.virtual_link import START, VirtualLink

TESTER = Address(255, 190)
# s for which the lights have been on when a run begins.
UPTIME = 100.0


class Run:
    """A suite, a light, and the line between them."""

    def __init__(self, *lights: DeviceProperties, faults: tuple[str, ...] = (), **options):
        only = options.pop('only', ())
        first, *others = lights or [DeviceProperties()]
        for fault in faults:
            first = replace(first, behaviour=with_fault(first.behaviour, fault))
        self.lights = Devices([first, *others], START - UPTIME)
        self.light = self.lights.devices[0]
        self.bench = Bench(TESTER, checksum_errors=lambda: (
            self.link.decoders[0].counters.crc_errors), **options)
        self.suite = Suite(self.bench, only=only)
        self.link = VirtualLink(self.bench, self.lights)

    def fault(self, *names: str) -> None:
        """Switch faults on."""
        for name in names:
            self.light.behave(with_fault(self.light.behaviour, name), self.link.now)

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
